"""01_labels.from_one_hot: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.questions.question import Question, wrong
from labkit.course.questions.t01_labels import labels_and_classes
from labkit.course.questions.t01_labels.one_hot import one_hot


def from_one_hot(Y):
    """Turn a one-hot tensor back into labels; all zeros become 255."""
    return np.where(Y.any(axis=-1), Y.argmax(axis=-1), 255)


QUESTION = Question(
    name="01_labels.from_one_hot",
    reference=from_one_hot,
    inputs=lambda rng: (one_hot(*labels_and_classes(rng)),),
    by_hand=(
        (np.array([[[1, 0], [0, 1], [0, 0]]], np.uint8),),
        (np.array([[[0, 0, 1], [1, 0, 0]], [[0, 0, 0], [0, 1, 0]], [[0, 1, 0], [0, 0, 1]]], np.uint8),),
    ),
    rtol=0.0,
    atol=0.0,
    points=2,
)

# ---------------------------------------------------------------------------------------------------- wrong answers


@wrong(QUESTION, "Over which axis of (H, W, C) is there exactly one 1?")
def along_the_columns(Y):
    return np.where(Y.any(axis=1), Y.argmax(axis=1), 255)


@wrong(QUESTION, "You look for the smallest entry: where is the 1?")
def first_zero(Y):
    return np.where(Y.any(axis=-1), Y.argmin(axis=-1), 255)
