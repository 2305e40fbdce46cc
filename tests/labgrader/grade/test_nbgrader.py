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
from nbgrader.utils import notebook_hash

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


@pytest.mark.nightly  # test_pages presses formgrader's button in a browser
def test_autograde_refuses_in_one_sentence_and_touches_nothing(course):
    before = copies(course)
    done = autograde(course)
    assert done.returncode == 1 and SAYS in done.stderr and "Traceback" not in done.stderr
    assert scores(course) == POINTS and copies(course) == before


@pytest.mark.nightly
def test_feedback_reaches_all_whoever_handed_in_no_secret_and_no_time_and_nobody_else_reads_the_course(course):
    """Ada's come from a hub, Ben handed in by Moodle, or wrote a time that is none; the commands run with umask 022."""
    for name, text in (("timestamp.txt", "2026-10-01 12:00:00 UTC"), ("submission_secret.txt", "hers")):
        (course / "submitted/ada" / TOPIC / name).write_text(text)
    (course / "submitted/ben" / TOPIC / "timestamp.txt").write_text("yesterday")
    (course / "roster.csv").write_text("id\nada\nben\n")
    for path in (course, *course.rglob("*")):
        path.chmod(0o755 if path.is_dir() else 0o644)
    exchange = course.with_name("exchange")
    exchange.mkdir()
    grade(course)
    beside = course / "autograded/ben" / TOPIC
    kept = [(beside / name).read_text() for name in ("timestamp.txt", "submission_secret.txt")]
    for words in (["generate_feedback", TOPIC], ["release_feedback", TOPIC, f"--Exchange.root={exchange}"]):
        command = [sys.executable, "-m", "nbgrader", *words]
        environment = os.environ | {"PYTHONPATH": str(ROOT)}
        done = subprocess.run(command, cwd=course, env=environment, umask=0o022, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
    released = sorted(exchange.glob("labkit/feedback/*.html"))
    secrets = {
        student: (course / f"feedback/{student}/{TOPIC}/submission_secret.txt").read_text() for student in POINTS
    }
    hashes = {notebook_hash(secret=secret, notebook_id=TOPIC) for secret in secrets.values()}
    assert {page.stem for page in released} == hashes and len(released) == 2 and secrets["ada"] == "hers"
    assert all(page.stat().st_mode & 0o044 == 0o044 for page in released)  # students fetch them
    for name in ("submitted", "autograded", "feedback", "grades", "roster.csv", "gradebook.db"):
        assert (course / name).stat().st_mode & 0o077 == 0, name
    grade(course)
    assert kept == [(beside / name).read_text() for name in ("timestamp.txt", "submission_secret.txt")]


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


@pytest.mark.nightly
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
