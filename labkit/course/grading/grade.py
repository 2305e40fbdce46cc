"""Grading one submission: each question in a process of its own, on secret cases first.

Cases and expected outputs stay in this process; a worker gets the arguments of one case at a time. Secret cases decide
the points and nothing else: what a student reads about a wrong answer comes from a second run, in another fresh worker,
on the public cases that `check` uses. So nothing that an answer does with secret inputs can reach a student.
"""

import functools
import hashlib
import pickle
import re
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from labkit.course.checking import PUBLIC_SEED
from labkit.course.grading import copies, sandbox
from labkit.course.grading.channel import Changed, Worker, WorkerLost
from labkit.course.grading.reading import Lab, Submission, imported_roots
from labkit.course.grading.sandbox import Limits
from labkit.course.questions.judge import Case, Problem, Verdict, expected_cases, parts, verdict
from labkit.course.questions.question import Question, of_topic

ON_DEMAND = ("scipy", "torch")  # they take long to load, so only where an answer names them
LOOK_AT = ("ended", "channel")  # kinds of problems that an instructor should look at
ONLY_HIDDEN = (
    "right in the cases of its check, wrong in others: which inputs does the task allow that these do not have?"
)


@dataclass(frozen=True)
class Result:
    """What a question earned. says: what was right or wrong, from public cases; hint: of a misconception.

    flag: what the instructor should look at, "" if nothing. behaviour: the same for answers that give the same wrong
    outputs, "" for a right one and for none.
    """

    question: str
    points: float
    max_points: float
    says: str
    hint: str = ""
    flag: str = ""
    behaviour: str = ""


def grade_submission(
    lab: Lab, submission: Submission, secret: str, limits: Limits | None = None, unsafe: bool = False
) -> list[Result]:
    """Grade every question of a submission that can be read, in the lab's order.

    secret: what the random cases are drawn from; the same gives the same cases. unsafe: without a sandbox.
    Raises ValueError if no sandbox can be made, or if the lab's own setup cell does not run in it.
    """
    questions, limits = of_topic(lab.topic), limits or Limits()
    runs = {name: Run(lab, submission, questions[name], limits, unsafe) for name in lab.answers}
    return [
        grade_question(runs[name], secret) if name in submission.cells else not_graded(lab, name, submission)
        for name in lab.answers
    ]


def grade_question(run: "Run", secret: str) -> Result:
    """Judge an answer on the secret cases, and say what is wrong with a wrong one by the public cases."""
    question, source = run.question, run.submission.cells[run.question.function]
    name, worth = question.function, run.lab.points[question.function]
    hidden, _ = run.judged(cases_of(question, secret))
    flags = [f"names {word}" for word in named_modules(source, question) if not named(word, run.lab.answers[name])]
    flags += copies.found_in(source, question)
    if hidden.problem is None:
        return Result(
            name, worth, worth, f"right in all {len(cases_of(question, secret))} cases", flag="; ".join(flags)
        )
    if hidden.problem.kind in LOOK_AT:
        flags.append(hidden.problem.says)
    public, outputs = run.judged(cases_of(question, None))
    if public.problem is None:
        return Result(name, 0.0, worth, ONLY_HIDDEN, flag="; ".join(flags), behaviour="wrong in secret cases only")
    problem = with_line(public.problem, source)
    blank = problem.kind == "unanswered"
    says = problem.says if blank or problem.kind == "missing" else f"{problem.says} ({public.where})"
    return Result(name, 0.0, worth, says, public.hint or "", "; ".join(flags), "" if blank else behaviour_of(outputs))


def not_graded(lab: Lab, name: str, submission: Submission) -> Result:
    """The result of a question whose cell cannot be read."""
    problem = submission.problems[name]
    return Result(name, 0.0, lab.points[name], problem, flag=problem)


# ------------------------------------------------------------------------------------------------ the cases


def cases_of(question: Question, secret: str | None) -> tuple[Case, ...]:
    """The cases of a question that belong to a secret, or the public ones; computed once in a process."""
    return _cases(question.topic, question.function, secret)


@functools.lru_cache(maxsize=64)
def _cases(topic: str, function: str, secret: str | None) -> tuple[Case, ...]:
    question, seed = of_topic(topic)[function], PUBLIC_SEED
    if secret is not None:
        seed = int.from_bytes(hashlib.sha256(f"{secret}\0{question.name}".encode()).digest(), "little")
    return tuple(expected_cases(question, seed))


