"""What is told about wrong answers is found in a process that may end, and then costs a hint and no more."""

import os

import grading_course as kit
import numpy as np
import pytest

from labgrader.grade import grade as grading
from labgrader.grade.diagnose_outputs import Diagnoser, Diagnosis
from labgrader.grade_course import grade_course

TOPIC = "04_iou"


class Made:
    """What becomes, where it is read, the result of a call."""

    def __init__(self, function, *arguments):
        self.call = (function, arguments)

    def __reduce__(self):
        return self.call


@pytest.fixture
def diagnoser():
    diagnoser = Diagnoser(seconds=1, memory=1 << 30)
    yield diagnoser
    diagnoser.close()


def test_a_hint_comes_back_and_an_exception_costs_one_answer(diagnoser):
    broken = diagnoser.ask(TOPIC, "iou", [Made(bytearray, 1 << 40)])
    assert broken == Diagnosis(failed="its mistake cannot be looked for: MemoryError")
    outputs = [np.zeros(len(case)) for case in (np.zeros(2), np.zeros(3))]
    assert diagnoser.ask(TOPIC, "iou", outputs).failed == "its mistake cannot be looked for: ValueError"  # too few
    assert diagnoser.process.poll() is None


@pytest.mark.parametrize("end", [Made(os._exit, 1), Made(max, iter(int, 1))], ids=["ends", "runs on"])
def test_one_that_ends_or_takes_too_long_says_so(diagnoser, end):
    assert diagnoser.ask(TOPIC, "iou", [end]).failed == "its mistake was not found within 1 s and 1 GB"


def broken(*arguments):
    raise RecursionError


def test_an_answer_without_a_hint_is_flagged_and_the_others_are_graded(tmp_path, monkeypatch):
    kit.write_lab(tmp_path, TOPIC)
    right = kit.right_answers(TOPIC)
    kit.submit(tmp_path, "ada", TOPIC, right)
    kit.submit(tmp_path, "ben", TOPIC, right | {"iou": "def iou(n):\n    return n.sum() / np.ones(len(n))\n"})
    monkeypatch.setattr(grading.diagnosers, "ask", lambda *asked: Diagnosis(needs_a_look=True))
    monkeypatch.setattr(grading.Run, "findings", broken)
    ada, ben = grade_course(TOPIC, tmp_path, seed="secret", progress=False).records
    assert not ada.needs_a_look and ben.needs_a_look
    (result,) = [result for result in ben.results if not result.right]
    assert result.question == "iou" and "values are wrong" in result.says
    assert result.flag == "its program cannot be looked at: RecursionError"
