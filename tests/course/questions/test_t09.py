"""The references of 09_other_stacks are the kit's functions, or OpenCV's."""

import numpy as np
import pytest

from labkit.course.questions.question import of_topic

QUESTIONS = of_topic("09_other_stacks")
right = {name: question.reference for name, question in QUESTIONS.items()}
SEEDS = pytest.mark.parametrize("seed", range(4))


def draw(question, seed):
    return question.inputs(np.random.default_rng(seed))
