"""An answer on the cases of its question, in one worker: outputs, the verdict, and what is found in its program.

Cases and what is expected stay in this process: a worker gets the arguments of one case at a time.
"""

import functools
import pickle
import sys
import threading
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass, replace

from labgrader.comparison import UNTRIED, Case, Problem, compare, expected_cases, is_large
from labgrader.course import course
from labgrader.program.slice import Program
from labgrader.question import PUBLIC_SEED, Question
from labgrader.reply.finding import MOST_FINDINGS, Finding, read_findings
from labgrader.reply.judge import Verdict, verdict
from labgrader.reply.listed import Listed, listed_in
from labgrader.reply.repair_job import comparison_settings, first, fresh_cases, pairs
from labgrader.reply.watches import MOST_S as WATCH_S
from labgrader.run.channel import MOST_FOUND, Changed, Worker, WorkerLost
from labgrader.run.limits import Limits
from labgrader.run.process import MORE
from labgrader.run.stopwatch import Stopwatch

ENOUGH_S = 2.0  # CPU seconds for the cases of an answer that is wrong: then others are not tried
LOOK_S = 5.0  # for a look: its own limits come before, but where a compiled function does not come back
# References are called with Python's warnings off, which no thread has for itself; and Python 3.11's parser fails when
# two threads use it at a time.
reference_lock = threading.Lock()


Start = Callable[[Sequence[str], Limits], AbstractContextManager[Worker]]  # a fresh worker with some packages


@functools.cache
def public_cases(question: Question) -> tuple[Case, ...]:
    """The cases that a check uses; computed once in a process."""
    with reference_lock:
        return tuple(expected_cases(question, PUBLIC_SEED))


@functools.cache
def more_public_cases(question: Question) -> tuple[Case, ...]:
    """Cases of other public seeds, on which a repair is tried; computed once in a process."""
    with reference_lock:
        return tuple(fresh_cases(question))


@functools.cache
def listed_mistakes(question: Question) -> list[Listed | None]:
    """What the listed mistakes give in the public cases, as `listed_in` does; computed once in a process."""
    cases = public_cases(question)
    with reference_lock:
        return listed_in(question, cases)


@dataclass
class Budget:
    """What the answers of one notebook may use together, in one run on public or on secret cases."""

    limits: Limits
    spent_s: float = 0.0

    @property
    def for_one(self) -> float:
        """CPU seconds for all cases of the next question: what is left, but enough for an answer as it should be."""
        left = max(self.limits.submission_s - self.spent_s, self.limits.least_s)
        return min(self.limits.question_s, left)


