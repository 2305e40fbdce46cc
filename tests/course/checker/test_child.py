"""The process that looks at a wrong program: whatever that does, the check goes on; and nothing it says is believed."""

import json
import sys
from dataclasses import asdict, replace

import pytest

from labkit.course.checker import child
from labkit.course.checker.finding import MOST_FINDINGS, Finding, Span, read, write
from labkit.course.topics import find

pytestmark = pytest.mark.bad_input  # without the shape checks, as outside the suite
IOU = find("04_iou.iou")
WRONG = "def iou(n):\n    i = np.diag(n)\n    return i / (n.sum(0) + n.sum(1) + i)"


@pytest.fixture(autouse=True)
def patient(monkeypatch):
    """Tests may run beside others: the clock is no limit."""
    monkeypatch.setattr(child, "CLOCK_S", 250.0)


def looked_at(source):
    return child.findings(IOU, (("quiet", "import numpy as np"), ("iou", source)), 0)


def test_a_repair_comes_back():
    found = looked_at(WRONG)[0]
    assert (found.kind, found.piece, found.spans) == ("operator", 1, (Span(3, 35, 3, 38),))


ENDLESS = [
    "while True: pass",
    "def iou(n):\n    while True:\n        try:\n            while True: pass\n        except BaseException: pass",
    "def iou(n):\n    while True: print('x' * 1024)",
]
HOSTILE = [
    "import os\nos._exit(0)",
    "import os\ndef iou(n): os._exit(3)",
    "x = bytearray(8 << 30)\ndef iou(n): return n",
    "def iou(n): return np.ones((n.size + 1000,) * 4)",
    "import sys\ndef iou(n): return float(sys.stdin.read())",
    "def iou(n): return float(input())",
    "raise RuntimeError",
    "raise SystemExit",
    "def iou(n): return iou(n)",
    "def iou(n:",
    "\0",
]


@pytest.mark.parametrize("source", HOSTILE)
def test_whatever_a_program_does_there_is_no_finding_and_the_check_goes_on(source):
    assert looked_at(source) == []


@pytest.mark.parametrize("source", ENDLESS)
def test_what_does_not_end_is_stopped(source, monkeypatch):
    monkeypatch.setattr(child, "CLOCK_S", 3.0)
    assert looked_at(source) == []


def test_files_and_processes_are_refused(tmp_path):
    """Each attempt is refused, and the answer's other mistake is found all the same."""
    target = tmp_path / "made"
    ends = "    i = np.diag(n)\n    return i / (n.sum(0) + n.sum(1) + i)"
    tries = [
        f"open({str(target)!r}, 'w').write('x')",
        f"__import__('pathlib').Path({str(target)!r}).touch()",
        f"__import__('os').mkdir({str(target)!r})",
        f"__import__('os').system('touch {target}')",
        f"__import__('subprocess').run(['touch', {str(target)!r}])",
    ]
    for attempt in tries:
        source = f"def iou(n):\n    try: {attempt}\n    except PermissionError: pass\n{ends}"
        assert looked_at(source) and not target.exists(), attempt


def test_without_a_process_there_is_no_finding(monkeypatch):
    monkeypatch.setattr(sys, "executable", "/no/such/python")
    assert looked_at(WRONG) == []
    monkeypatch.undo()
    monkeypatch.setattr(child, "CLOCK_S", 0.001)
    assert looked_at(WRONG) == []


def test_a_question_that_cannot_be_imported_again_is_left_alone():
    assert child.findings(replace(IOU, points=1), (("quiet", "import numpy as np"), ("iou", WRONG)), 0) == []


# ---------------------------------------------------------------------------------------- what comes back

PIECES = (("quiet", "import numpy as np"), ("f", "def f(größe):\n    return größe"))
GOOD = {"kind": "axis", "piece": 1, "spans": [{"line": 2, "column": 11, "last_line": 2, "end": 18}], "value": 0.0}
SPAN = GOOD["spans"][0]


def test_findings_come_back_as_they_were_written():
    findings = [
        Finding("overflow", 1, (Span(1, 0, 2, 18), Span(2, 4, 2, 10)), 1000.0),
        Finding("axis", 0, (Span(1, 0, 1, 0),)),
    ]
    again = read(write(findings), PIECES)
    assert [asdict(f) for f in again[:1]] == [asdict(f) for f in findings[:1]] and again[1].spans == findings[1].spans
    assert len(read(write(findings * 9), PIECES)) == MOST_FINDINGS


@pytest.mark.parametrize(
    "text",
    [
        "", "nothing", "{}", "null", "7", '"axis"', "[[]]", "[null]", "[" * 100_000, "NaN", "[1e999]",
        *(json.dumps([GOOD | change]) for change in (
            {"kind": "riddle"}, {"kind": ["axis"]}, {"kind": None},
            {"piece": 2}, {"piece": -1}, {"piece": 1.0}, {"piece": True}, {"piece": "1"},
            {"value": "<b>"}, {"value": None}, {"value": [1]},
            {"spans": []}, {"spans": None}, {"spans": {}}, {"spans": "2"}, {"spans": [[2, 0, 2, 1]]}, {"spans": [{}]},
            *({"spans": [SPAN | wrong]} for wrong in (
                {"line": 0}, {"line": 3}, {"last_line": 3}, {"line": 2, "last_line": 1}, {"line": 2.0}, {"line": True},
                {"column": -1}, {"column": 19}, {"end": 19}, {"end": 10**400}, {"column": "0"}, {"column": None},
                {"more": 1}, {"end": 10},
            )),
        )),
        json.dumps([GOOD, {}]),
    ],
)  # fmt: skip
def test_what_nobody_would_write_is_not_read(text):
    assert read(text, PIECES) == []


def test_long_lists_are_cut():
    (finding,) = read(json.dumps([GOOD | {"spans": [SPAN] * 10_000}]), PIECES)
    assert len(finding.spans) == 6
