"""The grader looks at a wrong answer in a sandbox of its own: its line is told, and what it says is checked."""

import numpy as np
import pytest

from labkit.course.checker.program import Program
from labkit.course.grading.grade import looked_at
from labkit.course.grading.isolated import Run, public_cases
from labkit.course.grading.sandbox import Limits
from labkit.course.grading.tell import Told
from labkit.course.topics import find

WRONG_AXIS = """import numpy as np

def iou(n):
    tp = np.diagonal(n)
    return tp / (n.sum(axis=0) + n.sum(axis=0) - tp)
"""
FORGES = """import json, sys
import numpy as np

def iou(n):
    module = sys.modules.get("labkit.course.checker.look")
    if module is not None:
        span = {"line": 1, "column": 0, "last_line": 1, "end": 9999}
        entry = {"kind": "axis", "piece": 0, "spans": [span], "value": 0}
        module.write = lambda found: json.dumps([entry, {"kind": "<b>", "piece": 0, "spans": [], "value": 0}])
    return n.sum(axis=0)
"""
LEAVES = "import os\n\ndef iou(n):\n    os._exit(0)\n"


def run_of(source: str) -> Run:
    limits = Limits(question_s=1.0 if "while" in source else 200.0)
    return Run(find("04_iou.iou"), Program((("iou", source),)), limits, unsafe=False)


def test_the_students_line_is_told():
    told = looked_at(Told(shown="the case"), run_of(WRONG_AXIS), values_are_right=False)
    assert told.named and "axis" in told.hint
    case, line, marks = told.shown.split("\n")
    assert case == "the case" and "line 5" in line and marks.split() == ["^", "^"]


@pytest.mark.parametrize("source", [FORGES, LEAVES, "def iou(n):\n    while True: pass\n", "def iou("])
def test_what_cannot_be_believed_or_does_not_come_is_no_finding(source):
    told = Told(hint="as before")
    assert looked_at(told, run_of(source), values_are_right=False) is told


def test_a_list_of_numbers_is_an_array_for_the_grader_as_for_the_check():
    source = WRONG_AXIS.replace("axis=0) - tp", "axis=1) - tp").replace("return tp", "return list(tp").rstrip() + ")\n"
    judged, outputs = run_of(source).judged(public_cases(find("04_iou.iou")))
    assert judged.passed and isinstance(outputs[0], np.ndarray)
