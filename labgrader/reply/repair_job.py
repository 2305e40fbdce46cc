"""What a worker does to look at a program: `watch` and `repair`; `Run.findings` puts in order what they find."""

import inspect
from collections.abc import Callable, Sequence

import numpy as np

from labgrader.comparison import (
    HEAVY,
    Case,
    Problem,
    as_expected,
    as_numpy,
    canonical,
    compare,
    differences,
    parts,
    trusted,
    weight,
)
from labgrader.question import PUBLIC_SEED, Question
from labgrader.reply.finding import write
from labgrader.reply.idle import idle
from labgrader.reply.listed import Listed
from labgrader.reply.repair import repairs
from labgrader.reply.watches import watch

MOST_REPAIRS = 4  # that are told of
FRESH = 50  # cases beside those that a check shows
COMPARING = ("name", "rtol", "atol", "same_dtype")  # the fields of a Question by which outputs are compared

Pairs = Sequence[tuple[tuple, object]]  # the arguments of cases, and what is expected


class Look:
    """What a worker does to look at the program of the function `name`: `watch`, `repair`; the question is not there.

    comparing, canonical: of `comparison_settings`; pieces: the program; public, listed: as `repairs` takes them.
    """

    def __init__(
        self,
        comparing: dict,
        canonical: str,
        name: str,
        pieces: Sequence[tuple[str, str]],
        public: Pairs,
        listed: Sequence[Listed | None] = (),
    ):
        if canonical:
            namespace = {"np": np}
            exec(canonical, namespace)
            comparing = comparing | {"canonical": [*namespace.values()][-1]}
        self.question = Question(reference=None, inputs=None, **comparing)
        self.name, self.pieces, self.public, self.listed = name, pieces, public, listed

    def right(self, expected: object, got: object) -> bool:
        """Whether an output is right."""
        return compare(self.question, expected, got) is None

    def off(self, expected: object, got: object) -> np.ndarray | None:
        """How far each number of an output is off, 0 where it is right; None for one of another form."""
        got = as_expected(expected, as_numpy(got))
        if isinstance(got, Problem) or [np.shape(p) for p in parts(got)] != [np.shape(p) for p in parts(expected)]:
            return None
        pair = canonical(self.question, expected, got)
        wrong = np.concatenate([np.ravel(part) for part in differences(self.question, *pair)])
        e, g = (np.concatenate([np.ravel(part).astype(float) for part in parts(output)]) for output in pair)
        return np.where(wrong, np.nan_to_num(np.abs(g - e), nan=np.inf), 0.0) if e.shape == wrong.shape else None

    def watch(self) -> str:
        """What instruments show, as JSON."""
        return write(watch(self.pieces, self.name, self.public, self.right))

    def repair(self, fresh: Callable[[], Pairs]) -> str:
        """What repair finds, and what stands idle, as JSON; fresh: more cases, as `repairs` takes them."""
        found = repairs(self.pieces, self.name, self.public, fresh, self.right, self.off, self.listed)
        return write([*found[:MOST_REPAIRS], *idle(self.pieces, self.name)])


def comparison_settings(question: Question) -> tuple[dict, str]:
    """What tells a right output from a wrong one, to be sent: fields, and the source of `Question.canonical`.

    That is a function complete in itself but for NumPy, as a reference is; a lambda is left out, so that outputs in
    another form count as wrong: a repair may be missed then, and none is wrong.
    """
    fields = {name: getattr(question, name) for name in COMPARING}
    named = question.canonical.__name__ != "<lambda>"
    return fields, inspect.getsource(inspect.unwrap(question.canonical)) if named else ""


def fresh_cases(question: Question, seed: int = PUBLIC_SEED) -> list[Case]:
    """Random cases of another public seed, on which a repair is tried; heavy ones are not."""
    rng = np.random.default_rng(seed + 1)
    drawn = [args for args in question.draws(rng, FRESH) if weight(args) <= HEAVY]
    return [Case(args, trusted(question.reference, args), by_hand=False) for args in drawn]


def first(some: Sequence, k: int) -> list:
    """A list with its entry k before all others."""
    return [some[k], *some[:k], *some[k + 1 :]]


def pairs(cases: Sequence[Case]) -> list[tuple[tuple, object]]:
    """Arguments and expected outputs alone."""
    return [(case.args, case.expected) for case in cases]
