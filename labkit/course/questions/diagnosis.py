"""What is said about a wrong answer: the most specific sentence that is true of it.

Students make more mistakes than authors foresee, so mistakes are recognised by what they do. `sentences` asks in this
order: which listed misconception gives these outputs, what an exception means in this task, which relation holds
between what was expected and what came, which change of the arguments explains it, which slip of the hand, and where it
is wrong.
"""

import copy
import functools
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from labkit.course.questions.by_number import NUMBERS
from labkit.course.questions.comparison import Case, Problem, alike, parts, trusted
from labkit.course.questions.errors import explain
from labkit.course.questions.inputs import changes
from labkit.course.questions.places import places
from labkit.course.questions.question import Misconception, Property, Question
from labkit.course.questions.relations import ARRANGED, COMBINED, View
from labkit.course.questions.slips import Slip, slips

LONGEST_S = 1.0  # no further sentence is looked for after that


@dataclass(frozen=True)
class Sentence:
    """Something true of a wrong answer. kind: "misconception", "exception", "relation", "input",

    "property", "slip" or "place"."""

    kind: str
    says: str


def diagnose(question: Question, cases: Sequence[Case], outputs: Sequence[object]) -> Sentence | None:
    """The most specific sentence about outputs that are wrong in some case, None if there is none."""
    return next(sentences(question, cases, outputs), None)


def sentences(question: Question, cases: Sequence[Case], outputs: Sequence[object]) -> Iterator[Sentence]:
    """All sentences that are true of wrong outputs, the most specific first."""
    end = time.monotonic() + LONGEST_S
    if misconception := recognise(question, cases, outputs):
        yield Sentence("misconception", misconception.hint)
    yield from explained(question, cases, outputs)
    views = list(views_of(question, cases, outputs))
    for name, view in views:
        yield from (Sentence("relation", name + says) for says in related(view))
    yield from tuple_in_another_order(question, cases, outputs)
    for says in changed_inputs(question, cases, outputs, end):
        yield Sentence("input", says)
    for name, view in views:
        yield from local(name, view)
    yield from broken_properties(question, cases, outputs)
    for says in slipped(question, cases, outputs, end):
        yield Sentence("slip", says)
    for name, view in views:
        yield from (Sentence("place", f"{name}It is wrong only {where}.") for where, _ in places(view))


# ------------------------------------------------------------------------------------------ misconceptions


def recognise(question: Question, cases: Sequence[Case], outputs: Sequence[object]) -> Misconception | None:
    """Find the misconception that gives these outputs in every case that tells it from a right answer."""
    if all(isinstance(got, Problem) for got in outputs):
        return None
    for misconception in question.misconceptions:
        told = False
        for case, got in zip(cases, outputs, strict=True):
            own = output_of(misconception, case.args)
            if alike(question, own, got):
                told = told or not alike(question, own, case.expected)
            elif not (isinstance(got, Problem) and alike(question, own, case.expected)):
                break
        else:
            if told:
                return misconception
    return None


def output_of(misconception: Misconception, args: tuple) -> object:
    """What a misconception gives, or a Problem where it raises."""
    try:
        return trusted(misconception.answer, args)
    except Exception as error:
        return Problem("exception", type(error).__name__)


# ------------------------------------------------------------------------------------------------ exceptions


def explained(question: Question, cases: Sequence[Case], outputs: Sequence[object]) -> Iterator[Sentence]:
    """What the first exception means in this task."""
    for case, got in zip(cases, outputs, strict=True):
        if isinstance(got, Problem) and got.kind == "exception":
            args = dict(zip(question.parameters, case.args, strict=True))
            if said := explain(got.says, args):
                yield Sentence("exception", said)
            return


# ------------------------------------------------------------------------------------------------- relations


def views_of(question: Question, cases: Sequence[Case], outputs: Sequence[object]) -> Iterator[tuple[str, View]]:
    """A view of each output that is wrong in some case, with words that name it; cases without output are left out."""
    pairs = [(case, got) for case, got in zip(cases, outputs, strict=True) if not isinstance(got, Problem)]
    counts = {len(parts(case.expected)) for case, _ in pairs} | {len(parts(got)) for _, got in pairs}
    if not pairs or len(counts) != 1:
        return
    (count,) = counts
    for k in range(count):
        expected = tuple(np.asarray(parts(case.expected)[k]) for case, _ in pairs)
        got = tuple(np.asarray(parts(got)[k]) for _, got in pairs)
        args = tuple(case.args for case, _ in pairs)
        view = View(expected, got, args, question.parameters, question.rtol, question.atol)
        if not all(view.same(e, g) for e, g in zip(expected, got, strict=True)):
            yield f"Output {k + 1} of {count}: " if count > 1 else "", view


