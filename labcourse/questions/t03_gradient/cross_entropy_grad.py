"""03_gradient.cross_entropy_grad: the question, and wrong answers with the hints that they earn."""

from dataclasses import replace

import numpy as np

from labcourse.questions.t03_gradient import (
    SMOOTHED_DRAWS,
    SMOOTHED_PIXELS,
    SURE,
    TOY,
    softmax_over_classes,
    softmax_over_pixels,
    targets,
)
from labgrader.question import Question, holds, wrong


def cross_entropy_grad(z, y, s):
    """Differentiate the cross-entropy, a share s spread over all classes, by each logit; 0 where the label is 255."""
    e = np.exp(z - z.max(axis=-1, keepdims=True))
    p = e / e.sum(axis=-1, keepdims=True)
    t = (1.0 - s) * (y[..., None] == np.arange(z.shape[-1])) + s / z.shape[-1]
    return np.where(y[..., None] == 255, 0.0, p - t)


# Pixels as many as the lab trains with: who moves one logit after the other is not done in time.
_V, _U = np.mgrid[:120, :160]
_AT_SIZE = (np.stack([_U % 7, _V % 5, (_U + _V) % 3, _U % 2], axis=-1) / 2, (_U // 9 % 4).astype(np.uint8), 0.05)


QUESTION = Question(
    reference=cross_entropy_grad,
    kinds=SMOOTHED_PIXELS | {"s": replace(SMOOTHED_PIXELS["s"], free=("float16",))},  # as fine as the tolerance below
    inputs=SMOOTHED_DRAWS,
    by_hand=(
        (TOY[None], np.array([1], np.uint8), 0.0),
        (TOY[None], np.array([0], np.uint8), 0.3),
        (SURE, np.array([0, 2], np.uint8), 0.1),  # the darker pixel counts: one maximum for both is not enough
        _AT_SIZE,
        (np.zeros((1, 4)), np.array([2], np.uint8), 0.0),
        (np.zeros((1, 4)), np.array([2], np.uint8), 0.4),
        (np.array([[-2.0, 1.0]]), np.array([0], np.uint8), 0.0),
        (np.array([[4.9e-4, -4.9e-4]]), np.array([0], np.uint8), 0.99),
    ),
    edges=4,
    random_cases=12,
    atol=2e-4,  # logits near 1000 have errors of 3e-5 in single precision
    forbidden=("scipy", "torch"),
)


@holds("the gradient of each pixel sums to 0")
def pixels_sum_to_0(z, y, s, grad):
    return np.allclose(grad.sum(axis=-1), 0.0, atol=1e-4)


# ---------------------------------------------------------------------------------------------------- wrong answers


def target(z, y, s):
    return targets(y, z.shape[-1], s)


@wrong(
    "That is the lesson's p minus a one-hot. Here a share s is spread over all classes: what is each class's target?"
)
def grad_of_the_lesson(z, y, s):
    return cross_entropy_grad(z, y, 0.0)


@wrong("That is the lesson's p minus a one-hot. Here a share s is spread over all classes, and 255 has no gradient.")
def grad_of_the_lesson_of_all_pixels(z, y, s):
    return softmax_over_classes(z) - target(z, y, 0.0)


@wrong("(1 - s)(p - Y) is the slope of the true class's share. The share s is a loss, too: what is its slope?")
def grad_of_the_true_share_alone(z, y, s):
    return (1.0 - s) * cross_entropy_grad(z, y, 0.0)


@wrong("The share s is spread over all C classes, the true one included: what does its target become?")
def grad_spread_over_the_others(z, y, s):
    one_hot = target(z, y, 0.0)
    t = (1.0 - s) * one_hot + s / (z.shape[-1] - 1) * (1.0 - one_hot)
    return (softmax_over_classes(z) - t) * (y != 255)[..., None]


@wrong(
    "The targets of a pixel sum to 1, like its probabilities: which one is missing, or too large?", true=("1-s", "1")
)
def grad_of_targets_that_do_not_sum_to_1(z, y, s, true):
    one_hot, C = target(z, y, 0.0), z.shape[-1]
    t = (1.0 - s if true == "1-s" else 1.0) * one_hot + s / C * (1.0 - one_hot)
    return (softmax_over_classes(z) - t) * (y != 255)[..., None]


@wrong("The targets of a pixel sum to 1, like its probabilities: do your 1 - s and s do so?", part=("s", "none"))
def grad_of_a_share_that_is_not_divided(z, y, s, part):
    t = (1.0 - s) * target(z, y, 0.0) + (s if part == "s" else 0.0)
    return (softmax_over_classes(z) - t) * (y != 255)[..., None]


@wrong("You swapped the shares: 1 - s of a pixel belongs to its true class.")
def grad_with_shares_exchanged(z, y, s):
    return cross_entropy_grad(z, y, 1.0 - s)


@wrong("p keeps its factor 1: it comes from lse, which the targets multiply by their sum, 1.")
def grad_with_less_of_p(z, y, s):
    return (((1.0 - s) * softmax_over_classes(z)) - target(z, y, s)) * (y != 255)[..., None]


@wrong("A pixel of 255 has no gradient in any class: its one-hot is zeros, but what about its share s?")
def grad_leaves_the_share_of_ignored(z, y, s):
    return np.where((y == 255)[..., None], -s / z.shape[-1], cross_entropy_grad(z, y, s))


@wrong("A pixel that adds no loss has no gradient: look at 255.")
def grad_counts_ignored(z, y, s):
    return softmax_over_classes(z) - target(z, y, s)


@wrong("Normalise over the classes, the last axis.")
def grad_over_pixels(z, y, s):
    return (softmax_over_pixels(z) - target(z, y, s)) * (y != 255)[..., None]


@wrong("The target is subtracted from probabilities: what turns your logits into probabilities?")
def grad_of_logits(z, y, s):
    return (z - target(z, y, s)) * (y != 255)[..., None]


@wrong("That is the gradient of half the squared error: with the logarithm the factor p in front cancels.")
def grad_of_squared_error(z, y, s):
    p = softmax_over_classes(z)
    error = p - target(z, y, s)
    return p * (error - (p * error).sum(axis=-1, keepdims=True)) * (y != 255)[..., None]


@wrong("That is the slope of -p[y]. What does the logarithm's derivative, 1 / p[y], make of it?")
def grad_without_the_logarithm(z, y, s):
    Y = target(z, y, s)
    return (softmax_over_classes(z) * Y).sum(axis=-1, keepdims=True) * cross_entropy_grad(z, y, s)


@wrong("The other classes move, too: where c is not the true class the slope is p[c] - s / C, not 0.")
def grad_of_the_true_class_alone(z, y, s):
    return (softmax_over_classes(z) - target(z, y, s)) * target(z, y, 0.0)


def targets_of_the_surest(z, s):
    return targets(z.argmax(axis=-1), z.shape[-1], s)


@wrong("1 - s is subtracted at one class of each pixel: the one with the largest logit, or the true one?")
def grad_at_the_surest_class(z, y, s):
    return (softmax_over_classes(z) - targets_of_the_surest(z, s)) * (y != 255)[..., None]


@wrong("You compare the target with the class of the largest logit: where do you use the probabilities themselves?")
def grad_of_a_perceptron(z, y, s):
    return (targets_of_the_surest(z, s) - target(z, y, s)) * (y != 255)[..., None]


@wrong("The gradient has a number for each logit of each pixel: what did you sum over?")
def grad_summed_over_pixels(z, y, s):
    return cross_entropy_grad(z, y, s).reshape(-1, z.shape[-1]).sum(axis=0)


@wrong("The gradient has the shape of z: what is it at the pixels of 255?")
def grad_of_counted_pixels_alone(z, y, s):
    return cross_entropy_grad(z, y, s)[y != 255]


@wrong("What is np.exp(1000)? What may you subtract from every logit of a pixel?", ignored=("chosen", "multiplied"))
def grad_that_overflows(z, y, s, ignored):
    """Where a label is 255, 0 is chosen, or what came is multiplied by 0, and NaN stays NaN."""
    counted = (y != 255)[..., None]
    grad = np.exp(z) / np.exp(z).sum(axis=-1, keepdims=True) - target(z, y, s)
    return np.where(counted, grad, 0.0) if ignored == "chosen" else grad * counted


@wrong("In the lesson a factor p cancels with the 1 / p of the logarithm. Which factor of yours should have cancelled?")
def grad_times_the_slope_of_a_sigmoid(z, y, s):
    p = softmax_over_classes(z)
    return cross_entropy_grad(z, y, s) * p * (1.0 - p)
