"""All labs of a course together: weights, what is dropped, free late days, points for everybody, and their files."""

import csv
from pathlib import Path

import grading_course as kit
import numpy as np
import pytest
from typer.testing import CliRunner

from labcli.cli import app
from labgrader.grade.batch import Record
from labgrader.grade.deadlines import Lateness, read_deadline
from labgrader.grade.grade import Result
from labgrader.grade.gradebook import opened, write_gradebook
from labgrader.grade.policy import Policy, read_bonus, read_policy
from labgrader.grade.totals import Final, settle
from labgrader.handin.reading import read_lab, read_submissions
from labgrader.handin.roster import Person
from labgrader.report.course_page import rows_of
from labgrader.report.forget import forget
from labgrader.report.outputs import write_outputs

FIRST, SECOND, THIRD = LABS = ("04_iou", "07_grasp", "09_other_stacks")
ROSTER = "id,name,email\n77,Ada Lovelace,ada@x.org\n78,Ada Lovelace,ada@x.org\n5,=Ben,ben@x.org\n6,Cher,cher@x.org\n"
# Who handed in what when, and which share of the questions is right.
ADA, ADA_TOO, BEN = "Ada Lovelace_77", "Ada Lovelace_78", "Ben_5"
HANDED_IN = {
    FIRST: {ADA: (1.0, "2026-10-07 12:00:00 UTC"), BEN: (0.0, "2026-10-01 12:00:00 UTC")},
    SECOND: {ADA_TOO: (0.0, "2026-11-01 12:00:00 UTC"), BEN: (1.0, "2026-11-07 12:00:00 UTC")},
    THIRD: {ADA_TOO: (1.0, "2026-12-07 12:00:00 UTC"), BEN: (1.0, "2026-12-01 12:00:00 UTC")},
}
DUE = {FIRST: "2026-10-05", SECOND: "2026-11-05", THIRD: "2026-12-05"}
COURSE = "".join(
    f'[[deadline]]\nlab = "{lab}"\ndue = {due}T12:00:00Z\npenalty_per_day = 10\n' for lab, due in DUE.items()
)
POLICY = f'[[course]]\ndrop_lowest = 1\nlate_days = 3\n[[weight]]\nlab = "{THIRD}"\nweight = 3\n'


@pytest.fixture(scope="module")
def graded(tmp_path_factory):
    """Three labs with two students, graded as their shares say; all answers in words are empty; no answer is run."""
    course = tmp_path_factory.mktemp("course")
    (course / "roster.csv").write_text(ROSTER)
    for topic, students in HANDED_IN.items():
        kit.write_lab(course, topic)
        submissions = course / f"submissions_{topic}"
        for student, (_, when) in students.items():
            path = submissions / student / topic
            notebook = kit.lab_notebook(topic, {})
            notebook["cells"][-1]["source"] = "*Your answer.*"
            kit.write(path / f"{topic}.ipynb", notebook)
            (path / "timestamp.txt").write_text(when)
        lab = read_lab(course, topic)
        read = read_submissions(submissions, lab)
        records = [
            Record(
                one.student,
                "",
                tuple(Result(name, worth * students[one.student][0], worth, "") for name, worth in lab.points.items()),
                True,
                one.digest,
                "key",
            )
            for one in read
        ]
        assert not write_gradebook(course, lab, zip(records, read, strict=True), {}, {})
        write_outputs(course / "grades" / topic, lab, records, {})
    return course


@pytest.fixture
def course(graded):
    """The same, with settings that a test may write anew."""
    (graded / "course.toml").write_text(COURSE + POLICY)
    return graded


def total(lab: str) -> float:
    return sum(float(question.points) for question in kit.asked(lab).values())


def written(course: Path, *options: str) -> list[dict]:
    done = CliRunner().invoke(app, ["grades", "course", "--course", str(course), *options])
    assert done.exit_code == 0, done.output
    name = options[0].strip("-") if options else "scores"
    with (course / "grades/course" / f"{name}.csv").open() as file:
        return list(csv.DictReader(file))


def test_weights_free_days_and_the_lowest_make_the_total(course):
    """By hand: Ada is 2 and 2 days late, 3 are free, so 1 costs 10 %; words are worth 3 points, which nobody has."""
    ada, ben, cher = written(course)
    shares = {lab: total(lab) / (total(lab) + 3) for lab in LABS}
    expected = np.average([shares[FIRST], 0.9 * shares[THIRD]], weights=[1, 3])
    assert float(ada["Course total"]) == pytest.approx(100 * expected, abs=0.01) and ada["dropped"] == SECOND
    assert float(ada[THIRD]) == pytest.approx(0.9 * total(THIRD))
    expected = np.average([shares[SECOND], shares[THIRD]], weights=[1, 3])  # Ben's 2 days are free
    assert float(ben["Course total"]) == pytest.approx(100 * expected, abs=0.01)
    assert ben["dropped"] == FIRST and (cher["student"], float(cher["Course total"])) == ("Cher", 0.0)
    page = (course / f"grades/{THIRD}/feedback/{ADA_TOO}.html").read_text()
    assert "Handed in 2 days late, 1 of them free, 10 % less." in page
    assert "<s>" in (course / "grades/course/course.html").read_text()


