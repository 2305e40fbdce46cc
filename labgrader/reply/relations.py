"""What wrong outputs have to do with the right ones, where a student sees it at once: transposed, a factor, a sign.

Each relation is one small function of a `View`, which holds the expected and the returned array of every case. It gives
one sentence, "" if it does not hold; it holds only if it does so in every case that can show it, and if chance would
give that in less than one of a hundred answers that are wrong in some other way.
"""

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from labgrader.comparison import quiet
from labgrader.course import course

Array = np.ndarray | np.generic
BY_CHANCE = 0.01  # what is likelier by chance is no relation


@dataclass(frozen=True)
class View:
    """The expected and the returned array of each case, with the case's arguments and their names.

    rtol, atol: what counts as equal.
    """

    expected: tuple[np.ndarray, ...]
    got: tuple[np.ndarray, ...]
    args: tuple[tuple, ...]
    names: tuple[str, ...]
    rtol: float
    atol: float

    def different(self, a: Array, b: Array) -> np.ndarray:
        """Where two arrays of one shape differ; truth values are no numbers."""
        if (a.dtype.kind == "b") != (b.dtype.kind == "b"):
            return np.ones(a.shape, bool)
        if a.dtype.kind != "f" and b.dtype.kind != "f":
            return np.asarray(a != b)
        with np.errstate(all="ignore"):
            equal = np.isclose(np.asarray(b, float), np.asarray(a, float), self.rtol, self.atol, equal_nan=True)
        return np.asarray(~equal)

    def same(self, a: Array, b: Array) -> bool:
        """Whether two arrays are equal within the tolerance."""
        return a.shape == b.shape and not self.different(a, b).any()

    def gives(self, change: Callable) -> bool:
        """Whether change(expected) is what came in all cases, not by chance; zeros alone show nothing."""
        chance = 1.0
        for e, g in zip(self.expected, self.got, strict=True):
            p = attempt(change, e)
            if not self.same(e if p is None else p, g):
                return False
            if p is not None and not self.same(e, p) and (np.abs(np.asarray(p, float)) > self.atol).any():
                shows = self.different(e, p) if e.shape == p.shape else np.ones(p.shape, bool)
                chance *= self.by_chance(p[shows])
        return chance < BY_CHANCE

    def by_chance(self, numbers: Array) -> float:
        """How likely another mistake gives these numbers: each is any of those that are expected, fractions of 1000.

        Of false and true, both count, and of fractions each once.
        """
        if numbers.dtype.kind == "f":
            return 0.001 ** len(np.unique(numbers))
        values = len(np.unique(np.concatenate([np.ravel(e) for e in self.expected])))
        return (1.0 / max(values, 2)) ** numbers.size

    @property
    def shaped(self) -> bool:
        """Whether every array has its right shape."""
        return all(e.shape == g.shape for e, g in zip(self.expected, self.got, strict=True))

    def wrong(self) -> list[np.ndarray]:
        """Where the arrays differ, if they have their right shapes."""
        return [self.different(e, g) for e, g in zip(self.expected, self.got, strict=True)]

    def numbers(self) -> tuple[np.ndarray, np.ndarray]:
        """All expected and all returned numbers in a row, as floats."""
        e, g = (np.concatenate([np.ravel(a).astype(float) for a in arrays]) for arrays in (self.expected, self.got))
        return e, g


Relation = Callable[[View], str]
RELATIONS: list[Relation] = []


def relation(function: Relation) -> Relation:
    """Enter a relation; they are asked in the order of this page."""
    RELATIONS.append(function)
    return function


def related(view: View) -> Iterator[str]:
    """The sentences of all relations that hold."""
    for function in RELATIONS:
        with quiet():
            try:
                said = function(view)
            except Exception:  # the oddest outputs may break a relation: then it does not hold
                continue
        if said:
            yield said


def attempt(change: Callable, *arguments) -> np.ndarray | None:
    """The array that a change gives; None if it cannot be made."""
    try:
        with quiet():
            changed = change(*arguments)
        return None if changed is None else np.asarray(changed)
    except Exception:  # a change that cannot be made here explains nothing
        return None


def axes(view: View) -> range:
    """The axes that every expected array has."""
    return range(min(e.ndim for e in view.expected))


def along(axis: int, view: View) -> str:
    """The name of an axis."""
    if all(e.ndim == 2 for e in view.expected):
        return ("from row to row", "from column to column")[axis]
    return "" if all(e.ndim == 1 for e in view.expected) else f"along axis {axis}"


def one(view: View) -> str:
    """What stands along the first axis, in the singular."""
    return "entry" if all(e.ndim == 1 for e in view.expected) else "row"


# ------------------------------------------------------------------------------------------- whole arrays


@relation
def transposed(view: View) -> str:
    """Rows and columns exchanged."""
    if view.gives(lambda e: np.swapaxes(e, 0, 1)):
        return "Your values are right, but rows and columns are exchanged. Which index comes first?"
    return ""


