"""05_class_weights.undo_weights: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.questions.question import Question, wrong
from labkit.course.questions.t05_class_weights import draw_weights


def undo_weights(z, w, share):
    """Take a share of the weights, 1 for all of them, out of the logits of a network that was trained with them."""
    return z - share * np.log(w)


def shifted(z):
    """Logits of which each pixel's largest is 0: those that differ by a constant a pixel say the same."""
    return z - z.max(axis=-1, keepdims=True)


def draw_logits(rng):
    """Logits (H, W, C), weights, and a share."""
    shape = int(rng.integers(2, 4)), int(rng.integers(4, 6)), int(rng.integers(6, 8))
    return 2.0 * rng.normal(size=shape), draw_weights(rng, shape[-1]), float(rng.uniform(0.2, 0.9))


QUESTION = Question(
    name="05_class_weights.undo_weights",
    reference=undo_weights,
    inputs=draw_logits,
    by_hand=(
        (np.array([0.0, 0.0]), np.array([1.0, 9.0]), 1.0),
        (np.array([[0.5, -2.0, 1.0]]), np.array([0.5, 4.0, 1.0]), 0.5),
    ),
    canonical=shifted,
)

# ---------------------------------------------------------------------------------------------------- wrong answers


@wrong(QUESTION, "A factor of a probability is a summand of its logarithm: which?")
def undo_subtracting_weights(z, w, share):
    return z - share * w


@wrong(QUESTION, "Probabilities are divided by weights; what does that do to logits?")
def undo_dividing(z, w, share):
    return z / w**share


@wrong(QUESTION, "With share 0 nothing may change.")
def undo_wholly(z, w, share):
    return z - np.log(w)


@wrong(QUESTION, "Half of the way is half of the logarithm, that is the square root of the weight.")
def undo_share_inside(z, w, share):
    return z - np.log(share * w + 1.0 - share)


@wrong(QUESTION, "Logits go in, and logits come out.")
def undo_as_probabilities(z, w, share):
    p = np.exp(z - np.logaddexp.reduce(z, axis=-1, keepdims=True)) / w**share
    return p / p.sum(axis=-1, keepdims=True)
