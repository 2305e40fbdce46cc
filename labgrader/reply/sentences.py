"""What is said about a wrong answer: the surest sentence that is true of it, and that a student can read.

`sentences` asks in this order: is it a listed misconception, or an output of several one; does it run (what an
exception means in this task); is a sign wrong; what do instruments and repair find in the student's own program; which
relation of the outputs would a student see at once; what stands idle in the program; which property of right answers
does it lack; and at last, which cases are wrong. What is said of an exception is said of the case that is shown.
"""

import copy
import itertools
from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from labgrader.comparison import Case, Problem, alike, as_expected, as_numpy, compare, parts, told_first, weight
from labgrader.question import Property, Question
from labgrader.reply.errors import explain
from labgrader.reply.finding import IDLE, REPAIRS, WATCHES, Finding
from labgrader.reply.listed import equal_parts, recognise, recognise_parts
from labgrader.reply.messages import Marked, marked, said
from labgrader.reply.relations import View, related, wrong_sign

ENDLESS = "A loop does not end, or runs far too many iterations: what changes in each iteration, and when does it stop?"
SLOW = (
    "It is right in {right} smaller cases, and too slow for a case as large as this one. Which work does it repeat, "
    "and which loop over single numbers could be one step for whole arrays?"
)
OF_NONE = "None is no number. Where does it come from, and which number does the task ask for there?"
OF_BYTES = "Bytes are not an array yet. Which function of NumPy makes one of them, and with which dtype?"
ASLEEP = "It waits, and computes nothing: does it sleep, or wait for something to be typed?"


NO_CAUSE = ("division", "nothing", "no number")  # where these appear may be right: a repair that is found tells more


@dataclass(frozen=True)
class Sentence:
    """Something true of a wrong answer.

    kind: "exception", "misconception", a kind of finding (`finding.WATCHES`, `finding.IDLE`, `finding.REPAIRS`) or
    "relation" name a mistake; "property" and "case" are true of more mistakes than one. marked:
    lines of the student's that it is about.
    """

    kind: str
    says: str
    marked: tuple[Marked, ...] = ()

    @property
    def names_the_mistake(self) -> bool:
        """Whether one knows from it what to change."""
        return self.kind not in ("property", "case")


def diagnose(
    question: Question,
    cases: Sequence[Case],
    outputs: Sequence[object],
    pieces: Sequence[tuple[str, str]] = (),
    findings: Sequence[Finding] = (),
) -> Sentence | None:
    """The surest sentence about outputs that are wrong in some case, or an answer that changes its arguments.

    pieces: the program, as `program` cuts it; findings: what is known about it (`run.run`). None if no case is
    wrong and nothing was found.
    """
    return next(sentences(question, cases, outputs, pieces, findings), None)


def at_once(question: Question, cases: Sequence[Case], outputs: Sequence[object]) -> Sentence | None:
    """The sentence that needs no search: a listed misconception, an exception, a sign; None if there is none."""
    return next(known_at_once(question, cases, in_form(cases, outputs)), None)


def in_form(cases: Sequence[Case], outputs: Sequence[object]) -> list[object]:
    """The outputs in the form that is expected, a tuple of numbers as an array; Problems as they are."""
    return [
        got if isinstance(got, Problem) else as_expected(case.expected, as_numpy(got))
        for case, got in zip(cases, outputs, strict=True)
    ]


def known_at_once(question, cases, outputs, pieces=()) -> Generator[Sentence, None, list[Sentence]]:
    """What `at_once` chooses from, of outputs in their form; returns what `listed` keeps for later."""
    later = yield from listed(question, cases, outputs)
    yield from exceptions(question, cases, outputs, pieces)
    for name, view in views_of(question, cases, outputs):
        if says := wrong_sign(view):
            yield Sentence("relation", name + says)
    return later


def sentences(question, cases, outputs, pieces=(), findings=()) -> Iterator[Sentence]:
    """All sentences that are true of an answer, the surest first; arguments are those of `diagnose`."""
    outputs = in_form(cases, outputs)
    later = yield from known_at_once(question, cases, outputs, pieces)
    pairs = wrong_ones_first(question, cases, outputs)
    values_are_right = bool(pairs) and alike(question, pairs[0][0].expected, pairs[0][1])
    yield from found_in_the_program(question, pieces, findings, values_are_right)
    yield from later
    if not pairs or values_are_right:
        return
    yield from outputs_exchanged(question, cases, outputs)
    for name, view in views_of(question, cases, outputs):
        yield from (Sentence("relation", name + says) for says in related(view))
    yield from exceptions_elsewhere(question, cases, outputs, pieces)
    yield from idle_in_the_program(pieces, findings)
    right = rightness(question, cases, outputs)
    yield from broken_properties(question, pairs[:1])  # that is the case that is shown
    for sentence in broken_properties(question, pairs[1:]):
        yield replace(sentence, says=f"In another wrong case: {sentence.says[0].lower()}{sentence.says[1:]}")
    yield which_cases(cases, right)


