"""01_labels.class_shares: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.checker.question import Question, wrong
from labkit.course.topics.t01_labels import labels_and_classes


def class_shares(y, C):
    """Give the share of each class among the pixels that are not ignored (255)."""
    judged = y[y != 255]
    return np.bincount(judged, minlength=C) / judged.size


def _many_labels(rng):
    y, C = labels_and_classes(rng)
    return np.tile(y, (5, 5)), C  # more pixels of a class than a byte counts


QUESTION = Question(
    reference=class_shares,
    inputs=_many_labels,
    by_hand=(
        (np.array([[1, 1], [0, 3]], np.uint8), 5),
        (np.array([[1, 255, 255], [1, 1, 0]], np.uint8), 3),
        (np.tile(np.array([0, 1, 1, 1, 2, 255], np.uint8), (25, 4)), 3),  # more pixels of a class than a byte counts
    ),
    random_cases=6,
    points=1,
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def counts(y, C):
    return np.bincount(y[y != 255], minlength=C)


@wrong("Your shares do not add up to 1: which pixels did nobody judge?")
def of_all_pixels(y, C):
    return counts(y, C) / y.size


@wrong("Pixels of 255 are counted as class 0: nobody has judged them, so they belong to no class.")
def unjudged_is_background(y, C):
    return np.bincount(np.where(y == 255, 0, y).ravel(), minlength=C) / y.size


@wrong("Background (class 0) is a class like the others here.")
def without_background(y, C):
    n = counts(y, C)
    return np.append(0.0, n[1:] / max(n[1:].sum(), 1))


@wrong("Some rows have fewer judged pixels than others: count over the whole image, divide once.")
def mean_of_rows(y, C):
    """Average the shares of the image's rows, though some rows count fewer pixels."""
    return np.mean([counts(row, C) / np.count_nonzero(row != 255) for row in y if (row != 255).any()], axis=0)


@wrong("A class without pixels has a share as well, 0: the result has always C entries.")
def only_what_occurs(y, C):
    n = counts(y, C)
    return n[n > 0] / n.sum()


@wrong("Yours gives a rare class a large number: that is one over its share (a weight, topic 05).")
def inverse_shares(y, C):
    n = counts(y, C)
    return n.sum() / np.maximum(n, 1)


@wrong("np.bincount ends at the largest label that occurs: what makes it as long as C?")
def up_to_the_largest_label(y, C):
    n = np.bincount(y[y != 255])
    return n / n.sum()


@wrong("np.histogram spreads its bins from the least value to the largest: where does that of class 1 begin?")
def bins_between_the_extremes(y, C):
    n, _ = np.histogram(y[y != 255], bins=C)
    return n / n.sum()


@wrong("A byte ends at 255. How many pixels of one class can an image have?")
def counted_in_bytes(y, C):
    n = counts(y, C).astype(np.uint8)
    return n / n.sum()


@wrong("Clipping makes the largest class of 255: pixels that nobody judged are then counted for that class.")
def unjudged_as_the_last_class(y, C):
    return np.bincount(np.minimum(y, C - 1).ravel(), minlength=C) / y.size


@wrong("np.bincount counts 255 like any other number: leave out the pixels that nobody judged before you count.")
def unjudged_as_a_class(y, C):
    return np.bincount(y.ravel(), minlength=C) / y.size


@wrong("Between C edges there are C - 1 bins, and the last holds two classes: how many edges do C bins need?")
def edges_of_one_bin_too_few(y, C):
    n, _ = np.histogram(y[y != 255], bins=np.arange(C))
    return np.append(n, 0) / n.sum()
