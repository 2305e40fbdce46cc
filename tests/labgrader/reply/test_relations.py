"""Relations of wrong outputs to the right ones: each where it holds, and none where it only nearly does."""

import numpy as np
import pytest

from labgrader.comparison import Problem, expected_cases
from labgrader.question import Question
from labgrader.reply.judge import judge, outputs_of
from labgrader.reply.sentences import sentences

pytestmark = pytest.mark.bad_input  # without the shape checks, as outside the suite


def table(a, k):
    """Shares of the rows of a, times k."""
    return k * a / a.sum(axis=1, keepdims=True)


def drawn(rng):
    """A table of 3 or 4 rows and 5 to 7 columns, and a factor."""
    return rng.random((rng.integers(3, 5), rng.integers(5, 8))) + 0.1, float(rng.uniform(1.5, 3))


TABLE = Question(
    name="00_test.table",
    reference=table,
    inputs=drawn,
    by_hand=((np.array([[1.0, 3.0, 4.0], [2.0, 1.0, 1.0]]), 2.0),),
)
IMAGE = Question(
    name="00_test.image",
    reference=lambda y, d: np.where(y == 255, np.nan, d + y),
    inputs=lambda rng: (np.where(rng.random((5, 6)) < 0.3, 255, 1).astype(np.uint8), rng.random((5, 6))),
)
BOTH = Question(name="00_test.both", reference=lambda a: (a.max(), a.min(), a.sum()), inputs=lambda r: (r.random(5),))
FLAGS = Question(name="00_test.flags", reference=lambda a: a > 0.5, inputs=lambda rng: (rng.random((4, 5)),))
BLOCK = Question(name="00_test.block", reference=lambda a: 2 * a, inputs=lambda rng: (rng.random((2, 3, 4)),))


def moved(e):
    return np.roll(e, 1, 1)


def without(e, y, where, value):
    """The right image with another value at some pixels."""
    return np.where(where, value, IMAGE.reference(y, e))


def edge(y):
    """True at the border."""
    return ~np.pad(np.ones((y.shape[0] - 2, y.shape[1] - 2), bool), 1)


def test_a_single_pixel_among_pictures_hides_no_place():
    """A label alone is an argument without axes: "where y is 255" is said of the pictures all the same."""
    scores = lambda y, z: np.where((y == 255)[..., None], 0.0, z)  # noqa: E731
    one = np.array(7, np.uint8), np.array([0.25, 0.5, 0.75])
    pictures = lambda rng: (IMAGE.inputs(rng)[0], rng.random((5, 6, 3)))  # noqa: E731
    question = Question(name="00_test.scores", reference=scores, inputs=pictures, by_hand=(one,))
    assert judge(question, lambda y, z: z, 3).hint == "It is wrong only where y is 255; all else is right."


FEW = Question(name="00_test.few", reference=lambda a: a > 0.5, inputs=lambda rng: (rng.random(2),), random_cases=3)


def last_of_one(d):
    """True at one place of the last row, in some images."""
    return (np.arange(30).reshape(5, 6) == 26) & (d[0, 0] > 0.6)


HOLDS = [
    (TABLE, lambda a, k: table(a, k).T, "rows and columns are exchanged"),
    (BLOCK, lambda a: 2 * a.transpose(1, 2, 0), "the axes stand in another order"),
    (TABLE, lambda a, k: table(a, k)[None], "only the shape is not"),
    (TABLE, lambda a, k: table(a, k)[::-1], "reverse order from row to row"),
    (TABLE, lambda a, k: table(a, k)[:, [1, 0, *range(2, a.shape[1])]], "belongs into column 1"),
    (TABLE, lambda a, k: moved(table(a, k)), "one place after its own from column to column"),
    (TABLE, lambda a, k: table(a, k)[:-1], "The last row is missing"),
    (TABLE, lambda a, k: np.vstack([a[:1], table(a, k)]), "Your first row is one too many"),
    (TABLE, lambda a, k: -table(a, k), "the wrong sign"),
    (TABLE, lambda a, k: 1 - table(a, k), "1 minus the right one"),
    (TABLE, lambda a, k: 1 / table(a, k), "1 over the right one"),
    (TABLE, lambda a, k: table(a, k) ** 2, "the square of the right one"),
    (TABLE, lambda a, k: table(a, k) ** 0.5, "the root of the right one"),
    (TABLE, lambda a, k: np.log(table(a, k)), "the logarithm of the right one"),
    (TABLE, lambda a, k: np.exp(table(a, k)), "the exponential of the right one"),
    (TABLE, lambda a, k: table(a, k).astype(int), "without their fractions"),
    (FLAGS, lambda a: a <= 0.5, "true exactly where the right one is false"),
    (TABLE, lambda a, k: 1000 * table(a, k), "too large by a factor of 1000 (millimetres, metres)"),
    (TABLE, lambda a, k: -table(a, k) / 255, "too small by a factor of 255 (bytes, numbers from 0 to 1), and they"),
    (TABLE, lambda a, k: table(a, k) / np.log(2), "log 2"),
    (IMAGE, lambda y, d: np.where(y == 255, 0.0, d + y), "only where y is 255"),
    (IMAGE, lambda y, d: without(d, y, edge(y), 7.0), "only at the border"),
    (IMAGE, lambda y, d: without(d, y, np.arange(6) == 0, 7.0), "only in the first column"),
    (BOTH, lambda a: (a.min(), a.max(), a.sum()), "Outputs 1 and 2 are swapped"),
    (BOTH, lambda a: a.min(), "You return only output 2 of 3"),
    (BOTH, lambda a: (a.max(), -a.min(), a.sum()), "Output 2 of 3: Each of your numbers has the wrong sign"),
    (BLOCK, lambda a: (a, 2 * a), "Number 2 of what you return is right"),
]  # fmt: skip


