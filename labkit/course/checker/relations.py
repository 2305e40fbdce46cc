"""What wrong outputs have to do with the right ones: transposed, doubled, shifted by one, minus the right ones ...

Each relation is one small function of a `View`, which holds the expected and the returned array of every case. It gives
one sentence for the student, "" if it does not hold; it holds only if it does so in every case that can show it.
ARRANGED are relations of whole arrays; NUMBERS are relations number by number, which can also be asked of some places
alone (`places`); COMBINED are those with the arguments and steps; LOOSE are true of more answers, so they come late.
"""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from labkit.course.checker.comparison import quiet

Array = np.ndarray | np.generic


@dataclass(frozen=True)
class View:
    """The expected and the returned array of each case, with the case's arguments and their names.

    rtol, atol: what counts as equal. steps: what the reference computes on the way, see `steps`.
    """

    expected: tuple[np.ndarray, ...]
    got: tuple[np.ndarray, ...]
    args: tuple[tuple, ...]
    names: tuple[str, ...]
    rtol: float
    atol: float
    steps: tuple[tuple[str, list], ...] = ()

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

    def is_(self, predicted: Sequence[np.ndarray | None]) -> bool:
        """Whether these are the returned arrays, and not all the expected ones; None counts as the expected one.

        Zeros show nothing: too many things are zero.
        """
        shows = 0
        for e, g, p in zip(self.expected, self.got, predicted, strict=True):
            if not self.same(e if p is None else p, g):
                return False
            shows += p is not None and not self.same(e, p) and not (np.abs(np.asarray(p, float)) <= self.atol).all()
        return shows > 0

    def gives(self, change: Callable) -> bool:
        """Whether a change of the expected arrays makes them the returned ones."""
        return self.is_([attempt(change, e) for e in self.expected])

    @property
    def shaped(self) -> bool:
        """Whether every array has its right shape."""
        return all(e.shape == g.shape for e, g in zip(self.expected, self.got, strict=True))

    def wrong(self) -> list[np.ndarray]:
        """Where the arrays differ, if they have their right shapes."""
        return [self.different(e, g) for e, g in zip(self.expected, self.got, strict=True)]

    def at(self, masks: Sequence[np.ndarray]) -> "View":
        """The numbers at some places alone."""
        expected = tuple(e[mask] for e, mask in zip(self.expected, masks, strict=True))
        return replace(self, expected=expected, got=tuple(g[mask] for g, mask in zip(self.got, masks, strict=True)))

    def numbers(self) -> tuple[np.ndarray, np.ndarray, list[int]]:
        """All expected and returned numbers in a row, as floats, and how many belong to each case."""
        e, g = (np.concatenate([np.ravel(a).astype(float) for a in arrays]) for arrays in (self.expected, self.got))
        return e, g, [np.size(a) for a in self.expected]


Relation = Callable[[View], str]
ARRANGED: list[Relation] = []
NUMBERS: list[Relation] = []
COMBINED: list[Relation] = []
LOOSE: list[Relation] = []


def relation(entries: list[Relation]) -> Callable[[Relation], Relation]:
    """Enter a relation in a list."""

    def enter(function: Relation) -> Relation:
        entries.append(function)
        return function

    return enter


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


def ordinal(axis: int, view: View) -> str:
    """The name of an axis."""
    if all(e.ndim == 2 for e in view.expected):
        return ("from row to row", "from column to column")[axis]
    return f"along axis {axis}" if axis >= 0 else "along the last axis"


# ------------------------------------------------------------------------------------------- whole arrays


@relation(ARRANGED)
def transposed(view: View) -> str:
    """Rows and columns exchanged."""
    if view.gives(lambda e: np.swapaxes(e, 0, 1)):
        return "Rows and columns are exchanged: your output is the transpose of the right one."
    return ""


@relation(ARRANGED)
def axes_in_another_order(view: View) -> str:
    """Of three or four axes."""
    for order in itertools.permutations(axes(view)) if 3 <= len(axes(view)) <= 4 else ():
        if view.gives(lambda e, order=order: np.transpose(e, order)):
            return f"The values are right; your axes are the right ones in the order {', '.join(map(str, order))}."
    return ""


@relation(ARRANGED)
def another_shape(view: View) -> str:
    """The right values in reading order."""
    if view.shaped or not all(view.same(e.ravel(), g.ravel()) for e, g in zip(view.expected, view.got, strict=True)):
        return ""
    return (
        "The values are right and in the right order, only the shape is another: is there an axis too many or too few?"
    )


@relation(ARRANGED)
def reversed_along_an_axis(view: View) -> str:
    """The last one first."""
    for axis in axes(view):
        if view.gives(lambda e, axis=axis: np.flip(e, axis)):
            return f"The order {ordinal(axis, view)} is reversed: the last one comes first."
    return ""


@relation(ARRANGED)
def two_exchanged(view: View) -> str:
    """Two of a few rows or columns."""
    for axis in (-1, 0) if len(axes(view)) > 1 else (0,) if axes(view) else ():
        length = min(e.shape[axis] for e in view.expected)
        for i, j in itertools.combinations(range(length), 2) if length <= 6 else ():
            if view.gives(lambda e, i=i, j=j, axis=axis: exchanged(e, i, j, axis)):
                return f"Numbers {i} and {j} {ordinal(axis, view)} are exchanged (counted from 0)."
    return ""


