"""The other end of a worker's pipes: requests out, replies in until its time is up; nothing that comes is believed.

A reply is a number of bytes with a limit, a letter, and then numbers or a short printable text: never a pickle. Long
texts come only where one is asked for; in the place of an output they end the worker. A stranger's words are not
repeated, but for those of a message; one's own are (`Worker.own`). Texts of replies to secret cases are for nobody to
read: what students are told comes from public cases (`grade`).
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
from dataclasses import dataclass, replace
from typing import BinaryIO

import numpy as np

from labgrader.comparison import Listed, Problem
from labgrader.program.slice import Program
from labgrader.run.process import DTYPES, LISTED, MOST_AXES, MOST_BYTES, MOST_MESSAGE, MOST_PARTS, MOST_PRINTED, ONE
from labgrader.run.stopwatch import Stopwatch, memory_of

# What a worker may say of an output that is none, and of a cell: a text, or a text and the name of a type of Python's.
KNOWN = {
    "kind": r"it returns None: is a `return` missing\?|expected an array or a number, got (a function|a (tuple|list) of"
    r" \d{1,9}|(?P<type>\w+))",
    "dtype": r"expected real numbers, got dtype (complex\d+|object|[<>|]?[USMm]\d*(\[\w+\])?)"
    r"|a tensor of torch\.\w{1,12}, torch\.\w{1,12} is not an array of numbers",
    "size": rf"it returns more than {MOST_BYTES >> 20} MB",
    "missing": r"its cell (defines no function of this name|makes it a (?P<type>\w+), not a function)",
}
UNKNOWN = {"kind": "expected an array or a number, got something else", "dtype": "expected real numbers, got others"}
MOST_REPLY = MOST_BYTES + 1024  # bytes: an output, or an exception, with what is around it
MOST_PROGRAMS = 32 << 20  # bytes; the programs of a long notebook are long
SHORTEST_LOOK_S = 0.02  # between two looks at a worker's time
MEMORY_LOOK_S = 0.1  # and at its memory, where that is looked at
MOST_FOUND = 1 << 20  # bytes of what is found in a program, which may have written them itself


class Text(str):
    """What a worker says where a text is asked for: programs, or what is found in one; no answer's output."""


@dataclass(frozen=True)
class Changed:
    """An output of a call that changed its arguments at some positions."""

    positions: tuple[int, ...]
    value: object


class WorkerLost(Exception):
    """The worker is gone, by its own doing or because it had to be stopped; `problem` says why."""

    def __init__(self, problem: Problem):
        super().__init__(problem.says)
        self.problem = problem


