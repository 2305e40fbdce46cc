"""Grading one submission: each question in processes of its own, on the public cases first, then on secret ones.

Cases and expected outputs stay in this process; a worker gets the arguments of one case at a time. What a student reads
comes from the public cases that `check` uses. An answer that is right in them runs once more, on cases that belong to a
secret and to this notebook alone; if it is wrong there, it earns nothing and its student reads one fixed sentence. So
does one with an output that is right in them, where outputs may count one by one (`changes`). A batch judges everybody
in public before anybody in secret (`batch`), so nothing that an answer does with secret arguments can reach a page.
"""

import hashlib
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from labkit.course.checker.comparison import right_outputs
from labkit.course.checker.diagnosis import found_in_the_program
from labkit.course.checker.judge import Case, Problem, parts
from labkit.course.checker.program import Program
from labkit.course.checker.question import PACKAGES, Question
from labkit.course.grading import copies, sandbox
from labkit.course.grading.channel import Changed, WorkerLost
from labkit.course.grading.isolated import Run, public_cases, secret_cases
from labkit.course.grading.reading import Lab, Submission
from labkit.course.grading.sandbox import Limits
from labkit.course.grading.tell import Told, tellers
from labkit.course.topics import of_topic

LOOK_AT = ("ended", "channel")  # kinds of problems that an instructor should look at
ONLY_HIDDEN = (
    "right in the cases of its check, wrong in others: which inputs does the task allow that these do not have?"
)
WRONG_IN_SECRET = "right in the public cases"  # how such answers behave
NOT_JUDGED = "the grader could not judge it, which your instructor sees"


@dataclass(frozen=True)
class Result:
    """What a question earned, and whether the answer is right.

    says: what was right or wrong, and hint: why it may be so, from public cases. shown: a wrong public case, with what
    came and what was expected. flag: what the instructor should look at, "" if nothing. behaviour: of wrong answers
    whose hint does not name the mistake, the same for those that give the same outputs. program: what was run. parts:
    the named outputs that are right in all cases, which earn nothing unless course.toml says so (`changes`).
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
    right: bool = False
    parts: tuple[str, ...] = ()


class Grading:
    """The grading of one submission that can be read, question by question: all of them in public, then in secret.

    drafts: results of an earlier run on the public cases. unsafe: without a sandbox. An error of the grader's own costs
    the one answer that it judged, which is flagged; failed: whether there was one, so that another try is due.
    """

    def __init__(
        self,
        lab: Lab,
        submission: Submission,
        limits: Limits | None = None,
        unsafe: bool = False,
        drafts: Sequence[Result] = (),
    ):
        self.lab, self.submission, self.limits, self.unsafe = lab, submission, limits or Limits(), unsafe
        self.questions = of_topic(lab.topic)
        self.drafts = {draft.question: draft for draft in drafts}
        self.results: dict[str, Result] = {}
        self.failed = False

    def in_public(self) -> tuple[Result, ...]:
        """The results on the public cases, in the lab's order."""
        return tuple(map(self.draft, self.lab.answers))

    def in_secret(self, secret: str) -> tuple[Result, ...]:
        """The results of all cases, in the lab's order; secret: what the secret cases are drawn from."""
        return tuple(self.result(name, secret) for name in self.lab.answers)

    @cached_property
    def cuts(self) -> dict[str, tuple[Program, list[str]]]:
        """The programs of the answers as they were handed in, and the shapes of their functions."""
        return dict(zip(self.lab.answers, self.cut(tuple(self.lab.answers), {}), strict=True))

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

    def program(self, name: str, is_right: Callable[[str], bool]) -> Program:
        """The program of an answer, with the kit's answers in the place of wrong ones that it calls."""
        program, _ = self.cuts[name]
        given = {
            other: copies.reference_source(self.questions[other].reference)
            for other in program.calls
            if not is_right(other)
        }
        return self.cut((name,), given)[0][0] if given else program

    def draft(self, name: str) -> Result:
        """What a question earns if its answer is right in secret, too; answers that it calls are judged before."""
        if name not in self.drafts:
            self.drafts[name] = not_gradable(self.lab, name, "it calls itself through another answer")
            self.drafts[name] = self.unless_it_fails(name, lambda: self.judged_in_public(name))
        return self.drafts[name]

    def unless_it_fails(self, name: str, judge: Callable[[], Result]) -> Result:
        """The result of a judgement, or a flag that says where the grader failed; what it said may be a stranger's."""
        try:
            return judge()
        except Exception as error:
            self.failed = True
            place = traceback.extract_tb(error.__traceback__)[-1]
            where = f"{type(error).__name__} in {Path(place.filename).name}, line {place.lineno}"
            return replace(not_gradable(self.lab, name, NOT_JUDGED), flag=f"the grader failed: {where}; grade it again")

    def judged_in_public(self, name: str) -> Result:
        """Judge an answer on the public cases, and say what is wrong with a wrong one."""
        question, worth = self.questions[name], self.lab.points[name]
        if name in self.submission.outdated:
            version = self.submission.outdated[name]
            return not_gradable(self.lab, name, f"this task was another one in the lab that labkit {version} released")
        program = self.program(name, lambda other: self.draft(other).right)
        if program.refused:
            return not_gradable(self.lab, name, program.refused)
        run = Run(question, program, self.limits, self.unsafe)
        judged, outputs = run.judged(public_cases(question))
        flags = copies.of_the_kit(self.cuts[name][1], question.reference)
        text = "\n\n".join("\n".join(filter(str.strip, piece.splitlines())) for _, piece in program.pieces)
        result = Result(name, 0.0, worth, "", flag="; ".join(flags), program=text)
        if judged.problem is None:
            says = f"right in all {len(outputs)} cases"
            return replace(result, points=worth, says=says, right=True, parts=question.outputs)
        problem = with_line(judged.problem, program)
        if problem.kind in ("unanswered", "missing"):
            return replace(result, says=problem.says)
        found = tellers.ask(question, outputs)
        flags += [problem.says] if problem.kind in LOOK_AT else []
        if not found.named and problem.kind != "time":
            try:
                found = looked_at(found, run, problem.kind == "altered")
            except Exception as error:  # of what a stranger wrote: it costs this answer a hint
                found = replace(found, failed=f"its program cannot be looked at: {type(error).__name__}")
        flags += [found.failed] if found.failed else []
        return replace(
            result,
            says=f"{problem.says} ({judged.where})",
            hint=found.hint,
            shown=found.shown,
            flag="; ".join(flags),
            behaviour="" if found.named else behaviour_of(outputs),
            parts=() if problem.kind in LOOK_AT else right_parts(question, public_cases(question), outputs),
        )

    def result(self, name: str, secret: str) -> Result:
        """What a question earned: a draft that is right, or has right parts, is judged once more, on secret cases."""
        if name not in self.results:
            self.results[name] = self.draft(name)
            if self.results[name].parts or self.results[name].right:
                self.results[name] = self.unless_it_fails(name, lambda: self.judged_in_secret(name, secret))
        return self.results[name]

    def judged_in_secret(self, name: str, secret: str) -> Result:
        """Judge an answer on the cases of this notebook; of one that is wrong in public only the parts."""
        question, draft = self.questions[name], self.draft(name)
        program = self.program(name, lambda other: self.result(other, secret).right)
        if program.refused:
            return not_gradable(self.lab, name, program.refused) if draft.right else replace(draft, parts=())
        cases = secret_cases(question, secret, self.submission.digest)
        judged, outputs = Run(question, program, self.limits, self.unsafe).judged(cases)
        if judged.problem is not None:
            still = () if judged.problem.kind in LOOK_AT else right_parts(question, cases, outputs)
            draft = replace(draft, parts=tuple(part for part in draft.parts if part in still))
        if not draft.right:
            return draft
        if judged.problem is None:
            return replace(draft, says=f"right in all {len(public_cases(question)) + len(cases)} cases")
        flags = [draft.flag, judged.problem.says if judged.problem.kind in LOOK_AT else ""]
        flag = "; ".join(filter(None, flags))
        return replace(draft, points=0.0, right=False, says=ONLY_HIDDEN, flag=flag, behaviour=WRONG_IN_SECRET)


