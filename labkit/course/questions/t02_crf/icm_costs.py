"""02_crf.icm_costs: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.questions.question import Question, wrong
from labkit.course.questions.t02_crf import labelled_model, model


def icm_costs(y, psi, w_right, w_down, v, u):
    """Say what each class would cost pixel (v, u), whose neighbours keep their labels."""
    H, W = y.shape
    classes = np.arange(psi.shape[2])
    costs = psi[v, u]
    if u + 1 < W:
        costs = costs + w_right[v, u] * (classes != y[v, u + 1])
    if u > 0:
        costs = costs + w_right[v, u - 1] * (classes != y[v, u - 1])
    if v + 1 < H:
        costs = costs + w_down[v, u] * (classes != y[v + 1, u])
    if v > 0:
        costs = costs + w_down[v - 1, u] * (classes != y[v - 1, u])
    return costs


def _pixel_of_a_model(rng):
    """Draw a labelled model and one of its pixels."""
    return *labelled_model(rng), int(rng.integers(4)), int(rng.integers(6))


_LABELS = np.array([[0, 1, 1, 2], [0, 2, 1, 0], [2, 2, 0, 1]], np.uint8)


_MODEL = tuple(part.round(1) for part in model(np.random.default_rng(2), 3, 4, 3))


_PIXELS = ((1, 1), (1, 2), (0, 0), (2, 3), (0, 3), (2, 0), (1, 0), (0, 2))  # the inside, all corners, two sides


QUESTION = Question(
    name="02_crf.icm_costs",
    reference=icm_costs,
    inputs=_pixel_of_a_model,
    by_hand=tuple((_LABELS, *_MODEL, v, u) for v, u in _PIXELS),
    points=3,
    forbidden=("labkit",),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def padded_weights(w_right, w_down, v, u):
    """Weights of the pairs to the left, right, top and bottom of a pixel, 0 outside the image."""
    right, down = np.pad(w_right, ((0, 0), (1, 1))), np.pad(w_down, ((1, 1), (0, 0)))
    return right[v, u], right[v, u + 1], down[v, u], down[v + 1, u]


def charged(weights, y, psi, v, u):
    """psi of a pixel and these weights for the neighbours to the left, right, top and bottom."""
    Y = np.pad(np.eye(psi.shape[2])[y], ((1, 1), (1, 1), (0, 0)))
    near = np.stack([Y[v + 1, u], Y[v + 1, u + 2], Y[v, u + 1], Y[v + 2, u + 1]])
    return psi[v, u] + np.array(weights) @ (1.0 - near)


@wrong(
    QUESTION, "A class pays for each neighbour that has another label: which class should four like neighbours favour?"
)
def charged_for_agreeing(y, psi, w_right, w_down, v, u):
    """Every class pays for the neighbours that have it."""
    weights = np.array(padded_weights(w_right, w_down, v, u))
    return psi[v, u] + weights.sum() - (charged(weights, y, psi, v, u) - psi[v, u])


@wrong(QUESTION, "The pair with the left neighbour belongs to that neighbour: at which index of w_right does it stand?")
def own_weights(y, psi, w_right, w_down, v, u):
    """The weights stored at the pixel, also for the pairs behind it."""
    _, right, _, down = padded_weights(w_right, w_down, v, u)
    return charged((right, right, down, down), y, psi, v, u)


@wrong(QUESTION, "In NumPy, index -1 is the last row or column: has a pixel at the border a neighbour on that side?")
def closed_to_a_ring(y, psi, w_right, w_down, v, u):
    """Index -1 is the last row or column, so that the border has neighbours on the other side."""
    H, W = y.shape
    right, down = np.pad(w_right, ((0, 0), (0, 1)), mode="edge"), np.pad(w_down, ((0, 1), (0, 0)), mode="edge")
    weights = (right[v, u - 1], right[v, u], down[v - 1, u], down[v, u])
    near = (y[v, u - 1], y[v, (u + 1) % W], y[v - 1, u], y[(v + 1) % H, u])
    classes = np.arange(psi.shape[2])
    return psi[v, u] + sum(w * (classes != label) for w, label in zip(weights, near, strict=True))


@wrong(QUESTION, "w_right joins neighbours of one row, (v, u) and (v, u + 1): which weight goes with which neighbour?")
def directions_exchanged(y, psi, w_right, w_down, v, u):
    """w_down for neighbours of one row."""
    left, right, up, down = padded_weights(w_right, w_down, v, u)
    return charged((up, down, left, right), y, psi, v, u)


@wrong(QUESTION, "In the energy each pair counts once, but a pixel in the middle belongs to four pairs.")
def ahead_only(y, psi, w_right, w_down, v, u):
    """Only the pairs that the energy's loop visits at this pixel."""
    _, right, _, down = padded_weights(w_right, w_down, v, u)
    return charged((0.0, right, 0.0, down), y, psi, v, u)
