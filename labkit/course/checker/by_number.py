"""Relations of wrong outputs to the right ones number by number: a sign, a factor, an offset, a function, a constant.

They are the NUMBERS of `relations`, where the rules for them stand.
"""

from collections.abc import Iterator

import numpy as np

from labkit.course.checker.relations import LOOSE, NUMBERS, Relation, View, relation

DIRECTIONS: list[Relation] = []  # true of many wrong answers, so they are asked last


@relation(NUMBERS)
def always_the_same(view: View) -> str:
    """One number, whatever the arguments are, also in another shape."""
    e, g, _ = view.numbers()
    if g.size < 2 or np.isnan(g[0]) or not view.same(g, np.full(g.shape, g[0])):
        return ""
    if e.size and view.same(e, np.full(e.shape, e[0])) and not np.isnan(e[0]):
        return ""  # then it is an offset
    first = next(a.flat[0] for a in view.got if a.size)
    said = first if first.dtype.kind == "b" else f"{0 if view.same(g, np.zeros(g.shape)) else first:.4g}"
    return f"Yours is always {said}, in all cases."


@relation(NUMBERS)
def values_taken_for_others(view: View) -> str:
    """Whole numbers: wherever one is expected, there always is another."""
    if not view.shaped or any(a.dtype.kind not in "iub" for a in (*view.expected, *view.got)):
        return ""
    e, g, _ = view.numbers()
    if not e.size:
        return ""
    values = np.unique(e)
    if values.size > 8 or e.size < 3 * values.size or np.isin([*values, *g], (0, 1)).all():  # too few to see a rule
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
    "Yours are whole numbers: the right ones without their fractions.": np.trunc,
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
    if view.shaped and np.unique(view.numbers()[0]).size < 2:  # one number: any function of it would do
        return ""
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
    right = np.isclose(told, 1.0, rtol=view.rtol, atol=0)
    if right.all() or not enough(view, told):
        return ""
    if np.allclose(told, told[0], rtol=max(1e-4, view.rtol), atol=0.0) and not right.any():
        k = told[0]
        if np.isclose(k, -1.0):
            return "The sign is the other one."
        sign = " and the sign is the other one" if k < 0 else ""
        for value, name in CONSTANTS.items():
            for size, words in ((value, "large"), (1.0 / value, "small")):
                if np.isclose(abs(k), size, rtol=1e-3, atol=0.0):
                    return f"Yours are too {words} by a factor of {name}{sign}."
        return f"Yours are the right values times {k:.{4 if abs(k - 1.0) > 1e-3 else 8}g}, in every case."
    for name, values in quantities(view):
        pairs = [(k, q) for k, q in zip(factors, values, strict=True) if k is not None]
        for power, words in ((1, "large"), (-1, "small"), (2, "large"), (-2, "small"), (0.5, "large"), (-0.5, "small")):
            with np.errstate(all="ignore"):
                if all(q is not None and q > 0 and np.isclose(abs(k), q**power, rtol=1e-3, atol=0.0) for k, q in pairs):
                    of = {1: name, 2: f"the square of {name}", 0.5: f"the root of {name}"}[abs(power)]
                    return f"Yours are too {words} by a factor that is {of}: divide or multiply by it."
    return ""


@relation(LOOSE)
def some_factor(view: View) -> str:
    """A factor in each case that cannot be named."""
    factors = [factor_of(view, e, g) for e, g in zip(view.expected, view.got, strict=True)]
    if not several(view) or not all(k is None or (np.isfinite(k) and k) for k in factors):
        return ""
    return "In each case yours are the right values times one number, another in each case."


def enough(view: View, told: list) -> bool:
    """Whether there is enough to see that it is one number: two values in a case, or two cases."""
    return len(told) > 1 or view.numbers()[0].size > 2


def several(view: View) -> bool:
    """Whether some wrong cases hold several different numbers, so that one number for each case is no accident."""
    wrong = [e for e, g in zip(view.expected, view.got, strict=True) if not view.same(e, g)]
    return sum(np.unique(e[np.isfinite(e)]).size > 2 for e in wrong if e.dtype.kind == "f") > 1


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
    return ""


