"""05_class_weights.change_prior: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labcourse.questions.t03_gradient import EPSILONS
from labcourse.questions.t05_class_weights import draw_shares, draw_weights, some_logits
from labgrader.question import Question, wrong


def change_prior(z, w, shares, new_shares):
    """Give the logits for scenes with new shares of the classes, of a network trained with weights on old ones."""
    return z + np.log(new_shares) - np.log(w * shares)


def shifted(z):
    """Logits of which each pixel's largest is 0: those that differ by a constant per pixel say the same."""
    return z - z.max(axis=-1, keepdims=True)


def _network(rng):
    """Logits (H, W, C), weights, and the classes' shares in the scenes of training and of use."""
    H, W, C = int(rng.integers(2, 4)), int(rng.integers(4, 6)), int(rng.integers(6, 8))
    return some_logits(rng, H, W, C, far=0.0), draw_weights(rng, C), draw_shares(rng, C), draw_shares(rng, C)


QUESTION = Question(
    reference=change_prior,
    inputs=_network,
    by_hand=(
        (np.array([0.0, 0.0]), np.array([1.0, 9.0]), np.array([0.9, 0.1]), np.array([0.9, 0.1])),  # weights alone
        (np.array([0.0, 0.0]), np.array([1.0, 1.0]), np.array([0.5, 0.5]), np.array([0.8, 0.2])),  # scenes alone
        (np.array([[0.5, -2.0, 1.0]]), np.array([0.5, 4.0, 1.0]), np.array([0.6, 0.1, 0.3]), np.array([0.2, 0.2, 0.6])),
        # As probabilities these are 1 and 0.
        (np.array([0.0, -800.0]), np.array([1.0, 9.0]), np.array([0.9, 0.1]), np.array([0.5, 0.5])),
    ),
    random_cases=6,
    canonical=shifted,
)

# ---------------------------------------------------------------------------------------------------- wrong answers


@wrong("If a probability is multiplied by a factor, what is added to its logit?")
def ratios_added(z, w, shares, new_shares):
    return z + new_shares / (w * shares)


@wrong("Probabilities are multiplied by the ratio; what does that do to logits?")
def ratios_multiplied(z, w, shares, new_shares):
    return z * new_shares / (w * shares)


@wrong("Logits go in and logits come out.")
def probabilities(z, w, shares, new_shares):
    q = np.exp(z - np.logaddexp.reduce(z, axis=-1, keepdims=True)) * new_shares / (w * shares)
    return q / q.sum(axis=-1, keepdims=True)


@wrong("If a probability is multiplied by a factor, what is added to its logit?")
def shares_added_and_subtracted(z, w, shares, new_shares):
    return z - w - shares + new_shares


@wrong("The softmax of the logits 0 and -800 is 1 and 0, and log 0 is -inf. Do you need probabilities here?")
def by_probabilities(z, w, shares, new_shares):
    p = np.exp(z - np.logaddexp.reduce(z, axis=-1, keepdims=True))
    return np.log(p * new_shares / (w * shares))


@wrong("What is np.exp(1000)? Your answer needs no exponential: what does a factor do to a logarithm?")
def by_exponentials(z, w, shares, new_shares):
    p = np.exp(z) / np.exp(z).sum(axis=-1, keepdims=True)
    return np.log(p * new_shares / (w * shares))


@wrong("Logits may be as low as they like: how low can log(p + epsilon) be, and do you need p?", epsilon=EPSILONS)
def by_probabilities_and(z, w, shares, new_shares, epsilon):
    return np.log(probabilities(z, w, shares, new_shares) + epsilon)
