"""Questions of topic 03: softmax, cross-entropy, its gradient, the check by differences, and the receptive field."""

import numpy as np


def random_logits(rng: np.random.Generator) -> np.ndarray:
    """Draw logits (H, W, C) of three unequal lengths, a few units apart; one pixel's are near 1000, another's -1000.

    In most draws a class of pixel (1, 3), not the last one, is so sure that the others' probabilities round to 0.
    """
    shape = (int(rng.integers(2, 4)), int(rng.integers(4, 6)), int(rng.integers(6, 8)))
    z = 2.0 * rng.normal(size=shape) + rng.normal()
    z[0, 1] += 1000.0
    z[1, 2] -= 1000.0
    z[1, 3, rng.integers(shape[2] - 1)] += 800.0 * (rng.random() < 0.7)
    return z


def random_possible_classes(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Draw logits (H, W, C), and which classes can occur (C,), at least one and in most draws not all of them.

    The impossible ones have the largest logits of pixel (0, 2), by far.
    """
    z = random_logits(rng)
    possible = rng.random(z.shape[-1]) < 0.6
    possible[rng.integers(z.shape[-1])] = True
    z[0, 2, ~possible] += 2000.0
    return z, possible


def random_pixels(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Draw logits (H, W, C) and labels (H, W), at least one of them ignored; the surest pixel is wrong."""
    z = random_logits(rng)
    y = rng.integers(0, z.shape[-1], z.shape[:-1]).astype(np.uint8)
    y[rng.random(y.shape) < 0.2] = 255
    y[0, 0], y[1, 3] = 255, z.shape[-1] - 1
    y[0, 1], y[1, 2] = rng.integers(0, z.shape[-1], 2)
    return z, y


def random_smoothed_pixels(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, float]:
    """Draw logits and labels, and the share of each pixel that is spread over all classes."""
    return *random_pixels(rng), float(rng.uniform(0.05, 0.4))


def targets(y, C, s):
    """How much of each pixel belongs to each class, (..., C): a share s is spread evenly over all of them."""
    return (1.0 - s) * (y[..., None] == np.arange(C)) + s / C


TOY = np.array([2.0, 1.0, -1.0])


SURE = np.array([[0.0, 3000.0, 3.0], [-1000.0, -1001.0, -1005.0]])  # exp overflows, or rounds everything to 0


EPSILONS = tuple(10.0**-digits for digits in (6, 7, 8, 9, 10, 12, 15, 16))  # what people add to probabilities


TRUE_CLASSES = np.array([0, 255], np.uint8)


def softmax_over_classes(z):
    e = np.exp(z - z.max(axis=-1, keepdims=True))
    return e / e.sum(axis=-1, keepdims=True)


def softmax_over_pixels(z):
    e = np.exp(z - z.max(axis=-2 if z.ndim > 1 else -1, keepdims=True))
    return e / e.sum(axis=-2 if z.ndim > 1 else -1, keepdims=True)
