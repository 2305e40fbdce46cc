"""Relations of the form of outputs: another type, another length, summed up or not yet, one number along an axis.

They belong to the ARRANGED and LOOSE of `relations`, where the rules for them stand.
"""

import numpy as np

from labkit.course.checker.by_number import quantities
from labkit.course.checker.relations import ARRANGED, LOOSE, View, axes, ordinal, relation

TYPES = {"b": "truth values", "i": "whole numbers", "u": "whole numbers", "f": "numbers with a fraction"}
REDUCED = {
    "the sum": np.sum,
    "the mean": np.mean,
    "the largest": np.max,
    "the smallest": np.min,
    "the product": np.prod,
    "the place of the largest": np.argmax,
    "the place of the smallest": np.argmin,
    "the length (the root of the sum of squares)": lambda v, axis: np.linalg.norm(np.asarray(v, float), axis=axis),
    "any": np.any,
    "all": np.all,
}


@relation(ARRANGED)
def reduced(view: View) -> str:
    """A sum, mean or largest of the right values; or the right values are such of yours."""
    if view.shaped:
        return ""
    for axis in range(min(g.ndim for g in view.got)):
        once = [g.take([0], axis) if g.shape[axis] else g for g in view.got]
        alike = all(view.same(np.broadcast_to(o, g.shape), g) for o, g in zip(once, view.got, strict=True))
        pairs = [(o.squeeze(axis), e) for o, e in zip(once, view.expected, strict=True) if o.size]
        if alike and pairs and all(view.same(o, e) for o, e in pairs):
            return f"Yours holds the right values again and again along axis {axis}: is that axis to be there?"
    turned = View(view.got, view.expected, view.args, view.names, view.rtol, view.atol)
    for words, function in REDUCED.items():
        for axis in (None, *range(max(e.ndim for e in (*view.expected, *view.got)))):
            over = "all of them" if axis is None else f"axis {axis}"
            if view.gives(lambda e, f=function, axis=axis: f(e, axis=axis)):
                return f"What you return is {words} of the right values, over {over}."
            if turned.gives(lambda g, f=function, axis=axis: f(g, axis=axis)):
                return f"A last step is missing: the right one is {words} of what you return, over {over}."
    return ""


@relation(ARRANGED)
def another_type(view: View) -> str:
    """Truth values, whole numbers or others in the place of the right type."""
    kinds = {(e.dtype.kind, g.dtype.kind) for e, g in zip(view.expected, view.got, strict=True)}
    came, wanted = ({TYPES[pair[k]] for pair in kinds} for k in (1, 0))
    if len(came) != 1 or len(wanted) != 1 or came == wanted or (came, wanted) == ({TYPES["i"]}, {TYPES["f"]}):
        return ""
    says = f"You return {came.pop()}, and {wanted.pop()} are asked for"
    if not view.shaped:
        return f"{says}; the shape is another, too."
    pairs = list(zip(view.expected, view.got, strict=True))
    if all(view.same(np.asarray(e, float), np.asarray(g, float)) for e, g in pairs):
        return f"{says}; the values are right."
    if all(view.same(np.asarray(e, float), np.asarray(g != 0, float)) for e, g in pairs):
        return f"{says}: yours are not 0 where the right ones are 1 or True."
    return f"{says}; the values are others, too."


@relation(LOOSE)
def another_length(view: View) -> str:
    """As long as something else, or with another number of axes."""
    pairs = list(zip(view.expected, view.got, strict=True))
    more = {g.ndim - e.ndim for e, g in pairs}
    if len(more) == 1 and more != {0}:
        (more,) = more
        if all(g.ndim == 0 for _, g in pairs):
            return f"You return a single number where an array of {pairs[0][0].ndim} axes is asked for."
        return (
            f"Your output has {abs(more)} {'axis' if abs(more) == 1 else 'axes'} too {'many' if more > 0 else 'few'}."
        )
    if more != {0}:
        return ""
    for axis in axes(view):
        came = [float(g.shape[axis]) for _, g in pairs]
        if came == [float(e.shape[axis]) for e, _ in pairs]:
            continue
        names = [name for name, values in quantities(view) if values == came]
        if not names and len(set(came)) == 1 and len(came) > 1:
            return f"Along axis {axis} your output always has length {came[0]:.0f}."
        return f"Along axis {axis} your output is as long as {names[0]}, which is wrong there." if names else ""
    return ""


@relation(LOOSE)
def alike_along_an_axis(view: View) -> str:
    """No change along an axis, where the right ones change."""
    if not view.shaped:
        return ""
    for axis in axes(view):
        first = (slice(None),) * axis + (slice(0, 1),)
        alike = all(view.same(g, np.broadcast_to(g[first], g.shape)) for g in view.got)
        if alike and not all(view.same(e, np.roll(e, 1, axis)) for e in view.expected):
            return f"Yours do not change {ordinal(axis, view)}; the right ones do."
    return ""


@relation(LOOSE)
def moved_line_by_line(view: View) -> str:
    """Off by a number for each row, column or pixel."""
    if not view.shaped or any(a.dtype.kind != "f" for a in view.expected) or len(axes(view)) < 2:
        return ""
    for axis in axes(view):
        off = [np.asarray(g, float) - e for e, g in zip(view.expected, view.got, strict=True)]
        moved = [np.nanmean(o, axis=axis, keepdims=True) if o.size else o for o in off]
        if min(e.shape[axis] for e in view.expected) > 1 and view.is_(
            [e + m for e, m in zip(view.expected, moved, strict=True)]
        ):
            return f"Yours are off by a number that stays the same {ordinal(axis, view)}."
    return ""
