"""What is about persons stays out of git, of bundles and of others' pages, and a student can be forgotten."""

import json
import subprocess
import zipfile
from dataclasses import replace
from pathlib import Path

import grading_course as kit
import pytest

from labgrader.grade.batch import Record, write_record
from labgrader.grade.grade import Result
from labgrader.grade.gradebook import opened, register
from labgrader.handin.reading import read_lab
from labgrader.handin.roster import read_roster
from labgrader.release.bundle import is_left_over
from labgrader.report.forget import forget, keep_out_of_git, mentions
from labgrader.report.outputs import write_outputs

ROOT = Path(__file__).parents[3]
TOPIC = "04_iou"
ADA, BEN = "Ada Lovelace_1234567", "Ben Ng_7654321"
THERE = {
    "roster.csv": "id,name,email\n1234567,Ada Lovelace,ada@x.org\n7654321,Ben Ng,ben@x.org\n",
    "course.toml": '[[extension]]\nlab = "04_iou"\nstudent = "1234567"\nlate_days = 0\nreason = "ill"\n\n'
    '[[deadline]]\nlab = "04_iou"\ndue = 2026-10-05\n',
    "changes.json": "{}",
    f"submitted/{ADA}/{TOPIC}/{TOPIC}.ipynb": "{}",
    f"downloaded/{TOPIC}/archive/all.txt": ADA,
    f"grades/{TOPIC}/records/{ADA}.json": "{}",
    "gradebook.db-journal": ADA,
}


def write(folder: Path, files: dict[str, str]) -> None:
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)


def git(folder: Path, *words: str) -> str:
    return subprocess.run(["git", *words], cwd=folder, capture_output=True, text=True, check=True).stdout


def test_git_takes_nothing_of_a_checkout_that_is_about_persons(tmp_path):
    git(tmp_path, "init", "-q")
    write(tmp_path, THERE | {".gitignore": (ROOT / ".gitignore").read_text(), "README.md": "x"})
    git(tmp_path, "add", "-A")
    assert git(tmp_path, "ls-files").split() == [".gitignore", "README.md"]


def test_grading_keeps_it_out_of_a_course_with_a_repository_of_its_own(tmp_path):
    git(tmp_path, "init", "-q")
    write(tmp_path, THERE | {".gitignore": "*.pyc"})
    added = keep_out_of_git(tmp_path)
    git(tmp_path, "add", "-A")
    assert git(tmp_path, "ls-files").split() == [".gitignore"] and "/roster.csv" in added
    assert (tmp_path / ".gitignore").read_text().startswith("*.pyc\n/") and keep_out_of_git(tmp_path) == []


def test_a_bundle_takes_none_of_it():
    assert all(is_left_over(name) for name in THERE)


@pytest.fixture
def course(tmp_path):
    """A class of two after grading, collecting, a comment and an extension; no answer is run for it."""
    kit.write_lab(tmp_path, TOPIC)
    write(tmp_path, {name: THERE[name] for name in ("roster.csv", "course.toml")})
    lab, out = read_lab(tmp_path, TOPIC), tmp_path / "grades" / TOPIC
    wrong = Result("iou", 0.0, 2.0, "wrong", behaviour="b", program="def iou(): pass")
    records = [
        Record(name, "", (replace(wrong, program=f"# of {name}"),), True, "digest", "key") for name in (ADA, BEN)
    ]
    for record in records:
        write_record(out, record)
    register(tmp_path, lab)
    with opened(tmp_path) as book:
        for name, first in ((ADA, "Ada"), (BEN, "Ben")):
            book.add_student(name, first_name=first)
            book.add_submission(TOPIC, name)
    write_outputs(out, lab, records, {})
    (out / "comments.json").write_text(json.dumps({"iou-1": "as Ada Lovelace asked", "iou-2": "divide"}))
    (out / "alike.html").write_text(f"<h2>{ADA} and Cher_5</h2>")
    write(tmp_path, {"grades/course/course.html": "Ada Lovelace", "grades/course/moodle.csv": "Ada Lovelace,ada@x.org"})
    (out / "moodle.csv").write_text("Identifier,Full name\nParticipant 1234567,Ada Lovelace\n")
    with zipfile.ZipFile(out / "moodle_feedback.zip", "w") as packed:
        packed.writestr(f"{ADA}_assignsubmission_file_{TOPIC}.html", "x")
    for step in ("submitted", "autograded", "feedback"):
        for name in (ADA, BEN):
            write(tmp_path, {f"{step}/{name}/{TOPIC}/{TOPIC}.ipynb": "{}"})
    for name in (ADA, BEN):
        write(tmp_path, {f"downloaded/{TOPIC}/extracted/all/{name}_assignsubmission_file_/{TOPIC}.ipynb": "{}"})
    return tmp_path


def holding(folder: Path, *words: str) -> list[str]:
    """The files whose name or bytes hold a word."""
    files = [path for path in folder.rglob("*") if path.is_file()]
    return [
        str(path)
        for path in files
        if any(w in str(path.relative_to(folder)) or w.encode() in path.read_bytes() for w in words)
    ]


@pytest.mark.parametrize("asked", [ADA, "1234567"])
def test_a_student_who_is_forgotten_is_in_no_file(course, asked):
    others = len(holding(course, BEN, "7654321"))
    assert len(holding(course, "Ada", "1234567")) > 8
    done = forget(course, asked)
    assert holding(course, "Ada", "1234567", "ada@x.org") == []
    places = (
        "submitted",
        "autograded",
        "feedback",
        "extracted",
        "records",
        "gradebook.db",
        "roster.csv",
        "course.toml",
    )
    assert all(any(place in line for line in done) for place in (*places, "comments.json", "results", "class.html"))
    assert list(read_roster(course)) == ["7654321"] and "[[deadline]]" in (course / "course.toml").read_text()
    gone = ("grades.csv", "class.html")  # of the class, made anew by the next grading
    assert others - len(holding(course, BEN, "7654321")) == len(gone)
    with pytest.raises(ValueError, match="no student matches"):
        forget(course, asked)


def test_a_page_writes_a_name_otherwise_and_is_found_all_the_same(tmp_path):
    (tmp_path / "alike.html").write_text("<h2>Zoë O&#x27;Brien_12</h2>")
    assert mentions(tmp_path / "alike.html", {"Zoë O'Brien_12"})
    assert not mentions(tmp_path / "alike.html", {"Zoë O'Brien_1"})


def test_a_zip_that_holds_the_student_is_named(course):
    write(course, {f"downloaded/{TOPIC}/archive/x": ""})
    with zipfile.ZipFile(course / f"downloaded/{TOPIC}/archive/all.zip", "w") as packed:
        packed.writestr(f"{ADA}_assignsubmission_file_/{TOPIC}.ipynb", "x")
    assert any("all.zip" in line and line.startswith("still in") for line in forget(course, ADA))


def test_a_page_of_feedback_names_no_other_student(course):
    for mine, other in ((ADA, ("Ben", "7654321")), (BEN, ("Ada", "1234567"))):
        out = course / "grades" / TOPIC
        for path in (out / f"feedback/{mine}.html", *(out / "results" / mine).iterdir()):
            assert not any(word in path.read_text() for word in other)
