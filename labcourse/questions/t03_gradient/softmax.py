"""03_gradient.softmax: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labcourse.questions.t03_gradient import SURE, TOY, random_possible_classes, softmax_over_classes
from labgrader.question import Question, wrong


def softmax(z, possible):
    """Turn logits (..., C) into probabilities over the last axis; a class that is not possible has 0."""
    z = np.where(possible, z, -np.inf)
    e = np.exp(z - z.max(axis=-1, keepdims=True))
    return e / e.sum(axis=-1, keepdims=True)


EVERY, TWO = np.array([True, True, True]), np.array([True, False, True])

QUESTION = Question(
    reference=softmax,
    inputs=random_possible_classes,
    by_hand=((TOY, EVERY), (TOY, TWO), (SURE, EVERY), (SURE, TWO)),
    random_cases=6,
    rtol=5e-4,  # logits near 3000 have errors of 1.2e-4 in single precision
    atol=1e-30,  # what is not possible has 0, not a small number
    points=1,
    forbidden=("scipy", "torch"),
)

# ---------------------------------------------------------------------------------------------------- wrong answers

SHIFT = "What is np.exp(1000)? What may you subtract from every logit of a pixel?"
CLIPPED = "Clipping changes differences of logits, and so the answer. Subtracting one number from all does not."
DIVIDED = "Dividing by the largest logit changes the differences of logits; subtracting it does not."


def shifted(z, possible, m, axis=-1):
    """Softmax over the possible classes, with m taken off the logits."""
    e = np.where(possible, np.exp(z - m), 0.0)
    return e / e.sum(axis=axis, keepdims=True)


def largest(z, possible, **how):
    return np.where(possible, z, -np.inf).max(**how)


@wrong("You set a class that is not possible to 0. Do the others still sum to 1?")
def impossible_classes_set_to_0(z, possible):
    return softmax_over_classes(z) * possible


@wrong("A logit of 0 is no probability of 0: what is np.exp(0)? Which logit makes np.exp 0?")
def impossible_logits_set_to_0(z, possible):
    return softmax_over_classes(z * possible)


@wrong(
    "You give impossible classes a logit of your own. What if the possible logits are smaller still, or as large?",
    logit=(-1.0, -10.0, -50.0, -100.0, -500.0, -999.0, -1000.0),
)
def impossible_logits_set_to(z, possible, logit):
    return softmax_over_classes(np.where(possible, z, logit))


@wrong("C classes have C probabilities: what is the entry of a class that is not possible?")
def impossible_classes_left_out(z, possible):
    return softmax_over_classes(z[..., possible])


@wrong("You read `possible` the wrong way round: True is for the classes that can occur.")
def possible_exchanged(z, possible):
    return softmax(z, ~possible if not possible.all() else possible)


@wrong("An impossible class's logit may be the largest by far. What are the exponentials then, its own and the others?")
def shifted_by_an_impossible_logit(z, possible):
    return shifted(z, possible, z.max(axis=-1, keepdims=True))


@wrong("An impossible class's logit may be the largest by far. What are the exponentials then, its own and the others?")
def rescaled_after_the_softmax(z, possible):
    p = softmax_over_classes(z) * possible
    total = p.sum(axis=-1, keepdims=True)
    return np.divide(p, total, out=np.zeros_like(p), where=total > 0.0)


@wrong("The sum goes over the possible classes. What is the numerator for the others?")
def impossible_classes_keep_their_part(z, possible):
    e = np.exp(z - z.max(axis=-1, keepdims=True))
    return e / e.sum(axis=-1, keepdims=True, where=possible)


@wrong("What one class's probability loses goes to the others in proportion, not in equal parts.")
def the_rest_in_equal_parts(z, possible):
    p = softmax_over_classes(z) * possible
    return p + possible * (1.0 - p.sum(axis=-1, keepdims=True)) / possible.sum()


@wrong("Each pixel has probabilities of its own: sum over one axis.")
def softmax_over_everything(z, possible):
    e = np.where(possible, np.exp(z - largest(z, possible)), 0.0)
    return e / e.sum()


@wrong(SHIFT)
def softmax_that_overflows(z, possible):
    return shifted(z, possible, 0.0)


@wrong("You subtract the whole image's largest logit. What is left of a pixel whose logits are all much smaller?")
def softmax_of_global_maximum(z, possible):
    return shifted(z, possible, largest(z, possible))


@wrong(CLIPPED)
def softmax_clipped(z, possible):
    return softmax(np.clip(z, -50.0, 50.0), possible)


@wrong("Classes exclude each other: do your probabilities sum to one?")
def sigmoid_of_each(z, possible):
    return possible / (1.0 + np.exp(-z))


@wrong("Logits may be negative, probabilities may not.")
def logits_divided_by_their_sum(z, possible):
    z = z * possible
    return z / z.sum(axis=-1, keepdims=True)


@wrong("The numbers of one pixel must sum to one: over which axis do yours?", axis=(0, 1))
def wrong_axis(z, possible, axis):
    axis = min(axis, z.ndim - 1)
    return shifted(z, possible, largest(z, possible, axis=axis, keepdims=True), axis)


@wrong(DIVIDED)
def divided_by_the_largest(z, possible):
    e = np.where(possible, np.exp(z / largest(z, possible, axis=-1, keepdims=True)), 0.0)
    return e / e.sum(axis=-1, keepdims=True)


@wrong(CLIPPED)
def large_logits_clipped(z, possible):
    return shifted(np.minimum(z, 700.0), possible, 0.0)


@wrong("You subtract the largest logit in the numerator: what do you subtract in the sum below it?")
def sum_of_unshifted_logits(z, possible):
    e = np.where(possible, np.exp(z - largest(z, possible, axis=-1, keepdims=True)), 0.0)
    return e / np.where(possible, np.exp(z), 0.0).sum(axis=-1, keepdims=True)


@wrong("Those are logarithms of probabilities, all negative: what undoes a logarithm?")
def log_softmax(z, possible):
    z = np.where(possible, z, -np.inf)
    return z - np.logaddexp.reduce(z, axis=-1, keepdims=True)


@wrong(DIVIDED)
def divided_by_the_largest_size(z, possible):
    size = np.abs(z).max(axis=-1, keepdims=True)
    return softmax(z / np.where(size == 0.0, 1.0, size), possible)
