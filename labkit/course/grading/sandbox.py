"""What an answer sees and may use: bubblewrap around it, limits inside, and nothing but Python and a few packages.

In the sandbox there are the interpreter, the standard library, the packages that answers may use and the worker's own
file, all of it read-only: no course, no labkit, no home, no /proc, no network, and no other process that it could
reach. A server in it loads the packages once; each answer runs in a child of its own (`worker`). Where the caller is
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
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

from labkit.course.checker import look, program
from labkit.course.grading import bwrap, seccomp, shapes, worker
from labkit.course.grading.channel import Worker, WorkerLost
from labkit.support.packages import requirements

SITE = "/packages"  # where a worker finds them
LOADERS = ("/lib64/ld-linux-x86-64.so.2", "/lib/ld-linux-aarch64.so.1")
FIRST_UID, UIDS, UIDS_OF_ONE = 61184, 4000, 50  # of systemd's range for short-lived users: never a person's
ENVIRONMENT = {
    "HOME": "/tmp",
    "LANG": "C.UTF-8",
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "PYTHONHASHSEED": "0",
    "TMPDIR": "/tmp",
}
NO_SANDBOX = "graded WITHOUT a sandbox: a submission could read and change anything here, grades and this file included"
FAREWELL_S = 10.0  # for the server to kill a child
# What cuts programs out of notebooks: a stranger's text is parsed in the sandbox, too.
TOOLS = {"program": os.path.abspath(program.__file__), "shapes": os.path.abspath(shapes.__file__)}
# What looks for a mistake in a program, loaded where it is asked for: file names by their modules.
LOOK_FOR_MISTAKES = {f"labkit.course.checker.{name}": f"{name}.py" for name in look.MODULES}
CHECKER = Path(look.__file__).resolve().parent
counter = itertools.count(os.getpid())


@dataclass(frozen=True)
class Limits:
    """What one answer may use. Seconds are of the clock; MB of memory are address space, with torch or without it.

    case_s: for one call; question_s: for all cases of a question. container: whether this machine is a container that
    is made for one submission; then there is no bubblewrap, and answers only become another user.
    """

    start_s: float = 120.0
    case_s: float = 10.0
    question_s: float = 20.0
    memory_mb: int = 1024
    torch_memory_mb: int = 3072
    file_mb: int = 16
    threads: int = 32
    container: bool = False


def options_for(packages: Sequence[str], limits: Limits, unsafe: bool, shown: str = "") -> str:
    """What the worker's program is told, as its argument. shown: the folder where a container shows what is needed."""
    is_open = unsafe or limits.container
    return json.dumps(
        {
            "first_uid": None if os.getuid() else FIRST_UID + next(counter) * UIDS_OF_ONE % UIDS,
            "uids": UIDS_OF_ONE,
            "path": site_folders() if unsafe else [shown + SITE],
            "load": list(packages),
            "only": [name.partition(".")[0] for name in package_files(tuple(packages))] if unsafe else None,
            "memory": (limits.torch_memory_mb if "torch" in packages else limits.memory_mb) << 20,
            "file_size": limits.file_mb << 20,
            "threads": None if unsafe else limits.threads,
            "cpu_s": int(limits.question_s) + 5,
            "tools": TOOLS if is_open else {name: f"/{name}.py" for name in TOOLS},
            "look": {
                name: str(CHECKER / file) if unsafe else f"{shown}/look/{file}"
                for name, file in LOOK_FOR_MISTAKES.items()
            },
            "filter": "" if unsafe else base64.b64encode(seccomp.program()).decode(),
        }
    )


class Server:
    """A sandbox with some packages loaded, in which `fork` starts a fresh child for each answer, one at a time."""

    def __init__(self, packages: Sequence[str], limits: Limits):
        self.packages, self.limits, self.forked = tuple(packages), limits, False
        self.shown = show_in_container(self.packages) if limits.container else None
        ours, theirs = socket.socketpair()
        with theirs:
            quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
            if self.shown is None:
                command = bubblewrap(self.packages)
            else:
                command = [sys.executable, "-P", "-s", "-S", "-B", worker.__file__]
                quiet |= {"cwd": "/tmp", "env": ENVIRONMENT}
            command.append(options_for(packages, limits, False, self.shown.name if self.shown else ""))
            self.process = subprocess.Popen(command, stdin=theirs, **quiet)
        self.control = ours
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
        try:
            socket.send_fds(self.control, [b"f"], [requests, replies])
        except OSError:
            self.close()
        finally:
            os.close(requests)
            os.close(replies)
        return Worker(os.fdopen(to_child, "wb"), os.fdopen(from_child, "rb"), self.kill)

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
        with plain_worker(packages, limits) as started:
            yield started
        return
    server, started = greeted(packages, limits)
    try:
        with started:
            yield started
    finally:
        servers.give_back(server)