def rightness(question: Question, cases: Sequence[Case], outputs: Sequence[object]) -> list[bool]:
    """Which outputs are right."""
    return [
        not isinstance(got, Problem) and compare(question, case.expected, got) is None
        for case, got in zip(cases, outputs, strict=True)
    ]


def exceptions(question, cases, outputs, pieces=()) -> Iterator[Sentence]:
    """That no value comes back in the case that is shown, and why."""
    right = rightness(question, cases, outputs)
    shown = told_first(cases, [not is_right for is_right in right])
    got = None if shown is None else outputs[shown]
    if not isinstance(got, Problem):
        return
    if got.kind == "time":
        yield Sentence("exception", out_of_time(cases, right, shown, got))
    if got.kind == "kind" and got.says.endswith(("got bytes", "got bytearray", "got memoryview")):
        yield Sentence("exception", OF_BYTES)
    if got.kind == "kind" and got.says.startswith("there is a None"):
        yield Sentence("exception", OF_NONE)
    if "returns None" in got.says:
        never = all(isinstance(other, Problem) and "returns None" in other.says for other in outputs)
        words = "It never reaches" if never else "In some cases it does not reach"
        says = f"{words} a `return` with a value: where does it stand, and is it in a branch or a loop?"
        yield Sentence("exception", says)
    if got.kind == "exception" and (says := explained(question, cases[shown], got, pieces)):
        yield Sentence("exception", says)


def explained(question: Question, case: Case, got: Problem, pieces: Sequence[tuple[str, str]]) -> str:
    """What an exception means in a case, "" if nobody knows."""
    arguments = dict(zip(question.parameters, case.args, strict=True))
    line = got.lines[-1][1] if got.lines else ""
    return explain(got.says, arguments, line, "\n".join(text for _, text in pieces))


def exceptions_elsewhere(question, cases, outputs, pieces) -> Iterator[Sentence]:
    """That another case than the one shown raises, and why."""
    for case, got in zip(cases, outputs, strict=True):
        if isinstance(got, Problem) and got.kind == "exception":
            if says := explained(question, case, got, pieces):
                yield Sentence("exception", f"In another case it raises {got.says}. {says}")
            return


def out_of_time(cases: Sequence[Case], right: Sequence[bool], shown: int, got: Problem) -> str:
    """Why a case is not done in time: asleep, endless, or slow for its size where all smaller ones are right."""
    if got.says.startswith("it slept"):
        return ASLEEP
    size = weight(cases[shown].args)
    smaller = [is_right for case, is_right in zip(cases[:shown], right, strict=False) if 2 * weight(case.args) <= size]
    return SLOW.format(right=len(smaller)) if len(smaller) > 1 and all(smaller) else ENDLESS


# ------------------------------------------------------------------------------------------ misconceptions


def listed(
    question: Question, cases: Sequence[Case], outputs: Sequence[object]
) -> Generator[Sentence, None, list[Sentence]]:
    """The hint of the listed misconception that gives these outputs, or of what gives the one that alone is wrong.

    That is, of several outputs, in the case that is shown. Returns the hints of what gives one of the others that are
    wrong there: a mark in the program tells more. The hint of one that is right there would speak of what is not seen.
    """
    if misconception := recognise(question, cases, outputs):
        yield Sentence("misconception", misconception.hint)
    found = list(recognise_parts(question, cases, outputs))
    if not found:
        return []
    case, got = wrong_ones_first(question, cases, outputs)[0]
    shown = [parts(case.expected)], [parts(got)]
    count = len(shown[0][0])
    wrong = [k for k in range(count) if not equal_parts(question, k, *shown)]
    hints = {k: Sentence("misconception", f"Output {k + 1} of {count}: {m.hint}") for k, m in found if k in wrong}
    if len(wrong) == 1 and wrong[0] in hints:
        yield hints.pop(wrong[0])
    return list(hints.values())


# ----------------------------------------------------------------------------------- the student's own program


def found_in_the_program(
    question: Question, pieces: Sequence[tuple[str, str]], findings: Sequence[Finding], values_are_right: bool
) -> Iterator[Sentence]:
    """What instruments show, an argument that is never read, then what repair finds, with the student's lines.

    Where a NaN appears is told last: what makes it may be in another line, which repair marks, or which changes an
    argument.
    That an argument is changed is told at once where that is all that is wrong, and else at last. Of a cast that mends
    wrong values is not said that the values are right.
    """
    shown = [f for f in findings if f.kind in (*WATCHES, "unread") and f.kind != "writes"]
    repairs = [f for f in findings if f.kind in REPAIRS]
    written = [f for f in findings if f.kind == "writes"]
    sure, weak = ([f for f in shown if (f.kind in NO_CAUSE) is which] for which in (False, True))
    later = (*sure, *repairs[:1], *written, *weak)
    for finding in (*written, *shown, *repairs[:1]) if values_are_right else later:
        equal = [f for f in repairs if f.kind == finding.kind and f.width == finding.width and f != finding][:1]
        equal = equal if len(finding.spans) == 1 else []  # more than two marked places help nobody
        changes_values = finding.kind == "cast" and not values_are_right
        says = said(replace(finding, kind="type") if changes_values else finding)
        if finding in repairs and equal:
            says = f"Change one of the two marked places, not both. {says}"
        if finding.listed is not None and finding.listed < len(question.misconceptions):
            one = question.misconceptions[finding.listed].hint
            says = f"Two things are wrong, it seems. Is the marked part as it should be? And this: {one}"
        yield Sentence(finding.kind, says, marked([finding, *(equal if finding in repairs else [])], pieces))


