"""What a check gives back for a right answer: the student's function, whose lists come out as a lab's cells need them.

A statement lets a list or a tuple of the numbers come back, and lessons compute with arrays. Which form an output has,
an array, a number or a tuple of several, is read off what is expected in the public cases.
"""

import functools
from collections.abc import Callable, Sequence
from contextvars import ContextVar

import numpy as np

from labgrader.comparison import Case, Listed, Problem, as_numpy, with_rows_as_outputs

inside = ContextVar("inside", default=False)  # an answer is running: of others, and itself, it gets what a grader gives


def giving_arrays(answer: Callable, cases: Sequence[Case]) -> Callable:
    """The answer, but for what it returns where a list or a tuple came. It looks the same: name, docstring, source.

    cases: those of its question, with what is expected.

    >>> halves = giving_arrays(lambda x: [n / 2 for n in x], [Case((), np.zeros(3), True)])
    >>> halves([1, 2])
    array([0.5, 1. ])
    """
    if getattr(answer, "given", None) is answer:  # by an earlier check
        return answer
    form = max((case.expected for case in cases), key=np.ndim if not isinstance(cases[0].expected, tuple) else len)

    @functools.wraps(answer)
    def given(*args, **named):
        __tracebackhide__ = True
        return called(answer, form, args, named)

    given.given = given
    return given


def called(answer: Callable, form: object, args: tuple, named: dict) -> object:
    """What an answer returns, in a form. By itself, since `given` goes to other processes with all that it names."""
    __tracebackhide__ = True
    if inside.get():
        return answer(*args, **named)
    token = inside.set(True)
    try:
        got = answer(*args, **named)
    finally:
        inside.reset(token)
    return in_form(form, got)


def in_form(form: object, got: object) -> object:
    """An output in the form of another one; as it came where that is its form, or it has none.

    >>> in_form((np.zeros(2), np.float64(0)), [(1, 2), 3.0])
    (array([1., 2.]), np.float64(3.0))
    """
    usual = isinstance(got, np.ndarray | np.generic | bool | int | float)
    values = with_rows_as_outputs(form, got if usual else as_numpy(got))
    if isinstance(form, tuple):
        fits = isinstance(values, tuple) and len(values) == len(form)
        return tuple(map(part_in_form, form, values)) if fits else got
    if isinstance(values, tuple) and len({part.shape for part in values}) == 1:
        values = np.array(values).view(Listed)
    return got if isinstance(values, tuple | Problem) else part_in_form(form, values)


def part_in_form(form: np.ndarray | np.generic, value: object) -> object:
    """One output: numbers of a list in the type that is expected, if they are the same in it; one alone as a number."""
    if isinstance(value, np.ndarray) and value.shape == (1,) and form.ndim == 0:
        return value[0]
    if not isinstance(value, Listed):
        return value
    array = np.asarray(value) if value.shape != (0,) else np.empty((0, *form.shape[1:]))
    typed = array.astype(form.dtype)
    return typed if form.dtype.kind == "f" or np.array_equal(typed, array) else array
