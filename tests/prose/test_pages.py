"""What the notebooks hold beside what they do: links, names, spelling, pictures, lengths of cells."""

import base64
import importlib
import re
import subprocess
import sys
from pathlib import Path

import pytest
from notebooks import LABS, LESSONS, ROOT, SOLUTIONS, code, is_compared, prose
from PIL import Image

from labgrader.course import topics

MAX_LINES, MAX_PNG = 25, 150_000


def each(paths):
    """Run a test once a notebook, named by its folder and topic."""
    return pytest.mark.parametrize("path", paths, ids=[f"{p.relative_to(ROOT).parts[0]}-{p.stem}" for p in paths])


@each([*LESSONS, *SOLUTIONS, *LABS])
def test_cells_are_short(path):
    for cell in code(path):
        assert len(cell.source.splitlines()) <= MAX_LINES, cell.source[:200]


def test_prose_is_spelled_as_in_the_dictionary(tmp_path):
    for path in (*LESSONS, *SOLUTIONS):
        # Formulas, code and targets of links are not words.
        text = re.sub(r"\$\$.*?\$\$|\$[^$\n]*\$|```.*?```|`[^`\n]*`|\]\([^)]*\)", " ", prose(path), flags=re.DOTALL)
        (tmp_path / f"{path.parent.name}-{path.stem}.txt").write_text(text)
    done = subprocess.run([sys.executable, "-m", "codespell_lib", str(tmp_path)], capture_output=True, text=True)
    assert done.returncode == 0 and not done.stdout, done.stdout + done.stderr


@each([*LESSONS, *SOLUTIONS, *LABS])
def test_links_lead_to_files_and_headings(path):
    text = prose(path)
    headings = {re.sub(r"\s+", "-", h.strip()) for h in re.findall(r"^#+ (.+)$", text, re.MULTILINE)}
    targets = re.findall(r"\]\(([^)\s]+)", text) + re.findall(r"(?:src|href)=[\"']([^\"']+)", text)
    for target in targets:
        if target.startswith("#"):
            assert target[1:] in headings, target
        elif not re.match(r"https?://|mailto:|attachment:|data:", target):
            assert (path.parent / target.partition("#")[0]).exists(), target


@pytest.mark.parametrize("path", sorted(ROOT.glob("docs/*.md")), ids=lambda path: path.stem)
def test_a_page_of_docs_has_a_place_on_the_site_and_a_link_that_leads_to_it(path):
    pages = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *ROOT.glob("docs/*.md"), *ROOT.glob("lessons/*.md")]
    links = {(page, target) for page in pages for target in re.findall(r"\]\(([^)#\s]+)", page.read_text())}
    is_linked = any((page.parent / target).resolve() == path for page, target in links if page != path)
    assert is_linked, "link to it, from README or the page that its reader comes from"
    assert f'"docs/{path.stem}"' in (ROOT / "docs/site/conf.py").read_text(), "write it into GUIDES"


# --------------------------------------------------------------------------------- names in prose


def resolve(dotted: str) -> None:
    """Raise if a dotted name of the packages leads nowhere."""
    parts = dotted.split(".")
    found = importlib.import_module(parts[0])
    for i, part in enumerate(parts[1:], start=2):
        if not hasattr(found, part):
            found = importlib.import_module(".".join(parts[:i]))
        else:
            found = getattr(found, part)
        if not hasattr(found, "__path__") and not isinstance(found, type(sys)) and not isinstance(found, type):
            return  # an object: its attributes are its own business


@each([*LESSONS, *SOLUTIONS, *LABS])
def test_every_symbol_that_prose_names_exists(path):
    """Those that code names exist: nbval runs it."""
    for name in sorted(
        set(re.findall(r"`((?:labkit|labtrain|labros|labgrader|labcourse|labcli|data_gen)(?:\.\w+)+)", prose(path)))
    ):
        resolve(name)


# --------------------------------------------------------------------------------------------- lessons


def pictures(path: Path) -> list[bytes]:
    """The PNG pictures among a notebook's outputs."""
    data = [output.get("data", {}) for cell in code(path) for output in cell.outputs]
    return [base64.b64decode(d["image/png"]) for d in data if "image/png" in d]


@each([*LESSONS, *SOLUTIONS])
def test_pictures_are_there_and_small(path):
    found = pictures(path)
    assert len(found) >= (2 if path in LESSONS else 1)
    for picture in found:
        assert picture.startswith(b"\x89PNG") and len(picture) < MAX_PNG, f"{len(picture)} bytes"


@pytest.mark.parametrize("topic", [topic for topic in topics() if any(p.name.startswith(topic) for p in LESSONS)])
def test_each_topics_lessons_have_an_explorer(topic):
    cells = [cell for path in LESSONS if path.name.startswith(topic) for cell in code(path)]
    texts = [output.get("data", {}).get("text/plain", "") for cell in cells for output in cell.outputs]
    assert any(text.startswith("an explorer: ") for text in texts)


@each(LESSONS)
def test_at_least_half_of_the_cells_with_output_are_compared(path):
    shown = [cell for cell in code(path) if cell.outputs]
    assert 2 * sum(map(is_compared, shown)) >= len(shown)


def test_a_page_of_the_repository_shows_its_explorers_as_moving_pictures_and_says_where_the_sliders_are():
    """No script runs there; landing.md is the site's alone."""
    pages = [page for page in ROOT.glob("docs/*.md") if "explorer: " in page.read_text(encoding="utf-8")]
    assert [page.name for page in pages] == ["ten_minutes.md"]
    text = pages[0].read_text(encoding="utf-8")
    first = text.split("\n\n")[1]
    assert "sliders" in first and "`make site`" in first and "minutes" in first
    shown = re.findall(r"^\[!\[explorer: (\w+)\. ([^]]+)\]\((\w+\.gif)\)\]\(([^)]+)\)$", text, re.MULTILINE)
    assert len(shown) == text.count("[explorer: ") == 4
    for name, words, file, lesson in shown:
        picture = ROOT / "docs" / file
        assert name in file and len(words.split()) >= 8 and (ROOT / "docs" / lesson).is_file()
        assert picture.stat().st_size < 400_000
        with Image.open(picture) as gif:
            assert gif.n_frames >= 5 and gif.info["loop"] == 0 and gif.width >= 600
        before, after = text.split(f"({file})")
        assert "**Predict:**" in before.rpartition("\n## ")[2] and "<details>" in after.partition("\n## ")[0]
