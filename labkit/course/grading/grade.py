"""Grading one submission: each question on its secret cases, in a sandbox, whatever happens in the others.

Cases and expected outputs stay in this process; the worker gets the arguments of one case at a time. A worker that
hangs, crashes or floods costs the question that it was busy with, and the others go on in a new one.
"""

import functools
import hashlib
import re
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

from labkit.course.grading import sandbox
from labkit.course.grading.channel import Worker, WorkerLost
from labkit.course.grading.reading import Lab, Submission, imported_roots
from labkit.course.grading.sandbox import Limits
from labkit.course.questions.judge import Case, Problem, Verdict, expected_cases, verdict
from labkit.course.questions.question import Question, of_topic

ON_DEMAND = ("scipy", "torch")  # they take long to load, so only where an answer names them
LONGEST_SHAPE = 24  # characters
LOOK_AT = ("ended", "channel")  # kinds of problems that an instructor should look at


@dataclass(frozen=True)
class Result:
    """What a question earned. says: what was right or wrong, without any expected value; hint: of a misconception;

    flag: what the instructor should look at, "" if nothing.
    """

    question: str
    points: float
    max_points: float
    says: str
    hint: str = ""
    flag: str = ""


def grade_submission(
    lab: Lab, submission: Submission, secret: str, limits: Limits | None = None, unsafe: bool = False
) -> list[Result]:
    """Grade every question of a submission that can be read, in the lab's order.

    secret: what the random cases are drawn from; the same gives the same cases. unsafe: without a sandbox.
    Raises ValueError if no sandbox can be made, or if the lab's own setup cell does not run in it.
    """
    questions = of_topic(lab.topic)
    limits = Limits() if limits is None else limits
    end = time.monotonic() + limits.submission_s
    groups: dict[tuple[str, ...], list[str]] = {}
    for name in submission.cells:
        if name in lab.answers:
            groups.setdefault(packages_for(questions[name], lab, submission), []).append(name)
    judged = {}
    for packages, names in groups.items():
        with Session(lab, submission, packages, limits, end, unsafe) as session:
            for name in names:
                cases = secret_cases(questions[name], secret)
                judged[name] = result(lab, submission, questions[name], cases, session.outputs(name, cases))
    return [judged.get(name) or not_graded(lab, name, submission.problems[name]) for name in lab.answers]


def packages_for(question: Question, lab: Lab, submission: Submission) -> tuple[str, ...]:
    """The packages that there are for a question: NumPy, what the lab's setup imports, and of ON_DEMAND what is named.

    What the question forbids is left out, whole. Everything else is absent in any case.
    """
    answers = " ".join(submission.cells.get(name, "") for name in lab.answers)
    wanted = {*imported_roots(lab.setup), *(package for package in ON_DEMAND if package in answers)}
    forbidden = {name.partition(".")[0] for name in question.forbidden}
    if not forbidden.isdisjoint(imported_roots(lab.setup)):
        raise ValueError(f"{question.name}: forbids what its lab's setup cell imports, {', '.join(sorted(forbidden))}")
    return tuple(sorted(wanted - forbidden))


@functools.lru_cache(maxsize=64)
def _cases(topic: str, function: str, secret: str) -> tuple[Case, ...]:
    question = of_topic(topic)[function]
    seed = hashlib.sha256(f"{secret}\0{question.name}".encode()).digest()
    return tuple(expected_cases(question, int.from_bytes(seed, "little")))


def secret_cases(question: Question, secret: str) -> tuple[Case, ...]:
    """The cases of a question that belong to a secret; computed once in a process."""
    return _cases(question.topic, question.function, secret)


