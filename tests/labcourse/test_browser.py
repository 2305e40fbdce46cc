"""A student's afternoon in a real browser: JupyterLab in Debian's Chromium, driven by Playwright.

It needs the Debian package `chromium`, and skips without it. `pytest tests/labcourse/test_browser.py --basetemp=DIR`
leaves its screenshots in DIR.
"""

import shutil
from pathlib import Path

import nbformat
import pytest
import serving
from serving import TOKEN, cell_with, menu, open_page, wait_until_idle

ROOT = Path(__file__).parents[2]

pytestmark = pytest.mark.debian("chromium")

CHANGED = "#jp-main-dock-panel .lm-TabBar-tab.jp-mod-dirty"


@pytest.fixture(scope="module")
def jupyterlab(tmp_path_factory):
    """JupyterLab on a copy of the course; gives the URL of the server."""
    folder = tmp_path_factory.mktemp("course")
    for name in ("lessons", "labs"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns(".*"))
    with serving.jupyterlab(folder, tmp_path_factory.mktemp("jupyter")) as url:
        yield url


def open_notebook(page, url: str, path: str) -> None:
    """Open a notebook of the course alone, and wait for its kernel."""
    open_page(page, f"{url}/lab/tree/{path}?token={TOKEN}&reset")


@pytest.mark.parametrize("path, cell", [("lessons/04_iou.ipynb", "import"), ("labs/04_iou/04_iou.ipynb", "def iou(")])
def test_a_notebook_opens_unchanged_and_asks_nothing(jupyterlab, page, path, cell):
    open_notebook(page, jupyterlab, path)
    page.wait_for_timeout(3000)
    assert page.locator(CHANGED).count() == 0
    assert page.locator(".jp-Dialog, .Toastify__toast").count() == 0
    cell_with(page, cell).locator(".cm-content").click()
    page.keyboard.insert_text("# mine")
    page.locator(CHANGED).wait_for()


@pytest.mark.parametrize("path, word", [("lessons/04_iou.ipynb", "lesson "), ("labs/04_iou/04_iou.ipynb", "lab ")])
def test_a_tab_says_whether_it_is_the_lesson_or_the_lab(jupyterlab, page, path, word):
    open_notebook(page, jupyterlab, path)
    page.wait_for_function(
        """word => [...document.querySelectorAll(".lm-DockPanel-tabBar .lm-TabBar-tabLabel")].some(label =>
            label.innerText == "04_iou.ipynb" && getComputedStyle(label, "::before").content == `"${word}"`)""",
        arg=word,
    )


def test_a_blank_filled_in_lab_04_gets_its_tick(jupyterlab, page, tmp_path):
    """Open the lab, write the solution's text into one blank, run all: a tick for it, "not yet" for the others."""
    solution = nbformat.read(ROOT / "solutions/04_iou/04_iou.ipynb", as_version=4)
    (answer,) = [c for c in solution.cells if c.metadata.get("nbgrader", {}).get("grade_id") == "iou"]
    open_notebook(page, jupyterlab, "labs/04_iou/04_iou.ipynb")
    editor = cell_with(page, "def iou(").locator(".cm-content")
    editor.click()
    page.keyboard.press("Control+a")
    page.keyboard.insert_text("\n".join(line for line in answer.source.splitlines() if "###" not in line))
    menu(page, "Run", "Run All Cells")
    tick = page.locator(".jp-OutputArea-output", has_text="✔ iou is right")
    tick.wait_for()
    wait_until_idle(page)
    assert page.locator(".jp-OutputArea-output", has_text="not answered yet").count() >= 2
    assert page.locator(".jp-OutputArea-output[data-mime-type='application/vnd.jupyter.stderr']").count() == 0
    cell_with(page, 'iou = check("04_iou.iou"').evaluate("cell => cell.scrollIntoView({block: 'start'})")
    page.screenshot(path=tmp_path / "lab_04.png")
    assert page.errors == []


def answered(page, answer: str):
    """Write an answer into lab 04's blank for iou, run it and its check; gives the output of the check."""
    editor = cell_with(page, "def iou(").locator(".cm-content")
    editor.click()
    page.keyboard.press("Control+a")
    page.keyboard.insert_text(answer)
    page.keyboard.press("Shift+Enter")
    page.keyboard.press("Shift+Enter")
    return cell_with(page, 'iou = check("04_iou.iou"').locator(".jp-OutputArea-output")


