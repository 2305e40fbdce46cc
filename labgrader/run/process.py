"""The program in a worker: it runs a student's program, calls its function and sends numbers back.

From the first line of a student's on, everything in this process is in the student's hands: the other end, `channel`,
believes none of it. Requests come through one pipe and replies go through another, each with its length before it; a
request is a pickle, since it comes from the check or the grader; a reply is:

    V count dtype ndim shape ... data    an output: one value, or a tuple of `count`
    C count position ... V ...           an output of a call that changed its arguments at these positions
    P kind says                          an output that is none, in words
    O                                    a piece of the program that ran
    U                                    a blank: NotImplementedError raised in the student's own lines
    E line piece name message            an exception
    M name                               a module that is not there
    J ...                                JSON: the programs of a notebook, or what was found in one
"""

import contextlib
import importlib
import io
import json
import os
import pickle
import queue
import signal
import struct
import sys
import threading
import time
from collections.abc import Callable, Iterator

import numpy as np

from labgrader.comparison import MOST_BYTES, Listed, Problem, as_numpy, parts, quiet
from labgrader.program.cell import Cell
from labgrader.program.fingerprint import fingerprints
from labgrader.program.live import LiveProgram, altered, own_entry
from labgrader.program.slice import program
from labgrader.reply.repair_job import Look

