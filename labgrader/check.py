"""The student's instant check: a tick, or the first thing that is wrong, and the function to go on with.

It lives in `labgrader.check`, and a course's package offers it as `check`: a module of that name would hide it.
A check runs the program that the grader will run, the cell of the answer and what it needs of other cells, in a worker:
nothing of it happens in the student's kernel. In plain Python the text of the answer's file is its one cell.
"""

import contextlib
import html
import inspect
import itertools
import linecache
import os
import re
import sys
import textwrap
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from labgrader.as_arrays import giving_arrays
from labgrader.comparison import Problem
from labgrader.course import course, find, of_topic
from labgrader.languages import HintsUnreadable
from labgrader.program.cell import Cell, parsed
from labgrader.program.notebook import LARGEST_FILE, Unreadable, readable, refuse_long
from labgrader.program.slice import NO_CELL, Program, program
from labgrader.question import Question
from labgrader.reply.judge import Verdict
from labgrader.reply.messages import Marked
from labgrader.run import subprocess_worker
from labgrader.run.process import MOST_PRINTED
from labgrader.run.run import Budget, Limits, Run, Start, public_cases

LIMITS = Limits(asleep_s=10.0)  # else the grader's, so that a tick here is a tick there
LOOKING = "Looking for the place in your program ..."
COLOURS = {"✔": "#2e7d32", "✘": "#c62828", "○": "#b26a00"}


class CheckFailed(AssertionError):
    """What `check` raises under LABKIT_STRICT=1 instead of going on with the kit's function."""


class Shown:
    """What a check shows: a mark and lines, of text or of the student's program; in colour in Jupyter, else plain."""

    def __init__(self, mark: str, *lines: str | Marked):
        self.mark, self.lines = mark, lines

    def __repr__(self) -> str:
        first, *rest = (part for line in self.lines for part in (line.plain() if isinstance(line, Marked) else (line,)))
        return "\n  ".join((f"{self.mark} {first}", *rest))

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

    name: of the question, "04_iou.iou". answer: the student's function. Returns the answer if it passes every case, its
    lists as arrays, else the kit's own function, so that the cells below run. Raises CheckFailed under LABKIT_STRICT=1,
    and ValueError where no process for an answer can be started.
    """
    try:
        question = find(name)
    except HintsUnreadable as error:
        return conclude(Shown("✘", "the hints of this topic cannot be read", str(error)), answer, passed=False)
    except ValueError as error:
        return conclude(Shown("✘", "there is no such question", str(error)), answer, passed=False)
    if broken := broken_cell(question):
        return conclude(broken, question.reference, passed=False)
    if answer is question.reference:
        lines = (
            f"{question.function}: this is the kit's function, not yours",
            "The last check put it in place of your answer: run the cell of your answer again, then this one.",
        )
        return conclude(Shown("○", *lines), question.reference, passed=False)
    if not callable(answer):
        shown = Shown("✘", f"{question.function} is not a function", f"It is of type {type(answer).__name__}.")
        return conclude(shown, question.reference, passed=False)
    notes = ()
    if jupyter() is not None and not is_of_the_notebook(question, answer):
        notes += (f"This is not the {question.function} of your notebook, which is the one that will be graded.",)
    if reason := why_its_file_is_not_graded():
        notes += (f"The grader would not take this notebook as it is saved: {reason}. Fix that, and save it.",)
    page = Page()

    def meanwhile(verdict: Verdict, printed: str) -> None:
        if jupyter() is not None:
            page.show(describe(question, verdict, printed, notes, LOOKING))

    verdict, printed = reply_to(question, program_of(question, answer), meanwhile)
    if verdict.problem is not None and verdict.problem.kind == "unanswered":
        notes += ("The kit's function stands in for it below.",)
    shown = describe(question, verdict, printed, notes)
    if not verdict.passed:
        return conclude(shown, question.reference, False, page)
    return conclude(shown, giving_arrays(answer, public_cases(question)), True, page)


def reply_to(
    question: Question,
    cut: Program,
    meanwhile: Callable[[Verdict, str], None] = lambda verdict, printed: None,
    budget: Budget | None = None,
    start: Start = subprocess_worker.fresh_worker,
) -> tuple[Verdict, str]:
    """Run a program on the public cases: the verdict, with what is found in a wrong one, and what it printed.

    meanwhile: called with both before the mistake is looked for, which takes a moment. budget: of a whole notebook.
    start: gives a worker, with a sandbox or without.
    """
    if cut.refused and cut.late is None:
        return Verdict(Problem("refused", cut.refused), None, ""), ""
    if cut.refused:
        return reply_to(question, cut.late, meanwhile, budget, start)
    with Run(question, cut, start, LIMITS, budget) as answer:
        verdict, _ = answer.judge(public_cases(question), brief=True)
        printed = answer.worker.printed()
        if not verdict.passed and cut.late is not None:
            with Run(question, cut.late, start, LIMITS, budget) as late:
                second, _ = late.judge(public_cases(question), brief=True)
                if second.passed:
                    return second, late.worker.printed()
        if verdict.needs_a_look:
            meanwhile(verdict, printed)
            verdict = replace(verdict, findings=answer.findings(verdict.case or 0))
    return verdict, printed


def broken_cell(question: Question) -> Shown | None:
    """What is said if the last run of the answer's cell was an error of syntax: what ran before it is not checked."""
    head = re.compile(rf"^[ \t]*def[ \t]+{question.function}\b", re.MULTILINE)
    sources = jupyter().history_manager.input_hist_raw if jupyter() is not None else []
    last = next((source for source in reversed(sources) if head.search(source)), "")
    cell = parsed(Cell(last))
    if not cell.problem:
        return None
    number = re.search(r"line (\d+)", cell.problem)
    n = int(number[1]) if number else 0
    lines = [f"line {n}:  {line.strip()}" for line in last.splitlines()[n - 1 : n]] if n else []
    again = "None of it has run. Fix it, run it again, then this cell."
    return Shown("✘", f"{question.function}: {cell.problem}", *lines, again)


