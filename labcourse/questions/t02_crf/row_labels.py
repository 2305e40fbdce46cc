"""02_crf.row_labels: the question, and wrong answers with the hints that they earn."""

from functools import partial

import numpy as np

from labcourse.kinds import LONG, MOST_CLASSES, array
from labgrader.question import Question, holds, wrong


def row_labels(psi, w):
    """Find the cheapest labels of one row: walk along it, remember where each minimum came from, and walk back."""
    n, C = psi.shape
    best, origins = psi[0], []
    for u in range(1, n):
        switch = best.min() + w[u - 1]
        origins.append(np.where(best <= switch, np.arange(C), best.argmin()))
        best = psi[u] + np.minimum(best, switch)
    labels = [best.argmin()]
    for origin in reversed(origins):
        labels.append(origin[labels[-1]])
    return np.array(labels[::-1], dtype=np.uint8)


def cost(psi, w, labels):
    """What a row's labels cost."""
    labels = np.asarray(labels).astype(int)
    return psi[np.arange(len(psi)), labels].sum() + w[labels[1:] != labels[:-1]].sum()


def _row(rng, n=7, C=5, size=1.0):
    """Draw a row whose ends hold to their neighbours, so that neither end decides by itself; size: of a common cost."""
    psi, w = rng.normal(1.0, 1.0, (n, C)), rng.uniform(0.1, 1.6, n - 1)
    psi[[0, -1]] *= 0.3
    w[[0, -1]] = rng.uniform(1.0, 2.0, 2)
    return np.clip(size * psi, -1e6, 1e6), np.clip(size * w, 0.0, 1e6)


def _many_classes(rng):
    """Draw a row of as many classes as there may be; in its middle the last one is by far the cheapest."""
    psi, w = _row(rng, C=MOST_CLASSES)
    psi[3, -1] = psi.min() - 5.0
    return psi, w


def _row_that_its_end_decides(rng):
    """Draw a row of two classes in which each pixel but the last prefers one, by so little that all take the other."""
    psi = np.zeros((LONG, 2))
    a = int(rng.integers(2))
    psi[:, 1 - a], psi[-1, a] = rng.uniform(0.005, 0.015, LONG), rng.uniform(9.0, 11.0)
    return psi, rng.uniform(5.0, 6.0, LONG - 1)


# A row as long as the lab's, with four classes: nobody tries 4 ** 110 labellings.
_RNG = np.random.default_rng(3)
_PSI_OF_A_ROW, _WEIGHTS_OF_A_ROW = _RNG.normal(1.0, 1.0, (110, 4)), _RNG.uniform(0.1, 1.6, 109)


QUESTION = Question(
    reference=row_labels,
    kinds={
        "psi": array("n C", -1e6, 1e6, lengths={"n": (1, LONG)}, says=("1 to 300", "-1e6 to 1e6")),
        "w": array("n-1", 0.0, 1e6, lengths={"n-1": (0, LONG - 1)}, says="0 to 1e6"),
    },
    inputs=(
        _row,
        _row,
        _row_that_its_end_decides,
        _many_classes,
        partial(_row, size=5e5),
        partial(_row, size=1e-3),
    ),
    by_hand=(
        (np.array([[0.0, 1.0], [1.0, 0.0], [0.0, 1.0]]), np.array([0.4, 0.4])),
        (np.array([[0.0, 1.0], [1.0, 0.0], [0.0, 1.0]]), np.array([0.6, 0.6])),
        (np.array([[0.0, 3.0, 0.5], [1.0, 3.0, 0.9], [3.0, 2.5, 0.0]]), np.array([0.8, 0.3])),  # from class 0 to 2
        (np.array([[2.0, 1.0, 4.0]]), np.zeros(0)),
        (np.array([[0.4, 0.5], [2.0, 0.0], [0.4, 0.5]]), np.array([0.5, 0.5])),  # both ends alone would choose 0
        (_PSI_OF_A_ROW, _WEIGHTS_OF_A_ROW),
        (np.array([[3.0], [4.0]]), np.array([0.5])),  # one class
        (np.array([[-1.0, 0.0]]), np.zeros(0)),
        (np.array([[0.0, -1.0]]), np.zeros(0)),
        (np.array([[0.0, 1.0], [1.0, 0.0]]), np.array([0.0])),
        (np.array([[0.0, 1.0], [5.0, 0.1]]), np.array([10.0])),
        # Large and small costs, large and small weights.
        (np.array([[-9.2e5, -9.8e5]]), np.zeros(0)),
        (np.array([[4e-4, 2e-4]]), np.zeros(0)),
        (np.array([[0.0, 9.9e5], [9.5e5, 0.0]]), np.array([9.7e5])),
        (np.array([[0.0, 9e-4, 9e-4], [3e-4, 0.0, 9e-4], [5e-4, 9e-4, 0.0]]), np.array([4e-4, 2e-4])),
    ),
    edges=9,
    random_cases=12,
    points=3,
)


@holds("the labels cost no more than each pixel's own cheapest class does")
def no_dearer_than_pixel_by_pixel(psi, w, labels):
    return cost(psi, w, labels) <= cost(psi, w, psi.argmin(axis=1)) + 1e-9