def exchanged(e: np.ndarray, i: int, j: int, axis: int) -> np.ndarray:
    """An array with two of its slices exchanged."""
    order = np.arange(e.shape[axis])
    order[[i, j]] = j, i
    return np.take(e, order, axis)


@relation(ARRANGED)
def shifted_by_one(view: View) -> str:
    """Along an axis; what comes in at the end is not looked at."""
    if not view.shaped or not any(wrong.any() for wrong in view.wrong()):
        return ""
    for axis, (step, words) in itertools.product(axes(view), ((1, "forward"), (-1, "back"))):
        inner = (slice(None),) * axis
        to, back = (slice(1, None), slice(None, -1))[::step]
        pairs = [(e[(*inner, back)], g[(*inner, to)]) for e, g in zip(view.expected, view.got, strict=True)]
        if all(view.same(e, g) for e, g in pairs) and sum(e.size for e, _ in pairs) > 3 and varies(view, axis):
            return f"Everything is shifted by one {ordinal(axis, view)}, {words}."
    return ""


def varies(view: View, axis: int) -> bool:
    """Whether the expected arrays change along an axis, so that a shift would show."""
    return any(np.size(e) and not view.same(e, np.roll(e, 1, axis)) for e in view.expected)


@relation(ARRANGED)
def one_too_few(view: View) -> str:
    """The first or last along an axis left out."""
    for axis in axes(view):
        inner = (slice(None),) * axis
        for name, kept in (("last", slice(None, -1)), ("first", slice(1, None))):
            if view.gives(lambda e, inner=inner, kept=kept: e[(*inner, kept)]):
                return f"The {name} one {ordinal(axis, view)} is missing; all others are right."
    return ""


@relation(ARRANGED)
def one_too_many(view: View) -> str:
    """One more along an axis."""
    turned = replace(view, expected=view.got, got=view.expected)
    if one_too_few(turned):
        return f"There is one too many: {one_too_few(turned).partition(' is missing')[0].lower()} should not be there."
    return ""


@relation(ARRANGED)
def right_values_elsewhere(view: View) -> str:
    """The same numbers in another order."""
    big = [np.size(e) > 2 and np.unique(e).size > 2 for e in view.expected]
    if not any(big):
        return ""
    sort = [(np.sort(e, axis=None), np.sort(g, axis=None)) for e, g in zip(view.expected, view.got, strict=True)]
    return "All the right values are there, but at other places." if all(view.same(e, g) for e, g in sort) else ""


@relation(ARRANGED)
def one_row_for_all(view: View) -> str:
    """Every row is the right first, or last, one; the same for columns."""
    for axis, (name, at) in itertools.product(axes(view), (("first", 0), ("last", -1))):
        if view.gives(lambda e, axis=axis, at=at: np.broadcast_to(np.take(e, [at], axis), e.shape)):
            return f"All are alike {ordinal(axis, view)}: everywhere stands what is right for the {name} one."
    return ""


@relation(ARRANGED)
def summed_up(view: View) -> str:
    """Sums from the beginning on, in place of the numbers; or differences."""
    for axis in axes(view):
        if view.gives(lambda e, axis=axis: np.cumsum(e, axis)):
            return f"Your values add up {ordinal(axis, view)}: each holds the sum of those before it, too."
    return ""


@relation(COMBINED)
def scaled_line_by_line(view: View) -> str:
    """A factor for each row, column or pixel: normalised along the wrong axis, or not at all."""
    if not view.shaped or len(axes(view)) < 2:
        return ""
    for axis in axes(view):
        if not all(factors_along(view, e, g, axis) for e, g in zip(view.expected, view.got, strict=True)):
            continue
        if not all(np.allclose(e.sum(axis), 1.0) for e in view.expected):
            return f"Yours are the right values times a number that stays the same {ordinal(axis, view)}, and is not 1."
        for other in axes(view):
            if other != axis and all(np.allclose(g.sum(other), 1.0) for g in view.got):
                return f"Your values sum to 1 {ordinal(other, view)}; they should sum to 1 {ordinal(axis, view)}."
        return f"Your values should sum to 1 {ordinal(axis, view)} and do not: divide by what they sum to."
    return ""


def factors_along(view: View, e: np.ndarray, g: np.ndarray, axis: int) -> bool:
    """Whether g is e times factors that are constant along one axis, along which there is more than one number each."""
    if e.shape[axis] < 2 or e.dtype.kind == "b" or g.dtype.kind == "b":
        return view.same(e, g)
    with np.errstate(all="ignore"):
        factor = np.sum(g * e, axis, keepdims=True, dtype=float) / np.sum(
            np.square(e, dtype=float), axis, keepdims=True
        )
    if not np.isfinite(factor).all() or (factor == 0).any() or not view.same(e * factor, g):
        return False
    scaled = ~np.isclose(factor, 1.0, rtol=view.rtol, atol=0.0)
    return bool((np.count_nonzero(e, axis=axis, keepdims=True)[scaled] > 1).all())