# ---------------------------------------------------------------------------------------------- running it


@dataclass(frozen=True)
class Run:
    """An answer to a question, and all that is needed to run it in a fresh worker."""

    lab: Lab
    submission: Submission
    question: Question
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
        if judged.passed and changed:
            judged = replace(judged, problem=Problem("altered", judged.notes[0]), case=0, where="some case")
        return judged, values

    def outputs(self, cases: Sequence[Case]) -> list[object]:
        """Call the answer on the arguments of all cases: an output or a Problem for each.

        After a case that cost the worker, the answer is not called again.
        """
        outputs, end, name = [], time.monotonic() + self.limits.question_s, self.question.function
        try:
            with sandbox.fresh_worker(self.packages(), self.limits, self.unsafe) as worker:
                run_setup(worker, self.lab, self.limits)
                problem = self.run_cells(worker, end)
                for case in cases:
                    output = worker.ask(("call", name, pickle.dumps(case.args)), self.time_left(end))
                    missing = isinstance(output, Problem) and output.kind == "missing"
                    outputs.append(problem if missing and problem is not None else output)
        except WorkerLost as lost:
            outputs += [lost.problem] * (len(cases) - len(outputs))
        return outputs

    def run_cells(self, worker: Worker, end: float) -> Problem | None:
        """Run the answer's cell after those of the answers that it names; what is wrong with it, None if nothing."""
        done = None
        for name in self.needed(self.question.function):
            done = worker.ask(("cell", name, self.submission.cells[name]), self.time_left(end))
        return done if isinstance(done, Problem) else None

    def needed(self, name: str) -> list[str]:
        """An answer, last, and the answers that it names, and so on; in the lab's order."""
        found, waiting = {name}, [name]
        while waiting:
            source = self.submission.cells[waiting.pop()]
            more = {other for other in self.lab.answers if other in self.submission.cells and named(other, source)}
            waiting += more - found
            found |= more
        return [other for other in self.lab.answers if other in found - {name}] + [name]

    def packages(self) -> tuple[str, ...]:
        """NumPy, what the lab's setup imports, and of ON_DEMAND what the program names; not what is forbidden."""
        setup = imported_roots(self.lab.setup)
        program = " ".join(self.submission.cells[name] for name in self.needed(self.question.function))
        wanted = {*setup, *(package for package in ON_DEMAND if package in program)}
        forbidden = {name.partition(".")[0] for name in self.question.forbidden}
        if not forbidden.isdisjoint(setup):
            words = ", ".join(sorted(forbidden))
            raise ValueError(f"{self.question.name}: forbids what its lab's setup cell imports, {words}")
        return tuple(sorted(wanted - forbidden))

    def time_left(self, end: float) -> float:
        """Seconds for the next request; raises WorkerLost when the question has used up its time."""
        left = end - time.monotonic()
        if left <= 0.0:
            raise WorkerLost(Problem("time", f"all its cases together took more than {self.limits.question_s:g} s"))
        return min(left, self.limits.case_s)


def run_setup(worker: Worker, lab: Lab, limits: Limits) -> None:
    """Run the lab's own setup cell; raises ValueError if it does not run."""
    try:
        done = worker.ask(("cell", "setup", lab.setup), limits.start_s)
    except WorkerLost as lost:
        done = lost.problem
    if done is not None:
        raise ValueError(f"{lab.topic}: its setup cell does not run where answers are graded: {done.says}")


# ---------------------------------------------------------------------------------------------- in words


def behaviour_of(outputs: Sequence[object]) -> str:
    """A short name for wrong outputs: the same for answers that give the same, up to rounding."""
    text = "\n".join(repr(output) if isinstance(output, Problem) else told(output) for output in outputs)
    return hashlib.sha256(text.encode()).hexdigest()[:8]


def told(output: object) -> str:
    """Kind, shape and rounded values of an output."""
    found = []
    for part in parts(output):
        array = np.asarray(part)
        with suppress(TypeError), np.errstate(all="ignore"):
            array = array if array.dtype.kind == "b" else np.round(array.astype(float), 5) + 0.0
        found.append(f"{array.shape} {array.tolist()}")
    return "; ".join(found)


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
