"""The student's instant check: a tick, or the first thing that is wrong, and the function to go on with.

It lives in `labkit.course.checking`, and notebooks say `from labkit import check`: a module of that name would hide it.
"""

import html
import os
import sys
from collections.abc import Callable

import numpy as np

from labkit.course.questions.judge import Verdict
from labkit.course.questions.question import Question, find
from labkit.course.questions.run import MAX_PRINTED, Printed, judge

PUBLIC_SEED = 0
LIMIT_S = 10.0  # for all cases together; a right answer takes a small part of it
MAX_SHOWN = 100  # characters of an argument or output that are worth showing
COLOURS = {"✔": "#2e7d32", "✘": "#c62828", "○": "#b26a00"}


class CheckFailed(AssertionError):
    """What `check` raises under LABKIT_STRICT=1 instead of going on with the kit's function."""


class Shown:
    """What a check shows: a mark and lines of text; in colour in Jupyter, plain anywhere else."""

    def __init__(self, mark: str, *lines: str):
        self.mark, self.lines = mark, lines

    def __repr__(self) -> str:
        return "\n  ".join((f"{self.mark} {self.lines[0]}", *self.lines[1:]))

    def _repr_html_(self) -> str:
        colour = COLOURS[self.mark]
        first, *rest = (html.escape(line) for line in self.lines)
        rest = "".join(f"<br><span style='white-space:pre-wrap'>{line}</span>" for line in rest)
        return (
            f"<div style='border-left:4px solid {colour};padding:2px 10px'>"
            f"<b style='color:{colour}'>{self.mark}</b> <b>{first}</b>{rest}</div>"
        )


def check(name: str, answer: object) -> Callable:
    """Check a student's answer, show the result, and return the function to go on with.

    name: of the question, "04_iou.iou". answer: the student's function. Returns the answer if it passes every case,
    else the kit's own function, so that the cells below run. It raises nothing, but CheckFailed under LABKIT_STRICT=1.
    """
    try:
        question = find(name)
    except ValueError as error:
        return conclude(Shown("✘", "there is no such question", str(error)), answer, passed=False)
    if answer is question.reference:
        lines = (
            f"{question.function}: this is the kit's function, not yours",
            "The last check put it in the place of your answer: run the cell of your answer again, then this one.",
        )
        return conclude(Shown("○", *lines), question.reference, passed=False)
    if not callable(answer):
        shown = Shown("✘", f"{question.function} is not a function", f"It is of type {type(answer).__name__}.")
        return conclude(shown, question.reference, passed=False)
    printed = Printed()
    verdict = judge(question, answer, PUBLIC_SEED, LIMIT_S, printed)
    shown = describe(question, verdict, printed)
    return conclude(shown, answer if verdict.passed else question.reference, verdict.passed)


def conclude(shown: Shown, function: Callable, passed: bool) -> Callable:
    """Show a result; return the function, or raise if failing is to stop the notebook."""
    if not passed and os.environ.get("LABKIT_STRICT") == "1":
        raise CheckFailed(repr(shown))
    ipython = sys.modules.get("IPython")
    if ipython is not None and ipython.get_ipython() is not None:
        ipython.display.display(shown)
    else:
        print(shown)
    return function


def describe(question: Question, verdict: Verdict, printed: Printed) -> Shown:
    """Put a verdict in words. Nothing in them comes from the reference but the shape and dtype that are asked for."""
    name, problem = question.function, verdict.problem
    said = [f"It prints: {line}" for line in printed.text.splitlines()[:3]]
    said += ["..."] if printed.length > MAX_PRINTED or printed.text.count("\n") > 3 else []
    notes = [f"Note: {note}." for note in verdict.notes]
    if problem is None:
        by_hand = len(question.by_hand)
        tried = ([f"{by_hand} by hand"] if by_hand else []) + [f"{question.random_cases} random"]
        return Shown("✔", f"{name} is right", f"Cases tried: {', '.join(tried)}.", *notes, *said)
    if problem.kind == "unanswered":
        return Shown("○", f"{name}: not answered yet", "The kit's function takes its place below.")
    lines = [f"line {number}:  {text}" for number, text in problem.lines]
    lines += [f"In {verdict.where}{called(question, verdict)}."]
    lines += [f"Hint: {verdict.hint}"] if verdict.hint else []
    return Shown("✘", f"{name}: {problem.says}", *lines, *notes, *said)


def called(question: Question, verdict: Verdict) -> str:
    """The call of a case by hand, if it is short enough to read."""
    if verdict.case is None or verdict.case >= len(question.by_hand):
        return ""
    text = ", ".join(compact(argument) for argument in question.by_hand[verdict.case])
    return f": {question.function}({text})" if len(text) <= MAX_SHOWN else ""


def compact(value: object) -> str:
    """A number or small array in one line.

    >>> compact(np.array([[1.0, 0.5], [0.0, 2.0]]))
    '[[1, 0.5], [0, 2]]'
    """
    if isinstance(value, np.ndarray) and value.ndim:
        return "[" + ", ".join(compact(part) for part in value) + "]" if value.size <= 32 else "..."
    return f"{value:.4g}" if isinstance(value, float | np.floating) else str(value)
