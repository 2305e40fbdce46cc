"""What a single change mends, and where none does: what stands idle in an answer."""

import numpy as np
import pytest

from labgrader.comparison import HEAVY
from labgrader.question import Question
from labgrader.reply import repair
from labgrader.reply.finding import Finding, Span
from labgrader.reply.idle import idle
from labgrader.reply.listed import fingerprint
from labgrader.reply.repair import repairs
from labgrader.reply.sentences import found_in_the_program

pytestmark = pytest.mark.bad_input  # without the shape checks, as outside the suite
CASES = [(np.array([1.0, 5.0]), np.array([2.0, 3.0])), (np.array([4.0, 0.5, 7.0]), np.array([1.0, 1.0, 9.0]))]
FRESH = [(np.array([-3.0, 2.0]), np.array([0.25, -8.0]))]


def found(reference, source, shown=CASES, fresh=FRESH, mistakes=()):
    """What repair finds in a program, with the parts that it marks; mistakes: the listed ones."""

    def off(expected, got):
        same = np.shape(expected) == np.shape(got)
        return np.where(np.isclose(expected, got), 0.0, np.abs(expected - got)).ravel() if same else None

    def right(expected, got):
        return off(expected, got) is not None and not off(expected, got).any()

    cases, more = ([(args, reference(*args)) for args in some] for some in (shown, fresh))
    listed = [{fingerprint(mistake(*args)): frozenset({k}) for k, mistake in enumerate(mistakes)} for args in shown]
    pieces = ("quiet", "import numpy as np"), ("f", source)
    lines = source.split("\n")
    return [
        (f.kind, [lines[s.line - 1][s.column : s.end].strip() for s in f.spans])
        for f in repairs(pieces, "f", cases, lambda: more, right, off, listed)
    ]


# --------------------------------------------------------------------------------------------- one repair


def test_a_repair_counts_if_it_mends_cases_that_are_not_shown():
    """2 * 1 is 2 alone: of the two repairs that the shown case allows, another one tells which is right."""
    source, shown = "def f(a, b):\n    return a + b", [(np.array([2.0]), np.array([1.0]))]
    by_shown = found(np.multiply, source, shown, fresh=[])
    by_more = found(np.multiply, source, shown, fresh=[(np.array([3.0]), np.array([5.0]))])
    assert ("operator", ["+"]) in by_shown and ("too much", ["b"]) in by_shown
    assert ("operator", ["+"]) in by_more and ("too much", ["b"]) not in by_more


def test_a_program_that_takes_long_on_its_cases_is_not_searched(monkeypatch):
    source = "def f(a, b):\n    return a + b"
    assert found(np.multiply, source)
    monkeypatch.setattr(repair, "MOST_S_OF_ALL", 0.0)
    assert found(np.multiply, source) == []


