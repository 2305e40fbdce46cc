"""What a statement promises and no case tries: simplifications of arguments that go unnoticed, and edges never drawn.

An answer that is right for simplified arguments alone (their absolute values, the first of several frames, bytes) is
ticked if no case tells the two apart. So each simplification is told by the cases, or excluded, because it changes no
value of the argument's kind (`labcourse.kinds`), or the kind says that no answer depends on it, and then none
may tell it. Likewise each end of what a kind allows, in shape, count and size, is in some case. Told means: by a case
by hand, or by so many of the draws that as many as a grader makes miss it with a chance under MISSED.
"""

import ast
import copy
import doctest
import fnmatch
import itertools
from collections.abc import Callable, Iterator
from functools import cached_property, partial

import numpy as np

from labcourse.kinds import LARGE, LONG, Kind
from labgrader.comparison import Problem, alike, quiet, trusted
from labgrader.question import Question

MISSED = 0.001
FEW = 16  # entries of an array that are simplified one by one; of larger ones the first and the last of each axis
SAMPLES = 60  # values of a kind that no excluded simplification changes
NEAR = 0.05  # of a range: so near to one of its ends a float is to come
Change = Callable[[np.ndarray], np.ndarray]

ENTRIES: dict[str, Change] = {"0": np.zeros_like, "|x|": np.abs, "-|x|": lambda x: -np.abs(x)}
SHORTER: dict[str, Change] = {
    "whole": np.round,
    "thousandths": lambda x: np.round(x, 3),
    "8 bits": lambda x: np.clip(x, -128, 127),
    "bytes": lambda x: np.clip(x, 0, 255),
    "16 bits": lambda x: np.clip(x, -(2**15), 2**15 - 1),
    "words": lambda x: np.clip(x, 0, 2**16 - 1),
    "float16": lambda x: x.astype(np.float16),
    "float16's range": lambda x: np.clip(x, -65504.0, 65504.0),
}
REPLACED: dict[str, Change] = {
    "255 to 0": lambda x: np.where(x == 255, 0, x),
    "0 to 255": lambda x: np.where(x == 0, 255, x),
    "NaN to 0": np.nan_to_num,
    "0 to NaN": lambda x: np.where(x == 0.0, np.nan, x),
}
ALONG: dict[str, Callable] = {
    "sorted": lambda x, axis: np.sort(x, axis=axis),
    "reversed": lambda x, axis: np.flip(x, axis=axis),
    "unique": lambda x, axis: np.unique(x, axis=axis),
    "first alone": lambda x, axis: np.take(x, [0], axis=axis),
    "first repeated": lambda x, axis: np.repeat(np.take(x, [0], axis=axis), x.shape[axis], axis=axis),
}
SQUARE: dict[str, Change] = {
    "transposed": lambda x: x.swapaxes(0, 1),
    "symmetric": lambda x: (x + x.swapaxes(0, 1)) / 2,
}


OF_WHOLE = ("255 to 0", "0 to 255")
OF_FRACTIONS = ("whole", "thousandths", "float16", "float16's range", "NaN to 0", "0 to NaN")


def simplifications(kind: Kind, value: object) -> dict[str, Callable[[], object]]:
    """The simplifications of a value of a kind, by their names; those that would not change it are not left out."""
    if kind.choices:
        return {f"always {choice!r}": partial(copy.copy, choice) for choice in kind.choices}
    if kind.dtype == "bool" and not kind.axes:
        return {f"always {choice}": partial(bool, choice) for choice in (True, False)}
    x = np.asarray(value)
    if x.dtype.kind == "b":
        found = {"all False": np.zeros_like, "all True": np.ones_like} | on_axes(kind, x)
    else:
        found = ENTRIES | SHORTER | REPLACED | ends(kind) | on_entries(kind, x) | on_axes(kind, x)
        found |= SQUARE if x.ndim >= 2 and x.shape[0] == x.shape[1] else {}
        found = {name: change for name, change in found.items() if fits(kind, name)}
    return {name: partial(applied, change, value) for name, change in found.items()}


def fits(kind: Kind, name: str) -> bool:
    """Whether a simplification is one of a kind's: whole numbers have no thousandths, a float of 255 is like any."""
    if name.startswith("-|x|") and kind.least >= 0:
        return False  # leads out of the kind: what squares it is right all the same
    return name not in (OF_FRACTIONS if kind.whole else OF_WHOLE)


