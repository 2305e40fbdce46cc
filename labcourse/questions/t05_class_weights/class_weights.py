"""05_class_weights.class_weights: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labgrader.question import Question, holds, wrong


def class_weights(counts, power):
    """Weigh classes by counts ** -power, with mean weight 1 over all pixels; a class without pixels gets 1."""
    present = counts > 0
    w = np.ones(len(counts))
    w[present] = counts[present] ** -power
    w[present] *= counts.sum() / (counts @ w)
    return w


def draw_counts(rng):
    """Pixels of four to six classes, one of them absent, and a power."""
    counts = (10.0 ** rng.uniform(1.0, 5.0, rng.integers(4, 7))).astype(np.int64)
    counts[rng.integers(len(counts))] = 0
    return counts, float(rng.uniform(0.2, 1.2))


QUESTION = Question(
    reference=class_weights,
    inputs=draw_counts,
    by_hand=(
        (np.array([900, 100, 0]), 1.0),
        (np.array([900, 100, 25]), 0.5),
        (np.array([1, 7, 0]), 0.5),
        (np.array([3, 40]), 0.0),
    ),
    forbidden=("sklearn",),
)


@holds("the mean weight over all pixels is 1")
def mean_is_1(counts, power, w):
    return np.isclose(counts @ w, counts.sum(), rtol=1e-3)


# ---------------------------------------------------------------------------------------------------- wrong answers


@wrong("What is the mean weight over the pixels? It should be 1.")
def weights_not_scaled(counts, power):
    return np.maximum(counts, 1) ** -power


@wrong("Your weights sum to 1. It is their mean over all pixels that should be 1.")
def weights_summing_to_one(counts, power):
    w = weights_not_scaled(counts, power)
    w[counts > 0] /= w[counts > 0].sum()
    return w


@wrong("A frequent class has more pixels: take the mean over pixels, not over classes.")
def weights_of_mean_one_over_classes(counts, power):
    w = weights_not_scaled(counts, power)
    w[counts > 0] /= w[counts > 0].mean()
    return w


@wrong("A class without pixels gets 1 and has no part in the mean; you count it as one pixel.")
def absent_class_as_one_pixel(counts, power):
    n = np.maximum(counts, 1)
    return n**-power * n.sum() / (n @ n**-power)
