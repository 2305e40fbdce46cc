"""02_crf.icm_costs: the question, and wrong answers with the hints that they earn."""

from functools import partial

import numpy as np

from labcourse.kinds import LONG, count
from labcourse.questions.t02_crf import COSTS, LABELLED_MODELS, LABELS, PAIRS, WEIGHTS, labelled_model
from labgrader.question import Question, wrong


def icm_costs(y, psi, weights, v, u):
    """Say what each class would cost pixel (v, u), whose neighbours keep their labels."""
    H, W, C = psi.shape
    costs = psi[v, u]
    for w, (down, right) in zip(weights, ((0, 1), (1, 0), (1, 1), (1, -1)), strict=True):
        for b, a in ((v + down, u + right), (v - down, u - right)):
            if 0 <= b < H and 0 <= a < W:
                pair = w[v, u] if b > v or (b == v and a > u) else w[b, a]
                costs = costs + pair * (np.arange(C) != y[b, a])
    return costs


def _pixel_of(rng, draw):
    """Draw a labelled model and one of its pixels."""
    y, psi, weights = draw(rng)
    return y, psi, weights, int(rng.integers(y.shape[0])), int(rng.integers(y.shape[1]))


_LONG_ROW, _LONG_COLUMN = (
    labelled_model(np.random.default_rng(3), *sides, 2) for sides in ((1, LONG + 1), (LONG + 1, 1))
)
_ONE_PAIR = np.zeros((4, 2, 2))
_ONE_PAIR[1, 0, 1] = 1e6
_LABELS, *_REST = labelled_model(np.random.default_rng(2), 3, 4)


_MODEL = tuple(part.round(1) for part in _REST)


_ROW = np.stack([np.array([[2.0, 0.5, 0.0]]), *np.zeros((3, 1, 3))])
_PIXELS = ((1, 1), (1, 2), (0, 0), (2, 3), (0, 3), (2, 0), (1, 0), (0, 2))  # the inside, all corners, two sides


