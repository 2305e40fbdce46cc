"""Questions of topic 01: labels from a renderer's mask and from colours, one-hot tensors, shares, resizing."""

import numpy as np

RETIRED = ("one_hot",)  # no lab asks it any more; those that were released when one did are graded all the same


def labels(rng, C, shape):
    """Draw unequal classes, the last but one absent, in most draws the last one, too, and some ignored pixels."""
    shares = rng.dirichlet(np.full(C, 2.0))
    last = 0 if rng.random() < 0.7 else C - 1
    shares[C - 2] = 0.0
    shares[C - 1] *= last > 0
    y = rng.choice(C, size=shape, p=shares / shares.sum())
    y[rng.random(shape) < rng.uniform(0.1, 0.5)] = 255
    y[0, 0], y[1, 2] = last, 255
    return y.astype(np.uint8)


def images_and_classes(rng):
    """Draw a stack of two or three label images, (N, H, W), and the number of classes."""
    C, N = int(rng.choice([4, 5, 7])), int(rng.integers(2, 4))
    shape = int(rng.integers(8, 10)), int(rng.integers(10, 14))
    return np.stack([labels(rng, C, shape) for _ in range(N)]), C
