"""The cases of a question, what is expected of them, and what is wrong with an output; nothing here calls an answer.

    expected_cases(question, seed)      arguments and expected outputs
    as_numpy(got)                          an output as NumPy, or the Problem that it is
    compare(question, expected, got)    one case: None if it is right, else the Problem

All functions here are pure: the same arguments, the same result, and no argument is altered.
"""

import contextlib
import copy
import sys
import types
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from labgrader.question import Question

LONGEST_TUPLE = 16
MOST_BYTES = 1 << 20  # of an output; no right one has more than some thousand
DEEPEST = 64  # lists in lists: NumPy has no array of so many axes
SHORT = 48  # numbers of a case that can be done by hand
HEAVY = 1000
LARGE = 10_000  # numbers of a case that is not tried where a usual one is wrong: smaller ones still tell mistakes apart
FUNCTIONS = (types.FunctionType, types.BuiltinFunctionType, types.MethodType, np.ufunc)


class Listed(np.ndarray):
    """Numbers that came in a list or a tuple, where they had no dtype: none is asked of them."""


@dataclass(frozen=True)
class Problem:
    """What is wrong with one output.

    kind: "unanswered", "exception", "time", "kind", "dtype", "length", "shape", "finite", "values", "altered", or one
    of a caller's own. says: one line, without any expected value. lines: (number, text) of the student's line that
    raised it, if it is known.
    """

    kind: str
    says: str
    lines: tuple[tuple[int, str], ...] = ()


UNTRIED = Problem("untried", "not tried, since a smaller case is wrong")


@dataclass(frozen=True)
class Case:
    """Arguments of one call, what the reference makes of them (as `as_numpy` gives it), and where they come from.

    edge: whether it stands at an end of what the statement allows.
    """

    args: tuple
    expected: object
    by_hand: bool
    edge: bool = False

    @property
    def is_usual(self) -> bool:
        """Whether it is one by hand that stands at no end: shown before all others if it is wrong."""
        return self.by_hand and not self.edge


def expected_cases(question: Question, seed: int) -> list[Case]:
    """Give the cases by hand, the random ones that belong to the seed, then the edges by hand: the telling ones first.

    seed: any that numpy's default_rng takes.
    """
    drawn = question.draws(np.random.default_rng(seed), question.random_cases)
    usual = max(len(question.by_hand) - question.edges, 0)
    tried = [
        *((args, True, False) for args in question.by_hand[:usual]),
        *((args, False, False) for args in drawn),
        *((args, True, True) for args in question.by_hand[usual:]),
    ]
    return [Case(args, trusted(question.reference, args), *where) for args, *where in tried]


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Without warnings, Python's and NumPy's."""
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        yield


def trusted(function: Callable, args: tuple) -> object:
    """Call the kit's own function on copies of the arguments, quietly; `as_numpy` of its output."""
    with quiet():
        return as_numpy(function(*copy.deepcopy(args)))


def same_argument(a: object, b: object) -> bool:
    """Whether an argument is still what it was."""
    if type(a) is not type(b):
        return False
    if isinstance(a, np.ndarray):
        return a.shape == b.shape and a.dtype == b.dtype and a.tobytes() == b.tobytes()
    if isinstance(a, tuple | list):
        return len(a) == len(b) and all(map(same_argument, a, b))
    return bool(a == b or (a != a and b != b))


def weight(args: tuple, expected: object = ()) -> int:
    """How much a case has to be worked on: numbers in its arrays, and in what comes out of it."""
    return sum(np.size(a) for a in (*args, *parts(expected)))


def is_heavy(args: tuple, expected: object) -> bool:
    """Whether so many numbers go into a case, or come out, that a slow program is not tried on it a thousand times."""
    return weight(args, expected) > HEAVY


def is_large(case: Case) -> bool:
    """Whether a case has so many numbers that it is left out where a usual one is wrong."""
    return weight(case.args, case.expected) > LARGE


