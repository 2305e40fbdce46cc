"""One class in three ways: a hub's exchange, Moodle's zip and Canvas's zip give each student the same points.

Each student is of a kind of hand-in that once was lost, or graded as another one.
"""

import csv
import io
import json
import os
import zipfile
from pathlib import Path

import grading_course as kit
import pytest
from nbgrader.coursedir import CourseDirectory

from labgrader.grade_course import grade_course
from labgrader.handin.exchange import OwnersCollect
from labgrader.report.outputs import terminal_table
from labgrader.report.platforms import write_grades

ROOT = Path(__file__).parents[3]
TOPIC = "04_iou"
TOTAL = sum(question.points for question in kit.asked(TOPIC).values())
IOU = kit.asked(TOPIC)["iou"].points
RIGHT = kit.right_answers(TOPIC)
WRONG = RIGHT | {"iou": "def iou(n):\n    return n / 2\n"}
COURSE = f"""
[[deadline]]
lab = "{TOPIC}"
due = 2026-10-05T12:00:00
penalty_per_day = 10
"""
EXTENSION = '[[extension]]\nlab = "04_iou"\nstudent = "{}"\ndue = 2026-10-12T12:00:00\nreason = "ill"\n'


def with_cells(change) -> dict:
    notebook = kit.lab_notebook(TOPIC, RIGHT)
    change(notebook["cells"])
    return notebook


def copied(cells: list[dict]) -> None:
    """A wrong try above, with the same grade id."""
    at = next(i for i, cell in enumerate(cells) if cell["id"] == "iou")
    cells.insert(at, kit.code_cell(WRONG["iou"], "iou", solution=True) | {"id": "first-try"})


def pressed_m(cells: list[dict]) -> None:
    next(cell for cell in cells if cell["id"] == "iou")["cell_type"] = "markdown"


def with_outputs(cells: list[dict]) -> None:
    cells[0]["outputs"] = [{"output_type": "display_data", "data": {"image/png": "x" * (21 << 20)}}]


def zipped(files: dict[str, bytes]) -> bytes:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as packed:
        for name, data in files.items():
            packed.writestr(name, data)
    return content.getvalue()


def saved(answers: dict) -> bytes:
    return json.dumps(answers if "cells" in answers else kit.lab_notebook(TOPIC, answers)).encode()


OLD = json.dumps({"metadata": {}, "nbformat": 3, "nbformat_minor": 0, "worksheets": [{"cells": []}]}).encode()
CONFLICT = saved(RIGHT).replace(b'{"cells"', b'<<<<<<< HEAD\n{"cells"').replace(b'"nbformat"', b'\n=======\n"nbformat"')
CHECKPOINTED = {"iou/04_iou.ipynb": saved(RIGHT), "iou/.ipynb_checkpoints/04_iou-checkpoint.ipynb": saved({})}
# Of each kind the files with the day of each, the last of them as a hub's exchange gets it (None: the same bytes), and
# the points, or what the table says in their place.
KINDS = {
    "right": ({"04_iou.ipynb": (saved(RIGHT), 4)}, None, TOTAL),
    "the older is worse": (
        {"04_iou.ipynb": (saved(WRONG), 3), "04_iou final.ipynb": (saved(RIGHT), 4)},
        None,
        TOTAL,
    ),
    "the older is blank": ({"04_iou.ipynb": (saved({}), 3), "04_iou (2).ipynb": (saved(RIGHT), 4)}, None, TOTAL),
    "a cell copied to try again": ({"04_iou.ipynb": (saved(with_cells(copied)), 4)}, None, TOTAL),
    "a cell made Markdown": ({"04_iou.ipynb": (saved(with_cells(pressed_m)), 4)}, None, TOTAL - IOU),
    "as text": ({"04_iou.ipynb.txt": (saved(WRONG), 4)}, ("04_iou.ipynb", saved(WRONG)), TOTAL - IOU),
    "a zip of the folder": (
        {"lab.zip": (zipped(CHECKPOINTED), 4)},
        ("04_iou.ipynb", saved(RIGHT)),
        TOTAL,
    ),
    "late": ({"04_iou.ipynb": (saved(RIGHT), 6)}, None, 0.9 * TOTAL),
    "late with an extension": ({"04_iou.ipynb": (saved(RIGHT), 6)}, None, TOTAL),
    "a PDF": ({"report.pdf": (b"%PDF-1.7", 4)}, None, "report.pdf"),
    "empty": ({"04_iou.ipynb": (b"", 4)}, None, "it is empty"),
    "git's marks": ({"04_iou.ipynb": (CONFLICT, 4)}, None, "it has git's conflict marks, the first in line 1"),
    "format 3": ({"04_iou.ipynb": (OLD, 4)}, None, "it is a notebook of format 3"),
    "nothing": ({}, None, "handed in nothing"),
    "large outputs": ({"04_iou.ipynb": (saved(with_cells(with_outputs)), 4)}, None, TOTAL),
}


