"""Answers in words: one page per question, without names and code, saved into nbgrader's gradebook as one types."""

import base64
import json
import re
import threading
import urllib.error
import urllib.request
from pathlib import Path

import grading_course as kit
import pytest
from attacks.payloads import PAYLOADS, RUN

from labgrader.grade.batch import Record
from labgrader.grade.gradebook import opened, write_gradebook
from labgrader.grade_course import private
from labgrader.handin.reading import read_lab, read_submissions
from labgrader.report.texts import read_texts, save
from labgrader.report.texts_server import TextsServer

TOPIC = "04_iou"
WORDS = {"Ada Lovelace_77": "Because of $\\frac{a}{b}$.", "ben": "\n\n".join(PAYLOADS), "cleo": "*Your answer.*"}
RUBRIC = "**Rubric (3 points).**\n\n- 1 point: union </div><script>window.attacked=1</script>"


@pytest.fixture
def course(tmp_path):
    """Three students, of whom one wrote nothing; no answer is run for it."""
    kit.write_lab(tmp_path, TOPIC)
    kit.write(tmp_path / "solutions" / TOPIC / f"{TOPIC}.ipynb", kit.notebook([kit.written_cell(f"A.\n\n{RUBRIC}")]))
    for student, words in WORDS.items():
        notebook = kit.lab_notebook(TOPIC, {"iou": "SECRET_CODE = 1"})
        notebook["cells"][-1]["source"] = words
        kit.submit(tmp_path, student, TOPIC, notebook)
    lab = read_lab(tmp_path, TOPIC)
    read = read_submissions(tmp_path / "submitted", lab)
    records = [Record(one.student, "", (), True, one.digest, "key") for one in read]
    assert not write_gradebook(tmp_path, lab, zip(records, read, strict=True), {}, {})
    return tmp_path


@pytest.fixture
def server(course):
    with private(), TextsServer(course, read_lab(course, TOPIC)) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True)
        thread.start()
        yield server
        server.shutdown()


def kept(course: Path, student: str) -> tuple[float | None, bool, str | None]:
    """What the gradebook has of a student's words."""
    with opened(course) as book:
        grade = book.find_grade("explain", TOPIC, TOPIC, student)
        comment = book.find_comment("explain", TOPIC, TOPIC, student).manual_comment
        return grade.manual_score, bool(grade.needs_manual_grade), comment


def key(course: Path, student: str) -> str:
    texts = read_texts(course, read_lab(course, TOPIC))["explain"]
    return next(text.key for text in texts.answers if text.student == student)


def ask(url: str, data: object = None, **headers: str) -> tuple[int, str]:
    """The status and the text of a reply; data: what is posted."""
    body = None if data is None else json.dumps(data).encode()
    try:
        with urllib.request.urlopen(urllib.request.Request(url, body, headers), timeout=20) as reply:
            return reply.status, reply.read().decode()
    except urllib.error.HTTPError as error:
        return error.code, error.read().decode()


def test_points_and_comments_are_what_formgrader_would_have_kept(course):
    lab, ada = read_lab(course, TOPIC), "Ada Lovelace_77"
    assert kept(course, ada) == (None, True, None)
    assert save(course, lab, "explain", {"key": key(course, ada), "points": 2.5, "comment": "Nearly."}) == 1
    assert kept(course, ada) == (2.5, False, "Nearly.")
    assert save(course, lab, "explain", {"key": key(course, ada), "points": None, "comment": ""}) == 2
    assert kept(course, ada) == (None, True, None)
    texts = read_texts(course, lab)["explain"]
    assert (texts.most, texts.empty, len(texts.answers)) == (3.0, 1, 2)


@pytest.mark.bad_input
@pytest.mark.parametrize(
    "points, comment", [(3.5, ""), (-1, ""), (float("nan"), ""), ("2", ""), (True, ""), (1, None), (1, "x" * 5001)]
)
def test_what_is_no_points_or_comment_is_refused(course, points, comment):
    data = {"key": key(course, "ben"), "points": points, "comment": comment}
    with pytest.raises(ValueError, match="expected"):
        save(course, read_lab(course, TOPIC), "explain", data)
    assert kept(course, "ben") == (None, True, None)


def test_the_page_has_no_names_and_no_code_and_others_can_neither_read_nor_save(course, server):
    status, page = ask(server.url)
    assert status == 200 and page.count("<article") == 2 and "Because of" in page and "1 point: union" in page
    assert not any(word in page for word in ("Ada", "Lovelace", "77", "ben", "cleo", "SECRET_CODE"))
    address, data = f"http://{server.host}", {"key": key(course, "ben"), "points": 1, "comment": ""}
    assert ask(f"{address}/explain")[0] == ask(f"{address}/wrong/explain")[0] == ask(f"{address}/")[0] == 404
    assert ask(server.url, Host="attacker.example")[0] == 404
    assert ask(server.url, data)[0] == ask(server.url, data, Origin="http://attacker.example")[0] == 403
    assert kept(course, "ben") == (None, True, None)
    assert ask(server.url, data, Origin=address) == (200, "1") and kept(course, "ben")[0] == 1.0
    assert ask(server.url, ["x"], Origin=address)[0] == 400


PICTURE = base64.b64encode(b"\x89PNG\r\n\x1a\n" + bytes(30)).decode()


