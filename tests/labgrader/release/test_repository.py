"""A repository for students, as an owner would publish it: tried with a placeholder for the owner's address."""

import os
import re
import subprocess
from dataclasses import replace
from pathlib import Path

import nbformat
import pytest
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook

from labgrader.course import course as course_here
from labgrader.release import publishing
from labgrader.release.bundle import MARKS
from labgrader.release.repository import repository

ROOT = Path(__file__).parents[3]
OWNER = "https://github.com/owner/name"
HERE = re.compile(
    rf"https://(?:colab\.research\.google\.com/github/owner/name|{re.escape(OWNER)})/(?:blob|raw)/main/(.*)"
)


def git(folder: Path, *words: str) -> str:
    author = ("-c", "user.name=a", "-c", "user.email=a@example.org")
    return subprocess.run(["git", "-C", folder, *author, *words], capture_output=True, text=True, check=True).stdout


@pytest.fixture(scope="module")
def public(tmp_path_factory):
    """This course, published by its owner with a wheel and a site."""
    site = replace(course_here(), repository=OWNER, wheel="labkit-manipulation==0.2.0", site="https://site.example/")
    folder = tmp_path_factory.mktemp("public") / "name"
    with pytest.MonkeyPatch.context() as patch:
        for module in ("bundle", "repository"):
            patch.setattr(f"labgrader.release.{module}.course_here", lambda: site)
        patch.setattr("labgrader.release.bundle.release", lambda *_, **__: [])  # in this tree labs have no badges
        repository(ROOT, folder)
    return folder


def pages_of(folder: Path) -> dict[str, str]:
    """The text of each page and notebook, by name."""
    found = {}
    for name in git(folder, "ls-files").split():
        if name.endswith(".md"):
            found[name] = (folder / name).read_text(encoding="utf-8")
        if name.endswith(".ipynb"):
            cells = nbformat.read(folder / name, as_version=4).cells
            found[name] = "\n\n".join(cell.source for cell in cells if cell.cell_type == "markdown")
    return found


def test_links_lead_to_files_of_the_repository_or_name_the_owners_address(public):
    pages, dead, ours = pages_of(public), [], 0
    assert len(pages) > 40
    del pages["docs/site/landing.md"]  # whose addresses are those of the site that is made with it
    for name, text in pages.items():
        for link in re.findall(r"\]\(([^)\s]+)\)|(?:src|href)=\"([^\"]+)\"", text):
            target = (link[0] or link[1]).partition("#")[0]
            if inside := HERE.fullmatch(target):
                ours += 1
                dead += [(name, target)] if not (public / inside[1]).is_file() else []
            elif target and not re.match(r"\w+:", target):
                dead += [(name, target)] if not (public / name).parent.joinpath(target).exists() else []
    assert not dead and ours > 100


def test_readme_and_notebooks_have_badges_the_first_cell_and_the_link_to_the_site(public):
    readme = (public / "README.md").read_text(encoding="utf-8")
    assert "](https://site.example/)" in readme and "github/owner/name/blob/main/lessons/01" in readme
    assert readme.startswith("# Start here\n\n[![")
    for name in [*public.glob("lessons/*.ipynb"), *public.glob("labs/*/*.ipynb")]:
        badge, install = nbformat.read(name, as_version=4).cells[1:3]
        assert badge.source.endswith(f"/github/owner/name/blob/main/{name.relative_to(public).as_posix()})")
        assert "labkit-manipulation" in install.source and "google.colab" in install.source


def test_no_solution_key_or_exam_is_published_and_all_is_committed(public):
    names = git(public, "ls-files").split()
    assert not [
        n for n in names if n.startswith(("solutions", "tests", "docs/exams", "docs/grading", "labcourse/exam"))
    ]
    kit = tuple(f"{name}/" for name in course_here().kit)
    for name in names:
        if not (name.startswith(kit) and name.endswith(".py")):
            data = (public / name).read_bytes()
            assert not [mark for mark in MARKS if mark in data], name
    assert git(public, "status", "--porcelain") == "" and git(public, "branch", "--show-current") == "main\n"


@pytest.fixture
def course(tmp_path):
    """A small course in a repository of its own, with a draft that nobody committed."""
    folder = tmp_path / "course"
    (folder / "lessons").mkdir(parents=True)
    (folder / "docs").mkdir()
    text = (
        "# One\n\nSee [the key](../docs/grading.md), [two](91_two.ipynb) and [it](https://github.com/a/b/blob/main/c)."
    )
    for name in ("90_one", "91_two"):
        book = new_notebook(cells=[new_markdown_cell(text), new_code_cell("1")])
        nbformat.write(book, folder / f"lessons/{name}.ipynb")
    (folder / "docs/grading.md").write_text("The key.")
    git(tmp_path, "init", "-q", "course")
    git(folder, "add", "-A")
    git(folder, "commit", "-qm", "all")
    nbformat.write(new_notebook(), folder / "lessons/92_draft.ipynb")
    return folder


@pytest.fixture
def published(course, tmp_path, monkeypatch):
    here = replace(course_here(), start="", bundle=("lessons", "docs"), withheld=("docs/grading.md",))
    for module in ("bundle", "repository"):
        monkeypatch.setattr(f"labgrader.release.{module}.course_here", lambda: here)
    monkeypatch.setattr("labgrader.release.bundle.release", lambda *_, **__: [])
    return lambda: repository(course, tmp_path / "public")


def test_drafts_stay_and_what_is_published_no_more_goes(course, tmp_path, published):
    made = published()
    assert made.names == ["lessons/90_one.ipynb", "lessons/91_two.ipynb"]
    assert made.left_out == {"lessons/92_draft.ipynb": "git does not track it"}
    (cell, _) = nbformat.read(tmp_path / "public/lessons/90_one.ipynb", as_version=4).cells
    assert cell.source.endswith("See the key, [two](91_two.ipynb) and [it](https://github.com/a/b/blob/main/c).")
    (tmp_path / "public/notes.txt").write_text("the owner's")
    git(course, "rm", "-q", "lessons/91_two.ipynb")
    published()
    assert git(tmp_path / "public", "ls-files").split() == ["lessons/90_one.ipynb"]
    assert (tmp_path / "public/notes.txt").exists()
    assert "See the key, two and" in (tmp_path / "public/lessons/90_one.ipynb").read_text()


def test_a_folder_that_holds_something_else_is_refused(course, tmp_path, published):
    (tmp_path / "public").mkdir()
    (tmp_path / "public/thesis.txt").write_text("mine")
    with pytest.raises(ValueError, match="expected an empty folder or a git repository"):
        published()
    with pytest.raises(ValueError, match="outside the course"):
        repository(course, course / "public")
    os.unlink(tmp_path / "public/thesis.txt")
    published()
    (tmp_path / "public/lessons/90_one.ipynb").write_text("changed by hand")
    with pytest.raises(ValueError, match="commit them or take them back"):
        published()
    assert (tmp_path / "public/lessons/90_one.ipynb").read_text() == "changed by hand"


def test_the_site_badge_leads_where_pyproject_says(tmp_path):
    there = replace(course_here(), repository=OWNER, site="https://site.example/")
    assert publishing.badges(tmp_path, there, "") == [
        "[![site](https://img.shields.io/badge/site-lessons-blue)](https://site.example/)"
    ]