@relation
def axes_in_another_order(view: View) -> str:
    """Of three or four axes."""
    for order in itertools.permutations(axes(view)) if 3 <= len(axes(view)) <= 4 else ():
        if view.gives(lambda e, order=order: np.transpose(e, order)):
            return "Your values are right, but the axes stand in another order. Compare the two shapes, axis by axis."
    return ""


@relation
def another_shape(view: View) -> str:
    """The right values in reading order."""
    if view.shaped or not all(view.same(e.ravel(), g.ravel()) for e, g in zip(view.expected, view.got, strict=True)):
        return ""
    return "Your values are right, only the shape is not. Is an axis missing, or is there one too many?"


@relation
def reversed_along_an_axis(view: View) -> str:
    """The last one first."""
    for axis in axes(view):
        if view.gives(lambda e, axis=axis: np.flip(e, axis)):
            return f"Your values are right, but they stand in reverse order {along(axis, view)}".rstrip() + "."
    return ""


@relation
def two_exchanged(view: View) -> str:
    """Two of a few rows, columns or entries."""
    for axis in (-1, 0) if len(axes(view)) > 1 else (0,) if axes(view) else ():
        length = min(e.shape[axis] for e in view.expected)
        what = one(view) if axis == 0 else "column"
        for i, j in itertools.combinations(range(length), 2) if 2 < length <= 6 else ():
            if view.gives(lambda e, i=i, j=j, axis=axis: exchanged(e, i, j, axis)):
                return f"Your {what} {i} holds what belongs into {what} {j}, and the other way round (counted from 0)."
    return ""


def exchanged(e: np.ndarray, i: int, j: int, axis: int) -> np.ndarray:
    """An array with two of its slices exchanged."""
    order = np.arange(e.shape[axis])
    order[[i, j]] = j, i
    return np.take(e, order, axis)


@relation
def shifted_by_one(view: View) -> str:
    """Along an axis; what comes in at the end is not looked at."""
    if not view.shaped or not any(wrong.any() for wrong in view.wrong()):
        return ""
    for axis, step in itertools.product(axes(view), (1, -1)):
        inner = (slice(None),) * axis
        to, back = (slice(1, None), slice(None, -1))[::step]
        pairs = [(e[(*inner, back)], g[(*inner, to)]) for e, g in zip(view.expected, view.got, strict=True)]
        moved = [e[(*inner, back)][view.different(e[(*inner, back)], e[(*inner, to)])].ravel() for e in view.expected]
        if all(view.same(e, g) for e, g in pairs) and view.by_chance(np.concatenate(moved)) < BY_CHANCE:
            where = "after" if step == 1 else "before"
            return (
                f"Your values are right, but each stands one place {where} its own {along(axis, view)}".rstrip() + "."
            )
    return ""


@relation
def one_too_few(view: View) -> str:
    """The first or last along an axis left out, or one too many there."""
    turned = replace(view, expected=view.got, got=view.expected)
    for axis, name in itertools.product(axes(view), ("first", "last")):
        kept = (*((slice(None),) * axis), slice(1, None) if name == "first" else slice(None, -1))
        what = one(view) if axis == 0 else "column" if axis == 1 else f"entry along axis {axis}"
        if view.gives(lambda e, kept=kept: e[kept]):
            return f"The {name} {what} is missing; all others are right."
        if turned.gives(lambda e, kept=kept: e[kept]):
            return f"Your {name} {what} is one too many; all others are right."
    return ""


# ------------------------------------------------------------------------------------------ number by number

SIGN = "Each of your numbers has the wrong sign."
FUNCTIONS = {
    SIGN: np.negative,
    "The signs are lost: yours are the absolute values.": np.abs,
    "Each of your numbers is 1 minus the right one. Whose share is asked for?": lambda e: 1.0 - e,
    "Each of your numbers is 1 over the right one. What is divided by what?": lambda e: 1.0 / e,
    "Each of your numbers is the square of the right one: is a root missing?": np.square,
    "Each of your numbers is the root of the right one. Is it the square that is asked for?": np.sqrt,
    "Each of your numbers is the logarithm of the right one.": np.log,
    "Each of your numbers is minus the logarithm of the right one.": lambda e: -np.log(e),
    "Each of your numbers is the exponential of the right one: a logarithm is missing.": np.exp,
    "Your numbers are the right ones without their fractions. Where do they become whole numbers?": np.trunc,
    "Your numbers are the right ones, rounded. Where do they become whole numbers?": np.round,
    "Your numbers wrap around at 256: somewhere they are bytes (uint8).": lambda e: np.mod(e, 256),
    "Yours is true exactly where the right one is false.": lambda e: ~e if e.dtype.kind == "b" else None,
}


@relation
def function_of_the_right_value(view: View) -> str:
    """A function of the right value, one of FUNCTIONS."""
    if view.shaped and np.unique(view.numbers()[0]).size < 2:  # one number: any function of it would do
        return ""
    return next((says for says, function in FUNCTIONS.items() if view.gives(function)), "")


