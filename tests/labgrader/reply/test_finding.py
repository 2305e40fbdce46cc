"""Findings as they come back from a worker: as they were written, and nothing else of what anybody may have written."""

import json

import pytest

from labgrader.reply.finding import MOST_FINDINGS, Finding, Span, read_findings, write

PIECES = (("quiet", "import numpy as np"), ("f", "def f(größe):\n    return größe"))
GOOD = {
    "kind": "axis",
    "piece": 1,
    "spans": [{"line": 2, "column": 11, "last_line": 2, "end": 18}],
    "exponent": 0.0,
    "listed": None,
}
SPAN = GOOD["spans"][0]


def test_findings_come_back_as_they_were_written():
    findings = [
        Finding("overflow", 1, (Span(1, 0, 2, 18), Span(2, 4, 2, 10)), 1000.0),
        Finding("axis", 0, (Span(1, 0, 1, 0),), listed=2),
    ]
    assert read_findings(write(findings), PIECES) == findings
    assert len(read_findings(write(findings * 9), PIECES)) == MOST_FINDINGS


@pytest.mark.parametrize(
    "text",
    [
        "", "nothing", "{}", "null", "7", '"axis"', "[[]]", "[null]", "[" * 100_000, "NaN", "[1e999]",
        *(json.dumps([GOOD | change]) for change in (
            {"kind": "riddle"}, {"kind": ["axis"]}, {"kind": None},
            {"piece": 2}, {"piece": -1}, {"piece": 1.0}, {"piece": True}, {"piece": "1"},
            {"exponent": "<b>"}, {"exponent": [1]}, {"exponent": float("nan")}, {"exponent": 10**400},
            {"listed": -1}, {"listed": 1.0}, {"listed": True}, {"listed": "1"},
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
    assert read_findings(text, PIECES) == []


def test_long_lists_are_cut():
    (finding,) = read_findings(json.dumps([GOOD | {"spans": [SPAN] * 10_000}]), PIECES)
    assert len(finding.spans) == 6
