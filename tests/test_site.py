"""The site, as a reader meets it: no dead link, nothing from a network, words for every figure, and what axe-core says.

It runs in the environment of `make site` (`make test-site`); in any other there is no Sphinx, and it skips.
"""

import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

pytest.importorskip("sphinx", reason="needs `make test-site`")
ROOT = Path(__file__).parent.parent
PAGES = [
    "index.html",
    "lessons/02_crf.html",
    "labs/04_iou/04_iou.html",
    "out/reference/labkit.geometry.projection.html",
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
    """The bugs, a first lesson, a syllabus, `back_project`: from the first page's own text, without the side bar."""
    text = (site / "index.html").read_text().split("<article")[1]
    wanted = {"lessons/errata.html", "lessons/01_labels.html", "docs/teaching.html", "genindex.html"}
    assert wanted <= set(re.findall(r'href="([^"#]+)', text))
    assert "syllabus" in text
    places = "out/reference/labkit.geometry.projection.html#labkit.geometry.projection.back_project"
    assert places in pages[site / "genindex.html"].links


def test_no_page_loads_anything_from_a_network(pages):
    assert not [load for page in pages.values() for load in page.loads if urlsplit(load).netloc]


def test_every_figure_has_words(pages):
    assert not {path.name: page.wordless for path, page in pages.items() if page.wordless}


@pytest.mark.debian("chromium")
@pytest.mark.parametrize("page", PAGES)
@pytest.mark.parametrize("width", [1280, 390])
def test_axe_finds_nothing_serious_and_nothing_is_wider_than_the_screen(site, page, width):
    from axe_playwright_python.sync_playwright import Axe
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=["--no-sandbox"])
        tab = browser.new_page(viewport={"width": width, "height": 844})
        tab.goto((site / page).as_uri())
        found = Axe().run(tab).response["violations"]
        widest = tab.evaluate("document.documentElement.scrollWidth")
        browser.close()
    serious = [f"{v['id']}: {v['nodes'][0]['html'][:120]}" for v in found if v["impact"] in ("serious", "critical")]
    assert not serious
    assert widest <= width