def looked_at(found: Told, run: Run, values_are_right: bool) -> Told:
    """What to tell when the answer's program has been looked at, too: its line and a question, if there is a place."""
    pieces = run.program.pieces
    sentence = next(found_in_the_program(pieces, run.findings(), values_are_right), None)
    if sentence is None:
        return found
    lines = [line for marked in sentence.marked for line in marked.plain()]
    return replace(found, hint=sentence.says, named=True, shown="\n".join([found.shown, *lines]).strip("\n"))


def right_parts(question: Question, cases: Sequence[Case], outputs: Sequence[object]) -> tuple[str, ...]:
    """The named outputs that are right in all cases; none of an answer that changes its arguments."""
    if not question.outputs or any(isinstance(output, Changed) for output in outputs):
        return ()
    right = [right_outputs(question, case.expected, got) for case, got in zip(cases, outputs, strict=True)]
    return tuple(name for i, name in enumerate(question.outputs) if all(row[i] for row in right))


def not_gradable(lab: Lab, name: str, problem: str) -> Result:
    """The result of a question whose answer is not run."""
    return Result(name, 0.0, lab.points[name], problem, flag=problem)


# ---------------------------------------------------------------------------------------------- in words


def behaviour_of(outputs: Sequence[object]) -> str:
    """A short name for wrong outputs on the public cases: the same for answers that give the same, up to rounding."""
    text = "\n".join(repr(output) if isinstance(output, Problem) else told(output) for output in outputs)
    return hashlib.sha256(text.encode()).hexdigest()[:8]


def told(output: object) -> str:
    """Kind, shape and rounded values of an output."""
    if isinstance(output, Changed):
        return f"changes argument {output.position}: {told(output.value)}"
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
