"""Write an exam: a page to print per version, and one key for whoever corrects."""

from collections.abc import Collection, Mapping, Sequence
from fractions import Fraction
from html import escape
from pathlib import Path

from labcourse.exam.draw import choose, draw
from labcourse.exam.paper import Paper, PaperQuestion, shown
from labkit.support.files import write_atomically

MOST_VERSIONS = 3  # some questions draw a number of which there are only three or four

STYLE = """
@page { size: A4; margin: 18mm 20mm }
body { font: 11.5pt/1.45 Georgia, "DejaVu Serif", serif; color: #000; background: #fff }
body { max-width: 170mm; margin: 8mm auto }
h1 { font-size: 17pt; margin: 0 } h2 { font-size: 12pt; margin: 9mm 0 1mm; break-after: avoid }
h2 { display: flex; justify-content: space-between; gap: 6mm }
h2 span { font-weight: normal; white-space: nowrap } p { margin: 2mm 0 }
.question, dl, li { break-inside: avoid } h3, .how { break-after: avoid }
.head { display: grid; grid-template-columns: 1fr 1fr auto; gap: 5mm; margin: 4mm 0; align-items: end }
.head div { border-bottom: .3mm solid } .head .total { border: .3mm solid; padding: 9mm 3mm 2mm 16mm; grid-area: 1/3/3 }
table { border-collapse: collapse; margin: 2mm 6mm 2mm 0; font-size: 11pt; display: inline-table }
table { vertical-align: middle }
td, th { border: .2mm solid #555; padding: .7mm 2.4mm; text-align: center; min-width: 6mm }
th { font-weight: normal; background: #eee }
.fill td { min-width: 13mm; height: 7mm } caption { font-style: italic; text-align: left } b { font-weight: normal }
sup, sub { line-height: 0 }
dl { display: grid; grid-template-columns: max-content 1fr; gap: 1mm 4mm; margin: 1mm 0 }
dt, dd { margin: 0 } dt { font-style: italic }
dd span { float: right; color: #333 } .how { color: #333 } ul { margin: 1mm 0; padding-left: 5mm }
"""
ROOM_MM = 9  # of paper for each minute that a question takes
AIDS = "pen and paper; no calculator is needed"
RULES = (
    "Not for students. Points are shown beside each answer; each of its values earns an equal part. A listed mistake "
    "costs 1 point, an arithmetic slip ½, and neither costs more than the answer is worth. What follows correctly from "
    "a wrong value loses nothing more."
)


def exam(
    topics: Sequence[str],
    minutes: int,
    seed: int,
    versions: int,
    without: Collection[str] = (),
    course: str = "",
    aids: str = "",
) -> dict[str, str]:
    """The pages of an exam by their names: exam_A.html, exam_B.html, ... and key.html.

    without: names of questions that are not asked. aids: AIDS if left out. Raises ValueError as `choose` does, or for
    more versions than there are numbers.
    """
    if not 1 <= versions <= MOST_VERSIONS:
        raise ValueError(f"versions: expected 1 to {MOST_VERSIONS}, got {versions}; draw more with another seed")
    questions = choose(topics, minutes, seed, without)
    papers = [draw(question, seed, versions) for question in questions]
    letters = "ABC"[:versions]
    pages = {
        f"exam_{letter}.html": exam_page(questions, [drawn[i] for drawn in papers], letter, minutes, course, aids)
        for i, letter in enumerate(letters)
    }
    return pages | {"key.html": key_page(questions, papers, letters, seed)}


def write(out: Path, pages: Mapping[str, str], overwrite: bool = False) -> list[Path]:
    """Write the pages of an exam into a folder, and return their paths.

    overwrite: remove another exam's pages from the folder; without it they raise ValueError: they would lie beside a
    key that is not theirs.
    """
    contents = {out / name: text.encode() for name, text in pages.items()}
    there = [*sorted(out.glob("exam_*.html")), *out.glob("key.html")]
    others = [path for path in there if path.read_bytes() != contents.get(path)]
    if others and not overwrite:
        names = ", ".join(path.name for path in others)
        raise ValueError(f"out: expected a folder without another exam, {out} has {names}; --overwrite removes it")
    for path in others:
        path.unlink()
    for path, data in contents.items():
        write_atomically(path, data)
    return list(contents)


