"""Questions of topic 01: labels from a renderer's mask and from colours, one-hot tensors, shares, resizing."""

import numpy as np


def labels(rng, C):
    """Draw unequal classes, the last but one absent, in most draws the last one, too, and some ignored pixels."""
    shares = rng.dirichlet(np.full(C, 2.0))
    last = 0 if rng.random() < 0.7 else C - 1
    shares[C - 2] = 0.0
    shares[C - 1] *= last > 0
    y = rng.choice(C, size=(int(rng.integers(6, 9)), int(rng.integers(10, 14))), p=shares / shares.sum())
    y[rng.random(y.shape) < 0.15] = 255
    y[0, 0], y[1, 2] = last, 255
    return y.astype(np.uint8)


def labels_and_classes(rng):
    C = int(rng.choice([4, 5, 7]))
    return labels(rng, C), C
