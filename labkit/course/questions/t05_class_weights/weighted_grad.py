"""05_class_weights.weighted_grad: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.questions.question import Property, Question, wrong
from labkit.course.questions.t05_class_weights import SURE, TOY, draw_pixels


def weighted_grad(z, y, w):
    """Differentiate the weighted, summed cross-entropy by each logit; 0 where the label is 255."""
    e = np.exp(z - z.max(axis=-1, keepdims=True))
    p = e / e.sum(axis=-1, keepdims=True)
    Y = y[..., None] == np.arange(len(w))
    return (Y @ w)[..., None] * (p - Y)


QUESTION = Question(
    name="05_class_weights.weighted_grad",
    reference=weighted_grad,
    inputs=draw_pixels,
    by_hand=(
        (TOY, np.array([1], np.uint8), np.array([1.0, 10.0, 3.0])),
        (SURE, np.array([0, 255], np.uint8), np.array([2.0, 5.0, 0.5])),
        (SURE, np.array([2, 1], np.uint8), np.array([2.0, 5.0, 0.5])),
    ),
    points=3,
    properties=(
        Property(
            "the gradient of each pixel sums to 0",
            lambda arguments, grad: bool(np.allclose(grad.sum(axis=-1), 0.0, atol=1e-3)),
        ),
    ),
    forbidden=("scipy", "torch"),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def parts(z, y):
    """Probabilities, one-hot labels and whether a pixel counts, with an axis for the classes."""
    p = np.exp(z - np.logaddexp.reduce(z, axis=-1, keepdims=True))
    return p, (y[..., None] == np.arange(z.shape[-1])).astype(float), (y != 255)[..., None]


def pixel_weights(y, w):
    """The weight of each pixel's true class, 0 where it is ignored."""
    return np.where(y == 255, 0.0, w[np.where(y == 255, 0, y)])[..., None]


@wrong(QUESTION, "One pixel has one weight, that of its true class, and it scales all of its entries alike.")
def grad_weighted_by_column(z, y, w):
    p, Y, counted = parts(z, y)
    return w * (p - Y) * counted


@wrong(QUESTION, "The weight multiplies the whole loss of a pixel, so it multiplies p as well.")
def grad_weights_in_the_one_hot(z, y, w):
    p, Y, counted = parts(z, y)
    return (p - w * Y) * counted


@wrong(QUESTION, "The probabilities do not know the weights; only the loss does.")
def grad_weights_in_the_softmax(z, y, w):
    p, Y, counted = parts(z, y)
    q = w * p
    return (q / q.sum(axis=-1, keepdims=True) - Y) * counted


@wrong(QUESTION, "That is what PyTorch's mean does; here the loss is the plain weighted sum.")
def grad_over_sum_of_weights(z, y, w):
    return weighted_grad(z, y, w) / max(pixel_weights(y, w).sum(), 1e-9)


@wrong(QUESTION, "A pixel labelled 255 has no class, so it has no weight.")
def grad_of_ignored_too(z, y, w):
    p, Y, _ = parts(z, y)
    return w[np.where(y == 255, 0, y)][..., None] * (p - Y)
