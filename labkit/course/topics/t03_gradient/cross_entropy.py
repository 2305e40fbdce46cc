"""03_gradient.cross_entropy: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.checker.question import Question, wrong
from labkit.course.topics.t03_gradient import EPSILONS, SURE, TOY, TRUE_CLASSES, random_pixels
from labkit.course.topics.t03_gradient.softmax import softmax


def cross_entropy(z, y):
    """Sum -log p(y) over the pixels; those labelled 255 add nothing."""
    counted = y != 255
    z, y = z[counted].T, y[counted]  # (C, N): a row a class
    log_p = z - np.logaddexp.reduce(z)
    return -float(log_p[y, np.arange(len(y))].sum())


QUESTION = Question(
    reference=cross_entropy,
    inputs=random_pixels,
    by_hand=(
        (TOY[None], np.array([1], np.uint8)),
        (SURE, np.array([0, 2], np.uint8)),
        (SURE, TRUE_CLASSES),
        (SURE, np.array([255, 255], np.uint8)),
    ),
    random_cases=6,
    forbidden=("scipy", "torch"),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def true_log_probabilities(z, y):
    """Log-probabilities of the true classes of the counted pixels, a list."""
    counted = y != 255
    z, y = z[counted], y[counted]
    log_p = z - np.logaddexp.reduce(z, axis=-1, keepdims=True)
    return log_p[np.arange(len(y)), y]


@wrong(
    "A loss has no upper end. How large can -log(p + epsilon) be, and can you write log p without p?", epsilon=EPSILONS
)
def cross_entropy_with(z, y, epsilon):
    return float(-np.log(np.exp(true_log_probabilities(z, y)) + epsilon).sum())


@wrong("z holds logits, and the loss makes probabilities of them itself: does yours do so twice?")
def cross_entropy_softmax_twice(z, y):
    return cross_entropy(softmax(z), y)


@wrong("Yours uses the true class's logit alone: log p depends on the logits of all classes.")
def cross_entropy_without_softmax(z, y):
    counted = y != 255
    return -float(np.take_along_axis(z[counted], y[counted][:, None], -1).sum())


@wrong("Yours adds up 1 - p: the loss of a pixel is minus the logarithm of p.")
def cross_entropy_of_probabilities(z, y):
    return float((1.0 - np.exp(true_log_probabilities(z, y))).sum())


@wrong("Only the true class's log-probability is summed.")
def cross_entropy_of_all_classes(z, y):
    return sum(cross_entropy(z, np.where(y == 255, 255, c)) for c in range(z.shape[-1]))


@wrong("The loss is a sum over the pixels. Yours is divided by how many are counted, and fails if none is.")
def cross_entropy_mean_of_counted(z, y):
    return -float(np.mean(true_log_probabilities(z, y)))


@wrong("A pixel labelled 255 adds nothing at all. Yours leaves out its true logit and still adds its lse.")
def cross_entropy_with_ignored_lse(z, y):
    true = np.where(y[..., None] == np.arange(z.shape[-1]), z, 0.0)
    return float(np.logaddexp.reduce(z, axis=-1).sum() - true.sum())


@wrong("A probability that rounds to 0 has no logarithm: log p is z - lse(z), without p.")
def cross_entropy_of_rounded_probabilities(z, y):
    return -float(np.log(np.exp(true_log_probabilities(z, y))).sum())


@wrong("The maximum that you take out of the exponents comes back: lse is m plus the logarithm.")
def cross_entropy_without_the_maximum(z, y):
    counted = y != 255
    return cross_entropy(z, y) - float(z[counted].max(axis=-1, initial=-np.inf).sum())


@wrong("z[:, y] takes the columns of all pixels' classes for each pixel: one entry per row is asked for.")
def cross_entropy_of_all_pixels_classes(z, y):
    counted = y != 255
    z, y = z[counted], y[counted]
    return float((np.logaddexp.reduce(z, axis=-1) - z[:, y]).sum())


@wrong("The loss is lse minus one logit: which one, the largest or the true class's?")
def cross_entropy_of_the_surest_class(z, y):
    return cross_entropy(z, np.where(y == 255, 255, z.argmax(axis=-1)))


@wrong("z holds logits, some of them negative: what makes probabilities of them?")
def cross_entropy_of_logits(z, y):
    counted = y != 255
    return -float(np.log(np.take_along_axis(z[counted], y[counted][:, None], -1)).sum())


@wrong("You give the pixels of 255 to the last class: how much should they add to the loss?")
def cross_entropy_with_ignored_as_last_class(z, y):
    return cross_entropy(z, np.minimum(y, z.shape[-1] - 1))


@wrong("(1 - p) squared is another loss. How large is it at most, and how large may a cross-entropy be?")
def cross_entropy_as_squared_error(z, y):
    return float(((1.0 - np.exp(true_log_probabilities(z, y))) ** 2).sum())


@wrong("Yours asks yes or no for each class on its own. Which function lets the classes share 1 among them?")
def cross_entropy_of_sigmoids(z, y):
    counted = y != 255
    signs = np.where(y[counted][:, None] == np.arange(z.shape[-1]), -1.0, 1.0)
    return float(np.logaddexp(0.0, signs * z[counted]).sum())


@wrong("To which base is your logarithm, and to which is that of the loss?")
def cross_entropy_in_bits(z, y):
    return cross_entropy(z, y) / np.log(2.0)


@wrong("You give the pixels of 255 to class 0: how much should they add to the loss?")
def cross_entropy_with_ignored_as_class_0(z, y):
    return cross_entropy(z, np.where(y == 255, 0, y))


@wrong(
    "A loss has no upper end. How large is it at most in yours, and can you write log p without p?",
    floor=(np.finfo(float).tiny, 1e-300, 1e-100, 1e-50),
)
def cross_entropy_with_a(z, y, floor):
    return float(-np.log(np.maximum(np.exp(true_log_probabilities(z, y)), floor)).sum())
