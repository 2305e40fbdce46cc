"""03_gradient.softmax: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.checker.question import Question, wrong
from labkit.course.topics.t03_gradient import SURE, TOY, random_logits, softmax_over_pixels


def softmax(z):
    """Turn logits (..., C) into probabilities over the last axis, for logits of any size."""
    e = np.exp(z - z.max(axis=-1, keepdims=True))
    return e / e.sum(axis=-1, keepdims=True)


QUESTION = Question(
    reference=softmax,
    inputs=lambda rng: (random_logits(rng),),
    by_hand=((TOY,), (SURE,)),
    random_cases=6,
    points=1,
    forbidden=("scipy", "torch"),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


@wrong("Each pixel has probabilities of its own: sum over one axis.")
def softmax_over_everything(z):
    e = np.exp(z - z.max())
    return e / e.sum()


@wrong("What is np.exp(1000)? What may you take off every logit of a pixel?")
def softmax_that_overflows(z):
    return np.exp(z) / np.exp(z).sum(axis=-1, keepdims=True)


@wrong("You take off the largest logit of the whole image. What is left of a pixel whose logits are all much smaller?")
def softmax_of_global_maximum(z):
    e = np.exp(z - z.max())
    return e / e.sum(axis=-1, keepdims=True)


@wrong("Clipping changes differences of logits, and so the answer. Subtracting one number from all does not.")
def softmax_clipped(z):
    return softmax(np.clip(z, -50.0, 50.0))


@wrong("Classes exclude each other: do your probabilities sum to one?")
def sigmoid_of_each(z):
    return 1.0 / (1.0 + np.exp(-z))


@wrong("Logits may be negative, probabilities may not.")
def logits_divided_by_their_sum(z):
    return z / z.sum(axis=-1, keepdims=True)


@wrong("The numbers of one pixel must sum to one: over which axis do yours?")
def wrong_axis(z):
    return softmax_over_pixels(z)


@wrong("Which number, taken off, makes the largest exponent 0? With a smaller one np.exp still overflows.")
def smallest_logit_taken_off(z):
    e = np.exp(z - z.min(axis=-1, keepdims=True))
    return e / e.sum(axis=-1, keepdims=True)


@wrong("Dividing by the largest logit changes the differences of logits; taking it off does not.")
def divided_by_the_largest(z):
    e = np.exp(z / z.max(axis=-1, keepdims=True))
    return e / e.sum(axis=-1, keepdims=True)


@wrong("Clipping changes differences of logits, and so the answer. Subtracting one number from all does not.")
def large_logits_clipped(z):
    e = np.exp(np.minimum(z, 700.0))
    return e / e.sum(axis=-1, keepdims=True)


@wrong("You take the largest logit off above the line: what is taken off in the sum below it?")
def sum_of_unshifted_logits(z):
    return np.exp(z - z.max(axis=-1, keepdims=True)) / np.exp(z).sum(axis=-1, keepdims=True)


@wrong("Those are logarithms of probabilities, all negative: what undoes a logarithm?")
def log_softmax(z):
    return z - np.logaddexp.reduce(z, axis=-1, keepdims=True)


@wrong("Dividing by the largest logit changes the differences of logits; taking it off does not.")
def divided_by_the_largest_size(z):
    largest = np.abs(z).max(axis=-1, keepdims=True)
    return softmax(z / np.where(largest == 0.0, 1.0, largest))
