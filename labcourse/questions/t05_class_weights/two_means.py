"""05_class_weights.two_means: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labcourse.questions.t03_gradient import EPSILONS
from labcourse.questions.t05_class_weights import SURE, TOY, draw_pixels
from labgrader.question import Question, wrong


def two_means(z, y, w):
    """Divide the weighted loss by the number of counted pixels, and by the sum of their weights, as PyTorch does."""
    counted = y != 255
    z, y = z[counted].T, y[counted]  # (C, N): a row a class
    log_p = z - np.logaddexp.reduce(z)
    loss = -(w[y] @ log_p[y, np.arange(len(y))])
    return float(loss / len(y)), float(loss / w[y].sum())


QUESTION = Question(
    reference=two_means,
    inputs=draw_pixels,
    by_hand=(
        (TOY, np.array([1], np.uint8), np.array([1.0, 10.0, 3.0])),
        (np.concatenate([SURE, TOY]), np.array([0, 255, 1], np.uint8), np.array([2.0, 5.0, 0.5])),  # not one maximum
    ),
    random_cases=8,
    forbidden=("scipy", "torch"),
    outputs=("by the number of pixels", "by the weights"),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def losses_and_weights(z, y, w):
    """Loss and weight of each counted pixel."""
    counted = y != 255
    z, y = z[counted], y[counted]
    return np.logaddexp.reduce(z, axis=-1) - z[np.arange(len(y)), y], w[y]


def means(loss, weight):
    """Both means of losses that have weights."""
    return float((loss * weight).mean()), float((loss * weight).sum() / weight.sum())


def of_log_probabilities(log_p, y, w):
    """Both means for log-probabilities of all classes."""
    counted = y != 255
    return means(-np.take_along_axis(log_p[counted], y[counted][:, None], -1)[:, 0], w[y[counted]])


@wrong("Pixels labelled 255 add no loss. Are they in the number that you divide by?")
def means_over_all_pixels(z, y, w):
    loss, weight = losses_and_weights(z, y, w)
    return float((loss * weight).sum() / y.size), float((loss * weight).sum() / weight.sum())


@wrong("The sum of weights runs over the pixels: a class with a thousand pixels counts a thousand times.")
def means_over_weights_of_classes(z, y, w):
    loss, weight = losses_and_weights(z, y, w)
    return float((loss * weight).mean()), float((loss * weight).sum() / w.sum())


@wrong("Each pixel's loss is multiplied by its weight before the sum.")
def means_not_weighted(z, y, w):
    loss, weight = losses_and_weights(z, y, w)
    return float(loss.mean()), float(loss.sum() / weight.sum())


@wrong("The first mean also averages weighted losses: the two differ only in what they are divided by.")
def first_mean_not_weighted(z, y, w):
    loss, weight = losses_and_weights(z, y, w)
    return float(loss.mean()), float((loss * weight).sum() / weight.sum())


@wrong("A weight multiplies the loss of a pixel, by its true class: the logits keep their values.")
def logits_weighted(z, y, w):
    loss, weight = losses_and_weights(z * w, y, w)
    return float(loss.mean()), float(loss.sum() / weight.sum())


@wrong("Take off each pixel's own largest logit: with one maximum for all, a pixel far below it has log 0.")
def one_maximum_for_all(z, y, w):
    z = z - z[y != 255].max()
    return of_log_probabilities(z - np.log(np.exp(z).sum(axis=-1, keepdims=True)), y, w)


@wrong("What is np.exp(1000)? What may you subtract from every logit of a pixel?")
def means_that_overflow(z, y, w):
    p = np.exp(z) / np.exp(z).sum(axis=-1, keepdims=True)
    return of_log_probabilities(np.log(p), y, w)


@wrong("The probabilities of one pixel add up to 1: which axis of z holds its classes?")
def normalised_along_the_first_axis(z, y, w):
    return of_log_probabilities(z - np.logaddexp.reduce(z, axis=0, keepdims=True), y, w)


@wrong(
    "A loss has no upper limit. How large can -log(p + epsilon) be, and can you write log p without p?",
    epsilon=EPSILONS,
)
def means_with(z, y, w, epsilon):
    loss, weight = losses_and_weights(z, y, w)
    return means(-np.log(np.exp(-loss) + epsilon), weight)
