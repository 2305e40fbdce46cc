"""From the zip that a learning platform gives, through nbgrader's zip_collect, to grades."""

import json
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import grading_course as kit
import pytest

from labkit.course.grading.collect import handed_in, marked_late, student_and_notebook
from labkit.course.grading.run import grade_course
from labkit.course.topics import of_topic

ROOT = Path(__file__).parents[3]
TOPIC = "04_iou"
TOTAL = sum(question.points for question in of_topic(TOPIC).values())
MOODLE = {
    "Ada Lovelace_1234567_assignsubmission_file_/04_iou.ipynb": True,
    "Zoë Müller_1234568_assignsubmission_file_/04_iou (1).ipynb": False,
    "Ada Lovelace_7654321_assignsubmission_file_/04_iou.ipynb": False,  # another of that name
    "Ada Lovelace_7654321_assignsubmission_file_/notes.txt": None,
}
MOODLE_FLAT = {name.replace("file_/", "file_"): right for name, right in MOODLE.items()}
CANVAS = {
    "lovelaceada_1234_567890_04_iou.ipynb": True,
    "mullerzoe_LATE_1235_567891_04_iou-2.ipynb": False,
    "mullerzoe_LATE_1235_567892_04_iou-3.ipynb": True,  # a second one: it stops nobody
    "lovelaceada_4321_567893_04_iou.ipynb": False,
    "sneaky_1_2_..%2f..%2fetc.ipynb": None,
}


@pytest.mark.parametrize(
    "files, students",
    [
        (MOODLE, ("Ada Lovelace_1234567", "Ada Lovelace_7654321", "Zoë Müller_1234568")),
        (MOODLE_FLAT, ("Ada Lovelace_1234567", "Ada Lovelace_7654321", "Zoë Müller_1234568")),
        (CANVAS, ("lovelaceada_1234", "lovelaceada_4321", "mullerzoe_1235")),
    ],
    ids=["Moodle", "Moodle without folders", "Canvas"],
)
def test_a_zip_becomes_grades(tmp_path, files, students):
    kit.write_lab(tmp_path, TOPIC)
    shutil.copy(ROOT / "nbgrader_config.py", tmp_path)
    right = kit.lab_notebook(TOPIC, kit.right_answers(TOPIC))
    archive = tmp_path / "downloaded" / TOPIC / "archive" / "all.zip"
    archive.parent.mkdir(parents=True)
    with zipfile.ZipFile(archive, "w") as packed:
        for name, is_right in files.items():
            packed.writestr(name, json.dumps(right if is_right else kit.lab_notebook(TOPIC, {})))
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    collect = [sys.executable, "-m", "nbgrader", "zip_collect", TOPIC]
    done = subprocess.run(collect, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    records = {record.student: record for record in grade_course(TOPIC, tmp_path, progress=False).records}
    assert set(students) <= records.keys()
    assert records[students[0]].points == TOTAL and records[students[1]].points == records[students[2]].points == 0.0


GRACE = "Grace Hopper_7654321_assignsubmission_file_04_iou.ipynb"  # what others may call their files


@pytest.mark.parametrize(
    "name, student",
    [
        (f"Eve Adams_1111111_assignsubmission_file_{GRACE}", "Eve Adams_1111111"),
        (f"Eve Adams_1111111_assignsubmission_file_/{GRACE}", "Eve Adams_1111111"),
        (f"Eve Adams_1111111_assignsubmission_file_/{GRACE}/04_iou.ipynb", "Eve Adams_1111111"),
        (f"adamseve_1235_567891_{GRACE}", "adamseve_1235"),
        ("adamseve_LATE_1235_567891_hoppergrace_7654_1_04_iou.ipynb", "adamseve_1235"),
        ("adamseve_LATE_1235_567891_x_1235_assignsubmission_file_04_iou.ipynb", "adamseve_1235"),
        ("adamseve_1235_567891_x\\hoppergrace_7654_1_04_iou.ipynb", "adamseve_1235"),
    ],
)
def test_the_name_that_a_student_gives_a_file_makes_nobody_else_of_them(tmp_path, name, student):
    path = tmp_path / "downloaded" / TOPIC / "extracted/all" / name
    path.parent.mkdir(parents=True)
    path.touch()
    assert student_and_notebook(str(path))[0] == student
    assert marked_late(tmp_path, TOPIC) == ({student} if "_LATE_" in name else set())
    assert handed_in(path) == ""  # there is no zip
