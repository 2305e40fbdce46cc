"""What an answer sees and may use: bubblewrap around it, limits inside, and nothing but Python and a few packages.

In the sandbox there are the interpreter, the standard library, the packages that answers may use and the worker's own
files, all of it read-only: no course, no home, no /proc, no network, and no other process that it could reach. A
server in it loads the packages once; each answer runs in a child of its own (`fork_server`). Where the caller is
root, the child becomes another user; elsewhere the sandbox has a user namespace of its own.
"""

import base64
import collections
import functools
import itertools
import json
import os
import shutil
import socket
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from labgrader.run import subprocess_worker
from labgrader.run.channel import Worker, WorkerLost
from labgrader.run.limits import Limits
from labgrader.run.subprocess_worker import ROOT, START, limits_of, package_files, site_folders
from labgrader.sandbox import bwrap, seccomp

START_SERVER = START + "from labgrader.sandbox.fork_server import main; main(options)"
SITE, KIT = "/packages", "/kit"  # where a worker finds packages, and its own files
ENVIRONMENT = subprocess_worker.ENVIRONMENT | {"HOME": "/tmp", "TMPDIR": "/tmp"}
LOADERS = ("/lib64/ld-linux-x86-64.so.2", "/lib/ld-linux-aarch64.so.1")
PAUSES_S = (0.2, 1.0, 5.0)  # before a worker that did not start is started again
FIRST_UID, UIDS, UIDS_OF_ONE = 61184, 4000, 50  # of systemd's range for short-lived users: never a person's
NO_SANDBOX = "graded WITHOUT a sandbox: a submission could read and change anything here, grades and this file included"
CREDENTIALS = struct.Struct("3i")  # of a process: its number, user and group
FAREWELL_S = 10.0  # for the server to kill a child
# The worker's own files, from the folder of this package on.
MODULES = ["labgrader/__init__.py", "labgrader/question.py", "labgrader/comparison.py"]
for room, names in {
    "program": "cell effects fingerprint live slice",
    "reply": "alarm finding idle listed mutation recipes repair repair_job syntax watches",
    "run": "process",
    "sandbox": "fork_server",
}.items():
    MODULES += [f"labgrader/{room}/{name}.py" for name in ("__init__", *names.split())]
counter = itertools.count(os.getpid())


def options_for(packages: Sequence[str], limits: Limits, shown: str = "") -> str:
    """What a server is told, as its argument. shown: the folder where a container shows what is needed."""
    own = {
        "first_uid": None if os.getuid() else FIRST_UID + next(counter) * UIDS_OF_ONE % UIDS,
        "uids": UIDS_OF_ONE,
        "path": [shown + KIT, shown + SITE],
        "threads": limits.threads,
        "filter": base64.b64encode(seccomp.program()).decode(),
    }
    return json.dumps(limits_of(packages, limits) | own)


class Server:
    """A sandbox with some packages loaded, in which `fork` starts a fresh child for each answer, one at a time."""

    def __init__(self, packages: Sequence[str], limits: Limits):
        self.packages, self.limits, self.forked = tuple(packages), limits, False
        self.shown = show_in_container(self.packages) if limits.container else None
        ours, theirs = socket.socketpair()
        theirs.setblocking(True)  # also where some library gave all sockets a time limit: the server would not wait
        with theirs:
            quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
            if self.shown is None:
                command = bubblewrap(self.packages)
            else:
                command = [sys.executable, "-P", "-s", "-S", "-B", "-c", START_SERVER]
                quiet |= {"cwd": "/tmp", "env": ENVIRONMENT}
            command.append(options_for(packages, limits, self.shown.name if self.shown else ""))
            self.process = subprocess.Popen(command, stdin=theirs, **quiet)
        self.control = ours
        ours.setsockopt(socket.SOL_SOCKET, socket.SO_PASSCRED, 1)
        if not self.hears(b"r", limits.start_s):
            self.close()
            raise ValueError(f"sandbox: a worker with {', '.join(packages)} does not start")

    def hears(self, word: bytes, seconds: float) -> bool:
        """Whether the server says a word in time."""
        with suppress(OSError):  # of a server that has ended, too
            self.control.settimeout(seconds)
            return self.control.recv(1) == word
        return False

    def fork(self) -> Worker:
        """Start a child that has the packages and the limits, and has run nothing yet."""
        self.forked = True
        requests, to_child = os.pipe()
        from_child, replies = os.pipe()
        pid = None
        try:
            socket.send_fds(self.control, [b"f"], [requests, replies])
            pid = self.number_of_child()
        except OSError:
            self.close()
        finally:
            os.close(requests)
            os.close(replies)
        return Worker(os.fdopen(to_child, "wb"), os.fdopen(from_child, "rb"), self.kill, pid=pid)

    def number_of_child(self) -> int | None:
        """The number of the process that says that it is the new child, as the kernel tells it; None if it does not."""
        self.control.settimeout(self.limits.start_s)
        word, told, _, _ = self.control.recvmsg(1, socket.CMSG_SPACE(CREDENTIALS.size))
        found = [data for level, kind, data in told if (level, kind) == (socket.SOL_SOCKET, socket.SCM_CREDENTIALS)]
        if word != b"c":
            raise OSError("the sandbox's server says nothing of a child")
        return CREDENTIALS.unpack(found[0])[0] or None if found else None

    def kill(self) -> None:
        """Kill the child; kill the whole sandbox if the server does not say in time that the child is dead."""
        with suppress(OSError):
            self.control.send(b"k")
        if not self.hears(b"d", FAREWELL_S):
            self.close()

    @property
    def alive(self) -> bool:
        """Whether it can still fork."""
        return self.process.poll() is None

    def close(self) -> None:
        """End the sandbox and everything in it."""
        self.process.kill()
        self.control.close()
        self.process.wait()
        if self.shown is not None:
            self.shown.cleanup()


