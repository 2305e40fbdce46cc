"""What a worker sees and may use, measured from inside; that it dies with the grader; that there is no way round it."""

import contextlib
import itertools
import json
import os
import pickle
import signal
import socket
import subprocess
import sys
import textwrap
import threading
import time
from pathlib import Path
from unittest.mock import Mock

import grading_course as kit
import numpy as np
import pytest

from labgrader.run.channel import Worker, WorkerLost
from labgrader.sandbox import bwrap, sandbox, seccomp
from labgrader.sandbox.sandbox import Limits

LIMITS = Limits(memory_mb=512, file_mb=2, threads=8)
PATIENCE = 120.0  # seconds that a busy machine may take for what is done at once


@pytest.fixture(scope="module")
def worker():
    with sandbox.fresh_worker(("numpy",), LIMITS) as started:
        yield started


def called(worker: Worker, *args):
    """Call the function `f` of the sandbox."""
    return worker.ask(("call", "f", pickle.dumps(args)), PATIENCE)


def told(worker: Worker, body: str):
    """Run lines inside a function `f` in the sandbox and give what it returns."""
    source = "import os\nimport numpy as np\ndef f():\n" + textwrap.indent(textwrap.dedent(body), "    ")
    assert worker.ask(("run", "f", source), PATIENCE) is None
    return called(worker)


def test_the_worker_is_nobody_and_alone(worker):
    uid, gid, groups, pid = told(worker, "return os.getuid(), os.getgid(), len(os.getgroups()), os.getpid()")
    if os.getuid() == 0:
        assert uid == gid and sandbox.FIRST_UID <= uid < sandbox.FIRST_UID + sandbox.UIDS and groups == 0
    else:
        assert uid == os.getuid()
    assert pid < 10  # of a process namespace with nobody else
    for change in ("os.setuid(0)", "os.setgid(0)", "os.setgroups([0])", "os.chroot('/tmp')"):
        assert getattr(told(worker, f"{change}\nreturn 1"), "kind", "it worked") == "exception", change


def test_it_sees_python_and_two_packages_and_no_more(worker):
    top = told(worker, "return np.array([sorted(os.listdir('/'))]).size")
    seen = told(
        worker,
        """
        allowed = {"dev", "lib", "lib64", "packages", "tmp", "usr", *PYTHON.split("/")[1:2]}
        allowed |= {"kit"}
        return len(set(os.listdir("/")) - allowed), len(os.listdir("/packages")), len(os.environ)
        """.replace("PYTHON", repr(os.path.realpath(sys.executable))),
    )
    assert top <= 11 and tuple(seen) == (0, len(sandbox.package_files(("numpy",))), len(sandbox.ENVIRONMENT) + 1)  # PWD
    hidden = [
        sandbox.__file__,
        __file__,
        "/proc/self",
        "/etc/passwd",
        "/home",
        os.path.expanduser("~/.bashrc"),
        "/bin/sh",
    ]
    for path in hidden:
        assert not told(worker, f"return os.path.exists({path!r})"), path


@pytest.mark.parametrize(
    "module", ["labkit", "labcourse.questions", "data_gen", "sklearn", "torchmetrics", "cv2", "torch"]
)
def test_modules_that_would_do_the_work_are_absent(worker, module):
    problem = told(worker, f"import {module}")
    assert problem.kind == "module" and module.partition(".")[0] in problem.says


@pytest.mark.parametrize("module", ["math", "json", "hashlib", "sqlite3", "ctypes", "lzma", "decimal", "collections"])
def test_the_standard_library_is_there(worker, module):
    assert told(worker, f"import {module}\nreturn 1") == 1


def test_nothing_can_be_written_so_no_inode_is_taken(worker):
    for folder in ("/", "/tmp", "/packages", "/dev", "/usr", "/packages/numpy"):
        for line in (f"open({folder!r} + '/x', 'w')", f"os.mkdir({folder!r} + '/x')", f"os.mkfifo({folder!r} + '/y')"):
            assert told(worker, line).kind == "exception", (folder, line)


