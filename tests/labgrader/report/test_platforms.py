"""From the zip of a learning platform to the file and the zip that it takes back."""

import csv
import json
import shutil
import zipfile
from pathlib import Path

import grading_course as kit
import pytest
from nbgrader.api import Gradebook
from nbgrader.coursedir import CourseDirectory
from traitlets.config import PyFileConfigLoader
from typer.testing import CliRunner

from labcli.cli import app
from labgrader.grade.changes import change_of
from labgrader.grade.gradebook import opened
from labgrader.grade.totals import NOT_FINAL
from labgrader.grade_course import grade_course
from labgrader.handin.roster import read_roster
from labgrader.report.platforms import canvas_heading

ROOT = Path(__file__).parents[3]
TOPIC = "04_iou"
TOTAL = sum(question.points for question in kit.asked(TOPIC).values())
MOODLE = (
    "Ada Lovelace_1234567_assignsubmission_file_/04_iou.ipynb",
    "Zoë O'Brien_12_assignsubmission_file_/04_iou.ipynb",
)
COURSE = """
[[deadline]]
lab = "04_iou"
due = 2026-10-05T23:59:00
penalty_per_day = 10
"""
ROSTER = "Identifier,Full name,Email address\nParticipant 12,Zoë O'Brien,zoe@x.org\nParticipant 99,Cher,c@x.org\n"
CANVAS = ("lovelaceada_1234_567890_04_iou.ipynb", "obrienzoe_LATE_1235_567891_04_iou-2.ipynb")


def collected(course: Path, names: tuple[str, str]) -> list[str]:
    """Collect, grade, and grade one answer in words by hand; the students' names."""
    kit.write_lab(course, TOPIC)
    archive = course / "downloaded" / TOPIC / "archive" / "all.zip"
    archive.parent.mkdir(parents=True)
    right = kit.right_answers(TOPIC)
    with zipfile.ZipFile(archive, "w") as packed:
        for name, answers in zip(names, (right, right | {"iou": "def iou(n):\n    return n / 2\n"}), strict=True):
            late = answers is not right
            info = zipfile.ZipInfo(name, date_time=(2026, 10, 6 if late else 5, 12, 0, 0))
            packed.writestr(info, json.dumps(kit.lab_notebook(TOPIC, answers)))
    (course / "course.toml").write_text(COURSE)
    kit.zip_collect(course, TOPIC)
    students = [record.student for record in grade_course(TOPIC, course, seed="secret", progress=False).records]
    with opened(course) as book:
        grade = book.find_grade("explain", TOPIC, TOPIC, students[0])
        grade.manual_score, grade.needs_manual_grade = 2.5, False
        book.find_comment("explain", TOPIC, TOPIC, students[0]).manual_comment = "Union, <not> sum."
        book.db.commit()
    return students


def grades(course: Path, platform: str) -> tuple[list[list[str]], dict[str, str]]:
    """The rows of the file, and the pages of the zip, that the command writes."""
    done = CliRunner().invoke(app, ["grades", TOPIC, "--course", str(course), f"--{platform}"])
    _, _, waiting = done.stdout.rpartition("to be graded by hand yet: ")
    assert done.exit_code == 1 and waiting.endswith(" (explain)\n")  # the second student's words
    out = course / "grades" / TOPIC
    with zipfile.ZipFile(out / f"{platform}_feedback.zip") as archive:
        pages = {name: archive.read(name).decode() for name in archive.namelist()}
    return list(csv.reader((out / f"{platform}.csv").open())), pages


def test_moodle_gets_its_worksheet_and_pages_by_participant(tmp_path):
    (tmp_path / "roster.csv").write_text(ROSTER)
    collected(tmp_path, MOODLE)
    rows, pages = grades(tmp_path, "moodle")
    late = 0.9 * (TOTAL - 2)
    assert rows == [
        ["Identifier", "Full name", "Email address", "Grade", "Maximum Grade", "Feedback comments"],
        ["Participant 1234567", "Ada Lovelace", "", f"{TOTAL + 2.5:g}", f"{TOTAL + 3}", ""],
        ["Participant 12", "Zoë O'Brien", "zoe@x.org", f"{late:g}", f"{TOTAL + 3}", NOT_FINAL],
    ]
    first, second = pages
    assert first == "Ada Lovelace_1234567_assignsubmission_file_04_iou.html" and second.startswith("Zoë O'Brien_12_")
    assert "explain: 2.5 of 3 points" in pages[first] and "Union, &lt;not&gt; sum." in pages[first]
    assert f"So far: {late:g} of {TOTAL + 3} points" in pages[second] and NOT_FINAL in pages[second]
    assert f"Total: {TOTAL + 2.5:g} of {TOTAL + 3} points" in pages[first] and NOT_FINAL not in pages[first]
    assert "Handed in 1 day late, 10 % less. That is taken off above." in pages[second] and "late" not in pages[first]
    page = tmp_path / f"grades/{TOPIC}/feedback/Ada Lovelace_1234567.html"
    assert page.read_text() == pages[first]  # one page for students, the same everywhere
    with opened(tmp_path) as book:
        submission = book.find_submission(TOPIC, "Zoë O'Brien_12")
        assert (submission.student.first_name, submission.student.last_name) == ("Zoë", "O'Brien")
        assert submission.late_submission_penalty == pytest.approx(0.1 * (TOTAL - 2))
        assert 43200 < submission.total_seconds_late < 43300