def with_pictures(course: Path, words: str, attached: dict) -> str:
    """A student's cell as the page has it; the key of the answer."""
    notebook = kit.lab_notebook(TOPIC, {})
    notebook["cells"][-1] |= {"source": words, "attachments": attached}
    kit.submit(course, "dan", TOPIC, notebook)
    lab = read_lab(course, TOPIC)
    read = [one for one in read_submissions(course / "submitted", lab) if one.student == "dan"]
    write_gradebook(course, lab, [(Record("dan", "", (), True, read[0].digest, "key"), read[0])], {}, {})
    return key(course, "dan")


def test_markdown_and_attached_pictures_are_shown_and_no_address_is(course, server):
    attached = {
        "a photo.png": {"image/png": PICTURE},
        "b.svg": {"image/svg+xml": PICTURE},
        "c.png": {"image/png": "PHN2Zz4="},
    }
    attached |= {"lost.jpg": {"image/jpeg": base64.b64encode(b"\xff\xd8\xff" + bytes(30)).decode()}}
    words = "# Why\n\n**union** of ![it](attachment:a%20photo.png) ![](attachment:b.svg) ![x](http://evil.org/x.png)"
    name = with_pictures(course, words, attached)
    page = ask(server.url)[1]
    mine = page[page.index(f'id="{name}"') :].partition("</article>")[0]
    assert "<strong>Why</strong>" in mine and "<strong>union</strong>" in mine and "http://" not in mine
    sources = re.findall('<img src="([^"]*)"', mine)
    assert sources == [f"pictures/{name}/picture-1.png", f"pictures/{name}/picture-2.jpeg"]  # an unused one ends it
    folder = server.url.rpartition("/")[0]
    with urllib.request.urlopen(f"{folder}/{sources[0]}", timeout=20) as reply:
        assert reply.headers["Content-Type"] == "image/png" and reply.read() == base64.b64decode(PICTURE)
    copy = json.loads((course / f"autograded/dan/{TOPIC}/{TOPIC}.ipynb").read_bytes())["cells"][-1]
    assert copy["attachments"].keys() == {"picture-1.png", "picture-2.jpeg"}  # formgrader shows them, too


@pytest.mark.bad_input
def test_nothing_but_mathjax_and_pictures_is_served_and_a_port_in_use_is_named(course, server):
    folder = server.url.rpartition("/")[0]
    assert ask(f"{folder}/mathjax/MathJax.js?config=x")[0] == 200
    for path in ("mathjax/../__init__.py", "mathjax/", "mathjax", "pictures/a/b", "pictures", "mathjax//etc/passwd"):
        assert ask(f"{folder}/{path}")[0] == 404, path
    port = server.server_address[1]
    with pytest.raises(ValueError, match=f"port: {port} is in use by another program; choose another one"):
        TextsServer(course, server.lab, port)


def errors(page) -> list[str]:
    """The errors of a page, without the empty font that MathJax asks for and is refused."""
    return [error for error in page.errors if "about:blank" not in error]


@pytest.mark.debian("chromium")
def test_formulas_are_typeset_here_and_the_rubric_covers_no_answer(course, server, page):
    asked = []
    page.on("request", lambda request: asked.append(request.url))
    for width in (1280, 420):
        page.set_viewport_size({"width": width, "height": 600})
        page.goto(server.url)
        page.wait_for_selector(".words .MathJax .math")
        boxes = page.locator("article").evaluate_all("all => all.map(one => one.getBoundingClientRect().toJSON())")
        rubric = page.locator(".rubric").evaluate("one => one.getBoundingClientRect().toJSON()")
        for box in boxes:
            assert rubric["right"] <= box["left"] or rubric["bottom"] <= box["top"]
        page.mouse.wheel(0, 3000)
        article = page.locator("article").last
        article.scroll_into_view_if_needed()
        assert article.evaluate(
            "one => { const at = one.getBoundingClientRect(); const y = Math.max(at.top, 0) + 5;"
            " return one.contains(document.elementFromPoint(at.left + 20, y)); }"
        )
    assert asked and all(url.startswith((f"http://{server.host}/", "about:")) for url in asked)
    assert not errors(page)


@pytest.mark.debian("chromium")
def test_a_person_grades_with_the_keyboard_alone_and_nothing_of_a_students_runs(course, server, page):
    page.goto(server.url)
    first = page.locator("article:focus")
    assert first.count() == 1
    page.keyboard.press("2")
    page.keyboard.press("h")
    page.wait_for_selector("#left:text-is('1')")
    page.keyboard.press("j")
    page.keyboard.press("c")
    page.keyboard.type("See 3")
    page.keyboard.press("Escape")
    page.keyboard.press("1")
    page.wait_for_selector("#left:text-is('0')")
    page.wait_for_timeout(1000)  # a comment that is typed is saved a little later
    assert {kept(course, student)[0] for student in ("Ada Lovelace_77", "ben")} == {2.5, 1.0}
    assert "See 3" in {kept(course, student)[2] for student in ("Ada Lovelace_77", "ben")}
    assert (
        page.evaluate("window.attacked") is None
        and page.locator("article script:not([type^='math/']), article img").count() == 0
    )
    assert RUN in page.content() and not errors(page)
