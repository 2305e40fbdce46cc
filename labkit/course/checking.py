"""The student's instant check: a tick, or the first thing that is wrong, and the function to go on with.

It lives in `labkit.course.checking`, and notebooks say `from labkit import check`: a module of that name would hide it.
In Jupyter a check runs the program that the grader will run: the cell of the answer and what it needs of other cells.
"""

import html
import inspect
import itertools
import os
import sys
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import replace

from labkit.course.checker.child import findings
from labkit.course.checker.comparison import Problem
from labkit.course.checker.judge import Verdict
from labkit.course.checker.program import Cell, Program, program
from labkit.course.checker.question import PACKAGES, PUBLIC_SEED, Question
from labkit.course.checker.run import MAX_PRINTED, Printed, define, judge
from labkit.course.checker.wording import Marked
from labkit.course.topics import find, of_topic

LIMIT_S = 10.0  # for all cases together; a right answer takes a small part of it
LOOKING = "Looking for the place in your program: a moment ..."
COLOURS = {"✔": "#2e7d32", "✘": "#c62828", "○": "#b26a00"}


class CheckFailed(AssertionError):
    """What `check` raises under LABKIT_STRICT=1 instead of going on with the kit's function."""


class Shown:
    """What a check shows: a mark and lines, of text or of the student's program; in colour in Jupyter, else plain."""

    def __init__(self, mark: str, *lines: str | Marked):
        self.mark, self.lines = mark, lines

    def __repr__(self) -> str:
        plain = [part for line in self.lines for part in (line.plain() if isinstance(line, Marked) else (line,))]
        return "\n  ".join((f"{self.mark} {plain[0]}", *plain[1:]))

    def _repr_html_(self) -> str:
        colour = COLOURS[self.mark]
        first, *rest = (in_colour(line) if isinstance(line, Marked) else html.escape(line) for line in self.lines)
        rest = "".join(f"<br><span style='white-space:pre-wrap'>{line}</span>" for line in rest)
        return (
            f"<div style='border-left:4px solid {colour};padding:2px 10px'>"
            f"<b style='color:{colour}'>{self.mark}</b> <b>{first}</b>{rest}</div>"
        )


def in_colour(line: Marked) -> str:
    """A student's line in HTML, with its marked parts."""
    edges = sorted({0, len(line.text), *(min(edge, len(line.text)) for part in line.parts for edge in part)})
    text = ""
    for a, b in itertools.pairwise(edges):
        inside = any(first <= a and b <= last for first, last in line.parts)
        piece = html.escape(line.text[a:b])
        text += f"<mark>{piece}</mark>" if inside else piece
    return f"Look at line {line.number}:  <code>{text}</code>"


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
    notes = ()
    if jupyter() is not None and not is_of_the_notebook(question, answer):
        notes += (f"This is another function than {question.function} of your notebook, which will be graded.",)
    if verdict.problem is not None and verdict.problem.kind == "unanswered":
        notes += ("The kit's function takes its place below.",)
    page = Page()
    if verdict.needs_a_look and verdict.pieces and jupyter() is not None:
        page.show(describe(question, verdict, printed, notes, LOOKING))
    verdict = looked_at(question, verdict)
    shown = describe(question, verdict, printed, notes)
    return conclude(shown, answer if verdict.passed else question.reference, verdict.passed, page)


def looked_at(question: Question, verdict: Verdict) -> Verdict:
    """The verdict with what instruments and repair find in the program of a wrong answer, if that may help."""
    if not verdict.needs_a_look or not verdict.pieces:
        return verdict
    return replace(verdict, findings=findings(question, verdict.pieces, PUBLIC_SEED))


def judged(question: Question, answer: Callable, printed: Printed) -> Verdict:
    """The verdict on an answer: on its program if the notebook has it under its name, else on the function itself."""
    cut = program_here(question) if is_of_the_notebook(question, answer) else None
    if cut is not None and cut.refused:
        return Verdict(Problem("refused", cut.refused), None, "")
    pieces = written_alone(answer) if cut is None else cut.pieces
    if cut is not None:
        answer = define(cut, question.function, LIMIT_S, printed)
    if isinstance(answer, Problem):
        return Verdict(answer, None, "before it is called")
    if not callable(answer):
        return Verdict(Problem("kind", f"its cell makes it a {type(answer).__name__}, not a function"), None, "")
    return replace(judge(question, answer, PUBLIC_SEED, LIMIT_S, printed), pieces=pieces)