def idle_in_the_program(pieces: Sequence[tuple[str, str]], findings: Sequence[Finding]) -> Iterator[Sentence]:
    """What stands idle, but for an argument that is never read, which is told before repairs."""
    for finding in findings:
        if finding.kind in IDLE and finding.kind != "unread":
            yield Sentence(finding.kind, said(finding), marked([finding], pieces))


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
        view = View(
            expected, got, tuple(case.args for case, _ in pairs), question.parameters, question.rtol, question.atol
        )
        if not all(view.same(e, g) for e, g in zip(expected, got, strict=True)):
            yield f"Output {k + 1} of {count}: " if count > 1 else "", view


def outputs_exchanged(question: Question, cases: Sequence[Case], outputs: Sequence[object]) -> Iterator[Sentence]:
    """Two outputs exchanged, one in the place of another, or another number of outputs than is asked for."""
    pairs = [(case, got) for case, got in zip(cases, outputs, strict=True) if not isinstance(got, Problem)]
    asked, came = {len(parts(case.expected)) for case, _ in pairs}, {len(parts(got)) for _, got in pairs}
    if len(asked) != 1 or len(came) != 1:
        return
    (count,), (given,) = asked, came
    if given == 1 < count:
        for k in range(count):
            if all(alike(question, parts(case.expected)[k], got) for case, got in pairs):
                yield Sentence("relation", f"You return only output {k + 1} of {count}. Return all of them.")
    if count == 1 < given:
        for k in range(given):
            if all(alike(question, case.expected, got[k]) for case, got in pairs):
                yield Sentence("relation", f"Number {k + 1} of what you return is right. Return it alone.")
    if count != given:
        return
    for i, j in itertools.combinations(range(count), 2):
        order = [j if k == i else i if k == j else k for k in range(count)]
        if all(alike(question, tuple(parts(case.expected)[k] for k in order), got) for case, got in pairs):
            yield Sentence("relation", f"Outputs {i + 1} and {j + 1} are swapped. In which order are they asked for?")


# ------------------------------------------------------------------------------------------- the last resort


def wrong_ones_first(question: Question, cases: Sequence[Case], outputs: Sequence[object]) -> list[tuple[Case, object]]:
    """The cases that have an output, the wrong ones first, of these the one that is shown."""
    pairs = [(case, got) for case, got in zip(cases, outputs, strict=True) if not isinstance(got, Problem)]
    right = [alike(question, case.expected, got) for case, got in pairs]
    shown = told_first([case for case, _ in pairs], [not is_right for is_right in right])
    order = sorted(range(len(pairs)), key=lambda i: (right[i], i != shown))
    return [pairs[i] for i in order]


def broken_properties(question: Question, pairs: Sequence[tuple[Case, object]]) -> Iterator[Sentence]:
    """The properties of right answers that a wrong one does not have in some cases."""
    pairs = [(case, got) for case, got in pairs if finite(got) or not finite(case.expected)]
    for prop in question.properties:
        if not all(fulfilled(prop, case, got) for case, got in pairs):
            yield Sentence("property", f"Every right answer has this property, and yours does not: {prop.says}.")


def finite(output: object) -> bool:
    """Whether no number of an output is NaN or infinite."""
    return all(np.isfinite(part).all() for part in parts(output))


def fulfilled(prop: Property, case: Case, got: object) -> bool:
    """Whether a property holds; one that cannot even be computed counts as held."""
    try:
        with np.errstate(all="ignore"):
            return bool(prop.holds(*copy.deepcopy(case.args), copy.deepcopy(got)))
    except Exception:
        return True


def which_cases(cases: Sequence[Case], right: Sequence[bool]) -> Sentence:
    """What to do with the case that is shown, and how many others are right; right: of each case."""
    shown = told_first(cases, [not is_right for is_right in right])
    usual = [is_right for case, is_right in zip(cases, right, strict=True) if case.is_usual]
    if shown is not None and usual and all(usual):
        unusual = "What is unusual about the case above, a size, a number, a type?"
        drawn = "What does the case above have that they do not: a size, a number, a direction?"
        says = f"{unusual if cases[shown].edge else drawn} Which of your lines depends on it?"
        return Sentence("case", f"All usual hand-made cases are right. {says}")
    verb = "is" if sum(right) == 1 else "are"
    others = f" {sum(right)} of {len(cases)} cases {verb} right." if any(right) else ""
    return Sentence("case", f"Do the case above by hand, and print what each of your lines gives for it.{others}")