def ends(kind: Kind) -> dict[str, Change]:
    """Cut where a kind goes on: half way to its largest number, just before it, near its smallest; fewer digits."""
    most = min(kind.most, LARGE)
    found = {"half of the largest": lambda x: np.clip(x, -most / 2, most / 2)}
    if np.isfinite(kind.most):
        found["nine tenths of the largest"] = lambda x: np.clip(x, -0.9 * kind.most, 0.9 * kind.most)
    if kind.least == 0.0 and not kind.whole:
        found["a thousandth at least"] = lambda x: np.maximum(x, 1e-3)
    if kind.least > 0:
        found["twice the smallest"] = lambda x: np.maximum(x, 2 * kind.least)
    if kind.digits > 7:
        found["float32"] = lambda x: x.astype(np.float32)
    return found


def on_entries(kind: Kind, x: np.ndarray) -> dict[str, Change]:
    """Each entry of a small array of fixed sides, else each row of its fixed axes, the first and the last of others."""
    if not x.ndim:
        return {}
    if all(axis.isdecimal() for axis in kind.axes) and x.size <= FEW:
        places = {str(list(i)): i for i in np.ndindex(x.shape)}
    else:
        places = {"the first": (0,) * x.ndim, "the last": (-1,) * x.ndim}
        for k, axis in enumerate(named_axes(kind, x)):
            rows = range(x.shape[k]) if axis.isdecimal() and x.shape[k] <= 4 else (0, -1)
            places |= {f"{axis}[{i}]": (slice(None),) * k + (i,) for i in rows}
    if not x.size:
        return {}
    pairs = itertools.product(ENTRIES.items(), places.items())
    return {f"{name} at {where}": partial(changed_at, change, place) for (name, change), (where, place) in pairs}


def changed_at(change: Change, place: tuple, x: np.ndarray) -> np.ndarray:
    """A copy of an array, changed at a place alone."""
    x = x.copy()
    x[place] = change(x[place])
    return x


def on_axes(kind: Kind, x: np.ndarray) -> dict[str, Change]:
    """What makes the order along an axis, all of it but the first, or what comes late, count for nothing."""
    named = [(k, axis) for k, axis in enumerate(named_axes(kind, x)) if x.shape[k] > 1]
    found = {
        f"{name} along {axis}": (lambda x, change=change, k=k: change(x, k))
        for (name, change), (k, axis) in itertools.product(ALONG.items(), named)
    }
    longest = {axis: kind.length(axis)[1] for _, axis in named if not axis.startswith("...")}
    found |= {
        f"the first {LONG - 1} along {axis}": (lambda x, k=k: np.take(x, range(min(LONG - 1, x.shape[k])), k))
        for k, axis in named
        if longest.get(axis, 0) is None
    }
    return found | {
        f"all but the last of {longest[axis]} along {axis}": (lambda x, k=k: np.take(x, range(x.shape[k] - 1), k))
        for k, axis in named
        if kind.axes.count(axis) == 1 and not axis.isdecimal() and x.shape[k] == longest.get(axis)
    }


def named_axes(kind: Kind, x: np.ndarray) -> list[str]:
    """A name for each axis of an array; those of ... are ...1, ...2, ...3."""
    lead = x.ndim - len(kind.axes) + 1
    return [
        name for axis in kind.axes for name in ([f"...{i}" for i in range(1, lead + 1)] if axis == "..." else [axis])
    ]


def applied(change: Change, value: object) -> object:
    """A changed value, of the type that it was."""
    x = np.asarray(value)
    y = np.asarray(change(x))
    y = y.astype(x.dtype) if x.dtype.kind == y.dtype.kind or x.dtype.kind in "iub" else y
    return np.ascontiguousarray(y) if isinstance(value, np.ndarray) else type(value)(y)


def same(a: object, b: object) -> bool:
    """Whether two values of an argument are equal to the last bit."""
    a, b = np.asarray(a), np.asarray(b)
    return a.shape == b.shape and bool(np.array_equal(a, b, equal_nan=a.dtype.kind == b.dtype.kind == "f"))


