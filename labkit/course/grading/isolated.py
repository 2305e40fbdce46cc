"""An answer's program in a worker of its own, on cases that this process keeps: for grades and `labkit check`."""

import functools
import hashlib
import pickle
import time
from collections.abc import Sequence
from dataclasses import dataclass

from labkit.course.checker.judge import Case, Problem, Verdict, expected_cases, verdict
from labkit.course.checker.program import Program
from labkit.course.checker.question import PACKAGES, PUBLIC_SEED, Question
from labkit.course.grading import sandbox
from labkit.course.grading.channel import Changed, Worker, WorkerLost
from labkit.course.grading.sandbox import Limits
from labkit.course.topics import of_topic


def cases_of(question: Question, secret: str | None) -> tuple[Case, ...]:
    """The cases of a question that belong to a secret, or the public ones; computed once in a process."""
    return _cases(question.topic, question.function, secret)


@functools.lru_cache(maxsize=64)
def _cases(topic: str, function: str, secret: str | None) -> tuple[Case, ...]:
    question, seed = of_topic(topic)[function], PUBLIC_SEED
    if secret is not None:
        seed = int.from_bytes(hashlib.sha256(f"{secret}\0{question.name}".encode()).digest(), "little")
    return tuple(expected_cases(question, seed))


@dataclass(frozen=True)
class Run:
    """An answer to a question as a program, which runs in a fresh worker each time."""

    question: Question
    program: Program
    limits: Limits
    unsafe: bool

    def judged(self, cases: Sequence[Case]) -> tuple[Verdict, list[object]]:
        """The verdict on some cases, with the outputs; outputs that cannot even be compared are wrong."""
        outputs = self.outputs(cases)
        changed = frozenset(output.position for output in outputs if isinstance(output, Changed))
        values = [output.value if isinstance(output, Changed) else output for output in outputs]
        try:
            judged = verdict(self.question, cases, values, changed)
        except Exception as error:
            problem = Problem("channel", f"its outputs cannot be compared: {type(error).__name__}")
            return Verdict(problem, 0, "some case", None, ()), values
        return judged, values

    def outputs(self, cases: Sequence[Case]) -> list[object]:
        """Call the answer on the arguments of all cases: an output or a Problem for each.

        After a case that cost the worker, the answer is not called again.
        """
        outputs, name = [], self.question.function
        try:
            with sandbox.fresh_worker(self.packages(), self.limits, self.unsafe) as worker:
                end = time.monotonic() + self.limits.question_s
                problem = self.run_pieces(worker, end)
                for case in cases:
                    output = worker.ask(("call", name, pickle.dumps(case.args)), self.time_left(end))
                    missing = isinstance(output, Problem) and output.kind == "missing"
                    outputs.append(problem if missing and problem is not None else output)
        except WorkerLost as lost:
            outputs += [lost.problem] * (len(cases) - len(outputs))
        return outputs

    def run_pieces(self, worker: Worker, end: float) -> Problem | None:
        """Run the program; what is wrong with it, None if nothing."""
        for label, text in self.program.pieces:
            done = worker.ask(("run", label, text), self.time_left(end))
            if isinstance(done, Problem):
                return done
        return None

    def packages(self) -> tuple[str, ...]:
        """NumPy, and the other packages that the program names and the question allows."""
        forbidden = {name.partition(".")[0] for name in self.question.forbidden}
        text = " ".join(text for _, text in self.program.pieces)
        return tuple(name for name in PACKAGES if name == "numpy" or (name in text and name not in forbidden))

    def time_left(self, end: float) -> float:
        """Seconds for the next request; raises WorkerLost when the question has used up its time."""
        left = end - time.monotonic()
        if left <= 0.0:
            raise WorkerLost(Problem("time", f"all its cases together took more than {self.limits.question_s:g} s"))
        return min(left, self.limits.case_s)
