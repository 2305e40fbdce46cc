"""The program in the sandbox: it runs a student's program, calls its function and sends numbers back.

It has the standard library, the packages that an answer may use and the kit's tools that cut programs out of notebooks.
It serves as a server that forks a child for each answer. From the first line of a student's on, everything in the child
is in the student's hands: the other end, `channel`, believes none of it. Requests come through one pipe and replies go
through another, each with its length before it; a request is a pickle (it comes from the grader), a reply is:

    V count dtype ndim shape ... data    an output: one value, or a tuple of `count`
    O                                    a piece of the program that ran
    U                                    a blank: NotImplementedError raised in the student's own lines
    A                                    there is no function of that name
    C position ...                       an output, as above, of a call that changed its argument at that position
    E line piece name message            an exception
    J ...                                the programs of the answers, as JSON
    M name                               a module that is not there
    K name, D kind, L, B                 a value that is no number, of a dtype that is none, too many, too big
"""

import base64
import ctypes
import importlib
import importlib.util
import io
import json
import os
import pickle
import signal
import socket
import struct
import sys

DTYPES = ("?", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", "f2", "f4", "f8")
MOST_BYTES = 1 << 20  # of an output; no right one has more than some thousand
MOST_PARTS = 16
MOST_AXES = 8
MOST_MESSAGE = 160  # characters of an exception's message
ONE = 255  # the count of an output that is no tuple


class CannotBeSent(Exception):
    """A value that cannot be sent; carries the reply that says why."""


def encode(value: object) -> bytes:
    """Write an output as a reply: arrays, numbers and tensors, or a tuple or list of these.

    >>> encode(True)
    b'V\\xff\\x00\\x00\\x01'
    """
    if issubclass(type(value), list) and is_regular(value):
        return encode(as_array(value))
    several = issubclass(type(value), tuple | list)
    if several and len(value) > MOST_PARTS:
        return b"L"
    arrays = [as_array(part) for part in (value if several else (value,))]
    head = bytes([ord("V"), len(arrays) if several else ONE])
    for array in arrays:
        length = array.itemsize  # of an empty array, too: its longest axis becomes bytes once it is summed
        for n in array.shape:
            length *= max(n, 1)
        if array.ndim > MOST_AXES or length > MOST_BYTES:
            return b"B"
        code = DTYPES.index(array.dtype.str[1:].replace("b1", "?"))
        head += struct.pack(f"<BB{array.ndim}q", code, array.ndim, *array.shape)
    reply = head + b"".join(array.tobytes() for array in arrays)
    return reply if len(reply) <= MOST_BYTES else b"B"


def is_regular(value: list) -> bool:
    """Whether a list stands for one array of numbers, as `comparison.plain` takes it."""
    import numpy as np

    try:
        return bool(value) and np.array(value).dtype.kind in "biuf"
    except (ValueError, TypeError, OverflowError):
        return False


def as_array(value: object):
    """Give a number, an array or a tensor as a plain little-endian array; raises CannotBeSent for anything else."""
    import numpy as np

    cls, torch = type(value), sys.modules.get("torch")
    if torch is not None and issubclass(cls, torch.Tensor):
        value = value.detach().cpu().resolve_neg().numpy()
    elif not issubclass(cls, bool | int | float | complex | np.generic | np.ndarray | list):
        raise CannotBeSent(b"K" + cls.__name__.encode()[:60])
    array = np.array(value, subok=False)
    if array.dtype.kind not in "biuf":
        raise CannotBeSent(b"D" + array.dtype.kind.encode())
    if array.dtype.itemsize > 8:  # longdouble
        array = array.astype(np.float64)
    return array.astype(array.dtype.newbyteorder("<"))


class Session:
    """What a worker is asked to do: to cut programs out of a notebook, to run one, and to call its function."""

    def __init__(self, tools: dict, look: dict[str, str]):
        self.tools, self.look_modules, self.namespace, self.pieces = tools, look, {"__name__": "__main__"}, []

    def answer(self, request: tuple) -> bytes:
        """Do what a request asks for, and write the reply: its first word says which method, the rest its arguments."""
        try:
            return getattr(self, request[0])(*request[1:])
        except CannotBeSent as refusal:
            return refusal.args[0]
        except ModuleNotFoundError as error:
            return b"M" + str(error.name).encode()[:60]
        except BaseException as error:  # SystemExit and KeyboardInterrupt as well
            line, piece, last = own_line(error.__traceback__, self.pieces)
            if isinstance(error, NotImplementedError) and last:
                return b"U"
            return b"E" + struct.pack("<IB", line, piece) + f"{type(error).__name__}\0{message_of(error)}".encode()

    def cut(self, cells: list[tuple[str, str]], asked: list[tuple]) -> bytes:
        """Cut programs out of a notebook's cells: (name, blanks, packages, forbidden, given) each. Nothing is run."""
        program, shapes = self.tools["program"], self.tools["shapes"]
        cells = [program.Cell(*cell) for cell in cells]
        found = []
        for arguments in asked:
            made = program.program(cells, *arguments)
            text = "\n".join(text for _, text in made.pieces)
            found.append((made.pieces, made.calls, made.refused, list(shapes.shapes_in(text))))
        return b"J" + json.dumps(found).encode()

    def look(self, *task: object) -> bytes:
        """Look for the mistake in a program, in a worker that has run nothing of it: `look.in_the_sandbox`."""
        for name, path in self.look_modules.items():
            look = load(name, path)
        return b"J" + look.in_the_sandbox(*task).encode()

    def run(self, label: str, source: str) -> bytes:
        """Run a piece of a program."""
        self.pieces.append(f"<{label}>")
        exec(compile(source, self.pieces[-1], "exec", dont_inherit=True), self.namespace)
        return b"O"

    def call(self, name: str, content: bytes) -> bytes:
        """Call a function of the program on pickled arguments."""
        if not callable(self.namespace.get(name)):
            return b"A"
        given = pickle.loads(content)
        reply = encode(self.namespace[name](*given))
        changed = [i for i, pair in enumerate(zip(given, pickle.loads(content), strict=True)) if not same(*pair)]
        return b"C" + bytes(changed[:1]) + reply if changed and reply[:1] == b"V" else reply


def load(name: str, path: str):
    """Import a module of the kit's from its file; it needs the standard library, or also NumPy, and no labkit."""
    spec = importlib.util.spec_from_file_location(name, path)
    sys.modules[name] = module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def same(a: object, b: object) -> bool:
    """Whether an argument is still what it was."""
    if hasattr(a, "tobytes") and hasattr(b, "tobytes"):
        return (a.shape, a.dtype) == (b.shape, b.dtype) and a.tobytes() == b.tobytes()
    if isinstance(a, tuple | list):
        return type(a) is type(b) and len(a) == len(b) and all(map(same, a, b))
    return bool(a == b or (a != a and b != b))


def message_of(error: BaseException) -> str:
    """The beginning of an exception's message in one line; "" if it cannot even be written."""
    try:
        return " ".join(str(error).split())[:MOST_MESSAGE]
    except BaseException:
        return ""


def own_line(trace, pieces: list[str]) -> tuple[int, int, bool]:
    """The last line of the program in a traceback and its piece, 0 if none; and whether it was raised right there."""
    line, piece, last = 0, 0, False
    while trace is not None:
        file = trace.tb_frame.f_code.co_filename
        last = file in pieces
        line, piece, trace = (trace.tb_lineno if last else line), (pieces.index(file) if last else piece), trace.tb_next
    return line, min(piece, 255), last


class Only:
    """Without a sandbox: a finder that knows no packages but some. A student's code can take it away."""

    def __init__(self, packages: list[str]):
        self.packages = {*packages, *sys.stdlib_module_names}

    def find_spec(self, name, path=None, target=None):
        """Say that there is no such module, or leave it to the other finders."""
        if name.partition(".")[0] not in self.packages:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)


