"""Answers in words that are not in their cell: below it, above it, in its place, under another release."""

import json
from pathlib import Path

import grading_course as kit
import pytest

from labgrader.grade.gradebook import opened
from labgrader.grade_course import grade_course
from labgrader.handin.reading import read_lab, read_submission

ROOT = Path(__file__).parents[3]
TOPIC, NAME = "04_iou", "accuracy_and_iou"
MINE, MORE = "Because most pixels are floor.", "So the IoU is *small*."


def text(source: str, kind: str = "markdown") -> dict:
    return {"cell_type": kind, "id": f"new-{len(source)}", "metadata": {}, "source": source.splitlines(True)}


def inserted(at: int, *new: dict):
    """A change that puts cells before or after that of the answer, counted from it."""

    def change(cells: list[dict], answer: int) -> None:
        cells[answer + at : answer + at] = new

    return change


def in_its_place(cells: list[dict], answer: int) -> None:
    cells[answer] = text(MINE)


def without_marks(cells: list[dict], answer: int) -> None:
    cells[answer]["source"] = [MINE]
    for cell in cells:
        cell["metadata"] = {}


def answered_and_more(cells: list[dict], answer: int) -> None:
    cells[answer]["source"] = [MINE]
    cells.insert(answer + 1, text(MORE, "raw"))


def deleted(cells: list[dict], answer: int) -> None:
    del cells[answer]


def elsewhere(cells: list[dict], answer: int) -> None:
    cells.insert(3, text(MINE))


@pytest.mark.parametrize(
    "change, found",
    [
        (inserted(1, text(MINE)), MINE),
        (inserted(1, text(MINE), text(MORE)), f"{MINE}\n\n{MORE}"),
        (inserted(0, text(MINE)), MINE),
        (in_its_place, MINE),
        (without_marks, MINE),
        (answered_and_more, f"{MINE}\n\n{MORE}"),
        (elsewhere, "*Your answer.*"),  # a note of one's own
        (inserted(1, text("  \n")), "*Your answer.*"),
        (deleted, None),
    ],
)
def test_an_answer_in_words_beside_its_cell_is_read(tmp_path, change, found):
    lab = read_lab(ROOT, TOPIC)
    notebook = json.loads((ROOT / f"labs/{TOPIC}/{TOPIC}.ipynb").read_text())
    answer = next(i for i, cell in enumerate(notebook["cells"]) if cell["id"] == NAME)
    change(notebook["cells"], answer)
    kit.submit(tmp_path, "ada", TOPIC, notebook)
    submission = read_submission(tmp_path / "submitted/ada", lab)
    assert submission.cells.get(NAME) == found and not submission.reason
    assert submission.lacks == (() if found else (NAME,))
    assert ("no cell accuracy_and_iou any more" in submission.note) == (found is None)


def test_cells_that_another_release_had_are_no_answer(tmp_path):
    lab = read_lab(ROOT, TOPIC)
    notebook = json.loads((ROOT / f"labs/{TOPIC}/{TOPIC}.ipynb").read_text())
    notebook["metadata"]["labkit"]["version"] = "0.1.0"
    notebook["cells"].append(text("## Sources of then"))
    answer = next(i for i, cell in enumerate(notebook["cells"]) if cell["id"] == NAME)
    notebook["cells"].insert(answer + 1, text("## Sources, as they were then"))
    kit.submit(tmp_path, "ada", TOPIC, notebook)
    assert read_submission(tmp_path / "submitted/ada", lab).cells[NAME] == "*Your answer.*"


@pytest.mark.nightly
def test_it_waits_for_a_person_and_is_shown_in_the_place_of_its_cell(tmp_path):
    kit.write_lab(tmp_path, TOPIC)
    notebook = kit.lab_notebook(TOPIC, None)
    notebook["cells"].append(text(MINE))
    kit.submit(tmp_path, "ada", TOPIC, notebook)
    assert not grade_course(TOPIC, tmp_path, seed="secret", progress=False).failures
    with opened(tmp_path) as book:
        grade = book.find_grade("explain", TOPIC, TOPIC, "ada")
        assert grade.needs_manual_grade and grade.auto_score is None
    shown = json.loads((tmp_path / f"autograded/ada/{TOPIC}/{TOPIC}.ipynb").read_text())["cells"]
    assert "".join(shown[-1]["source"]) == MINE and shown[-1]["id"] == "explain"
