"""What wrong outputs have to do with the right ones: transposed, doubled, shifted by one, minus the right ones ...

Each relation is one small function of a `View`, which holds the expected and the returned array of every case. It gives
one sentence for the student, "" if it does not hold; it holds only if it does so in every case that can show it.
ARRANGED are relations of whole arrays; NUMBERS are relations number by number, which can also be asked of some places
alone (`places`).
"""

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np


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

    def different(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Where two arrays of one shape differ; truth values are no numbers."""
        if (a.dtype.kind == "b") != (b.dtype.kind == "b"):
            return np.ones(a.shape, bool)
        if a.dtype.kind != "f" and b.dtype.kind != "f":
            return np.asarray(a != b)
        with np.errstate(all="ignore"):
            return ~np.isclose(np.asarray(b, float), np.asarray(a, float), self.rtol, self.atol, equal_nan=True)

    def same(self, a: np.ndarray, b: np.ndarray) -> bool:
        """Whether two arrays are equal within the tolerance."""
        return a.shape == b.shape and not self.different(a, b).any()

    def is_(self, predicted: Sequence[np.ndarray | None]) -> bool:
        """Whether these are the returned arrays, and not all the expected ones; None counts as the expected one."""
        shows = 0
        for e, g, p in zip(self.expected, self.got, predicted, strict=True):
            if not self.same(e if p is None else p, g):
                return False
            shows += p is not None and not self.same(e, p)
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


def relation(entries: list[Relation]) -> Callable[[Relation], Relation]:
    """Enter a relation in a list."""

    def enter(function: Relation) -> Relation:
        entries.append(function)
        return function

    return enter


def attempt(change: Callable, *arguments) -> np.ndarray | None:
    """The array that a change gives; None if it cannot be made."""
    try:
        with np.errstate(all="ignore"):
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
            return f"The values are right, the axes are in another order: your axis 0 should be axis {order[0]}."
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


@relation(ARRANGED)
def scaled_line_by_line(view: View) -> str:
    """A factor for each row, column or pixel: normalised along the wrong axis, or not at all."""
    if not view.shaped or len(axes(view)) < 2:
        return ""
    for axis in axes(view):
        if not all(factors_along(view, e, g, axis) for e, g in zip(view.expected, view.got, strict=True)):
            continue
        if not all(np.allclose(e.sum(axis), 1.0) for e in view.expected):
            return f"Yours are the right values times a factor that is constant {ordinal(axis, view)}, but not 1."
        for other in axes(view):
            if other != axis and all(np.allclose(g.sum(other), 1.0) for g in view.got):
                return f"Your values sum to 1 {ordinal(other, view)}; they should sum to 1 {ordinal(axis, view)}."
        return f"Your values should sum to 1 {ordinal(axis, view)} and do not: divide by what they sum to."
    return ""


def factors_along(view: View, e: np.ndarray, g: np.ndarray, axis: int) -> bool:
    """Whether g is e times a factor that is constant along one axis, longer than 1."""
    if e.shape[axis] < 2 or e.dtype.kind == "b" or g.dtype.kind == "b":
        return view.same(e, g)
    with np.errstate(all="ignore"):
        factor = np.sum(g * e, axis, keepdims=True, dtype=float) / np.sum(
            np.square(e, dtype=float), axis, keepdims=True
        )
    return bool(np.isfinite(factor).all() and (factor != 0).all() and view.same(e * factor, g))


# ---------------------------------------------------------------------------------------- number by number

FUNCTIONS = {
    "The sign is the other one.": np.negative,
    "The sign is lost: yours are the absolute values.": np.abs,
    "Each of yours is 1 minus the right value.": lambda e: 1.0 - e,
    "Each of yours is 1 over the right value: numerator and denominator are exchanged.": lambda e: 1.0 / e,
    "Each of yours is the square of the right value: is a root missing?": np.square,
    "Each of yours is the root of the right value: is it not to be squared?": np.sqrt,
    "Yours are the logarithms of the right values.": np.log,
    "Yours are minus the logarithms of the right values.": lambda e: -np.log(e),
    "Yours are the exponentials of the right values: a logarithm is missing.": np.exp,
    "The right values are minus the logarithms of yours.": lambda e: np.exp(-e),
    "Yours are sines of the right values.": np.sin,
    "Yours are rounded down to whole numbers.": np.floor,
    "Yours are rounded to whole numbers.": np.round,
    "Yours are rounded up to whole numbers.": np.ceil,
    "Yours are cut off below 0.": lambda e: np.maximum(e, 0),
    "Yours are cut off above 1.": lambda e: np.minimum(e, 1),
    "Yours are cut off to 0 ... 1.": lambda e: np.clip(e, 0, 1),
    "Yours are cut off to 0 ... 255.": lambda e: np.clip(e, 0, 255),
    "Your numbers wrap round at 256: the sum or product was formed in uint8.": lambda e: np.mod(e, 256),
    "Your numbers wrap round at 65536: they were formed in 16 bits.": lambda e: np.mod(e, 65536),
    "Yours is true exactly where the right one is false.": lambda e: ~e if e.dtype.kind == "b" else None,
}


@relation(NUMBERS)
def function_of_the_right_value(view: View) -> str:
    """A function of the right value, one of FUNCTIONS."""
    return next((says for says, function in FUNCTIONS.items() if view.gives(function)), "")


CONSTANTS = {
    2.0: "2",
    3.0: "3",
    4.0: "4",
    8.0: "8",
    10.0: "10",
    100.0: "100",
    180.0 / np.pi: "180 / pi: degrees and radians",
    np.pi: "pi",
    2.0 * np.pi: "2 pi",
    255.0: "255: bytes and numbers from 0 to 1",
    256.0: "256",
    1000.0: "1000: millimetres and metres",
    1e6: "a million",
    1e9: "1e9: nanoseconds and seconds",
    1.0 / np.log(2.0): "log 2: another base of the logarithm",
    np.log(10.0): "log 10: another base of the logarithm",
    np.sqrt(2.0): "the root of 2",
    np.sqrt(3.0): "the root of 3",
}


@relation(NUMBERS)
def factor(view: View) -> str:
    """One factor in each case: a constant, a quantity of the arguments, or one that cannot be named."""
    factors = [factor_of(view, e, g) for e, g in zip(view.expected, view.got, strict=True)]
    told = [k for k in factors if k is not None and np.isfinite(k)]
    if not told or any(k is not None and not np.isfinite(k) for k in factors) or max(map(abs, told)) == 0.0:
        return ""
    if all(np.isclose(k, 1.0, rtol=view.rtol, atol=0) for k in told) or not enough(view, told):
        return ""
    if np.allclose(told, told[0], rtol=max(1e-4, view.rtol)):
        k = told[0]
        sign = " and the sign is the other one" if k < 0 else ""
        for value, name in CONSTANTS.items():
            for size, words in ((value, "large"), (1.0 / value, "small")):
                if np.isclose(abs(k), size, rtol=1e-3):
                    return f"Yours are too {words} by a factor of {name}{sign}."
        return f"Yours are the right values times {k:.4g}, in every case."
    for name, values in quantities(view):
        pairs = [(k, q) for k, q in zip(factors, values, strict=True) if k is not None]
        for power, words in ((1, "large"), (-1, "small"), (2, "large"), (-2, "small"), (0.5, "large"), (-0.5, "small")):
            with np.errstate(all="ignore"):
                if all(q is not None and q > 0 and np.isclose(abs(k), q**power, rtol=1e-3) for k, q in pairs):
                    of = {1: name, 2: f"the square of {name}", 0.5: f"the root of {name}"}[abs(power)]
                    return f"Yours are too {words} by a factor that is {of}: divide or multiply by it."
    return (
        "In each case yours are the right values times one number, another in each case: something is scaled wrongly."
    )


def enough(view: View, told: list) -> bool:
    """Whether there is enough to see that it is one number: two values in a case, or two cases."""
    return len(told) > 1 or view.numbers()[0].size > 2


def factor_of(view: View, e: np.ndarray, g: np.ndarray) -> float | None:
    """The number k with g = k e; NaN if there is none, None if every k would do."""
    if e.shape != g.shape or e.dtype.kind == "b" or g.dtype.kind == "b":
        return np.nan
    e, g = e.astype(float), g.astype(float)
    use = np.isfinite(e) & (e != 0.0)
    if not use.any():
        return None if view.same(e, g) else np.nan
    k = float(np.median(g[use] / e[use]))
    return k if view.same(k * e, g) else np.nan


@relation(NUMBERS)
def offset(view: View) -> str:
    """The same number added everywhere in a case: a constant, a quantity of the arguments, or one without a name."""
    offsets = [offset_of(view, e, g) for e, g in zip(view.expected, view.got, strict=True)]
    told = [c for c in offsets if c is not None]
    if (
        not told
        or not np.isfinite(told).all()
        or not enough(view, told)
        or np.allclose(told, 0.0, atol=max(view.atol, 1e-9))
    ):
        return ""
    if np.allclose(told, told[0], rtol=max(1e-4, view.rtol), atol=max(view.atol, 1e-9)):
        return f"Yours are too {'large' if told[0] > 0 else 'small'} by {abs(told[0]):.4g}, in every case."
    for name, values in quantities(view):
        pairs = [(c, q) for c, q in zip(offsets, values, strict=True) if c is not None]
        for sign, words in ((1.0, "large"), (-1.0, "small")):
            for part, of in ((1.0, ""), (2.0, "twice "), (0.5, "half of ")):
                if all(q is not None and np.isclose(c, sign * part * q, rtol=1e-3, atol=view.atol) for c, q in pairs):
                    return f"Yours are too {words} by {of}{name}."
    return "In each case yours are off by one and the same number, another in each case: a term is missing or too much."


def offset_of(view: View, e: np.ndarray, g: np.ndarray) -> float | None:
    """The number c with g = e + c; NaN if there is none, None if there are no numbers."""
    if e.shape != g.shape or e.dtype.kind == "b" or g.dtype.kind == "b":
        return np.nan
    e, g = e.astype(float), g.astype(float)
    use = np.isfinite(e)
    if not use.any():
        return None if view.same(e, g) else np.nan
    c = float(np.median(g[use] - e[use]))
    return c if view.same(e + c, g) else np.nan


@relation(NUMBERS)
def straight_line(view: View) -> str:
    """A factor and an offset, the same in every case."""
    if not view.shaped:
        return ""
    e, g, _ = view.numbers()
    use = np.isfinite(e) & np.isfinite(g)
    if np.unique(e[use]).size < 4 or any(a.dtype.kind == "b" for a in (*view.expected, *view.got)):
        return ""
    k, c = np.polyfit(e[use], g[use], 1)
    if abs(k) < 1e-9 or not view.gives(lambda e: k * e + c):
        return ""
    return f"Each of yours is {k:.4g} times the right value {'plus' if c > 0 else 'minus'} {abs(c):.4g}."


@relation(NUMBERS)
def always_the_same(view: View) -> str:
    """One number, whatever the arguments are."""
    if not view.shaped:
        return ""
    e, g, _ = view.numbers()
    if g.size < 2 or not view.same(g, np.full(g.shape, g[0])) or view.same(e, np.full(e.shape, e[0])):
        return ""
    first = next(a.flat[0] for a in view.got if a.size)
    return f"Yours is always {first if first.dtype.kind == 'b' else f'{first:.4g}'}, whatever the arguments are."


@relation(NUMBERS)
def an_argument(view: View) -> str:
    """A number of the arguments, or a quantity of theirs, in the place of the right one."""
    for name, values in quantities(view):
        if view.shaped and view.is_(
            [None if q is None else np.full(e.shape, float(q)) for e, q in zip(view.expected, values, strict=True)]
        ):
            return f"What stands there is {name}."
    return ""


@relation(NUMBERS)
def values_taken_for_others(view: View) -> str:
    """Whole numbers: wherever one is expected, there always is another."""
    if not view.shaped or any(a.dtype.kind not in "iub" for a in (*view.expected, *view.got)):
        return ""
    e, g, _ = view.numbers()
    if not e.size:
        return ""
    values = np.unique(e)
    if values.size > 8:
        return ""
    taken = {}
    for value in values:
        seen = np.unique(g[e == value])
        if seen.size != 1:
            return ""
        if seen[0] != value:
            taken[value] = seen[0]
    if not taken or (len(taken) == values.size and values.size < 2):
        return ""
    return " ".join(f"Wherever {e:g} is right, you have {g:g}." for e, g in list(taken.items())[:3])


def quantities(view: View) -> Iterator[tuple[str, list[float | None]]]:
    """Numbers that the arguments hold: their values, lengths and sizes, the same one for every case."""
    for i, name in enumerate(view.names):
        values = [args[i] for args in view.args]
        if all(np.ndim(v) == 0 for v in values):
            yield name, [float(v) for v in values]
            continue
        if not all(isinstance(v, np.ndarray) for v in values):
            continue
        for axis in range(min(v.ndim for v in values)):
            length = (
                {0: "rows", 1: "columns"}.get(axis, f"entries along axis {axis}") if values[0].ndim > 1 else "entries"
            )
            yield f"the number of {length} of {name}", [float(v.shape[axis]) for v in values]
        if values[0].ndim > 1:
            yield f"the number of all entries of {name}", [float(v.size) for v in values]
            if all(v.ndim > 2 for v in values):
                yield f"the number of pixels of {name}", [float(v.size // v.shape[-1]) for v in values]
        if all(v.dtype.kind in "iuf" for v in values):
            yield f"the sum of {name}", [float(v.sum()) for v in values]
            if all(v.size for v in values):
                yield f"the largest of {name}", [float(v.max()) for v in values]
                yield f"the smallest of {name}", [float(v.min()) for v in values]
                yield f"the mean of {name}", [float(v.mean()) for v in values]
        if all(v.dtype == np.uint8 for v in values):
            yield (
                f"the number of entries of {name} that are not 255",
                [float(np.count_nonzero(v != 255)) for v in values],
            )
        if all(v.dtype.kind == "b" for v in values):
            yield f"the number of true entries of {name}", [float(np.count_nonzero(v)) for v in values]


# --------------------------------------------------------------------------------- made of the arguments alone


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


@relation(ARRANGED)
def the_right_one_and_an_argument(view: View) -> str:
    """The right value times, divided by, plus or minus an argument."""
    for name, values in ingredients(view):
        if any(v is None or v.dtype.kind not in "iuf" for v in values):
            continue
        for words, operation in OPERATIONS.items():
            for fitted in (lambda v: v, lambda v: v[..., None], lambda v: v[..., None, None]):
                predicted = [
                    attempt(lambda e, v, f=fitted, o=operation: o(e, f(v)), e, v)
                    for e, v in zip(view.expected, values, strict=True)
                ]
                if view.is_(predicted):
                    return f"Yours are the right values {words} {name}."
    return ""


@relation(ARRANGED)
def made_of_the_arguments(view: View) -> str:
    """Something simple of one argument, or of two that are combined."""
    first = next(i for i, (e, g) in enumerate(zip(view.expected, view.got, strict=True)) if not view.same(e, g))
    known = [(name, v) for name, v in ingredients(view) if v[first] is not None and v[first].dtype.kind in "iufb"]
    for name, values in known:
        if view.same(values[first], view.got[first]) and view.is_(values):
            return f"What you return is {name}: what else has to be done with it?"
    known = [(name, v) for name, v in known if v[first].dtype.kind != "b" and v[first].ndim <= view.got[first].ndim]
    for (a, xs), (b, ys) in itertools.permutations(known, 2):
        for words, operation in OPERATIONS.items():
            predicted = attempt(operation, xs[first], ys[first])
            if predicted is None or not view.same(predicted, view.got[first]):
                continue
            if view.is_([attempt(operation, x, y) for x, y in zip(xs, ys, strict=True)]):
                return f"What you return is {a} {words} {b}."
    return ""
