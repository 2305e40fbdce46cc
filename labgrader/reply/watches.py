"""Instruments: an answer runs again under a watch that shows where something goes wrong.

Two watches: floating-point errors raise, and arguments cannot be written. Each finds a line of the student's own, and
says nothing unless a wrong output hangs on it. Like `repair`, this runs in a worker.
"""

import ast
import contextlib
import itertools
import re
import sys
from collections.abc import Sequence
from types import FrameType, TracebackType

import numpy as np

from labgrader.comparison import is_heavy, quiet
from labgrader.program.live import LiveProgram, altered, copied, own_entry
from labgrader.reply.alarm import ENDS, limited
from labgrader.reply.finding import Finding, Span

MEAN = re.compile(r"\bmean\(")
MOST_S = 1.0  # CPU seconds of all watches together
MOST_TRACED_S = 0.3  # of a call whose lines are looked at one by one


def watch(pieces: Sequence[tuple[str, str]], name: str, cases: Sequence[tuple[tuple, object]], right) -> list[Finding]:
    """What the watches show of a wrong answer, the surest first; arguments are those of `repair.repairs`.

    Of what overflows, divides by 0 or has no result, the first of the wrong cases is asked, which is the one shown.
    """
    found = []
    with contextlib.suppress(*ENDS), limited(MOST_S), quiet():
        program = LiveProgram(name, pieces)
        outputs = ((args, expected, outcome(program, args)) for args, expected in cases)
        wrong = [*itertools.islice((tried for tried in outputs if not right(*tried[1:])), 1)]
        for look, tried in ((floating_point, wrong), (written_argument, [c for c in cases if not is_heavy(*c)])):
            if reading := look(program, tried):
                found.append(reading)
    return found


def outcome(program: LiveProgram, args: tuple) -> object:
    """The output of a call, None if it raises."""
    try:
        return program.call(args)[0]
    except Exception:
        return None


# ---------------------------------------------------------------------------------------- floating-point errors


def floating_point(program: LiveProgram, wrong: Sequence[tuple[tuple, object, object]]) -> Finding | None:
    """The first operation that overflows, divides by zero or has no result, where NaN or infinity comes out wrongly.

    wrong: the arguments of wrong cases, what is expected, and what came.
    """
    for args, expected, got in wrong:
        if not bad_numbers(expected, got):
            continue
        try:
            with np.errstate(over="raise", divide="raise", invalid="raise"):
                program.call(args)
        except FloatingPointError as error:
            where = own_place(program, error.__traceback__)
            if where is None:
                return None
            piece, span, frame = where
            kind = "overflow" if "overflow" in str(error) else "division" if "divide" in str(error) else "no number"
            part = text_of(program.pieces[piece][1], span)
            if kind != "overflow" and MEAN.search(part):
                return Finding("nothing", piece, (span,))
            if kind == "overflow" and is_whole(part, frame):
                return Finding("wraps", piece, (span,))
            return Finding(kind, piece, (span,), extreme(part, frame, kind))
        except Exception:
            return None
    return None


def bad_numbers(expected: object, got: object) -> bool:
    """Whether NaN or infinity stands where a finite number is expected."""
    pairs = zip(as_tuple(expected), as_tuple(got), strict=False)
    for e, g in pairs:
        e, g = np.asarray(e), np.asarray(g)
        if e.shape == g.shape and g.dtype.kind == "f" and (np.isfinite(e.astype(float)) & ~np.isfinite(g)).any():
            return True
    return False


def as_tuple(output: object) -> tuple:
    """Outputs as a tuple, also one."""
    return tuple(output) if isinstance(output, tuple | list) else (output,)


def own_place(program: LiveProgram, trace: TracebackType | None) -> tuple[int, Span, FrameType] | None:
    """The deepest of the student's own expressions in a traceback: its piece, its place and its frame."""
    entry, _ = own_entry(trace, program.files)
    if entry is None:
        return None
    code = entry.tb_frame.f_code
    line, last_line, column, end = list(code.co_positions())[entry.tb_lasti // 2]
    if None in (line, last_line, column, end):
        return None
    return program.files.index(code.co_filename), Span(line, column, last_line, end), entry.tb_frame


def text_of(text: str, span: Span) -> str:
    """A part of a line."""
    return text.split("\n")[span.line - 1].encode()[span.column : span.end].decode(errors="replace")


def is_whole(part: str, frame: FrameType) -> bool:
    """Whether an expression is a whole number, which does not grow too large for a float."""
    try:
        with quiet():
            return np.asarray(eval(part, frame.f_globals, frame.f_locals)).dtype.kind in "iu"
    except Exception:  # no expression, as x *= 2
        return False


def extreme(part: str, frame: FrameType, kind: str) -> float | None:
    """The largest number that goes into an exponential, None if it cannot be told."""
    try:
        node = ast.parse(part, mode="eval").body
        if kind == "overflow" and isinstance(node, ast.Call) and node.args:
            inner = compile(ast.Expression(node.args[0]), "<argument>", "eval")
            largest = float(np.nanmax(np.asarray(eval(inner, frame.f_globals, frame.f_locals), float)))
            return largest if np.isfinite(largest) else None
    except Exception:
        pass
    return None


# ------------------------------------------------------------------------------------------------- arguments


def written_argument(program: LiveProgram, cases: Sequence[tuple[tuple, object]]) -> Finding | None:
    """The line that changes an argument."""
    for args, _ in cases:
        given = copied(args)
        try:
            program.answer(*given)
        except Exception:
            return None
        if not altered(args, given):
            continue
        locked = copied(args)
        for array in locked:
            if isinstance(array, np.ndarray):
                array.flags.writeable = False
        try:
            program.answer(*locked)
        except ValueError as error:
            where = own_place(program, error.__traceback__) if "read-only" in str(error) else None
            if where is None:
                return None
            piece, span, _ = where
            return Finding("writes", piece, (line_that_changes(program, args, piece, span),))
        except Exception:
            return None
    return None


def line_that_changes(program: LiveProgram, args: tuple, piece: int, written: Span) -> Span:
    """The line of a piece after which an argument is no longer what it was; `written` where it is in that line.

    A line may well write what is there already, as np.fill_diagonal(n, n.diagonal()) does.
    """
    given, file, last, found = copied(args), program.files[piece], [0], []

    def step(frame: FrameType, event: str, _):
        if frame.f_code.co_filename != file:
            return None
        if not found and last[0] and altered(args, given):
            found.append(last[0])
        last[0] = frame.f_lineno
        return step

    before = sys.gettrace()
    sys.settrace(step)
    try:
        with contextlib.suppress(*ENDS), limited(MOST_TRACED_S):
            program.answer(*given)
    finally:
        sys.settrace(before)
    if not found or written.line <= found[0] <= written.last_line:
        return written
    text = program.pieces[piece][1].split("\n")[found[0] - 1]
    return Span(found[0], len(text) - len(text.lstrip()), found[0], len(text.encode()))
