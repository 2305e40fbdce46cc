"""05_class_weights.class_weights: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labcourse.kinds import MOST_CLASSES, array, number
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


def _any_power(rng):
    """Pixels of 255 classes, up to those of a large data set, a third of them absent, and a high power."""
    counts = (10.0 ** rng.uniform(0.0, 12.0, MOST_CLASSES)).astype(np.int64)
    counts[rng.random(MOST_CLASSES) < 0.3] = 0
    return counts, float(rng.choice([rng.uniform(2.0, 20.0), rng.integers(11, 20), 20.0]))


def _two_classes(rng):
    """Pixels of two classes in hundreds, and a high power."""
    return rng.integers(100, 1000, 2), float(rng.choice([rng.uniform(10.0, 20.0), rng.integers(10, 20)]))


QUESTION = Question(
    reference=class_weights,
    kinds={
        "counts": array("C", 0, 10**12, dtype="int64", says=("0 to 10 ** 12", "C from 1 to 255")),
        "power": number(0.0, 20.0, says="0 to 20"),
    },
    inputs=(draw_counts, _any_power, _two_classes),
    by_hand=(
        (np.array([900, 100, 0]), 1.0),
        (np.array([900, 100, 25]), 0.5),
        (np.array([1, 255, 0]), 0.5),
        (np.array([3, 40]), 0.0),
        (np.array([7]), 3.0),
        (np.array([10**12, 9 * 10**11, 0]), 20.0),
    ),
    edges=2,
    atol=1e-30,  # weights are small where a power is high; float32 has none much smaller
    random_cases=6,
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


@wrong("A class without pixels gets 1 and is not part of the mean; you count it as one pixel.")
def absent_class_as_one_pixel(counts, power):
    n = np.maximum(counts, 1)
    return n**-power * n.sum() / (n @ n**-power)


@wrong("0 to a negative power is infinite, and infinity times 0 is NaN: what is the weight of a class without pixels?")
def absent_class_infinite(counts, power):
    w = counts ** -float(power)
    return w * counts.sum() / (counts * w).sum()