def related(view: View) -> Iterator[str]:
    """The relations that hold everywhere."""
    for relation in (*ARRANGED, *NUMBERS, *COMBINED):
        if said := relation(view):
            yield said


def local(name: str, view: View) -> Iterator[Sentence]:
    """The relations that hold at some places outside of which all is right."""
    for where, masks in places(view):
        narrow = view.at(masks)
        for relation in NUMBERS:
            if said := relation(narrow):
                yield Sentence("relation", f"{name}It is wrong only {where}. {said}")


def tuple_in_another_order(question: Question, cases: Sequence[Case], outputs: Sequence[object]) -> Iterator[Sentence]:
    """Two outputs exchanged."""
    got = [output for output in outputs if isinstance(output, tuple)]
    count = len(parts(cases[0].expected))
    if len(got) < len(outputs) or any(len(output) != count for output in got):
        return
    for i in range(count):
        for j in range(i):
            order = list(range(count))
            order[i], order[j] = j, i
            turned = [tuple(parts(case.expected)[k] for k in order) for case in cases]
            if all(alike(question, a, b) for a, b in zip(turned, got, strict=True)):
                yield Sentence("relation", f"Outputs {j + 1} and {i + 1} are exchanged.")


# ------------------------------------------------------------------------------------------- changed arguments


def changed_inputs(question: Question, cases: Sequence[Case], outputs: Sequence[object], end: float) -> Iterator[str]:
    """The changes of the arguments with which a right answer gives these outputs."""
    pairs = with_outputs(question, cases, outputs)
    for says, change in changes(question, cases[0].args) if pairs else ():
        if time.monotonic() > end:
            return
        if explains(question, pairs, lambda args, change=change: question.reference(*change(args))):
            yield says


def with_outputs(question: Question, cases: Sequence[Case], outputs: Sequence[object]) -> list[tuple[Case, object]]:
    """The cases that have an output, the wrong ones first: they decide soonest."""
    pairs = [(case, got) for case, got in zip(cases, outputs, strict=True) if not isinstance(got, Problem)]
    return sorted(pairs, key=lambda pair: alike(question, pair[0].expected, pair[1]))


def explains(question: Question, pairs: Sequence[tuple[Case, object]], function: Callable) -> bool:
    """Whether a function of the arguments gives the outputs (where it fails, the right ones), some of them wrong."""
    shown = 0
    for case, got in pairs:
        new = attempted(function, case.args)
        if not alike(question, case.expected if new is None else new, got):
            return False
        shown += new is not None and not alike(question, new, case.expected)
    return shown > 0


def attempted(function: Callable, args: tuple) -> object | None:
    """What a function gives for arguments, as `plain` has it; None if it fails."""
    try:
        output = trusted(lambda *given: function(given), args)
    except Exception:  # the reference may fail on changed arguments
        return None
    return None if isinstance(output, Problem) else output


def broken_properties(question: Question, cases: Sequence[Case], outputs: Sequence[object]) -> Iterator[Sentence]:
    """The properties of right answers that a wrong one does not have."""
    pairs = [(case, got) for case, got in with_outputs(question, cases, outputs)]
    for prop in question.properties:
        for case, got in pairs:
            if not fulfilled(prop, case, got):
                yield Sentence("property", f"It should hold, but does not: {prop.says}.")
                break


def fulfilled(prop: Property, case: Case, got: object) -> bool:
    """Whether a property holds; one that cannot even be computed counts as held."""
    try:
        with np.errstate(all="ignore"):
            return bool(prop.holds(copy.deepcopy(case.args), copy.deepcopy(got)))
    except Exception:
        return True


# ------------------------------------------------------------------------------------------------------ slips


def slipped(question: Question, cases: Sequence[Case], outputs: Sequence[object], end: float) -> Iterator[str]:
    """The slips in the reference that give these outputs."""
    pairs = with_outputs(question, cases, outputs)
    for slip in slips_of(question.reference) if pairs else ():
        if time.monotonic() > end:
            return
        if explains(question, pairs, lambda args, slip=slip: slip.function(*args)):
            yield str(slip)


@functools.cache
def slips_of(reference: Callable) -> list[Slip]:
    """The slips of a reference, compiled once; none if it has no source of its own."""
    try:
        return slips(reference)
    except (OSError, SyntaxError, ValueError):
        return []