def told_first(cases: Sequence[Case], wrong: Sequence[bool]) -> int | None:
    """Which wrong case a student is to see, None if none is wrong: a telling one by hand, else a random one.

    An edge is shown where no other case by hand is wrong, and at most half of the random ones, or only long ones, are.
    """
    at = [i for i, is_wrong in enumerate(wrong) if is_wrong]
    usual = [i for i in at if cases[i].is_usual]
    drawn, edges = [i for i in at if not cases[i].by_hand], [i for i in at if cases[i].edge]
    short = [i for i in drawn if weight(cases[i].args) <= SHORT]
    mostly = 2 * len(drawn) > sum(not case.by_hand for case in cases)
    return next(iter(usual + (short if mostly else []) + edges + drawn), None)


# ------------------------------------------------------------------------------------- what an output is


def as_numpy(got: object) -> object:
    """Give an output as NumPy: a scalar or an array, or a tuple of these, all copied; or the Problem that it is not.

    Tensors of torch are converted; subclasses of arrays lose what they add. A list of numbers, or of lists of them, is
    an array, in a tuple as well, and any other list a tuple. Nothing of an object of any other class is called, not
    even its repr.

    >>> as_numpy((1, np.ones(2, np.float32)))
    (np.int64(1), array([1., 1.], dtype=float32))
    >>> as_numpy(None).says
    'it returns None: is a `return` missing?'
    """
    if not issubclass(type(got), tuple | list):
        return plain_array(got)
    if issubclass(type(got), list) and (array := array_of_list(got)) is not None:
        return array
    if len(got) > LONGEST_TUPLE:
        if (array := array_of_list(list(got))) is not None:
            return array
        return Problem("kind", f"expected an array or a number, got a {kind_name(got)} of {len(got)}")
    parts = tuple(plain_part(part) for part in got)
    return next((part for part in parts if isinstance(part, Problem)), parts)


def plain_part(got: object) -> object:
    """Give one output of several as `as_numpy` does: a list or tuple of numbers is an array here, too."""
    if issubclass(type(got), tuple | list) and (array := array_of_list(list(got))) is not None:
        return array
    if got is None:
        return Problem("kind", "there is a None in what it returns: expected numbers alone")
    return plain_array(got)


def array_of_list(got: list) -> np.ndarray | Problem | None:
    """The array that a list of numbers stands for; None if its rows differ in length, or hold anything else.

    Truth values beside numbers are outputs of several kinds, and no array. What holds more values than an output has
    bytes, or more lists in lists than an array has axes, is a Problem: a list that holds itself has no end.
    """
    waiting, truths, count = [(got, 1)], set(), 0
    while waiting:
        rows, depth = waiting.pop()
        count += len(rows)
        if count > MOST_BYTES or depth > DEEPEST:
            return Problem("size", f"it returns more than {MOST_BYTES >> 20} MB")
        for part in rows:
            if issubclass(type(part), list | tuple):
                waiting.append((part, depth + 1))
            elif issubclass(type(part), np.generic | np.ndarray):
                truths.add(part.dtype.kind == "b")
            elif issubclass(type(part), bool | int | float):
                truths.add(issubclass(type(part), bool))
            else:
                return None
    if len(truths) > 1:
        return None
    try:
        array = np.array(got)
    except (ValueError, OverflowError):
        return None
    return array.view(Listed) if array.dtype.kind in "biuf" else None


def plain_array(got: object) -> object:
    """Give one array or number as `as_numpy` does."""
    cls = type(got)
    if got is None:
        return Problem("kind", "it returns None: is a `return` missing?")
    torch = sys.modules.get("torch")
    if torch is not None and issubclass(cls, torch.Tensor):
        try:
            got = got.detach().cpu().resolve_neg().numpy()
        except (TypeError, RuntimeError):  # bfloat16, sparse ...
            return Problem("dtype", f"a tensor of {got.dtype}, {got.layout} is not an array of numbers")
    elif not issubclass(cls, bool | int | float | complex | np.generic | np.ndarray):
        return Problem("kind", f"expected an array or a number, got {kind_name(got)}")
    array = np.array(got, subok=issubclass(cls, Listed))
    if array.dtype.kind not in "biuf":
        return Problem("dtype", f"expected real numbers, got dtype {array.dtype}")
    return array[()]


def kind_name(got: object) -> str:
    """Say what something is by its class."""
    return "a function" if issubclass(type(got), FUNCTIONS) else type(got).__name__[:40]


# ------------------------------------------------------------------------------------------ the comparison


