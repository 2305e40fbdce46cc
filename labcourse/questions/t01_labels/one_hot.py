"""01_labels.one_hot: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labcourse.questions.t01_labels import images_and_classes
from labgrader.question import Question, holds, wrong


def one_hot(y, C):
    """Turn a stack of label images into one-hot planes (N, C, H, W); a pixel that is ignored (255) is all zeros."""
    return (y[:, None] == np.arange(C)[:, None, None]).astype(np.uint8)


QUESTION = Question(
    reference=one_hot,
    inputs=images_and_classes,
    by_hand=((np.array([[[0, 2]]], np.uint8), 3), (np.array([[[1, 255], [0, 3], [2, 2]]], np.uint8), 5)),
    random_cases=6,
    points=1,
    forbidden=("sklearn",),
)


@holds("over the axis of the classes it sums to 1, and to 0 where the pixel is ignored")
def sums_to_1(y, C, Y):
    return np.array_equal(np.sum(Y, axis=1), y != 255)


# ---------------------------------------------------------------------------------------------------- wrong answers


def last(y, C):
    """The lesson's one-hot tensor, classes last."""
    return (y[..., None] == np.arange(C)).astype(np.uint8)


@wrong("That is the lesson's tensor, with the classes last. Here the classes are the second axis: (N, C, H, W).")
def classes_last(y, C):
    return last(y, C)


@wrong("The numbers are right but in the wrong places: reshape does not move an axis.")
def reshaped(y, C):
    return last(y, C).reshape(len(y), C, *y.shape[1:])


@wrong("You swapped rows and columns: the last two axes are still H and W.")
def rows_and_columns_exchanged(y, C):
    return last(y, C).swapaxes(1, 3)


@wrong("A class that is not in these images has a plane of zeros: there are always C planes.")
def classes_that_occur(y, C):
    return (y[:, None] == np.unique(y[y != 255])[:, None, None]).astype(np.uint8)


@wrong("Add up the entries of an unlabelled pixel (255): what should the sum be, and what do you get?")
def ignored_is_shared_out(y, C):
    return np.where((y == 255)[:, None], 1 / C, one_hot(y, C))


@wrong("The function gets C, which need not be 4: how many of the C planes do you fill?")
def four_classes(y, C):
    Y = one_hot(y, C)
    Y[:, 4:] = 0
    return Y