class Session:
    """A submission's cells in a worker, and in another one when that is lost. A context manager."""

    def __init__(
        self, lab: Lab, submission: Submission, packages: tuple[str, ...], limits: Limits, end: float, unsafe: bool
    ):
        self.lab, self.submission, self.packages, self.unsafe = lab, submission, packages, unsafe
        self.limits, self.end = limits, end
        self.worker: Worker | None = None
        self.cell_problems: dict[str, Problem] = {}
        self.fatal: set[str] = set()  # cells that cost a worker: they are not run again

    def __enter__(self) -> "Session":
        return self

    def __exit__(self, *exception) -> None:
        if self.worker is not None:
            self.worker.close()

    def outputs(self, name: str, cases: Sequence[Case]) -> list[object]:
        """Call a function on the arguments of all cases: an output or a Problem for each.

        After a case that cost the worker, this function is not called again.
        """
        outputs = []
        for case in cases:
            try:
                self.make_ready()
                if name in self.fatal:
                    raise WorkerLost(self.cell_problems[name])
                output = self.worker.ask(("call", name, case.args), self.time_left())
            except WorkerLost as lost:
                if self.worker is not None and self.worker.process.returncode is not None:
                    self.worker = None
                return outputs + [lost.problem] * (len(cases) - len(outputs))
            if isinstance(output, Problem) and output.kind == "missing":
                output = self.cell_problems.get(name, output)
            outputs.append(output)
        return outputs

    def make_ready(self) -> None:
        """See to it that there is a worker in which the setup and all cells were run that can be."""
        while self.worker is None:
            self.time_left()
            worker = sandbox.start(self.packages, self.limits, self.unsafe)
            self.worker = self.run_cells(worker)

    def run_cells(self, worker: Worker) -> Worker | None:
        """Run the setup and the cells; None if one of them cost the worker, which is remembered."""
        run_setup(worker, self.lab, self.limits)
        for name in self.lab.answers:
            if name not in self.submission.cells or name in self.fatal:
                continue
            try:
                done = worker.ask(("cell", name, self.submission.cells[name]), self.time_left())
            except WorkerLost as lost:
                self.fatal.add(name)
                self.cell_problems[name] = lost.problem
                return None
            if isinstance(done, Problem):
                self.cell_problems[name] = done
        return worker

    def time_left(self) -> float:
        """Seconds for the next request; raises WorkerLost when the submission has used up its time."""
        left = self.end - time.monotonic()
        if left <= 0.0:
            raise WorkerLost(Problem("time", f"the submission took more than {self.limits.submission_s:g} s in all"))
        return min(left, self.limits.case_s)


def run_setup(worker: Worker, lab: Lab, limits: Limits) -> None:
    """Run the lab's own setup cell; raises ValueError if it does not run."""
    try:
        done = worker.ask(("cell", "setup", lab.setup), limits.start_s)
    except WorkerLost as lost:
        done = lost.problem
    if done is not None:
        worker.close()
        raise ValueError(f"{lab.topic}: its setup cell does not run where answers are graded: {done.says}")


def result(lab: Lab, submission: Submission, question: Question, cases: Sequence[Case], outputs: list) -> Result:
    """Judge a question's outputs and put the verdict into words and points."""
    name, source = question.function, submission.cells[question.function]
    judged = judged_safely(question, cases, outputs)
    flags = [f"names {word}" for word in named_modules(source, question) if not named(word, lab.answers[name])]
    if judged.problem is None:
        says = f"right in all {len(cases)} cases"
        return Result(name, lab.points[name], lab.points[name], says, flag="; ".join(flags))
    problem = with_short_shape(with_line(judged.problem, source))
    says = problem.says if problem.kind in ("unanswered", "missing") else f"{problem.says} ({judged.where})"
    if problem.kind in LOOK_AT:
        flags.append(problem.says)
    return Result(name, 0.0, lab.points[name], says, judged.hint or "", "; ".join(flags))


def judged_safely(question: Question, cases: Sequence[Case], outputs: list) -> Verdict:
    """The verdict; outputs that the comparison cannot even digest are wrong, and do not stop the batch."""
    try:
        return verdict(question, cases, outputs)
    except Exception as error:
        problem = Problem("channel", f"its outputs cannot be compared: {type(error).__name__}")
        return Verdict(problem, 0, "some case", None, ())


def with_short_shape(problem: Problem) -> Problem:
    """Leave out a shape that is too long to be an honest one: many digits could tell the secret arguments."""
    kept, got, shape = problem.says.rpartition("got ")
    if problem.kind != "shape" or len(shape) <= LONGEST_SHAPE:
        return problem
    return replace(problem, says=f"{kept}{got}quite another shape")


def not_graded(lab: Lab, name: str, problem: str) -> Result:
    """The result of a question whose cell cannot be read."""
    return Result(name, 0.0, lab.points[name], problem, flag=problem)


def with_line(problem: Problem, source: str) -> Problem:
    """Say in which of the student's lines an exception was raised, if it is one of them."""
    if not problem.lines:
        return problem
    number, lines = problem.lines[0][0], source.splitlines()
    if not 1 <= number <= len(lines):
        return replace(problem, lines=())
    line = "".join(c if c.isprintable() else " " for c in lines[number - 1]).strip()
    return replace(problem, says=f"{problem.says} in line {number}: {line[:80]}")


def named_modules(source: str, question: Question) -> list[str]:
    """Modules that an answer names although they are absent: no reason to fail, but the instructor may want to look."""
    return [word for word in dict.fromkeys((*question.forbidden, "labkit")) if named(word, source)]


def named(word: str, source: str) -> bool:
    """Whether a word stands in a source.

    >>> named("scipy", "import scipy.ndimage"), named("scipy", "not_scipy = 1")
    (True, False)
    """
    return re.search(rf"(?<![\w.]){re.escape(word)}(?!\w)", source) is not None