def written_alone(answer: Callable) -> tuple[tuple[str, str], ...]:
    """The program of a function outside of a notebook: its own text, nothing if it has none or needs a closure."""
    if not inspect.isfunction(answer) or answer.__closure__:
        return ()
    try:
        return ("quiet", "import numpy as np"), (answer.__name__, textwrap.dedent(inspect.getsource(answer)))
    except (OSError, TypeError):
        return ()


def is_of_the_notebook(question: Question, answer: Callable) -> bool:
    """Whether an answer is the function that the notebook has under the question's name: the grader takes no other."""
    shell = jupyter()
    return shell is not None and shell.user_ns.get(question.function) is answer


def program_here(question: Question) -> Program | None:
    """The program of an answer among the cells that were run in this notebook.

    None where the kernel's history does not have the answer: nbval keeps none. Other blanks that it calls are the
    student's, or the kit's where a check has put that in their place.
    """
    shell, blanks = jupyter(), of_topic(question.topic)
    last = {cell: number for number, cell in ran.items()}
    cells = [
        Cell(source, ran[number] if ran.get(number) in blanks else "")
        for number, source in enumerate(shell.history_manager.input_hist_raw)
        if number not in ran or last[ran[number]] == number
    ]
    given = {name: other.source for name, other in blanks.items() if shell.user_ns.get(name) is other.reference}
    cut = program(cells, question.function, blanks, PACKAGES, question.forbidden, given, latest=True)
    return None if cut.refused.startswith("no cell defines") else cut


def jupyter() -> object | None:
    """The running IPython shell, None in plain Python."""
    ipython = sys.modules.get("IPython")
    return None if ipython is None else ipython.get_ipython()


# By number of execution the cell's id, from the first check on and where Jupyter tells it. A lab's answers have their
# functions' names.
ran: dict[int, str] = {}


def note_cell(info: object) -> None:
    """Keep which cell is about to run."""
    if info.store_history and info.cell_id:
        ran[len(jupyter().history_manager.input_hist_raw)] = info.cell_id  # it is put there next


if jupyter() is not None:
    jupyter().events.register("pre_run_cell", note_cell)


class Page:
    """Where a check shows its result; in Jupyter a later one takes the place of the first."""

    def __init__(self):
        self.handle = None

    def show(self, shown: Shown) -> None:
        """Show a result."""
        if jupyter() is None:
            print(shown)
        elif self.handle is None:
            self.handle = sys.modules["IPython"].display.display(shown, display_id=True)
        else:
            self.handle.update(shown)


def conclude(shown: Shown, function: Callable, passed: bool, page: Page | None = None) -> Callable:
    """Show a result; return the function, or raise if failing is to stop the notebook."""
    if not passed and os.environ.get("LABKIT_STRICT") == "1":
        raise CheckFailed(repr(shown))
    (page or Page()).show(shown)
    return function


def describe(
    question: Question, verdict: Verdict, printed: Printed, notes: Sequence[str] = (), looking: str = ""
) -> Shown:
    """Put a verdict on public cases in words. looking: what stands in the place of the hint while it is looked for."""
    name, problem = question.function, verdict.problem
    said = [f"It prints: {line}" for line in printed.text.splitlines()[:3]]
    said += ["..."] if printed.length > MAX_PRINTED or printed.text.count("\n") > 3 else []
    if problem is None:
        by_hand = len(question.by_hand)
        tried = ([f"{by_hand} by hand"] if by_hand else []) + [f"{question.random_cases} random"]
        return Shown("✔", f"{name} is right", f"Cases tried: {', '.join(tried)}.", *said, *notes)
    if problem.kind == "unanswered":
        return Shown("○", f"{name}: not answered yet", *notes)
    if problem.kind == "refused":
        refused = f"{name} cannot be graded: {problem.says}"
        return Shown("✘", refused, "So the grader would not take it.", *notes)
    lines: list[str | Marked] = [f"line {number}:  {text}" for number, text in problem.lines]
    lines += [f"In {verdict.where}:", *(f"    {line}" for line in verdict.shown)] if verdict.shown else []
    sentence = None if looking else verdict.sentence
    if sentence is not None and sentence.marked:
        lines += sentence.marked
    lines += [looking] if looking else [f"Hint: {sentence.says}"] if sentence else []
    lines += [f"Note: {note}." for note in verdict.notes]
    return Shown("✘", f"{name}: {problem.says}", *lines, *said, *notes)