@pytest.mark.parametrize("number", range(len(HOLDS)))
def test_each_relation_is_said_where_it_holds(number):
    question, answer, says = HOLDS[number]
    found = judge(question, answer, seed=1).sentence
    assert found.kind == "relation" and says in found.says, found


NEARLY = [
    (TABLE, lambda a, k: table(a, k).T + (len(a) == 3)),  # transposed in some cases
    (TABLE, lambda a, k: table(a, k) * (1000 if len(a) == 3 else 2)),
    (TABLE, lambda a, k: 1.01 * 1000 * table(a, k)),
    (TABLE, lambda a, k: np.abs(table(a, k)) + 1e-2),
    (TABLE, lambda a, k: 0 * a),  # zeros are any number times tiny ones
    (TABLE, lambda a, k: np.full(a.shape, np.nan)),
    (TABLE, lambda a, k: np.roll(table(a, k), 2, 1)),
    (TABLE, lambda a, k: table(a, k)[:-2]),
    (FLAGS, lambda a: (a <= 0.5) | (a > 0.9)),
    (IMAGE, lambda y, d: without(d, y, edge(y), 7.0) + (np.arange(30).reshape(5, 6) == 14)),
    (BOTH, lambda a: (a.min(), a.max(), a.sum() + 1)),
    (IMAGE, lambda y, d: without(d, y, last_of_one(d), 7.0)),  # wrong in one place of two cases
    (FEW, lambda a: (a > 0.5)[::-1]),  # of two truth values one in four is the other way round
    (FEW, lambda a: ~(a > 0.5)),
    (Question(name="00_test.one", reference=lambda a: 2.0, inputs=lambda rng: (rng.random(3),)), lambda a: 4.0),
]  # fmt: skip


@pytest.mark.parametrize("number", range(len(NEARLY)))
def test_nothing_is_said_that_holds_only_nearly(number):
    question, answer = NEARLY[number]
    assert judge(question, answer, seed=1).sentence.kind in ("case", "property")


def test_an_endless_loop_is_told_what_to_look_at():
    cases = expected_cases(TABLE, 1)
    never = [Problem("time", "it did not return in time")] * len(cases)
    assert "does not end" in next(sentences(TABLE, cases, never)).says


def test_what_is_right_but_slow_is_told_that_it_is_slow():
    sizes = iter([2, 3, 40])
    rows = Question(
        name="00_test.row", reference=np.sort, inputs=lambda rng: (rng.random(next(sizes)),), random_cases=3
    )
    cases, late = expected_cases(rows, 1), Problem("time", "it did not return in time")
    right = [case.expected for case in cases]
    assert "too slow for a case as large as this one" in next(sentences(rows, cases, [*right[:2], late])).says
    assert "does not end" in next(sentences(rows, cases, [right[0], late, late])).says, "no case is much larger"
    asleep = Problem("time", "it slept for 10 seconds")
    assert "computes nothing" in next(sentences(rows, cases, [*right[:2], asleep])).says


def test_a_right_answer_is_told_nothing():
    cases = expected_cases(TABLE, 1)
    outputs, _ = outputs_of(table, [case.args for case in cases])
    assert list(sentences(TABLE, cases, outputs)) == []