class Servers:
    """Servers that wait for the next answer, by packages and limits; threads take them and give them back.

    Before the first one with some packages, since they were all closed, what earlier answers read is forgotten.
    """

    def __init__(self):
        self.idle: dict[tuple, collections.deque[Server]] = collections.defaultdict(collections.deque)
        self.forgotten: set[tuple[str, ...]] = set()

    def take(self, packages: Sequence[str], limits: Limits) -> Server:
        """Give a server that is idle, or start one."""
        idle = self.idle[tuple(packages), limits]
        while True:
            try:
                server = idle.pop()
            except IndexError:
                if not limits.container and tuple(packages) not in self.forgotten:
                    self.forgotten.add(tuple(packages))
                    forget_pages(tuple(packages))
                return Server(packages, limits)
            if server.alive:
                return server
            server.close()

    def give_back(self, server: Server) -> None:
        """Keep a server for the next answer, unless it has ended."""
        if server.alive:
            self.idle[server.packages, server.limits].append(server)
        else:
            server.close()

    def close(self) -> None:
        """End all servers that are idle."""
        self.forgotten.clear()
        for idle in self.idle.values():
            while idle:
                idle.pop().close()


servers = Servers()


@contextmanager
def fresh_worker(packages: Sequence[str], limits: Limits, unsafe: bool = False) -> Iterator[Worker]:
    """A worker in which no answer has run yet; it is killed at the end. unsafe: as a plain process.

    Raises ValueError if no sandbox can be made here, or if the packages do not load in it.
    """
    if unsafe:
        with subprocess_worker.fresh_worker(packages, limits) as started:
            yield started
        return
    server, started = greeted(packages, limits)
    try:
        with started:
            yield started
    finally:
        servers.give_back(server)


def greeted(packages: Sequence[str], limits: Limits) -> tuple[Server, Worker]:
    """A server with a child that is ready. A server that ended while it was idle is replaced, which costs nobody.

    Nor does it cost an answer, of which nothing has run, that the machine can start no child for a moment: it is tried
    again. Raises ValueError if none starts then.
    """
    pauses = iter(PAUSES_S)
    while True:
        server = servers.take(packages, limits)
        is_new, started = not server.forked, server.fork()
        try:
            started.greet(limits.start_s)
            return server, started
        except WorkerLost as lost:
            server.close()
            if not is_new:
                continue
            if (pause := next(pauses, None)) is None:
                raise ValueError(f"sandbox: a worker with {', '.join(packages)} does not start: {lost}") from None
            time.sleep(pause)


def probe(packages: Sequence[str], limits: Limits) -> None:
    """Start a server to see whether the sandbox works here; raises bwrap.NoSandbox, a ValueError with a remedy."""
    if not limits.container:
        bwrap.executable()
    elif os.getuid():
        raise ValueError("container: expected to be root, who can let answers become another user")
    servers.give_back(servers.take(packages, limits))


def show_in_container(packages: tuple[str, ...]) -> tempfile.TemporaryDirectory:
    """A folder that other users can read, with the packages and the worker's own files."""
    folder = tempfile.TemporaryDirectory()
    for path in (Path(folder.name), Path(folder.name + SITE)):
        path.mkdir(exist_ok=True)
        path.chmod(0o755)
    for name, path in package_files(packages).items():
        os.symlink(path, f"{folder.name}{SITE}/{name}")
    for module in MODULES:
        copy = Path(f"{folder.name}{KIT}/{module}")
        copy.parent.mkdir(parents=True, exist_ok=True)
        Path(shutil.copyfile(ROOT / module, copy)).chmod(0o644)
    for path in (Path(folder.name + KIT), *Path(folder.name + KIT).rglob("*/")):
        path.chmod(0o755 if path.is_dir() else 0o644)
    return folder


