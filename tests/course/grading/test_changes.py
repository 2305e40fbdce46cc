"""Changes after a release: they reach table, pages, results and gradebook alike, and deleting a block undoes one."""

import csv
import json
from pathlib import Path

import grading_course as kit
import pytest
from typer.testing import CliRunner

from labkit.apps.cli import app
from labkit.course.grading.gradebook import opened
from labkit.course.topics import of_topic

TOPIC = "04_iou"
POINTS = {name: float(question.points) for name, question in of_topic(TOPIC).items()}
TOTAL = sum(POINTS.values())
IOU = POINTS["iou"]


@pytest.fixture
def course(tmp_path):
    """One student is right, one is wrong in iou."""
    kit.write_lab(tmp_path, TOPIC)
    right = kit.right_answers(TOPIC)
    kit.submit(tmp_path, "ada", TOPIC, right)
    kit.submit(tmp_path, "ben", TOPIC, right | {"iou": "def iou(n):\n    return n / 2\n"})
    return tmp_path


def grade(course: Path, *options: str):
    return CliRunner().invoke(app, ["grade", TOPIC, "--course", str(course), "--seed", "secret", *options])


def points(course: Path) -> list[float]:
    """Points of ada and ben: the same in the table, in Gradescope's results, on their pages and in the gradebook."""
    rows = list(csv.DictReader((course / f"grades/{TOPIC}/grades.csv").open()))
    found = []
    for student in ("ada", "ben"):
        earned = sum(float(row["points"]) for row in rows if row["student"] == student)
        most = sum(float(row["max_points"]) for row in rows if row["student"] == student)
        assert json.loads((course / f"grades/{TOPIC}/results/{student}/results.json").read_text())["score"] == earned
        page = (course / f"grades/{TOPIC}/feedback/{student}.html").read_text()
        assert f"{earned:g} of {most:g} points for the functions" in page
        with opened(course) as book:
            submission = book.find_submission(TOPIC, student)
            assert submission.score == earned and submission.max_score == most + 3  # the answer in words
        found.append(earned)
    return found


@pytest.mark.parametrize(
    "option, wanted",
    [
        (("--everybody", "iou"), [TOTAL, TOTAL]),
        (("--drop", "iou"), [TOTAL - IOU, TOTAL - IOU]),
        (("--points", "iou=5"), [TOTAL - IOU + 5, TOTAL - IOU]),
    ],
)
def test_a_change_reaches_everything_and_one_command_undoes_it(course, option, wanted):
    before = [TOTAL, TOTAL - IOU]
    assert grade(course).exit_code == 0 and points(course) == before
    done = grade(course, *option, "--reason", 'the task said "rows"')
    assert done.exit_code == 0 and "0 of them graded now" in done.stdout and points(course) == wanted
    told = (course / f"grades/{TOPIC}/feedback/ben.html").read_text()
    assert ("the task said &quot;rows&quot;" in told) == (option[0] != "--points")
    assert grade(course).exit_code == 0 and points(course) == wanted
    assert grade(course, "--undo", "iou").exit_code == 0 and points(course) == before
    assert (course / "course.toml").read_text() == ""


def test_a_second_change_to_a_question_takes_the_place_of_the_first(course):
    grade(course, "--drop", "iou", "--reason", "unfair")
    grade(course, "--points", "mean_iou=1", "--reason", "short")
    grade(course, "--everybody", "iou", "--reason", "unfair")
    assert (course / "course.toml").read_text().count("[[change]]") == 2
    assert points(course) == [TOTAL - POINTS["mean_iou"] + 1] * 2


def test_an_answer_in_words_is_dropped_or_given_and_what_a_person_gave_comes_back(course):
    def score() -> tuple[float, float, bool]:
        with opened(course) as book:
            submission = book.find_submission(TOPIC, "ada")
            return submission.score, submission.max_score, bool(submission.needs_manual_grade)

    grade(course)
    with opened(course) as book:
        given = book.find_grade("explain", TOPIC, TOPIC, "ada")
        given.manual_score, given.needs_manual_grade = 1.0, False
        book.db.commit()
    assert grade(course, "--drop", "explain", "--reason", "unfair").exit_code == 0
    assert score() == (TOTAL, TOTAL, False)
    assert grade(course, "--everybody", "explain", "--reason", "unfair").exit_code == 0
    assert score() == (TOTAL + 3, TOTAL + 3, False)
    told = (course / f"grades/{TOPIC}/feedback/ada.html").read_text()
    assert "explain: 3 of 3 points" in told and "Everybody has these points: unfair" in told
    assert grade(course, "--undo", "explain").exit_code == 0
    assert score() == (TOTAL + 1, TOTAL + 3, False)


GOOD = '[[change]]\nlab = "04_iou"\nquestion = "iou"\ndrop = true\ndate = 2026-10-05\nreason = "unfair"\n'


@pytest.mark.parametrize(
    "text, says",
    [
        ("[[change]\n", "(at line 1"),
        (
            GOOD + GOOD.replace("2026-10-05", '"monday"'),
            "toml, line 7: expected date, a date such as 2026-10-05",
        ),
        (GOOD.replace('"iou"', '"oiu"'), "course.toml, line 1: question: expected one of confusion_matrix, iou"),
        (GOOD.replace("drop", "halve"), "course.toml, line 1: expected lab, question, date, reason, everybody"),
        (GOOD.replace("drop", "everybody = true\ndrop"), "line 1: expected one of everybody = true, drop = true"),
        (GOOD.replace("drop = true", "points = -1"), "line 1: expected points, a number that is not negative"),
    ],
)
def test_a_file_that_a_person_broke_stops_grading_with_its_line(course, text, says):
    (course / "course.toml").write_text(text)
    done = grade(course)
    assert done.exit_code != 0 and says in str(done.exception)
    assert not (course / "grades").exists()


@pytest.mark.parametrize(
    "options, says",
    [
        (("--drop", "oiu", "--reason", "unfair"), "question: expected one of confusion_matrix, iou"),
        (("--drop", "iou"), "and a --reason"),
        (("--points", "iou", "--reason", "unfair"), "points: expected QUESTION=NUMBER"),
        (("--points", "explain=1", "--reason", "short"), "points: a person gives those of an answer in words"),
        (("--undo", "iou"), "undo: there is no change to iou"),
    ],
)
def test_a_change_that_cannot_be_is_refused_and_changes_nothing(course, options, says):
    done = grade(course, *options)
    assert done.exit_code != 0 and says in str(done.exception)
    assert not (course / "course.toml").exists() and not (course / "grades").exists()
