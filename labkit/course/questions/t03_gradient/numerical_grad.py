"""03_gradient.numerical_grad: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.questions.question import Property, Question, wrong
from labkit.course.questions.t03_gradient import TOY
from labkit.course.questions.t03_gradient.softmax import softmax


def numerical_grad(z, y, h):
    """Estimate the gradient of one pixel's cross-entropy by central differences of step h."""

    def loss(logits):
        return np.logaddexp.reduce(logits) - logits[y]

    return np.array([(loss(z + step) - loss(z - step)) / (2 * h) for step in h * np.eye(len(z))])


def draw_pixel(rng: np.random.Generator) -> tuple[np.ndarray, int, float]:
    """Draw one pixel's logits (C,), its label, and a step so large that differences are not yet the derivative."""
    C = int(rng.integers(4, 7))
    return 1.5 * rng.normal(size=C), int(rng.integers(C)), float(rng.uniform(0.3, 1.2))


QUESTION = Question(
    name="03_gradient.numerical_grad",
    reference=numerical_grad,
    inputs=draw_pixel,
    by_hand=((TOY, 1, 0.5), (TOY, 0, 1.0)),
    atol=1e-5,
    properties=(Property("one number a logit", lambda arguments, out: np.shape(out) == np.shape(arguments[0])),),
    forbidden=("scipy", "torch"),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def pixel_loss(z, y):
    """The loss of one pixel."""
    return np.log(np.exp(z).sum()) - z[y]


@wrong(QUESTION, "Step to both sides: the error falls as h squared.")
def forward_difference(z, y, h):
    return np.array([(pixel_loss(z + step, y) - pixel_loss(z, y)) / h for step in h * np.eye(len(z))])


@wrong(QUESTION, "Step to both sides, not only down.")
def backward_difference(z, y, h):
    return np.array([(pixel_loss(z, y) - pixel_loss(z - step, y)) / h for step in h * np.eye(len(z))])


@wrong(QUESTION, "A check must not use what it checks: only values of the loss, at two points h away.")
def formula_instead_of_differences(z, y, h):
    return softmax(z) - (np.arange(len(z)) == y)


@wrong(QUESTION, "Put the logit back before you move the next one.")
def step_never_taken_back(z, y, h):
    moved, out = z.astype(float), np.empty(len(z))
    for c in range(len(z)):
        moved[c] += h
        up = pixel_loss(moved, y)
        moved[c] -= h
        out[c] = (up - pixel_loss(moved - h * (np.arange(len(z)) == c), y)) / (2 * h)
        moved[c] -= h
    return out
