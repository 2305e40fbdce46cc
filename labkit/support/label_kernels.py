"""A loop over label images that is worth compiling: counting pairs of labels."""

from labkit.support.compiled import kernel


@kernel
def count_pairs(y_true, y_pred, n):
    """Add to n[true, predicted], int64 (256, 256), over all pairs of bytes; return whether every label was a byte.

    y_true, y_pred: flat integer arrays of one length. The loop has no branch that a noisy image could make the
    processor mispredict, and so no place for an error: which of the pairs may occur is asked of n, once, at the end.
    """
    bits = 0
    for pixel in range(y_true.size):
        i, j = y_true[pixel], y_pred[pixel]
        bits |= i | j  # a negative label or one above 255 leaves a bit beyond the eighth
        n[i & 255, j & 255] += 1
    return 0 <= bits <= 255
