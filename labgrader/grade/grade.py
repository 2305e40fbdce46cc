"""Grading one submission: each question in processes of its own, on the public cases first, then on secret ones.

Cases and expected outputs stay in this process; a worker gets the arguments of one case at a time. What a student reads
comes from the public cases that `check` uses. An answer that is right in them runs once more, on cases that belong to a
secret and to this student alone, the same ones after each resubmission of a round; if it is wrong there, it earns
nothing and its student reads one fixed sentence. So does one with an output that is right in them, where outputs may
count one by one (`changes`). A batch judges everybody in public before anybody in secret (`batch`), so nothing that an
answer does with secret arguments can reach a page of that batch. The filter of system calls (`seccomp`) refuses what
would outlive it, as far as we know of it, and what was read is forgotten between batches (`sandbox.forget_pages`). One
thing is left that we know of: names of files that an answer looked for and did not find stay in the kernel's cache,
where an answer of a later batch, or of late work, can tell by the time which ones were asked for. With many of them it
can say of secret arguments on a public page what they were, or answer them from a table; `--new-round` draws others.
"""

import hashlib
import traceback
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from labgrader.comparison import Case, Problem, expected_cases, parts, right_outputs
from labgrader.course import course, of_topic
from labgrader.grade import copied_code
from labgrader.grade.diagnose_outputs import Diagnosis, diagnosers
from labgrader.handin.reading import Lab, Submission
from labgrader.program.slice import NO_CELL, Program
from labgrader.question import Question
from labgrader.reply.judge import Verdict
from labgrader.run.channel import Changed, WorkerLost
from labgrader.run.run import Budget, Limits, Run, public_cases, reference_lock
from labgrader.sandbox import sandbox

LOOK_AT = ("ended", "channel")  # kinds of problems that an instructor should look at
ONLY_HIDDEN = (
    "right in the cases of its check, wrong in others: which inputs does the task allow that these do not have?"
)
WRONG_IN_SECRET = "right in the public cases"  # how such answers behave
NOT_PYTHON = "its cell is not Python"  # as `program.cell` says it
NOT_JUDGED = "the grader could not judge it, which your instructor sees"