# ---------------------------------------------------------------------------------- the server and its children


def main(options: dict) -> None:
    """Load packages and tools, then serve: by pipes of its own, or in a sandbox by a child for each pair of pipes.

    No student's code runs in the server: a child is forked for each question and killed after it, so that what one
    answer does to its process is over before the next one begins.
    """
    sys.path += options["path"]
    for package in options["load"]:
        importlib.import_module(package)
    tools = {name: load(f"_{name}", path) for name, path in options["tools"].items()}
    if options["only"] is not None:  # no sandbox: this process is used once
        requests, replies = os.dup(0), os.dup(1)
        sys.meta_path.insert(0, Only(options["only"]))
        limit(options)
        serve(requests, replies, tools, options["look"])
        return
    control = socket.socket(fileno=os.dup(0))
    control.send(b"r")
    while True:
        message, pipes, _, _ = socket.recv_fds(control, 1, 2)
        if not message:
            return
        child = os.fork()
        if child == 0:
            control.close()
            limit(options)
            lock_in(options)
            serve(*pipes, tools, options["look"])
            os._exit(0)
        for pipe in pipes:
            os.close(pipe)
        done = control.recv(1)  # comes when the grader has all that it wants, or wants no more
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        if not done:
            return
        control.send(b"d")


def limit(options: dict) -> None:
    """Set the limits of this process, where the system has them."""
    try:
        import resource
    except ImportError:
        return
    wanted = {
        "AS": options["memory"],
        "FSIZE": options["file_size"],
        "NPROC": options["threads"],
        "CPU": options["cpu_s"],
        "NOFILE": 64,
        "CORE": 0,
    }
    for name, value in wanted.items():
        if value is not None:
            resource.setrlimit(getattr(resource, f"RLIMIT_{name}"), (value, value))


def lock_in(options: dict) -> None:
    """Leave root for good, then give up the system calls that the filter refuses."""
    if options["first_uid"] is not None:
        uid = options["first_uid"] + os.getpid() % options["uids"]
        os.setgroups([])
        os.setgid(uid)
        os.setuid(uid)
    program = base64.b64decode(options["filter"])
    code = ctypes.create_string_buffer(program, len(program))
    head = struct.pack("@HP", len(program) // 8, ctypes.addressof(code))  # struct sock_fprog
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.prctl(38, 1, 0, 0, 0) or libc.prctl(22, 2, head, 0, 0):  # no new privileges; filter the system calls
        raise OSError(ctypes.get_errno(), "the filter of system calls cannot be set")


def serve(requests: int, replies: int, tools: dict, look: dict[str, str]) -> None:
    """Answer requests until there are no more. The first reply, O, says that the packages are loaded."""
    null = os.open(os.devnull, os.O_RDWR)
    for standard in (0, 1, 2):
        os.dup2(null, standard)
    with os.fdopen(requests, "rb") as stream, os.fdopen(replies, "wb", buffering=0) as out:
        send(out, b"O")
        session = Session(tools, look)
        while len(head := stream.read(4)) == 4:
            send(out, session.answer(pickle.loads(stream.read(*struct.unpack("<I", head)))))


def send(stream: io.RawIOBase, reply: bytes) -> None:
    """Write a reply with its length before it."""
    data = memoryview(struct.pack("<I", len(reply)) + reply)
    while data:
        data = data[stream.write(data) :]


if __name__ == "__main__":
    main(json.loads(sys.argv[1]))