class Run:
    """An answer to a question as a program, in a worker that has run nothing before; a context manager.

    budget: of the notebook that it is of, which pays for it; a new one by default. used_s: CPU seconds so
    far; called_s: of the last `outputs`. not_run: the problem of a piece that did not run, None if all ran.
    """

    def __init__(
        self, question: Question, program: Program, start: Start, limits: Limits, budget: Budget | None = None
    ):
        self.question, self.program, self.limits = question, program, limits
        self.budget = Budget(limits) if budget is None else budget
        self.name, self.seconds = program.name or question.function, self.budget.for_one
        self.used_s = self.called_s = 0.0
        self.starting = start(packages_of(question, program), limits)

    def __enter__(self) -> "Run":
        self.worker = self.starting.__enter__()
        try:
            self.not_run = self.run_pieces()
        except BaseException:  # as Ctrl-C: nobody would end the worker
            self.__exit__(*sys.exc_info())
            raise
        return self

    def __exit__(self, *exception) -> None:
        self.budget.spent_s += self.used_s
        self.starting.__exit__(*exception)

    def run_pieces(self) -> Problem | None:
        """Run the program; what is wrong with it, None if nothing."""
        self.stopwatch = Stopwatch(self.worker.pid)
        for label, text in self.program.pieces:
            problem = self.ask("run", label, text)
            if problem is not None:
                return problem if isinstance(problem, Problem) else Problem("channel", "it answers for its cell")
        return None

    def ask(self, *request: object) -> object:
        """What the worker replies, or the Problem that ended it; once the question's time is up, it is ended."""
        left = self.seconds - self.used_s
        limit = min(left, self.limits.case_s)
        try:
            if left <= 0.0:
                self.worker.close()
                said = f"all its cases together took more than {self.seconds:.3g} s of CPU time"
                raise WorkerLost(Problem("time", said))
            reply = self.worker.ask(request, limit, asleep_s=self.limits.asleep_s)
        except WorkerLost as lost:
            self.used_s += max(limit, 0.0) if lost.problem.kind == "time" else 0.0
            return lost.problem
        self.used_s = self.stopwatch.used()
        return reply

    def outputs(self, cases: Sequence[Case], brief: bool = False) -> list[object]:
        """Call the answer on the arguments of all cases: an output or a Problem for each.

        After a case that cost the worker, the answer is not called again. brief: nor on large cases once a usual one
        is wrong, of which no reply speaks, nor on any more where that has taken ENOUGH_S.
        """
        outputs: list[object] = []
        before, enough = self.used_s, False
        for case in cases:
            if brief and not enough and outputs:
                last = cases[len(outputs) - 1]
                enough = last.is_usual and is_wrong(self.question, last, outputs[-1])
            if enough and (is_large(case) or self.used_s - before > ENOUGH_S):
                outputs.append(UNTRIED)
                continue
            if self.worker.closed:
                outputs.append(self.worker.stopped or (outputs[-1] if outputs else self.not_run))
                continue
            output = self.ask("call", self.name, pickle.dumps(case.args))
            missing = isinstance(output, Problem) and output.kind == "missing"
            outputs.append(self.not_run if missing and self.not_run is not None else output)
        self.called_s = self.used_s - before
        return outputs

    def judge(self, cases: Sequence[Case], brief: bool = False) -> tuple[Verdict, list[object]]:
        """The verdict on some cases, with the outputs; outputs that cannot even be compared are wrong."""
        outputs = self.outputs(cases, brief)
        worded = [self.with_line(output) for output in outputs]
        if self.not_run is not None and outputs[0] is self.not_run:
            return Verdict(worded[0], None, "before it is called", outputs=worded), outputs
        if isinstance(worded[0], Problem) and worded[0].kind == "missing":
            return Verdict(worded[0], None, "", outputs=worded), outputs
        try:
            verdict = verdict_on(self.question, cases, worded)
            return replace(verdict, pieces=self.program.pieces), outputs
        except Exception as error:
            problem = Problem("channel", f"its outputs cannot be compared: {type(error).__name__}")
            return Verdict(problem, 0, "some case", outputs=worded), outputs

    def findings(self, shown: int = 0) -> list[Finding]:
        """What instruments and repair find in the program; they get public cases and nothing else.

        shown: the number of the case that a student sees, which comes first.
        """
        question, pieces = self.question, self.program.pieces
        cases, listed = (first(some, shown) for some in (public_cases(question), listed_mistakes(question)))
        job = (*comparison_settings(question), self.name, pieces, pairs(cases), listed)
        found: list[Finding] = []
        with suppress(WorkerLost):
            looks = ("watch", "repair") if self.called_s <= WATCH_S else ("repair",)  # a watch calls it on all cases
            for look in looks:
                stopwatch = Stopwatch(self.worker.pid)
                reply = self.worker.ask((look, *job), LOOK_S, MOST_FOUND)
                if reply == MORE[1:].decode():
                    reply = self.worker.ask(pairs(more_public_cases(question)), LOOK_S - stopwatch.used(), MOST_FOUND)
                found += read_findings(reply, pieces) if isinstance(reply, str) else []
        return found[:MOST_FINDINGS]

    def with_line(self, output: object) -> object:
        """An output; an exception with the text of the student's line that raised it, if there is one."""
        if not isinstance(output, Problem) or output.kind != "exception":
            return output
        ((number, piece),) = output.lines
        pieces = self.program.pieces
        lines = pieces[int(piece)][1].split("\n") if int(piece) < len(pieces) else []
        own = ((number, lines[number - 1].strip()),) if 1 <= number <= len(lines) else ()
        return replace(output, says=output.says.removeprefix("it raises "), lines=own)


def is_wrong(question: Question, case: Case, output: object) -> bool:
    """Whether an output of a worker is wrong; one that cannot be compared is."""
    value = output.value if isinstance(output, Changed) else output
    try:
        return isinstance(value, Problem) or compare(question, case.expected, value) is not None
    except Exception:
        return True


def packages_of(question: Question, program: Program) -> tuple[str, ...]:
    """NumPy, and the other packages that a program names and its question allows."""
    forbidden = {name.partition(".")[0] for name in question.forbidden}
    text = " ".join(text for _, text in program.pieces)
    return tuple(name for name in course().packages if name == "numpy" or (name in text and name not in forbidden))


def verdict_on(question: Question, cases: Sequence[Case], outputs: Sequence[object]) -> Verdict:
    """The verdict on what `Run.outputs` gives."""
    changed = frozenset(k for output in outputs if isinstance(output, Changed) for k in output.positions)
    values = [output.value if isinstance(output, Changed) else output for output in outputs]
    return verdict(question, cases, values, changed)
