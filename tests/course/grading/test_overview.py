"""The class page: who made which mistake, one sample of each, and one comment for all who made it."""

import csv
import json

import grading_course as kit
import pytest
from typer.testing import CliRunner

from labkit.apps.cli import app
from labkit.course.grading import gradebook
from labkit.course.grading.run import grade_course
from labkit.course.topics import of_topic

TOPIC = "04_iou"
IOU = of_topic(TOPIC)["iou"]
# Two ways to write one mistake that has no hint, and another mistake.
ODD = "def iou(n):\n    return np.sin(1e3 * np.diagonal(n) + n.sum(axis=1) ** 2) ** 2\n"
ODD_TOO = "def iou(c):\n    return np.array([np.sin(1e3 * c[i, i] + c[i].sum() ** 2) ** 2 for i in range(len(c))])\n"
OTHER = "def iou(n):\n    return '</pre><script>alert(1)</script>'\n"
CLASS = {
    "ada": {},
    "ben": {"iou": kit.as_cell(IOU.misconceptions[0].answer, "iou")},
    "cleo": {"iou": kit.as_cell(IOU.misconceptions[0].answer, "iou").replace("\n", "  # mine\n", 1)},
    "dan": {"iou": ODD},
    "eve": {"iou": ODD_TOO},
    "fay": {"iou": OTHER},
    "gus": {"iou": kit.blank(IOU)},
}


@pytest.fixture(scope="module")
def course(tmp_path_factory):
    course = tmp_path_factory.mktemp("course")
    kit.write_lab(course, TOPIC)
    for student, cells in CLASS.items():
        kit.submit(course, student, TOPIC, kit.right_answers(TOPIC) | cells)
    grade_course(TOPIC, course, seed="secret", progress=False)
    return course


def rows(course) -> list[dict]:
    return list(csv.DictReader((course / "grades" / TOPIC / "class.csv").open()))


def group(course, said: str) -> str:
    """The group of which the table says something."""
    (found,) = [row["group"] for row in rows(course) if said in row["says"]]
    return found


def test_each_question_says_how_many_tried_and_passed(course):
    counts = {row["question"]: (int(row["tried"]), int(row["passed"])) for row in rows(course) if not row["group"]}
    assert counts == dict.fromkeys(of_topic(TOPIC), (7, 7)) | {"iou": (6, 1)}


def test_wrong_answers_are_grouped_by_hint_and_else_by_what_they_give(course):
    groups = {row["says"]: (row["students"], row["named"]) for row in rows(course) if row["group"]}
    assert groups.pop(IOU.misconceptions[0].hint) == ("2", "yes")
    assert sorted(groups.values()) == [("1", "no"), ("2", "no")]


def test_the_page_shows_students_and_one_sample_of_each_group_and_nothing_else_of_it_runs(course):
    page = (course / "grades" / TOPIC / "class.html").read_text()
    assert "dan, eve" in page and "1e3 * np.diagonal(n)" in page and "c[i, i]" not in page
    assert "<script>" not in page and "&lt;script&gt;" in page


def test_a_comment_reaches_everybody_in_its_group_and_nobody_else(course):
    name = group(course, IOU.misconceptions[0].hint)
    said = "Look at <page 12>: [$2^3$](x)"
    arguments = ["grade", TOPIC, "--course", str(course), "--comment", name]
    assert CliRunner().invoke(app, [*arguments, said]).exit_code in (0, 1)
    out = course / "grades" / TOPIC
    for student in CLASS:
        expected = student in ("ben", "cleo")
        assert ("Look at &lt;page 12&gt;" in (out / "feedback" / f"{student}.html").read_text()) == expected
        tests = json.loads((out / "results" / student / "results.json").read_text())["tests"]
        assert any(said in test["output"] for test in tests) == expected
        with gradebook.opened(course) as book:
            comment = book.find_comment("iou", TOPIC, TOPIC, student).auto_comment
        assert ("Look at < page 12>: [$2^3$] (x)" in comment) == expected
    assert "Look at" in (out / "class.html").read_text()
    assert CliRunner().invoke(app, [*arguments, ""]).exit_code in (0, 1)
    assert "Look at" not in (out / "feedback" / "ben.html").read_text()


@pytest.mark.bad_input
def test_a_comment_for_no_group_is_said(course):
    with pytest.raises(ValueError, match=r"comment: expected one of the groups iou-\w+, .*got 'iou'"):
        grade_course(TOPIC, course, comment=("iou", "text"), progress=False)
