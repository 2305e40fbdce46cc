"""What a check gives back: a right answer whose lists and tuples are arrays, and that is the student's to look at."""

import inspect

import cloudpickle
import numpy as np
import pytest

from labgrader.as_arrays import giving_arrays, in_form
from labgrader.comparison import Case, as_numpy, compare
from labgrader.question import Question
from labgrader.run.channel import decode
from labgrader.run.process import encode

BYTES = np.zeros((2, 2), np.uint8)


@pytest.mark.parametrize(
    "form, got, expected",
    [
        (BYTES, [[1, 2, 3]], np.array([[1, 2, 3]], np.uint8)),
        (BYTES, ((1, 2), (3, 256)), np.array([[1, 2], [3, 256]])),  # no byte
        (BYTES, [], np.zeros((0, 2), np.uint8)),
        (np.zeros(2, bool), [True], np.array([True])),
        (np.zeros(2, np.float32), (0.5, 1), np.array([0.5, 1.0], np.float32)),
        (np.float64(0), np.array([2.0]), np.float64(2.0)),
        ((np.zeros(3), np.float64(0)), [[0, 0, 1], 2.0], (np.array([0.0, 0.0, 1.0]), np.float64(2.0))),
        ((np.zeros(2), np.zeros(2)), [[1, 2], [3, 4]], (np.array([1.0, 2.0]), np.array([3.0, 4.0]))),
    ],
)
def test_a_list_has_the_form_that_is_expected(form, got, expected):
    found = in_form(form, got)
    parts = zip(found, expected, strict=True) if isinstance(expected, tuple) else [(found, expected)]
    for a, b in parts:
        assert type(a) is type(b) and np.shape(a) == np.shape(b) and np.array_equal(a, b)
        assert getattr(a, "dtype", None) == getattr(b, "dtype", None)
    assert isinstance(found, tuple) == isinstance(expected, tuple)


def test_what_has_its_form_is_handed_through():
    array = np.zeros(3)
    assert in_form(array, array) is array and in_form(np.float64(0), 2.5) == 2.5
    words = ["no", "numbers"]
    assert in_form(array, words) is words


def countdown(n):
    """From n to 1."""
    return [n, *countdown(n - 1)] if n else []


def test_it_looks_like_the_answer_and_in_another_answer_lists_stay_lists(monkeypatch):
    given = giving_arrays(countdown, [Case((1,), np.array([1]), True)])
    monkeypatch.setitem(globals(), "countdown", given)  # as the check's cell does: it calls itself by this name
    np.testing.assert_array_equal(given(3), [3, 2, 1])
    assert given.__name__ == "countdown" and given.__doc__ == "From n to 1."
    assert "[n, *countdown" in inspect.getsource(given)
    assert giving_arrays(given, []) is given


def test_a_notebooks_answer_goes_to_other_processes_after_its_check(monkeypatch):
    monkeypatch.setattr(
        countdown, "__module__", "__main__"
    )  # so it is sent by value, as lab 07 does with several workers
    given = giving_arrays(countdown, [Case((1,), np.array([1]), True)])
    sent = cloudpickle.loads(cloudpickle.dumps(given))
    np.testing.assert_array_equal(sent(2), [2, 1])
    assert isinstance(sent(2), np.ndarray)


def test_of_numbers_in_a_list_no_dtype_is_asked_and_an_empty_list_is_an_empty_array():
    blob = Question(name="0.blob", reference=None, inputs=lambda rng: (), same_dtype=True)
    expected = np.ones((1, 2), np.float32)
    for got in ([[1.0, 1.0]], ((1.0, 1.0),), expected):
        assert compare(blob, expected, got) is None and compare(blob, expected, decode(encode(got))) is None
    assert (
        compare(blob, expected, np.ones((1, 2))).kind
        == "dtype"
        == compare(blob, expected, decode(encode(np.ones((1, 2))))).kind
    )
    for empty in ([], ()):
        assert compare(blob, np.zeros((0, 3), np.float32), decode(encode(as_numpy(empty)))) is None
