"""What is said of a wrong answer: each relation where it holds, none where it does not; how many mutants are named."""

import warnings

import numpy as np
import pytest
from measure_diagnosis import Named, measure

from labkit.course.checker import diagnosis
from labkit.course.checker.comparison import expected_cases
from labkit.course.checker.diagnosis import sentences
from labkit.course.checker.errors import explain
from labkit.course.checker.places import places
from labkit.course.checker.question import Question
from labkit.course.checker.relations import View
from labkit.course.checker.run import Printed, call, judge, run
from labkit.course.topics import find

pytestmark = pytest.mark.bad_input  # without the shape checks, as outside the suite


def table(a, k):
    """Shares of the rows of a, times k."""
    return k * a / a.sum(axis=1, keepdims=True)


TABLE = Question(
    name="00_test.table",
    reference=table,
    inputs=lambda rng: (
        rng.random((int(rng.integers(3, 5)), int(rng.integers(5, 8)))) + 0.1,
        float(rng.uniform(1.5, 3)),
    ),
    by_hand=((np.array([[1.0, 3.0, 4.0], [2.0, 1.0, 1.0]]), 2.0),),
)

RELATIONS = [
    (lambda a, k: table(a, k).T, "transpose"),
    (lambda a, k: table(a, k)[::-1], "order from row to row is reversed"),
    (lambda a, k: table(a, k)[:, [1, 0, *range(2, a.shape[1])]], "Numbers 0 and 1 from column to column are exchanged"),
    (lambda a, k: np.roll(table(a, k), 1, 1), "shifted by one from column to column, forward"),
    (lambda a, k: table(a, k)[:-1], "The last one from row to row is missing"),
    (lambda a, k: np.vstack([table(a, k), a[:1]]), "one too many"),
    (lambda a, k: table(a, k)[None], "only the shape is another"),
    (lambda a, k: np.sort(table(a, k), axis=1), "at other places"),
    (lambda a, k: np.cumsum(table(a, k), 1), "add up from column to column"),
    (lambda a, k: -table(a, k), "The sign is the other one"),
    (lambda a, k: 1 - table(a, k), "1 minus the right value"),
    (lambda a, k: 1 / table(a, k), "1 over the right value"),
    (lambda a, k: np.log(table(a, k)), "logarithms"),
    (lambda a, k: table(a, k) ** 2, "square"),
    (lambda a, k: 1000 * table(a, k), "factor of 1000"),
    (lambda a, k: table(a, k) / np.log(2), "log 2"),
    (lambda a, k: a.shape[0] * table(a, k), "the number of rows of a"),
    (lambda a, k: table(a, k) + 1, "too large by 1, in every case"),
    (lambda a, k: table(a, k) - k, "too small by k"),
    (lambda a, k: 3 * table(a, k) + 2, "3 times the right value plus 2"),
    (lambda a, k: np.zeros(a.shape), "Yours is always 0"),
    (lambda a, k: np.zeros(len(a)), "Yours is always 0"),
    (lambda a, k: table(a, k) * a, "times a"),
    (lambda a, k: a / a.sum(axis=0), "a divided by the sum of a over axis 0"),
    (lambda a, k: table(a, 1.0), "too small by a factor that is k"),
    (lambda a, k: table(a, -k), "sign"),
    (lambda a, k: table(np.flip(a, 1), k), "order from column to column is reversed"),
    (lambda a, k: table(a, k) * (np.arange(len(a))[:, None] < len(a) - 1), "in the last row. There: Yours is always 0"),
    (lambda a, k: table(a[:, :-1], k), "a were without its last column"),
    (lambda a, k: a[9], "An index of 9"),
    (lambda a, k: table(a, k).sum(), "the sum of the right values, over all of them"),
    (lambda a, k: table(a, k)[..., None] * [2.0, 3.0, 7.0], "axis too many"),
    (lambda a, k: table(a, k) > 0.5, "You return truth values"),
    (lambda a, k: list(table(a, k)), "list or a tuple, and one array is asked for; its values are right"),
    (lambda a, k: np.full(a.shape, a.sum()) ** 0.5 + a[0, 0], "Yours do not change from row to row"),
    (lambda a, k: np.zeros((len(a), 9)) + k, "always has length 9"),
    (lambda a, k: a * a.sum(), "a number that stays the same from column to column"),
    (lambda a, k: a.sum(axis=1, keepdims=True), "What you return is the result of sum over axis 1, made of a"),
    (lambda a, k: table(a, k) + a.mean(axis=0), "the right values plus the mean of a over axis 0"),
    (lambda a, k: np.where(table(a, k) > 0.8, np.nan, table(a, k)), "What is wrong is NaN: nothing was written there"),
    (lambda a, k: table(a, k) + (table(a, k) > 0.8) * a, "Wherever yours are wrong, they are too large"),
    (lambda a, k: k * a / np.sqrt(a.sum(axis=1, keepdims=True)), "a number that stays the same from column to column"),
]  # fmt: skip


@pytest.mark.parametrize("number", range(len(RELATIONS)))
def test_each_relation_is_said_where_it_holds(number):
    answer, says = RELATIONS[number]
    hint = judge(TABLE, answer, seed=1).hint
    assert says in hint, hint


def test_no_relation_is_said_that_does_not_hold_in_every_case():
    """Doubled in one case, right or halved in the others."""
    for other in (1.0, 0.5):
        wrong = judge(TABLE, lambda a, k, o=other: table(a, k) * (2.0 if len(a) == 2 else o), seed=1)
        assert wrong.sentence is None or ("every case" not in wrong.hint and "factor of 2" not in wrong.hint), (
            wrong.hint
        )


