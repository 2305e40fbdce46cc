"""The verdict on an answer: from the outputs of all cases, however they were computed, to words for its student.

    cases = expected_cases(question, seed)     keep them where no answer can see them
    verdict(question, cases, outputs)          outputs by any way: values for `as_numpy`, or Problems in their place

A student's answer runs in a worker (`labgrader.run.run`), and a Problem stands where no value came back. `judge`
calls a function that is trusted in this process: that of a question's author.
"""

import copy
import linecache
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

from labgrader.comparison import (
    UNTRIED,
    Case,
    Problem,
    as_numpy,
    compare,
    expected_cases,
    is_large,
    quiet,
    told_first,
)
from labgrader.program.live import altered, own_entry
from labgrader.question import Question
from labgrader.reply.finding import Finding
from labgrader.reply.messages import shown_case
from labgrader.reply.sentences import Sentence, at_once, diagnose


@dataclass(frozen=True)
class Verdict:
    """The result of all cases of a question.

    problem: None if the answer passes; case: the number of the case that has it, from 0, and `where` says it in words.
    question: None where no case was judged, and there is no hint. notes: what else is wrong, arguments that it changes.
    cases, outputs: what it was made of; UNTRIED for a large case beside a usual one that is wrong. pieces: the
    program, and findings: what instruments and repair know about it, once somebody has looked.
    """

    problem: Problem | None
    case: int | None
    where: str
    question: Question | None = None
    notes: tuple[str, ...] = ()
    cases: Sequence[Case] = ()
    outputs: Sequence[object] = ()
    pieces: Sequence[tuple[str, str]] = ()
    findings: Sequence[Finding] = ()

    @property
    def passed(self) -> bool:
        """Whether every case is right."""
        return self.problem is None

    @cached_property
    def sentence(self) -> Sentence | None:
        """The surest thing that is true of a wrong answer; looked for when it is asked for."""
        if self.problem is None or self.question is None or self.problem.kind == "unanswered":
            return None
        return diagnose(self.question, *self.tried, self.pieces, self.findings)

    @property
    def needs_a_look(self) -> bool:
        """Whether a wrong answer runs, and no sentence names its mistake without a look at its program."""
        if self.problem is None or self.question is None or self.problem.kind in ("unanswered", "time"):
            return False
        return at_once(self.question, *self.tried) is None

    @property
    def tried(self) -> tuple[list[Case], list[object]]:
        """The cases that were tried, and their outputs."""
        pairs = [(case, got) for case, got in zip(self.cases, self.outputs, strict=True) if not is_untried(got)]
        return [case for case, _ in pairs], [got for _, got in pairs]

    @property
    def hint(self) -> str | None:
        """What `sentence` says, None if there is none."""
        return self.sentence.says if self.sentence else None

    @cached_property
    def shown(self) -> tuple[str, ...]:
        """Lines that show the call of the case, and what came and what was expected where they first differ."""
        if self.problem is None or self.question is None or self.case is None:
            return ()
        return shown_case(self.question, self.cases[self.case], self.outputs[self.case])


def verdict(
    question: Question, cases: Sequence[Case], outputs: Sequence[object], altered: frozenset[int] = frozenset()
) -> Verdict:
    """Compare the outputs of all cases, and find what should be told first.

    altered: positions of the arguments that the answer altered: then it is not right, since its caller needs them.
    """
    problems, outputs = told_apart(question, cases, outputs)
    changed = tuple(f"it changes its argument {question.parameters[i]}: work on a copy" for i in sorted(altered))
    first = told_first(cases, [problem is not None for problem in problems])
    if first is None:
        problem = Problem("altered", f"{changed[0]}; what calls it still needs the old values") if changed else None
        return Verdict(problem, None, "all cases" if changed else "", question, (), cases, outputs)
    alike = [i for i, case in enumerate(cases) if case.by_hand == cases[first].by_hand]
    where = f"{'hand-made' if cases[first].by_hand else 'random'} case {alike.index(first) + 1} of {len(alike)}"
    return Verdict(problems[first], first, where, question, changed, cases, outputs)


def is_untried(output: object) -> bool:
    """Whether it is UNTRIED, perhaps out of another process."""
    return isinstance(output, Problem) and output.kind == UNTRIED.kind


def told_apart(
    question: Question, cases: Sequence[Case], outputs: Sequence[object]
) -> tuple[list[Problem | None], list[object]]:
    """The problem of each output, None where it is right, and the outputs; UNTRIED where one tells no more."""
    problems, told, enough = [], [], False
    for case, got in zip(cases, outputs, strict=True):
        if is_untried(got) or (enough and is_large(case)):
            problems.append(None)
            told.append(UNTRIED)
            continue
        problems.append(got if isinstance(got, Problem) else compare(question, case.expected, got))
        told.append(got)
        enough = enough or (case.is_usual and problems[-1] is not None)
    return problems, told


# ------------------------------------------------------------------------------------------ a trusted function


def judge(question: Question, answer: Callable, seed: int) -> Verdict:
    """Call a trusted answer on the cases that belong to a seed, here, and tell the first problem, if there is one.

    >>> double = Question(name="0.double", reference=lambda x: 2 * x, inputs=lambda rng: (rng.random(3),))
    >>> judge(double, lambda x: x + x, seed=0).passed
    True
    >>> judge(double, lambda x: (2 * x)[:, None], seed=0).problem.says
    'expected shape (3,), got (3, 1)'
    """
    cases = expected_cases(question, seed)
    return verdict(question, cases, *outputs_of(answer, [case.args for case in cases]))


def outputs_of(answer: Callable, arguments: Sequence[tuple]) -> tuple[list, frozenset[int]]:
    """Call a trusted answer on copies of each tuple of arguments.

    Returns for each what `as_numpy` makes of its output, or a Problem with its exception; and the positions of the
    arguments that it altered.
    """
    outputs, changed = [], set()
    for args in arguments:
        given = copy.deepcopy(args)
        outputs.append(output_of(answer, given))
        changed |= {*altered(args, given)}
    return outputs, frozenset(changed)


def output_of(answer: Callable, args: tuple) -> object:
    """`as_numpy` of an output, or a Problem with the exception and the line of the answer that led to it."""
    try:
        with quiet():
            return as_numpy(answer(*args))
    except Exception as error:
        code = getattr(answer, "__code__", None)
        entry, last = own_entry(error.__traceback__, () if code is None else (code.co_filename,))
        if isinstance(error, NotImplementedError) and last:
            return Problem("unanswered", "not answered yet")
        line = (entry.tb_lineno, linecache.getline(code.co_filename, entry.tb_lineno).strip()) if entry else None
        return Problem("exception", f"{type(error).__name__}: {error}", (line,) if line else ())
