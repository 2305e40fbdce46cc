"""02_crf.energy: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labcourse.questions.t02_crf import COSTS, LABELLED_MODELS, LABELS, PAIRS, WEIGHTS, disagreeing, unary_part
from labgrader.question import Question, wrong


def energy(y, psi, weights):
    """Add up what the labels cost the pixels and what disagreement costs the pairs, each pair once."""
    rows, columns = np.indices(y.shape)
    total = psi[rows, columns, y].sum()
    for w, (down, right) in zip(weights, ((0, 1), (1, 0), (1, 1), (1, -1)), strict=True):
        neighbour = np.roll(y, (-down, -right), axis=(0, 1))  # what comes round the border meets a weight of 0
        total = total + w[y != neighbour].sum()
    return float(total)


# Four pixels, two classes, six pairs: small enough for a pencil.
_PENCIL = (
    np.array([[[0.0, 2.0], [1.5, 0.5]], [[0.2, 1.0], [3.0, 0.1]]]),
    np.array([[[1.0, 0.0], [0.4, 0.0]], [[0.3, 0.8], [0.0, 0.0]], [[0.7, 0.0], [0.0, 0.0]], [[0.0, 0.2], [0.0, 0.0]]]),
)


QUESTION = Question(
    reference=energy,
    kinds={"y": LABELS, "psi": COSTS, "weights": WEIGHTS},
    inputs=LABELLED_MODELS,
    random_cases=10,
    by_hand=(
        (np.array([[0, 1], [0, 1]], np.uint8), *_PENCIL),
        (np.array([[0, 0], [0, 1]], np.uint8), *_PENCIL),
        (np.zeros((2, 2), np.uint8), *_PENCIL),
        (
            np.array([[2, 0, 2]], np.uint8),
            np.arange(9.0).reshape(1, 3, 3),
            np.stack([np.array([[0.5, 0.25, 0.0]]), *np.zeros((3, 1, 3))]),
        ),
        (np.array([[0, 0]], np.uint8), np.array([[[2.0], [-2.5]]]), np.zeros((4, 1, 2))),
        (np.array([[0]], np.uint8), np.array([[[-1.5]]]), np.zeros((4, 1, 1))),
    ),
    edges=2,
    points=3,
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def steps(y):
    """By how much the labels of pairs differ, in the type that labels have."""
    return np.stack([np.abs(y - np.roll(y, (-down, -right), (0, 1))) for down, right in PAIRS])


@wrong("Classes have names, not sizes: a pair (0, 2) disagrees no more than a pair (0, 1).")
def label_steps(y, psi, weights):
    """Labels subtracted as if they were numbers."""
    return unary_part(y, psi) + (weights * steps(y.astype(int))).sum()


@wrong("You charge neighbours that agree. The weight is paid where two labels differ.")
def agreement_charged(y, psi, weights):
    """The weight paid where neighbours agree."""
    return unary_part(y, psi) + (weights * ~disagreeing(y)).sum()


@wrong("Each pair is in weights once, at the pixel that owns it: do you visit it from one end only?")
def pairs_twice(y, psi, weights):
    """Each pair counted from both ends."""
    return unary_part(y, psi) + 2.0 * (weights * disagreeing(y)).sum()


@wrong("A pixel in the middle has eight neighbours: how many kinds of pairs do you add up?")
def four_neighbours(y, psi, weights):
    """The diagonals forgotten."""
    return unary_part(y, psi) + (weights * disagreeing(y))[:2].sum()


@wrong("weights[3] belongs to the neighbour below to the left: which way does your shift go?")
def both_diagonals_to_the_right(y, psi, weights):
    """The second diagonal taken for the first."""
    return unary_part(y, psi) + (weights * disagreeing(y, (*PAIRS[:3], PAIRS[2]))).sum()


@wrong("weights[3] belongs to the neighbour below to the left: in which column do you look for it?")
def both_diagonals_to_the_right_in_loops(y, psi, weights):
    """The same in loops, which leave out the pairs that would end outside."""
    inside = weights.copy()
    inside[3, :, -1] = 0.0
    return both_diagonals_to_the_right(y, psi, inside)


@wrong("A pair's weight is stored at the pixel that owns it, (v, u): do you read it at the neighbour's place?")
def weights_of_the_neighbours(y, psi, weights):
    moved = np.stack([np.roll(w, (-down, -right), (0, 1)) for w, (down, right) in zip(weights, PAIRS, strict=True)])
    return unary_part(y, psi) + (np.where(weights > 0.0, moved, 0.0) * disagreeing(y)).sum()


@wrong("np.roll by +1 brings the left neighbour: with which sign does the right one come?")
def rolled_backwards(y, psi, weights):
    """Each pair compared with the neighbour on the other side."""
    return unary_part(y, psi) + (weights * disagreeing(y, [(-down, -right) for down, right in PAIRS])).sum()


@wrong("weights[3] is stored at the upper pixel of its pair: is that the left one of the two?")
def fourth_kind_at_the_lower_column(y, psi, weights):
    """The last kind of pairs multiplied by the weights one column to the left of theirs."""
    left = np.roll(weights[3], 1, axis=1)
    left[:, 0] = 0.0
    return unary_part(y, psi) + (np.stack([*weights[:3], left]) * disagreeing(y)).sum()


@wrong("A pixel pays for the label that y gives it: do you charge it for its cheapest class?")
def cheapest_classes(y, psi, weights):
    """The pixels' minima in the place of what the labels cost."""
    return psi.min(axis=2).sum() + (weights * disagreeing(y)).sum()