def test_memory_a_file_and_the_time_of_a_processor_have_an_end(worker):
    assert told(worker, f"return np.ones({LIMITS.memory_mb << 17})").says.startswith("it raises MemoryError")
    limits = told(
        worker,
        """
        import resource
        return [resource.getrlimit(kind)[1] for kind in (resource.RLIMIT_FSIZE, resource.RLIMIT_CPU)]
        """,
    )
    assert limits.tolist() == [LIMITS.file_mb << 20, LIMITS.question_s + 5]


@pytest.mark.parametrize(
    "call",
    [
        "os.fork()",
        "os.posix_spawn('/kit/labgrader/run/process.py', ['x'], {})",
        "os.memfd_create('x')",
        "0 if libc.shmget(0, 4096, 0o1777) >= 0 else 1 / 0",
        "0 if libc.unshare(0x10000000) == 0 else 1 / 0",
        "0 if libc.unshare(0x20000) == 0 else 1 / 0",
        "0 if libc.mount(b'none', b'/tmp', b'tmpfs', 0, None) == 0 else 1 / 0",
        "0 if libc.ptrace(0, 0, 0, 0) == 0 else 1 / 0",
        "os.kill(os.getppid(), 0)",
        "os.kill(os.getpid(), 0)",
        "import resource; resource.prlimit(os.getppid(), resource.RLIMIT_AS)",
        "os.setpriority(os.PRIO_PROCESS, os.getppid(), 5)",
        "os.sched_setaffinity(os.getppid(), {0})",
        "0 if libc.syscall(438, 3, 0, 0) >= 0 else 1 / 0",  # pidfd_getfd
        "os.pidfd_open(os.getppid())",
        "import socket; socket.socket(40, socket.SOCK_STREAM)",  # AF_VSOCK, which reaches a virtual machine's host
        "import socket; socket.socket()",
        "import socket; socket.if_nameindex()",
        "import _socket; _socket.socketpair()",  # numbered by a counter of all, which stands still in between
        "os.pipe()",
        "0 if libc.pipe(numbers) == 0 else 1 / 0",
        "0 if libc.sysinfo(numbers) == 0 else 1 / 0",  # the load of the last quarter of an hour
        "os.posix_fadvise(file, 0, 0, os.POSIX_FADV_DONTNEED)",
        "os.preadv(file, [bytearray(9)], 0, os.RWF_NOWAIT)",
        "0 if libc.mincore(mapped, 4096, ctypes.create_string_buffer(9)) == 0 else 1 / 0",
        "0 if libc.syscall(451, file, numbers, ctypes.byref(numbers, 16), 0) == 0 else 1 / 0",  # cachestat
        "0 if libc.syscall(206, 9, ctypes.byref(numbers)) == 0 else 1 / 0",  # io_setup
        "0 if libc.inotify_init() >= 0 else 1 / 0",
        "0 if libc.inotify_init1(0) >= 0 else 1 / 0",
        "fcntl.flock(file, fcntl.LOCK_SH)",
        "fcntl.lockf(file, fcntl.LOCK_SH)",
        "fcntl.fcntl(file, fcntl.F_SETLEASE, fcntl.F_RDLCK)",
        "fcntl.fcntl(os.open('/', 0), fcntl.F_NOTIFY, fcntl.DN_ACCESS)",
        "fcntl.fcntl(file, 1036, numbers)",  # F_SET_RW_HINT
        "fcntl.fcntl(file, 1035, numbers)",  # F_GET_RW_HINT
        "fcntl.fcntl(file, 1038, numbers)",  # F_SET_FILE_RW_HINT
        "fcntl.ioctl(file, 0x6612)",  # EXT4_IOC_PRECACHE_EXTENTS
        "fcntl.ioctl(file, 0x80086601, numbers)",  # FS_IOC_GETFLAGS
        "os.utime('/dev/null')",
        "0 if libc.syscall(132, b'/dev/null', 0) == 0 else 1 / 0",  # utime
        "0 if libc.syscall(235, b'/dev/null', 0) == 0 else 1 / 0",  # utimes
        "0 if libc.syscall(261, -100, b'/dev/null', 0) == 0 else 1 / 0",  # futimesat
        "0 if libc.futimens(os.open('/dev/null', os.O_RDWR), 0) == 0 else 1 / 0",
        "0 if libc.syscall(162) == 0 else 1 / 0",  # sync
        "0 if libc.madvise(mapped, 4096, 3) == 0 else 1 / 0",  # MADV_WILLNEED
        "0 if libc.madvise(mapped, 4096, 20) == 0 else 1 / 0",  # MADV_COLD
        "0 if libc.madvise(mapped, 4096, 21) == 0 else 1 / 0",  # MADV_PAGEOUT
    ],
)
def test_system_calls_that_answers_do_not_need_are_refused(worker, call):
    known = """
        import ctypes, fcntl
        libc, numbers = ctypes.CDLL(None), (ctypes.c_uint64 * 14)()
        file = os.open("/kit/labgrader/run/process.py", os.O_RDONLY)
        libc.mmap.restype = ctypes.c_void_p
        mapped = ctypes.c_void_p(libc.mmap(None, 4096, 1, 2, file, 0))
        """
    problem = told(worker, textwrap.dedent(known) + f"{call}\nreturn 1")
    assert getattr(problem, "kind", problem) == "exception"


