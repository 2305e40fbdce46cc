"""Where the course is published: badges, the first cell for Colab, and links that lead into the tree."""

import json
import os
import re
import sys
import tomllib
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import pytest
from IPython.core.inputtransformer2 import TransformerManager
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from ruamel.yaml import YAML

from labgrader.course import course
from labgrader.program.cell import Cell, Parsed
from labgrader.release import publishing
from labgrader.release.publishing import published, unpublished

ROOT = Path(__file__).parents[3]
SITE = replace(course(), repository="https://github.com/owner/name", wheel="labkit-manipulation==0.2.0")
NOTEBOOKS = sorted([*ROOT.glob("lessons/*.ipynb"), *ROOT.glob("labs/*/*.ipynb")])
HERE = re.compile(
    r"https://(?:colab\.research\.google\.com/github|github\.com)/owner/name/(blob|raw)/main/([^)\"\s#]+)"
)


@pytest.fixture(scope="module")
def notebooks():
    """Lessons and labs as they are in the tree, by name."""
    names = [path.relative_to(ROOT).as_posix() for path in NOTEBOOKS]
    return {name: json.loads((ROOT / name).read_text(encoding="utf-8")) for name in names}


def text(notebook: dict) -> str:
    return "\n".join("".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == "markdown")


def test_published_notebooks_have_a_badge_a_cell_and_links_that_lead_to_files_of_the_repository(notebooks):
    for name, notebook in notebooks.items():
        there = published(notebook, name, ROOT, SITE)
        title, badge, install = there["cells"][:3]
        assert "".join(title["source"]).startswith("# ")
        assert badge["source"].endswith(f"(https://colab.research.google.com/github/owner/name/blob/main/{name})")
        wanted = "labkit-manipulation[stacks]==0.2.0" if "/09_" in name else "labkit-manipulation==0.2.0"
        assert f'%pip install -q "{wanted}"' in install["source"] and "nbgrader" not in install["metadata"]
        assert not re.findall(r"(?:\]\(|\bsrc=\")(?!https?:|#)", text(there)), name
        leads = HERE.findall(text(there))
        assert leads and all((ROOT / target).is_file() for _, target in leads), name
        assert {kind for kind, target in leads if target.endswith(".svg")} <= {"raw"}


def test_what_is_published_is_taken_back_without_a_trace(notebooks):
    for name, notebook in notebooks.items():
        plain = unpublished(notebook, name, ROOT)
        there = published(notebook, name, ROOT, SITE)
        elsewhere = replace(SITE, repository="https://github.com/other/place", wheel="https://x.org/kit.whl")
        assert published(there, name, ROOT, SITE) == there
        assert unpublished(published(there, name, ROOT, elsewhere), name, ROOT) == plain


@pytest.mark.parametrize("missing", [{"repository": ""}, {"wheel": ""}, {"repository": "https://elsewhere.org/o/n"}])
def test_without_both_settings_notebooks_stay_as_they_are(notebooks, missing):
    name, notebook = next(iter(notebooks.items()))
    assert published(notebook, name, ROOT, replace(SITE, **missing)) == unpublished(notebook, name, ROOT)


def test_the_first_cell_installs_the_wheel_on_colab_alone(notebooks, monkeypatch):
    name, notebook = next(iter(notebooks.items()))
    cell = published(notebook, name, ROOT, SITE)["cells"][2]
    calls = []
    shell = type("Shell", (), {"run_line_magic": lambda self, *arguments: calls.append(arguments)})()
    code = TransformerManager().transform_cell(cell["source"])
    monkeypatch.delitem(sys.modules, "google.colab", raising=False)
    exec(code, {"get_ipython": lambda: shell})
    assert calls == []
    monkeypatch.setitem(sys.modules, "google.colab", ModuleType("google.colab"))
    exec(code, {"get_ipython": lambda: shell})
    assert calls == [("pip", 'install -q "labkit-manipulation==0.2.0"')]
    assert Parsed(Cell(cell["source"])).problem == ""  # to the grader it is a cell like others


def test_readme_has_badges_if_the_course_has_a_repository_and_none_else():
    first = "lessons/01_labels.ipynb"
    found = publishing.badges(ROOT, SITE, first)
    names = [re.match(r"\[!\[([\w ]+)\]", badge)[1] for badge in found]
    assert names == ["tests", "site", "licence", "cite", "Open in Colab", "Binder", "Codespaces"]
    for badge in found:
        link = re.search(r"\]\(([^()]+)\)$", badge)[1]
        assert link.startswith("https://") or (ROOT / link).is_file()
    assert "Open in Colab" not in " ".join(publishing.badges(ROOT, replace(SITE, wheel=""), first))
    assert publishing.badges(ROOT, replace(SITE, repository=""), first) == []
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    shown = publishing.with_badges(readme, found)
    assert set(found) <= set(shown.splitlines()) and publishing.with_badges(shown, []) == publishing.with_badges(
        readme, []
    )


def test_binder_and_codespaces_install_what_students_need_with_a_python_that_fits():
    said = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    project = tomllib.loads(said)["project"]
    environment = YAML(typ="safe").load((ROOT / "binder" / "environment.yml").read_text(encoding="utf-8"))
    python, torch, _ = map(Requirement, (re.sub(r"(?<!>)=", "==", line) for line in environment["dependencies"]))
    assert next(iter(python.specifier)).version in SpecifierSet(project["requires-python"])
    assert torch.specifier == Requirement(next(n for n in project["dependencies"] if n.startswith("torch"))).specifier
    build = (ROOT / "binder" / "postBuild").read_text(encoding="utf-8")
    (extras,) = re.findall(r"-e '\.\[([\w,]+)\]'", build)
    assert set(extras.split(",")) <= project["optional-dependencies"].keys()
    assert all(os.access(ROOT / "binder" / name, os.X_OK) for name in ("postBuild", "start"))
    lines = (ROOT / ".devcontainer" / "devcontainer.json").read_text(encoding="utf-8").splitlines()
    container = json.loads("\n".join(line for line in lines if not line.startswith("//")))
    assert container["hostRequirements"]["cpus"] == 2
    target = container["postCreateCommand"].removeprefix("make ")
    assert re.search(
        rf"^(.* )?{re.escape(target)}( .*)?: ", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE
    )
