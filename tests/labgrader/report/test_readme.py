"""The instructor's commands, as the page has them: from a clone to a released lab, three grades and formgrader."""

import csv
import json
import os
import re
import shutil
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest
import serving

ROOT = Path(__file__).parents[3]
PAGES = [
    page
    for page in (ROOT / "README.md", ROOT / "docs/grading.md")
    if "labkit grade 04_iou --course" in page.read_text()
]
# What the students of tests/data/submitted have right.
RIGHT = {
    "ada": {"confusion_matrix", "iou", "jackknife", "merge_classes", "trimap_band"},
    "ben": {"confusion_matrix", "trimap_band"},
    "eve": {"confusion_matrix", "merge_classes"},
}


def commands(page: Path) -> list[str]:
    """The lines of the indented block that grades a lab."""
    blocks = re.findall(r"(?:^    .+\n)+", page.read_text(), re.MULTILINE)
    block = next(block for block in blocks if "labkit grade 04_iou" in block)
    return [line.partition("  #")[0].strip() for line in block.splitlines()]


@pytest.fixture(scope="module")
def clone(tmp_path_factory):
    """What of a clone the commands need, made and set up already."""
    folder = tmp_path_factory.mktemp("clone")
    for name in ("solutions/04_iou", "tests/data/submitted"):
        shutil.copytree(ROOT / name, folder / name)
    shutil.copy(ROOT / "nbgrader_config.py", folder)
    shutil.copy(ROOT / ".gitignore", folder)
    return folder


def test_there_is_such_a_page():
    assert PAGES


@pytest.mark.nightly  # each command has tests of its own
def test_the_commands_grade_and_formgrader_shows_it(clone, tmp_path):
    environment = os.environ | {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    given = commands(PAGES[0])
    assert given[0].startswith("make ") and given[-1] == "cd out/sample && jupyter lab"
    for command in given[1:-1]:
        if command.startswith("export PATH"):
            continue
        done = subprocess.run(command, shell=True, cwd=clone, env=environment, capture_output=True, text=True)
        assert done.returncode == (1 if "labkit grade" in command else 0), done.stderr
    assert not (clone / "submitted").exists()
    course = clone / "out/sample"
    rows = list(csv.DictReader((course / "grades/04_iou/grades.csv").open()))
    points = {s: {row["question"]: float(row["points"]) for row in rows if row["student"] == s} for s in RIGHT}
    for student, right in RIGHT.items():
        assert {name for name, earned in points[student].items() if earned} == right
    with serving.jupyterlab(course, tmp_path) as url:
        address = f"{url}/formgrader/api/submissions/04_iou?token={serving.TOKEN}"
        shown = json.loads(urllib.request.urlopen(address).read())
    assert {s["student"]: s["score"] for s in shown} == {s: sum(earned.values()) for s, earned in points.items()}
    assert {s["student"]: s["needs_manual_grade"] for s in shown} == {"ada": True, "ben": True, "eve": True}


def test_git_ignores_what_grading_leaves(clone):
    names = ("downloaded", "submitted", "autograded", "feedback", "grades")
    for name in names:
        (clone / name).mkdir()
        (clone / name / "file").touch()
    (clone / "gradebook.db").touch()
    git = ["git", "-C", str(clone)]
    subprocess.run([*git, "init", "--quiet"], check=True)
    status = subprocess.run([*git, "status", "--short"], capture_output=True, text=True, check=True).stdout
    assert not [name for name in (*names, "gradebook.db") if name in status]


def test_grading_elsewhere_says_in_one_line_that_it_needs_linux(monkeypatch, labkit, capsys):
    monkeypatch.setattr(sys, "platform", "darwin")
    assert labkit("grade", "04_iou") == 2
    assert capsys.readouterr().err == (
        "labkit: labkit grade needs Linux, and this is darwin: use Linux, WSL or a container (docs/install.md)\n"
    )