def compare(question: Question, expected: object, got: object) -> Problem | None:
    """Say what is wrong with an output, None if nothing is.

    expected: from a Case. got: any object. In this order: kind, length of a tuple, dtype, shape, values that are not
    finite where they should be, values. Floating-point outputs may come in any real dtype but bool; arrays of integers
    must be integers, since they count or index, while a single one may be a whole float; truth values must be bool. An
    array counts as a tuple of its rows where a tuple is expected, a tuple of numbers or rows as an array where one is,
    and an array of one number, (1,), as the number. NaN is right where the reference gives NaN.
    """
    got = as_expected(expected, as_numpy(got))
    if isinstance(got, Problem):
        return got
    return wrong_form(question, expected, got) or wrong_values(question, expected, got)


def with_rows_as_outputs(expected: object, got: object) -> object:
    """An array as the tuple of its rows, where a tuple of that length is expected."""
    if isinstance(expected, tuple) and isinstance(got, np.ndarray) and got.ndim and len(got) == len(expected):
        return tuple(row[()] for row in got)
    return got


def as_expected(expected: object, got: object) -> object:
    """`got` in the container of `expected` (a tuple, an array, a number), where its numbers allow it; else as it is."""
    got = with_rows_as_outputs(expected, got)
    if isinstance(expected, tuple):
        if isinstance(got, tuple) and len(got) == len(expected):
            return tuple(number_of_one(e, g) for e, g in zip(expected, got, strict=True))
        return got
    if isinstance(got, tuple) and len({part.shape for part in got}) == 1:
        array = np.array(got).view(type(np.asanyarray(got[0])))
        return array if array.ndim == 1 or array.shape == expected.shape else got
    return number_of_one(expected, got)


def number_of_one(expected: object, got: object) -> object:
    """The number in an array of shape (1,), where a number is expected; an empty list as the empty array that is."""
    if isinstance(got, Listed | tuple) and len(got) == 0 and not np.size(expected):
        return np.empty_like(expected)
    alone = isinstance(got, np.ndarray) and got.shape == (1,) and np.shape(expected) == ()
    return got[0] if alone else got


def right_outputs(question: Question, expected: tuple, got: object) -> list[bool]:
    """Which outputs of a tuple are right, each for itself; none of something that is no such tuple."""
    got = as_expected(expected, as_numpy(got))
    if not isinstance(got, tuple) or len(got) != len(expected):
        return [False] * len(expected)
    wrong = differences(question, *canonical(question, expected, got))
    return [not w.any() and wrong_dtype(e, g) is None for w, e, g in zip(wrong, expected, got, strict=True)]


def wrong_form(question: Question, expected: object, got: object) -> Problem | None:
    """Find the first of wrong kind, length, dtype, shape, and values that are not finite."""
    if isinstance(expected, tuple) != isinstance(got, tuple):
        wanted = f"a tuple of {len(expected)}" if isinstance(expected, tuple) else "one array or number"
        came = f"a tuple or list of {len(got)}" if isinstance(got, tuple) else "one array or number"
        return Problem("kind", f"expected {wanted}, got {came}")
    pairs = list(zip(parts(expected), parts(got), strict=False))
    if len(parts(expected)) != len(parts(got)):
        return Problem("length", f"expected a tuple of {len(expected)}, got one of {len(got)}")
    names = [f"output {i + 1} of {len(pairs)}: " if len(pairs) > 1 else "" for i in range(len(pairs))]
    for test in (wrong_dtype, wrong_shape, not_finite):
        for name, (e, g) in zip(names, pairs, strict=True):
            if problem := test(e, g):
                return Problem(problem.kind, name + problem.says)
    if question.same_dtype and expected.dtype != got.dtype and not isinstance(got, Listed):
        return Problem("dtype", f"expected dtype {expected.dtype}, got {got.dtype}")
    return None


def parts(output: object) -> tuple:
    """The outputs as a tuple, also if there is only one."""
    return output if isinstance(output, tuple) else (output,)