def test_points_for_everybody_reach_page_and_files_and_go_with_their_block(course):
    bonus = f'[[bonus]]\nlab = "{FIRST}"\npoints = 1.5\nreason = "a <long> task"\n'
    (course / "course.toml").write_text(COURSE + POLICY + bonus)
    assert read_bonus(course, FIRST) == [(1.5, "a <long> task")] and read_bonus(course, SECOND) == []
    assert [float(row[FIRST] or 0) for row in written(course)] == [total(FIRST) + 1.5, 1.5, 0.0]
    page = course / f"grades/{FIRST}/feedback/{BEN}.html"
    assert "1.5 points more for everybody: a &lt;long&gt; task" in page.read_text()
    (course / "course.toml").write_text(COURSE + POLICY)
    assert float(written(course)[0][FIRST]) == total(FIRST) and "for everybody" not in page.read_text()


def test_moodle_finds_people_by_email_and_canvas_gets_a_total_of_100(course):
    rows = written(course, "--moodle")
    assert [row["Email address"] for row in rows] == ["ada@x.org", "ben@x.org", "cher@x.org"]
    assert rows[1]["Full name"] == "'=Ben" and list(rows[0])[2:] == [*LABS, "Course total", "Feedback"]
    possible, *rows = written(course, "--canvas")
    assert possible["Course total"] == "100" and [row["ID"] for row in rows] == ["77", "5", "6"]


def test_what_waits_for_a_person_is_not_final_anywhere(course):
    with opened(course) as book:
        grade = book.find_grade("explain", FIRST, FIRST, BEN)
        grade.auto_score, grade.needs_manual_grade = None, True
        book.db.commit()
    try:
        done = CliRunner().invoke(app, ["grades", "course", "--canvas", "--course", str(course)])
        assert done.exit_code == 1 and f"not final yet: {BEN}" in done.stdout
        with (course / "grades/course/canvas.csv").open() as file:
            assert [row["Course total"] == "" for row in csv.DictReader(file)] == [False, False, True, True]  # and Cher
        assert "(not final)" in (course / "grades/course/course.html").read_text()
        final = settle(course, FIRST, [], read_deadline(course, FIRST))[BEN]
        assert "So far: 0 of" in final.section
    finally:
        with opened(course) as book:
            grade = book.find_grade("explain", FIRST, FIRST, BEN)
            grade.auto_score, grade.needs_manual_grade = 0.0, False
            book.db.commit()


@pytest.mark.bad_input
@pytest.mark.parametrize(
    "text, says",
    [
        ("[[course]]\ndrop_lowest = 1.5\n", "[[course]] number 1: expected whole numbers"),
        ("[[course]]\ndrop = 1\n", "[[course]] number 1: expected drop_lowest, late_days in this block, got drop"),
        ("[[course]]\n[[course]]\n", "[[course]] number 2: expected one block of this name"),
        ('[[weight]]\nlab = "04_iou"\nweight = -1\n', "[[weight]] number 1: expected weight, a number that is not neg"),
        ('[[weight]]\nlab = "04_iou"\nweight = 1\n' * 2, "[[weight]] number 2: lab: 04_iou has a weight above"),
    ],
)
def test_a_policy_that_cannot_be_used_is_refused_with_its_place(tmp_path, text, says):
    (tmp_path / "course.toml").write_text(text)
    with pytest.raises(ValueError) as refusal:
        read_policy(tmp_path)
    assert "course.toml" in str(refusal.value) and says in str(refusal.value)


def test_two_folders_of_one_person_in_a_lab_are_refused():
    """The letters of one name are composed in the roster's way, of the other they are not."""
    roster = {"Zo\u00eb": Person("Zo\u00eb")}
    final = Final("", 1.0, 1.0, (), Lateness(), "")
    assert len(rows_of({FIRST: {"Zo\u00eb": final}, SECOND: {"Zoe\u0308": final}}, roster, {})) == 1
    with pytest.raises(ValueError, match=r"04_iou: .* are both Zo\u00eb; rename the folder of one"):
        rows_of({FIRST: {"Zo\u00eb": final, "Zoe\u0308": final}}, roster, {})


def test_one_lab_always_stays_and_a_weight_of_0_does_not_count():
    assert Policy({}, drop_lowest=3).total({"a": 0.5, "b": 0.7}) == (0.7, ["a"])
    assert Policy({"a": 0.0}, drop_lowest=1).total({"a": 0.1, "b": 0.5, "c": 1.0}) == (1.0, ["b"])
    assert Policy({"a": 0.0}).total({"a": 0.1}) == (0.0, [])


def test_what_could_not_be_graded_is_no_final_0_of_the_courses(course):
    """A page says so, and the lab's file has no grade of that student's either."""
    page = course / f"grades/{FIRST}/feedback/Dan_9.html"
    page.write_text("This submission could not be graded")
    try:
        for platform in ("canvas", "moodle"):
            done = CliRunner().invoke(app, ["grades", "course", f"--{platform}", "--course", str(course)])
            assert done.exit_code == 1 and "not final yet: Dan_9" in done.stdout
            rows = (course / f"grades/course/{platform}.csv").read_text().splitlines()
            dan = next(row for row in rows if "Dan" in row)
            cher = next(row for row in rows if "Cher" in row)
            assert "0.00" not in cher and ("0.00" not in dan or "Not final" in dan)
        assert "not graded" in (course / "grades/course/course.html").read_text()
    finally:
        page.unlink()


def test_the_courses_page_and_table_forget_a_student_too(course):
    written(course)
    forget(course, "77")
    left = [path for path in (course / "grades/course").iterdir() if "Lovelace" in path.read_text()]
    assert not left