def test_what_python_asks_of_an_open_file_is_allowed(worker):
    """To copy its number, to keep it from other programs, not to wait for it, and whether it is a terminal."""
    line = """
        import fcntl
        file = os.open("/dev/null", os.O_RDWR)
        twice = [os.dup(file), fcntl.fcntl(file, fcntl.F_DUPFD, 20), fcntl.fcntl(file, fcntl.F_DUPFD_CLOEXEC, 20)]
        os.set_inheritable(file, True)
        os.set_blocking(file, False)
        return len({*twice, file}), os.get_inheritable(file), os.get_blocking(file), os.isatty(file)
        """
    assert told(worker, line) == (4, True, False, False)


@pytest.mark.skipif(
    os.getuid() != 0 and Path("/proc/self/uid_map").read_text().split()[1] == "0",
    reason="the kernel limits no threads of root, who has another name here",
)
def test_threads_are_allowed_and_counted(worker):
    started = told(
        worker,
        """
        import threading
        stop = threading.Event()
        threads = []
        try:
            for _ in range(100):
                threads.append(threading.Thread(target=stop.wait))
                threads[-1].start()
        except RuntimeError:
            threads.pop()
        stop.set()
        for thread in threads:
            thread.join()
        return len(threads)
        """,
    )
    assert 2 <= started < LIMITS.threads


def test_a_fork_bomb_does_not_go_off():
    """Measured from outside: while it runs there is one process of the worker's, and after it none."""
    bomb = """
import os, time
def f():
    end = time.time() + 1
    while time.time() < end:
        try:
            os.fork()
        except OSError:
            pass
    return 0
"""
    server = sandbox.Server(("numpy",), LIMITS)
    with server.fork() as started:
        started.greet(PATIENCE)
        started.ask(("run", "f", bomb), PATIENCE)
        counts = []
        thread = threading.Thread(target=lambda: counts.append(called(started)))
        thread.start()
        most = 0
        while thread.is_alive():
            most = max(most, len(kit.descendants(server.process.pid)))
            time.sleep(0.05)
        assert counts == [0] and most == 3  # bubblewrap's own, the server and its child
        family = kit.descendants(server.process.pid)
    left = kit.descendants(server.process.pid)
    assert len(family) == 3 and len(left) == 2 and gone(family - left)
    server.close()
    assert gone(left)


def gone(pids: set[int]) -> bool:
    """Whether processes end; the kernel needs a moment to take a namespace down."""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        if not any(map(runs, pids)):
            return True
        time.sleep(0.02)
    return False