def why_its_file_is_not_graded() -> str:
    """What is too large in the notebook's file, where its program tells this kernel which one it is; "" if nothing."""
    try:
        here = {} if jupyter() is None else jupyter().user_ns
        with open(here.get("__vsc_ipynb_file__") or os.environ["JPY_SESSION_NAME"], "rb") as file:
            readable(file.read(LARGEST_FILE + 1))
    except Unreadable as reason:
        return str(reason)
    except (OSError, KeyError, TypeError, ValueError):
        pass
    return ""


def is_of_the_notebook(question: Question, answer: Callable) -> bool:
    """Whether an answer is the function that the notebook has under the question's name: the grader takes no other."""
    shell = jupyter()
    return shell is not None and shell.user_ns.get(question.function) is answer


def program_of(question: Question, answer: Callable) -> Program:
    """The program of an answer, by its name among the cells of the notebook or in its own file.

    Other blanks that it calls are the student's, or the kit's where a check has put that in their place, or where they
    have not run since the kernel started.
    """
    module = sys.modules.get(getattr(answer, "__module__", None) or "")
    namespace = vars(module) if jupyter() is None and module else {} if jupyter() is None else jupyter().user_ns
    name = question.function if namespace.get(question.function) is answer else getattr(answer, "__name__", "")
    blanks, here = of_topic(question.topic), course()
    given = {other: q.source for other, q in blanks.items() if namespace.get(other, q.reference) is q.reference}
    cut = Program(refused=f"{NO_CELL} it")
    for cells in places_of(answer, blanks):
        try:
            refuse_long(cells)
        except Unreadable as reason:
            return Program(refused=str(reason))
        cut = program(cells, name, blanks, here.packages, question.forbidden, here.kit, given, latest=True)
        if not cut.refused.startswith(NO_CELL):
            return replace(cut, name=name)
    return Program(refused="there is no text that defines it alone: write it under its name, in a cell or in a file")


