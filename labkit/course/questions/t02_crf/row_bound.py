"""02_crf.row_bound: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.questions.question import Property, Question, wrong
from labkit.course.questions.t02_crf import model


def row_bound(psi, w_right):
    """Add up the least costs of the rows, each labelled as if there were no other row."""
    best = psi[:, 0]
    for u in range(1, psi.shape[1]):
        switch = best.min(axis=1, keepdims=True) + w_right[:, u - 1, None]
        best = psi[:, u] + np.minimum(best, switch)
    return float(best.min(axis=1).sum())


QUESTION = Question(
    name="02_crf.row_bound",
    reference=row_bound,
    inputs=lambda rng: model(rng)[:2],
    by_hand=(
        (np.array([[[0.0, 1.0], [1.0, 0.0], [0.0, 1.0]]]), np.array([[0.4, 0.4]])),
        (np.array([[[0.0, 3.0], [2.0, 0.0], [0.0, 3.0]], [[1.0, 0.0], [0.0, 5.0], [0.5, 0.0]]]), np.full((2, 2), 0.7)),
        (np.array([[[2.0, 1.0, 4.0]], [[0.5, 3.0, -1.0]]]), np.zeros((2, 0))),
    ),
    points=3,
    properties=(
        Property(
            "the bound is at most what the cheapest classes cost, pairs of the rows included",
            lambda given, bound: bool(bound <= energy_of_cheapest_classes(*given) + 1e-9),
        ),
        Property(
            "the bound is at least the sum of the pixels' cheapest costs",
            lambda given, bound: bool(bound >= switching_for_free(*given) - 1e-9),
        ),
    ),
    forbidden=("labkit",),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def row_minima(psi, w_right):
    """The least cost of each row by the class of its last pixel, (H, C)."""
    best = psi[:, 0]
    for u in range(1, psi.shape[1]):
        best = psi[:, u] + np.minimum(best, best.min(axis=1, keepdims=True) + w_right[:, u - 1, None])
    return best


@wrong(QUESTION, "That is what one labelling costs; a bound needs the least over all labellings of a row.")
def energy_of_cheapest_classes(psi, w_right):
    """The energy of one labelling: above the minimum if anything."""
    y = psi.argmin(axis=2)
    return float(psi.min(axis=2).sum() + w_right[y[:, 1:] != y[:, :-1]].sum())


@wrong(QUESTION, "Keep one number for each class of the last pixel, and choose only at the end of the row.")
def never_looking_back(psi, w_right):
    """Walk along each row and take the cheapest class at each pixel."""
    total = 0.0
    for row, weights in zip(psi, w_right, strict=True):
        label = row[0].argmin()
        total += row[0, label]
        for costs, w in zip(row[1:], weights, strict=True):
            now = costs + w * (np.arange(len(costs)) != label)
            label = now.argmin()
            total += now[label]
    return total


def switching_for_free(psi, w_right):
    """The pixels' cheapest costs: a bound, but a weak one."""
    return psi.min(axis=2).sum()


@wrong(QUESTION, "Each row chooses its own last class: first the minimum of each row, then the sum.")
def rows_end_alike(psi, w_right):
    """The minimum taken after the sum over the rows."""
    return row_minima(psi, w_right).sum(axis=0).min()


@wrong(QUESTION, "Going from pixel u - 1 to pixel u, the pair stands at w_right[:, u - 1].")
def next_pairs_weight(psi, w_right):
    """The weight of the pair ahead, charged for the pair behind."""
    return row_minima(psi, np.roll(w_right, -1, axis=1)).min(axis=1).sum()


@wrong(QUESTION, "Does your loop reach the last column?")
def last_pixel_left_out(psi, w_right):
    """A loop that ends one column too early."""
    return row_minima(psi[:, : max(psi.shape[1] - 1, 1)], w_right).min(axis=1).sum()