QUESTION = Question(
    reference=icm_costs,
    kinds={
        "y": LABELS,
        "psi": COSTS,
        "weights": WEIGHTS,
        "v": count(0, LONG - 1, says="row and column of the pixel"),
        "u": count(0, LONG - 1, says="row and column of the pixel"),
    },
    inputs=tuple(partial(_pixel_of, draw=draw) for draw in LABELLED_MODELS),
    random_cases=10,
    by_hand=(
        *((_LABELS, *_MODEL, v, u) for v, u in _PIXELS[:-1]),
        (np.minimum(_LABELS, 1), *_MODEL, *_PIXELS[-1]),  # class 2 has a cost, though no pixel has it
        (np.array([[0]], np.uint8), np.array([[[-2.0, 0.0, 2.0]]]), np.zeros((4, 1, 1)), 0, 0),
        (
            np.array([[0, 1], [1, 0]], np.uint8),
            np.arange(8.0).reshape(2, 2, 2),
            _ONE_PAIR,
            0,
            1,
        ),
        (*_LONG_ROW, 0, LONG - 1),
        (*_LONG_COLUMN, LONG - 1, 0),
        (np.array([[0, 0, 1]], np.uint8), np.array([[[0.0, 9.0], [1.0, 1.0], [9.0, 0.0]]]), _ROW, 0, 1),
    ),
    edges=5,
    points=3,
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def pairs_of(weights, v, u):
    """The pairs of a pixel, as (weight, row, column of the neighbour): those it owns, then those of its neighbours."""
    H, W = weights.shape[1:]
    own = [(w[v, u], v + down, u + right) for w, (down, right) in zip(weights, PAIRS, strict=True)]
    owned = [(d, v - down, u - right) for d, (down, right) in enumerate(PAIRS)]
    owned = [(weights[d, b, a], b, a) for d, b, a in owned if 0 <= b < H and 0 <= a < W]
    return [pair for pair in own if 0 <= pair[1] < H and 0 <= pair[2] < W], owned


def charged(pairs, y, psi, v, u):
    """psi of a pixel and the weights of the pairs whose neighbour has another class."""
    return psi[v, u] + sum((w * (np.arange(psi.shape[2]) != y[b, a]) for w, b, a in pairs), np.zeros(psi.shape[2]))


@wrong("A class pays for each neighbour of another class: if all eight are of class 2, which class is cheapest?")
def charged_for_agreeing(y, psi, weights, v, u):
    """Every class pays for the neighbours that have it."""
    own, owned = pairs_of(weights, v, u)
    return 2 * psi[v, u] + sum(w for w, _, _ in own + owned) - charged(own + owned, y, psi, v, u)


@wrong("The pair with the left neighbour belongs to that neighbour: at which pixel is its weight?")
def own_weights(y, psi, weights, v, u):
    """The weights stored at the pixel, also for the pairs that its neighbours own."""
    H, W = y.shape
    back = [(w[v, u], v - down, u - right) for w, (down, right) in zip(weights, PAIRS, strict=True)]
    back = [(w, b, a) for w, b, a in back if 0 <= b < H and 0 <= a < W]
    return charged(pairs_of(weights, v, u)[0] + back, y, psi, v, u)


@wrong("A pixel in the middle belongs to eight pairs and owns four: where are the weights of the others?")
def ahead_only(y, psi, weights, v, u):
    """Only the pairs that the energy's loop visits at this pixel."""
    return charged(pairs_of(weights, v, u)[0], y, psi, v, u)


@wrong("Neighbours touch at corners, too: how many pairs does a pixel in the middle have?")
def four_neighbours(y, psi, weights, v, u):
    """The diagonals forgotten."""
    straight = np.concatenate([weights[:2], np.zeros_like(weights[2:])])
    own, owned = pairs_of(straight, v, u)
    return charged(own + owned, y, psi, v, u)


@wrong("Which label do you compare with the neighbours': the class c, or y[v, u] for all classes?")
def label_of_now(y, psi, weights, v, u):
    """Every class pays for the disagreements of the label that the pixel has."""
    own, owned = pairs_of(weights, v, u)
    return psi[v, u] + sum(w for w, b, a in own + owned if y[b, a] != y[v, u])


@wrong("Each class is compared with the neighbours' labels: do you compare them with y[v, u], the pixel's own?")
def compared_with_itself(y, psi, weights, v, u):
    own, owned = pairs_of(weights, v, u)
    return psi[v, u] + sum(w for w, _, _ in own + owned) * (np.arange(psi.shape[2]) != y[v, u])


@wrong("Seen from the neighbour above to the right you lie below to the LEFT: which kind of pair is that?")
def upper_diagonals_exchanged(y, psi, weights, v, u):
    """weights[2] taken for the neighbour's own side, not for yours."""
    own = pairs_of(weights, v, u)[0]
    owned = pairs_of(weights[[0, 1, 3, 2]], v, u)[1]
    return charged(own + owned, y, psi, v, u)


@wrong("At the border there is no neighbour: which pixel does a row or column that you clip lead to?")
def clipped_at_the_border(y, psi, weights, v, u):
    (H, W), both = y.shape, []
    for w, (down, right) in zip(weights, PAIRS, strict=True):
        ahead, behind = ((int(np.clip(v + s * down, 0, H - 1)), int(np.clip(u + s * right, 0, W - 1))) for s in (1, -1))
        both += [(w[v, u], *ahead), (w[behind], *behind)]
    return charged(both, y, psi, v, u)


@wrong("A pixel at the border has fewer neighbours and pays for those it has: you charge it for none.")
def no_pairs_at_the_border(y, psi, weights, v, u):
    H, W, _ = psi.shape
    inside = 0 < v < H - 1 and 0 < u < W - 1
    return icm_costs(y, psi, weights, v, u) if inside else psi[v, u].copy()


@wrong("Each class costs its own psi, whatever the neighbours are: where do you use psi?")
def without_psi(y, psi, weights, v, u):
    return icm_costs(y, np.zeros_like(psi), weights, v, u)


@wrong("Each class costs its own psi: you give all of them the one of the pixel's label.")
def psi_of_its_label(y, psi, weights, v, u):
    return without_psi(y, psi, weights, v, u) + psi[v, u, y[v, u]]


@wrong("Rows and columns begin at 0: do you leave out a neighbour in row 0, or in column 0?", of=("owners", "all"))
def neighbours_in_the_first_row_left_out(y, psi, weights, v, u, of):
    own, owned = pairs_of(weights, v, u)
    own = [(w, b, a) for w, b, a in own if a > 0 or of == "owners"]
    return charged(own + [(w, b, a) for w, b, a in owned if b > 0 and a > 0], y, psi, v, u)
