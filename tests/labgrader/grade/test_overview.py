"""The class page: who made which mistake, one sample of each, one comment for all who made it; and a second look."""

import csv
import json
import re
from dataclasses import replace
from functools import partial

import grading_course as kit
import numpy as np
import pytest
from scipy.stats import pointbiserialr
from typer.testing import CliRunner

from labcli.cli import app
from labgrader import grade_course as run
from labgrader.comparison import Problem
from labgrader.course import of_topic
from labgrader.grade import gradebook
from labgrader.grade.batch import Record
from labgrader.grade.grade import Result, behaviour_of
from labgrader.grade.overview import discrimination
from labgrader.grade_course import grade_course
from labgrader.run.run import Limits

TOPIC = "04_iou"
LIMITS = Limits(case_s=0.4)
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
    "hal": {"iou": "def iou(n):\n    return n[\n"},
    "ida": {"iou": "def iou(n):\n    return np.array(open('iou.txt').read())\n"},
    "jim": {"iou": "import os\ndef iou(n):\n    os.system('rm -rf ~')\n    while True:\n        pass\n"},
}


@pytest.fixture(scope="module")
def course(tmp_path_factory):
    course = tmp_path_factory.mktemp("course")
    kit.write_lab(course, TOPIC)
    for student, cells in CLASS.items():
        kit.submit(course, student, TOPIC, kit.right_answers(TOPIC) | cells)
    grade_course(TOPIC, course, seed="secret", progress=False, limits=LIMITS)
    return course


def rows(course) -> list[dict]:
    return list(csv.DictReader((course / "grades" / TOPIC / "class.csv").open()))


def group(course, said: str) -> str:
    """The group of which the table says something."""
    (found,) = [row["group"] for row in rows(course) if said in row["says"]]
    return found


def test_each_question_says_how_many_tried_and_passed(course):
    counts = {row["question"]: (int(row["tried"]), int(row["passed"])) for row in rows(course) if not row["group"]}
    assert counts == dict.fromkeys(kit.asked(TOPIC), (10, 10)) | {"iou": (9, 1)}


def test_wrong_answers_are_grouped_by_hint_and_else_by_what_they_give(course):
    groups = {row["says"]: (row["students"], row["named"]) for row in rows(course) if row["group"]}
    assert groups.pop(IOU.misconceptions[0].hint) == ("2", "yes")
    not_run = [says for says in groups if "not Python" in says or "opens no file" in says]
    assert [groups.pop(says) for says in not_run] == [("1", "yes")] * 2
    assert sorted(students for students, _ in groups.values()) == ["1", "1", "2"] and ("2", "no") in groups.values()


def test_an_exception_on_another_line_is_the_same_mistake():
    third, fourth = ([Problem("exception", "it raises KeyError: 7", ((line, "0"),))] for line in (3, 4))
    assert behaviour_of(third) == behaviour_of(fourth) != behaviour_of([Problem("exception", "it raises KeyError")])


def test_time_outs_refused_and_syntax_errors_are_counted_as_what_they_are(course):
    (iou,) = [row for row in rows(course) if row["question"] == "iou" and not row["group"]]
    assert [iou[kind] for kind in ("time", "refused", "syntax")] == ["1", "1", "1"]


def test_discrimination_is_the_point_biserial_correlation_with_the_rest():
    """SciPy is the oracle; a question that all have right, or the only one, has none."""
    rng = np.random.default_rng(5)
    right = rng.random((40, 4)) < np.linspace(0.2, 0.9, 40)[:, None]
    right[:, 3] = True
    names, worth = ("a", "b", "c", "d"), np.array([1.0, 2.0, 3.0, 2.0])
    records = [
        Record(
            f"s{i}",
            "",
            tuple(Result(n, float(w * r), w, "", right=bool(r)) for n, w, r in zip(names, worth, row, strict=True)),
            True,
            "",
            "",
        )
        for i, row in enumerate(right)
    ]
    for k, name in enumerate(names[:3]):
        rest = (right * worth).sum(axis=1) - right[:, k] * worth[k]
        assert discrimination(name, records) == pytest.approx(pointbiserialr(right[:, k], rest).statistic, abs=1e-12)
    assert discrimination("d", records) is None and discrimination("a", records[:1]) is None
    assert discrimination("a", [replace(one, results=one.results[:1]) for one in records]) is None


