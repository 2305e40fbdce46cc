"""The one loop of `labkit.metrics` that is worth compiling: counting pairs of labels, pixel by pixel."""

import numpy as np
from numba import njit


@njit(cache=True)
def count_pairs(y_true, y_pred, num_classes, ignore):
    """Count into n[true, predicted]; return n, and False if a label out of range ended the count early.

    y_true, y_pred: flat integer arrays of one length. Labels are checked in the pass that counts: a check of its own
    would be a second pass.
    """
    n = np.zeros((num_classes, num_classes), np.int64)
    for pixel in range(y_true.size):
        i = y_true[pixel]
        if i == ignore:
            continue
        j = y_pred[pixel]
        if i < 0 or i >= num_classes or j < 0 or j >= num_classes:
            return n, False
        n[i, j] += 1
    return n, True