@dataclass(frozen=True)
class Result:
    """What a question earned, and what is told about it.

    says: what was right or wrong; hint: why it may be so; shown: a wrong public case and the marked line. A student
    reads these three, which come from public cases alone. flag: what the instructor should look at, "" if nothing.
    kind: of problem, "" for a right answer: "refused" and "syntax" were not run, others are those of `Problem`.
    behaviour: a name for wrong outputs whose mistake no hint names: the same outputs, the same name. program: what was
    run; late: whether that is `Program.late`. parts: the named outputs that are right in all cases; they earn nothing
    unless a change says so (`changes`). note: which of several cells was graded, for student and instructor.
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
    kind: str = ""
    parts: tuple[str, ...] = ()
    late: bool = False
    note: str = ""


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
        self.failed, self.budget = False, Budget(self.limits)

    def in_public(self) -> tuple[Result, ...]:
        """The results on the public cases, in the lab's order."""
        self.budget = Budget(self.limits)
        return tuple(map(self.draft, self.lab.answers))

    def in_secret(self, secret: str) -> tuple[Result, ...]:
        """The results of all cases, in the lab's order; secret: what the secret cases are drawn from."""
        self.budget = Budget(self.limits)
        return tuple(self.result(name, secret) for name in self.lab.answers)

    def start(self, packages: Sequence[str], limits: Limits) -> AbstractContextManager:
        """A fresh worker, in the sandbox if there is to be one."""
        return sandbox.fresh_worker(packages, limits, self.unsafe)

    @cached_property
    def cuts(self) -> dict[str, tuple[Program, list[str]]]:
        """The programs of the answers as they were handed in, and the fingerprints of their functions."""
        return dict(zip(self.lab.answers, self.cut(tuple(self.lab.answers), {}), strict=True))

    def cut(self, names: Sequence[str], given: dict[str, str]) -> list[tuple[Program, list[str]]]:
        """Cut the programs of some answers out of the notebook, in the sandbox; each with its functions' fingerprints.

        given: the kit's answers, in the place of those that are wrong.
        """
        blanks, here = tuple(self.lab.answers), course()
        asked = [(name, blanks, here.packages, self.questions[name].forbidden, here.kit, given) for name in names]
        cells = [(cell.source, cell.grade_id) for cell in self.submission.code]
        try:
            with self.start(("numpy",), self.limits) as worker:
                return worker.programs(cells, asked, self.limits.case_s)
        except WorkerLost as lost:
            why = "that takes too long" if lost.problem.kind == "time" else lost.problem.says
            return [(Program(refused=f"its notebook cannot be read: {why}"), []) for _ in names]

    def program(self, name: str, is_right: Callable[[str], bool]) -> Program:
        """The program of an answer, with the kit's answers in the place of wrong ones that it calls."""
        program, _ = self.cuts[name]
        given = {other: self.questions[other].source for other in program.calls if not is_right(other)}
        return self.cut((name,), given)[0][0] if given else program

    def draft(self, name: str) -> Result:
        """What a question earns if its answer is right in secret, too; answers that it calls are judged before."""
        if name not in self.drafts:
            self.drafts[name] = not_gradable(self.lab, name, "it calls itself through another answer")
            self.drafts[name] = self.unless_it_fails(name, lambda: self.judged_in_public(name))
            self.drafts[name] = replace(self.drafts[name], note=self.note(name))
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

    def note(self, name: str) -> str:
        """Which of several cells with an answer's grade id was graded, "" if there is one alone."""
        return self.cuts[name][0].note if "cuts" in self.__dict__ else ""

    def judged_in_public(self, name: str) -> Result:
        """Judge an answer on the public cases, and say what is wrong with a wrong one."""
        question, worth = self.questions[name], self.lab.points[name]
        if name in self.submission.outdated:
            version = self.submission.outdated[name]
            released = f"{course().command} {version} released"
            return not_gradable(self.lab, name, f"this task was another one in the lab that {released}")
        program = self.program(name, lambda other: self.draft(other).right)
        if program.refused and program.late is None:
            is_absent = program.refused.startswith(NO_CELL)
            why = self.submission.no_code.get(name, program.refused) if is_absent else program.refused
            refused = not_gradable(self.lab, name, why)
            return replace(refused, program=self.submission.cells.get(name, ""))
        flags = copied_code.of_the_kit(self.cuts[name][1], question)
        flags += self.of_later_tasks(name, lambda other: self.draft(other).right)
        first, late = program, program.late
        program = late if first.refused else first
        result = Result(name, 0.0, worth, "", flag="; ".join(flags), program=text_of(program), late=program is late)
        with Run(question, program, self.start, self.limits, self.budget) as answer:
            verdict, outputs = answer.judge(public_cases(question))
            says = f"right in all {len(outputs)} cases"
            right = replace(result, points=worth, says=says, right=True, parts=question.outputs)
            if verdict.problem is None:
                return right
            if late is not None and program is first and self.is_right(question, late):
                return replace(right, program=text_of(late), late=True)
            problem = verdict.problem
            if problem.kind in ("unanswered", "missing"):
                return replace(result, says=problem.says, kind=problem.kind)
            found = explained(answer, verdict)
        flags += [problem.says] if problem.kind in LOOK_AT else []
        flags += [found.failed] if found.failed else []
        return replace(
            result,
            says=f"{in_a_sentence(problem)} ({verdict.where})",
            kind=problem.kind,
            hint=found.hint,
            shown=found.shown,
            flag="; ".join(flags),
            behaviour="" if found.named else behaviour_of(outputs),
            parts=() if problem.kind in LOOK_AT else right_parts(question, public_cases(question), outputs),
        )

    def of_later_tasks(self, name: str, is_right: Callable[[str], bool]) -> list[str]:
        """Flags that name later tasks which an answer calls and has from the kit, since the student's own is wrong.

        A later answer may hold an earlier one: mean IoU of one class alone is its IoU.
        """
        order = list(self.lab.answers)
        below = [other for other in self.cuts[name][0].calls if order.index(other) > order.index(name)]
        wrong = [other for other in below if not is_right(other)]
        return [f"uses the kit's {other}, a later task, of which its own is wrong" for other in wrong]

    def is_right(self, question: Question, program: Program) -> bool:
        """Whether a program is right in the public cases."""
        with Run(question, program, self.start, self.limits, self.budget) as answer:
            return answer.judge(public_cases(question))[0].problem is None

    def result(self, name: str, secret: str) -> Result:
        """What a question earned: a draft that is right, or has right parts, is judged once more, on secret cases."""
        if name not in self.results:
            self.results[name] = self.draft(name)
            if self.results[name].parts or self.results[name].right:
                self.results[name] = self.unless_it_fails(name, lambda: self.judged_in_secret(name, secret))
        return self.results[name]

    def judged_in_secret(self, name: str, secret: str) -> Result:
        """Judge an answer on its student's cases; of one that is wrong in public only the parts."""
        question, draft = self.questions[name], self.draft(name)

        def is_right(other: str) -> bool:
            return self.result(other, secret).right

        program = self.program(name, is_right)
        kits = [flag for flag in self.of_later_tasks(name, is_right) if flag not in draft.flag]
        draft = replace(draft, flag="; ".join(filter(None, [draft.flag, *kits])))
        program = program.late if draft.late and program.late is not None else program
        if program.refused:
            return not_gradable(self.lab, name, program.refused) if draft.right else replace(draft, parts=())
        cases = secret_cases(question, secret, self.submission.student)
        with Run(question, program, self.start, self.limits, self.budget) as answer:
            verdict, outputs = answer.judge(cases)
        if verdict.problem is not None:
            still = () if verdict.problem.kind in LOOK_AT else right_parts(question, cases, outputs)
            draft = replace(draft, parts=tuple(part for part in draft.parts if part in still))
        if not draft.right:
            return draft
        if verdict.problem is None:
            return replace(draft, says=f"right in all {len(public_cases(question)) + len(cases)} cases")
        flags = [draft.flag, verdict.problem.says if verdict.problem.kind in LOOK_AT else ""]
        flag = "; ".join(filter(None, flags))
        wrong = replace(draft, points=0.0, right=False, kind=verdict.problem.kind)
        return replace(wrong, says=ONLY_HIDDEN, flag=flag, behaviour=WRONG_IN_SECRET)

    def replies(self, name: str, secret: str) -> list[tuple[Case, object]]:
        """All cases of an answer, the public ones first, with what it replies; none of one that is not run."""
        question, program = self.questions[name], self.program(name, lambda other: self.result(other, secret).right)
        program = program.late if self.result(name, secret).late and program.late is not None else program
        if program.refused:
            return []
        cases = (*public_cases(question), *secret_cases(question, secret, self.submission.student))
        with Run(question, program, self.start, self.limits, Budget(self.limits)) as answer:
            return list(zip(cases, answer.outputs(cases), strict=True))


