"""03_gradient.cross_entropy_grad: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.checker.question import Question, holds, wrong
from labkit.course.topics.t03_gradient import SURE, TOY, random_pixels, softmax_over_pixels
from labkit.course.topics.t03_gradient.softmax import softmax


def cross_entropy_grad(z, y):
    """Differentiate the summed cross-entropy by each logit; 0 where the label is 255."""
    e = np.exp(z - z.max(axis=-1, keepdims=True))
    p = e / e.sum(axis=-1, keepdims=True)
    Y = y[..., None] == np.arange(z.shape[-1])
    return np.where(y[..., None] == 255, 0.0, p - Y)


QUESTION = Question(
    reference=cross_entropy_grad,
    inputs=random_pixels,
    by_hand=(
        (TOY[None], np.array([1], np.uint8)),
        (TOY[None], np.array([0], np.uint8)),
        (SURE, np.array([0, 2], np.uint8)),  # the darker pixel counts: one maximum for both is not enough
    ),
    random_cases=6,
    atol=2e-4,  # logits near 1000 have errors of 3e-5 in single precision
    forbidden=("scipy", "torch"),
)


@holds("the gradient of each pixel sums to 0")
def pixels_sum_to_0(z, y, grad):
    return np.allclose(grad.sum(axis=-1), 0.0, atol=1e-4)


# ---------------------------------------------------------------------------------------------------- wrong answers


def one_hot(z, y):
    """The labels as ones and zeros in the logits' shape."""
    return (y[..., None] == np.arange(z.shape[-1])).astype(float)


@wrong("A pixel that adds no loss has no gradient: look at 255.")
def grad_counts_ignored(z, y):
    return softmax(z) - one_hot(z, y)


@wrong("Normalise over the classes, the last axis.")
def grad_over_pixels(z, y):
    return (softmax_over_pixels(z) - one_hot(z, y)) * (y != 255)[..., None]


@wrong("The one-hot is subtracted from probabilities: what makes probabilities of your logits?")
def grad_of_logits(z, y):
    return (z - one_hot(z, y)) * (y != 255)[..., None]


@wrong("That is the gradient of half the squared error: with the logarithm the factor p in front cancels.")
def grad_of_squared_error(z, y):
    p = softmax(z)
    error = p - one_hot(z, y)
    return p * (error - (p * error).sum(axis=-1, keepdims=True)) * (y != 255)[..., None]


@wrong("That is the slope of -p[y]. What does the logarithm's derivative, 1 / p[y], make of it?")
def grad_without_the_logarithm(z, y):
    Y = one_hot(z, y)
    return (softmax(z) * Y).sum(axis=-1, keepdims=True) * cross_entropy_grad(z, y)


@wrong("Your gradient sums to 1 over a pixel's classes: the one-hot has not been taken off.")
def grad_without_the_one_hot(z, y):
    return softmax(z) * (y != 255)[..., None]


@wrong("The other classes move, too: where c is not the true class the slope is p[c], not 0.")
def grad_of_the_true_class_alone(z, y):
    return (softmax(z) - 1.0) * one_hot(z, y)


def one_hot_of_the_surest(z):
    return (z.argmax(axis=-1)[..., None] == np.arange(z.shape[-1])).astype(float)


@wrong("1 is taken off at one class of each pixel: at the one of the largest logit, or at the true one?")
def grad_at_the_surest_class(z, y):
    return (softmax(z) - one_hot_of_the_surest(z)) * (y != 255)[..., None]


@wrong("All of yours are -1, 0 or 1: does the class of the largest logit enter, or do the probabilities?")
def grad_of_a_perceptron(z, y):
    return (one_hot_of_the_surest(z) - one_hot(z, y)) * (y != 255)[..., None]


@wrong("The gradient has a number for each logit of each pixel: over what did you add up?")
def grad_summed_over_pixels(z, y):
    return cross_entropy_grad(z, y).reshape(-1, z.shape[-1]).sum(axis=0)


@wrong("The gradient has the shape of z: what stands in it at the pixels of 255?")
def grad_of_counted_pixels_alone(z, y):
    return cross_entropy_grad(z, y)[y != 255]


@wrong("What is np.exp(1000)? What may you take off every logit of a pixel?")
def grad_that_overflows(z, y):
    p = np.exp(z) / np.exp(z).sum(axis=-1, keepdims=True)
    return (p - one_hot(z, y)) * (y != 255)[..., None]


@wrong("Each pixel has probabilities of its own: how many numbers does your sum add up?")
def grad_of_a_softmax_over_everything(z, y):
    e = np.exp(z - z.max())
    return (e / e.sum() - one_hot(z, y)) * (y != 255)[..., None]


@wrong("In the lesson a factor p cancels with the 1 / p of the logarithm. Which factor of yours should have cancelled?")
def grad_times_the_slope_of_a_sigmoid(z, y):
    p = softmax(z)
    return cross_entropy_grad(z, y) * p * (1.0 - p)