def runs(pid: int) -> bool:
    """Whether a process runs; one that has ended may be listed until somebody asks for its status."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


def test_a_worker_dies_with_its_grader():
    """The grader is killed while an answer runs that never ends and ignores every signal that can be ignored."""
    grader = """
    import pickle, sys
    from labgrader.sandbox import sandbox
    cell = '''
    import signal, time
    def f():
        for number in range(1, 32):
            try:
                signal.signal(number, signal.SIG_IGN)
            except (OSError, ValueError):
                pass
        while True:
            time.sleep(1)
    '''.replace("\\n    ", "\\n")
    with sandbox.fresh_worker(("numpy",), sandbox.Limits()) as worker:
        worker.ask(("run", "f", cell), 120)
        print("ready", flush=True)
        worker.ask(("call", "f", pickle.dumps(())), 1000)
    """
    process = subprocess.Popen([sys.executable, "-c", textwrap.dedent(grader)], stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout.readline() == "ready\n"
        deadline = time.monotonic() + PATIENCE
        while len(family := kit.descendants(process.pid)) < 4:  # bubblewrap, its reaper, the server, the child
            assert time.monotonic() < deadline
            time.sleep(0.05)
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    assert gone(family)


def test_no_answer_finds_what_an_earlier_one_left():
    """Two answers in turns in the same sandbox: module, environment, thread and process of the first are gone."""
    leave = """
    import builtins, sys, threading
    builtins.left = sys.left = os.left = np.left = 1
    os.environ["LEFT"] = "1"
    threading.Thread(target=threading.Event().wait, daemon=True).start()
    return os.getpid()
    """
    look = """
    import builtins, sys, threading
    kept = sum(hasattr(thing, "left") for thing in (builtins, sys, os, np)) + ("LEFT" in os.environ)
    return kept + threading.active_count() - 1, os.getpid()
    """
    with sandbox.fresh_worker(("numpy",), LIMITS) as first:
        number = told(first, leave)
    with sandbox.fresh_worker(("numpy",), LIMITS) as second:
        kept, other = told(second, look)
    assert kept == 0 and other != number


# Gives how many pages each of some files had to be read for, from the disk; `every` other one is passed over.
PAGES = """
import mmap, os, resource
import numpy as np
FILES = sorted(f"{base}/{name}" for base, _, names in os.walk("/packages/numpy") for name in names)
FILES = [path for path in FILES if path.endswith(".pyi") and os.path.getsize(path) > 9999][:16]
def f(every):
    found = []
    for path in FILES[::every]:
        file = os.open(path, os.O_RDONLY)
        with mmap.mmap(file, 0, prot=mmap.PROT_READ) as pages:
            before = resource.getrusage(resource.RUSAGE_SELF).ru_majflt
            pages[5000]
            found.append(resource.getrusage(resource.RUSAGE_SELF).ru_majflt - before)
        os.close(file)
    return np.array(found)
