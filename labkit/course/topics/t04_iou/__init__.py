"""Questions of topic 04: the confusion matrix and the scores that follow from it."""

import numpy as np


def counts(rng):
    """Draw an asymmetric confusion matrix; in some one class is absent, in some one is predicted only."""
    C = int(rng.choice([3, 4, 6]))
    n = rng.integers(0, 60, (C, C)) + np.diag(rng.integers(20, 400, C))
    kind = rng.integers(3)
    if kind < 2:
        n[rng.integers(C)] = 0  # a class that is never true ...
    if kind == 1:
        absent = np.flatnonzero(n.sum(axis=1) == 0)[0]
        n[:, absent] = 0  # ... and never predicted either
    return (n.astype(np.int64),)


# Two classes confused with each other; a class in neither image; a class that is predicted but never true; one perfect.
SMALL_COUNTS = (
    (np.array([[6, 2], [1, 4]]),),
    (np.array([[6, 2, 0], [0, 4, 0], [0, 0, 0]]),),
    (np.array([[5, 0, 3], [1, 2, 0], [0, 0, 0]]),),
    (np.array([[0, 7], [2, 0]]),),
    (np.diag([3, 0, 1]),),
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
