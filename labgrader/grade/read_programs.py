"""Programs of strangers as syntax trees, in a process of its own: their shapes, and what they try.

A text may break a parser or take it long. The process has limits of time and memory; one that ends it costs nobody
else.
"""

import ast
import json
import os
import resource
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from labgrader.grade.attempts import attempts
from labgrader.grade.shapes import Shapes, shapes
from labgrader.program.effects import without_idle

LONGEST = 40_000  # characters of a program that is read
SECONDS, MEMORY = 3, 1 << 30  # of a processor, for one program; bytes of address space, for the process


@dataclass(frozen=True)
class Read:
    """What is in a program: its shapes with their lines, and what it tries that no answer needs."""

    shapes: Shapes
    attempts: list[str]


def read_program(source: str) -> Read:
    """Read a program here; raises what a parser raises for what is no Python."""
    tree = ast.parse(source)
    tried = attempts(tree)
    return Read(shapes(without_idle(tree)), tried)


def read_all(sources: Sequence[str]) -> dict[str, Read | None]:
    """Read programs of strangers; None is what cannot be read within the limits, or is no Python."""
    sources = list(dict.fromkeys(sources))
    found: list[Read | None] = []
    path = os.pathsep.join([str(Path(__file__).parents[2]), *filter(None, [os.environ.get("PYTHONPATH")])])
    while len(found) < len(sources):
        done = subprocess.run(
            [sys.executable, "-P", "-c", "from labgrader.grade.read_programs import main; main()"],
            input=json.dumps(sources[len(found) :]).encode(),
            capture_output=True,
            env=os.environ | {"PYTHONPATH": path},
            check=False,
        )
        replies = [json.loads(line) for line in done.stdout.split(b"\n")[:-1]]
        found += [None if reply is None else Read(*reply) for reply in replies]
        found += [None] * (len(found) < len(sources))  # the one that ended the process
    return dict(zip(sources, found, strict=True))


def main() -> None:
    """Read programs, and write a line of JSON for each at once; the kernel ends this process if one takes too long."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    for source in json.load(sys.stdin):
        used = resource.getrusage(resource.RUSAGE_SELF)
        resource.setrlimit(resource.RLIMIT_CPU, (int(used.ru_utime + used.ru_stime) + SECONDS + 1, -1))
        reply = None
        try:
            if len(source) <= LONGEST:
                found = read_program(source)
                reply = found.shapes, found.attempts
        except (SyntaxError, ValueError, RecursionError, MemoryError):
            pass
        print(json.dumps(reply), flush=True)
