"""05_class_weights.weighted_optimum: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.questions.question import Property, Question, wrong
from labkit.course.questions.t05_class_weights import draw_weights


def weighted_optimum(p, w):
    """Give the probabilities that minimise the expected weighted loss where the true ones are p."""
    return w * p / (p @ w)[..., None]


def draw_distributions(rng):
    """Probabilities (H, W, C) and weights."""
    shape = int(rng.integers(2, 4)), int(rng.integers(4, 6)), int(rng.integers(6, 8))
    p = rng.uniform(0.05, 1.0, shape)
    return p / p.sum(axis=-1, keepdims=True), draw_weights(rng, shape[-1])


QUESTION = Question(
    name="05_class_weights.weighted_optimum",
    reference=weighted_optimum,
    inputs=draw_distributions,
    by_hand=(
        (np.array([0.9, 0.1]), np.array([1.0, 9.0])),
        (np.array([[0.5, 0.3, 0.2], [0.7, 0.0, 0.3]]), np.array([1.0, 2.0, 5.0])),
    ),
    properties=(
        Property(
            "the probabilities of a pixel, over the last axis, sum to 1",
            lambda arguments, q: bool(np.allclose(q.sum(axis=-1), 1.0, atol=1e-4)),
        ),
    ),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


@wrong(QUESTION, "Set the weighted gradient to zero: w is in it.")
def optimum_without_weights(p, w):
    return p.copy()


@wrong(QUESTION, "What must the probabilities of a pixel sum to?")
def optimum_not_normalised(p, w):
    return w * p


@wrong(QUESTION, "Normalise over the classes, the last axis.")
def optimum_over_pixels(p, w):
    q = w * p
    return q / q.sum(axis=0, keepdims=True)


@wrong(QUESTION, "Divide by what makes each pixel's own sum one; it differs from pixel to pixel.")
def optimum_of_normalised_weights(p, w):
    return p * w / w.sum()


@wrong(QUESTION, "The weights enter as they are: solve for q again.")
def optimum_of_square_roots(p, w):
    return weighted_optimum(p, np.sqrt(w))


@wrong(QUESTION, "These are probabilities already: no exponential is left.")
def optimum_by_softmax(p, w):
    e = np.exp(w * p)
    return e / e.sum(axis=-1, keepdims=True)
