"""03_gradient.cross_entropy: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labcourse.questions.t03_gradient import (
    EPSILONS,
    SMOOTHED_DRAWS,
    SMOOTHED_PIXELS,
    SURE,
    TOY,
    TRUE_CLASSES,
    softmax_over_classes,
    targets,
)
from labgrader.question import Question, wrong


def cross_entropy(z, y, s):
    """Sum -log p over the pixels, a share s of each spread evenly over all classes; labels of 255 add nothing."""
    counted = y != 255
    z, y = z[counted], y[counted]
    log_p = z - np.logaddexp.reduce(z, axis=-1, keepdims=True)
    true = log_p[np.arange(len(y)), y]
    return -float(((1.0 - s) * true + s * log_p.mean(axis=-1)).sum())


QUESTION = Question(
    reference=cross_entropy,
    kinds=SMOOTHED_PIXELS,
    inputs=SMOOTHED_DRAWS,
    by_hand=(
        (TOY[None], np.array([1], np.uint8), 0.0),
        (TOY[None], np.array([1], np.uint8), 0.3),
        (SURE, np.array([0, 2], np.uint8), 0.1),
        (SURE, TRUE_CLASSES, 0.2),
        (SURE, np.array([255, 255], np.uint8), 0.1),
        (SURE, np.array([1, 255], np.uint8), 4e-4),
        (np.array([[4e-4, 0.0]]), np.array([0], np.uint8), 0.0),
        (np.array([[-2.0, 1.0]]), np.array([0], np.uint8), 0.0),
    ),
    edges=3,
    random_cases=12,
    forbidden=("scipy", "torch"),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def log_probabilities(z):
    return z - np.logaddexp.reduce(z, axis=-1, keepdims=True)


def weighed(log_p, y, t):
    """Minus the sum of the counted pixels' log-probabilities (..., C), or of what stands for them, weighted with t."""
    with np.errstate(invalid="ignore"):
        return -float(np.where(t > 0.0, t * log_p, 0.0)[y != 255].sum())


def loss(log_p, y, s):
    return weighed(log_p, y, targets(y, log_p.shape[-1], s))


@wrong("That is the lesson's loss, of the true class alone. Here a share s of each pixel is spread over all classes.")
def without_the_share(z, y, s):
    return cross_entropy(z, y, 0.0)


@wrong("You have only the true class's share, 1 - s: the share s of each pixel costs something, too.")
def true_share_alone(z, y, s):
    return (1.0 - s) * cross_entropy(z, y, 0.0)


@wrong("The share s is spread over all C classes, the true one included: what is the true one's weight?")
def spread_over_the_others(z, y, s):
    C = z.shape[-1]
    t = targets(y, C, 0.0)
    return weighed(log_probabilities(z), y, (1.0 - s) * t + s / (C - 1) * (1.0 - t))


@wrong(
    "The weights of a pixel's classes sum to 1: which one is missing, or too large?", true=("1 - s", "1", "1 + s / C")
)
def weights_that_do_not_sum_to_1(z, y, s, true):
    C = z.shape[-1]
    weight = {"1 - s": 1.0 - s, "1": 1.0, "1 + s / C": 1.0 + s / C}[true]
    t = targets(y, C, 0.0)
    return weighed(log_probabilities(z), y, weight * t + s / C * (1.0 - t))


@wrong("The share s is spread evenly: each of the C classes gets s / C of it, not s.")
def share_for_each_class(z, y, s):
    return weighed(log_probabilities(z), y, (1.0 - s) * targets(y, z.shape[-1], 0.0) + s)


@wrong("You swapped the two shares: 1 - s of a pixel belongs to its true class.")
def shares_exchanged(z, y, s):
    return cross_entropy(z, y, 1.0 - s)


@wrong("You smooth the prediction. It is the target that is smoothed: the logarithm is inside the sum.")
def smoothed_prediction(z, y, s):
    p = np.exp(log_probabilities(z))
    return -float(np.log((targets(y, z.shape[-1], s) * p).sum(axis=-1))[y != 255].sum())


@wrong(
    "A loss has no upper limit. How large can -log(p + epsilon) be, and can you write log p without p?",
    epsilon=EPSILONS,
)
def cross_entropy_with(z, y, s, epsilon):
    return loss(np.log(np.exp(log_probabilities(z)) + epsilon), y, s)


