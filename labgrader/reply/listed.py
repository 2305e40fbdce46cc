"""Listed mistakes: which one gives an answer's outputs, and what each gives in each case."""

from collections.abc import Iterator, Sequence

import numpy as np

from labgrader.comparison import Case, Problem, alike, differences, is_heavy, parts, trusted, weight
from labgrader.question import Misconception, Question, Untold

HEAVY_ONES = 2  # of the heavy cases, the smallest, in which it is known what listed mistakes give
Listed = dict[bytes, frozenset[int]]  # of one case: fingerprints of outputs, and which listed mistakes give them


def recognise(question: Question, cases: Sequence[Case], outputs: Sequence[object]) -> Misconception | None:
    """Find the misconception that gives these outputs in every case that tells it from a right answer."""
    if all(isinstance(got, Problem) for got in outputs):
        return None
    for misconception in question.misconceptions:
        told, stray = [], False  # told: of each case that tells it from a right answer, whether there is an output
        for case, got in zip(cases, outputs, strict=True):
            own = output_of(misconception, case.args)
            if own is None:
                continue
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


def recognise_parts(
    question: Question, cases: Sequence[Case], outputs: Sequence[object]
) -> Iterator[tuple[int, Misconception]]:
    """For each output of several that is wrong in two cases or more, a misconception that gives it in all of them.

    Where several do, the one that has fewest of the other outputs wrong.
    """
    count = len(parts(cases[0].expected))
    if count == 1 or any(isinstance(got, Problem) or len(parts(got)) != count for got in outputs):
        return
    theirs = [(m, [parts(output_of(m, case.args)) for case in cases]) for m in question.misconceptions]
    theirs = [(m, given) for m, given in theirs if all(len(one) == count for one in given)]
    expected, own = [parts(case.expected) for case in cases], [parts(got) for got in outputs]
    for k in range(count):
        if len(cases) - equal_parts(question, k, expected, own) < 2:
            continue
        gives = [(m, given) for m, given in theirs if equal_parts(question, k, given, own) == len(cases)]
        right = [sum(equal_parts(question, j, given, expected) for j in range(count)) for _, given in gives]
        if gives:
            yield k, gives[int(np.argmax(right))][0]


def equal_parts(question: Question, k: int, some: Sequence[tuple], others: Sequence[tuple]) -> int:
    """In how many cases two outputs are equal in their part k."""
    pairs = ((one[k], other[k]) for one, other in zip(some, others, strict=True))
    return sum(not any(wrong.any() for wrong in differences(question, a, b)) for a, b in pairs)


def output_of(misconception: Misconception, args: tuple) -> object:
    """What a misconception gives, a Problem where it raises, None where it tells nothing."""
    try:
        return trusted(misconception.answer, args)
    except Untold:
        return None
    except Exception as error:
        return Problem("exception", type(error).__name__)


def listed_in(question: Question, cases: Sequence[Case]) -> list[Listed | None]:
    """What the listed mistakes of a question give in each case, None in heavy ones but the smallest."""
    heavy = [k for k, case in enumerate(cases) if is_heavy(case.args, case.expected)]
    left_out = sorted(heavy, key=lambda k: weight(cases[k].args, cases[k].expected))[HEAVY_ONES:]
    return [None if k in left_out else listed_in_case(question, case) for k, case in enumerate(cases)]


def listed_in_case(question: Question, case: Case) -> Listed:
    """What the listed mistakes of a question give in a case; those that raise give nothing."""
    told: dict[bytes, set[int]] = {}
    for number, mistake in enumerate(question.misconceptions):
        output = output_of(mistake, case.args)
        if output is not None and not isinstance(output, Problem):
            told.setdefault(fingerprint(output), set()).add(number)
    return {key: frozenset(numbers) for key, numbers in told.items()}


def fingerprint(output: object) -> bytes:
    """The numbers of an output, rounded, and its shape; of outputs that differ by rounding most have the same.

    >>> fingerprint([1, 0.1 + 0.2]) == fingerprint(np.array([1.0, 0.3]))
    True
    """
    try:
        arrays = [np.asarray(part).astype(float) for part in parts(output)]
    except (TypeError, ValueError):
        return b""
    return b"".join(bytes(str(a.shape), "ascii") + (np.round(a, 7) + 0.0).tobytes() for a in arrays)