@wrong("A difference of bytes wraps around, 0 - 1 is 255; and all that counts is whether two labels differ.")
def byte_steps(y, psi, weights):
    return unary_part(y, psi) + (weights * steps(y)).sum()


@wrong("The last row and the last column have costs and pairs as well: how far do your loops go?")
def loops_too_short(y, psi, weights):
    return unary_part(y[:-1, :-1], psi[:-1, :-1]) + (weights * disagreeing(y))[:, :-1, :-1].sum()


@wrong("The last row has pairs to the right, the last column pairs downward: how far do your loops go?")
def pairs_of_the_last_row_and_column_skipped(y, psi, weights):
    return unary_part(y, psi) + (weights * disagreeing(y))[:, :-1, :-1].sum()


@wrong("A loop that leaves out the border loses its pairs: ask each neighbour whether it is in the image.")
def pairs_of_the_border_skipped(y, psi, weights):
    return unary_part(y, psi) + (weights * disagreeing(y))[:, :-1, 1:-1].sum()


@wrong("A pair that disagrees pays its own weight: what do you charge each of them?")
def disagreements_counted(y, psi, weights):
    return unary_part(y, psi) + np.count_nonzero((weights > 0.0) & disagreeing(y))


@wrong("A pixel pays for one class, its label's: how many entries of psi[v, u] do you add up?")
def costs_of_all_classes(y, psi, weights):
    return psi.sum() + (weights * disagreeing(y)).sum()


ORDER = "weights holds the kinds right, below, below right, below left: are your steps in this order?"


@wrong(ORDER)
def diagonals_exchanged(y, psi, weights):
    """In loops, which leave out the pairs that would end outside."""
    inside = weights.copy()
    inside[2, :, 0] = inside[3, :, -1] = 0.0
    return unary_part(y, psi) + (inside * disagreeing(y, [PAIRS[d] for d in (0, 1, 3, 2)])).sum()


@wrong(ORDER)
def right_and_below_exchanged(y, psi, weights):
    """In loops, which leave out the pairs that would end outside."""
    inside = weights.copy()
    inside[0, -1] = inside[1, :, -1] = 0.0
    return unary_part(y, psi) + (inside * disagreeing(y, [PAIRS[d] for d in (1, 0, 2, 3)])).sum()