DTYPES = ("?", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", "f2", "f4", "f8")
MOST_PARTS = 16
MOST_AXES = 8
MOST_MESSAGE = 160  # characters of an exception's message
MORE = b'J"more"'  # asks for the cases of other seeds, in the middle of a repair; they are the next request
LISTED = 64  # added to the code of a dtype: the numbers came in a list
ONE = 255  # the count of an output that is no tuple
MOST_PRINTED = 600  # characters that are kept of what an answer prints
# What a plain worker refuses, since a sandbox has none of it: it is no defence, but a tick here is a tick there.
REFUSED = ("subprocess.", "socket.connect", "socket.bind", "socket.send", "socket.get", "shutil.", "os.exec", "os.fork")
REFUSED += ("os.posix_spawn", "os.system", "os.kill", "os.remove", "os.rename", "os.mkdir", "os.rmdir", "os.link")
REFUSED += ("os.symlink", "os.truncate", "os.chmod", "os.chown", "os.utime", "webbrowser.")
# Modules whose locks and memory need a file system for them, and functions of os that ask for a filtered system call.
SHARED = ("multiprocessing.synchronize", "multiprocessing.shared_memory")
CALLS = "memfd_create pidfd_open posix_fadvise sched_setaffinity sched_setparam sched_setscheduler setns setpriority"
CALLS += " sync fsync fdatasync unshare nice mkfifo mknod pipe pipe2"


def encode(value: object) -> bytes:
    """Write an output as a reply: arrays, numbers and tensors, or a tuple or list of these.

    >>> encode(True)
    b'V\\xff\\x00\\x00\\x01'
    """
    value = as_numpy(value)
    if isinstance(value, Problem):
        return problem_reply(value)
    head = bytes([ord("V"), len(value) if isinstance(value, tuple) else ONE])
    arrays = [as_sent(part) for part in parts(value)]
    for part, array in zip(parts(value), arrays, strict=True):
        length = array.itemsize  # of an empty array, too: its longest axis becomes bytes once it is summed
        for n in array.shape:
            length *= max(n, 1)
        if array.ndim > MOST_AXES or length > MOST_BYTES:
            return problem_reply(Problem("size", f"it returns more than {MOST_BYTES >> 20} MB"))
        code = DTYPES.index(array.dtype.str[1:].replace("b1", "?")) + LISTED * isinstance(part, Listed)
        head += struct.pack(f"<BB{array.ndim}q", code, array.ndim, *array.shape)
    reply = head + b"".join(array.tobytes() for array in arrays)
    if len(reply) > MOST_BYTES:
        return problem_reply(Problem("size", f"it returns more than {MOST_BYTES >> 20} MB"))
    return reply


def as_sent(value: object) -> np.ndarray:
    """A number or array as a little-endian array of at most 8 bytes each."""
    array = np.asarray(value)
    if array.dtype.itemsize > 8:  # longdouble
        array = array.astype(np.float64)
    return array.astype(array.dtype.newbyteorder("<"))


def problem_reply(problem: Problem) -> bytes:
    """A reply that says what is wrong with an output."""
    return b"P" + f"{problem.kind}\0{problem.says}".encode()


class Session:
    """What a worker is asked to do: cut programs out of a notebook, run one, call its function, look for its mistake.

    more: fetches the cases that a repair needs beside the public ones; it is called at most once.
    """

    def __init__(self, more: Callable[[], list]):
        self.program, self.more = LiveProgram(), more

    def answer(self, request: tuple) -> bytes:
        """Do what a request asks for, and write the reply: its first word says which method, the rest its arguments."""
        try:
            return getattr(self, request[0])(*request[1:])
        except ModuleNotFoundError as error:
            return b"M" + str(error.name).encode()[:60]
        except BaseException as error:  # SystemExit and KeyboardInterrupt as well
            entry, last = own_entry(error.__traceback__, self.program.files)
            if isinstance(error, NotImplementedError) and last:
                return b"U"
            line, file = (entry.tb_lineno, entry.tb_frame.f_code.co_filename) if entry else (0, "")
            piece = min(self.program.files.index(file), 255) if entry else 0
            return b"E" + struct.pack("<IB", line, piece) + f"{type(error).__name__}\0{message_of(error)}".encode()

    def cut(self, cells: list[tuple[str, str]], asked: list[tuple]) -> bytes:
        """Cut programs out of a notebook's cells: (name, blanks, packages, forbidden, kit, given) each; run none."""
        cells = [Cell(*cell) for cell in cells]
        found = []
        for arguments in asked:
            made = program(cells, *arguments)
            text = "\n".join(text for _, text in made.pieces)
            ways = [(way.pieces, way.calls, way.refused, way.copies) for way in (made, made.late) if way]
            found.append((ways, list(fingerprints(text))))
        return b"J" + json.dumps(found).encode()

    def run(self, label: str, source: str) -> bytes:
        """Run a piece of a program."""
        with quiet():
            self.program.run(label, source)
        return b"O"

    def call(self, name: str, content: bytes) -> bytes:
        """Call a function of the program on pickled arguments."""
        function = self.program.namespace.get(name)
        if not callable(function):
            what = "defines no function of this name" if function is None else f"makes it a {type(function).__name__}"
            return problem_reply(Problem("missing", f"its cell {what}{', not a function' * (function is not None)}"))
        given = pickle.loads(content)
        with quiet():
            reply = encode(function(*given))
        changed = altered(pickle.loads(content), given)
        return b"C" + bytes([len(changed), *changed]) + reply if changed and reply[:1] == b"V" else reply

    def watch(self, *job: object) -> bytes:
        """Look at a program with instruments: arguments are those of `repair_job.Look`."""
        return b"J" + Look(*job).watch().encode()

    def repair(self, *job: object) -> bytes:
        """Look for the place of a program's mistake."""
        return b"J" + Look(*job).repair(self.more).encode()


def message_of(error: BaseException) -> str:
    """The beginning of an exception's message in one line; "" if it cannot even be written."""
    try:
        text = " ".join(str(error).split())
        return text if len(text) <= MOST_MESSAGE else text[:MOST_MESSAGE] + " ..."
    except BaseException:
        return ""


# ------------------------------------------------------------------------------------------- requests and replies


def serve(requests: Iterator[tuple], replies: io.RawIOBase) -> None:
    """Answer requests until there are no more. The first reply, O, says that the packages are loaded."""
    send(replies, b"O")

    def more() -> list:
        send(replies, MORE)
        return next(requests)

    session = Session(more)
    for request in requests:
        send(replies, session.answer(request))


def received(stream: io.BufferedIOBase) -> Iterator[tuple]:
    """The requests that come through a pipe."""
    while len(head := stream.read(4)) == 4:
        yield pickle.loads(stream.read(*struct.unpack("<I", head)))


def send(stream: io.RawIOBase, reply: bytes) -> None:
    """Write a reply with its length before it."""
    data = memoryview(struct.pack("<I", len(reply)) + reply)
    while data:
        data = data[stream.write(data) :]


def limit(options: dict) -> None:
    """Set the limits of this process, where the system has them."""
    try:
        import resource
    except ImportError:
        return
    wanted = {
        "AS": options["memory"] if sys.platform == "linux" else None,  # macOS refuses a smaller one than it shows
        "FSIZE": options["file_size"],
        "NPROC": options["threads"],
        "CPU": options["cpu_s"] + int(time.process_time()),
        "NOFILE": 64,
        "CORE": 0,
    }
    for name, value in wanted.items():
        if value is not None:
            resource.setrlimit(getattr(resource, f"RLIMIT_{name}"), (value, value))


def without_standard_streams() -> None:
    """Let nothing that a student's code reads or writes by a number reach what this process was started with."""
    null = os.open(os.devnull, os.O_RDWR)
    for standard in (0, 1, 2):
        os.dup2(null, standard)


# ------------------------------------------------------------------------------------------------ a plain worker


def main(options: dict) -> None:
    """Serve as a plain process that is used once, and ends when the one that started it does."""
    for package in options["load"]:
        importlib.import_module(package)
    requests, replies, printed = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb", buffering=0), os.dup(2)
    without_standard_streams()
    sys.stdout = sys.stderr = Printed(printed)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Jupyter interrupts a kernel and all that it started
    limit(options)
    sys.meta_path.insert(0, Only(options["only"]))
    as_in_the_sandbox()
    serve(until_the_end(requests), replies)


class Printed(io.TextIOBase):
    """A stream that puts the beginning of what is written to it into a file, and one character more if there is any."""

    encoding = "utf-8"

    def __init__(self, file: int):
        self.file, self.left = file, MOST_PRINTED + 1

    def write(self, text: str) -> int:
        """Write as much of the text as there is room for."""
        kept = text[: self.left]
        self.left -= len(kept)
        if kept:
            os.write(self.file, kept.encode(errors="replace"))
        return len(text)


class Only:
    """A finder that knows no packages but some. A student's code can take it away."""

    def __init__(self, packages: list[str]):
        self.packages = {*packages, *sys.stdlib_module_names}

    def find_spec(self, name, path=None, target=None):
        """Say that there is no such module, or leave it to the other finders."""
        top = name.partition(".")[0]
        if top not in self.packages and not top.startswith("_sysconfigdata"):  # the standard library's, by machine
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)