@wrong("z holds logits, and the loss turns them into probabilities itself: do you do so twice?")
def cross_entropy_softmax_twice(z, y, s):
    return cross_entropy(softmax_over_classes(z), y, s)


@wrong("You use logits alone: log p is z - lse(z), and lse depends on the logits of all classes.")
def cross_entropy_without_softmax(z, y, s):
    return loss(z, y, s)


@wrong("You use logits alone: log p is z - lse(z), and lse depends on the logits of all classes.")
def cross_entropy_without_softmax_or_share(z, y, s):
    return loss(z, y, 0.0)


@wrong("You add up 1 - p: the loss of a pixel is made of negative logarithms of p.")
def cross_entropy_of_probabilities(z, y, s):
    return loss(np.exp(log_probabilities(z)) - 1.0, y, s)


@wrong("You weight all classes alike: the true one's weight is 1 - s + s / C, the others' are s / C.")
def cross_entropy_of_all_classes(z, y, s):
    return weighed(log_probabilities(z), y, np.ones(z.shape))


@wrong("The loss is a sum over the pixels. You divide by how many are counted, which fails if none is.")
def cross_entropy_mean_of_counted(z, y, s):
    return cross_entropy(z, y, s) / np.count_nonzero(y != 255)


@wrong("A pixel labelled 255 adds nothing at all: you leave out its one-hot, but its share s is still there.")
def cross_entropy_with_the_share_of_ignored(z, y, s):
    return cross_entropy(z, y, s) - float(s * log_probabilities(z).mean(axis=-1)[y == 255].sum())


@wrong("A pixel labelled 255 adds nothing at all. You leave out its true logit but still add its lse.")
def cross_entropy_with_ignored_lse(z, y, s):
    return cross_entropy(z, y, s) + float(np.logaddexp.reduce(z, axis=-1)[y == 255].sum())


@wrong("A probability that rounds to 0 has no logarithm: log p is z - lse(z), without p.")
def cross_entropy_of_rounded_probabilities(z, y, s):
    with np.errstate(divide="ignore"):
        return loss(np.log(np.exp(log_probabilities(z))), y, s)


@wrong("z[:, y] takes the columns of all pixels' classes for each pixel: you need one entry per row.")
def cross_entropy_of_all_pixels_classes(z, y, s):
    counted = y != 255
    log_p = log_probabilities(z[counted])
    return -float(((1.0 - s) * log_p[:, y[counted]] + s * log_p.mean(axis=-1)).sum())


@wrong("1 - s of a pixel belongs to one class: which one, that of the largest logit or the true one?")
def cross_entropy_of_the_surest_class(z, y, s):
    return cross_entropy(z, np.where(y == 255, 255, z.argmax(axis=-1)), s)


@wrong("z holds logits, some of them negative: what turns them into probabilities?")
def cross_entropy_of_logits(z, y, s):
    return loss(np.log(z), y, s)


@wrong("You give the pixels of 255 to the last class: how much should they add to the loss?")
def cross_entropy_with_ignored_as_last_class(z, y, s):
    return cross_entropy(z, np.minimum(y, z.shape[-1] - 1), s)


@wrong("(1 - p) squared is another loss. How large is it at most, and how large may a cross-entropy be?")
def cross_entropy_as_squared_error(z, y, s):
    return loss(-((1.0 - np.exp(log_probabilities(z))) ** 2), y, s)


@wrong("You ask yes or no for each class on its own. Which function lets the classes share 1 among them?")
def cross_entropy_of_sigmoids(z, y, s):
    return float((np.logaddexp(0.0, z) - targets(y, z.shape[-1], s) * z)[y != 255].sum())


@wrong("What is the base of your logarithm, and of the one in the loss?")
def cross_entropy_in_bits(z, y, s):
    return cross_entropy(z, y, s) / np.log(2.0)


@wrong("You give the pixels of 255 to class 0: how much should they add to the loss?")
def cross_entropy_with_ignored_as_class_0(z, y, s):
    return cross_entropy(z, np.where(y == 255, 0, y), s)


@wrong(
    "A loss has no upper limit. How large can yours become, and can you write log p without p?",
    floor=(np.finfo(float).tiny, 1e-300, 1e-100, 1e-50),
)
def cross_entropy_with_a(z, y, s, floor):
    return loss(np.log(np.maximum(np.exp(log_probabilities(z)), floor)), y, s)
