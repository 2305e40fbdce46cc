"""What an exception means in a task, by its text and the arguments that led to it."""

import numpy as np
import pytest

from labgrader.reply.errors import explain
from labgrader.reply.judge import output_of

pytestmark = pytest.mark.bad_input  # without the shape checks, as outside the suite


def raised(function) -> str:
    """How an exception is told."""
    return output_of(function, ()).says


ARGS = {"y": np.array([[0, 255]]), "P": np.zeros((5, 3)), "R": np.eye(3)}
EXCEPTIONS = [
    (lambda: np.zeros(3)[np.array([[0, 255]])], "ignored pixels of y, labelled 255"),
    (lambda: np.zeros(3)[3], "one past the end: the last one along axis 0 (as long as that of R) is 2"),
    (lambda: np.zeros((3, 2))[0, 4], "an index up to 4 fits axis 0 of P: are two axes swapped?"),
    (lambda: np.zeros(2)[4], "An index of 4 into an axis of 2"),  # P's first axis is no other one
    (lambda: np.zeros(3)[1.5], "must be integers or booleans"),
    (lambda: np.zeros(3)[np.ones(4, bool)], "A mask of length 4 along axis 0"),
    (lambda: np.zeros(3)[0, 1], "2 indices for an array with 1 axes"),
    (lambda: np.float64(3)[0], "single number"),
    (lambda: np.zeros((5, 3)) + np.zeros((3, 5)), "(the shape of P)"),
    (lambda: np.eye(3) @ np.zeros((5, 3)), "other axes than you meant"),
    (lambda: np.zeros(0)[0], "entry 0 of an array that has none"),
    (lambda: np.zeros(3).reshape(2, 2), "3 numbers do not fill the shape (2,2), which takes 4: are there too many"),
    (lambda: np.zeros(4).reshape(1, 1, 8), "which takes 8: is a length 2 times too large"),
    (lambda: np.zeros(9).reshape(3, 1), "which takes 3: is a length 3 times too small"),
    (lambda: np.zeros(9).reshape(2, -1, 2), "the shape (2,-1,2), which takes a multiple of 4"),
    (lambda: 1 if np.zeros(3) > 0 else 2, "np.where"),
    (lambda: np.zeros(3).sum(axis=1), "no axis 1 here"),
    (lambda: np.zeros(0).max(), "empty array"),
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
    (lambda: np.zeros(2.0), "// an integer"),
    (lambda: np.max(1.0, 2.0), "takes b for an axis"),
    (lambda: np.max(1.0, 2.0, 3.0), "np.max([a, b, c])"),
    (lambda: undefined_name, "No cell that counts here defines undefined_name"),
    (lambda: yy + 1, "No cell"),
    (lambda: np.argmx(1), "np.argmax"),
    (lambda: np.zeros(2).summ(), ".sum"),
    (lambda: {}[3], "no such key"),
    (lambda: exec("raise EOFError('EOF when reading a line')"), "waits for somebody to type"),
    (lambda: int(np.nan), "is float() meant?"),
    (lambda: int("inf"), "is float() meant?"),
    (lambda: np.zeros((1, 3))[:, :2].__iadd__(np.zeros((0, 2))), "The right side is empty here"),
    (
        lambda: np.zeros(2).__iadd__(np.zeros((3, 2))),
        "The place on the left has shape (2,), and what you put there makes",
    ),
]


@pytest.mark.parametrize("number", range(len(EXCEPTIONS)))
def test_an_exception_is_explained_by_what_raised_it(number):
    function, says = EXCEPTIONS[number]
    assert says in explain(raised(function), ARGS), raised(function)


def test_comparisons_without_brackets_are_seen_in_the_line():
    text = raised(lambda: np.ones(2) > 0 & np.ones(2))
    assert "bind more tightly" in explain(text, {}, "return a > 0 & b")
    assert "bind more tightly" not in explain(text, {}, "return f(a)")


def mask_of_one(y):
    """A function of a lab, as another answer calls it."""


# What raises, the student's line, and what is said.
OF_A_LINE = [
    (lambda: 1 if np.zeros(2) <= np.ones(2) <= np.ones(2) else 2, "if a <= b <= c:", "write (a <= b) & (b <= c)"),
    (lambda: np.ones(2) > 0 & np.ones(2) < 3, "return a > 0 & b < 3", "bind more tightly"),
    (lambda: mask_of_one(), "return mask_of_one()", "Your call of mask_of_one lacks y"),
    (lambda: mask_of_one(1, 2), "return mask_of_one(1, 2)", "too many arguments"),
    (lambda: mask_of_one(), "", "The check calls it with these arguments: y, P, R"),
    (lambda: np.eye(4) @ np.zeros((3, 5)), "T @ P.T", "T[:3, :3]"),
    (lambda: np.diag(np.eye(3)) @ np.zeros((5, 3)), "np.diag(p) @ g", "np.diag of a matrix takes its diagonal"),
    (lambda: int(np.float64(np.nan)), "int(u.mean())", "The mean of nothing is NaN"),
    (lambda: np.stack([np.zeros(256), np.zeros(4)]), "n = np.stack([np.bincount(i) for i in y])", "with a 255 in it"),
    (lambda: np.zeros(7) == np.zeros((5, 3)) + np.zeros(7)[:7], "a == b", "mask both alike"),
    (lambda: np.zeros(15) == np.zeros((5, 3)) + np.zeros(15), "a == b", "15 numbers, as a mask or ravel puts them"),
    (lambda: np.ones((1, 3)) + np.ones(4), "n = n[:k] + n[k + 1 :]", "+ concatenates lists. With arrays"),
    (lambda: np.zeros((5, 3)) + np.zeros((4, 3)), "a + b", "one has length 5 where the other has 4"),
]


@pytest.mark.parametrize("function, line, says", OF_A_LINE)
def test_an_exception_is_explained_by_its_line(function, line, says):
    assert says in explain(raised(function), ARGS, line)


def test_a_product_after_a_division_is_seen_in_the_program():
    text = raised(lambda: np.zeros(2)[7])
    assert "a // 2 * H is (a // 2) * H" in explain(text, {}, "y[rows]", "rows = (2 * v + 1) * h // 2 * H\ny[rows]")
    assert "brackets" not in explain(text, {}, "y[rows]", "rows = (2 * v + 1) * h // (2 * H)\ny[rows]")
    assert "brackets" not in explain(text, {}, "y[rows]", "rows = c // block * H\ny[rows]")  # as it is meant


def test_an_axis_that_is_missing_is_seen_in_the_program():
    text, program = raised(lambda: np.diagonal(np.delete(np.eye(3), 0))), "a = np.delete(n, {})\nreturn np.diagonal(a)"
    assert "np.delete without an axis" in explain(text, {}, "return np.diagonal(a)", program.format("k"))
    assert "np.delete" not in explain(text, {}, "return np.diagonal(a)", program.format("k, axis=0"))


def test_what_is_not_known_is_not_explained():
    assert explain("ValueError: no such thing", ARGS) == ""
    assert explain("", ARGS) == ""