def people(count: int) -> dict[str, str]:
    """The kind of each student, by number; kinds come again and again, but what is large comes once."""
    kinds = [kind for kind in KINDS if kind != "large outputs"]
    return {str(101 + i): "large outputs" if i + 1 == count else kinds[i % len(kinds)] for i in range(count)}


def by_exchange(course: Path, of: dict[str, str]) -> None:
    for number, kind in of.items():
        files, other, _ = KINDS[kind]
        for i, (name, (data, day)) in enumerate(files.items()):
            folder = course / f"exchange/kit/inbound/u_{number}+{TOPIC}+2026-10-{day:02} 10:00:00 UTC+r{i}"
            folder.mkdir(parents=True)
            name, data = other or (f"{TOPIC}.ipynb" if name.endswith(".ipynb") else name, data)
            (folder / name).write_bytes(data)
            (folder / "timestamp.txt").write_text(f"2026-10-{day:02} 10:00:00 UTC")
    directory = CourseDirectory(root=str(course), course_id="kit", assignment_id=TOPIC)
    OwnersCollect(coursedir=directory, root=str(course / "exchange"), check_owner=False).start()


def by_zip(course: Path, of: dict[str, str], platform: str) -> None:
    archive = course / "downloaded" / TOPIC / "archive" / "all.zip"
    archive.parent.mkdir(parents=True)
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as packed:
        for number, kind in of.items():
            for i, (name, (data, day)) in enumerate(KINDS[kind][0].items()):
                when, late = (2026, 10, day, 10, 0, 0), "LATE_" if day > 5 else ""
                path = f"Zoë Lovelace_{number}_assignsubmission_file_/{name}"
                if platform == "Canvas":
                    when, path = (1980, 1, 1, 0, 0, 0), f"lovelacezoe_{late}{number}_{9 * int(number) + i}_{name}"
                packed.writestr(zipfile.ZipInfo(path, when), data)
    os.utime(archive, (1_791_331_200, 1_791_331_200))  # 7 October 2026: the extension is not over
    assert "no match information" not in kit.zip_collect(course, TOPIC)


def outcome(course: Path, of: dict[str, str], collect) -> dict[str, object]:
    """By student's number the points in the end, or what the table says in their place."""
    kit.write_lab(course, TOPIC)
    roster = "".join(f"{number},Zoë Lovelace {number},z{number}@x.org\n" for number in of)
    (course / "roster.csv").write_text(f"id,name,email\n{roster}")
    extended = [EXTENSION.format(number) for number, kind in of.items() if kind == "late with an extension"]
    (course / "course.toml").write_text(COURSE + "".join(extended))
    collect(course, of)
    graded = grade_course(TOPIC, course, seed="secret", workers=2, progress=False)
    table = terminal_table(graded.lab, graded.records, graded.told, graded.absent).splitlines()
    written = write_grades(course, TOPIC, "scores")
    with (course / "grades" / TOPIC / "scores.csv").open() as file:
        found: dict[str, object] = {row["student"][-3:]: float(row["score"]) for row in csv.DictReader(file)}
    for number, kind in of.items():
        line = next(line for line in table if number in line)
        expected = KINDS[kind][2]
        if isinstance(expected, str) and number not in found and expected in line:
            found[number] = expected
            assert any(number in name and expected in why for name, why in written.without.items())
        assert (
            ("not 2026-10-03" in line or f"not {9 * int(number)}, " in line)
            or not kind.startswith("the older")
            or "u_" in line
        )
    return found


@pytest.mark.parametrize("count, share", [(len(KINDS), 3), pytest.param(40, 1, marks=pytest.mark.nightly)])
def test_a_class_has_the_same_points_whichever_way_it_hands_in(tmp_path, count, share):
    """By day each way brings a third of the kinds, at night all."""
    of = people(count)
    ways = {"exchange": by_exchange}
    ways |= {name: lambda course, of, name=name: by_zip(course, of, name) for name in ("Moodle", "Canvas")}
    for i, (name, collect) in enumerate(ways.items()):
        theirs = dict([*of.items()][i % share :: share])
        expected = {n: e if isinstance(e := KINDS[kind][2], str) else pytest.approx(e) for n, kind in theirs.items()}
        (tmp_path / name).mkdir()
        assert outcome(tmp_path / name, theirs, collect) == expected, name