# ---------------------------------------------------------------------------------------------------- wrong answers


def walk(psi, w):
    """The least cost of the row up to each pixel, by its class, (n, C)."""
    best = [psi[0]]
    for costs, weight in zip(psi[1:], w, strict=True):
        best.append(costs + np.minimum(best[-1], best[-1].min() + weight))
    return np.array(best)


def walk_with_origins(psi, w, late=0):
    """The walk, and the class that each came from, (n, C); late: 1 if the cheapest class is asked for a pixel late."""
    best, came = walk(psi, w), np.zeros(psi.shape, int)
    for u in range(1, len(psi)):
        stays = best[u - 1] <= best[u - 1].min() + w[u - 1]
        came[u] = np.where(stays, np.arange(psi.shape[1]), best[u - 1 + late].argmin())
    return best, came


def traced(came, last):
    """The way back from the last label, through one row of `came` after the other."""
    labels = [last]
    for origin in came[::-1]:
        labels.append(origin[labels[-1]])
    return np.array(labels[::-1])


@wrong("That is each pixel's own choice: do you charge w for changing the class, and nothing for keeping it?")
def pixel_by_pixel(psi, w):
    """The weights forgotten, or paid by all classes alike."""
    return psi.argmin(axis=1)


@wrong("The class cheapest so far need not lie on the cheapest path: trace the path back. Keeping a class costs no w.")
def never_walked_back(psi, w):
    """The minimum at each pixel of the forward walk."""
    return walk(psi, w).argmin(axis=1)


@wrong("Choosing pixel by pixel from the left cannot know what comes later: keep a cost for every class.")
def greedy(psi, w):
    """From the left, each pixel the class that is cheapest given the label before it."""
    labels = [psi[0].argmin()]
    for costs, weight in zip(psi[1:], w, strict=True):
        labels.append((costs + weight * (np.arange(len(costs)) != labels[-1])).argmin())
    return np.array(labels)


@wrong("Going from pixel u - 1 to pixel u, the pair stands at w[u - 1].")
def next_pairs_weight(psi, w):
    """The weight of the pair ahead, charged for the pair behind."""
    return row_labels(psi, np.roll(w, -1))


@wrong("Each pair has its own weight: do you charge the first pair's weight for all pairs?")
def first_weight_for_all(psi, w):
    return row_labels(psi, np.repeat(w[:1], len(w)))


@wrong("Classes have names, not sizes: from class 0 to class 2 costs w once, as from class 0 to class 1.")
def class_steps(psi, w):
    """Labels subtracted as if they were numbers."""
    best, came, classes = psi[0], [], np.arange(psi.shape[1])
    for costs, weight in zip(psi[1:], w, strict=True):
        ways = best + weight * np.abs(classes[:, None] - classes)
        came.append(ways.argmin(axis=1))
        best = costs + ways.min(axis=1)
    return traced(came, best.argmin())


@wrong("On the way back from pixel u: do you read the row of `came` that belongs to u, or to u - 1?")
def traced_one_pixel_off(psi, w):
    """The way back read one pixel too early."""
    best, came = walk_with_origins(psi, w)
    return traced(came[:-1], best[-1].argmin())


@wrong("Decide where a pixel comes from while `best` ends at pixel u - 1: do you add psi[u] before that?")
def asked_too_late(psi, w):
    best, came = walk_with_origins(psi, w, late=1)
    return traced(came[1:], best[-1].argmin())


@wrong("The last label is the cheapest by `best`, which holds the whole row, not by the last pixel's psi.")
def last_pixel_on_its_own(psi, w):
    return traced(walk_with_origins(psi, w)[1][1:], psi[-1].argmin())


@wrong("You stop tracing back one step too early: what came[1] says about the first pixel is not used.")
def first_pixel_not_reached(psi, w):
    labels = row_labels(psi, w).copy()
    labels[0] *= len(labels) == 1
    return labels


@wrong("The first pixel's own cheapest class need not be on the best path: its label is traced back as well.")
def first_pixel_on_its_own(psi, w):
    return np.array([psi[0].argmin(), *row_labels(psi, w)[1:]])


@wrong("That is what the best labels cost. Which labels are they?")
def least_cost(psi, w):
    return walk(psi, w)[-1].min()


@wrong("Each of your steps changes one pixel. It stops where two pixels would have to change together.")
def pixel_after_pixel_again(psi, w):
    """ICM on the row."""
    y = psi.argmin(axis=1)
    for _ in range(20):
        for u in range(len(psi)):
            near = [(w[i], y[j]) for i, j in ((u - 1, u - 1), (u, u + 1)) if 0 <= j < len(y)]
            y[u] = (psi[u] + sum(weight * (np.arange(psi.shape[1]) != c) for weight, c in near)).argmin()
    return y


@wrong("Both passes end at pixel u, and both include psi[u]: how often is it in their sum?")
def own_cost_twice(psi, w):
    return (walk(psi, w) + walk(psi[::-1], w[::-1])[::-1]).argmin(axis=1)