def wrong_dtype(expected, got) -> Problem | None:
    """Integers for integers (one alone may be a whole float), truth values for truth values, real numbers for such."""
    wanted, came = expected.dtype.kind, got.dtype.kind
    if wanted != "b" and came == "b" and expected.shape == () == got.shape:
        return Problem("dtype", "expected a number, got a truth value: does the task ask whether, or how many?")
    if wanted in "iu" and came == "b" and expected.shape == ():
        return Problem("dtype", "expected a number, got an array of bool: does the task ask which ones, or how many?")
    if wanted == "b" and came != "b":
        return Problem("dtype", f"expected bool, got dtype {got.dtype}: write a comparison, or .astype(bool)")
    if wanted != "b" and came == "b":
        numbers = "real numbers" if wanted == "f" else "whole numbers"
        cast = ": write .astype(float) or .astype(int)" if np.array_equal(expected, got) else ""
        return Problem("dtype", f"expected {numbers}, got dtype bool{cast}")
    if wanted in "iu" and came == "f" and not (np.isfinite(got) & (np.floor(got) == got)).all():
        return Problem("dtype", f"expected whole numbers, got fractions or NaN in an array of {got.dtype}")
    if wanted in "iu" and came == "f" and got.size and got.shape:
        cast = ", so write .astype(int)" if np.array_equal(expected, got) else ""
        return Problem("dtype", f"expected integers, got dtype {got.dtype}: they count or index{cast}")
    return None


def wrong_shape(expected, got) -> Problem | None:
    """The same shape; a number has the shape ()."""
    if expected.shape == got.shape:
        return None
    wanted = f"shape {expected.shape}" if expected.shape else "a number"
    return Problem("shape", f"expected {wanted}, got {f'shape {got.shape}' if expected.shape == () else got.shape}")


def not_finite(expected, got) -> Problem | None:
    """No NaN and no infinity where the reference is finite."""
    bad = np.isfinite(expected) & ~np.isfinite(got)
    if not bad.any():
        return None
    what = "NaN" if np.isnan(got[bad] if got.shape else got).all() else "NaN or infinite"
    count = np.count_nonzero(bad)
    verb = "is" if count == 1 else "are"
    return Problem("finite", f"{count} of {got.size} values {verb} {what}" if got.shape else f"it is {what}")


def wrong_values(question: Question, expected: object, got: object) -> Problem | None:
    """Count the values that are not right."""
    wrong = differences(question, *canonical(question, expected, got))
    count, size = sum(int(np.count_nonzero(w)) for w in wrong), sum(w.size for w in wrong)
    if not count:
        return None
    if size != sum(np.size(part) for part in parts(got)):  # of the canonical form, which a student does not see
        return Problem("values", "some values are wrong")
    verb = "is" if count == 1 else "are"
    return Problem("values", f"{count} of {size} values {verb} wrong" if size > 1 else "the value is wrong")


def canonical(question: Question, expected: object, got: object) -> tuple[object, object]:
    """Both outputs in the one form of those that are equally right, as they came if one of them has none."""
    # It may rely on what only right outputs have.
    with contextlib.suppress(Exception), np.errstate(all="ignore"):
        return question.canonical(expected), question.canonical(got)
    return expected, got


def differences(question: Question, expected: object, got: object) -> list[np.ndarray]:
    """For each part, where two outputs differ; a part of another shape differs in one place."""
    if len(parts(expected)) != len(parts(got)):
        return [np.ones(1, bool)]
    pairs = zip(parts(expected), parts(got), strict=True)
    return [different(question, np.atleast_1d(e), np.atleast_1d(g)) for e, g in pairs]


def different(question: Question, expected: np.ndarray, got: np.ndarray) -> np.ndarray:
    """Where two arrays differ: numbers by the question's tolerance, integers and truth values exactly."""
    if expected.shape != got.shape:
        return np.ones(1, bool)
    if expected.dtype.kind != "f":
        return expected != got
    with np.errstate(all="ignore"):
        return ~np.isclose(got, expected.astype(np.float64), question.rtol, question.atol, equal_nan=True)


def alike(question: Question, a: object, b: object) -> bool:
    """Whether two outputs, wrong ones perhaps, are the same within the question's tolerance."""
    a, b = as_numpy(a), as_numpy(b)
    if isinstance(a, Problem) or isinstance(b, Problem):
        return isinstance(a, Problem) and isinstance(b, Problem) and a.kind == b.kind
    return not any(wrong.any() for wrong in differences(question, *canonical(question, a, b)))
