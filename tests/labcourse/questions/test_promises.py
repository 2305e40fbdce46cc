"""What statements promise is tried: no simplification goes unnoticed, no edge is missing, in any blank of any lab.

`pytest tests/labcourse/questions/test_promises.py -k 07_grasp` tries one topic. What a failing test lists is told by a
case, excluded by the argument's kind (and in the statement's words), or declared in the kind's `free`.
"""

import importlib
import inspect
import re
from dataclasses import replace

import numpy as np
import pytest
from at_night import others_at_night
from notebooks import ROOT, code
from promises import Trial, examples, is_a_case, unsaid

from labcourse import kinds
from labgrader.course import course, find, of_topic, topics
from labgrader.question import Question

pytestmark = pytest.mark.bad_input  # as outside the suite


def blanks() -> list[str]:
    """The questions that labs ask."""
    retired = {t: getattr(importlib.import_module(f"{course().questions}.t{t}"), "RETIRED", ()) for t in topics()}
    return [q.name for t in topics() for f, q in of_topic(t).items() if f not in retired[t]]


def statement(question: Question) -> str:
    """What a lab's cell says of a question: the docstring of its function."""
    sources = (cell.source for cell in code(ROOT / "solutions" / question.topic / f"{question.topic}.ipynb"))
    head = re.compile(rf'^def {question.function}\(.*?\).*?:\n    """(.*?)"""', re.DOTALL | re.MULTILINE)
    return next(inspect.cleandoc(found[1]) for source in sources if (found := head.search(source)))


BLANKS = pytest.mark.parametrize("name", blanks())
ROUNDS = pytest.mark.parametrize("rounds", others_at_night([8, 60]))


@BLANKS
def test_a_statement_says_what_its_kinds_are(name):
    question = find(name)
    assert tuple(question.kinds) == question.parameters
    assert not list(unsaid(question, statement(question)))


@BLANKS
def test_each_example_of_a_statement_is_a_case(name):
    question = find(name)
    text = statement(question)
    assert not re.search(r"^ *Examples?:", text, re.MULTILINE), "write it as >>> lines, which are tried"
    assert all(is_a_case(question, args) for args in examples(question, text))


@BLANKS
@ROUNDS
def test_every_case_is_of_its_kinds_and_every_edge_is_in_a_case(name, rounds):
    trial = Trial(find(name), rounds)
    assert not sorted(set(trial.of_no_kind()))
    assert not list(trial.never_drawn())


@BLANKS
@ROUNDS
def test_no_simplification_of_an_argument_goes_unnoticed(name, rounds):
    assert not list(Trial(find(name), rounds).unnoticed())


@BLANKS
def test_every_kind_of_inputs_is_drawn_in_a_check(name):
    question = find(name)
    assert not isinstance(question.inputs, tuple) or len(question.inputs) <= question.random_cases


# --------------------------------------------------------------------------------------- the tests' own machinery


def length(x):
    """The length of a vector in space, whose direction does not count."""
    return np.sqrt((x**2).sum())


SPACE = Question(
    name="00_test.length",
    reference=length,
    inputs=lambda rng: (rng.normal(size=3) * 1e6,),
    by_hand=((np.array([0.0, 4.0, 0.0]),), (np.array([0.0002, 0.0, 0.0004]),)),
    kinds={"x": kinds.array("3", free=("|x|*", "-|x|*", "sorted*", "reversed*", "unique*"))},
)


def test_what_no_case_tells_is_named_and_what_no_answer_depends_on_is_declared():
    assert not [*Trial(SPACE, 8).unnoticed()]
    positive = {"inputs": lambda rng: (rng.random(3),), "by_hand": (), "reference": lambda x: x.sum()}
    found = {*Trial(replace(SPACE, kinds={"x": kinds.array("3")}, **positive), 8).unnoticed()}
    assert {"x: |x| at [2]", "x: |x|", "x: bytes", "x: sorted along 3", "x: half of the largest"} <= found
    assert not {"x: 0 at [1]", "x: whole", "x: first alone along 3"} & found
    found = [
        *Trial(replace(SPACE, kinds={"x": kinds.array("3", 0.0, free=("0 at *", "bytes"))}, **positive), 8).unnoticed()
    ]
    assert "x: 0 at [1] is declared to be free, and a case tells it" in found and "x: bytes" not in " ".join(found)
    assert not [simple for simple in found if "|x|" in simple], "no number of the kind is negative"


def test_what_a_draw_of_two_shows_is_not_told_and_what_turns_show_is():
    often = replace(SPACE, by_hand=(), inputs=lambda rng: (rng.choice([-1.0, 1.0]) * np.ones(3),), random_cases=3)

    def negative(i, args):
        return bool((args[0] < 0.0).all())

    assert not Trial(often, 60).told(negative), "six draws are of one sign by a chance of 1 in 64"
    turns = replace(often, inputs=(lambda rng: (np.ones(3),), lambda rng: (-np.ones(3),)))
    assert Trial(turns, 60).told(negative)


def test_rotations_are_rotations_of_all_directions():
    R = np.stack([kinds.rotation(rng) for rng in [np.random.default_rng(0)] for _ in range(4000)])
    np.testing.assert_allclose(R @ R.transpose(0, 2, 1), np.broadcast_to(np.eye(3), R.shape), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(R), 1.0)
    # The columns of a rotation of which all are alike are spread evenly: E R = 0, E R[i, j]^2 = 1 / 3.
    np.testing.assert_allclose(R.mean(axis=0), 0.0, atol=0.05)
    np.testing.assert_allclose((R**2).mean(axis=0), 1 / 3, atol=0.02)
