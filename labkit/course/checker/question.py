"""What a question is: a reference, its inputs, and the wrong answers that have a hint of their own."""

import inspect
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

PACKAGES = ("numpy", "scipy", "torch")  # what an answer may import beside the standard library, unless it is forbidden
PUBLIC_SEED = 0  # of the random cases that a check shows


@dataclass(frozen=True)
class Misconception:
    """A wrong answer that students really give: how it behaves, and the hint that it earns."""

    answer: Callable
    hint: str

    @property
    def name(self) -> str:
        """The name of its function in words."""
        return self.answer.__name__.replace("_", " ")


@dataclass(frozen=True)
class Property:
    """Something that every right answer fulfils: in words, and as a function (arguments, output) -> bool."""

    says: str
    holds: Callable[[tuple, object], bool]


@dataclass(frozen=True, kw_only=True)
class Question:
    """One blank of a lab: a function of arrays to an array, a number, or a tuple of these.

    name: "04_iou.iou", the topic and the function's name, which is the grade id of its cell. reference: the right
    answer, short and complete in itself. inputs: function of a numpy Generator to the arguments of one random case,
    asymmetric so that swaps show. by_hand: arguments of cases small enough to do by hand; each is always tried.
    random_cases: how many cases are drawn. rtol, atol: which fractions count as equal; integers and truth values are
    compared exactly. same_dtype: whether the dtype is asked for, too. points: what the blank is worth. properties: what
    the check may say about a wrong output that nothing else explains. misconceptions: filled by `wrong`.
    canonical: maps an output to the one form of those that are equally right (the sign of an axis, say). forbidden:
    modules that would do the work; they do not exist where answers are graded.
    """

    name: str
    reference: Callable
    inputs: Callable[[np.random.Generator], tuple]
    by_hand: tuple[tuple, ...] = ()
    random_cases: int = 4
    rtol: float = 1e-4
    atol: float = 1e-6
    same_dtype: bool = False
    points: int = 2
    properties: tuple[Property, ...] = ()
    misconceptions: list[Misconception] = field(default_factory=list)
    canonical: Callable = lambda output: output
    forbidden: tuple[str, ...] = ()

    @property
    def topic(self) -> str:
        """The topic that it belongs to, "04_iou"."""
        return self.name.partition(".")[0]

    @property
    def function(self) -> str:
        """The name of the function that answers it, and the grade id of its cell."""
        return self.name.partition(".")[2]

    @property
    def parameters(self) -> tuple[str, ...]:
        """The names of its arguments."""
        return tuple(inspect.signature(self.reference).parameters)

    @property
    def source(self) -> str:
        """The source of the reference, which is complete in itself but for `np`."""
        return inspect.getsource(inspect.unwrap(self.reference))


def wrong(question: Question, hint: str, **variants: Sequence) -> Callable[[Callable], Callable]:
    """Decorate a wrong answer to a question: whoever's answer gives its outputs gets the hint.

    variants: values of one more argument of the answer; with each it is a wrong answer of its own.

    >>> double = Question(name="0.double", reference=lambda x: 2 * x, inputs=lambda rng: (rng.random(),))
    >>> @wrong(double, "Twice, not a power.", exponent=(2, 3))
    ... def power(x, exponent):
    ...     return x**exponent
    >>> [misconception.name for misconception in double.misconceptions]
    ['power exponent 2', 'power exponent 3']
    """

    def add(answer: Callable) -> Callable:
        given = [with_argument(answer, name, value) for name, values in variants.items() for value in values]
        question.misconceptions.extend(Misconception(variant, hint) for variant in given or [answer])
        return answer

    return add


def with_argument(answer: Callable, name: str, value: object) -> Callable:
    """An answer with one of its arguments given, under a name that says so."""

    def variant(*args):
        return answer(*args, **{name: value})

    variant.__name__ = f"{answer.__name__}_{name}_{value}"
    return variant
