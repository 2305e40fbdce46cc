"""Questions of topic 05: weights, decisions at a price, and shares of classes inside and after training.

RETIRED are those that the lab asks no more; labs that were released when it did are checked and graded all the same.
"""

import numpy as np

from labcourse.kinds import array, sum_to_1

RETIRED = ("two_means", "change_prior")


def draw_weights(rng, C):
    """Weights of C classes, from about 0.1 to 20, no two alike."""
    return np.exp(rng.uniform(-2.0, 3.0, C))


def draw_shares(rng, C):
    """Shares of C classes of all pixels, from about 1 % up; they sum to 1."""
    shares = np.exp(rng.uniform(-3.0, 1.0, C))
    return shares / shares.sum()


def some_labels(rng, H, W, C):
    """Labels (H, W) of C classes, some of them 255."""
    y = rng.integers(0, C, (H, W)).astype(np.uint8)
    y[rng.random(y.shape) < 0.2] = 255
    y[0, 0], y[1, 1:4] = 255, (C - 1, 0, C - 1)
    return y


def some_logits(rng, H, W, C, far=1000.0):
    """Logits (H, W, C) a few units apart; those of pixel (1, 1) are near `far`, those of (1, 2) near -far.

    In most draws a class of pixel (1, 3), not the last one, is so sure that the others' probabilities round to 0.
    """
    z = 2.0 * rng.normal(size=(H, W, C))
    z[1, 1:3] += [[far], [-far]]
    z[1, 3, rng.integers(C - 1)] += 800.0 * (rng.random() < 0.7)
    return z


def draw_pixels(rng):
    """Logits (H, W, C), labels (H, W), some of them ignored, and weights."""
    H, W, C = int(rng.integers(2, 4)), int(rng.integers(4, 6)), int(rng.integers(6, 8))
    return some_logits(rng, H, W, C), some_labels(rng, H, W, C), draw_weights(rng, C)


def logits_of_any_size(rng, shape, C):
    """Logits (*shape, C), those of a pixel a few units apart and together of any size; some classes are far off."""
    z = 3.0 * rng.normal(size=(*shape, C)) + rng.choice([0.0, 1e4, -9.6e5, 9.6e5], (*shape, 1))
    return z - rng.choice([0.0, 0.0, 0.0, 2e4], z.shape)


def above_0(rng, values):
    """Shares, none of them 0, of numbers that are not negative."""
    return sum_to_1(rng, values + 1e-3)


SHARES = array("C", 0.0, 1.0, form=above_0, says=("above 0", "sum 1"))
TOY = np.array([[2.0, 1.0, -1.0]])


SURE = np.array([[0.0, 1000.0, 3.0], [-1000.0, -1001.0, -1005.0]])  # exp overflows, or rounds everything to 0