def page(title: str, body: str) -> str:
    """Wrap a page."""
    head = f'<meta charset="utf-8"><title>{title}</title><style>{STYLE}</style>'
    return f'<!DOCTYPE html>\n<html lang="en"><head>{head}</head><body>\n{body}\n</body></html>\n'


def exam_page(
    questions: Sequence[PaperQuestion], papers: Sequence[Paper], letter: str, minutes: int, course: str, aids: str
) -> str:
    """What students get of a version; it does not say the seed, from which the key could be made."""
    points, answering = sum(q.points for q in questions), sum(q.minutes for q in questions)
    lines = (f"Course: {escape(course)}", "Date", "Name", "Matriculation number")
    parts = [
        f"<h1>Exam, version {letter}</h1>",
        f'<div class="head">{"".join(f"<div>{line}</div>" for line in lines)}',
        f'<div class="total">of {points}</div></div>',
        f"<p>{len(questions)} questions, {points} points, {minutes} minutes: {answering} for the questions, the rest "
        f"for reading. Allowed: {escape(aids or AIDS)}. You may leave fractions and roots as they are. Show your "
        "working: a correct method earns points even if the number is wrong. Rows and columns, pixels and classes are "
        "counted from 0.</p>",
    ]
    for number, (question, paper) in enumerate(zip(questions, papers, strict=True), 1):
        worth = f"<span>{count(question.points)}, {question.minutes} min</span>"
        parts.append(
            f'<section class="question"><h2>{number}. {question.about} {worth}</h2>\n'
            f'{paper.text}\n<div style="height:{ROOM_MM * question.minutes}mm"></div></section>'
        )
    return page(f"Exam, version {letter}", "\n".join(parts))


def key_page(questions: Sequence[PaperQuestion], papers: Sequence[Sequence[Paper]], letters: str, seed: int) -> str:
    """The key of all versions, question by question, with the mistakes that wrong values tell."""
    parts = [f"<h1>Key, seed {seed}</h1><p>{sum(q.points for q in questions)} points. {RULES}</p>"]
    for number, (question, drawn) in enumerate(zip(questions, papers, strict=True), 1):
        title = f"{number}. {question.about}<span>{question.topic}, {question.name}, {count(question.points)}</span>"
        versions, ways = [], {paper.how for paper in drawn}
        for letter, paper in zip(letters, drawn, strict=True):
            answer = "".join(
                f"<dt>{name}</dt><dd><span>{count(worth)}</span>{shown(paper.answer[name])}</dd>"
                for name, worth in paper.worth(question.points).items()
            )
            told = "".join(f"<li>{mistake_in_words(what, value)}</li>" for what, value in paper.mistakes.items())
            versions.append(
                f"<h3>{letter}</h3><dl>{answer}</dl>"
                + (f'<p class="how">{paper.how}</p>' if len(ways) > 1 else "")
                + (f"<ul>{told}</ul>" if told else "")
            )
        for_all = f'<p class="how">{drawn[0].how}</p>' if len(ways) == 1 else ""
        parts.append(f"<section><h2>{title}</h2>\n{for_all}{''.join(versions)}</section>")
    return page("Key", "\n".join(parts))


def mistake_in_words(what: str, value) -> str:
    """Say which mistake a wrong value tells.

    >>> mistake_in_words("forgot the constant", {"constant": 0})
    'constant 0: forgot the constant'
    """
    if isinstance(value, dict):
        (name, wrong), *_ = value.items()
        return f"{name} {shown(wrong)}: {what}"
    return f"{shown(value)}: {what}"


def count(points: int | Fraction) -> str:
    """Say how many points, in halves.

    >>> count(1), count(3), count(Fraction(1, 2)), count(Fraction(5, 2))
    ('1 point', '3 points', '½ point', '2½ points')
    """
    return f"{int(points) or ''}{'½' * (points % 1 > 0)} point" + "s" * (points > 1)
