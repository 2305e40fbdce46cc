"""Each reference of topic 02 gives what the kit gives; where the kit has no such function, its solvers judge."""

import numpy as np

from labkit.course.questions import t02_crf
from labkit.course.questions.question import of_topic
from labkit.crf import PottsCRF, unary_from_probabilities

SEEDS = range(5)
QUESTIONS = of_topic("02_crf")
right = {name: question.reference for name, question in QUESTIONS.items()}


def model(seed: int, C: int = 3):
    """A small random model as arrays of the questions' shapes, and the same as the kit's."""
    psi, w_right, w_down = t02_crf.model(np.random.default_rng(seed), 3, 4, C)
    return psi, w_right, w_down, as_crf(psi, w_right, w_down)


def as_crf(psi, w_right, w_down) -> PottsCRF:
    return PottsCRF(psi, np.stack([np.pad(w_right, ((0, 0), (0, 1))), np.pad(w_down, ((0, 1), (0, 0)))]))


def test_costs_are_the_kits():
    p, floor = QUESTIONS["unary_from_probabilities"].inputs(np.random.default_rng(1))
    assert np.allclose(right["unary_from_probabilities"](p, floor), unary_from_probabilities(p, floor), atol=1e-12)
