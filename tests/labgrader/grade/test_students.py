"""Students' names: what may be one, who was renamed, and who is gone."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import grading_course as kit
import pytest
from typer.testing import CliRunner

from labcli.cli import app
from labgrader.course import of_topic
from labgrader.grade import students
from labgrader.grade.gradebook import opened
from labgrader.grade_course import grade_course
from labgrader.handin.reading import name_of

TOPIC = "04_iou"
UNANSWERED = kit.blank(of_topic(TOPIC)["iou"])


@pytest.fixture
def course(tmp_path):
    """Two students, who answered nothing: grades are of no interest here."""
    kit.write_lab(tmp_path, TOPIC)
    for student in ("ada", "ben"):
        kit.submit(tmp_path, student, TOPIC, {"iou": f"# {student}'s\n{UNANSWERED}"})
    return tmp_path


def grade(course: Path, **how):
    return grade_course(TOPIC, course, seed="secret", progress=False, **how)


def left_of(course: Path, student: str) -> list[str]:
    """All files and folders with a student's name."""
    return sorted(str(path.relative_to(course)) for path in course.rglob("*") if path.name.split(".")[0] == student)


STOPPED = {
    'Ada "Ada" Lovelace': """it holds '"'""",
    "Ada\u202eLovelace": "it holds '\\u202e'",
    ".ada": "it begins with a dot",
    "ada ": "it begins or ends with a space",
    "ä" * 111: "it is 222 bytes long, at most 220 are possible",
}


def test_what_stops_a_name_is_said(course):
    for name in STOPPED:
        kit.submit(course, name, TOPIC, {})
    odd = {record.student: record.reason for record in grade(course).records if record.reason}
    assert odd.keys() == set(map(name_of, STOPPED))
    for name, says in STOPPED.items():
        assert odd[name_of(name)].startswith("rename the student's folder ") and odd[name_of(name)].endswith(
            f": {says}"
        )


def test_nbgraders_feedback_takes_every_name_that_is_graded(course):
    names = ("Ben & Ada O'Brien", "Zoë Ångström", "a" * 200)
    for name in names:
        kit.submit(course, name, TOPIC, {})
    assert not grade(course).failures
    command = [sys.executable, "-m", "nbgrader", "generate_feedback", TOPIC]
    environment = os.environ | {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    subprocess.run(command, cwd=course, env=environment, check=True, capture_output=True)
    assert all((course / "feedback" / name / TOPIC / f"{TOPIC}.html").is_file() for name in names)


def test_a_renamed_student_keeps_grades_and_pages(course):
    grade(course)
    with opened(course) as book:
        book.find_grade("explain", TOPIC, TOPIC, "ada").manual_score = 3.0
        book.db.commit()
    (course / "submitted/ada").rename(course / "submitted/Ada Lovelace")
    graded = grade(course)
    assert graded.renamed == {"ada": "Ada Lovelace"} and graded.graded_now == 0 and not graded.gone
    assert left_of(course, "ada") == [] and len(left_of(course, "Ada Lovelace")) == len(left_of(course, "ben"))
    with opened(course) as book:
        assert book.find_grade("explain", TOPIC, TOPIC, "Ada Lovelace").manual_score == 3.0
        assert {submission.student.id for submission in book.assignment_submissions(TOPIC)} == {"Ada Lovelace", "ben"}


def test_a_rename_that_meets_a_locked_gradebook_is_made_in_the_next_run(course, monkeypatch):
    def locked(course):
        raise ValueError("another program is writing it")

    grade(course)
    (course / "submitted/ada").rename(course / "submitted/Ada Lovelace")
    with monkeypatch.context() as patched, pytest.raises(ValueError, match="another program is writing it"):
        patched.setattr(students, "opened", locked)
        grade(course)
    graded = grade(course)
    assert graded.renamed == {"ada": "Ada Lovelace"} and not graded.gone and left_of(course, "ada") == []


def test_who_is_gone_is_listed_and_removed_when_that_is_asked_for(course):
    grade(course)
    shutil.rmtree(course / "submitted/ada")
    before = left_of(course, "ada")
    graded = grade(course)
    assert graded.gone == ["ada"] and left_of(course, "ada") == before
    done = CliRunner().invoke(app, ["grade", TOPIC, "--course", str(course), "--tidy"])
    assert "removed what there was of students without a submission: ada" in done.stdout
    assert left_of(course, "ada") == [] and grade(course).gone == []
    with opened(course) as book:
        assert [submission.student.id for submission in book.assignment_submissions(TOPIC)] == ["ben"]


@pytest.mark.parametrize("roster", ["", "id,name\nada,Ada L\neve,Eve A\n"])
def test_a_copy_of_what_somebody_missing_handed_in_inherits_nothing(course, roster):
    """Eve hands in Ada's file, byte by byte, and for one run Ada's folder is not there."""
    ada, eve = ("ada", "eve") if roster else ("Ada L_1", "Eve A_2")
    (course / "roster.csv").write_text(roster or "id\n")
    (course / "submitted/ada").rename(course / "submitted" / ada)
    grade(course)
    (course / "submitted" / ada).rename(course / "submitted" / eve)
    graded = grade(course)
    assert graded.renamed == {} and graded.gone == [ada]


def test_a_platforms_number_tells_who_was_renamed(course):
    (course / "submitted/ada").rename(course / "submitted/Ada L_1")
    grade(course)
    (course / "submitted/Ada L_1").rename(course / "submitted/Ada B_1")
    assert grade(course).renamed == {"Ada L_1": "Ada B_1"}


def test_of_two_who_handed_in_the_same_nobody_is_taken_for_the_other(course):
    shutil.copy(course / f"submitted/ada/{TOPIC}/{TOPIC}.ipynb", course / f"submitted/ben/{TOPIC}/{TOPIC}.ipynb")
    grade(course)
    for old, new in (("ada", "fay"), ("ben", "gus")):
        (course / "submitted" / old).rename(course / "submitted" / new)
    graded = grade(course)
    assert graded.renamed == {} and graded.gone == ["ada", "ben"]
