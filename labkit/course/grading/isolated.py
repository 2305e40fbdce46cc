"""An answer's program in a worker of its own, on cases that this process keeps: for grades and `labkit check`."""

import functools
import hashlib
import pickle
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

from labkit.course.checker.child import fresh_cases, pairs
from labkit.course.checker.finding import Finding, read
from labkit.course.checker.judge import Case, Problem, Verdict, expected_cases, verdict
from labkit.course.checker.program import Program
from labkit.course.checker.question import PACKAGES, PUBLIC_SEED, Question
from labkit.course.grading import sandbox
from labkit.course.grading.channel import MOST_FOUND, Changed, Worker, WorkerLost
from labkit.course.grading.sandbox import Limits

drawing = threading.Lock()  # references are called with Python's warnings off, which no thread has for itself


@functools.cache
def public_cases(question: Question) -> tuple[Case, ...]:
    """The cases that `check` uses; computed once in a process."""
    with drawing:
        return tuple(expected_cases(question, PUBLIC_SEED))


@functools.cache
def more_public_cases(question: Question) -> tuple[Case, ...]:
    """Cases of other public seeds, on which a repair is tried; computed once in a process."""
    with drawing:
        return tuple(fresh_cases(question, PUBLIC_SEED))


def secret_cases(question: Question, secret: str, digest: str) -> tuple[Case, ...]:
    """The random cases that decide about an answer of one notebook; no other notebook gets them.

    secret: of the round of grading; digest: of the notebook. They are twice as many as the public ones, since those by
    hand are not among them.
    """
    seed = int.from_bytes(hashlib.sha256(f"{secret}\0{question.name}\0{digest}".encode()).digest(), "little")
    with drawing:
        cases = expected_cases(replace(question, by_hand=(), random_cases=2 * question.random_cases), seed)
    return tuple(cases)


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
        try:
            return verdict_on(self.question, cases, outputs), outputs
        except Exception as error:
            problem = Problem("channel", f"its outputs cannot be compared: {type(error).__name__}")
            return Verdict(problem, 0, "some case"), outputs

    def findings(self) -> list[Finding]:
        """What instruments and repair find in the program, in a worker that gets public cases and nothing else."""
        question, pieces = self.question, self.program.pieces
        tolerances = {name: getattr(question, name) for name in ("name", "rtol", "atol", "same_dtype")}
        public, fresh = pairs(public_cases(question)), pairs(more_public_cases(question))
        try:
            with sandbox.fresh_worker(self.packages(), self.limits, self.unsafe) as worker:
                task = ("look", tolerances, pieces, public, fresh)
                reply = worker.ask(task, self.limits.question_s, MOST_FOUND)
        except WorkerLost:
            return []
        return read(reply, pieces) if isinstance(reply, str) else []

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


def verdict_on(question: Question, cases: Sequence[Case], outputs: Sequence[object]) -> Verdict:
    """The verdict on what `Run.outputs` gives."""
    changed = frozenset(output.position for output in outputs if isinstance(output, Changed))
    values = [output.value if isinstance(output, Changed) else output for output in outputs]
    return verdict(question, cases, values, changed)
