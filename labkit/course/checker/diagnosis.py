"""What is said about a wrong answer: the most specific sentence that is true of it.

Students make more mistakes than authors foresee, so mistakes are recognised by what they do. `sentences` asks in this
order: which listed misconception gives these outputs, what an exception means in this task, which relation holds
between what was expected and what came, which change of the arguments explains it, which slip of the hand, and where it
is wrong.
"""

import copy
import functools
import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from labkit.course.checker import forms, made_of  # noqa: F401  they enter their relations
from labkit.course.checker.by_number import DIRECTIONS, NUMBERS, values_taken_for_others
from labkit.course.checker.comparison import Case, Problem, alike, parts, plain, quiet, trusted
from labkit.course.checker.errors import explain
from labkit.course.checker.inputs import changes
from labkit.course.checker.places import places
from labkit.course.checker.question import Misconception, Property, Question
from labkit.course.checker.relations import ARRANGED, COMBINED, LOOSE, Relation, View, attempt
from labkit.course.checker.slips import Slip, slips
from labkit.course.checker.steps import changed_steps, steps

MOST_TRIES = 8000  # functions that are tried for one answer: a number, so that all machines say the same
ENDLESS = "A loop does not end, or has far too many turns: what changes in each turn, and when does `while` stop?"


@dataclass(frozen=True)
class Sentence:
    """Something true of a wrong answer.

    kind: "misconception", "exception", "relation", "input", "step" or "slip" name a mistake; "loose", "property" and
    "place" are true of more mistakes than one.
    """

    kind: str
    says: str


def diagnose(question: Question, cases: Sequence[Case], outputs: Sequence[object]) -> Sentence | None:
    """The most specific sentence about outputs that are wrong in some case, None if there is none."""
    return next(sentences(question, cases, outputs), None)


def sentences(question: Question, cases: Sequence[Case], outputs: Sequence[object]) -> Iterator[Sentence]:
    """All sentences that are true of wrong outputs, the most specific first."""
    if misconception := recognise(question, cases, outputs):
        yield Sentence("misconception", misconception.hint)
    nothing = [isinstance(got, Problem) and "returns None" in got.says for got in outputs]
    if any(nothing):
        words = ("In some cases no `return` is reached", "It never reaches a `return` with a value")[all(nothing)]
        yield Sentence("exception", f"{words}: where does it stand, and is it in a branch or a loop?")
    yield from explained(question, cases, outputs)
    yield from tuple_in_another_order(question, cases, outputs)
    views = list(views_of(question, cases, outputs))
    for name, view in views:
        yield from related(name, view, (*ARRANGED, *NUMBERS, *COMBINED))
    yield from another_form(question, cases, outputs)
    tried = Tried(question, cases, outputs)
    yield from (sentence for sentence, function in of_inputs(question, cases[0].args) if tried.explains(function))
    for name, view in views:
        yield from local(name, view)
    yield from (sentence for sentence, function in of_answers(question, tried.args) if tried.explains(function))
    for name, view in views:
        yield from related(name, view, LOOSE, "loose")
    yield from broken_properties(question, cases, outputs)
    for name, view in views:
        yield from directed(name, view)
    for name, view in views:
        yield from (Sentence("place", f"{name}It is wrong only {where}.") for where in narrow_places(view))


# ------------------------------------------------------------------------------------------ misconceptions


def recognise(question: Question, cases: Sequence[Case], outputs: Sequence[object]) -> Misconception | None:
    """Find the misconception that gives these outputs in every case that tells it from a right answer."""
    if all(isinstance(got, Problem) for got in outputs):
        return None
    for misconception in question.misconceptions:
        told, stray = [], False  # told: of each case that tells it from a right answer, whether there is an output
        for case, got in zip(cases, outputs, strict=True):
            own = output_of(misconception, case.args)
            if alike(question, own, got):
                if not alike(question, own, case.expected):
                    told.append(not isinstance(got, Problem))
            elif isinstance(got, Problem) and alike(question, own, case.expected):
                stray = True
            else:
                break
        else:
            if any(told) or (told and not stray):  # exceptions here and there may be of any mistake
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
    """What the first exception means in this task, and in which cases there is one; or that it does not end."""
    if any(isinstance(got, Problem) and got.kind == "time" for got in outputs):
        yield Sentence("exception", ENDLESS)
    raised = [isinstance(got, Problem) and got.kind == "exception" for got in outputs]
    if not any(raised):
        return
    first = raised.index(True)
    says = explain(
        outputs[first].says.removeprefix("it raises "), dict(zip(question.parameters, cases[first].args, strict=True))
    )
    failed = tuple(np.array(float(r)) for r in raised)
    args = tuple(case.args for case in cases)
    view = View(tuple(np.array(0.0) for _ in cases), failed, args, question.parameters, 0.0, 0.0)
    marks = ("is 255 somewhere", "is NaN somewhere")  # others are true of some cases by accident
    known = ((where, masks) for where, masks in places(view) if where.startswith("in cases") and where.endswith(marks))
    where = next((where for where, masks in known if masks == raised), "")  # there in every case
    if says and where:
        yield Sentence("exception", f"{says} It fails only {where}.")
    if says:
        yield Sentence("exception", says)