def as_in_the_sandbox() -> None:
    """Refuse in this process what a sandbox does not have: files but Python's, other processes, accounts."""
    for name in CALLS.split():
        if hasattr(os, name):
            setattr(os, name, refused)
    with contextlib.suppress(ImportError):
        import pwd

        pwd.getpwuid = pwd.getpwnam = refused
    places = [os.path.dirname(os.__file__), *filter(None, sys.path)]
    readable = tuple(os.path.normcase(os.path.abspath(place)) for place in places)

    def audit(event: str, args: tuple) -> None:
        if event == "open":
            absent = not may_open(args[0], args[2], readable)
        elif event == "import":
            absent = args[0] in SHARED
        elif event == "sqlite3.connect":
            absent = args[0] != ":memory:"
        else:
            absent = event.startswith(REFUSED)
        if absent:
            refused(event)

    sys.addaudithook(audit)


def may_open(path: str | bytes | int, flags: int, readable: tuple[str, ...]) -> bool:
    """Whether a sandbox has a file: those of some folders are there to read, and some devices."""
    full = path if isinstance(path, int) else os.path.normcase(os.path.abspath(os.fsdecode(path)))
    if full in ("/dev/null", "/dev/urandom", "/dev/zero"):
        return True
    writes = flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC)
    return not writes and (isinstance(full, int) or full.startswith(readable))


def refused(*what: object) -> None:
    """Raise PermissionError."""
    raise PermissionError("an answer does not do this" + "".join(f": {word}" for word in what if isinstance(word, str)))


def until_the_end(stream: io.BufferedIOBase) -> Iterator[tuple]:
    """The requests that come through a pipe; once it is closed this process ends, whatever an answer is doing."""
    waiting: queue.SimpleQueue = queue.SimpleQueue()

    def read() -> None:
        for request in received(stream):
            waiting.put(request)
        os._exit(0)

    threading.Thread(target=read, daemon=True).start()
    while True:
        yield waiting.get()
