"""The grader looks at a wrong answer in a sandbox of its own: its line is told, and what it says is checked."""

import numpy as np
import pytest

from labgrader.course import find
from labgrader.grade.grade import explained
from labgrader.program.slice import Program
from labgrader.run.run import Limits, Run, public_cases
from labgrader.sandbox.sandbox import fresh_worker

NO_AXIS = """import numpy as np

def iou(n):
    tp = np.diagonal(n)
    return tp / (n.sum(axis=0) + n.sum() - tp)
"""
FORGES = """import json, sys
import numpy as np

def iou(n):
    module = sys.modules["labgrader.reply.repair_job"]
    span = {"line": 1, "column": 0, "last_line": 1, "end": 9999}
    entry = {"kind": "axis", "piece": 0, "spans": [span], "exponent": None, "listed": None}
    module.write = lambda found: json.dumps([entry, entry | {"kind": "<b>"}])
    return n.sum(axis=0)
"""
LEAVES = "import os\n\ndef iou(n):\n    os._exit(0)\n"


def run_of(source: str) -> Run:
    limits = Limits(question_s=1.0 if "while" in source else 200.0)
    return Run(find("04_iou.iou"), Program((("iou", source),)), fresh_worker, limits)


def test_the_students_line_is_told():
    with run_of(NO_AXIS) as answer:
        told = explained(answer, answer.judge(public_cases(answer.question))[0])
    assert told.named and "axis" in told.hint
    *case, line, marks = told.shown.split("\n")
    assert case[0].startswith("iou(") and "line 5" in line and marks.split() == ["^^^^^^^"]


@pytest.mark.parametrize("source", [FORGES, LEAVES, "def iou(n):\n    while True: pass\n", "def iou("])
def test_what_cannot_be_believed_or_does_not_come_is_no_finding(source):
    with run_of(source) as answer:
        told = explained(answer, answer.judge(public_cases(answer.question))[0])
    assert not told.failed and "axis" not in told.hint


def test_a_list_of_numbers_is_an_array_for_the_grader_as_for_the_check():
    source = NO_AXIS.replace("sum() - tp", "sum(axis=1) - tp").replace("return tp", "return list(tp").rstrip() + ")\n"
    with run_of(source) as answer:
        judged, outputs = answer.judge(public_cases(answer.question))
    assert judged.passed and isinstance(outputs[0], np.ndarray)
