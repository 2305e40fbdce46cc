"""The site, as a reader meets it: no dead link, nothing from a network, words for every figure, explorers that answer
to keys, and what axe-core says.

It runs in the environment of `make site` (`make test-site`); in any other there is no Sphinx, and it skips.
"""

import json
import re
import subprocess
import sys
import tomllib
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
import report_pages

pytest.importorskip("sphinx", reason="needs `make test-site`")
pytestmark = pytest.mark.timeout(1800)  # the first test waits for the site, and that for its explorers' pictures
ROOT = Path(__file__).parent.parent
PAGES = [
    "index.html",
    "docs/ten_minutes.html",
    "lessons/02_crf.html",
    "labs/04_iou/04_iou.html",
    "reference/index.html",
    "reference/labkit.geometry.projection.html",
    "genindex.html",
]


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The built site; a warning is an error."""
    out = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html", "-c", "docs/site", "."]
    done = subprocess.run([*command, str(out)], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-3000:]
    return out


class Page(HTMLParser):
    """What a page links to, loads, names, and which of its pictures have no words."""

    def __init__(self, path: Path):
        super().__init__()
        self.links, self.loads, self.ids, self.wordless = [], [], set(), []
        self.feed(path.read_text())

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        self.ids |= {found.get("id"), found.get("name")}
        if tag == "a" and found.get("href"):
            self.links.append(found["href"])
        if tag in ("img", "script", "link", "iframe", "source") and (found.get("src") or found.get("href")):
            self.loads.append(found.get("src") or found.get("href"))
        if tag == "img" and (not found.get("alt") or found["alt"].startswith(("../", "_images"))):
            self.wordless.append(found.get("src"))


@pytest.fixture(scope="module")
def pages(site):
    return {path: Page(path) for path in site.rglob("*.html") if "_static" not in path.parts}


def test_every_link_inside_the_site_leads_somewhere(pages):
    dead = []
    for path, page in pages.items():
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            known = pages.get(target)
            if not target.exists() or (known and parts.fragment and unquote(parts.fragment) not in known.ids):
                dead.append(f"{path.name}: {link}")
    assert not dead


def test_readers_are_two_clicks_from_what_they_look_for(site, pages):
    """Ten minutes, bugs, a lesson, a syllabus, `back_project`: from the first page's own text, not the side bar."""
    text = (site / "index.html").read_text().split("<article")[1]
    wanted = {
        "docs/ten_minutes.html",
        "lessons/errata.html",
        "lessons/01_labels.html",
        "docs/teaching.html",
        "reference/index.html",
        "genindex.html",
    }
    assert wanted <= set(re.findall(r'href="([^"#]+)', text))
    assert "syllabus" in text
    places = "reference/labkit.geometry.projection.html#labkit.geometry.projection.back_project"
    assert places in pages[site / "genindex.html"].links


def test_the_reference_is_found_by_topic(pages, site):
    """From the topic to its functions' page; where the kit is not published, no page offers to edit it."""
    assert {"labkit.geometry.projection.html", "../lessons/06_back_projection.html"} <= set(
        pages[site / "reference/index.html"].links
    )
    published = "urls" in tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert ("Suggest edit" in (site / "lessons/04_iou.html").read_text()) == published


def test_no_page_loads_anything_from_a_network(pages):
    assert not [load for page in pages.values() for load in page.loads if urlsplit(load).netloc]


def test_every_figure_has_words(pages):
    assert not {path.name: page.wordless for path, page in pages.items() if page.wordless}


def test_every_explorer_of_a_lesson_has_a_picture_and_words_for_each_state(site):
    """As many as JupyterLab shows, 60 states each at most, and less than 15 MB together."""
    for lesson in ROOT.glob("lessons/*.ipynb"):
        outputs = [o for c in json.loads(lesson.read_text())["cells"] for o in c.get("outputs", [])]
        shown = sum("".join(o.get("data", {}).get("text/plain", "")).startswith("an explorer:") for o in outputs)
        text = (site / "lessons" / lesson.name).with_suffix(".html").read_text()
        found = re.findall(r'id="explorer-(\w+)"><script type="application/json">(.*?)</script>', text)
        assert len(found) == shown, lesson.name
        for name, state in found:
            words = json.loads(state)["words"]
            pictures = list((site / "_static/explorers" / name).glob("*.webp"))
            assert len(pictures) == len(words) <= 60 and all(words), name
    assert sum(path.stat().st_size for path in site.glob("_static/explorers/*/*")) < 15e6


def test_ten_minutes_has_the_explorers_in_the_place_of_its_moving_pictures(site):
    page = (site / "docs/ten_minutes.html").read_text().split("<article")[1]
    assert page.count('class="explorer"') == 4 and "explorer_" not in page and "[explorer" not in page


