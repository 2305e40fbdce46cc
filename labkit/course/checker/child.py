"""A process of its own for a student's program: watched by instruments, then repaired, never in the student's kernel.

    findings(question, pieces, seed)     what was found, the surest first; none where no such process can be had

The process has limits on time, memory and output, no display, and may not write files or start others.
"""

import importlib
import os
import pickle
import subprocess
import sys
import tempfile
from collections.abc import Sequence

from labkit.course.checker.comparison import Case, expected_cases
from labkit.course.checker.finding import Finding, read, write
from labkit.course.checker.look import look
from labkit.course.checker.question import Question

FRESH_SEEDS = 20
MEMORY = 3 << 30  # bytes of address space
CPU_S = 9  # a mutation may keep a compiled function busy without end, which no alarm of Python's ends
CLOCK_S = 20.0  # the limits in CPU time come before, unless the machine is busy
FORBIDDEN = ("subprocess.", "socket.", "shutil.", "os.exec", "os.fork", "os.posix_spawn", "os.system", "os.kill")
FORBIDDEN += ("os.remove", "os.rename", "os.mkdir", "os.rmdir", "os.link", "os.symlink", "os.truncate", "webbrowser.")


def findings(question: Question, pieces: Sequence[tuple[str, str]], seed: int) -> list[Finding]:
    """Look at a program in a child process. seed: of the public cases. Gives none if anything goes wrong there."""
    module = question.reference.__module__
    if getattr(sys.modules.get(module), "QUESTION", None) is not question:
        return []
    command = [sys.executable, "-c", "from labkit.course.checker.child import main; main()"]
    environment = {**os.environ, "MPLBACKEND": "agg", "OMP_NUM_THREADS": "1", "PYTHONPATH": os.pathsep.join(sys.path)}
    task = pickle.dumps((module, [tuple(piece) for piece in pieces], seed))
    try:
        with tempfile.TemporaryDirectory() as folder:
            options = {"input": task, "capture_output": True, "timeout": CLOCK_S, "cwd": folder, "env": environment}
            done = subprocess.run(command, **options)
    except (OSError, subprocess.SubprocessError):
        return []
    return read(done.stdout.decode(errors="replace"), pieces) if done.returncode == 0 else []


def main() -> None:
    """Read a task from standard input, and write the findings to standard output."""
    module, pieces, seed = pickle.load(sys.stdin.buffer)
    question = importlib.import_module(module).QUESTION
    public = pairs(expected_cases(question, seed))
    answer = os.dup(1)
    shut_in()
    found = look(question, pieces, public, lambda: pairs(fresh_cases(question, seed)))
    os.write(answer, write(found).encode())


def fresh_cases(question: Question, seed: int) -> list[Case]:
    """Random cases of FRESH_SEEDS other public seeds."""
    seeds = range(seed + 1, seed + 1 + FRESH_SEEDS)
    return [case for s in seeds for case in expected_cases(question, s) if not case.by_hand]


def pairs(cases: Sequence[Case]) -> list[tuple[tuple, object]]:
    """Arguments and expected outputs alone."""
    return [(case.args, case.expected) for case in cases]


def shut_in() -> None:
    """Take from this process what a student's program does not need; raises ImportError where there are no limits."""
    import resource

    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_S, CPU_S))
    null = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        os.dup2(null, stream)

    def refuse(event: str, args: tuple) -> None:
        writes = event == "open" and args[2] & (os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC)
        if writes or event.startswith(FORBIDDEN):
            raise PermissionError(f"an answer does not do this: {event}")

    sys.addaudithook(refuse)