def test_canvas_gets_its_columns_and_its_own_names_of_files(tmp_path):
    collected(tmp_path, CANVAS)
    rows, pages = grades(tmp_path, "canvas")
    assert rows[0] == ["Student", "ID", "SIS User ID", "SIS Login ID", "Section", TOPIC]
    assert rows[1][0].strip() == "Points Possible" and rows[1][5] == f"{TOTAL + 3}"
    # The second is not final, which Canvas cannot be told: its cell is empty.
    assert [(row[0], row[1], row[5]) for row in rows[2:]] == [
        ("lovelaceada", "1234", f"{TOTAL + 2.5:g}"),
        ("obrienzoe", "1235", ""),
    ]
    assert list(pages) == ["lovelaceada_1234_567890_04_iou.html", "obrienzoe_LATE_1235_567891_04_iou-2.html"]


EXPORT = "Student,ID,SIS User ID,SIS Login ID,Section,{}\n,,,,,Manual Posting,\n    Points Possible,,,,,7,7\n{}"
PEOPLE = '"Lovelace, Ada",1234,a,ada,S1,,\n'


@pytest.mark.parametrize(
    "columns, settings, number, heading",
    [
        ("04_iou (5511),Quiz (5512)", "", None, "04_iou (5511)"),
        ("04_IoU (5511),Quiz (5512)", "", None, "04_IoU (5511)"),
        ("Lab 4: IoU (5511),Quiz (5512)", "", 5511, "Lab 4: IoU (5511)"),
        ("Lab 4: IoU (5511),Quiz (5512)", '[[canvas]]\nlab = "04_iou"\nassignment = 5511\n', None, "Lab 4: IoU (5511)"),
        ("Lab 4: IoU (5511),Quiz (5512)", "", None, "none has the name 04_iou; name one by --assignment NUMBER"),
        ("Lab 4: IoU (5511),Quiz (5512)", "", 7, "none has the number 7; name one by --assignment NUMBER or in"),
        ("04_iou (5511),04_iou (5512)", "", None, "several have the name 04_iou"),
        ("a,b", "", None, "04_iou"),
        ("a,b", "", 5511, "04_iou (5511)"),
    ],
)
def test_canvas_finds_the_assignment_by_its_number_or_it_is_asked_for(tmp_path, columns, settings, number, heading):
    (tmp_path / "roster.csv").write_text(EXPORT.format(columns, PEOPLE))
    (tmp_path / "course.toml").write_text(settings)
    roster = read_roster(tmp_path)
    assert list(roster) == ["1234"]
    if "name" in heading or "number" in heading:
        with pytest.raises(ValueError, match="assignment: of the columns") as refusal:
            canvas_heading(tmp_path, TOPIC, roster, number)
        assert heading in str(refusal.value) and "(5511)" in str(refusal.value)
    else:
        assert canvas_heading(tmp_path, TOPIC, roster, number) == heading


@pytest.mark.parametrize("odd", ["a ?b", "50% c", "x%3Fy#z"])
def test_a_course_is_graded_whatever_its_path_holds(tmp_path, odd, monkeypatch):
    """And nbgrader, by its configuration here, has the same gradebook."""
    course = tmp_path / odd
    kit.write_lab(course, TOPIC)
    kit.submit(course, "ada", TOPIC, {})
    assert not grade_course(TOPIC, course, seed="secret", progress=False).failures
    with opened(course) as book:
        assert [submission.student.id for submission in book.assignment_submissions(TOPIC)] == ["ada"]
    shutil.copy(ROOT / "nbgrader_config.py", course)
    monkeypatch.chdir(course)
    config = PyFileConfigLoader("nbgrader_config.py", path=str(course)).load_config()
    with Gradebook(CourseDirectory(config=config).db_url) as book:
        assert [submission.student.id for submission in book.assignment_submissions(TOPIC)] == ["ada"]
    assert {path.name for path in tmp_path.iterdir()} == {odd}
    assert [path.name for path in course.glob("*.db")] == ["gradebook.db"]


@pytest.mark.bad_input
def test_what_a_platform_cannot_find_is_refused(tmp_path):
    runner = CliRunner()
    command = ["grades", TOPIC, "--course", str(tmp_path)]
    kit.write_lab(tmp_path, TOPIC)
    assert "`labkit grade 04_iou` makes them" in str(runner.invoke(app, command).exception)
    kit.submit(tmp_path, "ada", TOPIC, {})
    grade_course(TOPIC, tmp_path, seed="secret", progress=False)
    assert "expected students in roster.csv, or names that end with _NUMBER" in str(
        runner.invoke(app, [*command, "--moodle"]).exception
    )
    assert "got more" in str(runner.invoke(app, [*command, "--moodle", "--canvas"]).exception)
    assert runner.invoke(app, command).exit_code == 1  # its words are to be graded by hand
    rows = list(csv.reader((tmp_path / f"grades/{TOPIC}/scores.csv").open()))
    change = change_of(TOPIC, "longer than it looks", points="iou=3.5")
    grade_course(TOPIC, tmp_path, seed="secret", progress=False, change=change)
    said = runner.invoke(app, command).stdout
    assert f"the maximum is {TOTAL + 3 - 2 + 3.5:g} now, and was {TOTAL + 3} in the lab" in said
    assert (rows[1][0], rows[1][3]) == ("ada", "0") and not (tmp_path / f"grades/{TOPIC}/moodle.csv").exists()
