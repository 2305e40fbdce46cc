"""What a worker sees and may use, measured from inside; that it dies with the grader; that there is no way round it."""

import os
import signal
import subprocess
import sys
import textwrap
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from labkit.course.grading import sandbox, seccomp
from labkit.course.grading.channel import Worker, WorkerLost
from labkit.course.grading.sandbox import Limits

LIMITS = Limits(memory_mb=512, tmp_mb=4, file_mb=2, threads=8)


@pytest.fixture(scope="module")
def worker():
    with sandbox.start(("numpy",), LIMITS) as started:
        yield started


def told(worker: Worker, body: str):
    """Run lines inside a function `f` in the sandbox and give what it returns."""
    source = "import os\nimport numpy as np\ndef f():\n" + textwrap.indent(textwrap.dedent(body), "    ")
    assert worker.ask(("cell", "f", source), 20.0) is None
    return worker.ask(("call", "f", ()), 20.0)


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
        allowed = {"dev", "lib", "lib64", "packages", "tmp", "usr", "worker.py", *PYTHON.split("/")[1:2]}
        return len(set(os.listdir("/")) - allowed), len(os.listdir("/packages")), len(os.environ)
        """.replace("PYTHON", repr(os.path.realpath(sys.executable))),
    )
    assert top <= 8 and tuple(seen) == (0, len(sandbox.package_files(("numpy",))), len(sandbox.ENVIRONMENT) + 1)  # PWD
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
    "module", ["labkit", "labkit.course.questions", "data_gen", "sklearn", "torchmetrics", "cv2", "torch"]
)
def test_modules_that_would_do_the_work_are_absent(worker, module):
    problem = told(worker, f"import {module}")
    assert problem.kind == "module" and module.partition(".")[0] in problem.says


@pytest.mark.parametrize("module", ["math", "json", "hashlib", "sqlite3", "ctypes", "lzma", "decimal", "collections"])
def test_the_standard_library_is_there(worker, module):
    assert told(worker, f"import {module}\nreturn 1") == 1


def test_only_tmp_can_be_written_and_it_is_small(worker):
    for folder in ("/", "/packages", "/dev", "/usr", "/packages/numpy"):
        problem = told(worker, f"open({folder!r} + '/x', 'w')")
        assert problem.kind == "exception", folder
    written = told(
        worker,
        """
        total = 0
        try:
            for i in range(64):
                with open(f"/tmp/{i}", "wb", buffering=0) as file:
                    total += file.write(bytes(1 << 20))
        except OSError:
            pass
        for name in os.listdir("/tmp"):
            os.unlink(f"/tmp/{name}")
        return total
        """,
    )
    assert (LIMITS.tmp_mb - 1) << 20 <= written <= LIMITS.tmp_mb << 20


def test_a_file_has_a_largest_size(worker):
    says = told(worker, "open('/tmp/x', 'wb', buffering=0).write(bytes(1 << 20)); os.unlink('/tmp/x'); return 1")
    assert says == 1
    grown = told(
        worker,
        """
        import signal
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        fd = os.open("/tmp/x", os.O_CREAT | os.O_WRONLY)
        try:
            os.ftruncate(fd, 3 << 20)
            return 1
        except OSError:
            return 0
        """,
    )
    assert grown == 0


def test_memory_has_an_end(worker):
    assert told(worker, f"return np.ones({LIMITS.memory_mb << 17})").says == "it raises MemoryError"


def test_there_is_no_network(worker):
    reached = told(
        worker,
        """
        import socket
        names = [name for _, name in socket.if_nameindex()]
        try:
            socket.create_connection(("127.0.0.1", 22), timeout=0.2)
        except OSError:
            return len(set(names) - {"lo"})
        return 99
        """,
    )
    assert reached == 0


@pytest.mark.parametrize(
    "call",
    [
        "os.fork()",
        "os.posix_spawn('/worker.py', ['x'], {})",
        "os.memfd_create('x')",
        "0 if libc.shmget(0, 4096, 0o1777) >= 0 else 1 / 0",
        "0 if libc.unshare(0x10000000) == 0 else 1 / 0",
        "0 if libc.unshare(0x20000) == 0 else 1 / 0",
        "0 if libc.mount(b'none', b'/tmp', b'tmpfs', 0, None) == 0 else 1 / 0",
        "0 if libc.ptrace(0, 0, 0, 0) == 0 else 1 / 0",
    ],
)
def test_system_calls_that_answers_do_not_need_are_refused(worker, call):
    problem = told(worker, f"import ctypes\nlibc = ctypes.CDLL(None)\n{call}\nreturn 1")
    assert getattr(problem, "kind", problem) == "exception"


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
    with sandbox.start(("numpy",), LIMITS) as started:
        started.ask(("cell", "f", bomb), 20.0)
        counts = []
        thread = threading.Thread(target=lambda: counts.append(started.ask(("call", "f", ()), 20.0)))
        thread.start()
        most = 0
        while thread.is_alive():
            most = max(most, len(descendants(started.process.pid)))
            time.sleep(0.05)
        assert counts == [0] and most == 2  # bubblewrap's own and the worker
        family = descendants(started.process.pid)
    assert gone(family)


def descendants(pid: int) -> set[int]:
    """Processes below one, by the kernel's lists of children."""
    found, waiting = set(), [pid]
    while waiting:
        try:
            tasks = list(Path(f"/proc/{waiting.pop()}/task").iterdir())
            children = [int(child) for task in tasks for child in (task / "children").read_text().split()]
        except OSError:
            continue
        found |= set(children)
        waiting += children
    return found