def test_an_attempt_stands_in_the_table_as_such_and_on_no_students_page(course):
    page, out = (course / "grades" / TOPIC / "class.html").read_text(), course / "grades" / TOPIC
    assert "jim, iou: os.system (line 3)" in page and page.count("<li>") == 1
    with (out / "grades.csv").open() as table:
        flagged = [row["student"] for row in csv.DictReader(table) if row["look_at"].startswith("suspicious code: ")]
    assert flagged == ["jim"] and "attempt" not in (out / "feedback/jim.html").read_text()


@pytest.mark.parametrize("student, says", [("dan", "returns "), ("hal", "look at line"), ("fay", "expected")])
def test_a_second_look_shows_program_cases_and_replies_by_the_key_of_a_students_page(course, student, says):
    page = (course / "grades" / TOPIC / f"feedback/{student}.html").read_text()
    (key,) = re.findall("<code>(iou-.*?)</code>", page)
    done = CliRunner().invoke(app, ["grade", TOPIC, "--course", str(course), "--look", key])
    assert done.exit_code == 0 and f"{student}, {TOPIC}.iou" in done.stdout
    lines = CLASS[student]["iou"].splitlines()
    assert all(line in done.stdout for line in lines)
    replies = re.findall(r"^(public|secret) case \d+: ", done.stdout, re.MULTILINE)
    assert ("numbered without blank ones" in done.stdout) == (student != "hal")
    assert says in done.stdout and {*replies} == (set() if student == "hal" else {"public", "secret"})


def test_a_second_look_shows_the_points_that_count(course):
    """After a change for everybody, and after a person's points."""
    page = (course / "grades" / TOPIC / "feedback/dan.html").read_text()
    (key,) = re.findall("<code>(iou-.*?)</code>", page)
    change = {"lab": TOPIC, "question": "iou", "everybody": True, "date": "2026-10-05", "reason": "unclear"}
    (course / "changes.json").write_text(json.dumps([change]))
    with gradebook.opened(course) as book:
        book.find_grade("check_iou", TOPIC, TOPIC, "dan").manual_score = 1.5
        book.db.commit()
    try:
        said = CliRunner().invoke(app, ["grade", TOPIC, "--course", str(course), "--look", key]).stdout
    finally:
        (course / "changes.json").unlink()
        with gradebook.opened(course) as book:
            book.find_grade("check_iou", TOPIC, TOPIC, "dan").manual_score = None
            book.db.commit()
    assert "2 of 2 points: " in said and "Everybody has these points: unclear" in said
    assert "A person gave it 1.5 points, which count." in said


@pytest.mark.bad_input
def test_a_key_of_nobody_is_said(course):
    done = CliRunner().invoke(app, ["grade", TOPIC, "--course", str(course), "--look", "iou-\x1b"])
    assert "look: expected the key of an answer" in str(done.exception) and "\x1b" not in str(done.exception)


def test_the_page_shows_students_and_one_sample_of_each_group_and_nothing_else_of_it_runs(course):
    page = (course / "grades" / TOPIC / "class.html").read_text()
    assert "dan, eve" in page and "1e3 * np.diagonal(n)" in page and "c[i, i]" not in page
    assert "<script>" not in page and "&lt;script&gt;" in page


def test_a_comment_reaches_everybody_in_its_group_and_nobody_else(course, monkeypatch):
    monkeypatch.setattr(run, "grade_course", partial(grade_course, limits=LIMITS))  # else all are graded again
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
        grade_course(TOPIC, course, comment=("iou", "text"), limits=LIMITS, progress=False)