def bubblewrap(packages: tuple[str, ...]) -> list[str]:
    """The command line of a server; its options follow."""
    python, shown = shown_files(packages)
    command = [bwrap.executable(), *bwrap.namespaces(), "--clearenv", "--hostname", "sandbox"]
    for name, value in ENVIRONMENT.items():
        command += ["--setenv", name, value]
    made = set()
    for place, source in shown:
        for folder in reversed(Path(place).parents[:-1]):
            if folder not in made:
                command += ["--perms", "0755", "--dir", str(folder)]
                made.add(folder)
        if source is None:
            command += ["--size", "4096", "--tmpfs", place, "--remount-ro", place]
        else:
            command += ["--dev-bind" if place.startswith("/dev/") else "--ro-bind", source, place]
    command += ["--perms", "0755", "--dir", "/tmp", "--chdir", "/tmp", "--remount-ro", "/"]
    return [*command, python, "-P", "-s", "-S", "-B", "-c", START_SERVER]  # not -I, which would ignore PYTHONHASHSEED


# ------------------------------------------------------------------------------------ what there is to be seen

# Run by the interpreter that the sandbox will have: where it is, and the shared libraries that it and packages load.
LOOK = """
import importlib, json, os, sys
sys.path += json.loads(sys.argv[1])
libraries = os.path.join(os.path.dirname(os.__file__), "lib-dynload")
for name in [*sorted(n.partition(".")[0] for n in os.listdir(libraries) if "tkinter" not in n), *sys.argv[2:]]:
    try:
        importlib.import_module(name)
    except ImportError:
        pass
mapped = {line.split(maxsplit=5)[5].strip() for line in open("/proc/self/maps") if ".so" in line}
print(json.dumps([os.path.realpath(sys.executable), os.path.dirname(os.__file__), sorted(mapped)]))
"""


@functools.lru_cache
def shown_files(packages: tuple[str, ...]) -> tuple[str, list[tuple[str, str | None]]]:
    """The interpreter, and what the sandbox shows: (place, source on this machine); None as source is an empty folder.

    Shared libraries are shown one by one, not their folders, in which a system keeps Python packages as well.
    """
    run = [os.path.realpath(sys.executable), "-I", "-S", "-B", "-c", LOOK, json.dumps(list(site_folders())), *packages]
    done = subprocess.run(run, capture_output=True, text=True, check=True, env=dict(ENVIRONMENT))
    python, library, mapped = json.loads(done.stdout)
    tops = package_files(packages)
    real = [os.path.realpath(path) for path in tops.values()]  # as the kernel names what is mapped
    covered = (os.path.realpath(library) + os.sep, *(path + os.sep for path in real), *real)
    shown = [(python, python), (library, library)]
    shown += [(f"{library}/site-packages", None)] if os.path.isdir(f"{library}/site-packages") else []
    for path in mapped:
        if os.path.isfile(path) and not path.startswith(covered) and path != python:
            shown += [(name, path) for name in names_of(path)]
    shown += [(loader, os.path.realpath(loader)) for loader in LOADERS if os.path.exists(loader)]
    shown += [(f"{SITE}/{name}", str(path)) for name, path in sorted(tops.items())]
    shown += [(f"/dev/{name}", f"/dev/{name}") for name in ("null", "urandom", "zero")]
    shown += [(f"{KIT}/{module}", str(ROOT / module)) for module in MODULES]
    return python, [*dict.fromkeys(shown)]


def forget_pages(packages: tuple[str, ...]) -> None:
    """Take the files that the sandbox shows out of memory, but for what other processes have mapped.

    Which pages are there tells an answer which ones one of an earlier run has read, on secret arguments perhaps.
    """
    for place, source in shown_files(packages)[1]:
        if source is None or place.startswith("/dev/"):
            continue
        found = [source] if os.path.isfile(source) else []
        for folder, folders, names in os.walk(source):
            folders[:] = [name for name in folders if name != "site-packages"]  # the standard library's is not shown
            found += [f"{folder}/{name}" for name in names]
        for path in found:
            with suppress(OSError):
                file = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
                try:
                    os.posix_fadvise(file, 0, 0, os.POSIX_FADV_DONTNEED)
                finally:
                    os.close(file)


def names_of(library: str) -> list[str]:
    """A file and the links beside it that lead to it, by which it is looked for: libz.so.1 -> libz.so.1.2.13."""
    folder = os.path.dirname(library)
    stem = os.path.basename(library).partition(".so")[0]
    beside = [entry.path for entry in os.scandir(folder) if entry.name.startswith(stem) and entry.is_symlink()]
    return [library, *sorted(path for path in beside if os.path.realpath(path) == os.path.realpath(library))]
