"""The grader's end of a worker's pipes: requests out, replies in until a deadline; nothing that comes is believed.

A reply is a number of bytes with a limit, a letter, and then numbers or a short printable text: never a pickle. Long
texts come only where one is asked for; in the place of an output they end the worker. Texts of replies to secret cases
are for nobody to read: what students are told comes from public cases (`grade`).
"""

import builtins
import contextlib
import json
import math
import pickle
import re
import struct
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import BinaryIO

import numpy as np

from labkit.course.checker.judge import Problem
from labkit.course.checker.program import Program
from labkit.course.grading.worker import DTYPES, MOST_AXES, MOST_BYTES, MOST_MESSAGE, MOST_PARTS, ONE

KINDS = {"c": "complex numbers", "O": "objects", "U": "text", "S": "bytes", "M": "dates", "m": "spans of time"}


MOST_REPLY = MOST_BYTES + 1024  # bytes: an output, or an exception, with what is around it
MOST_PROGRAMS = 32 << 20  # bytes; the programs of a long notebook are long
MOST_FOUND = 1 << 20  # bytes of what is found in a program, which may have written them itself


class Text(str):
    """What a worker says where a text is asked for: programs, or what is found in one; no answer's output."""


@dataclass(frozen=True)
class Changed:
    """An output of a call that changed one of its arguments, the one at this position."""

    position: int
    value: object


class WorkerLost(Exception):
    """The worker is gone, by its own doing or because it had to be stopped; `problem` says why."""

    def __init__(self, problem: Problem):
        super().__init__(problem.says)
        self.problem = problem


class Worker:
    """One worker: `ask` it, and `close` it; it is a context manager, too.

    requests, replies: its pipes; kill: ends its process and everything that it started.
    """

    def __init__(self, requests: BinaryIO, replies: BinaryIO, kill: Callable[[], None]):
        self.requests, self.replies, self.kill = requests, replies, kill
        self.late = self.closed = False
        self.ending = threading.Lock()

    def __enter__(self) -> "Worker":
        return self

    def __exit__(self, *exception) -> None:
        self.close()

    def ask(self, request: tuple, limit_s: float, text: int = 0) -> object:
        """Send a request and return what the reply holds; raises WorkerLost, and kills the worker, if none came.

        text: the most bytes of a Text that may come; without it, a Text is no reply.
        """
        data = pickle.dumps(request, protocol=pickle.HIGHEST_PROTOCOL)
        return self.exchange(struct.pack("<I", len(data)) + data, limit_s, text)

    def programs(self, cells: list, asked: list, limit_s: float) -> list[tuple[Program, list[str]]]:
        """Have programs cut out of a notebook, by a worker in which nothing of it has run; each with its shapes."""
        found = self.ask(("cut", cells, asked), limit_s, MOST_PROGRAMS)
        if not isinstance(found, Text):
            raise WorkerLost(found if isinstance(found, Problem) else Problem("ended", "its cells cannot be read"))
        made = json.loads(found)
        return [
            (Program(tuple(map(tuple, pieces)), tuple(calls), refused), shapes)
            for pieces, calls, refused, shapes in made
        ]

    def greet(self, limit_s: float) -> None:
        """Wait until the worker has loaded its packages; no student's code has run by then."""
        self.exchange(b"", limit_s)

    def exchange(self, data: bytes, limit_s: float, text: int = 0) -> object:
        """Write, then read one reply. The deadline holds for both: a pipe that nobody reads gets full."""
        alarm = threading.Timer(limit_s, self.stop_late)
        alarm.start()
        try:
            self.requests.write(data)
            self.requests.flush()
            return decode(self.read(max(text, MOST_REPLY)), text > 0)
        except (OSError, EOFError, ValueError) as error:
            self.close()
            if self.late:
                raise WorkerLost(Problem("time", "it did not return in time: does a loop never end?")) from None
            if isinstance(error, ValueError):
                raise WorkerLost(
                    Problem("channel", "it wrote to the grader's channel, or returned far too much")
                ) from None
            raise WorkerLost(Problem("ended", "it ended or crashed the process that it ran in")) from None
        finally:
            alarm.cancel()

    def stop_late(self) -> None:
        """Kill the worker because its time is up, which ends the reading and writing of `exchange`."""
        self.late = True
        self.end()

    def end(self) -> None:
        """Kill its process, once."""
        with self.ending:
            if not self.closed:
                self.closed = True
                self.kill()

    def read(self, most: int) -> bytes:
        """Read one reply, of a length that is reasonable."""
        (length,) = struct.unpack("<I", self.read_exactly(4))
        if length > most:
            raise ValueError("length: a reply that is too long")
        return self.read_exactly(length)

    def read_exactly(self, count: int) -> bytes:
        """Read that many bytes; raises EOFError if the worker is gone before."""
        data = self.replies.read(count)
        if len(data) < count:
            raise EOFError
        return data

    def close(self) -> None:
        """Kill the worker and everything that it started, and wait until it is gone."""
        self.end()
        for stream in (self.requests, self.replies):
            with contextlib.suppress(OSError):
                stream.close()


