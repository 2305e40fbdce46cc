"""02_crf.energy: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.questions.question import Question, wrong
from labkit.course.questions.t02_crf import labelled_model


def energy(y, psi, w_right, w_down):
    """Add up what the labels cost the pixels and what disagreement costs the pairs, each pair once."""
    rows, columns = np.indices(y.shape)
    unary = psi[rows, columns, y].sum()
    right = w_right[y[:, 1:] != y[:, :-1]].sum()
    down = w_down[y[1:] != y[:-1]].sum()
    return float(unary + right + down)


# Four pixels, two classes, four pairs: small enough for a pencil.
_PENCIL = (
    np.array([[[0.0, 2.0], [1.5, 0.5]], [[0.2, 1.0], [3.0, 0.1]]]),
    np.array([[1.0], [0.4]]),
    np.array([[0.3, 0.8]]),
)


QUESTION = Question(
    name="02_crf.energy",
    reference=energy,
    inputs=labelled_model,
    by_hand=(
        (np.array([[0, 1], [0, 1]], np.uint8), *_PENCIL),
        (np.array([[0, 0], [0, 1]], np.uint8), *_PENCIL),
        (np.zeros((2, 2), np.uint8), *_PENCIL),
        (np.array([[2, 0, 2]], np.uint8), np.arange(9.0).reshape(1, 3, 3), np.array([[0.5, 0.25]]), np.zeros((0, 3))),
    ),
    points=2,
    forbidden=("labkit",),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def unary_part(y, psi):
    """What the pixels cost on their own."""
    return np.take_along_axis(psi, y[..., None].astype(int), axis=2).sum()


def pair_part(y, w_right, w_down):
    """What disagreement costs."""
    return w_right[y[:, 1:] != y[:, :-1]].sum() + w_down[y[1:] != y[:-1]].sum()


@wrong(QUESTION, "What does agreement cost in the Potts model? Label everything alike: only unary costs may remain.")
def spins(y, psi, w_right, w_down):
    """Agreement is rewarded by w, disagreement costs w, as for spins of +1 and -1."""
    right, down = np.where(y[:, 1:] == y[:, :-1], -1, 1), np.where(y[1:] == y[:-1], -1, 1)
    return unary_part(y, psi) + (w_right * right).sum() + (w_down * down).sum()


@wrong(QUESTION, "Classes have names, not sizes: a pair (0, 2) disagrees no more than a pair (0, 1).")
def label_steps(y, psi, w_right, w_down):
    """Labels subtracted as if they were numbers."""
    right, down = np.abs(np.diff(y.astype(float), axis=1)), np.abs(np.diff(y.astype(float), axis=0))
    return unary_part(y, psi) + (w_right * right).sum() + (w_down * down).sum()


@wrong(QUESTION, "The weight is paid where neighbours differ: what does an image of one label cost?")
def agreement_charged(y, psi, w_right, w_down):
    """The weight paid where neighbours agree."""
    return unary_part(y, psi) + w_right.sum() + w_down.sum() - pair_part(y, w_right, w_down)


@wrong(QUESTION, "An H by W grid has H (W - 1) + W (H - 1) pairs: does yours visit each of them once?")
def pairs_twice(y, psi, w_right, w_down):
    """Each pair counted from both ends."""
    return unary_part(y, psi) + 2.0 * pair_part(y, w_right, w_down)