class Worker:
    """One worker: `ask` it, and `close` it; it is a context manager, too.

    requests, replies: its pipes; kill: ends its process and everything that it started. own: a file of what it prints,
    where it runs the code of whoever reads what comes of it; None for a stranger's. pid: of its process; None
    if it is not known: then the clock limits. memory: bytes that it may hold, where the kernel does not see to that.
    slept_s: seconds asleep in all requests so far.
    """

    def __init__(
        self,
        requests: BinaryIO,
        replies: BinaryIO,
        kill: Callable[[], None],
        own: BinaryIO | None = None,
        pid: int | None = None,
        memory: int | None = None,
    ):
        self.requests, self.replies, self.kill, self.own, self.pid = requests, replies, kill, own, pid
        self.memory, self.stopped, self.closed, self.slept_s = memory, None, False, 0.0
        self.ending = threading.Lock()

    def __enter__(self) -> "Worker":
        return self

    def __exit__(self, *exception) -> None:
        self.close()

    def ask(self, request: object, limit_s: float, text: int = 0, asleep_s: float | None = None) -> object:
        """Send a request and return what the reply holds; raises WorkerLost, and kills the worker, if none came.

        limit_s: seconds of CPU time that it may take (`stopwatch`); asleep_s: that it may sleep, with those before.
        text: the most bytes of a Text that may come; without it, a Text is no reply.
        """
        data = pickle.dumps(request, protocol=pickle.HIGHEST_PROTOCOL)
        return self.exchange(struct.pack("<I", len(data)) + data, limit_s, text, asleep_s)

    def programs(self, cells: list, asked: list, limit_s: float) -> list[tuple[Program, list[str]]]:
        """Have programs cut out of a notebook, by a worker that has run nothing of it; each with fingerprints."""
        found = self.ask(("cut", cells, asked), limit_s, MOST_PROGRAMS)
        if not isinstance(found, Text):
            raise WorkerLost(found if isinstance(found, Problem) else Problem("ended", "its cells cannot be read"))
        programs = []
        for ways, prints in json.loads(found):
            made, *late = (
                Program(tuple(map(tuple, pieces)), tuple(calls), no, copies=tuple(copies))
                for pieces, calls, no, copies in ways
            )
            programs.append((replace(made, late=late[0] if late else None), prints))
        return programs

    def greet(self, limit_s: float) -> None:
        """Wait until the worker has loaded its packages; no student's code has run by then.

        Raises WorkerLost if it has ended, and says why where it says so itself.
        """
        said = self.exchange(b"", limit_s, MOST_MESSAGE)
        if isinstance(said, Text):
            raise WorkerLost(Problem("ended", said))

    def exchange(self, data: bytes, limit_s: float, text: int = 0, asleep_s: float | None = None) -> object:
        """Write, then read one reply. The limit holds for both: a pipe that nobody reads gets full."""
        done, stopwatch = threading.Event(), Stopwatch(self.pid)
        threading.Thread(target=self.watch, args=(stopwatch, limit_s, asleep_s, done), daemon=True).start()
        try:
            self.requests.write(data)
            self.requests.flush()
            return decode(self.read(max(text, MOST_REPLY)), text > 0, self.own is not None)
        except (OSError, EOFError, ValueError) as error:
            self.close()
            if self.stopped is not None:
                raise WorkerLost(self.stopped) from None
            if isinstance(error, ValueError):
                raise WorkerLost(
                    Problem("channel", "it wrote to the grader's channel, or returned far too much")
                ) from None
            raise WorkerLost(Problem("ended", "it ended or crashed the process that it ran in")) from None
        finally:
            done.set()
            stopwatch.used()
            self.slept_s += max(stopwatch.slept, 0.0)

    def printed(self) -> str:
        """The beginning of what an own answer has printed, and one character more if that is not all."""
        if self.own is None:
            return ""
        self.own.seek(0)
        return self.own.read(4 * (MOST_PRINTED + 1)).decode(errors="replace").replace("\r\n", "\n")

    def watch(self, stopwatch: Stopwatch, limit_s: float, asleep_s: float | None, done: threading.Event) -> None:
        """Kill the worker unless it is done within its limits, which ends the reading and writing of `exchange`."""
        may_sleep = math.inf if asleep_s is None else asleep_s - self.slept_s
        left, stopped = limit_s, None
        while left > 0.0 and stopped is None:
            pause = max(min(left, may_sleep - stopwatch.slept) / 2.0, SHORTEST_LOOK_S)
            if done.wait(pause if self.memory is None else min(pause, MEMORY_LOOK_S)):
                return
            if self.memory is not None and memory_of(self.pid) > self.memory:
                stopped = Problem("ended", f"it used more than {self.memory >> 20} MB of memory")
            left = limit_s - stopwatch.used()
            if stopwatch.slept >= may_sleep:
                stopped = Problem("time", f"it slept for {asleep_s:.3g} seconds")
        if done.is_set():  # its reply came while its time was looked at
            return
        self.stopped = stopped or Problem("time", "it did not return in time")
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
        for stream in filter(None, (self.requests, self.replies)):
            with contextlib.suppress(OSError):
                stream.close()


