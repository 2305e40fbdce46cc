"""The judge: what passes, what is said about what does not, and that no answer reaches the expected values."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
import torch

from labgrader.comparison import Problem, as_numpy, compare, expected_cases
from labgrader.question import Misconception, Property, Question, Untold, wrong
from labgrader.reply.judge import judge, outputs_of, verdict
from labgrader.reply.sentences import OF_BYTES, OF_NONE, Sentence, at_once, recognise


def iou(n):
    both = np.diagonal(n)
    return both / (n.sum(axis=0) + n.sum(axis=1) - both)


QUESTION = Question(
    name="00_test.iou",
    reference=iou,
    inputs=lambda rng: (rng.integers(1, 9, (3, 3)),),
    by_hand=((np.array([[3, 1], [2, 5]]),), (np.array([[3, 1, 0], [2, 5, 0], [0, 0, 0]]),)),
    properties=[Property("no class has an IoU over one", lambda n, got: bool(np.nanmax(got) <= 1))],
)
PLAIN = replace(QUESTION, properties=[], misconceptions=[])


@wrong("who pays for false alarms?")
def recall(n):
    return np.diagonal(n) / n.sum(axis=1)


@wrong("one number per class")
def whole(n):
    return np.trace(n) / n.sum()


@wrong("how many classes are there?")
def broken(n):
    return n[:, 7]


def problem(answer, question=QUESTION):
    return judge(question, answer, seed=3).problem


def kind(answer, question=QUESTION):
    found = problem(answer, question)
    return None if found is None else found.kind


# ------------------------------------------------------------------------------------------ what is right


@pytest.mark.parametrize(
    "answer",
    [
        lambda n: iou(n),
        lambda n: iou(n).astype(np.float32),
        lambda n: torch.from_numpy(iou(n)),
        lambda n: torch.from_numpy(iou(n)).float().requires_grad_(True),
        lambda n: np.ma.masked_array(iou(n)),
        lambda n: np.asfortranarray(iou(n)),
        lambda n: iou(n).tolist(),
        lambda n: list(iou(n)),
        lambda n: iou(n) + 1e-7,
    ],
)
def test_right_answers_pass_in_any_real_array(answer):
    found = judge(QUESTION, answer, seed=3)
    assert found.passed and found.hint is None and found.notes == ()


@pytest.mark.parametrize(
    "expected, right, wrong",
    [
        (
            np.array([1, 2]),
            (np.array([1, 2], np.uint8), torch.tensor([1, 2]), [1, 2], (1, 2)),
            (np.array([1.0, 2.0]), [1.0, 2.0], np.array([1.0, 2.5])),
        ),
        (np.array([True, False]), (torch.tensor([True, False]),), (np.array([1, 0]), np.array([1.0, 0.0]))),
        (np.array([1.0, 2.0]), (np.array([1, 2]), np.array([1, 2], np.float16)), (np.array([True, True]),)),
        (np.int64(3), (3, np.uint8(3), np.array(3), np.array([3]), torch.tensor(3), 3.0), (3.5, np.nan, True)),
        (np.ones((2, 2)), ([[1, 1], [1, 1]], ((1, 1), (1, 1)), (np.ones(2), [1, 1])), ((True, True),)),
        ((np.ones(3), np.float64(2)), (([1, 1, 1], [2.0]), ((1, 1, 1), np.array([2]))), (("111", 2),)),
        (np.float64(3), (3, 3.0, np.float32(3), torch.tensor(3.0)), (True, 3 + 0j, "3", Fraction(3))),
        (np.bool_(True), (True, np.True_), (1, 1.0)),
        ((np.bool_(True), np.int64(2)), ((True, 2), [True, 2.0], [np.True_, np.int64(2)]), ([1, 2],)),
        (
            (np.float64(1), np.ones(2)),
            ((1.0, np.ones(2)), [1, torch.ones(2)], [1, np.ones(2)]),
            ((1.0, np.ones(2) + 0j),),
        ),
    ],
)
def test_dtypes(expected, right, wrong):
    """Real numbers come in any real dtype, lists and tuples are arrays; integers and truth values are what they are."""
    for got in right:
        assert compare(PLAIN, expected, got) is None
    for got in wrong:
        assert compare(PLAIN, expected, got).kind in ("dtype", "kind")


def test_nan_is_right_where_the_reference_has_it_and_nowhere_else():
    expected = np.array([0.5, np.nan, np.inf])
    assert compare(PLAIN, expected, expected.copy()) is None
    assert compare(PLAIN, expected, np.array([0.5, 0.0, np.inf])).kind == "values"
    assert compare(PLAIN, expected, np.array([0.5, np.nan, -np.inf])).kind == "values"
    assert compare(PLAIN, expected, np.array([np.nan, np.nan, np.inf])).says == "1 of 3 values is NaN"
    assert compare(PLAIN, np.float64(1), np.inf).says == "it is NaN or infinite"


def test_integers_are_compared_exactly():
    """As floating-point numbers these two would be equal."""
    assert compare(PLAIN, np.array([2**60]), np.array([2**60 + 1])).kind == "values"


def test_canonical_makes_equally_right_outputs_one():
    axis = Question(
        name="00_test.axis",
        reference=lambda v: v / np.linalg.norm(v),
        inputs=lambda rng: (rng.normal(size=3),),
        canonical=lambda v: v * np.sign(v[np.argmax(np.abs(v))]),
    )
    assert kind(lambda v: -v / np.linalg.norm(v), axis) is None
    assert kind(lambda v: v, axis) == "values"
    assert kind(lambda v: v[:0], axis) == "shape"


def test_an_empty_array_is_an_answer():
    cloud = replace(QUESTION, reference=lambda n: np.zeros((0, 3)), misconceptions=[])
    assert kind(lambda n: np.empty((0, 3)), cloud) is None
    assert kind(lambda n: np.empty((3, 0)), cloud) == "shape"


# ----------------------------------------------------------------------------------------- what is wrong


class Odd:
    """Nothing of it can be looked at."""

    def __getattribute__(self, name):
        raise RuntimeError("hands off")

    __repr__ = __str__ = __array__ = __len__ = __iter__ = __eq__ = lambda self: Odd.nothing


class AlwaysEqual(np.ndarray):
    """An array that is equal to anything, and close to it."""

    def __array_ufunc__(self, *args, **kwargs):
        return True

    def __array_function__(self, *args, **kwargs):
        return True

    def __eq__(self, other):
        return True


def itself(n):
    return itself


@pytest.mark.parametrize(
    "answer, expected_kind, says",
    [
        (lambda n: None, "kind", "it returns None: is a `return` missing?"),
        (lambda n: [0.5, None], "kind", "there is a None in what it returns"),
        (itself, "kind", "expected an array or a number, got a function"),
        (lambda n: "right", "kind", "got str"),
        (lambda n: (x for x in iou(n)), "kind", "got generator"),
        (lambda n: Odd(), "kind", "got Odd"),
        (lambda n: (0.5,) * 1000, "shape", "expected shape (2,), got (1000,)"),
        (lambda n: [0.5] * 1000, "shape", "expected shape (2,), got (1000,)"),
        (lambda n: [[0.5], [0.5, 0.5]], "kind", "got a tuple or list of 2"),
        (lambda n: (iou(n), iou(n)), "kind", "got a tuple or list of 2"),
        (lambda n: iou(n) + 0j, "dtype", "got dtype complex128"),
        (lambda n: iou(n).astype(object), "dtype", "got dtype object"),
        (lambda n: iou(n).astype(str), "dtype", "got dtype <U"),
        (lambda n: iou(n) > 0.5, "dtype", "expected real numbers, got dtype bool"),
        (lambda n: torch.from_numpy(iou(n)).bfloat16(), "dtype", "torch.bfloat16"),
        (lambda n: torch.from_numpy(iou(n)).to_sparse(), "dtype", "torch.sparse_coo"),
        (lambda n: iou(n)[:, None], "shape", "expected shape (2,), got (2, 1)"),
        (lambda n: 0.5, "shape", "expected shape (2,), got ()"),
        (lambda n: np.zeros(len(n)).view(AlwaysEqual), "values", "2 of 2 values are wrong"),
        (lambda n: iou(n) * 1.01, "values", "2 of 2 values are wrong"),
        (lambda n: iou(n) * 9, "values", "2 of 2 values are wrong"),
        (lambda n: np.where(np.arange(len(n)) == 1, np.nan, iou(n)), "finite", "1 of 2 values is NaN"),
        (lambda n: n[7], "exception", "IndexError: index 7 is out of bounds"),
        (lambda n, m: n, "exception", "missing 1 required positional argument: 'm'"),
    ],
)
def test_each_kind_of_problem_is_said(answer, expected_kind, says):
    found = problem(answer)
    assert found.kind == expected_kind and says in found.says and "\n" not in found.says


def test_tuples_are_judged_part_by_part():
    both = Question(name="00_test.both", reference=lambda x: (x.sum(), x.mean(0)), inputs=lambda r: (r.random((3, 2)),))
    assert kind(lambda x: (x.sum(), x.mean(0)), both) is None
    assert kind(lambda x: x.sum(axis=0), replace(both, reference=lambda x: tuple(x.sum(axis=0)))) is None
    assert problem(lambda x: x.sum(), both).says == "expected a tuple of 2, got one array or number"
    assert problem(lambda x: (x.sum(), x.mean(0), 1), both).kind == "length"
    assert problem(lambda x: (x.sum(), x.mean(1)), both).says == "output 2 of 2: expected shape (2,), got (3,)"
    assert problem(lambda x: (x.sum(0), x.mean(0)), both).says == "output 1 of 2: expected a number, got shape (2,)"
    assert problem(lambda x: (x.sum() + 1, x.mean(0)), both).says == "1 of 3 values is wrong"
    count = replace(QUESTION, reference=lambda n: int((n > 0).sum()))
    assert problem(lambda n: n > 0, count).says.endswith("does the task ask which ones, or how many?")


def test_the_first_problem_is_told_with_its_case():
    def wrong_on_three_classes(n):
        return iou(n) + (len(n) == 3)

    found = judge(QUESTION, wrong_on_three_classes, seed=3)
    assert (found.case, found.where) == (1, "hand-made case 2 of 2")
    only_random = judge(replace(QUESTION, by_hand=QUESTION.by_hand[:1]), wrong_on_three_classes, seed=3)
    assert (only_random.case, only_random.where) == (1, "random case 1 of 4")


def test_a_telling_case_is_shown_before_an_edge_and_before_whatever_fails_worse():
    """The last case by hand is an edge: three classes, of which one never occurs; random cases have three classes."""
    edge = replace(QUESTION, edges=1, misconceptions=[], properties=[])

    def shown(answer):
        found = judge(edge, answer, seed=3)
        return found.where, found.sentence.says

    everywhere, _ = shown(lambda n: recall(n) if len(n) == 2 else n[9])  # an exception does not come first
    assert everywhere == "hand-made case 1 of 2"
    mostly, _ = shown(lambda n: iou(n) if len(n) == 2 else n[9])
    assert mostly == "random case 1 of 4"
    drawn, says = shown(lambda n: iou(n) if len(n) == 2 else iou(n) + 1.0)
    assert drawn == "random case 1 of 4" and "right. What does the case above have that they do not" in says
    where, says = shown(lambda n: np.nan_to_num(iou(n)))  # only where a class never occurs
    assert where == "hand-made case 2 of 2" and says.startswith("All usual hand-made cases are right. What is unusual")


def test_a_problem_never_holds_an_expected_value():
    """Whatever an answer does, no number of the expected outputs is in what is said."""
    number = 0.7312684519
    secret = replace(QUESTION, reference=lambda n: np.full(2, number), by_hand=QUESTION.by_hand[:1], random_cases=0)
    answers = [lambda n: None, lambda n: np.zeros(3), lambda n: np.zeros(2), lambda n: np.full(2, 5.0), lambda n: n[9]]
    for answer in answers:
        assert "0.73" not in problem(answer, secret).says


# ------------------------------------------------------------------------------------------ misconceptions


def test_a_wrong_answer_that_behaves_like_a_misconception_earns_its_hint():
    found = judge(QUESTION, lambda n: (np.diagonal(n) / n.sum(axis=1)).astype(np.float32), seed=3)
    assert found.sentence == Sentence("misconception", "who pays for false alarms?")
    assert judge(QUESTION, lambda n: np.trace(n) / n.sum(), seed=3).hint == "one number per class"


def test_one_that_behaves_so_on_some_cases_only_earns_none():
    def mixed(n):
        return np.diagonal(n) / n.sum(axis=1) + (len(n) == 2)

    for answer in (mixed, lambda n: n[7]):
        cases = expected_cases(QUESTION, 3)
        assert recognise(QUESTION, cases, outputs_of(answer, [case.args for case in cases])[0]) is None


def test_a_mistake_in_one_of_several_outputs_is_recognised_beside_the_others():
    both = Question(
        name="00_test.both", reference=lambda n: (n.sum(), n.mean()), inputs=lambda rng: (rng.integers(1, 99, (2, 3)),)
    )
    wrong_both = Misconception(lambda n: (n.max(), n.max()), "the largest is no sum")
    wrong_second = Misconception(lambda n: (n.sum(), n.max()), "the largest is no mean")
    both = replace(both, misconceptions=[wrong_both, wrong_second])
    assert judge(both, lambda n: (n.max(), n.mean()), seed=3).hint == "Output 1 of 2: the largest is no sum"
    assert judge(both, lambda n: (n.min(), n.max()), seed=3).hint == "Output 2 of 2: the largest is no mean"
    assert judge(both, lambda n: (n.sum(), n.max()), seed=3).hint == "the largest is no mean"
    cases = expected_cases(both, 3)
    for answer, is_alone in ((lambda n: (n.max(), n.mean()), True), (lambda n: (n.min(), n.max()), False)):
        sentence = at_once(both, cases, outputs_of(answer, [case.args for case in cases])[0])
        assert (sentence is not None) == is_alone, "with another output wrong beside it, the program is looked at first"
    assert "largest" not in judge(both, lambda n: (n.min(), n.mean()), seed=3).hint


def test_bytes_are_said_to_be_no_array_before_the_program_is_searched():
    """The absolute value of a bytearray is the array that was asked for, which says nothing of what is wrong."""
    for kind in (bytes, bytearray):
        assert judge(PLAIN, lambda n, kind=kind: kind(2), seed=3).hint == OF_BYTES


def test_a_none_among_numbers_gets_a_hint_although_no_case_has_an_output():
    """So does a list with None for what has no partner, in every case."""
    assert judge(PLAIN, lambda n: [0.5, None], seed=3).hint == OF_NONE


def test_the_hint_of_an_output_that_is_right_in_the_case_shown_is_not_said():
    """In a table with one number that is not 0 the largest is the sum: what is seen there is the other output."""
    both = Question(
        name="00_test.both",
        reference=lambda n: (n.sum(), n.mean()),
        inputs=lambda rng: (rng.integers(1, 99, (2, 3)),),
        by_hand=((np.array([[7, 0]]),),),
        misconceptions=[Misconception(lambda n: (n.max(), n.max()), "the largest is no sum")],
    )
    found = judge(both, lambda n: (n.max(), n.min()), seed=3)
    assert found.where == "hand-made case 1 of 1" and "largest" not in found.hint


def test_a_case_in_which_a_listed_mistake_tells_nothing_is_left_out():
    def some(n):
        if len(n) == 3:
            raise Untold
        return 2 * iou(n)

    listed = replace(PLAIN, misconceptions=[Misconception(some, "twice")])
    assert judge(listed, lambda n: (2 if len(n) == 2 else 7) * iou(n), seed=3).hint == "twice"
    assert judge(listed, lambda n: 7 * iou(n), seed=3).hint != "twice"


def test_right_cases_are_counted_in_whatever_form_they_come():
    says = judge(PLAIN, lambda n: tuple(iou(n) * (1 if len(n) == 2 else 9)), seed=3).hint
    assert says.endswith("1 of 6 cases is right.")


def test_a_wrong_sign_is_told_without_a_look_at_the_program():
    found = judge(PLAIN, lambda n: -iou(n), seed=3)
    assert not found.needs_a_look and found.hint == "Each of your numbers has the wrong sign."


def test_a_misconception_may_raise_where_the_answer_does():
    sometimes = Misconception(lambda n: 2 * iou(n) if len(n) == 3 else n[9], "hint")
    assert judge(replace(QUESTION, misconceptions=[sometimes]), sometimes.answer, seed=3).hint == "hint"


def test_verdicts_are_made_of_outputs_that_came_from_anywhere():
    """As the grader does: the parent keeps the cases, values come back from another process, or do not."""
    cases = expected_cases(QUESTION, 5)
    assert [case.by_hand for case in cases] == [True] * 2 + [False] * 4
    values = [case.expected.copy() for case in cases]
    assert verdict(QUESTION, cases, values).passed
    lost = [*values[:4], Problem("time", "no answer within 2 s"), values[5]]
    found = verdict(QUESTION, cases, lost)
    assert (found.problem, found.where) == (lost[4], "random case 3 of 4")
    assert recognise(QUESTION, cases, values) is None
    assert verdict(QUESTION, cases, values, frozenset({0})).problem.kind == "altered"


def test_cases_belong_to_the_seed():
    first, again, other = (expected_cases(QUESTION, seed) for seed in (1, 1, 2))
    for a, b in zip(first, again, strict=True):
        assert np.array_equal(a.args[0], b.args[0]) and np.array_equal(a.expected, b.expected, equal_nan=True)
    assert any(not np.array_equal(a.args[0], b.args[0]) for a, b in zip(first, other, strict=True))


# ------------------------------------------------------------------------------------- running an answer


def test_arguments_are_copies_and_altering_them_is_said():
    def alters(n):
        right = iou(n)
        n[:] = 0
        return right

    found = judge(QUESTION, alters, seed=3)
    assert not found.passed and found.problem.says.startswith("it changes its argument n: work on a copy")
    for untouched in (3, 0.5, np.float32(2), np.nan, "text", None, (np.ones(2), [1, 2]), np.array([np.nan, 1])):
        assert outputs_of(lambda x: 1, [(untouched,)]) == ([1], frozenset())
    assert outputs_of(lambda x: x[1].append(3), [((np.ones(2), [1, 2]),)])[1] == {0}
    assert QUESTION.by_hand[0][0].tolist() == [[3, 1], [2, 5]]


def test_an_output_is_taken_when_it_is_returned():
    """One buffer for all cases: what a later call writes into it does not count for an earlier one."""
    buffer = np.zeros(3)

    def last(n):
        buffer[: len(n)] = iou(n)
        return buffer[: len(n)]

    assert judge(QUESTION, last, seed=3).passed


def test_plain_copies():
    array = np.ones(3)
    kept = as_numpy(array)
    array[0] = 5
    assert kept.tolist() == [1, 1, 1]


def test_the_students_own_line_is_found_below_a_librarys():
    def own(n):
        twice = 2 * n
        return np.linalg.inv(twice)

    (line,) = problem(own, replace(QUESTION, by_hand=((np.zeros((2, 2)),),))).lines
    assert line[1] == "return np.linalg.inv(twice)"
    assert line[0] == own.__code__.co_firstlineno + 2
