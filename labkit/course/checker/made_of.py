"""Relations of wrong outputs to what is at hand: arguments, what is easily made of them, steps of the reference.

They belong to the COMBINED of `relations`, where the rules for them stand.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from labkit.course.checker.relations import COMBINED, View, attempt, relation

Values = list[np.ndarray | None]
MOST_TRIED = 40  # combinations that fit some numbers, and are tried on all


def ingredients(view: View) -> Iterator[tuple[str, list[np.ndarray | None]]]:
    """What is easily made of one argument: itself, its sums, extremes and places; the same for every case."""
    for i, name in enumerate(view.names):
        values = [args[i] for args in view.args]
        yield name, [attempt(np.asarray, v) for v in values]
        if not all(isinstance(v, np.ndarray) and v.ndim for v in values):
            continue
        for words, function in SIMPLE.items():
            yield f"{words} of {name}", [attempt(function, v) for v in values]
        for axis in range(min(v.ndim for v in values)):
            for words, function in ALONG.items():
                yield f"{words} of {name} over axis {axis}", [attempt(function, v, axis) for v in values]


SIMPLE = {
    "the diagonal": lambda v: np.diagonal(v) if v.ndim == 2 else None,
    "the trace": lambda v: np.trace(v) if v.ndim == 2 else None,
    "the sum": np.sum,
    "the mean": np.mean,
    "the largest": np.max,
    "the smallest": np.min,
    "the median": np.median,
    "the standard deviation": np.std,
    "the length": len,
    "the exponentials": lambda v: np.exp(v) if v.dtype.kind == "f" else None,
    "the logarithms": lambda v: np.log(v) if v.dtype.kind == "f" else None,
}
ALONG = {
    "the sum": np.sum,
    "the mean": np.mean,
    "the largest": np.max,
    "the smallest": np.min,
    "the median": np.median,
    "the spread": np.std,
    "the place of the largest": np.argmax,
    "the place of the smallest": np.argmin,
    "the range": np.ptp,
    "the product": np.prod,
    "the differences": lambda v, axis: np.diff(v, axis=axis),
}
OPERATIONS = {
    "times": np.multiply,
    "divided by": np.divide,
    "plus": np.add,
    "minus": np.subtract,
}
FUNCTIONS = {
    "minus": np.negative,
    "1 minus": lambda v: 1 - v,
    "1 over": lambda v: 1 / v,
    "the square of": np.square,
    "the root of": np.sqrt,
    "the logarithm of": np.log,
    "the exponential of": np.exp,
    "the absolute value of": np.abs,
    "the negation of": lambda v: ~v if v.dtype.kind == "b" else None,
    "the sum of": np.sum,
}


@dataclass(frozen=True)
class Operand:
    """Something that outputs may be made of: its name and its value in each case; whether it is the right output."""

    name: str
    values: Values
    right: bool = False
    only_with_right: bool = False


@relation(COMBINED)
def a_step(view: View) -> str:
    """Something simple of one argument, or a step, perhaps with a function of it."""
    first = first_wrong(view)
    for name, values in at_hand(view):
        if view.same(values[first], view.got[first]) and view.is_(values):
            return f"What you return is {name}: what else has to be done with it?"
    for name, values in at_hand(view):
        for words, function in FUNCTIONS.items():
            predicted = attempt(function, values[first])
            fits = predicted is not None and view.same(predicted, view.got[first])
            if fits and view.is_([attempt(function, v) for v in values]):
                return f"What you return is {words} {name}."
    return ""


@relation(COMBINED)
def two_combined(view: View) -> str:
    """The right value times, divided by, plus or minus something; or two things at hand so combined."""
    first = first_wrong(view)
    got = np.asarray(view.got[first], float)
    if not got.size or view.got[first].dtype.kind == "b":
        return ""
    places = np.flatnonzero(np.isfinite(got))[:: max(got.size // 4, 1)][:4]
    operands = [
        (o, rows) for o in operands_of(view) if (rows := at_places(o.values[first], got.shape, places)) is not None
    ]
    if not operands or not places.size:
        return ""
    numbers, wanted = np.array([rows for _, rows in operands]), got.ravel()[places]
    found = []
    for words, operation in OPERATIONS.items():
        with np.errstate(all="ignore"):
            fits = np.isclose(operation(numbers[:, None], numbers[None]), wanted, view.rtol, view.atol).all(-1)
        found += [(operands[i][0], words, operation, operands[j][0]) for i, j in np.argwhere(fits)]
    found = [f for f in found if f[0].right != f[3].right or not (f[0].only_with_right or f[3].only_with_right)]
    found = sorted((f for f in found if f[0] is not f[3]), key=lambda f: -f[0].right - f[3].right)
    for a, words, operation, b in found[:MOST_TRIED]:
        if view.is_([attempt(operation, x, y) for x, y in zip(a.values, b.values, strict=True)]):
            subject = "Yours are" if a.right or b.right else "What you return is"
            return f"{subject} {a.name} {words} {b.name}."
    return ""


def first_wrong(view: View) -> int:
    """The number of the first case that is wrong."""
    return next(i for i, (e, g) in enumerate(zip(view.expected, view.got, strict=True)) if not view.same(e, g))


def at_hand(view: View) -> list[tuple[str, Values]]:
    """Ingredients and steps that hold numbers in the first wrong case and are not the right output themselves."""
    first = first_wrong(view)
    known = [*ingredients(view), *view.steps]
    known = [(name, v) for name, v in known if v[first] is not None and v[first].dtype.kind in "iufb"]
    known = [(name, v) for name, v in known if not np.isnan(v[first]).all()]  # an empty one is all NaN, too
    return [(name, v) for name, v in known if not view.same(v[first], view.expected[first])]


def operands_of(view: View) -> Iterator[Operand]:
    """The right output, and what is at hand: itself, and with it alone its double, its square and with more axes."""
    yield Operand("the right values", list(view.expected), right=True)
    for name, values in at_hand(view):
        if "the place of" in name:  # the product of an index and a number may fit, and explains nothing
            continue
        yield Operand(name, values)
        for words, change in (
            ("twice ", lambda v: 2.0 * v),
            ("the square of ", np.square),
            ("", lambda v: v[..., None] if v.ndim else None),
            ("", lambda v: v[..., None, None] if v.ndim else None),
        ):
            yield Operand(words + name, [None if v is None else attempt(change, v) for v in values], False, True)


def at_places(value: np.ndarray | None, shape: tuple[int, ...], places: np.ndarray) -> np.ndarray | None:
    """The numbers at some places of an array that is spread to a shape; None if it does not fit."""
    if value is None:
        return None
    spread = attempt(np.broadcast_to, value, shape)
    return None if spread is None else spread.ravel()[places].astype(float)