def test_a_change_from_which_lapack_would_not_come_back_does_not_end_the_search():
    """b / a has infinite entries, in places where the search for singular vectors has no end."""
    a, b = np.array([[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [0.0, 3.0, 2.0]]), np.array([1e-4, 0.3, 1.0])
    reference = lambda a, b: np.abs(np.linalg.svd(a * b[:, None])[2])  # noqa: E731
    source = "def f(a, b):\n    return np.abs(np.linalg.svd(a / b[:, None])[2])"
    assert ("operator", ["/"]) in found(reference, source, [(a, b)], fresh=[(a.T, b)])


@pytest.mark.parametrize(
    "now, before, closer",
    [
        ([0.0, 0.0], [1.0, 0.0], True),
        ([0.5, 1.0], [1.0, 2.0], True),
        ([0.0, 2.0], [1.0, 2.0], False),  # one is right, and the other as wrong as before
        ([0.0, 0.1], [1.0, 0.0], False),  # one was right
        ([0.0], None, True),  # of another form before
        ([0.3], None, False),
        (None, [1.0], False),
    ],
)
def test_a_mark_beside_a_listed_mistake_brings_each_number_of_the_case_closer(now, before, closer):
    arrays = [None if numbers is None else np.array(numbers) for numbers in (now, before)]
    assert repair.is_closer(*arrays) is closer


def test_a_mark_beside_a_listed_mistake_spoils_no_case_that_was_right():
    """One mistake, what b = 9 means, is not told as two, of which the second would have to undo the first."""
    source, differs = "def f(a, b):\n    return 1.0 * (a != b)", lambda a, b: 1.0 * ((a != b) & (b != 9))
    larger = lambda a, b: 1.0 * (a > b)  # noqa: E731
    wrong = [(np.array([1]), np.array([9])), (np.array([3, 1, 2, 7]), np.array([5, 9, 2, 4]))]
    more = [(np.array([7, 8, 0, 9, 9, 4]), np.array([9, 9, 9, 9, 0, 4]))]
    assert found(differs, source, wrong, more, [larger]) == [("comparison", ["!="])]
    assert found(differs, source, [*wrong, (np.array([1]), np.array([2]))], more, [larger]) == []


def test_a_mark_beside_a_listed_mistake_is_told_where_large_cases_agree():
    """In small cases alone a change may give by chance what a listed mistake does."""
    source, differs = "def f(a, b):\n    return 1.0 * (a != b)", lambda a, b: 1.0 * ((a != b) & (b != 9))
    small = [(np.array([1]), np.array([9])), (np.array([3, 1, 2, 7]), np.array([5, 9, 2, 4]))]
    large = [(np.arange(HEAVY) % 7, np.arange(HEAVY) % 5)]
    same, other = lambda a, b: 1.0 * (a > b), lambda a, b: 1.0 * (a > b) * (len(a) < HEAVY)
    assert found(differs, source, [*small, *large], mistakes=[same]) == [("comparison", ["!="])]
    assert found(differs, source, [*small, *large], mistakes=[other]) == []


def test_a_mark_with_which_the_case_shown_is_right_is_told_before_one_that_only_brings_it_closer():
    """1 * 1 is closer to 1.4 than 1 + 1 is, and so large an operator comes before a name."""
    shown = [(np.array([1.0]), np.array([0.4])), (np.array([9.0, 3.0]), np.array([1.0, 2.0]))]
    without_9, squares = np.add, lambda a, b: a * a
    answer = lambda a, b: a + b + 7 * (a == 9)  # noqa: E731
    source = "def f(a, b):\n    return a + a"
    assert found(answer, source, shown, mistakes=[squares]) == [("operator", ["+"])]
    assert found(answer, source, shown, mistakes=[squares, without_9])[0][0] == "name"


@pytest.mark.parametrize(
    "kind, places, says", [("name", 2, "places need another of"), ("name", 1, "place needs another")]
)
def test_a_sentence_agrees_with_how_many_places_are_marked(kind, places, says):
    spans = tuple(Span(2, column, 2, column + 1) for column in (11, 15)[:places])
    assert says in said(Finding(kind, 0, spans))[0]


def test_what_no_single_change_mends_is_not_found():
    source = "def f(a, b):\n    return np.stack([a + 1.3, b * 1.7, a * b - 0.9 * a])[:, :2].sum(axis=0) ** 3"
    assert found(lambda a, b: np.stack([a, b, a - b])[:, :2].prod(axis=0), source) == []


PIECES = (("f", "def f(a, b):\n    return a + b - a"),)


def said(*findings):
    """The first sentence about findings, and how many places it marks."""
    question = Question(name="0.f", reference=lambda a, b: b, inputs=lambda rng: ())
    sentence = next(found_in_the_program(question, PIECES, findings, values_are_right=False))
    return sentence.says, sum(len(line.parts) for line in sentence.marked)


def test_at_most_two_places_are_offered_to_choose_from():
    one, other = (Finding("name", 0, (Span(2, column, 2, column + 1),)) for column in (11, 15))
    both, others = (
        Finding("name", 0, spans) for spans in ((one.spans + other.spans), (Span(2, 19, 2, 20), *one.spans))
    )
    assert said(one, other)[0].startswith("Change one of the two") and said(one, other)[1] == 2
    assert "one of the two" not in said(both, others)[0]


# --------------------------------------------------------------------------------------------- what stands idle


@pytest.mark.parametrize(
    "source, kinds",
    [
        ("def f(a, b):\n    return a", ["unread"]),
        ("def f(a, b):\n    c = a * b\n    return a", ["unused"]),
        ("def f(a, b):\n    c = len(a)\n    n, m = b.shape[0], 1\n    return a + b", []),  # may well be left over
        ("def f(a, b):\n    c = len(a + b)\n    return a + b", ["unused"]),
        ("def f(a, b):\n    c = a * b\n    c += 1\n    return c", []),
        ("def f(a, b):\n    def g(x):\n        return x + b\n    return g(a)", []),
        ("def f(a, b):\n    for _ in range(3):\n        a = a + b\n    return a", []),
        ("def f(a, b):\n    x, y = a\n    return x + b", []),  # what is unpacked need not be used
        ("def f(a, b):\n    c = 1\n    return eval('a + b + c')", []),
        ("def g(a, b):\n    return a\ndef f(a, b):\n    return g(a, b)", []),  # of the answer alone
    ],
)
def test_what_is_never_read_is_found(source, kinds):
    assert [finding.kind for finding in idle([("f", source)], "f")] == kinds


def test_rows_that_are_one_list_are_told_before_anything_else_and_an_unread_argument_before_a_repair():
    text = "def f(a, b):\n    n = [[0] * 3] * 3\n    n[0][0] = a[0]\n    return n"
    assert [(f.kind, f.spans[0].line) for f in idle([("f", text)], "f")] == [("aliased", 2), ("unread", 1)]
    harmless = "def f(a, b):\n    n = np.array([[0] * 3] * 3)\n    return n + a + b"
    assert idle([("f", harmless)], "f") == []
    repair, unread = Finding("name", 0, (Span(2, 11, 2, 12),)), Finding("unread", 0, (Span(1, 6, 1, 7),))
    assert said(repair, unread)[0].startswith("Your function never reads the marked argument")
