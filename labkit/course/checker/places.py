"""Where outputs are wrong, if it is at places that have a name: the last row, one column, where NaN is expected ..."""

import contextlib
from collections.abc import Callable, Iterator

import numpy as np

from labkit.course.checker.relations import View

Masks = list[np.ndarray]


def places(view: View) -> Iterator[tuple[str, Masks]]:
    """Names of places outside of which every case is right, the narrowest first, with masks for every case."""
    if not view.shaped:
        return
    wrong = view.wrong()
    if not any(w.any() for w in wrong):
        return
    found = []
    in_wrong = [(name, masks, [w.any() for w in wrong]) for name, masks in in_the_array(view)]
    in_all = [(name, masks, [True] * len(wrong)) for name, masks in (*by_value(view), *by_argument(view))]
    for name, masks, looked_at in (*in_wrong, *in_all):
        inside = all(not (w & ~m).any() for w, m in zip(wrong, masks, strict=True))
        if inside and any((~m).any() for m, look in zip(masks, looked_at, strict=True) if look):
            found.append((sum(int(m.sum()) for m in masks), name, masks))
    yield from ((name, masks) for _, name, masks in sorted(found, key=lambda entry: entry[0]))


def in_the_array(view: View) -> Iterator[tuple[str, Masks]]:
    """Rows, columns, entries, the border, the diagonal."""
    ndims, shapes = {e.ndim for e in view.expected}, {e.shape for e in view.expected}
    if ndims == {1}:
        lengths = {len(e) for e in view.expected}
        names = range(min(lengths)) if len(lengths) == 1 and max(lengths) <= 6 else ()
        yield from ((f"in entry {i}", [at(e, (i,)) for e in view.expected]) for i in names)
        yield from (
            (f"in the {name} entry", [at(e, (i,)) for e in view.expected]) for name, i in (("first", 0), ("last", -1))
        )
    if ndims != {1} and len(ndims) == 1 and 0 not in ndims:
        if len(shapes) == 1 and np.prod(next(iter(shapes))) <= 16:
            for index in np.ndindex(next(iter(shapes))):
                yield f"in the entry at {list(index)}", [at(e, index) for e in view.expected]
        last = {e.shape[-1] for e in view.expected}
        for c in range(next(iter(last))) if len(last) == 1 and next(iter(last)) <= 6 else ():
            yield f"in column {c} of the last axis", [at(e, (..., c)) for e in view.expected]
        for name, index in lines(*ndims):
            yield name, [at(e, index) for e in view.expected]
        yield "at the border", [border(e) for e in view.expected]
        if all(e.ndim == 2 and e.shape[0] == e.shape[1] for e in view.expected):
            yield "on the diagonal", [np.eye(len(e), dtype=bool) for e in view.expected]
            yield "off the diagonal", [~np.eye(len(e), dtype=bool) for e in view.expected]


def lines(ndim: int) -> Iterator[tuple[str, tuple]]:
    """The first and the last one along each axis, all others, and every second one, by their indices."""
    for axis, name in enumerate(("row", "column") if ndim == 2 else [f"entry along axis {k}" for k in range(ndim)]):
        before = (slice(None),) * axis
        yield f"in the first {name}", (*before, 0)
        yield f"in the last {name}", (*before, -1)
        yield f"outside of the last {name}", (*before, slice(None, -1))
        yield f"outside of the first {name}", (*before, slice(1, None))
        yield f"in every second {name}, from the first on", (*before, slice(0, None, 2))
        yield f"in every second {name}, from the second on", (*before, slice(1, None, 2))


def at(e: np.ndarray, index: tuple) -> np.ndarray:
    """A mask of an index; nothing if the array has no such place."""
    mask = np.zeros(e.shape, bool)
    with contextlib.suppress(IndexError):
        mask[index] = True
    return mask


def border(e: np.ndarray) -> np.ndarray:
    """A mask of the first and last rows and columns."""
    mask = np.ones(e.shape, bool)
    mask[1:-1, 1:-1] = False
    return mask


