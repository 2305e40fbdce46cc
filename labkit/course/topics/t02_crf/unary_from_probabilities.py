"""02_crf.unary_from_probabilities: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.checker.question import Question, wrong


def unary_from_probabilities(p, floor):
    """Turn class probabilities into costs; those below `floor` count as `floor`."""
    return -np.log(np.maximum(p, floor))


def _probabilities(rng):
    """Draw probabilities some of which lie below the floor."""
    return rng.dirichlet((0.3, 0.4, 0.5), (4, 5)), float(rng.uniform(0.01, 0.05))


QUESTION = Question(
    reference=unary_from_probabilities,
    inputs=_probabilities,
    by_hand=(
        (np.array([[[0.5, 0.25, 0.25], [1.0, 0.0, 0.0]]]), 0.01),
        (np.array([[[0.7, 0.3]], [[0.05, 0.95]], [[0.1, 0.9]]]), 0.1),
    ),
    points=1,
)

# ---------------------------------------------------------------------------------------------------- wrong answers


@wrong("The softmax has been applied already: these numbers sum to one at each pixel.")
def softmaxed_again(p, floor):
    """Take the probabilities for logits."""
    e = np.exp(p)
    return -np.log(np.maximum(e / e.sum(axis=-1, keepdims=True), floor))


@wrong("Only probabilities below the floor are to change: look at a pixel where one class has probability 1.")
def the_floor_added(p, floor):
    return -np.log(p + floor)


@wrong("What does a class of probability 0 cost, and can neighbours ever overrule that?")
def no_floor(p, floor):
    return -np.log(np.maximum(p, 1e-300))


@wrong("Only small probabilities are lifted: what must a class of probability 1 cost, and what does yours?")
def clipped_at_both_ends(p, floor):
    return -np.log(np.clip(p, floor, 1.0 - floor))


@wrong("Do not scale after the floor: what is not below it stays as it is, and a probability of 1 costs 0.")
def made_to_sum_to_1_again(p, floor):
    lifted = np.maximum(p, floor)
    return -np.log(lifted / lifted.sum(axis=-1, keepdims=True))


@wrong("Yours lifts only zeros: every probability below the floor counts as the floor.")
def zeros_lifted(p, floor):
    return -np.log(np.where(p == 0.0, floor, p))


@wrong("The floor is a probability, not a cost: lift what is too small before you take the logarithm.")
def costs_lifted(p, floor):
    return np.maximum(-np.log(p), floor)


@wrong("A class costs -log p: where does the factor before your logarithm come from?")
def entropies(p, floor):
    return -np.maximum(p, floor) * np.log(np.maximum(p, floor))


@wrong("Nothing is subtracted here: the cheapest class of a pixel costs -log p, which need not be 0.")
def cheapest_made_free(p, floor):
    psi = -np.log(np.maximum(p, floor))
    return psi - psi.min(axis=-1, keepdims=True)


@wrong("np.log undoes np.exp: to which base is your logarithm?")
def logarithm_to_base_10(p, floor):
    return -np.log10(np.maximum(p, floor))


@wrong("np.log undoes np.exp: to which base is your logarithm?")
def logarithm_to_base_2(p, floor):
    return -np.log2(np.maximum(p, floor))


@wrong("The floor is a probability, not a cost: lift what is too small before you take the logarithm.")
def costs_lifted_and_infinite_ones_replaced(p, floor):
    return np.where(p > 0.0, costs_lifted(np.where(p > 0.0, p, 1.0), floor), -np.log(floor))
