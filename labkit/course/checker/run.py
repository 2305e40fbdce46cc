"""Calling an answer in this process: on copies of the arguments, for a limited time, with its prints held back.

This keeps a student's notebook whole; it is no defence against a hostile answer, which the grader runs elsewhere.
"""

import contextlib
import copy
import io
import linecache
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Sequence
from types import TracebackType

from labkit.course.checker.comparison import Problem, expected_cases, plain, quiet, same_argument
from labkit.course.checker.judge import Verdict, verdict
from labkit.course.checker.program import Program
from labkit.course.checker.question import Question

MAX_PRINTED = 600  # characters that are kept of what an answer prints
LONGEST_TEXT = 160  # characters of an exception's message that are shown


class TimeIsUp(BaseException):
    """Raised in an answer that runs too long; not an Exception, so that `except Exception` lets it pass."""


class Printed(io.TextIOBase):
    """A stream that keeps the beginning of what is written to it and counts the rest."""

    def __init__(self):
        self.text, self.length = "", 0

    def write(self, text: str) -> int:
        """Keep as much of the text as there is room for."""
        self.text += text[: MAX_PRINTED - len(self.text)]
        self.length += len(text)
        return len(text)


def judge(
    question: Question, answer: Callable, seed: int, limit_s: float | None = None, printed: Printed | None = None
) -> Verdict:
    """Run an answer on the cases that belong to a seed and tell the first problem, if there is one.

    limit_s: seconds for all cases together (where the system has interval timers, in the main thread); what was not
    reached then counts as not returned. printed: takes what the answer prints; else it is dropped.

    >>> double = Question(name="0.double", reference=lambda x: 2 * x, inputs=lambda rng: (rng.random(3),))
    >>> judge(double, lambda x: x + x, seed=0).passed
    True
    >>> judge(double, lambda x: (2 * x)[:, None], seed=0).problem.says
    'expected shape (3,), got (3, 1)'
    """
    cases = expected_cases(question, seed)
    outputs, altered = run(answer, [case.args for case in cases], limit_s, printed)
    return verdict(question, cases, outputs, altered)


def run(
    answer: Callable, arguments: Sequence[tuple], limit_s: float | None = None, printed: Printed | None = None
) -> tuple[list, frozenset[int]]:
    """Call an answer on copies of each tuple of arguments.

    Returns for each what `plain` makes of its output, or a Problem that says why there is none; and the positions of
    the arguments that it altered. After the time is up it is not called again.
    """
    outputs, altered, end = [], set(), None if limit_s is None else time.monotonic() + limit_s
    printed = Printed() if printed is None else printed
    for args in arguments:
        given = copy.deepcopy(args)
        left = None if end is None else max(end - time.monotonic(), 1e-3)
        outputs.append(call(answer, given, left, printed))
        altered |= {i for i, (a, b) in enumerate(zip(args, given, strict=True)) if not same_argument(a, b)}
        if isinstance(outputs[-1], Problem) and outputs[-1].kind == "time":
            outputs += [outputs[-1]] * (len(arguments) - len(outputs))
            break
    return outputs, frozenset(altered)


def define(program: Program, name: str, limit_s: float | None = None, printed: Printed | None = None) -> object:
    """Run a program in a namespace of its own; give what it defines under a name, or the Problem that came up."""
    namespace = {"__name__": "__main__"}

    def run_pieces() -> None:
        for label, text in program.pieces:
            file = f"<{label}>"
            linecache.cache[file] = (len(text), None, text.splitlines(keepends=True), file)
            exec(compile(text, file, "exec", dont_inherit=True), namespace)

    problem = guarded(run_pieces, {f"<{label}>" for label, _ in program.pieces}, limit_s, printed or Printed())
    return problem or namespace.get(name)


def call(answer: Callable, args: tuple, limit_s: float | None, printed: Printed) -> object:
    """Call an answer once: `plain` of its output, or a Problem."""
    return guarded(lambda: plain(answer(*args)), own_files(answer), limit_s, printed)


def guarded(function: Callable, own: set[str], limit_s: float | None, printed: Printed) -> object:
    """Call a function of the student's; give its result, or the Problem that it raised. Nothing gets out.

    own: files, or cells, that the student wrote.
    """
    try:
        # A division by zero says so wherever the function is called itself; here it would only fill the notebook.
        with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed), quiet():
            return limited(function, limit_s)
    except TimeIsUp:
        return Problem("time", "it did not return in time: does a loop never end?")
    except BaseException as error:  # SystemExit and KeyboardInterrupt as well: they are the answer's, not ours
        return exception_problem(error, own)


def limited(function: Callable, seconds: float | None) -> object:
    """Call a function, and raise TimeIsUp in it when it takes longer.

    The alarm rings again and again: an answer that catches everything in an endless loop is hit outside its `try`
    sooner or later. Another's alarm that was set before (pytest's, say) is set again afterwards.
    """
    timers = hasattr(signal, "setitimer") and threading.current_thread() is threading.main_thread()
    if seconds is None or not timers:
        return function()
    guard = sys._getframe()

    def ring(number, frame):
        if frame is not guard:  # in this frame the answer is no longer running
            raise TimeIsUp

    handler = signal.signal(signal.SIGALRM, ring)
    start = time.monotonic()
    left, interval = signal.setitimer(signal.ITIMER_REAL, seconds, 0.005)
    try:
        return function()
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, signal.SIG_DFL if handler is None else handler)
        if left:
            signal.setitimer(signal.ITIMER_REAL, max(left - (time.monotonic() - start), 1e-3), interval)


# ---------------------------------------------------------------------- exceptions, and the student's own line


def own_files(answer: Callable) -> set[str]:
    """The file, or notebook cell, that an answer was written in; empty for what was not written in Python."""
    code = getattr(answer, "__code__", None)
    return set() if code is None else {code.co_filename}


def exception_problem(error: BaseException, own: set[str]) -> Problem:
    """Say what an answer raised, and the deepest line of the student's own that led there."""
    lines, last = own_lines(error.__traceback__, own)
    if isinstance(error, NotImplementedError) and last:
        return Problem("unanswered", "not answered yet")
    with contextlib.suppress(Exception):  # an exception's own __str__ may fail
        text = " ".join(str(error).split())
        text = text if len(text) <= LONGEST_TEXT else text[:LONGEST_TEXT] + " ..."
        return Problem("exception", f"{type(error).__name__}: {text}" if text else type(error).__name__, lines[-1:])
    return Problem("exception", type(error).__name__, lines[-1:])


def own_lines(trace: TracebackType | None, own: set[str]) -> tuple[tuple[tuple[int, str], ...], bool]:
    """Numbers and texts of the student's lines in a traceback, and whether the last call in it is among them.

    The student's are those of the answer's own cell, and of other cells: they have a source but no file.
    """
    found, last = [], False
    while trace is not None:
        name = trace.tb_frame.f_code.co_filename
        text = linecache.getline(name, trace.tb_lineno).strip()
        last = name in own or (bool(text) and not os.path.exists(name))
        if last:
            found.append((trace.tb_lineno, text))
        trace = trace.tb_next
    return tuple(found), last
