"""05_class_weights.adjusted_grad: the question, and wrong answers with the hints that they earn."""

from functools import partial

import numpy as np

from labcourse.kinds import MOST_CLASSES, array, labels, number
from labcourse.questions.t05_class_weights import (
    SHARES,
    SURE,
    TOY,
    draw_shares,
    logits_of_any_size,
    some_labels,
    some_logits,
)
from labgrader.question import Question, Untold, wrong


def adjusted_grad(z, y, shares, tau):
    """Differentiate the summed cross-entropy of the logits z + tau log(shares) by z; 0 where the label is 255."""
    a = z + tau * np.log(shares)
    e = np.exp(a - a.max(axis=-1, keepdims=True))
    p = e / e.sum(axis=-1, keepdims=True)
    Y = y[..., None] == np.arange(len(shares))
    return (p - Y) * (y != 255)[..., None]


def _pixels(rng):
    """Logits (H, W, C), labels (H, W), shares of the classes, tau."""
    H, W, C = int(rng.integers(2, 4)), int(rng.integers(4, 6)), int(rng.integers(6, 8))
    return (
        some_logits(rng, H, W, C),
        some_labels(rng, H, W, C),
        draw_shares(rng, C),
        float(rng.uniform(0.3, 1.7) * rng.choice([1.0, 1000.0])),
    )


def _any_pixels(rng, shape, C):
    """Logits (*shape, C) of any size, labels that are far from sure, shares of the classes, a small tau."""
    y = rng.choice(np.array([*range(C), 255], np.uint8), shape, p=np.array([*[0.8 / C] * C, 0.2]))
    y = np.asarray(y, np.uint8)
    y.flat[0] = C - 1
    return logits_of_any_size(rng, shape, C), y, draw_shares(rng, C), float(rng.uniform(0.0, 3.0))


def _rare_classes(rng, least, most):
    """Logits that a tau of any size leaves a few units apart, where it shifts those of rare classes by far."""
    shares = np.exp(rng.uniform(-12.0, -4.0, 3))
    shares[rng.integers(3)] = 1.0
    shares, tau = shares / shares.sum(), float(rng.uniform(least, most))
    y = rng.integers(0, 3, (2, 6), np.uint8)
    return rng.normal(size=(2, 6, 3)) - tau * np.log(shares), y, shares, tau


SHAPES = ((3, 3, 4), 2), ((40,), MOST_CLASSES), ((), 3)
QUESTION = Question(
    reference=adjusted_grad,
    kinds={
        "z": array("... C", -1e6, 1e6, says=("-1e6 to 1e6", "C from 1 to 255")),
        "y": labels("..."),
        "shares": SHARES,
        "tau": number(0.0, 2000.0, says="0 to 2000"),
    },
    inputs=(
        *(partial(_any_pixels, shape=shape, C=C) for shape, C in SHAPES),
        _pixels,
        partial(_rare_classes, least=0.0, most=3.0),
        partial(_rare_classes, least=1900.0, most=2000.0),
    ),
    by_hand=(
        (np.zeros((1, 2)), np.array([1], np.uint8), np.array([0.9, 0.1]), 1.0),  # the softmax is the shares
        (TOY, np.array([1], np.uint8), np.array([0.7, 0.1, 0.2]), 0.0),  # tau 0: the plain gradient
        (SURE, np.array([0, 2], np.uint8), np.array([0.7, 0.1, 0.2]), 2.0),  # one maximum for both is not enough
        (np.array([3.0]), np.array(0, np.uint8), np.ones(1), 1.0),
        (TOY, np.array([0], np.uint8), np.array([0.4, 0.4, 0.2]), 2000.0),  # all shifts are far below all logits
    ),
    edges=2,
    random_cases=12,
    atol=5e-5,
    points=3,
    forbidden=("scipy", "torch"),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def parts(z, y):
    """Probabilities, one-hot labels and whether a pixel counts, with an axis for the classes."""
    p = np.exp(z - np.logaddexp.reduce(z, axis=-1, keepdims=True))
    return p, (y[..., None] == np.arange(z.shape[-1])).astype(float), (y != 255)[..., None]


@wrong("All logits of a pixel move, each by the share of its class: you move only the true one.")
def true_logit_alone(z, y, shares, tau):
    p, Y, counted = parts(z + tau * np.log(shares) * parts(z, y)[1], y)
    return (p - Y) * counted


@wrong("You multiply the probabilities by powers of the shares: what do they sum to then?")
def not_normalised_again(z, y, shares, tau):
    p, Y, counted = parts(z, y)
    return (p * shares**tau - Y) * counted


@wrong("The labels are not adjusted: only the logits move.")
def one_hot_adjusted(z, y, shares, tau):
    p, Y, counted = parts(z + tau * np.log(shares), y)
    return (p - Y * shares) * counted


@wrong("You divide the gradient by the shares. Here the shares shift the logits, before the softmax.")
def shares_as_weights(z, y, shares, tau):
    p, Y, counted = parts(z, y)
    gradient = (p - Y) * counted / np.take(shares, y, mode="clip")[..., None] ** tau
    if not np.isfinite(gradient).all():  # with a large tau, whose power comes first decides what overflows
        raise Untold
    return gradient


@wrong("You multiply the gradient by the shares. Here the shares shift the logits, before the softmax.")
def gradient_of_each_class_times_its_share(z, y, shares, tau):
    p, Y, counted = parts(z, y)
    return (p - Y) * counted * shares**tau


@wrong(
    "Subtract each pixel's own largest logit: with one maximum for all, a pixel far below it has 0 / 0.",
    ignored=("0", "times 0"),
)
def one_maximum_for_all(z, y, shares, tau, ignored):
    a = z + tau * np.log(shares)
    e = np.exp(a - a.max())
    _, Y, counted = parts(a, y)
    gradient = e / e.sum(axis=-1, keepdims=True) - Y
    return gradient * counted if ignored == "times 0" else np.where(counted, gradient, 0.0)


@wrong(
    "log(tau * shares) is log(shares) plus one number for all classes, which changes nothing. Where does tau belong?"
)
def tau_inside_the_logarithm(z, y, shares, tau):
    p, Y, counted = parts(z + np.log(tau * shares), y)
    return (p - Y) * counted


@wrong("Your gradient is multiplied by a share, like a weight. A share only shifts the logits, before the softmax.")
def times_the_share(z, y, shares, tau):
    return adjusted_grad(z, y, shares, tau) * np.take(shares, y, mode="clip")[..., None]


@wrong("What is np.exp(1000)? What may you subtract from every logit of a pixel?", ignored=("0", "times 0"))
def that_overflows(z, y, shares, tau, ignored):
    a = z + tau * np.log(shares)
    p = np.exp(a) / np.exp(a).sum(axis=-1, keepdims=True)
    _, Y, counted = parts(a, y)
    return (p - Y) * counted if ignored == "times 0" else np.where(counted, p - Y, 0.0)


@wrong("What is the derivative of z + constant by z? The shares do not depend on z.")
def with_a_factor_of_the_shares(z, y, shares, tau):
    return adjusted_grad(z, y, shares, tau) * (1.0 + tau * np.log(shares))