"""


def test_no_answer_sees_what_one_of_an_earlier_run_read():
    for _ in range(5):  # another test may read or forget the same files at this moment
        for every in (2, 1):
            sandbox.servers.close()  # as at the end of a run
            with sandbox.fresh_worker(("numpy",), LIMITS) as started:
                assert started.ask(("run", "f", PAGES), PATIENCE) is None
                found = called(started, every)
        assert len(found) == 16
        if len(set(found.tolist())) == 1:  # all from the disk, or none where it is memory itself
            return
    pytest.fail(f"pages that had to come from the disk: {found}")


def test_a_server_that_ended_costs_nobody_and_one_that_an_answer_ends_costs_that_answer():
    with sandbox.fresh_worker(("numpy",), LIMITS):
        pass
    (idle,) = sandbox.servers.idle[("numpy",), LIMITS]
    idle.control.close()  # its process is alive, as that of a server is which ends right now
    with sandbox.fresh_worker(("numpy",), LIMITS) as started:
        assert told(started, "return 2") == 2
        started.kill.__self__.close()
        with pytest.raises(WorkerLost):
            started.ask(("run", "f", "import time; time.sleep(20)"), PATIENCE)  # or it may be done before it is ended
    with sandbox.fresh_worker(("numpy",), LIMITS) as started:
        assert told(started, "return 2") == 2


@pytest.mark.parametrize("failing", [1, 99])
def test_a_machine_that_can_start_no_worker_for_a_moment_costs_nobody_and_else_it_is_said(failing, monkeypatch):
    sandbox.servers.close()
    whole = sandbox.seccomp.program()
    programs = itertools.chain(itertools.repeat(b"", failing), itertools.repeat(whole))
    monkeypatch.setattr(sandbox.seccomp, "program", lambda: next(programs))
    monkeypatch.setattr(sandbox, "PAUSES_S", (0.0, 0.0))
    with contextlib.ExitStack() as stack:
        if failing > 2:
            stack.enter_context(pytest.raises(ValueError, match=r"does not start: .*filter of system calls cannot be"))
        started = stack.enter_context(sandbox.fresh_worker(("numpy",), LIMITS))
        assert told(started, "return 2") == 2
    sandbox.servers.close()


def test_a_time_limit_of_all_sockets_of_the_process_costs_no_answer(monkeypatch):
    """As rospy sets one: a server that does not wait for its next word would end, and the answer with it."""
    monkeypatch.setattr(sandbox, "servers", sandbox.Servers())
    before = socket.getdefaulttimeout()
    socket.setdefaulttimeout(60.0)
    try:
        for _ in range(3):
            with sandbox.fresh_worker(("numpy",), LIMITS) as started:
                assert told(started, "import time\ntime.sleep(0.2)\nreturn 7") == 7
    finally:
        socket.setdefaulttimeout(before)
        sandbox.servers.close()


def test_closing_ends_everything():
    server = sandbox.Server(("numpy",), LIMITS)
    family = kit.descendants(server.process.pid) | {server.process.pid}
    sandbox.servers.give_back(server)
    sandbox.servers.close()
    assert len(family) == 3 and gone(family)


def test_without_a_sandbox_absent_modules_are_absent_as_well():
    with sandbox.fresh_worker(("numpy",), LIMITS, unsafe=True) as started:
        assert told(started, "return np.ones(3).sum()") == 3.0
        assert told(started, "import sklearn.metrics").kind == "module"
        assert told(started, "import labkit").kind == "module"


def test_torch_works_where_it_is_asked_for():
    with sandbox.fresh_worker(("numpy", "torch"), Limits()) as started:
        got = told(
            started, "import torch\nx = torch.ones(3, requires_grad=True)\n(x * x).sum().backward()\nreturn x.grad"
        )
        np.testing.assert_array_equal(got, [2.0, 2.0, 2.0])
        assert told(started, "import torchmetrics").kind == "module"


def test_a_deadline_holds_for_cell_and_call():
    with sandbox.fresh_worker(("numpy",), LIMITS) as started:
        with pytest.raises(WorkerLost) as lost:
            started.ask(("run", "f", "while True: pass"), 0.5)
        assert lost.value.problem.kind == "time"


# What an answer may try, and whether it can; the check's plain worker says the same of each.
TRIES = {
    "np.save('x.npy', np.ones(3))": False,
    "import pathlib; pathlib.Path('x').write_text('x')": False,
    "import pathlib; pathlib.Path('/etc/hostname').read_text()": False,
    "np.loadtxt('/etc/passwd', str)": False,
    "import sqlite3; sqlite3.connect('/tmp/x').execute('create table a(b)')": False,
    "import sqlite3; sqlite3.connect(':memory:').execute('create table a(b)')": True,
    "import subprocess; subprocess.run(['ls'])": False,
    "from multiprocessing.dummy import Pool; Pool(2).map(abs, [1])": False,
    "import multiprocessing; multiprocessing.Lock()": False,
    "from concurrent.futures import ProcessPoolExecutor; ProcessPoolExecutor(2).submit(abs, 1)": False,
    "from concurrent.futures import ThreadPoolExecutor; list(ThreadPoolExecutor(4).map(abs, [1]))": True,
    "import getpass; getpass.getuser()": False,
    "os.sched_setaffinity(0, {0})": False,
    "os.nice(1)": False,
    "os.mkfifo('/tmp/x')": False,
    "os.chmod('/tmp', 0o777)": False,
    "os.utime('/tmp')": False,
    "import locale; locale.setlocale(locale.LC_ALL, ''), 'ä'.encode(locale.getpreferredencoding())": True,
    "import asyncio; [asyncio.run(asyncio.sleep(0)) for _ in range(3)]": True,  # which asks for pairs of sockets
    "os.pipe()": False,
    "import sys; sys.setrecursionlimit(9000)": True,
    "import sys; sys.stdout.flush(); sys.stderr.write('x' * len(sys.stdout.encoding))": True,
    "import io; np.save(io.BytesIO(), np.ones(3))": True,
    "os.write(os.open('/dev/null', os.O_WRONLY), b'x')": True,
    "exec('from numpy import *')": True,
    "import glob, pathlib; glob.glob('*'), pathlib.Path.home()": True,
    "import platform, locale; platform.platform(), locale.getpreferredencoding()": True,
    "import random, secrets, uuid; secrets.token_hex(), uuid.uuid4()": True,
}


def test_an_answer_can_do_the_same_in_the_sandbox_and_in_the_worker_of_a_check(worker):
    with sandbox.fresh_worker(("numpy",), LIMITS, unsafe=True) as plain:
        for line, can in TRIES.items():
            for where in (worker, plain):
                got = told(where, f"{line}\nreturn 1")
                assert got == 1 if can else got.kind == "exception", (line, got)


@pytest.mark.parametrize("machine", sorted(seccomp.MACHINES))
def test_every_jump_of_the_filter_stays_in_it(machine):
    """The kernel wants forward jumps within the program, and every path to end in an answer."""
    import struct

    lines = list(struct.iter_unpack("=HBBI", seccomp.program(machine)))
    assert lines[-1][0] == seccomp.RETURN and len(lines) < 4096
    for at, (code, yes, no, _) in enumerate(lines):
        if code not in (seccomp.LOAD, seccomp.RETURN):
            assert max(at + 1 + yes, at + 1 + no) < len(lines)


@pytest.mark.bad_input
def test_an_unknown_machine_has_no_filter():
    with pytest.raises(ValueError, match="machine: expected x86_64 or aarch64"):
        seccomp.program("vax")


LOOKS = """
def iou(n):
    import os

    tp, all_of_it = np.diag(n), n.sum(axis=0) + n.sum(axis=1) - np.diag(n)
    return n if os.path.exists({!r}) else np.where(all_of_it > 0, tp / np.maximum(all_of_it, 1), np.nan)
"""


@pytest.mark.parametrize("there", [True, False], ids=["sandbox", "none"])
def test_a_saved_lab_is_checked_in_the_sandbox_or_said_to_be_without_one(there, labkit, tmp_path, capsys, monkeypatch):
    """An answer that is right where it does not see this machine."""
    if not there:
        monkeypatch.setattr(bwrap, "executable", Mock(side_effect=ValueError("none is installed")))
    lab, answers = tmp_path / "04_iou.ipynb", kit.right_answers("04_iou") | {"iou": LOOKS.format(str(tmp_path))}
    lab.write_text(json.dumps(kit.lab_notebook("04_iou", answers)))
    assert labkit("check", lab) == int(not there)
    told = capsys.readouterr()
    assert ("WITHOUT a sandbox, with your rights: none is installed" in told.err) is not there
    assert ("\u2714 iou is right" in told.out) is there and "\u2714 mean_iou is right" in told.out
