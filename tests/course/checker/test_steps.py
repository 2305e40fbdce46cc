"""A step of the right answer taken otherwise: each change is said of an answer that makes it; none runs without end."""

import contextlib
import inspect

import numpy as np
import pytest

from labkit.course.checker.comparison import expected_cases
from labkit.course.checker.diagnosis import sentences
from labkit.course.checker.question import Question, way
from labkit.course.checker.run import run
from labkit.course.checker.steps import MOST_STEPS, changed_steps, traced
from labkit.course.topics import TOPICS, of_topic

pytestmark = pytest.mark.bad_input  # without the shape checks, as outside the suite


def shares(a, k, limit):
    """Of each row without its last number, the shares of what is above a limit, each to the power of k."""
    kept = a[:, :-1] * (a[:, :-1] > limit)
    return (kept / kept.sum(axis=1, keepdims=True)) ** k - np.maximum(a[:, 1:], limit) / a[0, 1]


SHARES = Question(
    name="00_test.shares",
    reference=shares,
    inputs=lambda rng: (rng.random((4, 6)) + 0.5, float(rng.uniform(1.5, 3.0)), float(rng.uniform(0.6, 0.8))),
    by_hand=((np.array([[1.0, 3.0, 4.0], [2.0, 1.5, 1.0]]), 2.0, 1.2),),
)


@way(SHARES)
def loops(a, k, limit):
    found = np.zeros((len(a), a.shape[1] - 1))
    for i in range(len(a)):
        total = sum(x for x in a[i, :-1] if x > limit)
        for j in range(a.shape[1] - 1):
            share = a[i, j] / total if a[i, j] > limit else 0.0
            found[i, j] = share**k - max(a[i, j + 1], limit) / a[0, 1]
    return found


def answer(
    operation=lambda s, k: s**k, total=np.sum, over=1, above=np.greater, larger=np.maximum, place=(0, 1), end=-1
):
    """An answer like the reference, with one of its steps taken otherwise."""

    def wrong(a, k, limit):
        kept = a[:, :-1] * above(a[:, :end][:, : a.shape[1] - 1], limit)
        part = larger(a[:, 1:], limit) / a[place]
        return operation(kept / total(kept, axis=over, keepdims=True), k) - part

    return wrong


TAKEN_OTHERWISE = [
    (answer(operation=lambda s, k: s * k), "the power made of a, k and limit were a product"),
    (answer(operation=lambda s, k: s), "the power made of a, k and limit were its first side alone"),
    (answer(total=np.mean), "the result of sum over axis 1, made of a and limit, were taken with mean"),
    (answer(over=0), "the result of sum over axis 1, made of a and limit, ran over axis 0"),
    (answer(above=np.less), "the comparison made of a and limit were made with <"),
    (answer(above=lambda a, b: np.ones(a.shape)), "the comparison made of a and limit were always true"),
    (answer(larger=np.minimum), "the result of maximum, made of a and limit, were taken with minimum"),
    (answer(larger=lambda a, b: a), "the result of maximum, made of a and limit, were not taken"),
    (answer(place=(1, 0)), "a[0, 1] had its indices 0 and 1 exchanged"),
    (answer(place=(0, 2)), "a number in a[0, 1] were one larger"),
    (
        lambda a, k, limit: shares(a, k, limit) * (np.arange(len(a)) < len(a) - 1)[:, None],
        "the loop over axis 0 of a ended one turn earlier",
    ),
]


def distance(a, b):
    """A function with another one in it."""

    def length(row):
        return (row**2).sum() ** 0.5

    return length(a - b)


def test_a_step_of_an_inner_function_is_named_by_what_that_is_called_with():
    args = np.array([3.0, 0.0]), np.array([0.0, 4.0])
    changed = dict(changed_steps(distance, args))
    assert not [says for says in changed if "fixed numbers" in says]
    taken = changed["Your output is right as if the result of sum, made of a and b, were taken with max."]
    assert taken(args) == 4.0