def greeted(packages: Sequence[str], limits: Limits) -> tuple[Server, Worker]:
    """A server with a child that is ready; a server that ended while it was idle is replaced, which costs nobody."""
    while True:
        server = servers.take(packages, limits)
        is_new, started = not server.forked, server.fork()
        try:
            started.greet(limits.start_s)
            return server, started
        except WorkerLost:
            server.close()
            if is_new:
                raise


def plain_worker(packages: Sequence[str], limits: Limits) -> Worker:
    """Start a worker without any sandbox, a process of its own."""
    process = subprocess.Popen(
        [sys.executable, "-P", "-s", "-B", worker.__file__, options_for(packages, limits, unsafe=True)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        cwd=tempfile.gettempdir(),
        env=dict(ENVIRONMENT),
    )

    def kill() -> None:
        process.kill()
        process.wait()

    started = Worker(process.stdin, process.stdout, kill)
    try:
        started.greet(limits.start_s)
    except WorkerLost:
        raise ValueError(f"a worker with {', '.join(packages)} does not start") from None
    return started


def probe(packages: Sequence[str], limits: Limits) -> None:
    """Start a server to see whether the sandbox works here; raises bwrap.NoSandbox, a ValueError with a remedy."""
    if not limits.container:
        bwrap.executable()
    elif os.getuid():
        raise ValueError("container: expected to be root, who can let answers become another user")
    servers.give_back(servers.take(packages, limits))


def show_in_container(packages: tuple[str, ...]) -> tempfile.TemporaryDirectory:
    """A folder that other users can read, with the packages and what looks for mistakes."""
    folder = tempfile.TemporaryDirectory()
    for path in (Path(folder.name), Path(folder.name + SITE), Path(folder.name, "look")):
        path.mkdir(exist_ok=True)
        path.chmod(0o755)
    for name, path in package_files(packages).items():
        os.symlink(path, f"{folder.name}{SITE}/{name}")
    for file in LOOK_FOR_MISTAKES.values():
        Path(shutil.copyfile(CHECKER / file, f"{folder.name}/look/{file}")).chmod(0o644)
    return folder


def bubblewrap(packages: tuple[str, ...]) -> list[str]:
    """The command line up to the worker's file; its options follow."""
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
    return [*command, python, "-P", "-s", "-S", "-B", "/worker.py"]  # not -I, which would ignore PYTHONHASHSEED


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
    run = [os.path.realpath(sys.executable), "-I", "-S", "-B", "-c", LOOK, json.dumps(site_folders()), *packages]
    done = subprocess.run(run, capture_output=True, text=True, check=True, env=dict(ENVIRONMENT))
    python, library, mapped = json.loads(done.stdout)
    tops = package_files(packages)
    covered = (library + os.sep, *(f"{path}{os.sep}" for path in tops.values()), *map(str, tops.values()))
    shown = [(python, python), (library, library)]
    shown += [(f"{library}/site-packages", None)] if os.path.isdir(f"{library}/site-packages") else []
    for path in mapped:
        if os.path.isfile(path) and not path.startswith(covered) and path != python:
            shown += [(name, path) for name in names_of(path)]
    shown += [(loader, os.path.realpath(loader)) for loader in LOADERS if os.path.exists(loader)]
    shown += [(f"{SITE}/{name}", str(path)) for name, path in sorted(tops.items())]
    shown += [(f"/dev/{name}", f"/dev/{name}") for name in ("null", "urandom", "zero")]
    programs = TOOLS | {"worker": os.path.abspath(worker.__file__)}
    shown += [(f"/look/{file}", str(CHECKER / file)) for file in LOOK_FOR_MISTAKES.values()]
    return python, [*dict.fromkeys(shown), *((f"/{name}.py", path) for name, path in programs.items())]


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


def site_folders() -> list[str]:
    """Where this interpreter keeps installed packages."""
    found = [packages[0] for name in ("numpy", "torch") if (packages := list(metadata.distributions(name=name)))]
    return list(dict.fromkeys(str(Path(str(package.locate_file("")))) for package in found))


@functools.lru_cache
def package_files(packages: tuple[str, ...]) -> dict[str, Path]:
    """Files and folders of packages, named by what is imported, and of everything that they require."""
    distributions = metadata.packages_distributions()
    found = {}
    for package in packages:
        if package not in distributions:
            raise ValueError(f"packages: expected an installed package, got {package}")
        for name in distributions[package]:
            for required in (name, *requirements(name)):
                found |= top_levels(required)
    return found


def top_levels(distribution: str) -> dict[str, Path]:
    """What a distribution puts into the folder of packages, without its metadata and what lies outside."""
    files = metadata.distribution(distribution).files or []
    tops = {file.parts[0] for file in files} - {"..", "__pycache__"}
    locate = metadata.distribution(distribution).locate_file
    return {top: Path(str(locate(top))) for top in tops if not top.endswith((".dist-info", ".pth"))}