class Trial:
    """A question with its cases and draws, on which simplifications and edges are tried.

    rounds: how many times each of its `inputs` is drawn.
    """

    def __init__(self, question: Question, rounds: int):
        self.question, self.kinds = question, question.kinds
        self.strata = len(question.inputs) if isinstance(question.inputs, tuple) else 1
        drawn = question.draws(np.random.default_rng(7), rounds * self.strata)
        self.by_hand, self.drawn = list(question.by_hand), drawn
        self.simple: dict[tuple[int, int], dict] = {}  # by argument and case

    @property
    def cases(self) -> list[tuple]:
        """All arguments, those by hand first."""
        return [*self.by_hand, *self.drawn]

    @cached_property
    def expected(self) -> list[object]:
        """What the reference makes of each case, those by hand first."""
        return [trusted(self.question.reference, args) for args in self.cases]

    def told(self, tells: Callable[[int, tuple], bool]) -> bool:
        """Whether a case by hand tells it, or so many draws that a grader's miss it with a chance under MISSED."""
        n, turns = len(self.by_hand), 2 * self.question.random_cases
        if any(tells(i, args) for i, args in enumerate(self.by_hand)):
            return True
        missed = 1.0
        for k in range(self.strata):
            hits = [tells(n + i, self.drawn[i]) for i in range(k, len(self.drawn), self.strata)]
            missed *= (1.0 - np.mean(hits)) ** len(range(k, turns, self.strata))
            if missed < MISSED:
                return True
        return False

    # --------------------------------------------------------------------------------------------- blindness

    def unnoticed(self) -> Iterator[str]:
        """The simplifications of arguments that change a value of its kind, go unnoticed, and are not declared."""
        rng = np.random.default_rng(11)
        for k, (name, kind) in enumerate(self.kinds.items()):
            values = [*(args[k] for args in self.cases), *(kind.draw(rng) for _ in range(SAMPLES))]
            for i, value in enumerate(values):
                self.simple[k, i] = simplifications(kind, value)
            of_values = [self.simple[k, i] for i in range(len(values))]
            for simple in dict.fromkeys(itertools.chain(*of_values)):
                if any(fnmatch.fnmatch(simple, pattern) for pattern in kind.free):
                    if any(self.shows({k: simple}, i, args) for i, args in enumerate(self.cases)):
                        yield f"{name}: {simple} is declared to be free, and a case tells it"
                elif not self.told(partial(self.shows, {k: simple})) and any(
                    simple in found and changed(found[simple], value)
                    for found, value in zip(of_values, values, strict=True)
                ):
                    yield f"{name}: {simple}"
        for axis, places in self.shared_axes().items():
            both = dict.fromkeys(places, f"first alone along {axis}")
            if not self.told(partial(self.shows, both)):
                yield f"{' and '.join(self.question.parameters[k] for k in both)}: the first of {axis} alone"

    def shared_axes(self) -> dict[str, list[int]]:
        """The axes that several arguments begin with, and the places of these."""
        first = [next(iter(kind.axes), "").replace("...", "...1") for kind in self.kinds.values()]
        several = {axis for axis in first if axis and not axis.isdecimal() and first.count(axis) > 1}
        return {axis: [k for k, other in enumerate(first) if other == axis] for axis in sorted(several)}

    def shows(self, simple: dict[int, str], i: int, args: tuple) -> bool:
        """Whether the reference gives something else in a case where arguments are simplified."""
        new = list(args)
        for k, name in simple.items():
            change = self.simple[k, i].get(name)
            if change is None:
                return False
            with quiet():
                new[k] = change()
        if all(same(new[k], args[k]) for k in simple):
            return False
        try:
            got = trusted(self.question.reference, tuple(new))
        except Exception:  # it would stop, and be seen
            return True
        return isinstance(got, Problem) or not alike(self.question, self.expected[i], got)

    # ------------------------------------------------------------------------------------------------- edges

    def never_drawn(self) -> Iterator[str]:
        """The ends of what the kinds allow, in shape, count and size, that no case has."""
        for k, (name, kind) in enumerate(self.kinds.items()):
            for edge, has in edges(kind).items():
                if not self.told(lambda i, args, k=k, has=has: has(args[k])):
                    yield f"{name}: {edge}"

    def of_no_kind(self) -> Iterator[str]:
        """The arguments of cases that are not of their kinds."""
        for args in self.cases:
            for (name, kind), value in zip(self.kinds.items(), args, strict=True):
                if why := kind.refuses(value):
                    yield f"{name}: {why}"