@pytest.fixture(scope="module")
def browser():
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=["--no-sandbox"])
        yield browser
        browser.close()


@pytest.mark.debian("chromium")
def test_an_explorer_is_loaded_when_it_is_scrolled_to_and_moved_by_keys(site, browser):
    tab, asked = browser.new_page(), []
    tab.on("request", lambda request: asked.append(request.url))
    tab.goto((site / "lessons/02_crf.html").as_uri())
    assert not [url for url in asked if url.endswith(".webp")]
    explorer = tab.locator("#explorer-gibbs")
    picture, words = explorer.locator("img"), explorer.locator("figcaption p").first
    explorer.scroll_into_view_if_needed()
    loaded = "([picture, file]) => picture.src.endsWith(file) && picture.complete && picture.naturalWidth > 0"
    tab.wait_for_function(loaded, arg=[picture.element_handle(), "/0.webp"])
    assert words.inner_text().startswith("w = 0.0:")
    slider = explorer.get_by_role("slider", name="w")
    slider.press("ArrowRight")
    slider.press("ArrowRight")
    tab.wait_for_function(loaded, arg=[picture.element_handle(), "/2.webp"])
    assert words.inner_text().startswith("w = 0.2:")
    assert slider.get_attribute("aria-valuetext") == "0.2"
    tab.close()


@pytest.mark.debian("chromium")
def test_a_lab_is_one_click_away_once_its_reader_has_given_an_address(site, browser):
    context = browser.new_context()
    tab = context.new_page()
    tab.goto((site / "lessons/04_iou_edges.html").as_uri())
    link = tab.get_by_role("link", name="Open lab 04_iou")
    assert "pip install" in tab.locator("div.lab").inner_text() and not link.is_visible()
    tab.get_by_label("address of your JupyterLab").fill("http://localhost:8888/lab?token=1")
    tab.get_by_role("button", name="Keep it").click()
    assert link.get_attribute("href") == "http://localhost:8888/lab/tree/labs/04_iou/04_iou.ipynb"
    tab.goto((site / "lessons/04_iou.html").as_uri())
    assert link.is_visible() and not tab.get_by_text("pip install -c").is_visible()
    context.close()


@pytest.mark.debian("chromium")
def test_a_double_click_turns_a_view_back(site, browser):
    tab = browser.new_page()
    tab.goto((site / "lessons/06_back_projection.html").as_uri())
    view = tab.locator("div.view").first
    view.scroll_into_view_if_needed()
    view.locator("canvas").first.wait_for(state="attached")
    eye = "view => view.layout.scene.camera.eye.x"
    start = view.evaluate(eye)
    view.evaluate("view => Plotly.relayout(view, { 'scene.camera.eye.x': 9 })")
    assert view.evaluate(eye) == 9
    view.dispatch_event("dblclick")
    tab.wait_for_function(f"([view, start]) => ({eye})(view) === start", arg=[view.element_handle(), start])
    tab.close()


def what_axe_says(tab) -> list[str]:
    """What axe-core finds serious or critical on a page."""
    from axe_playwright_python.sync_playwright import Axe

    found = Axe().run(tab).response["violations"]
    return [f"{v['id']}: {v['nodes'][0]['html'][:120]}" for v in found if v["impact"] in ("serious", "critical")]


@pytest.mark.debian("chromium")
@pytest.mark.parametrize(("width", "scheme"), [(1280, "light"), (390, "dark")])
def test_axe_finds_nothing_serious_on_the_pages_that_grading_writes(tmp_path, browser, width, scheme):
    tab = browser.new_page(viewport={"width": width, "height": 844}, color_scheme=scheme)
    for name, file in report_pages.write_report_pages(tmp_path).items():
        tab.goto(file.as_uri())
        tab.evaluate("document.querySelectorAll('details').forEach(d => { d.open = true; })")
        assert not what_axe_says(tab), name
    tab.close()


@pytest.mark.debian("chromium")
@pytest.mark.parametrize("page", PAGES)
@pytest.mark.parametrize(("width", "scheme"), [(1280, "light"), (390, "dark")])
def test_axe_finds_nothing_serious_and_nothing_is_cut_or_dimmed(site, browser, page, width, scheme):
    tab = browser.new_page(viewport={"width": width, "height": 844}, color_scheme=scheme)
    tab.goto((site / page).as_uri())
    serious = what_axe_says(tab)
    widest = tab.evaluate("document.documentElement.scrollWidth")
    cut = tab.evaluate(
        "[...document.querySelectorAll('pre, .picture')].filter((e) => e.scrollWidth > e.clientWidth + 1).length"
    )
    dimmed = tab.evaluate(
        "[...document.querySelectorAll('.picture img')].filter((e) => getComputedStyle(e).filter != 'none').length"
    )
    tab.close()
    assert not serious
    assert widest <= width and not cut and not dimmed
