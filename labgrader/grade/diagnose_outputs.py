"""What a student is told about a wrong answer, found in a process of its own, within limits of time and memory.

Outputs are of a stranger's making, and the search for a mistake tries many programs on them. A process that ends, or
takes too long, costs this answer its hint; the grader goes on.
"""

import collections
import os
import pickle
import resource
import struct
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from labgrader.course import environment, of_topic
from labgrader.question import Question
from labgrader.reply.finding import Finding
from labgrader.run.run import public_cases, verdict_on

SECONDS, MEMORY = 20, 3 << 30  # of a processor, for one answer; bytes of address space, for the process


@dataclass(frozen=True)
class Diagnosis:
    """What was found about a wrong answer. named: whether one knows from the hint what to change.

    failed: why nothing was found.

    shown: the case that is told, and the marked lines. needs_a_look: whether nothing is said before somebody looks at
    the program.
    """

    hint: str = ""
    named: bool = False
    shown: str = ""
    failed: str = ""
    needs_a_look: bool = False


def diagnosed(
    topic: str,
    function: str,
    outputs: Sequence[object],
    pieces: Sequence[tuple[str, str]] = (),
    findings: Sequence[Finding] | None = None,
) -> Diagnosis:
    """What to tell about outputs on the public cases, found in this process.

    pieces: the program; findings: what was found in it, None if nobody has looked yet.
    """
    question = of_topic(topic)[function]
    verdict = verdict_on(question, public_cases(question), outputs)
    if findings is None and verdict.needs_a_look:
        return Diagnosis(needs_a_look=True)
    sentence = replace(verdict, pieces=pieces, findings=findings or ()).sentence
    if sentence is None:
        return Diagnosis(shown="\n".join(verdict.shown))
    lines = [*verdict.shown, *(line for marked in sentence.marked for line in marked.plain())]
    return Diagnosis(sentence.says, sentence.names_the_mistake, "\n".join(lines))


class Diagnoser:
    """A process that is asked for one answer after the other. seconds: of a processor, for each; memory: in bytes."""

    def __init__(self, seconds: int = SECONDS, memory: int = MEMORY):
        self.limits = f"{seconds} s and {memory >> 30} GB"
        path = os.pathsep.join([str(Path(__file__).parents[2]), *filter(None, [os.environ.get("PYTHONPATH")])])
        begin = f"from labgrader.grade.diagnose_outputs import main; main({seconds}, {memory})"
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-c", begin],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=os.environ | environment() | {"PYTHONPATH": path, "OMP_NUM_THREADS": "1"},
        )

    def ask(self, topic: str, function: str, *outputs_and_program: object) -> Diagnosis:
        """What `diagnosed` tells, or why that cannot be said; the process may have ended then."""
        data = pickle.dumps((topic, function, *outputs_and_program))
        try:
            self.process.stdin.write(struct.pack("<Q", len(data)) + data)
            self.process.stdin.flush()
            return pickle.load(self.process.stdout)
        except (OSError, EOFError, pickle.UnpicklingError):
            self.close()
            return Diagnosis(failed=f"its mistake was not found within {self.limits}")

    def close(self) -> None:
        """End the process."""
        self.process.kill()
        self.process.wait()
        for stream in (self.process.stdin, self.process.stdout):
            with suppress(OSError):
                stream.close()


class Diagnosers:
    """Processes that wait for the next answer; threads take them and give them back."""

    def __init__(self):
        self.idle: collections.deque[Diagnoser] = collections.deque()

    def ask(self, question: Question, *outputs_and_program: object) -> Diagnosis:
        """What to tell about an answer on the public cases: arguments after the question as `diagnosed` takes them."""
        try:
            diagnoser = self.idle.pop()
        except IndexError:
            diagnoser = Diagnoser()
        found = diagnoser.ask(question.topic, question.function, *outputs_and_program)
        if diagnoser.process.poll() is None:
            self.idle.append(diagnoser)
        return found

    def close(self) -> None:
        """End all of them that wait."""
        while self.idle:
            self.idle.pop().close()


diagnosers = Diagnosers()


def main(seconds: int, memory: int) -> None:
    """Answer requests until there are no more; the kernel ends this process when one takes too long."""
    requests, replies = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    while len(head := requests.read(8)) == 8:
        data = requests.read(*struct.unpack("<Q", head))
        used = resource.getrusage(resource.RUSAGE_SELF)
        limit = int(used.ru_utime + used.ru_stime) + seconds + 1
        resource.setrlimit(resource.RLIMIT_CPU, (limit, resource.RLIM_INFINITY))
        try:
            found = diagnosed(*pickle.loads(data))
        except Exception as error:
            found = Diagnosis(failed=f"its mistake cannot be looked for: {type(error).__name__}")
        pickle.dump(found, replies)
        replies.flush()