def gone(pids: set[int], seconds: float = 20.0) -> bool:
    """Whether processes end within some seconds; the kernel needs a moment to take a namespace down."""
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        if not any(Path(f"/proc/{pid}").exists() for pid in pids):
            return True
        time.sleep(0.02)
    return False


def test_a_worker_dies_with_its_grader():
    """The grader is killed while an answer runs that never ends and ignores every signal that can be ignored."""
    grader = """
    import sys
    from labkit.course.grading import sandbox
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
    worker = sandbox.start(("numpy",), sandbox.Limits())
    worker.ask(("cell", "f", cell), 20)
    print("ready", flush=True)
    worker.ask(("call", "f", ()), 1000)
    """
    process = subprocess.Popen([sys.executable, "-c", textwrap.dedent(grader)], stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout.readline() == "ready\n"
        family = descendants(process.pid)
        assert len(family) >= 3  # bubblewrap, its reaper, the worker
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    assert gone(family)


def test_closing_ends_everything():
    started = sandbox.start(("numpy",), LIMITS)
    family = descendants(started.process.pid) | {started.process.pid}
    started.close()
    assert gone(family)


def test_without_a_sandbox_absent_modules_are_absent_as_well():
    with sandbox.start(("numpy",), LIMITS, unsafe=True) as started:
        assert told(started, "return np.ones(3).sum()") == 3.0
        assert told(started, "import sklearn.metrics").kind == "module"
        assert told(started, "import labkit").kind == "module"


def test_torch_works_where_it_is_asked_for():
    with sandbox.start(("numpy", "torch"), Limits()) as started:
        got = told(
            started, "import torch\nx = torch.ones(3, requires_grad=True)\n(x * x).sum().backward()\nreturn x.grad"
        )
        np.testing.assert_array_equal(got, [2.0, 2.0, 2.0])
        assert told(started, "import torchmetrics").kind == "module"


def test_a_deadline_holds_for_cell_and_call():
    with sandbox.start(("numpy",), LIMITS) as started:
        begin = time.monotonic()
        with pytest.raises(WorkerLost) as lost:
            started.ask(("cell", "f", "while True: pass"), 0.5)
        assert lost.value.problem.kind == "time" and time.monotonic() - begin < 20.0


@pytest.mark.parametrize("machine", sorted(seccomp.ARCHITECTURES))
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
