"""nbgrader's own autograder beside the kit's grades: it refuses, and what it or a hand changed is put right again."""

import json
import os
import shutil
import subprocess
import sys
import urllib.request
from pathlib import Path

import grading_course as kit
import pytest
import serving

from labgrader.course import asked
from labgrader.grade.gradebook import opened
from labgrader.grade.nbgrader_plugins import SAYS
from labgrader.grade_course import grade_course

ROOT = Path(__file__).parents[3]
TOPIC = "04_iou"
TOTAL = float(sum(question.points for question in asked(TOPIC).values()))
POINTS = {"ada": TOTAL, "ben": TOTAL - asked(TOPIC)["iou"].points}


@pytest.fixture(scope="module")
def graded(tmp_path_factory):
    """A right and a wrong answer to iou in the lab as it is released, graded."""
    folder = tmp_path_factory.mktemp("graded")
    shutil.copytree(ROOT / "labs" / TOPIC, folder / "labs" / TOPIC)
    released = (folder / "labs" / TOPIC / f"{TOPIC}.ipynb").read_text()
    for student, answers in (("ada", {}), ("ben", {"iou": "def iou(n):\n    return n / 2\n"})):
        notebook = json.loads(released)
        answers = kit.right_answers(TOPIC) | answers
        for cell in notebook["cells"]:
            cell["source"] = answers.get(cell["metadata"].get("nbgrader", {}).get("grade_id"), cell["source"])
        kit.submit(folder, student, TOPIC, notebook)
    shutil.copy(ROOT / "nbgrader_config.py", folder)
    grade(folder)
    return folder


@pytest.fixture
def course(graded, tmp_path):
    """A copy of that course."""
    return shutil.copytree(graded, tmp_path / "course")


def grade(course: Path):
    return grade_course(TOPIC, course, seed="secret", progress=False)


def autograde(course: Path) -> subprocess.CompletedProcess:
    """Run nbgrader's own command, which executes what students wrote."""
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "nbgrader", "autograde", TOPIC, "--force"]
    return subprocess.run(command, cwd=course, env=environment, capture_output=True, text=True)


def scores(course: Path) -> dict[str, float]:
    with opened(course) as book:
        return {student: book.find_submission(TOPIC, student).score for student in POINTS}


def copies(course: Path) -> dict[str, bytes]:
    return {student: (course / f"autograded/{student}/{TOPIC}/{TOPIC}.ipynb").read_bytes() for student in POINTS}


def test_autograde_refuses_in_one_sentence_and_touches_nothing(course):
    before = copies(course)
    done = autograde(course)
    assert done.returncode == 1 and SAYS in done.stderr and "Traceback" not in done.stderr
    assert scores(course) == POINTS and copies(course) == before


@pytest.mark.nightly
def test_without_the_kits_configuration_no_score_changes_and_the_next_run_puts_the_copies_back(course):
    before = copies(course)
    (course / "nbgrader_config.py").unlink()
    done = autograde(course)
    assert done.returncode == 1 and "graded-by-labkit-grade" in done.stderr
    assert scores(course) == POINTS
    assert grade(course).graded_now == 0 and copies(course) == before


def test_a_score_that_is_not_the_kits_is_put_right(course):
    with opened(course) as book:
        book.find_grade("check_iou", TOPIC, TOPIC, "ben").auto_score = 2.0
        book.db.commit()
    assert grade(course).graded_now == 0 and scores(course) == POINTS


@pytest.mark.nightly  # test_pages presses it in a browser
def test_formgraders_button_refuses_too(course, tmp_path_factory):
    """What the bolt in formgrader's table asks its server for, whose log it then shows."""
    with serving.jupyterlab(course, tmp_path_factory.mktemp("jupyter")) as url:
        address = f"{url}/formgrader/api/submission/{TOPIC}/ben/autograde?token={serving.TOKEN}"
        answer = json.loads(urllib.request.urlopen(urllib.request.Request(address, data=b"")).read())
    assert not answer["success"] and SAYS in answer["log"]
    assert scores(course) == POINTS


@pytest.mark.nightly
def test_a_lab_of_texts_alone_waits_for_a_person_where_something_is_written(tmp_path):
    """Its points are those of its rubrics, and a text that was left empty has nothing to read."""
    lab = "10_capstone"
    for folder in ("labs", "solutions"):
        shutil.copytree(ROOT / folder / lab, tmp_path / folder / lab)
    for student, folder in (("wrote", "solutions"), ("wrote_nothing", "labs")):
        kit.submit(tmp_path, student, lab, json.loads((ROOT / folder / lab / f"{lab}.ipynb").read_text()))
    grade_course(lab, tmp_path, seed="secret", progress=False)
    with opened(tmp_path) as book:
        found = {student: book.find_submission(lab, student) for student in ("wrote", "wrote_nothing")}
        assert {student: one.needs_manual_grade for student, one in found.items()} == {
            "wrote": True,
            "wrote_nothing": False,
        }
        assert found["wrote"].max_score == 24.0 and found["wrote"].score == 0.0
    assert "Rubric (4 points)" in (tmp_path / "autograded" / "wrote" / lab / f"{lab}.ipynb").read_text()
