"""What a question is: a reference, its inputs, and the wrong answers that have a hint of their own."""

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

PUBLIC_SEED = 0  # of the random cases that a check shows


class Untold(Exception):
    """Raised by a wrong answer of a list where what it gives hangs on how it is written: that case tells nothing."""


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
    """Something that every right answer fulfils: in words, and as a function (*arguments, output) -> bool."""

    says: str
    holds: Callable[..., bool]


@dataclass(frozen=True, eq=False, kw_only=True)
class Question:
    """One blank of a lab: a function of arrays to an array, a number, or a tuple of these.

    reference: the right answer, short and complete in itself. name: "04_iou.iou", the topic and the function's name,
    which is the grade id of its cell; by default where the reference stands, questions.t04_iou.iou. inputs: function of
    a numpy Generator to the arguments of one random case, asymmetric so that swaps show; or several, which take turns,
    so that each edge is in some case. kinds: what the statement allows for each argument, as the course says it;
    nothing in labgrader reads it. by_hand: arguments of cases small enough to do by hand; each is always tried.
    edges: how many of these, the last ones, stand at an end of what the statement allows: they are shown where all
    others are right. random_cases: how many cases are drawn. rtol, atol: which fractions count as equal; integers and
    truth values are compared exactly. same_dtype: whether the dtype is asked for, too. points: what the blank is worth.
    properties: what the check may say about a wrong output that nothing else explains, filled by `holds`;
    misconceptions, by `wrong`. canonical: maps an output to the one form of those that are equally right (the sign of
    an axis, say). outputs: names of the reference's outputs, where each is worth something without the others, so that
    an instructor may let it count on its own. forbidden: modules that would do the work; they do not exist where
    answers are graded.
    """

    reference: Callable
    inputs: Callable[[np.random.Generator], tuple] | tuple[Callable[[np.random.Generator], tuple], ...]
    name: str = ""
    by_hand: tuple[tuple, ...] = ()
    edges: int = 0
    random_cases: int = 4
    rtol: float = 1e-4
    atol: float = 1e-6
    same_dtype: bool = False
    points: int = 2
    properties: list[Property] = field(default_factory=list)
    misconceptions: list[Misconception] = field(default_factory=list)
    canonical: Callable = lambda output: output
    outputs: tuple[str, ...] = ()
    forbidden: tuple[str, ...] = ()
    kinds: Mapping[str, object] = field(default_factory=dict)

    def __post_init__(self):
        if not self.name:
            *_, topic, function = self.reference.__module__.split(".")
            object.__setattr__(self, "name", f"{topic.removeprefix('t')}.{function}")

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

    def draws(self, rng: np.random.Generator, count: int) -> list[tuple]:
        """The arguments of so many random cases; where `inputs` are several, they take turns."""
        inputs = self.inputs if isinstance(self.inputs, tuple) else (self.inputs,)
        return [inputs[k % len(inputs)](rng) for k in range(count)]

    @property
    def source(self) -> str:
        """The reference as a piece of a program: its source, which needs nothing but the import before it."""
        return f"import numpy as np\n{inspect.getsource(inspect.unwrap(self.reference))}"


def wrong(hint: str, **variants: Sequence) -> Callable[[Callable], Callable]:
    """Decorate a wrong answer to its module's QUESTION: whoever's answer gives its outputs gets the hint.

    variants: values of one more argument of the answer; with each it is a wrong answer of its own.

    >>> QUESTION = Question(name="0.double", reference=lambda x: 2 * x, inputs=lambda rng: (rng.random(),))
    >>> @wrong("Twice, not a power.", exponent=(2, 3))
    ... def power(x, exponent):
    ...     return x**exponent
    >>> [misconception.name for misconception in QUESTION.misconceptions]
    ['power exponent 2', 'power exponent 3']
    """

    def add(answer: Callable) -> Callable:
        given = [with_argument(answer, name, value) for name, values in variants.items() for value in values]
        question_beside(answer).misconceptions.extend(Misconception(variant, hint) for variant in given or [answer])
        return answer

    return add


def holds(says: str) -> Callable[[Callable], Callable]:
    """Decorate a function (*arguments, output) -> bool that is true of every right answer to its module's QUESTION."""

    def add(function: Callable) -> Callable:
        question_beside(function).properties.append(Property(says, function))
        return function

    return add


def question_beside(function: Callable) -> Question:
    """The QUESTION of the module that a function stands in."""
    return inspect.unwrap(function).__globals__["QUESTION"]


def with_argument(answer: Callable, name: str, value: object) -> Callable:
    """An answer with one of its arguments given, under a name that says so."""

    def variant(*args):
        return answer(*args, **{name: value})

    variant.__name__ = f"{answer.__name__}_{name}_{getattr(value, '__name__', value)}"
    variant.of = answer  # with one hint for all its variants, in any language
    return variant