def places_of(answer: Callable, blanks: Collection[str]) -> Iterator[list[Cell]]:
    """The cells in which an answer may stand: a kernel's history, then its texts; in plain Python the answer's file.

    nbval keeps no history of what it runs, but Python has the text of each cell for its tracebacks.
    """
    if jupyter() is not None:
        last = {cell: number for number, cell in cell_of_execution.items()}
        yield [
            Cell(source, cell_of_execution[number] if cell_of_execution.get(number) in blanks else "")
            for number, source in enumerate(jupyter().history_manager.input_hist_raw)
            if number not in cell_of_execution or last[cell_of_execution[number]] == number
        ]
        entries = [entry for entry in linecache.cache.values() if len(entry) == 4 and entry[1] is None]
        yield [Cell("".join(lines)) for _, _, lines, name in entries if "ipython-input" in name or "ipykernel" in name]
        return
    with contextlib.suppress(OSError, TypeError, ValueError, AttributeError):
        code = inspect.unwrap(answer).__code__
        own = textwrap.dedent(inspect.getsource(answer)) if "<locals>" in answer.__qualname__ else ""
        if not set(code.co_freevars) - {code.co_name}:
            yield [Cell(Path(code.co_filename).read_text(encoding="utf-8")), Cell(own)]


def jupyter() -> object | None:
    """The running IPython shell, None in plain Python."""
    ipython = sys.modules.get("IPython")
    return None if ipython is None else ipython.get_ipython()


# By number of execution the cell's id, from the first check on and where Jupyter tells it. A lab's answers have their
# functions' names.
cell_of_execution: dict[int, str] = {}


CALL = re.compile(r"""\bcheck\(\s*["']([\w.]+)["'],\s*(\w+)\s*\)""")


def note_cell(info: object) -> None:
    """Record the id of the cell that is about to run: a check without an answer says why, if the cell is no Python."""
    cell = getattr(info, "cell_id", None)  # IPython 7, which Colab has, tells none
    if info.store_history and cell:
        cell_of_execution[len(jupyter().history_manager.input_hist_raw)] = cell  # it is put there next
    for name, function in CALL.findall(info.raw_cell or ""):
        with contextlib.suppress(ValueError):
            question = find(name)
            if function not in jupyter().user_ns and broken_cell(question):
                jupyter().user_ns[function] = question.reference


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
    question: Question, verdict: Verdict, printed: str = "", notes: Sequence[str] = (), looking: str = ""
) -> Shown:
    """Put a verdict on public cases in words. looking: what stands in the place of the hint while it is looked for."""
    name, problem = question.function, verdict.problem
    said = [f"It prints: {line}" for line in printed[:MOST_PRINTED].splitlines()[:3]]
    said += ["..."] if len(printed) > MOST_PRINTED or printed.count("\n") > 3 else []
    if problem is None:
        by_hand = len(question.by_hand)
        tried = f"{by_hand} hand-made and {question.random_cases}" if by_hand else f"{question.random_cases}"
        return Shown("✔", f"{name} is right", f"Passed {tried} random cases.", *said, *notes)
    if problem.kind == "unanswered":
        return Shown("○", f"{name}: not answered yet", *notes)
    if problem.kind == "refused":
        refused = f"{name} cannot be graded: {problem.says}"
        return Shown("✘", refused, "The grader would not take it either.", *notes)
    lines: list[str | Marked] = [f"line {number}:  {text}" for number, text in problem.lines]
    lines += [f"In {verdict.where}:", *(f"    {line}" for line in verdict.shown)] if verdict.shown else []
    sentence = None if looking else verdict.sentence
    if sentence is not None and sentence.marked:
        lines += sentence.marked
    lines += [looking] if looking else [f"Hint: {sentence.says}"] if sentence else []
    lines += [f"Note: {note}." for note in verdict.notes]
    return Shown("✘", f"{name}: {problem.says}", *lines, *said, *notes)