# ------------------------------------------------------------------------------------------------- relations


def views_of(question: Question, cases: Sequence[Case], outputs: Sequence[object]) -> Iterator[tuple[str, View]]:
    """A view of each output that is wrong in some case, with words that name it; cases without output are left out."""
    pairs = [(case, got) for case, got in zip(cases, outputs, strict=True) if not isinstance(got, Problem)]
    counts = {len(parts(case.expected)) for case, _ in pairs} | {len(parts(got)) for _, got in pairs}
    if not pairs or len(counts) != 1:
        return
    (count,) = counts
    on_the_way = tuple(steps(question.reference, [case.args for case, _ in pairs]))
    for k in range(count):
        expected = tuple(np.asarray(parts(case.expected)[k]) for case, _ in pairs)
        got = tuple(np.asarray(parts(got)[k]) for _, got in pairs)
        args = tuple(case.args for case, _ in pairs)
        view = View(expected, got, args, question.parameters, question.rtol, question.atol, on_the_way)
        if not all(view.same(e, g) for e, g in zip(expected, got, strict=True)):
            yield f"Output {k + 1} of {count}: " if count > 1 else "", view


def related(name: str, view: View, relations: Sequence[Relation], kind: str = "relation") -> Iterator[Sentence]:
    """Those of some relations that hold everywhere."""
    for relation in relations:
        if said := attempted(lambda relation=relation: relation(view)):
            yield Sentence(kind, name + said)


def local(name: str, view: View) -> Iterator[Sentence]:
    """The relations that hold at some places outside of which all is right."""
    for where, masks in places(view):
        relations = (*NUMBERS, *COMBINED) if where.startswith(("in column", "in entry")) else NUMBERS
        yield from related(f"{name}It is wrong only {where}. There: ", view.at(masks), relations)
    if masks := wherever_wrong(view):  # which value stands for which is known there, if there are but two
        relations = [r for r in NUMBERS if r is not values_taken_for_others]
        yield from related(f"{name}Where it is wrong: ", view.at(masks), relations)


def directed(name: str, view: View) -> Iterator[Sentence]:
    """How it is wrong, at the narrowest place outside of which all is right, or wherever it is wrong."""
    where = next((f"It is wrong only {where}. " for where in narrow_places(view)), "")
    yield from related(name + where, view, DIRECTIONS, "place")


def narrow_places(view: View) -> Iterator[str]:
    """Places outside of which all is right, that are less than half of everything."""
    half = sum(e.size for e in view.expected) / 2
    return (where for where, masks in places(view) if sum(int(m.sum()) for m in masks) <= half)


def wherever_wrong(view: View) -> list[np.ndarray]:
    """The places that are wrong, if there are several, some are right, and there is more to say than no for yes."""
    wrong = view.wrong() if view.shaped else []
    count = sum(int(w.sum()) for w in wrong)
    truths = all(np.isin(a, (0, 1)).all() for a in (*view.expected, *view.got))
    return wrong if 2 < count < sum(w.size for w in wrong) and not truths else []


def another_form(question: Question, cases: Sequence[Case], outputs: Sequence[object]) -> Iterator[Sentence]:
    """One array in the place of several, or several in the place of one."""
    pairs = with_outputs(question, cases, outputs)
    if not pairs or len({isinstance(got, tuple) for _, got in pairs}) > 1:
        return
    several = isinstance(pairs[0][0].expected, tuple)
    if several and not isinstance(pairs[0][1], tuple):
        count = len(pairs[0][0].expected)
        for k in range(count):
            if all(alike(question, case.expected[k], got) for case, got in pairs):
                yield Sentence("relation", f"You return only output {k + 1} of {count}; the others are missing.")
        if all(np.shape(got) and len(got) == count for _, got in pairs):
            yield Sentence("relation", f"You return one array of {count} rows in the place of {count} outputs.")
    elif not several and isinstance(pairs[0][1], tuple):
        for k in range(min(len(got) for _, got in pairs)):
            if all(alike(question, case.expected, got[k]) for case, got in pairs):
                yield Sentence(
                    "relation", f"The right output is number {k + 1} of those that you return: return it alone."
                )
        made = [attempt(np.stack, got) for _, got in pairs]
        right = all(m is not None and alike(question, c.expected, m) for (c, _), m in zip(pairs, made, strict=True))
        values = "its values are right" if right else "its values are others, too"
        yield Sentence("relation", f"You return a list or a tuple, and one array is asked for; {values}.")


