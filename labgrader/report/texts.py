"""Answers in words, question by question: one page with what all students wrote, saved as a person types points.

The page shows no names and no code: the rubric, then each answer with a place for points and a comment. They go into
nbgrader's gradebook, where formgrader shows and changes the same ones. `texts_server` serves it.
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path

from labgrader.grade.gradebook import opened, rubrics_of
from labgrader.handin.pictures import Pictures
from labgrader.handin.reading import Lab
from labgrader.program.cell import grade_id, plain_text, source_of
from labgrader.report.outputs import answer_key, head
from labgrader.report.rendered import rendered
from labgrader.support import counted

LONGEST_COMMENT = 5_000  # characters


@dataclass(frozen=True)
class Text:
    """One student's answer. key: what names it without the student; points: None if there are none yet.

    words: in Markdown that is harmless; pictures: base64 by kind, by name.
    """

    key: str
    student: str
    words: str
    points: float | None
    comment: str
    pictures: Pictures = field(default_factory=dict)


@dataclass(frozen=True)
class Texts:
    """The answers to a question, in an order that tells nothing.

    most: what an answer may earn; empty: how many wrote nothing.
    """

    question: str
    most: float
    rubric: str
    answers: tuple[Text, ...]
    empty: int


def read_texts(course: Path, lab: Lab) -> dict[str, Texts]:
    """The answers in words of a lab by question, as the gradebook and the copies for formgrader have them.

    Raises ValueError for a lab without such questions, and for one that was not graded yet.
    """
    course, rubrics, found = Path(course), rubrics_of(course, lab), {}
    if not lab.written:
        raise ValueError(f"topic: expected a lab with answers in words, {lab.topic} has none")
    if not (course / "gradebook.db").is_file():
        raise ValueError(f"topic: expected a lab that was graded, there is no gradebook.db in {course}")
    with opened(course) as gradebook:
        for question in lab.written:
            grades = [
                (submission.student.id, gradebook.find_grade(question, lab.topic, lab.topic, submission.student.id))
                for submission in gradebook.assignment_submissions(lab.topic)
            ]
            texts = []
            for student, grade in grades:
                comment = gradebook.find_comment(question, lab.topic, lab.topic, student)
                is_empty = comment.auto_comment == "No response." and grade.manual_score is None
                if not is_empty and (found_there := words_of(course, lab, student, question)) is not None:
                    (words, pictures), said = found_there, comment.manual_comment or ""
                    key = answer_key(student, lab, question)
                    texts.append(Text(key, student, words, grade.manual_score, said, pictures))
            texts.sort(key=lambda text: text.key[-8:])
            most = next((grade.max_score for _, grade in grades), 0.0)
            rubric = rubrics.get(question, "")
            found[question] = Texts(question, most, rubric, tuple(texts), len(grades) - len(texts))
    return found


def words_of(course: Path, lab: Lab, student: str, question: str) -> tuple[str, Pictures] | None:
    """What a student wrote, with pictures, from the copy that grading made for formgrader; None if there is none."""
    path = course / "autograded" / student / lab.topic / f"{lab.topic}.ipynb"
    if not path.is_file():
        return None
    cells = json.loads(path.read_bytes())["cells"]
    found = ((source_of(cell) or "", cell.get("attachments", {})) for cell in cells if grade_id(cell) == question)
    return next(found, None)


def save(course: Path, lab: Lab, question: str, data: Mapping[str, object]) -> int:
    """Keep points and comment of one answer in the gradebook; returns how many answers to the question have none yet.

    data: key, points (None to take them back) and comment. Raises ValueError for what is none of these.
    """
    texts = read_texts(course, lab)[question]
    key, points, comment = data.get("key"), data.get("points"), data.get("comment")
    student = next((text.student for text in texts.answers if text.key == key), None)
    if student is None or not isinstance(comment, str) or len(comment) > LONGEST_COMMENT:
        raise ValueError(f"expected the key of an answer, and a comment of at most {LONGEST_COMMENT} characters")
    is_number = isinstance(points, int | float) and not isinstance(points, bool) and math.isfinite(points)
    if points is not None and not (is_number and 0 <= points <= texts.most):
        raise ValueError(f"expected points from 0 to {texts.most:g}")
    with opened(course) as gradebook:
        grade = gradebook.find_grade(question, lab.topic, lab.topic, student)
        grade.manual_score = None if points is None else float(points)
        grade.needs_manual_grade = grade.manual_score is None and grade.auto_score is None  # as formgrader does
        gradebook.find_comment(question, lab.topic, lab.topic, student).manual_comment = plain_text(comment) or None
        gradebook.db.commit()
    return sum(text.points is None and text.key != key for text in texts.answers) + (points is None)


# ------------------------------------------------------------------------------------------------------ the page

PAGE_STYLE = """body{max-width:90rem}nav a{margin-right:1rem}.words pre,.rubric pre{white-space:pre-wrap}
.words img{max-width:100%}
.two{display:grid;grid-template-columns:minmax(16rem,1fr) 2fr;gap:1.5rem;align-items:start}
article{border-left:5px solid var(--look);padding:.2rem 1rem;margin:1rem 0}article.done{border-color:var(--right)}
article:focus{outline:3px solid var(--bar)}.rubric{position:sticky;top:0;background:var(--rubric);padding:.5rem 1rem;
max-height:100vh;box-sizing:border-box;overflow:auto}@media(max-width:60rem){.two{display:block}
.rubric{position:static;max-height:none}}input{width:5rem;font:inherit}textarea{width:100%;font:inherit}
label{display:block}.status{color:var(--soft);margin-left:1rem}.failed{color:var(--failed);font-weight:bold}
kbd{border:1px solid #999;border-radius:3px;padding:0 .3rem}"""

PICTURES, MATHJAX_FILES = "pictures", "mathjax"  # places below the secret of the address, beside the questions
MATHJAX = f"{MATHJAX_FILES}/MathJax.js?config=TeX-AMS-MML_HTMLorMML-full"
SCRIPT = """
window.MathJax = {
  extensions: ["Safe.js"], showMathMenu: false, messageStyle: "none", jax: ["input/TeX", "output/HTML-CSS"],
  "HTML-CSS": {availableFonts: [], preferredFont: null, webFont: "STIX-Web", imageFont: null},
  tex2jax: {inlineMath: [["$", "$"], ["\\\\(", "\\\\)"]], processEscapes: true}
};
const articles = [...document.querySelectorAll("article")];
const timers = new Map();
async function save(article) {
  const status = article.querySelector(".status"), points = article.querySelector("input");
  const comment = article.querySelector("textarea"), value = points.value.trim().replace(",", ".");
  status.className = "status"; status.textContent = "saving";
  try {
    const body = JSON.stringify({key: article.id, points: value === "" ? null : Number(value), comment: comment.value});
    const reply = await fetch(location.pathname, {method: "POST", headers: {"Content-Type": "application/json"}, body});
    const text = await reply.text();
    if (!reply.ok) throw new Error(text);
    status.textContent = "saved"; article.classList.toggle("done", value !== "");
    document.getElementById("left").textContent = text;
  } catch (error) { status.className = "status failed"; status.textContent = "NOT saved: " + error.message; }
}
function later(article) {
  clearTimeout(timers.get(article)); timers.set(article, setTimeout(() => save(article), 400));
}
function move(article, step) { articles[articles.indexOf(article) + step]?.focus(); }
for (const article of articles) {
  const points = article.querySelector("input"), comment = article.querySelector("textarea");
  points.addEventListener("input", () => later(article));
  comment.addEventListener("input", () => later(article));
  article.addEventListener("keydown", event => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    if (event.target !== article) { if (event.key === "Escape") article.focus(); return; }
    const most = Number(points.max), now = Number(points.value || 0);
    if (/^[0-9]$/.test(event.key) && Number(event.key) <= most) { points.value = event.key; save(article); }
    else if (event.key === "h" && now + 0.5 <= most) { points.value = now + 0.5; save(article); }
    else if (event.key === "Backspace") { points.value = ""; save(article); }
    else if (event.key === "j") move(article, 1);
    else if (event.key === "k") move(article, -1);
    else if (event.key === "c") comment.focus();
    else return;
    event.preventDefault();
  });
}
articles.find(article => !article.classList.contains("done"))?.focus();
"""
KEYS = (
    "<kbd>0</kbd> to <kbd>9</kbd> points, <kbd>h</kbd> half a point more, <kbd>Backspace</kbd> none, "
    "<kbd>j</kbd> and <kbd>k</kbd> next and previous answer, <kbd>c</kbd> comment, <kbd>Esc</kbd> back to the answer"
)


def texts_page(lab: Lab, texts: Texts, questions: Sequence[str], nonce: str) -> str:
    """The page of a question. nonce: what tells the page's own script from others."""
    title = escape(f"{lab.topic}: {texts.question}")
    left = sum(text.points is None for text in texts.answers)
    links = "".join(f'<a href="{escape(name)}">{escape(name)}</a>' for name in questions)
    count = f'{counted(len(texts.answers), "answer")}, <span id="left" role="status">{left}</span> without points'
    empty = f"; {counted(texts.empty, 'student')} wrote nothing" if texts.empty else ""
    rubric = (
        f'<div class="rubric" tabindex="0" role="region" aria-label="rubric">{rendered(texts.rubric)}</div>'
        if texts.rubric
        else ""
    )
    articles = "\n".join(article(text, texts.most, i) for i, text in enumerate(texts.answers, start=1))
    return (
        f"{head(title, PAGE_STYLE)}<h1>{title}</h1><nav>{links}</nav>\n"
        f"<p>{count}{empty}. What you type is saved at once.</p><p>{KEYS}</p>\n"
        f'<div class="{"two" if rubric else ""}">{rubric}\n<div>{articles}</div></div>\n'
        f'</main><script nonce="{nonce}">{SCRIPT}</script>\n'
        f'<script nonce="{nonce}" src="{MATHJAX}"></script>\n</body></html>\n'
    )


def article(text: Text, most: float, number: int) -> str:
    """One answer, with a place for points and a comment."""
    points = "" if text.points is None else f"{text.points:g}"
    words = rendered(text.words, text.pictures, f"{PICTURES}/{text.key}")
    kind = "" if text.points is None else ' class="done"'
    return (
        f'<article id="{escape(text.key)}" tabindex="0" aria-label="answer {number}"{kind}>'
        f'<div class="words">{words}</div><label>Points of {most:g} <input type="number" min="0" '
        f'max="{most:g}" step="any" value="{points}"><span class="status" role="status"></span></label>'
        f'<label>Comment <textarea rows="2" maxlength="{LONGEST_COMMENT}">\n{escape(text.comment)}</textarea></label>'
        "</article>"
    )
