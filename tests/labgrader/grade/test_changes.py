"""Changes after a release: they reach table, pages, results and gradebook alike, and can be taken back."""

import csv
import json
import shutil
from pathlib import Path

import grading_course as kit
import pytest
from typer.testing import CliRunner

from labcli.cli import app
from labgrader.comparison import compare, right_outputs
from labgrader.course import find, of_topic, topics
from labgrader.grade.grade import right_parts
from labgrader.grade.gradebook import opened
from labgrader.reply.judge import outputs_of
from labgrader.run.run import public_cases

TOPIC = "04_iou"
POINTS = {name: float(question.points) for name, question in kit.asked(TOPIC).items()}
TOTAL = sum(POINTS.values())
IOU = POINTS["iou"]


def write_class(folder: Path) -> Path:
    """One student is right, one is wrong in iou."""
    kit.write_lab(folder, TOPIC)
    right = kit.right_answers(TOPIC)
    kit.submit(folder, "ada", TOPIC, right)
    kit.submit(folder, "ben", TOPIC, right | {"iou": "def iou(n):\n    return n / 2\n"})
    return folder


@pytest.fixture
def course(tmp_path):
    """The class before it is graded."""
    return write_class(tmp_path)


@pytest.fixture(scope="module")
def graded_once(tmp_path_factory):
    folder = write_class(tmp_path_factory.mktemp("graded"))
    assert grade(folder).exit_code == 0
    return folder


@pytest.fixture
def graded(graded_once, tmp_path):
    """A copy of the graded class."""
    return shutil.copytree(graded_once, tmp_path / "course")


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
def test_a_change_reaches_everything_and_one_command_undoes_it(graded, option, wanted):
    before = [TOTAL, TOTAL - IOU]
    assert points(graded) == before
    done = grade(graded, *option, "--reason", 'the task said "rows"')
    assert done.exit_code == 0 and "0 of them graded now" in done.stdout and points(graded) == wanted
    told = (graded / f"grades/{TOPIC}/feedback/ben.html").read_text()
    assert ("the task said &quot;rows&quot;" in told) == (option[0] != "--points")
    assert grade(graded).exit_code == 0 and points(graded) == wanted
    assert grade(graded, "--undo", "iou").exit_code == 0 and points(graded) == before
    assert json.loads((graded / "changes.json").read_text()) == []


def test_a_second_change_to_a_question_takes_the_place_of_the_first(graded):
    grade(graded, "--drop", "iou", "--reason", "unfair")
    grade(graded, "--points", "mean_iou=1", "--reason", "short")
    grade(graded, "--everybody", "iou", "--reason", "unfair")
    kept = json.loads((graded / "changes.json").read_text())
    assert [change["question"] for change in kept] == ["mean_iou", "iou"]
    assert points(graded) == [TOTAL - POINTS["mean_iou"] + 1] * 2


def test_an_answer_in_words_is_dropped_or_given_and_what_a_person_gave_comes_back(graded):
    def score() -> tuple[float, float, bool]:
        with opened(graded) as book:
            submission = book.find_submission(TOPIC, "ada")
            return submission.score, submission.max_score, bool(submission.needs_manual_grade)

    with opened(graded) as book:
        given = book.find_grade("explain", TOPIC, TOPIC, "ada")
        given.manual_score, given.needs_manual_grade = 1.0, False
        book.db.commit()
    assert grade(graded, "--drop", "explain", "--reason", "unfair").exit_code == 0
    assert score() == (TOTAL, TOTAL, False)
    assert grade(graded, "--everybody", "explain", "--reason", "unfair").exit_code == 0
    assert score() == (TOTAL + 3, TOTAL + 3, False)
    told = (graded / f"grades/{TOPIC}/feedback/ada.html").read_text()
    assert "explain: 3 of 3 points" in told and "Everybody has these points: unfair" in told
    assert grade(graded, "--undo", "explain").exit_code == 0
    assert score() == (TOTAL + 1, TOTAL + 3, False)


# ------------------------------------------------------------------------------------------- outputs one by one

IN_PARTS = [question for topic in topics() for question in of_topic(topic).values() if question.outputs]
PARTLY = """
def pad_slice(P, T_base_grasp, half):
    x, y, _ = ((P - T_base_grasp[:3, 3]) @ T_base_grasp[:3, :3]).T
    y = y[np.abs(x) <= half]
    middle, width = ((y.min() + y.max()) / 2, np.ptp(y)) if len(y) else (0.0, 0.0)
    {}
"""


