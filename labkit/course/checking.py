"""The student's instant check: a tick, or the first thing that is wrong, and the function to go on with.

It lives in `labkit.course.checking`, and notebooks say `from labkit import check`: a module of that name would hide it.
In Jupyter a check runs the program that the grader will run: the cell of the answer and what it needs of other cells.
"""

import html
import os
import sys
from collections.abc import Callable

from labkit.course.checker.comparison import Problem
from labkit.course.checker.judge import Verdict
from labkit.course.checker.program import Cell, Program, program
from labkit.course.checker.question import PACKAGES, PUBLIC_SEED, Question
from labkit.course.checker.run import MAX_PRINTED, Printed, define, judge
from labkit.course.topics import find, of_topic

LIMIT_S = 10.0  # for all cases together; a right answer takes a small part of it
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
    verdict = judged(question, answer, printed)
    shown = describe(question, verdict, printed)
    if jupyter() is not None and not is_of_the_notebook(question, answer):
        shown.lines += (f"This is another function than {question.function} of your notebook, which will be graded.",)
    if verdict.problem is not None and verdict.problem.kind == "unanswered":
        shown.lines += ("The kit's function takes its place below.",)
    return conclude(shown, answer if verdict.passed else question.reference, verdict.passed)


def judged(question: Question, answer: Callable, printed: Printed) -> Verdict:
    """The verdict on an answer: on its program if the notebook has it under its name, else on the function itself."""
    cut = program_here(question) if is_of_the_notebook(question, answer) else None
    if cut is not None and cut.refused:
        return Verdict(Problem("refused", cut.refused), None, "")
    if cut is not None:
        answer = define(cut, question.function, LIMIT_S, printed)
    if isinstance(answer, Problem):
        return Verdict(answer, None, "before it is called")
    if not callable(answer):
        return Verdict(Problem("kind", f"its cell makes it a {type(answer).__name__}, not a function"), None, "")
    return judge(question, answer, PUBLIC_SEED, LIMIT_S, printed)


def is_of_the_notebook(question: Question, answer: Callable) -> bool:
    """Whether an answer is the function that the notebook has under the question's name: the grader takes no other."""
    shell = jupyter()
    return shell is not None and shell.user_ns.get(question.function) is answer


def program_here(question: Question) -> Program | None:
    """The program of an answer among the cells that were run in this notebook.

    None where the kernel's history does not have the answer: nbval keeps none. Other blanks that it calls are the
    student's, or the kit's where a check has put that in their place.
    """
    shell = jupyter()
    cells = [Cell(source) for source in shell.history_manager.input_hist_raw]
    blanks = of_topic(question.topic)
    given = {name: other.source for name, other in blanks.items() if shell.user_ns.get(name) is other.reference}
    cut = program(cells, question.function, blanks, PACKAGES, question.forbidden, given, latest=True)
    return None if cut.refused.startswith("no cell defines") else cut


def jupyter() -> object | None:
    """The running IPython shell, None in plain Python."""
    ipython = sys.modules.get("IPython")
    return None if ipython is None else ipython.get_ipython()


def conclude(shown: Shown, function: Callable, passed: bool) -> Callable:
    """Show a result; return the function, or raise if failing is to stop the notebook."""
    if not passed and os.environ.get("LABKIT_STRICT") == "1":
        raise CheckFailed(repr(shown))
    if jupyter() is not None:
        sys.modules["IPython"].display.display(shown)
    else:
        print(shown)
    return function


def describe(question: Question, verdict: Verdict, printed: Printed) -> Shown:
    """Put a verdict on public cases in words."""
    name, problem = question.function, verdict.problem
    said = [f"It prints: {line}" for line in printed.text.splitlines()[:3]]
    said += ["..."] if printed.length > MAX_PRINTED or printed.text.count("\n") > 3 else []
    if problem is None:
        by_hand = len(question.by_hand)
        tried = ([f"{by_hand} by hand"] if by_hand else []) + [f"{question.random_cases} random"]
        return Shown("✔", f"{name} is right", f"Cases tried: {', '.join(tried)}.", *said)
    if problem.kind == "unanswered":
        return Shown("○", f"{name}: not answered yet")
    if problem.kind == "refused":
        return Shown("✘", f"{name} cannot be graded: {problem.says}", "The grader would refuse it in these words.")
    lines = [f"line {number}:  {text}" for number, text in problem.lines]
    lines += [f"In {verdict.where}:", *(f"    {line}" for line in verdict.shown)] if verdict.shown else []
    lines += [f"Hint: {verdict.hint}"] if verdict.hint else []
    return Shown("✘", f"{name}: {problem.says}", *lines, *(f"Note: {note}." for note in verdict.notes), *said)