@pytest.mark.parametrize("number", range(len(TAKEN_OTHERWISE)))
def test_a_step_that_is_taken_otherwise_is_named(number):
    wrong, says = TAKEN_OTHERWISE[number]
    cases = expected_cases(SHARES, 1)
    outputs, _ = run(wrong, [case.args for case in cases])
    said = [sentence.says for sentence in sentences(SHARES, cases, outputs)]
    assert any(says in sentence for sentence in said), said


def test_what_is_said_of_a_step_is_true():
    """Each sentence comes with the function that it speaks of; where nothing is changed, that is the reference."""
    args = expected_cases(SHARES, 1)[-1].args
    assert np.allclose(traced(shares).run(args), shares(*args)) and np.allclose(traced(loops).run(args), shares(*args))
    for says, function in changed_steps(shares, args):
        if says.endswith("the comparison made of a and limit were always true."):
            a, k, limit = args
            without = (a[:, :-1] / a[:, :-1].sum(axis=1, keepdims=True)) ** k - np.maximum(a[:, 1:], limit) / a[0, 1]
            assert np.allclose(function(args), without)
            break
    else:
        pytest.fail("nothing is said of the comparison")


@pytest.mark.parametrize("topic", TOPICS)
def test_every_right_answer_has_steps_that_can_be_taken_otherwise(topic):
    for question in of_topic(topic).values():
        args = expected_cases(question, 1)[-1].args
        for right in (question.reference, *question.ways):
            assert len(list(changed_steps(right, args))) > 20, f"{question.name}: {right.__name__}"
            # Of a matrix with infinities, which a changed step may make, LAPACK may never return from this.
            assert not {"svd", "pinv"} & set(inspect.unwrap(right).__code__.co_names), (
                f"{question.name}: {right.__name__}"
            )


def passed_on(a, *others):
    """The largest of a and of two numbers."""
    return max(a.max(), *others)


def test_arguments_without_names_of_their_own_are_no_obstacle():
    assert list(changed_steps(passed_on, (np.ones(2), 3, 4)))


def inside(a, low, high):
    """How many numbers of a lie between two limits."""
    return sum(low <= x <= high for x in a)


def test_a_chain_of_comparisons_has_two_parts():
    args = np.arange(5.0), 1.0, 3.0
    known = {says.rpartition("low ")[2]: function for says, function in changed_steps(inside, args)}
    assert known["were made with <, in its part number 2."](args) == 2
    assert known["were its first part alone."](args) == 4


def pairs(a):
    """How many pairs of numbers in the rows of a are in order."""
    count = 0
    for i in range(len(a)):
        for j in range(a.shape[-1]):
            for k in range(a.shape[-1]):
                count += j <= k and a[i, j] <= a[i, k]
    return count


def test_loops_are_told_apart_by_their_axes():
    known = {s.partition("as if ")[2]: function for s, function in changed_steps(pairs, (np.ones((2, 3)),))}
    for loop, count in (("loop over axis 0", 6), ("loop over the last axis", 10), ("inner loop over the last axis", 6)):
        assert known[f"the {loop} of a ended one turn earlier."]((np.ones((2, 3)),)) == count


def halvings(x):
    """How often x is halved until it is below 1."""
    n = 0
    while x >= 1:
        x, n = x / 2, n + 1
    return n


def test_a_change_that_makes_a_loop_endless_is_given_up():
    for says, function in changed_steps(halvings, (5.0,)):
        if "were always true" in says:
            with pytest.raises(RuntimeError, match="does not end"):
                function((5.0,))
            assert traced(halvings).count <= MOST_STEPS + 1
            break
    else:
        pytest.fail("the condition is not changed")


def power(n):
    """The n-th power of two, twice."""
    return 2**n + (1 << n)


def test_a_change_makes_no_number_of_thousands_of_digits():
    for _, function in changed_steps(power, (40,)):
        with contextlib.suppress(OverflowError, ValueError, TypeError, ZeroDivisionError):
            assert abs(function((40,))) < 2**200