def test_what_says_nothing_is_not_said():
    """A column that is the whole array is no place; and zeros are the right values times any tiny number."""
    column, square = np.arange(4.0)[:, None], np.ones((2, 2))
    view = View((column, square), (column + 9, square), ((), ()), (), 1e-6, 1e-6)
    assert "in the first column" not in dict(places(view))
    blob = np.ones((1, 2, 3, 4))
    of_blob = View((blob,), (blob * [1, 1, 1, 2],), ((),), (), 1e-6, 1e-6)
    assert "in the last entry along axis 3" in dict(places(of_blob))
    assert not View((square,), (0 * square,), ((),), (), 1e-6, 1e-6).gives(lambda e: 1e-60 * e)


def test_an_endless_loop_is_told_what_to_look_at():
    def endless(a, k):
        while True:
            k += 1

    assert "does not end" in judge(TABLE, endless, seed=1, limit_s=0.2).hint


def test_a_right_answer_is_told_nothing():
    cases = expected_cases(TABLE, 1)
    outputs, _ = run(table, [case.args for case in cases])
    assert [s for s in sentences(TABLE, cases, outputs) if s.kind != "exception"] == []


def raised(function) -> str:
    """How an exception is told."""
    return call(function, (), None, Printed()).says


ARGS = {"y": np.array([[0, 255]]), "P": np.zeros((5, 3)), "R": np.eye(3)}
EXCEPTIONS = [
    (lambda: np.zeros(3)[np.array([[0, 255]])], "ignored pixels of y, labelled 255"),
    (lambda: np.zeros(3)[3], "one past the end: the last one along axis 0 (as long as that of R) is 2"),
    (lambda: np.zeros(3)[1.5], "whole numbers or truth values"),
    (lambda: np.zeros(3)[np.ones(4, bool)], "A mask of 4 entries"),
    (lambda: np.zeros(3)[0, 1], "2 indices for an array of 1 axes"),
    (lambda: np.float64(3)[0], "single number"),
    (lambda: np.zeros((5, 3)) + np.zeros((3, 5)), "(the shape of P)"),
    (lambda: np.eye(3) @ np.zeros((5, 3)), "P @ R.T"),
    (lambda: np.zeros(3).reshape(2, 2), "3 numbers do not fill the shape (2,2)"),
    (lambda: 1 if np.zeros(3) > 0 else 2, "np.where"),
    (lambda: np.zeros(3).sum(axis=1), "no axis 1 here"),
    (lambda: np.zeros(0).max(), "nothing is left"),
    (lambda: np.array([[1], [1, 2]]), "different lengths"),
    (lambda: 1 / 0, "divide by is 0"),
    (lambda: np.linalg.inv(np.zeros((2, 2))), "no inverse"),
    (lambda: np.ones(2, int).__iadd__(0.5), "cannot hold float64 in place"),
    (lambda: None + 1, "is None"),
    (lambda: np.ones(2, bool) - np.ones(2, bool), "no minus"),
    (lambda: np.ones(2) & np.ones(2), "compare first"),
    (lambda: __import__("math").exp(np.ones(2)), "math.exp"),
    (lambda: np.zeros(2)(0), "Round brackets"),
    (lambda: raised(1, 2), "y, P, R"),
    (lambda: np.zeros(2.0), "// a whole number"),
    (lambda: np.max(1.0, 2.0), "takes b for an axis"),
    (lambda: np.max(1.0, 2.0, 3.0), "np.max([a, b, c])"),
    (lambda: undefined_name, "No cell that counts here defines undefined_name"),
    (lambda: yy + 1, "No cell"),
    (lambda: np.argmx(1), "np.argmax"),
    (lambda: np.zeros(2).summ(), ".sum"),
    (lambda: {}[3], "no such key"),
    (lambda: int(np.nan), "is float() meant?"),
    (lambda: int("inf"), "is float() meant?"),
]


@pytest.mark.parametrize("number", range(len(EXCEPTIONS)))
def test_an_exception_is_explained_by_what_raised_it(number):
    function, says = EXCEPTIONS[number]
    assert says in explain(raised(function), ARGS), raised(function)


SAMPLE = ("01_labels.one_hot", "03_gradient.cross_entropy", "04_iou.iou")


def test_most_mutants_are_named(capsys):
    """A fixed sample; all are measured by tests/measure_diagnosis.py."""
    warnings.simplefilter("ignore")
    found = sum((measure(find(name), sample=8) for name in SAMPLE), Named())
    with capsys.disabled():
        print(f"\n{found}")
    assert found.named >= 0.6 * found.wrong and found.strict >= 0.6 * found.wrong


def test_a_diagnosis_tries_so_many_functions_and_no_more(monkeypatch):
    """However long each takes: a limit in seconds would say other things on a busy machine."""
    monkeypatch.setattr(diagnosis, "MOST_TRIES", 7)
    calls = []

    def counted(a, k):
        calls.append(1)
        return table(a, k)

    question = Question(name="00_test.counted", reference=counted, inputs=TABLE.inputs)
    cases = expected_cases(question, 0)
    calls.clear()
    list(sentences(question, cases, [np.full(case.expected.shape, 0.123) for case in cases]))
    assert 0 < len(calls) <= 7
