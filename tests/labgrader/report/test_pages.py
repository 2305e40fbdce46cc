"""What students wrote on the instructor's pages: formgrader and nbgrader's feedback show it, and none of it runs."""

import os
import re
import shutil
import subprocess
import sys
import time
from html import unescape
from html.parser import HTMLParser
from pathlib import Path

import grading_course as kit
import pytest
import serving
from attacks.payloads import PAYLOADS, RUN
from nbconvert.filters import markdown2html

from labgrader.grade import gradebook
from labgrader.grade.markdown import harmless_markdown
from labgrader.grade.nbgrader_plugins import SAYS
from labgrader.grade_course import grade_course

ROOT = Path(__file__).parents[3]
TOPIC = "04_iou"
SOLUTION = "A model.\n\n**Rubric (3 points).**\n\n- 3 points: one for the union, two for the rest."


class Tags(HTMLParser):
    """The tags of a page with their attributes."""

    def __init__(self, page: str):
        super().__init__()
        self.found: list[tuple[str, dict]] = []
        self.feed(page)

    def handle_starttag(self, tag, attributes):
        self.found.append((tag, dict(attributes)))


PLAIN = {"p", "em", "strong", "code", "pre", "ul", "ol", "li", "h1", "h2", "h3", "blockquote", "br", "hr", "del"}
PLAIN |= {"table", "thead", "tbody", "tr", "th", "td", "div", "span"}


# What a list of tasks, "- [x]", has.
BOX = {"class": "task-list-item-checkbox", "type": "checkbox", "disabled": None, "checked": None}


@pytest.mark.parametrize("payload", PAYLOADS)
def test_no_tag_of_a_students_is_left(payload):
    for text in (payload, f"Because.\n\n{payload}\n", f"- {payload}", f"> {payload}", payload.replace("\n", "\r\n")):
        for tag, attributes in Tags(markdown2html(harmless_markdown(text))).found:
            if attributes == BOX:
                continue
            assert tag in PLAIN and attributes.keys() <= {"class", "style"}, (tag, attributes)
            assert "expression" not in attributes.get("style", "") and "url" not in attributes.get("style", "")


@pytest.mark.parametrize("payload", [PAYLOADS[1], PAYLOADS[6], PAYLOADS[10]])
def test_without_that_they_are(payload):
    found = Tags(markdown2html(payload)).found
    assert any(tag not in PLAIN or attributes.keys() & {"href", "src", "onerror"} for tag, attributes in found)


@pytest.mark.parametrize("command", ["href", "url", "require", "def", "newcommand", "class", "style", "unicode"])
def test_commands_of_formulas_that_reach_beyond_them_are_taken_apart(command):
    assert f"\\{command}" not in harmless_markdown(f"$\\{command}{{javascript:{RUN}}}{{x}}$")


def test_formulas_and_emphasis_stay():
    text = "**1.** $e^{-E(y)} = \\prod_p a_p < 1$, $$\\begin{bmatrix} 1 & 2 \\\\ 3 & 4 \\end{bmatrix}$$\n- `a[i] = b`"
    assert harmless_markdown(text) == text
    assert harmless_markdown("if a<b, 2<3") == "if a< b, 2<3"


# ------------------------------------------------------------------------------------------- in a real browser


