"""In which kind of cases an answer is wrong, and in which it is right: the ones with 255, say, or those not square.

A kind is a plain fact about an argument (`facts`). One is told only if it tells wrong cases from right ones without an
exception.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from labgrader.comparison import Case
from labgrader.course import course
from labgrader.question import Question

FEWEST_WRONG = 2  # cases of a kind that have to be wrong: one may be wrong for any reason
FEWEST_RIGHT = 2  # cases of the other kind that have to be right: fewer show nothing


def contrast(question: Question, cases: Sequence[Case], right: Sequence[bool]) -> str:
    """A sentence about the kind of the wrong cases, "" if none tells them apart.

    right: of each case. A kind that all wrong cases are of, and no right one, is told before one of which some cases
    are right.
    """
    told = [set(facts(question, case.args)) for case in cases]
    wrong = [kinds for kinds, passed in zip(told, right, strict=True) if not passed]
    passed = [kinds for kinds, passed in zip(told, right, strict=True) if passed]
    if len(wrong) < FEWEST_WRONG:
        return ""
    common = [kind for kind in facts(question, cases[right.index(False)].args) if all(kind in other for other in wrong)]
    for kind in common:
        others = sum(kind not in kinds for kinds in passed)
        if others == len(passed) >= FEWEST_RIGHT:
            return f"It is wrong whenever {kind}, and right in the {others} other cases. What do your lines do then?"
    for kind in common:
        others = sum(kind not in kinds for kinds in passed)
        if others >= 2 * FEWEST_RIGHT and 2 * others > len(passed):
            return f"It is wrong only when {kind}: in the {others} cases without that it is right. What differs then?"
    return ""


def facts(question: Question, args: tuple) -> Iterator[str]:
    """What is so of a case's arguments, in words that follow "when"; the rarest things first."""
    for name, value in zip(question.parameters, args, strict=True):
        yield from (f"{name} {fact}" for fact in facts_of(value))


def facts_of(value: object) -> Iterator[str]:
    """What is so of one argument."""
    array = np.asarray(value) if isinstance(value, np.ndarray | int | float | np.generic) else None
    if array is None or array.dtype.kind not in "biuf":
        return
    if not array.ndim:
        if array.dtype.kind == "b":
            yield f"is {bool(array)}"
        else:
            yield from (f"is {words}" for words, so in (("0", array == 0), ("negative", array < 0)) if so)
        return
    if not array.size:
        yield "is empty"
        return
    if array.dtype.kind == "f" and np.isnan(array).any():
        yield "holds NaN"
    if array.dtype.kind == "f" and np.isinf(array).any():
        yield "holds infinity"
    if array.dtype.kind in "iu" and (array == course().ignored).any():
        yield f"holds {course().ignored}"
    if array.dtype.kind == "b":
        yield from (f"is {words}" for words, so in (("all true", array.all()), ("nowhere true", not array.any())) if so)
    else:
        yield from (
            f"holds {words}" for words, so in (("a negative number", array < 0), ("a 0", array == 0)) if so.any()
        )
    for axis, length in enumerate(array.shape):
        if length == 1 and array.ndim > 1:
            yield f"has one {('row', 'column')[axis]}" if array.ndim == 2 else f"is 1 long along axis {axis}"
    if array.ndim == 1 and array.size == 1:
        yield "has one entry"
    if array.ndim >= 2 and array.shape[0] != array.shape[1]:
        yield "is not square" if array.ndim == 2 else "has unlike lengths along its first two axes"
