"""03_gradient.log_sum_exp: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.questions.question import Property, Question, wrong
from labkit.course.questions.t03_gradient import SURE, TOY, random_logits


def log_sum_exp(z):
    """Give log(sum(exp(z))) over the last axis, for logits of any size."""
    largest = z.max(axis=-1)
    return largest + np.log(np.exp(z - largest[..., None]).sum(axis=-1))


QUESTION = Question(
    name="03_gradient.log_sum_exp",
    reference=log_sum_exp,
    inputs=lambda rng: (random_logits(rng),),
    by_hand=((TOY,), (SURE,), (np.array([[7.0]]),)),
    properties=(
        Property(
            "it is at least the largest logit, and at most log C more",
            lambda arguments, out: bool(
                (
                    np.abs(out - arguments[0].max(axis=-1) - 0.5 * np.log(arguments[0].shape[-1]))
                    <= 0.5 * np.log(arguments[0].shape[-1]) + 1e-3
                ).all()
            ),
        ),
    ),
    forbidden=("scipy", "torch"),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


@wrong(QUESTION, "np.exp(1000) is inf: take the largest logit out first.")
def log_sum_exp_that_overflows(z):
    return np.log(np.exp(z).sum(axis=-1))


@wrong(QUESTION, "An epsilon changes the answer where all is small; a shift is exact.")
def log_sum_exp_with_epsilon(z):
    return np.log(np.exp(z).sum(axis=-1) + 1e-8)


@wrong(QUESTION, "One number a pixel: the classes, the last axis, go.")
def log_sum_exp_over_pixels(z):
    axis = -2 if z.ndim > 1 else -1
    largest = z.max(axis=axis, keepdims=True)
    return (largest + np.log(np.exp(z - largest).sum(axis=axis, keepdims=True))).squeeze(axis)


@wrong(QUESTION, "A sum, not a mean: you are off by log C.")
def log_mean_exp(z):
    largest = z.max(axis=-1)
    return largest + np.log(np.exp(z - largest[..., None]).mean(axis=-1))


@wrong(QUESTION, "Each pixel needs its own maximum, or the exponentials of a dark pixel all round to 0.")
def log_sum_exp_of_global_maximum(z):
    return z.max() + np.log(np.exp(z - z.max()).sum(axis=-1))