@pytest.fixture(scope="module")
def course(tmp_path_factory):
    """Two students with every payload in words, in a string, in a message and in a comment; one is left as it is."""
    course = tmp_path_factory.mktemp("course")
    shutil.copy(ROOT / "nbgrader_config.py", course)
    kit.write_lab(course, TOPIC)
    kit.write(course / "solutions" / TOPIC / f"{TOPIC}.ipynb", kit.notebook([kit.written_cell(SOLUTION)]))
    (course / "roster.csv").write_text("id,name\neve,Eve Adams\n")
    message = "; ".join(PAYLOADS)
    cells = {
        "iou": f"def iou(n):\n    raise ValueError({message[:150]!r})\n",
        "mean_iou": f"def mean_iou(n):\n    x = {message!r}\n    return x.{RUN.split('=', maxsplit=1)[0]}\n",
    }
    notebook = kit.lab_notebook(TOPIC, kit.right_answers(TOPIC) | cells)
    notebook["cells"][-1]["source"] = "\n\n".join([*PAYLOADS, "So $\\frac{a}{b}$."])
    for student in ("eve", "raw"):
        kit.submit(course, student, TOPIC, notebook)
    graded = grade_course(TOPIC, course, seed="secret", progress=False)
    assert not graded.failures
    notebook["cells"][-1]["source"] = "\n\n".join(PAYLOADS[:2])  # as nbgrader's own autograder would have copied it
    kit.write(course / "autograded/raw" / TOPIC / f"{TOPIC}.ipynb", notebook)
    run = [sys.executable, "-m", "nbgrader", "generate_feedback", TOPIC]
    environment = os.environ | {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    done = subprocess.run(run, cwd=course, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
    return course


def visit(page, address: str) -> tuple[bool, list[str]]:
    """Whether a page of ours lets a payload run, and what it asks others for."""
    asked = []
    page.on("request", lambda request: asked.append(request.url))
    page.goto(address)
    page.wait_for_load_state("load")
    page.wait_for_timeout(1000)
    return page.evaluate("window.attacked === 1"), [url for url in asked if "127.0.0.1:9" in url]


@pytest.mark.debian("chromium")
def test_nothing_that_a_student_wrote_runs_in_formgrader(course, page, tmp_path):
    with gradebook.opened(course) as book:
        ids = {s: book.find_submission_notebook(TOPIC, TOPIC, s).id for s in ("eve", "raw")}
    with serving.jupyterlab(course, tmp_path / "jupyter") as url:
        page.set_extra_http_headers(
            {"Authorization": f"token {serving.TOKEN}"}
        )  # what pages ask for later needs it, too
        page.route(lambda asked: not asked.startswith(url), lambda route: route.abort())  # no other network
        attacked, asked = visit(page, f"{url}/formgrader/submissions/{ids['eve']}/?index=0")
        page.wait_for_selector(".MathJax .mfrac, .MathJax_SVG", timeout=20000)
        assert page.locator("#check_iou").count() == 1 and page.locator("text=onerror").count() > 0
        assert not attacked and not asked
        assert page.locator("text=one for the union").count() == 1 and page.locator("text=A model").count() == 0
        assert page.locator(".name-shown", has_text="Adams, Eve").count() > 0
        for table in ("gradebook/04_iou/04_iou", "manage_students", "manage_submissions/04_iou"):
            assert visit(page, f"{url}/formgrader/{table}") == (False, [])
            page.wait_for_selector("tbody tr:has-text('Adams, Eve'), tbody tr:has-text('Submission #')")
        page.locator("tr", has_text="Adams, Eve").locator(".autograde a").click()  # the bolt
        page.wait_for_selector(f".modal :text({SAYS.partition(';')[0]!r})")
        visit(page, f"{url}/formgrader/submissions/{ids['raw']}/?index=0")
        page.wait_for_function("window.attacked === 1")  # so this test can fail


@pytest.mark.debian("chromium")
def test_nothing_that_a_student_wrote_runs_in_the_feedback(course, page):
    page.on("dialog", lambda dialog: dialog.dismiss())
    feedback = course / "feedback/eve" / TOPIC / f"{TOPIC}.html"
    assert "one for the union" not in feedback.read_text()
    assert visit(page, feedback.as_uri()) == (False, []) and page.locator("text=Comments").count() > 0
    visit(page, (course / "feedback/raw" / TOPIC / f"{TOPIC}.html").as_uri())
    page.wait_for_function("window.attacked === 1")  # so this test can fail
    for ours in ((course / "grades" / TOPIC / "feedback/eve.html"), (course / "grades" / TOPIC / "class.html")):
        assert visit(page, ours.as_uri()) == (False, [])


@pytest.mark.parametrize(
    "text", ["&#36;&#92;href{x}{y}&#36;", "\\h&#x72;ef", "&bsol;href{x}{y}", "&dollar;", "&\x00#36;"]
)
def test_entities_are_shown_and_make_no_characters(text):
    """What a browser makes of the page is what was typed: no dollar, backslash or letter comes out of an entity."""
    shown = unescape(re.sub("<[^>]*>", "", markdown2html(harmless_markdown(text)))).strip()
    assert shown == text.replace("\x00", "")


@pytest.mark.parametrize("text", [" " * 160_000 + "x", " \t" * 80_000, "[" * 160_000, "a[" * 80_000, "`a``b" * 30_000])
def test_no_length_makes_the_page_slow(text):
    """160,000 spaces took nbconvert 48 seconds."""
    before = time.process_time()
    markdown2html(harmless_markdown(text))
    assert time.process_time() - before < 5.0


def test_a_long_answer_is_cut_and_says_so():
    text = harmless_markdown("word " * 30_000)
    assert len(text) < 20_100 and text.endswith("(Cut here: 150,000 characters, of which 20,000 are shown.)")