@relation(LOOSE)
def some_offset(view: View) -> str:
    """An offset in each case that cannot be named."""
    offsets = [offset_of(view, e, g) for e, g in zip(view.expected, view.got, strict=True)]
    if not several(view) or not all(c is None or np.isfinite(c) for c in offsets):
        return ""
    return "In each case yours are off by one number, another in each case: which term is it?"


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
    if abs(k) < 1e-9 or abs(k - 1) < 1e-9 or not view.gives(lambda e: k * e + c):
        return ""
    return f"Each of yours is {k:.4g} times the right value {'plus' if c > 0 else 'minus'} {abs(c):.4g}."


@relation(LOOSE)
def no_number(view: View) -> str:
    """All that is wrong is NaN, or infinite."""
    _, g, wrong = wrong_numbers(view)
    if not wrong.any() or np.isfinite(g[wrong]).any():
        return ""
    if np.isnan(g[wrong]).all() and any(np.isnan(right).any() for right in view.expected):
        return "NaN stands where a number is right: is it 0 / 0, or do you answer NaN in more cases than are asked for?"
    if np.isnan(g[wrong]).all():
        return (
            "What is wrong is NaN: nothing was written there, or it is 0 / 0, infinite over or minus infinite (an "
            "exponential too large), 0 times infinite, the mean of nothing, or the log or root of a negative number."
        )
    return "What is wrong is infinite: something is divided by 0, or grows without end."


@relation(DIRECTIONS)
def one_direction(view: View) -> str:
    """What is wrong is always too large, or always too small."""
    e, g, wrong = wrong_numbers(view)
    if not np.isfinite(g[wrong]).all() or np.count_nonzero(wrong) < 2:
        return ""
    truths = all(a.dtype.kind == "b" for a in (*view.expected, *view.got))
    for larger, sign, whole in (
        (True, "large", "True where it should be, and elsewhere, too"),
        (False, "small", "True only where it should be, but not everywhere there"),
    ):
        if ((g > e) == larger)[wrong].all():
            if truths:
                return f"Yours is {whole}."
            towards = "; the sign is right" if (np.sign(g) == np.sign(e))[wrong].all() and (e < 0).any() else ""
            return f"Wherever yours are wrong, they are too {sign}{towards}."
    return ""


@relation(DIRECTIONS)
def order_kept(view: View) -> str:
    """The right ones in order of size are yours in order of size, or the reverse."""
    e, g, wrong = wrong_numbers(view)
    if e.size < 6 or np.unique(e).size < 6 or not np.isfinite(e).all() or not np.isfinite(g).all():
        return ""
    if np.count_nonzero(wrong) <= e.size / 2:  # those that are right keep the order anyway
        return ""
    sorted_by_right = g[np.argsort(e, kind="stable")]
    if (np.diff(sorted_by_right) > 0).all():
        return (
            "Yours grow where the right ones grow, in all cases together: is a number in the formula wrong, or is too "
            "much counted?"
        )
    if (np.diff(sorted_by_right) < 0).all():
        return "Yours shrink where the right ones grow: is a sign or a quotient the wrong way round?"
    return ""


def wrong_numbers(view: View) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """All numbers that are expected and that came, and where they differ; nothing if shapes or types are others."""
    if not view.shaped or len({a.dtype.kind == "b" for a in (*view.expected, *view.got)}) > 1:
        return np.zeros(0), np.zeros(0), np.zeros(0, bool)
    e, g, _ = view.numbers()
    return e, g, np.concatenate([np.ravel(w) for w in view.wrong()])


@relation(NUMBERS)
def an_argument(view: View) -> str:
    """A number of the arguments, or a quantity of theirs, in the place of the right one."""
    for name, values in quantities(view):
        if view.shaped and view.is_(
            [None if q is None else np.full(e.shape, float(q)) for e, q in zip(view.expected, values, strict=True)]
        ):
            return f"What stands there is {name}."
    return ""


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
        if max(v.ndim for v in values) > 1:
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