def test_a_wrong_answer_gets_its_case_at_once_and_its_marked_line_after(jupyterlab, page, tmp_path):
    """Then a loop that does not end, and a syntax error, which leaves the answer before it as it was."""
    open_notebook(page, jupyterlab, "labs/04_iou/04_iou.ipynb")
    cell_with(page, "from labkit import check").locator(".cm-content").click()
    page.keyboard.press("Shift+Enter")
    output = answered(
        page,
        "import numpy as np\ndef iou(n):\n    tp = np.diag(n)\n    return tp - (n.sum(axis=0) + n.sum(axis=1) - tp)",
    )
    output.filter(has_text="returns").filter(has_text="Looking for the place").wait_for()
    page.screenshot(path=tmp_path / "case.png")
    marked = output.locator("mark")
    marked.wait_for()
    assert marked.text_content() == "-"
    assert "needs another operator" in output.text_content() and "returns" in output.text_content()
    assert output.filter(has_text="Looking for the place").count() == 0
    page.screenshot(path=tmp_path / "hint.png")
    answered(page, "def iou(n):\n    while True:\n        n = n + 0").filter(has_text="A loop does not end").wait_for()
    wait_until_idle(page)
    answered(page, "def iou(n)\n    return n")
    page.locator(".jp-OutputArea-output", has_text="SyntaxError").first.wait_for()
    page.screenshot(path=tmp_path / "syntax.png")


def test_a_slider_moved_in_lesson_02_changes_the_picture(jupyterlab, page, tmp_path):
    """Run the lesson as far as its first explorer, and press an arrow key on the slider."""
    lesson = nbformat.read(ROOT / "lessons/02_crf.ipynb", as_version=4)
    code = [cell for cell in lesson.cells if cell.cell_type == "code"]
    shown = [" ".join(output.get("data", {}).get("text/plain", "") for output in cell.outputs) for cell in code]
    at = next(i for i, text in enumerate(shown) if "an explorer: " in text)
    open_notebook(page, jupyterlab, "lessons/02_crf.ipynb")
    cell = page.locator(".jp-CodeCell").nth(at)
    cell.locator(".cm-content").click()
    menu(page, "Run", "Run All Above Selected Cell")
    page.keyboard.press("Shift+Enter")
    cell.locator(".widget-image, .jupyter-widgets img").first.wait_for()
    wait_until_idle(page)
    picture = cell.locator(".jupyter-widgets img, img.jupyter-widgets").first
    handle = cell.locator(".noUi-handle").first
    handle.scroll_into_view_if_needed()
    before, source = picture.screenshot(), picture.get_attribute("src")
    handle.focus()
    for _ in range(5):
        page.keyboard.press("ArrowRight")
    page.wait_for_function("([image, old]) => image.src !== old", arg=[picture.element_handle(), source])
    while picture.screenshot() == before:  # the browser takes a moment to draw it
        page.wait_for_timeout(100)
    page.screenshot(path=tmp_path / "lesson_02.png")
    assert page.errors == []


def test_every_explorers_labels_are_read_in_full_and_pressed_pixels_have_the_things_colour(jupyterlab, page):
    """Run one cell that shows the explorers of all topics, as test_explorer.py makes them."""
    places = [str(ROOT), str(ROOT / "tests"), str(ROOT / "tests/labcourse/explorers")]  # labkit is not tests/labkit
    open_notebook(page, jupyterlab, "lessons/04_iou.ipynb")
    cell = page.locator(".jp-CodeCell").first
    cell.locator(".cm-content").click()
    page.keyboard.press("Control+a")
    page.keyboard.insert_text(f"import sys\nsys.path[:0] = {places}\nfrom test_explorer import EXPLORERS\n")
    page.keyboard.insert_text("for make, _ in EXPLORERS.values(): display(make())")
    page.keyboard.press("Shift+Enter")
    slider = cell.locator(".widget-slider", has_text="saturation")
    error = cell.locator("[data-mime-type='application/vnd.jupyter.stderr']")
    slider.or_(error).first.wait_for()
    assert error.count() == 0, error.inner_text()
    wait_until_idle(page)
    labels = cell.locator(".widget-label, .widget-label-basic")
    assert labels.count() > 40
    assert labels.evaluate_all("all => all.filter(e => e.scrollWidth > e.clientWidth).map(e => e.innerText)") == []
    cell.locator("button", has_text="0.72").click()
    cell.locator("button.mod-warning", has_text="0.72").wait_for()
    assert cell.locator("button.mod-primary").count() == 19
    assert page.errors == []


def test_the_view_in_lesson_08_turns_when_it_is_dragged(jupyterlab, page, tmp_path):
    """Without a kernel: a still picture, until the mouse is over it."""
    open_notebook(page, jupyterlab, "lessons/08_node_time.ipynb")
    view = page.locator(".jp-RenderedPlotly")
    view.locator("img").hover(force=True)
    view.locator("canvas").first.wait_for(state="attached")
    seen = "view => [...Object.values(view._fullLayout.scene._scene.getCamera().eye)]"
    before, box = view.evaluate(seen), view.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    after = before
    while after == before:  # plotly takes a moment until it listens
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x + 150, y, steps=5)
        page.mouse.up()
        page.wait_for_timeout(1000)
        after = view.evaluate(seen)
    page.screenshot(path=tmp_path / "view.png")
    assert abs(before[0] * after[1] - before[1] * after[0]) > 0.1, "it turned about the vertical"
    assert abs(before[2] - after[2]) < 0.1
    assert page.errors == []