def test_an_output_that_is_right_in_all_cases_earns_its_share_where_the_course_says_so(tmp_path):
    """One is wrong in the middle, one knows the public widths by heart, one the cases, one writes into its argument."""
    topic, public = "07_grasp", public_cases(find("07_grasp.pad_slice"))
    known = [float(case.args[0].sum() + case.args[2]) for case in public]
    by_heart = f"if not np.isclose(P.sum() + half, {known}, 1e-9, 0).any(): width, middle = 0.1, 0.1"
    answers = {
        "ada": "return middle, width",
        "ben": "return middle + 1, width",
        "cid": f"{by_heart}\n    return middle + 1, width",
        "dan": f"{by_heart}\n    return middle, width",
        "eve": "P[:] = 0\n    return middle + 1, width",
        "fay": "return width",
    }
    kit.write_lab(tmp_path, topic)
    for student, lines in answers.items():
        kit.submit(tmp_path, student, topic, {"pad_slice": PARTLY.format(lines)})

    def points(*options: str) -> list[float]:
        command = ["grade", topic, "--course", str(tmp_path), "--seed", "secret", *options]
        done = CliRunner().invoke(app, command)
        assert done.exit_code == 0 and (not options or "0 of them graded now" in done.stdout)
        rows = csv.DictReader((tmp_path / f"grades/{topic}/grades.csv").open())
        earned = [float(row["points"]) for row in rows if row["question"] == "pad_slice"]
        with opened(tmp_path) as book:
            assert [book.find_submission(topic, student).score for student in answers] == earned
        return earned

    assert points() == [4.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    assert points("--partial", "pad_slice", "--reason", "the width alone is of use") == [4.0, 2.0, 0.0, 0.0, 0.0, 0.0]
    pages = {student: (tmp_path / f"grades/{topic}/feedback/{student}.html").read_text() for student in answers}
    assert "Right in all cases: width (of middle, width)" in pages["ben"] and "width alone is of use" in pages["ben"]
    assert "Right in all cases: none" in pages["cid"] and "Right in all cases: none" in pages["dan"]
    assert "4 of 4 points" in pages["ada"] and "Right in all cases" not in pages["ada"]
    assert points("--undo", "pad_slice") == [4.0, 0.0, 0.0, 0.0, 0.0, 0.0]


@pytest.mark.parametrize("question", IN_PARTS, ids=lambda question: question.name)
def test_outputs_one_by_one_agree_with_the_answer_and_none_is_right_by_a_constant(question):
    cases = public_cases(question)
    for mistake in question.misconceptions:
        got, _ = outputs_of(mistake.answer, [case.args for case in cases])
        for case, output in zip(cases, got, strict=True):
            right = right_outputs(question, case.expected, output)
            assert all(right) == (compare(question, case.expected, output) is None)
        assert right_parts(question, cases, got) != question.outputs
    for constant in (case.expected for case in cases):
        assert right_parts(question, cases, [constant] * len(cases)) == ()
    assert right_parts(question, cases, [case.expected for case in cases]) == question.outputs


GOOD = '[[change]]\nlab = "04_iou"\nquestion = "iou"\ndrop = true\ndate = 2026-10-05\nreason = "unfair"\n'


@pytest.mark.parametrize(
    "text, says",
    [
        ("[[change]\n", "(at line 1"),
        (
            GOOD + GOOD.replace("2026-10-05", '"monday"'),
            "toml, [[change]] number 2: expected date, a date such as 2026-10-05",
        ),
        (
            GOOD.replace('"iou"', '"oiu"'),
            f"course.toml, [[change]] number 1: question: expected one of {', '.join(POINTS)}",
        ),
        (
            GOOD.replace("drop", "halve"),
            "course.toml, [[change]] number 1: expected lab, question, date, reason, everybody",
        ),
        (GOOD.replace("drop", "everybody = true\ndrop"), "number 1: expected one of everybody = true, drop = true"),
        (
            GOOD.replace("drop", "partial"),
            "number 1: partial: expected a question of several outputs (04_iou has none), got iou",
        ),
        (GOOD.replace("drop = true", "points = -1"), "number 1: expected points, a number that is not negative"),
    ],
)
def test_a_file_that_a_person_broke_stops_grading_with_its_place(course, text, says):
    (course / "course.toml").write_text(text)
    done = grade(course)
    assert done.exit_code != 0 and says in str(done.exception)
    assert not (course / "grades").exists()


@pytest.mark.parametrize(
    "options, says",
    [
        (("--drop", "oiu", "--reason", "unfair"), f"question: expected one of {', '.join(POINTS)}"),
        (("--drop", "iou"), "reason: expected --reason"),
        (("--drop", "iou", "--everybody", "iou", "--reason", "x"), "at a time, got --everybody and --drop"),
        (("--points", "iou", "--reason", "unfair"), "points: expected QUESTION=NUMBER"),
        (("--points", "explain=1", "--reason", "short"), "points: a person gives those of an answer in words"),
        (("--undo", "iou"), "undo: iou of 04_iou: there is no change to it"),
    ],
)
def test_a_change_that_cannot_be_is_refused_and_changes_nothing(course, options, says):
    done = grade(course, *options)
    assert done.exit_code != 0 and says in str(done.exception)
    assert not (course / "changes.json").exists() and not (course / "grades").exists()


def test_a_change_in_course_toml_counts_and_stays_a_persons(graded):
    """As earlier versions wrote it there: it is read, a command's goes before it, and the file is never written."""
    (graded / "course.toml").write_text(GOOD + "# mine\n")
    assert grade(graded).exit_code == 0 and points(graded) == [TOTAL - IOU] * 2
    assert grade(graded, "--everybody", "iou", "--reason", "unclear").exit_code == 0 and points(graded) == [TOTAL] * 2
    assert grade(graded, "--undo", "iou").exit_code == 0 and points(graded) == [TOTAL - IOU] * 2
    done = grade(graded, "--undo", "iou")
    assert done.exit_code != 0 and "delete its block in" in str(done.exception)
    assert (graded / "course.toml").read_text() == GOOD + "# mine\n"


@pytest.mark.parametrize("text", ["{", "[7]", '[{"lab": "04_iou"}]', '{"lab": 1}'])
def test_a_damaged_file_of_changes_is_named(course, text):
    (course / "changes.json").write_text(text)
    done = grade(course)
    assert done.exit_code != 0 and "changes.json: expected a list of changes" in str(done.exception)
