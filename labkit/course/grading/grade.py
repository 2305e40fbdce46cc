"""Grading one submission: each question in a process of its own, on secret cases first.

Cases and expected outputs stay in this process; a worker gets the arguments of one case at a time. Secret cases decide
the points and nothing else: what a student reads about a wrong answer comes from a second run, in another fresh worker,
on the public cases that `check` uses. So nothing that an answer does with secret inputs can reach a student.
"""

import hashlib
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from labkit.course.checker.judge import Problem, parts
from labkit.course.checker.program import Program
from labkit.course.checker.question import PACKAGES
from labkit.course.grading import copies, sandbox
from labkit.course.grading.channel import WorkerLost
from labkit.course.grading.isolated import Run, cases_of
from labkit.course.grading.reading import Lab, Submission
from labkit.course.grading.sandbox import Limits
from labkit.course.topics import of_topic

LOOK_AT = ("ended", "channel")  # kinds of problems that an instructor should look at
ONLY_HIDDEN = (
    "right in the cases of its check, wrong in others: which inputs does the task allow that these do not have?"
)
WRONG_IN_SECRET = "right in the public cases"  # how such answers behave


@dataclass(frozen=True)
class Result:
    """What a question earned. says: what was right or wrong, and hint: why it may be so, from public cases.

    shown: a wrong public case, with what came and what was expected.
    flag: what the instructor should look at, "" if nothing. behaviour: of wrong answers whose hint does not name the
    mistake, the same for those that give the same outputs. program: what was run.
    """

    question: str
    points: float
    max_points: float
    says: str
    hint: str = ""
    flag: str = ""
    behaviour: str = ""
    program: str = ""
    shown: str = ""


def grade_submission(
    lab: Lab, submission: Submission, secret: str, limits: Limits | None = None, unsafe: bool = False
) -> list[Result]:
    """Grade every question of a submission that can be read, in the lab's order.

    secret: what the random cases are drawn from; the same gives the same cases. unsafe: without a sandbox.
    Raises ValueError if no sandbox can be made.
    """
    grading = Grading(lab, submission, secret, limits or Limits(), unsafe)
    return [grading.result(name) for name in lab.answers]


class Grading:
    """The grading of one submission, question by question."""

    def __init__(self, lab: Lab, submission: Submission, secret: str, limits: Limits, unsafe: bool):
        self.lab, self.submission, self.secret, self.limits, self.unsafe = lab, submission, secret, limits, unsafe
        self.questions = of_topic(lab.topic)
        self.results: dict[str, Result] = {}
        self.cuts = dict(zip(lab.answers, self.cut(tuple(lab.answers), {}), strict=True))

    def cut(self, names: Sequence[str], given: dict[str, str]) -> list[tuple[Program, list[str]]]:
        """Cut the programs of some answers out of the notebook, in the sandbox; each with the shapes of its functions.

        given: the kit's answers, in the place of those that are wrong.
        """
        blanks = tuple(self.lab.answers)
        asked = [(name, blanks, PACKAGES, self.questions[name].forbidden, given) for name in names]
        cells = [(cell.source, cell.grade_id) for cell in self.submission.code]
        try:
            with sandbox.fresh_worker(("numpy",), self.limits, self.unsafe) as worker:
                return worker.programs(cells, asked, self.limits.case_s)
        except WorkerLost as lost:
            return [(Program(refused=f"its notebook cannot be read: {lost.problem.says}"), []) for _ in names]

    def result(self, name: str) -> Result:
        """What a question earned; answers that it calls are graded before."""
        if name not in self.results:
            self.results[name] = not_gradable(self.lab, name, "it calls itself through another answer")
            self.results[name] = self.graded(name)
        return self.results[name]

    def graded(self, name: str) -> Result:
        """Judge an answer on the secret cases, and say what is wrong with a wrong one by the public cases."""
        question, worth = self.questions[name], self.lab.points[name]
        if name in self.submission.outdated:
            version = self.submission.outdated[name]
            return not_gradable(self.lab, name, f"this task was another one in the lab that labkit {version} released")
        program, shapes = self.cuts[name]
        wrong = {other: self.questions[other] for other in program.calls if self.result(other).points == 0.0}
        if wrong:
            given = {other: copies.reference_source(callee.reference) for other, callee in wrong.items()}
            ((program, _),) = self.cut((name,), given)
        if program.refused:
            return not_gradable(self.lab, name, program.refused)
        run = Run(question, program, self.limits, self.unsafe)
        hidden, _ = run.judged(cases_of(question, self.secret))
        flags = copies.of_the_kit(shapes, question.reference)
        text = "\n\n".join("\n".join(filter(str.strip, piece.splitlines())) for _, piece in program.pieces)
        if hidden.problem is None:
            says = f"right in all {len(cases_of(question, self.secret))} cases"
            return Result(name, worth, worth, says, flag="; ".join(flags), program=text)
        if hidden.problem.kind in LOOK_AT:
            flags.append(hidden.problem.says)
        public, outputs = run.judged(cases_of(question, None))
        base = Result(name, 0.0, worth, ONLY_HIDDEN, "", "; ".join(flags), WRONG_IN_SECRET, text)
        if public.problem is None:
            return base
        problem = with_line(public.problem, program)
        if problem.kind in ("unanswered", "missing"):
            return replace(base, says=problem.says, behaviour="")
        says = f"{problem.says} ({public.where})"
        shown = "\n".join(public.shown)
        named = public.sentence is not None and public.sentence.names_the_mistake
        return replace(
            base, says=says, hint=public.hint or "", shown=shown, behaviour="" if named else behaviour_of(outputs)
        )


def not_gradable(lab: Lab, name: str, problem: str) -> Result:
    """The result of a question whose answer is not run."""
    return Result(name, 0.0, lab.points[name], problem, flag=problem)


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


def with_line(problem: Problem, program: Program) -> Problem:
    """Say in which of the student's lines an exception was raised, if it is one of them."""
    if not problem.lines:
        return problem
    number, piece = problem.lines[0][0], int(problem.lines[0][1])
    lines = program.pieces[piece][1].splitlines() if piece < len(program.pieces) else []
    if not 1 <= number <= len(lines):
        return replace(problem, lines=())
    line = "".join(c if c.isprintable() else " " for c in lines[number - 1]).strip()
    return replace(problem, says=f"{problem.says} in line {number}: {line[:80]}")
