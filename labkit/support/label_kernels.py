"""A loop over label images that is worth compiling: counting pairs of labels."""

import numpy as np
from numba import njit


@njit(cache=True)
def count_pairs(y_true, y_pred):
    """Count n[true, predicted] over all 256 x 256 pairs of bytes; return n, and whether every label was a byte.

    y_true, y_pred: flat integer arrays of one length. The loop has no branch that a noisy image could make the
    processor mispredict, and so no place for an error: which of the pairs may occur is asked of n, once, at the end.
    """
    n = np.zeros((256, 256), np.int64)
    bits = 0
    for pixel in range(y_true.size):
        i, j = y_true[pixel], y_pred[pixel]
        bits |= i | j  # a negative label or one above 255 leaves a bit beyond the eighth
        n[i & 255, j & 255] += 1
    return n, 0 <= bits <= 255