def decode(reply: bytes, text: bool = False) -> object:
    """Read a reply: an array or number, a tuple of these, None for a cell that ran, or the Problem that it tells.

    text: whether a Text is a reply, too. Raises ValueError for anything that `worker.encode` does not write.

    >>> decode(b"V\\xff\\x03\\x01" + struct.pack("<q2i", 2, 5, -1))
    array([ 5, -1], dtype=int32)
    """
    letter, rest = reply[:1], reply[1:]
    if letter == b"V":
        return decode_values(rest)
    if letter == b"J" and text:
        return Text(rest.decode("utf-8", "replace"))
    if letter == b"C" and rest[1:2] == b"V":
        return Changed(rest[0], decode_values(rest[2:]))
    if letter == b"E" and len(rest) >= 5:
        line, piece = struct.unpack("<IB", rest[:5])
        return Problem("exception", f"it raises {exception_text(rest[5:])}", ((line, str(piece)),))
    if letter in (b"K", b"M", b"D"):
        return worded(letter, rest.decode("ascii", "replace"))
    fixed = {
        b"O": None,
        b"U": Problem("unanswered", "not answered yet"),
        b"A": Problem("missing", "its cell defines no function of this name"),
        b"L": Problem("kind", f"it returns a tuple or list of more than {MOST_PARTS}"),
        b"B": Problem("size", f"it returns more than {MOST_BYTES >> 20} MB"),
    }
    if letter not in fixed or rest:
        raise ValueError("reply: expected one that a worker writes")
    return fixed[letter]


def worded(letter: bytes, word: str) -> Problem:
    """Say what was returned, or which module is missing; a word of the student's own making is not repeated."""
    if letter == b"D":
        return Problem("dtype", f"expected real numbers, got {KINDS.get(word, 'records')}")
    if letter == b"M":
        named = word if re.fullmatch(r"[A-Za-z_][\w.]{0,59}", word, re.ASCII) else "that"
        return Problem("module", f"there is no module {named} where answers are graded")
    if word == "NoneType":
        return Problem("kind", "it returns None: is a `return` missing?")
    named = word if isinstance(getattr(builtins, word, None), type) else "something else"
    return Problem("kind", f"expected an array or a number, got {named}")


def exception_text(data: bytes) -> str:
    """Name and message of an exception; the name of one of Python's own, any other is "an exception"."""
    name, _, message = data.decode("utf-8", "replace")[: MOST_MESSAGE + 60].partition("\0")
    known = getattr(builtins, name, None)
    name = name if isinstance(known, type) and issubclass(known, BaseException) else "an exception"
    message = "".join(c if c.isprintable() else " " for c in message).strip()
    message = re.sub(r"0x[0-9a-fA-F]{6,}", "0x...", message)  # an address, another one in each run
    return f"{name}: {message}" if message else name


def decode_values(data: bytes) -> object:
    """Read arrays: first what they claim to be, then, if the bytes are as many as these make, the bytes."""
    if len(data) > MOST_BYTES:
        raise ValueError("reply: an output that is too long")
    count, at = data[0] if data else 0, 1
    claims = []
    for _ in range(1 if count == ONE else count):
        code, ndim = struct.unpack_from("<BB", claimable(data, at, 2), 0)
        if code >= len(DTYPES) or ndim > MOST_AXES:
            raise ValueError("reply: no such dtype, or too many axes")
        shape = struct.unpack(f"<{ndim}q", claimable(data, at + 2, 8 * ndim))
        if any(n < 0 for n in shape):
            raise ValueError("reply: a negative length")
        # What is empty along one axis may be endless along another.
        if math.prod(max(n, 1) for n in shape) > MOST_BYTES:
            raise ValueError("reply: too long an axis")
        claims.append((np.dtype(DTYPES[code]).newbyteorder("<"), shape))
        at += 2 + 8 * ndim
    if not data or (count != ONE and count > MOST_PARTS):
        raise ValueError("reply: no values, or too many")
    if len(data) - at != sum(dtype.itemsize * math.prod(shape) for dtype, shape in claims):
        raise ValueError("reply: not as many bytes as it claims")
    values = []
    for dtype, shape in claims:
        size = math.prod(shape)
        array = np.frombuffer(data, dtype, size, at).reshape(shape)
        values.append((array.view(np.uint8) != 0 if dtype.kind == "b" else array)[()])  # no truth value but 0 and 1
        at += size * dtype.itemsize
    return values[0] if count == ONE else tuple(values)


def claimable(data: bytes, at: int, length: int) -> bytes:
    """Cut out a piece of a reply; raises ValueError if it ends before."""
    piece = data[at : at + length]
    if len(piece) < length:
        raise ValueError("reply: it ends too early")
    return piece