def tuple_in_another_order(question: Question, cases: Sequence[Case], outputs: Sequence[object]) -> Iterator[Sentence]:
    """Two outputs exchanged, or one in the place of another."""
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
    for i, j in itertools.permutations(range(count), 2):
        other = [tuple(parts(case.expected)[j if k == i else k] for k in range(count)) for case in cases]
        same = all(alike(question, a, b) for a, b in zip(other, got, strict=True))
        if same and not all(alike(question, case.expected, a) for case, a in zip(cases, other, strict=True)):
            yield Sentence("relation", f"Output {i + 1} holds what output {j + 1} should be.")


# ---------------------------------------------------------------------------------------- functions that are tried


def of_inputs(question: Question, args: tuple) -> Iterator[tuple[Sentence, Callable]]:
    """The right answer for changed arguments, as functions of a tuple of arguments, and what each explains."""
    for says, change in changes(question, args):
        yield Sentence("input", says), lambda args, change=change: question.reference(*change(args))


def of_answers(question: Question, args: tuple) -> Iterator[tuple[Sentence, Callable]]:
    """Right answers with one step taken otherwise, and slips of the reference; args: those of a wrong case."""
    for right in (question.reference, *question.ways):
        for says, function in changed_steps(right, args):
            yield Sentence("step", says), function
    for slip in slips_of(question.reference):
        yield Sentence("slip", str(slip)), lambda args, slip=slip: slip.function(*args)


class Tried:
    """Functions of the arguments that may give the outputs; MOST_TRIES are tried."""

    def __init__(self, question: Question, cases: Sequence[Case], outputs: Sequence[object]):
        self.question, self.pairs, self.count = question, with_outputs(question, cases, outputs), 0

    @property
    def args(self) -> tuple:
        """Arguments of the first case that is wrong, or of any."""
        return self.pairs[0][0].args if self.pairs else ()

    def explains(self, function: Callable) -> bool:
        """Whether a function gives the outputs (where it fails, the right ones), some of them wrong."""
        self.count += 1
        if not self.pairs or self.count > MOST_TRIES:
            return False
        shown = 0
        with quiet():
            for case, got in self.pairs:
                new = made(function, case.args)
                if not alike(self.question, case.expected if new is None else new, got):
                    return False
                shown += new is not None and not alike(self.question, new, case.expected) and not all_nan(got)
        return shown > 0


def made(function: Callable, args: tuple) -> object | None:
    """What a function gives for a copy of a tuple of arguments, as `plain` has it; None if it fails."""
    try:
        output = plain(function(tuple(a.copy() if isinstance(a, np.ndarray) else a for a in args)))
    except Exception:
        return None
    return None if isinstance(output, Problem) else output


def all_nan(output: object) -> bool:
    """Whether an output is NaN throughout, as many mistakes make it."""
    return all(np.isnan(np.asarray(part, float)).all() for part in parts(output))


def with_outputs(question: Question, cases: Sequence[Case], outputs: Sequence[object]) -> list[tuple[Case, object]]:
    """The cases that have an output, the wrong ones first: they decide soonest."""
    pairs = [(case, got) for case, got in zip(cases, outputs, strict=True) if not isinstance(got, Problem)]
    return sorted(pairs, key=lambda pair: alike(question, pair[0].expected, pair[1]))


def attempted(function: Callable, *args: object) -> object | None:
    """What a function gives, quietly; None if it fails, as it may on changed arguments and on the oddest outputs."""
    try:
        with quiet():
            return function(*args)
    except Exception:
        return None


def broken_properties(question: Question, cases: Sequence[Case], outputs: Sequence[object]) -> Iterator[Sentence]:
    """The properties of right answers that a wrong one does not have."""
    pairs = [(c, got) for c, got in with_outputs(question, cases, outputs) if finite(got) or not finite(c.expected)]
    for prop in question.properties:
        held = [fulfilled(prop, case, got) for case, got in pairs]
        if not all(held):  # the first case is wrong, and mostly the one that is shown
            yield Sentence("property", f"It should hold, but does not{' in every case' * held[0]}: {prop.says}.")


def finite(output: object) -> bool:
    """Whether no number of an output is NaN or infinite."""
    return all(np.isfinite(part).all() for part in parts(output))


def fulfilled(prop: Property, case: Case, got: object) -> bool:
    """Whether a property holds; one that cannot even be computed counts as held."""
    try:
        with np.errstate(all="ignore"):
            return bool(prop.holds(copy.deepcopy(case.args), copy.deepcopy(got)))
    except Exception:
        return True


# ------------------------------------------------------------------------------------------------------ slips


@functools.cache
def slips_of(reference: Callable) -> list[Slip]:
    """The slips of a reference, compiled once; none if it has no source of its own."""
    try:
        return slips(reference)
    except (OSError, SyntaxError, ValueError):
        return []