VALUES: dict[str, Callable] = {
    "where NaN is expected": lambda e: np.isnan(e.astype(float)),
    "where 0 is expected": lambda e: e == 0,
    "where something else than 0 is expected": lambda e: e != 0,
    "where 1 is expected": lambda e: e == 1,
    "where True is expected": lambda e: e if e.dtype.kind == "b" else np.ones(e.shape, bool),
    "where False is expected": lambda e: ~e if e.dtype.kind == "b" else np.ones(e.shape, bool),
    "where a negative number is expected": lambda e: e < 0,
    "where a positive number is expected": lambda e: e > 0,
    "where -1 is expected": lambda e: e == -1,
    "where the largest value is expected": lambda e: e == e.max() if e.size else np.zeros(e.shape, bool),
    "where the smallest value is expected": lambda e: e == e.min() if e.size else np.zeros(e.shape, bool),
    "where the right number is above 255": lambda e: e > 255,
}


def by_value(view: View) -> Iterator[tuple[str, Masks]]:
    """Places by what is expected there; of truth values, True and False."""
    truths = all(e.dtype.kind == "b" for e in view.expected)
    for name, mask in VALUES.items():
        if truths and name not in ("where True is expected", "where False is expected"):
            continue
        with np.errstate(all="ignore"):
            if name.endswith("255") and any((np.mod(e, 1) > 0).any() for e in view.expected):
                continue  # fractions were never bytes
            yield name, [np.asarray(mask(e), bool) for e in view.expected]


MARKS: dict[str, Callable] = {
    "is 255": lambda v: v == 255,
    "is 0": lambda v: v == 0,
    "is not 0": lambda v: v != 0,
    "is NaN": lambda v: np.isnan(v),
    "is negative": lambda v: v < 0,
    "is positive": lambda v: v > 0,
    "is the largest": lambda v: v == v.max(),
    "is above 127": lambda v: v > 127,
}


def by_argument(view: View) -> Iterator[tuple[str, Masks]]:
    """Places by what an argument holds there, or by what a number among the arguments is in that case."""
    for i, name in enumerate(view.names):
        values = [args[i] for args in view.args]
        if all(np.ndim(v) == 0 for v in values):
            for says, mark in (
                ("is 0", lambda v: v == 0),
                ("is not 0", lambda v: v != 0),
                ("is 1", lambda v: v == 1),
                ("is above 1", lambda v: v > 1),
            ):
                yield (
                    f"in cases where {name} {says}",
                    [np.full(e.shape, bool(mark(v))) for e, v in zip(view.expected, values, strict=True)],
                )
            continue
        pairs = list(zip(view.expected, values, strict=True))
        if not all(isinstance(v, np.ndarray) and v.dtype.kind in "iufb" and v.size for v in values):
            continue
        bytes_alone = all(v.dtype == np.uint8 for v in values)
        for says, mark in MARKS.items():
            if not bytes_alone and says in ("is 255", "is above 127"):
                continue
            with np.errstate(all="ignore"):
                if all(v.shape == e.shape[: v.ndim] for e, v in pairs):
                    yield f"where {name} {says}", [spread(mark(v), e) for e, v in pairs]
                elif says in ("is 255", "is NaN") and all(e.shape == v.shape[: e.ndim] and e.ndim for e, v in pairs):
                    yield f"where {name} {says} somewhere", [mark(v).reshape(*e.shape, -1).any(-1) for e, v in pairs]
                labels = all(((v < 32) | (v == 255)).all() for v in values)  # not colours, in which 255 is no mark
                if says == "is NaN" or (says == "is 255" and labels):  # the others are true of some cases by accident
                    name_it = f"in cases where {name} {says} somewhere"
                    yield name_it, [np.full(e.shape, bool(mark(v).any())) for e, v in pairs]


def spread(mask: np.ndarray, e: np.ndarray) -> np.ndarray:
    """A mask of pixels for an array that has more axes."""
    return np.broadcast_to(mask.reshape(mask.shape + (1,) * (e.ndim - mask.ndim)), e.shape)
