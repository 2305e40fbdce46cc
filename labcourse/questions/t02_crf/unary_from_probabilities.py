"""02_crf.unary_from_probabilities: the question, and wrong answers with the hints that they earn."""

from functools import partial

import numpy as np

from labcourse.kinds import LONG, MOST_CLASSES, number, probabilities
from labgrader.question import Question, holds, wrong


def unary_from_probabilities(p, eps):
    """Turn class probabilities into costs, if the network guesses blindly in a share `eps` of the pixels."""
    return -np.log((1.0 - eps) * p + eps / p.shape[-1])


def _probabilities(rng, shape=(4, 5), C=3, eps=(0.02, 0.2)):
    """Draw probabilities some of which are nearly 0, and one in five of which are of one class; eps: a range."""
    p = rng.dirichlet(np.linspace(0.3, 0.5, C), shape)
    sure = rng.random(shape) < 0.2
    p[sure] = np.eye(C)[rng.integers(0, C, np.count_nonzero(sure))]
    p[-1, -1] = np.eye(C)[-1]
    return p, float(np.exp(rng.uniform(*np.log(eps))))


QUESTION = Question(
    reference=unary_from_probabilities,
    kinds={"p": probabilities("H W C"), "eps": number(1e-12, 0.999, says="1e-12 to 0.999")},
    inputs=(
        _probabilities,
        partial(_probabilities, shape=(1, LONG), C=1),
        partial(_probabilities, shape=(LONG, 1), C=4, eps=(0.96, 0.999)),
        partial(_probabilities, shape=(2, 2), C=MOST_CLASSES, eps=(1e-12, 1.5e-12)),
    ),
    by_hand=(
        (np.array([[[0.5, 0.25, 0.25], [1.0, 0.0, 0.0]]]), 0.03),
        (np.array([[[0.7, 0.3]], [[0.05, 0.95]], [[0.1, 0.9]]]), 0.1),
        (np.array([[[0.5, 0.5, 0.0]]]), 0.03),
    ),
    edges=1,
    points=1,
)


@holds("exp(-psi) sums to 1 over each pixel's classes: the mixture is a distribution, too")
def sums_to_1(p, eps, psi):
    return np.allclose(np.exp(-psi).sum(axis=-1), 1.0, atol=1e-4)


# ---------------------------------------------------------------------------------------------------- wrong answers


def mixed(p, eps):
    return (1.0 - eps) * p + eps / p.shape[-1]


@wrong(
    "That is the lesson's cost, with a floor. Here nothing is clipped: mix p with the blind guess, then take the log.",
    floor=("eps", "eps per class", "eps, then scaled"),
)
def floor_of_the_lesson(p, eps, floor):
    q = np.maximum(p, eps / p.shape[-1] if floor == "eps per class" else eps)
    return -np.log(q / q.sum(axis=-1, keepdims=True) if "scaled" in floor else q)


@wrong("Nothing is clipped here, at either end: mix p with the blind guess, then take the log.", end=("eps", "0"))
def clipped(p, eps, end):
    return -np.log(np.clip(p, eps, 1.0 - eps) if end == "eps" else np.where(p == 0.0, eps / p.shape[-1], p))


@wrong("Scaled back to a sum of 1, your guess has the share C eps / (1 + C eps), not eps. Weigh the two cases instead.")
def added_and_scaled(p, eps):
    q = p + eps
    return -np.log(q / q.sum(axis=-1, keepdims=True))


@wrong("A blind guess may also pick the network's own class: its probability is spread over all C classes.")
def guess_of_the_others(p, eps):
    return -np.log((1.0 - eps) * p + (1.0 - p) * eps / (p.shape[-1] - 1))


@wrong("That is the lesson's -log p: a class of probability 0 costs infinity. Where does the blind guess come in?")
def without_the_guess(p, eps):
    with np.errstate(divide="ignore"):
        return -np.log(p)


@wrong("The softmax has been applied already: these numbers sum to one at each pixel.")
def softmaxed_again(p, eps):
    """Take the probabilities for logits."""
    e = np.exp(p)
    return -np.log(mixed(e / e.sum(axis=-1, keepdims=True), eps))


@wrong("If the network guesses blindly, each class has the same probability: what is it for C classes?")
def guess_of_1(p, eps):
    return -np.log((1.0 - eps) * p + eps)


@wrong("The network's own answer counts only in the remaining cases: what share is that?", per_class=(True, False))
def whole_of_p(p, eps, per_class):
    return -np.log(p + (eps / p.shape[-1] if per_class else eps))


@wrong("You swapped the shares: eps is the small one, that of the blind guess.")
def shares_exchanged(p, eps):
    return -np.log(eps * p + (1.0 - eps) / p.shape[-1])


@wrong("Mix the probabilities, not their costs: a sum of logarithms is not the logarithm of the sum.")
def costs_mixed(p, eps):
    with np.errstate(divide="ignore"):
        return -(1.0 - eps) * np.log(p) + eps * np.log(p.shape[-1])


@wrong("The guess is spread over the classes: which axis of p counts them?", axis=(0, 1))
def another_axis_counted(p, eps, axis):
    return -np.log((1.0 - eps) * p + eps / p.shape[axis])


@wrong("The guess is spread over the classes only: p.size counts the pixels, too.")
def everything_counted(p, eps):
    return -np.log((1.0 - eps) * p + eps / p.size)


@wrong("The course has four classes, these probabilities have C: which axis of p counts them?")
def four_classes(p, eps):
    return -np.log((1.0 - eps) * p + eps / 4)


@wrong("A class costs -log p: where does the factor in front of your logarithm come from?")
def entropies(p, eps):
    return -mixed(p, eps) * np.log(mixed(p, eps))


@wrong("Nothing is subtracted here: the cheapest class of a pixel costs -log of its probability, which need not be 0.")
def cheapest_made_free(p, eps):
    psi = -np.log(mixed(p, eps))
    return psi - psi.min(axis=-1, keepdims=True)


@wrong("np.log undoes np.exp: to which base is your logarithm?", base=(2, 10))
def another_logarithm(p, eps, base):
    return -np.log(mixed(p, eps)) / np.log(base)


@wrong("A likely class must be cheap: what is the sign of the logarithm of a number below 1?")
def sign_forgotten(p, eps):
    return np.log(mixed(p, eps))
