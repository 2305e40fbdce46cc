"""A worker as a plain process, on every system: for a student's own check, and for grading without a sandbox.

It is no defence. One is always started ahead, so that a check waits for nothing and each answer has a fresh one. Time
of a processor is limited everywhere. Linux limits memory, too; on macOS and Windows, which do not, it is looked at
while an answer runs (`channel.Worker.watch`).
"""

import atexit
import functools
import json
import os
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from importlib import metadata
from pathlib import Path

from labgrader.packages import requirements
from labgrader.run.channel import Worker, WorkerLost
from labgrader.run.limits import Limits

# A sandbox has the files of no locale, so that "" names C in both.
ENVIRONMENT = {
    "LC_ALL": "C",
    "PYTHONUTF8": "1",
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "PYTHONHASHSEED": "0",
}
ROOT = Path(__file__).resolve().parents[2]
# What an interpreter begins with that is to be a worker: its options are the argument that follows.
START = "import json, sys; options = json.loads(sys.argv[1]); sys.path[:0] = options['path']; "
START_PLAIN = START + "from labgrader.run.process import main; main(options)"


def limits_of(packages: Sequence[str], limits: Limits) -> dict:
    """What a worker is told about its limits, and what it loads before it takes any."""
    return {
        "load": list(packages),
        "memory": (limits.torch_memory_mb if "torch" in packages else limits.memory_mb) << 20,
        "file_size": limits.file_mb << 20,
        "cpu_s": int(limits.question_s) + 5,
    }


def started(packages: Sequence[str], limits: Limits) -> Worker:
    """Start a worker; it is ready when it greets."""
    options = limits_of(packages, limits) | {
        "path": [str(ROOT), *site_folders()],
        "only": [name.partition(".")[0] for name in package_files(tuple(packages))],
        "threads": None,
    }
    own = {name: os.environ[name] for name in ("SYSTEMROOT", "PATH") if os.name == "nt" and name in os.environ}
    place = {"HOME": tempfile.gettempdir(), "TMPDIR": tempfile.gettempdir()}
    printed = tempfile.TemporaryFile()  # noqa: SIM115 (the worker's, and gone with it)
    # On Windows an environment's python.exe only starts another process, in which everything would happen.
    python = getattr(sys, "_base_executable", sys.executable) if os.name == "nt" else sys.executable
    process = subprocess.Popen(
        [python, "-P", "-s", "-S", "-c", START_PLAIN, json.dumps(options)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=printed,
        cwd=tempfile.gettempdir(),
        env=ENVIRONMENT | place | own,
    )

    def kill() -> None:
        process.kill()
        process.wait()

    memory = None if sys.platform == "linux" else options["memory"]
    return Worker(process.stdin, process.stdout, kill, printed, process.pid, memory)


class Spare:
    """A worker with NumPy that waits for the next answer."""

    def __init__(self):
        self.lock, self.worker = threading.Lock(), None

    def taken(self) -> Worker | None:
        """The one that waits, if there is one; it may have ended."""
        with self.lock:
            worker, self.worker = self.worker, None
        return worker

    def replace(self) -> None:
        """Start another one, if none waits."""
        with self.lock:
            if self.worker is None:
                self.worker = started(("numpy",), Limits())

    def close(self) -> None:
        """End the one that waits."""
        if worker := self.taken():
            worker.close()


spare = Spare()
atexit.register(spare.close)


@contextmanager
def fresh_worker(packages: Sequence[str], limits: Limits) -> Iterator[Worker]:
    """A worker that has run nothing; it is ended afterwards. Raises ValueError where none starts."""
    usual = tuple(packages) == ("numpy",) and replace(limits, asleep_s=None) == Limits()
    with ready((spare.taken() if usual else None), packages, limits) as worker:
        try:
            yield worker
        finally:
            if usual:
                spare.replace()


def ready(waiting: Worker | None, packages: Sequence[str], limits: Limits) -> Worker:
    """A worker that has greeted: the one that waits, or a new one where that is none, or has ended."""
    for worker in (waiting, None) if waiting else (None,):
        worker = worker or started(packages, limits)
        try:
            worker.greet(limits.start_s)
            return worker
        except WorkerLost:
            continue
    raise ValueError(f"a worker with {', '.join(packages)} does not start: {worker.printed() or 'it says nothing'}")


# ------------------------------------------------------------------------------------------------- its packages


@functools.cache
def site_folders() -> tuple[str, ...]:
    """Where this interpreter keeps installed packages."""
    found = [packages[0] for name in ("numpy", "torch") if (packages := list(metadata.distributions(name=name)))]
    return tuple(dict.fromkeys(str(Path(str(package.locate_file("")))) for package in found))


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