def wrong_sign(view: View) -> str:
    """SIGN, or "": a sign can be turned at many places of a program, all of them as good, so that none is marked."""
    with quiet():
        return SIGN if function_of_the_right_value(view) == SIGN else ""


CONSTANTS = {
    2.0: "2",
    3.0: "3",
    4.0: "4",
    180.0 / np.pi: "180 / pi (degrees, radians)",
    np.pi: "pi",
    2.0 * np.pi: "2 pi",
    255.0: "255 (bytes, numbers from 0 to 1)",
    256.0: "256",
    1000.0: "1000 (millimetres, metres)",
    1e6: "a million",
    1e9: "1e9 (nanoseconds, seconds)",
    1.0 / np.log(2.0): "log 2 (another base of the logarithm)",
    np.log(10.0): "log 10 (another base of the logarithm)",
    np.sqrt(2.0): "the root of 2",
}


@relation
def factor(view: View) -> str:
    """One factor in all cases that has a name."""
    e, g = view.numbers() if view.shaped else (np.zeros(0), np.zeros(0))
    use = np.isfinite(e) & (e != 0.0)
    if np.unique(e[use]).size < 2:
        return ""
    k = abs(float(np.median(g[use] / e[use])))
    for value, name in CONSTANTS.items():
        for size, words in ((value, "large"), (1.0 / value, "small")):
            for sign in (1.0, -1.0):
                if np.isclose(k, size, rtol=1e-3, atol=0.0) and view.gives(lambda e, s=sign * size: s * e):
                    too = ", and they have the wrong sign" if sign < 0 else ""
                    return f"Your numbers are too {words} by a factor of {name}{too}."
    return ""


# --------------------------------------------------------------------------------------------------- places


@relation
def only_at_a_place(view: View) -> str:
    """Where it is wrong, if that has a name, and all else is right."""
    if not view.shaped:
        return ""
    wrong = view.wrong()
    for name, masks in places(view):
        pairs = list(zip(wrong, masks, strict=True))
        shows, refutes = sum(w.any() for w, _ in pairs), sum(m.any() and not w.any() for w, m in pairs)
        inside = all(not (w & ~m).any() for w, m in pairs)
        if inside and refutes <= shows and np.prod([inside_by_chance(w, m) for w, m in pairs]) < BY_CHANCE:
            return f"It is wrong only {name}; all else is right."
    return ""


def inside_by_chance(wrong: np.ndarray, mask: np.ndarray) -> float:
    """How likely what is wrong in a case lies inside of a mask: one number or one blob does by the mask's share.

    A mask that is wrong as a whole is no chance.
    """
    if not wrong.any():
        return 1.0
    return mask.mean() ** (mask.sum() if (wrong == mask).all() else 1)


def places(view: View) -> Iterator[tuple[str, Sequence[np.ndarray]]]:
    """Places that a student knows by name, with masks for every case."""
    for i, name in enumerate(view.names):
        values = [np.asarray(args[i]) for args in view.args]
        ignored = course().ignored
        for says, number in ((f"is {ignored}", ignored), ("is NaN", np.nan), ("is 0", 0)):
            pairs = list(zip(view.expected, values, strict=True))
            if not all(v.dtype.kind in "iuf" and v.shape == e.shape[: v.ndim] for e, v in pairs):
                continue
            if not any(v.ndim for v in values):  # a single pixel is a place where others are pictures
                continue
            if number is None or (number == ignored and not all(v.dtype == np.uint8 for v in values)):
                continue
            masks = [np.isnan(v.astype(float)) if number != number else v == number for v in values]
            yield f"where {name} {says}", [spread(m, e) for m, e in zip(masks, view.expected, strict=True)]
    yield "where NaN is expected", [np.isnan(e.astype(float)) for e in view.expected]
    if all(e.ndim == 2 for e in view.expected):
        for name, index in (
            ("first row", (0,)),
            ("last row", (-1,)),
            ("first column", (..., 0)),
            ("last column", (..., -1)),
        ):
            yield f"in the {name}", [entry_at(e, index) for e in view.expected]
        yield "at the border", [border(e) for e in view.expected]


def spread(mask: np.ndarray, e: np.ndarray) -> np.ndarray:
    """A mask of pixels for an array that has more axes."""
    return np.broadcast_to(mask.reshape(mask.shape + (1,) * (e.ndim - mask.ndim)), e.shape)


def entry_at(e: np.ndarray, index: tuple) -> np.ndarray:
    """A mask of an index."""
    mask = np.zeros(e.shape, bool)
    if e.size:
        mask[index] = True
    return mask


def border(e: np.ndarray) -> np.ndarray:
    """A mask of the first and last rows and columns."""
    mask = np.ones(e.shape, bool)
    mask[1:-1, 1:-1] = False
    return mask