def decode(reply: bytes, text: bool = False, own: bool = False) -> object:
    """Read a reply: an array or number, a tuple of these, None for a piece that ran, or the Problem that it tells.

    text: whether a Text is a reply, too; own: whether its words are repeated. Raises ValueError for anything that a
    worker does not write.

    >>> decode(b"V\\xff\\x03\\x01" + struct.pack("<q2i", 2, 5, -1))
    array([ 5, -1], dtype=int32)
    """
    letter, rest = reply[:1], reply[1:]
    if letter == b"V":
        return decode_values(rest)
    if letter == b"J" and text:
        return Text(rest.decode("utf-8", "replace"))
    if letter == b"C" and rest and rest[0] > 0 and rest[rest[0] + 1 : rest[0] + 2] == b"V":
        return Changed(tuple(rest[1 : rest[0] + 1]), decode_values(rest[rest[0] + 2 :]))
    if letter == b"E" and len(rest) >= 5:
        line, piece = struct.unpack("<IB", rest[:5])
        return Problem("exception", f"it raises {exception_text(rest[5:], own)}", ((line, str(piece)),))
    if letter == b"P":
        kind, _, says = printable(rest[:300]).partition("\0")
        return trusted_problem(kind, says, own)
    if letter == b"M":
        word = rest.decode("ascii", "replace")
        named = word if re.fullmatch(r"[A-Za-z_][\w.]{0,59}", word, re.ASCII) else "that"
        return Problem("module", f"there is no module {named} where answers are graded")
    if letter not in (b"O", b"U") or rest:
        raise ValueError("reply: expected one that a worker writes")
    return None if letter == b"O" else Problem("unanswered", "not answered yet")


def printable(data: bytes) -> str:
    """A text in one line without what could move a terminal's cursor."""
    return "".join(c if c.isprintable() or c == "\0" else " " for c in data.decode("utf-8", "replace"))


def trusted_problem(kind: str, says: str, own: bool) -> Problem:
    """What is wrong with an output, in the worker's words if they are one's own or all of them are known."""
    if kind not in KNOWN:
        raise ValueError("reply: no such kind")
    found = re.fullmatch(KNOWN[kind], says, re.ASCII)
    name = found.groupdict().get("type") if found else None
    if own or (found and (name is None or isinstance(getattr(builtins, name, None), type))):
        return Problem(kind, says)
    return Problem(kind, UNKNOWN.get(kind, "its cell makes it something else, not a function"))


def exception_text(data: bytes, own: bool) -> str:
    """Name and message of an exception; a name that is neither one's own nor Python's is "an exception"."""
    name, _, message = printable(data[: MOST_MESSAGE + 60]).partition("\0")
    known = getattr(builtins, name, None)
    known = own or (isinstance(known, type) and issubclass(known, BaseException))
    message = re.sub(r"0x[0-9a-fA-F]{6,}", "0x...", message.strip())  # an address, another one in each run
    return f"{name if known else 'an exception'}: {message}" if message else name if known else "an exception"


def decode_values(data: bytes) -> object:
    """Read arrays: first what they claim to be, then, if the bytes are as many as these make, the bytes."""
    if len(data) > MOST_BYTES:
        raise ValueError("reply: an output that is too long")
    count, at = data[0] if data else 0, 1
    claims = []
    for _ in range(1 if count == ONE else count):
        code, ndim = struct.unpack_from("<BB", claimable(data, at, 2), 0)
        kind, code = Listed if code & LISTED else np.ndarray, code & ~LISTED
        if code >= len(DTYPES) or ndim > MOST_AXES:
            raise ValueError("reply: no such dtype, or too many axes")
        shape = struct.unpack(f"<{ndim}q", claimable(data, at + 2, 8 * ndim))
        if any(n < 0 for n in shape):
            raise ValueError("reply: a negative length")
        # What is empty along one axis may be endless along another.
        if math.prod(max(n, 1) for n in shape) > MOST_BYTES:
            raise ValueError("reply: too long an axis")
        claims.append((np.dtype(DTYPES[code]).newbyteorder("<"), shape, kind))
        at += 2 + 8 * ndim
    if not data or (count != ONE and count > MOST_PARTS):
        raise ValueError("reply: no values, or too many")
    if len(data) - at != sum(dtype.itemsize * math.prod(shape) for dtype, shape, _ in claims):
        raise ValueError("reply: not as many bytes as it claims")
    values = []
    for dtype, shape, kind in claims:
        size = math.prod(shape)
        array = np.frombuffer(data, dtype, size, at).reshape(shape)
        array = array.view(np.uint8) != 0 if dtype.kind == "b" else array
        values.append(array.view(kind)[()])  # no truth value but 0 and 1
        at += size * dtype.itemsize
    return values[0] if count == ONE else tuple(values)


def claimable(data: bytes, at: int, length: int) -> bytes:
    """Cut out a piece of a reply; raises ValueError if it ends before."""
    piece = data[at : at + length]
    if len(piece) < length:
        raise ValueError("reply: it ends too early")
    return piece
