"""Files that are damaged, locked, missing or renamed: words that say which, and what to do."""

import json
import sqlite3
import warnings
from contextlib import closing
from pathlib import Path

import grading_course as kit
import nbformat
import pytest

from labgrader.grade.batch import Record, secret_for, write_record
from labgrader.grade.gradebook import copy_for_formgrader, fault_of_file, opened
from labgrader.grade.overview import read_comments
from labgrader.grade_course import grade_course
from labgrader.handin.reading import read_lab, read_submissions

TOPIC = "04_iou"


def test_a_gradebook_that_is_none_is_said_to_be_damaged(tmp_path):
    (tmp_path / "gradebook.db").write_bytes(b"no database" * 1000)
    with pytest.raises(ValueError, match=r"gradebook\.db: it is damaged; put back a copy"), opened(tmp_path):
        pass


def test_a_gradebook_that_another_program_writes_is_said_to_be_locked(tmp_path):
    (tmp_path / "gradebook.db").write_bytes(kit.empty_gradebook())
    with closing(sqlite3.connect(tmp_path / "gradebook.db")) as other:
        other.execute("BEGIN EXCLUSIVE")
        with pytest.raises(ValueError, match=r"gradebook\.db: another program is writing it"), opened(tmp_path):
            pass


def test_a_full_disk_is_said_of_the_gradebook(tmp_path):
    """SQLite's limit on pages stands for the disk's: its error is the same."""
    (tmp_path / "gradebook.db").write_bytes(kit.empty_gradebook())
    with pytest.raises(ValueError, match=r"gradebook\.db: the disk is full"), opened(tmp_path) as gradebook:
        gradebook.db.connection().exec_driver_sql("PRAGMA max_page_count = 1")
        for i in range(3000):
            gradebook.add_student(f"student {i}")


def test_an_error_of_another_kind_is_none_of_the_file():
    assert fault_of_file(ValueError("locked")) == ""


def test_a_gradebook_that_is_gone_is_said(tmp_path):
    """There are grades, so that somebody may have graded by hand what a new gradebook does not have."""
    kit.write_lab(tmp_path, TOPIC)
    (tmp_path / "submitted").mkdir()
    how = {"course": tmp_path, "unsafe": True, "progress": False}
    assert not grade_course(TOPIC, **how).new_gradebook
    (tmp_path / "gradebook.db").unlink()
    write_record(tmp_path / "grades" / TOPIC, Record("ada", "no reason", (), True, "digest", "key"))
    graded = grade_course(TOPIC, **how)
    assert graded.new_gradebook and graded.needs_a_look


@pytest.mark.parametrize("content", [b"{", b"[]", b'{"iou-1": 3}', b"\xff", b"[" * 100_000])
def test_damaged_comments_are_named(tmp_path, content):
    (tmp_path / "comments.json").write_bytes(content)
    with pytest.raises(ValueError, match=r"comments\.json: .*delete it"):
        read_comments(tmp_path)


@pytest.mark.parametrize("content", [b"", b"\n", b"\xff\xfe", b"two\nlines", b"\x1b[2J"])
def test_a_damaged_seed_is_named_and_no_new_round_begins(tmp_path, content):
    (tmp_path / "secret_seed").write_bytes(content)
    with pytest.raises(ValueError, match="secret_seed: expected one line of text, it is damaged; --new-round draws"):
        secret_for(tmp_path, None)
    assert (tmp_path / "secret_seed").read_bytes() == content
    assert secret_for(tmp_path, None, new_round=True) != secret_for(tmp_path / "other", None)


def read(course: Path, files: dict[str, dict]):
    """What is read of one student's folder."""
    kit.write_lab(course, TOPIC)
    folder = course / "submitted/ada" / TOPIC
    folder.mkdir(parents=True)
    for name, content in files.items():
        (folder / name).write_text(json.dumps(content))
    (submission,) = read_submissions(course / "submitted", read_lab(course, TOPIC))
    return submission


@pytest.mark.parametrize("name", ["Copy of 04_iou (1).ipynb", "iou final.ipynb", "04_iou.IPYNB.ipynb"])
def test_a_copy_alone_in_the_folder_is_graded_by_the_labs_own_key(tmp_path, name):
    submission = read(tmp_path, {name: kit.lab_notebook(TOPIC, kit.right_answers(TOPIC))})
    assert not submission.reason and submission.file == name and "iou" in submission.cells


def test_the_labs_own_name_is_not_said(tmp_path):
    lab = kit.lab_notebook(TOPIC)
    assert read(tmp_path, {f"{TOPIC}.ipynb": lab, "other.ipynb": lab}).file == ""


@pytest.mark.parametrize(
    "files, says",
    [
        ({}, "the folder 04_iou holds no 04_iou.ipynb: it is empty"),
        ({"notes.txt": {}, "timestamp.txt": {}}, "it holds notes.txt; expected a notebook"),
        (
            {f"{i}.ipynb": {} for i in range(5)},
            "it holds 0.ipynb, 1.ipynb, 2.ipynb, ...; name the one to be graded in [[notebook]]",
        ),
        ({"a\x1b[2J.txt": {}}, r"it holds a\x1b[2J.txt;"),
        ({"other.ipynb": kit.notebook([kit.code_cell("def iou(n): ...")])}, "and other.ipynb is no copy of that lab"),
    ],
)
def test_a_folder_without_the_lab_names_what_is_there(tmp_path, files, says):
    assert says in read(tmp_path, files).reason


def test_equal_ids_of_a_students_cells_reach_no_file_that_nbformat_reads_and_warns_of(tmp_path):
    """The copy for formgrader and feedback has the lab's ids, which differ, so nothing is printed for each reading."""
    kit.write_lab(tmp_path, TOPIC)
    notebook = kit.lab_notebook(TOPIC, kit.right_answers(TOPIC)) | {"nbformat": 4, "nbformat_minor": 5}
    for cell in notebook["cells"]:
        cell["id"] = "same"
    kit.submit(tmp_path, "ada", TOPIC, notebook)
    lab = read_lab(tmp_path, TOPIC)
    for number, cell in enumerate(lab.notebook["cells"]):
        cell["id"] = f"cell-{number}"
    lab.notebook["nbformat_minor"] = 5
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        (submission,) = read_submissions(tmp_path / "submitted", lab)
        copied = copy_for_formgrader(lab, Record("ada", "", (), True, "d", "k"), submission, {}, {})
        nbformat.reads(copied.decode(), as_version=4)
    assert not submission.reason and "same" not in {cell["id"] for cell in json.loads(copied)["cells"]}
