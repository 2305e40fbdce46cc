"""01_labels.one_hot: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.checker.question import Question, holds, wrong
from labkit.course.topics.t01_labels import labels_and_classes


def one_hot(y, C):
    """Turn labels into a one-hot tensor, one more axis of length C; a pixel that is ignored (255) is all zeros."""
    return (y[..., None] == np.arange(C)).astype(np.uint8)


QUESTION = Question(
    reference=one_hot,
    inputs=labels_and_classes,
    by_hand=((np.array([[0, 2]], np.uint8), 3), (np.array([[1, 255], [0, 3], [2, 2]], np.uint8), 5)),
    random_cases=6,
    points=1,
    forbidden=("sklearn",),
)


@holds("over the last axis it sums to 1, and to 0 where the pixel is ignored")
def sums_to_1(y, C, Y):
    return np.array_equal(np.sum(Y, axis=-1), y != 255)


# ---------------------------------------------------------------------------------------------------- wrong answers


@wrong("A pixel of 255 gets a 1 in the last class of yours: what should its C entries be?")
def ignored_as_last_class(y, C):
    return np.eye(C, dtype=np.uint8)[np.minimum(y, C - 1)]


@wrong("A class that is not in this image has a plane too, of zeros: there are always C of them.")
def classes_that_occur(y, C):
    return (y[..., None] == np.unique(y[y != 255])).astype(np.uint8)


@wrong("Add up the entries of a pixel that nobody judged, 255: what should come out, and what does in yours?")
def ignored_is_shared_out(y, C):
    Y = (y[..., None] == np.arange(C)).astype(float)
    Y[y == 255] = 1 / C
    return Y


@wrong("The function gets C, which need not be 4: how many of the C planes does yours fill?")
def four_classes(y, C):
    Y = one_hot(y, C)
    Y[..., 4:] = 0
    return Y
