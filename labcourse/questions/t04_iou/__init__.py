"""Questions of topic 04: the confusion matrix and the scores that follow from it."""

import numpy as np

from labcourse.kinds import MOST_CLASSES, array

RETIRED = ("mean_iou",)  # no lab asks it any more; those that were released when one did are graded all the same


def counts(rng):
    """Draw an asymmetric confusion matrix; in most a class is absent, one is never true, and one is never predicted."""
    C = int(rng.choice([4, 5, 6]))
    n = rng.integers(1, 60, (C, C)) + np.diag(rng.integers(20, 400, C))
    absent, never_true, never_predicted = rng.permutation(C)[:3]
    if rng.random() < 0.7:
        n[absent] = n[:, absent] = 0
    if rng.random() < 0.7:
        n[never_true] = 0
    if rng.random() < 0.7:
        n[:, never_predicted] = 0
    return (n.astype(np.int64),)


def counts_of_many_classes(rng):
    """Draw the matrix of 255 classes in a set of pictures; half of the cells are 0, and the others of any size."""
    n = np.exp(rng.uniform(0.0, np.log(MOST_COUNTED), (MOST_CLASSES, MOST_CLASSES)))
    return (np.where(rng.random(n.shape) < 0.5, 0.0, n).astype(np.int64),)


def counts_of_frames(rng):
    """Draw the confusion matrices of a few frames of unlike size; a class is often absent from a frame, or from all.

    Each frame has a pixel.
    """
    F, C = int(rng.choice([3, 6])), int(rng.choice([4, 5]))
    n = rng.integers(0, 30, (F, C, C)) + np.eye(C, dtype=np.int64) * rng.integers(10, 500, (F, C, 1))
    n *= rng.integers(1, 200, (F, 1, 1))  # more pixels than 16 bits count
    for frame in n[1:]:
        absent = rng.integers(C)
        frame[absent], frame[:, absent] = 0, 0
    if rng.random() < 0.7:
        n[:, 1], n[:, :, 1] = 0, 0
    if rng.random() < 0.7:
        n[:, 2] = 0
    if rng.random() < 0.7:
        n[:, 3], n[:, :, 3] = 0, 0
        n[0, 3, 3] = 1  # one pixel
    n[~n.any(axis=(1, 2)), 0, 0] = 7  # no frame is empty
    return (n.astype(np.int64),)


MOST_COUNTED = 10**12  # pixels of a cell of n: a million pictures of a million pixels
COUNTS = array("C C", 0, MOST_COUNTED, dtype="int64", says=("C from 1 to 255", "0 to 10 ** 12"))

# Two confused with each other, which a student sees first; a class in neither image; one predicted, never true; edges.
SMALL_COUNTS = (
    (np.array([[6, 2], [1, 4]]),),
    (np.array([[6, 2, 0], [0, 4, 0], [0, 0, 0]]),),
    (np.array([[5, 0, 3], [1, 2, 0], [0, 0, 0]]),),
    (np.array([[0, 7], [2, 255]]),),
    (np.array([[0, 3], [0, 5]]),),  # class 0 is true and never predicted
    (np.diag([3, 0, 1]),),
    (np.array([[6, 2], [0, 4]]),),
    (np.array([[5]]),),
    (np.array([[3 * MOST_COUNTED // 4, 0], [MOST_COUNTED, 50]]),),
)


def parts(n):
    """The true positives, all that is predicted and all that is true, by class, as floats."""
    n = np.asarray(n, np.float64)
    return np.diagonal(n), n.sum(axis=0), n.sum(axis=1)


def divide(part, whole, empty=np.nan):
    return np.where(whole > 0, part / np.where(whole > 0, whole, 1.0), empty)


def iou_of(n, empty=np.nan):
    correct, predicted, true = parts(n)
    return divide(correct, predicted + true - correct, empty)