def changed(change: Callable[[], object], value: object) -> bool:
    """Whether a simplification changes its value."""
    with quiet():
        return not same(change(), value)


def edges(kind: Kind) -> dict[str, Callable[[object], bool]]:
    """The ends of what a kind allows, each with the question whether a value has it."""
    if kind.choices:
        return {repr(choice): (lambda v, c=choice: v == c) for choice in kind.choices}
    types = kind.dtypes if kind.axes and not kind.is_tuple else ()
    found: dict[str, Callable] = {f"of {d}": (lambda v, d=d: v.dtype == d) for d in types}
    if kind.axes[:1] == ("...",):
        extra = len(kind.axes) - 1
        found |= {f"{n} axes in the place of ...": (lambda v, n=n: np.ndim(v) == n + extra) for n in range(4)}
    for k, axis in enumerate(kind.axes):
        if axis == "..." or axis.isdecimal():
            continue
        from_end, (first, last) = k - len(kind.axes), kind.length(axis)
        found[f"{axis} = {first}"] = lambda v, j=from_end, n=first: np.shape(v)[j] == n
        longest = last or LONG
        found[f"{axis} = {longest}" + " or more" * (last is None)] = lambda v, j=from_end, n=longest: (
            np.shape(v)[j] >= n
        )
    if not kind.whole:
        found |= near_ends(kind)
    else:
        top = kind.most - round(NEAR * (kind.most - kind.least)) if np.isfinite(kind.most) else 1000
        found[f"{kind.least:g}"] = lambda v: bool((np.asarray(v) == kind.least).any())
        found[f"{top:g}"] = lambda v: bool((np.asarray(v)[~np.isin(v, kind.also)] >= top).any())
    for value in kind.also:
        found[f"{value:g}"] = lambda v, e=value: bool((np.isnan(v) if np.isnan(e) else np.asarray(v) == e).any())
    return found


def near_ends(kind: Kind) -> dict[str, Callable[[object], bool]]:
    """The ends of a range of floats, each with the question whether a value comes near it."""
    margin, found = NEAR * (kind.most - kind.least), {}
    if np.isfinite(kind.least):
        low = kind.least + min(margin, kind.least) if kind.least > 0 else kind.least + margin
        found[f"{low:g} or less"] = lambda v: bool((np.asarray(v)[~np.isin(v, kind.also)] <= low).any())
    if np.isfinite(kind.most):
        high = kind.most - margin if np.isfinite(margin) else NEAR * kind.most
        found[f"{high:g} or more"] = lambda v: bool((np.asarray(v)[~np.isin(v, kind.also)] >= high).any())
    return found


# ------------------------------------------------------------------------------------------------- the statement


def unsaid(question: Question, statement: str) -> Iterator[str]:
    """The words of the kinds that a statement lacks."""
    text = " ".join(statement.split())
    for name, kind in question.kinds.items():
        words = [*kind.says]
        if kind.axes and not kind.is_tuple:
            shape = ", ".join(kind.axes).replace("-1", " - 1")
            words.append(f"({shape},)" if len(kind.axes) == 1 and shape != "..." else f"({shape})")
        yield from (f"{name}: {word!r}" for word in words if word not in text)


def examples(question: Question, statement: str) -> Iterator[tuple]:
    """The arguments of the calls in a statement's examples."""
    calls: list[tuple] = []

    def noted(*args, **named):
        bound = dict(zip(question.parameters, args, strict=False)) | named
        calls.append(tuple(copy.deepcopy(bound[name]) for name in question.parameters))
        return question.reference(*args, **named)

    space = {"np": np, question.function: noted}
    for example in doctest.DocTestParser().get_examples(statement):
        exec(compile(ast.parse(example.source), "<example>", "exec"), space)
    return iter(calls)


def is_a_case(question: Question, args: tuple) -> bool:
    """Whether a case by hand has these arguments, whatever whole numbers' types."""
    return any(all(same(a, b) for a, b in zip(args, case, strict=True)) for case in question.by_hand)