def secret_cases(question: Question, secret: str, student: str) -> tuple[Case, ...]:
    """The random cases that decide about the answers of one student in a round; nobody else gets them.

    secret: of the round of grading. They are twice as many as the public ones, since those by hand are not among them.
    """
    seed = int.from_bytes(hashlib.sha256(f"{secret}\0{question.name}\0{student}".encode()).digest(), "little")
    with reference_lock:
        cases = expected_cases(replace(question, by_hand=(), edges=0, random_cases=2 * question.random_cases), seed)
    return tuple(cases)


def explained(answer: Run, verdict: Verdict) -> Diagnosis:
    """What to tell about a wrong answer, as its check tells it: its program is looked at where that is needed."""
    asked = answer.question, verdict.outputs, answer.program.pieces
    found = diagnosers.ask(*asked)
    if not found.needs_a_look:
        return found
    try:
        findings, failed = answer.findings(verdict.case or 0), ""
    except Exception as error:  # of what a stranger wrote: it costs this answer a hint
        findings, failed = [], f"its program cannot be looked at: {type(error).__name__}"
    found = diagnosers.ask(*asked, findings)
    return replace(found, failed=failed or found.failed)


def right_parts(question: Question, cases: Sequence[Case], outputs: Sequence[object]) -> tuple[str, ...]:
    """The named outputs that are right in all cases; none of an answer that changes its arguments."""
    if not question.outputs or any(isinstance(output, Changed) for output in outputs):
        return ()
    right = [right_outputs(question, case.expected, got) for case, got in zip(cases, outputs, strict=True)]
    return tuple(name for i, name in enumerate(question.outputs) if all(row[i] for row in right))


def not_gradable(lab: Lab, name: str, problem: str) -> Result:
    """The result of a question whose answer is not run."""
    kind = "syntax" if problem.startswith(NOT_PYTHON) else "refused"
    return Result(name, 0.0, lab.points[name], problem, flag=problem, kind=kind)


# ---------------------------------------------------------------------------------------------- in words


def behaviour_of(outputs: Sequence[object]) -> str:
    """A short name for wrong outputs on the public cases: the same for answers that give the same, up to rounding."""
    text = "\n".join(outputs_as_text(output) for output in outputs)
    return hashlib.sha256(text.encode()).hexdigest()[:8]


def outputs_as_text(output: object) -> str:
    """Kind, shape and rounded values of an output; of a Problem all but the student's line."""
    if isinstance(output, Problem):
        return f"{output.kind}: {output.says}"
    if isinstance(output, Changed):
        return f"changes argument {output.positions[0]}: {outputs_as_text(output.value)}"
    found = []
    for part in parts(output):
        array = np.asarray(part)
        with suppress(TypeError), np.errstate(all="ignore"):
            array = array if array.dtype.kind == "b" else np.round(array.astype(float), 5) + 0.0
        found.append(f"{array.shape} {array.tolist()}")
    return "; ".join(found)


def text_of(program: Program) -> str:
    """A program as an instructor reads it, without blank lines."""
    return "\n\n".join("\n".join(filter(str.strip, piece.splitlines())) for _, piece in program.pieces)


def in_a_sentence(problem: Problem) -> str:
    """A problem as pages say it: an exception with the student's line that raised it, if it is one of them."""
    if problem.kind != "exception":
        return problem.says
    where = ""
    for number, text in problem.lines:
        line = "".join(c if c.isprintable() else " " for c in text).strip()
        where = f" in line {number}: {line[:80]}"
    return f"it raises {problem.says}{where}"
