"""05_class_weights.weight_for_recall: the question, and wrong answers with the hints that they earn."""

from bisect import bisect_left
from functools import partial

import numpy as np

from labcourse.kinds import array, number, truth
from labgrader.question import Question, Untold, wrong


def weight_for_recall(q1, y, recall):
    """Find the smallest weight of class 1 with which at least this share of its pixels is found."""
    found_first = np.sort(q1[y])[::-1]
    last = found_first[int(np.ceil(recall * len(found_first))) - 1]
    return float((1.0 - last) / last)


def _pixels(rng):
    """Draw probabilities of two overlapping classes, the second one rare, and a recall between two steps.

    The last pixel that must be found is at q with (1 - q) / q * q < 1 - q, in floats. Class 1 is more or less sure: it
    needs weights below 1, above 1, or of many thousands. Some of its pixels are equally sure.
    """
    n, sure = int(rng.integers(7, 12)), rng.choice([1.0, -12.0])
    y = rng.permutation(np.arange(int(rng.integers(40, 60))) < n)
    must = int(rng.integers(2, n))
    while True:
        q1 = 1.0 / (1.0 + np.exp(-rng.normal(np.where(y, sure, -2.5), 1.0)))
        alike = np.flatnonzero(y)[: int(rng.integers(1, 4))]
        q1[alike] = q1[alike[0]]
        last = np.sort(q1[y])[-must]
        if (1.0 - last) / last * last < 1.0 - last:
            return q1, y, float((must - rng.uniform(0.3, 0.7)) / n)


def _many_pixels(rng, least, most):
    """Draw as many pixels as a picture's, probabilities of any size, and a recall."""
    n, y = MANY // 2, rng.permutation(np.arange(MANY) < MANY // 2)
    q1 = np.clip(1.0 / (1.0 + np.exp(rng.choice([-1.0, 1.0], MANY) * rng.uniform(6.0, 21.0, MANY))), SURE, 1.0 - SURE)
    must = int(n * rng.uniform(least, most))
    return q1, y, float((must - rng.uniform(0.3, 0.7)) / n)


MANY = 1_000
SURE = 1e-9
QUESTION = Question(
    reference=weight_for_recall,
    kinds={
        "q1": array("N", SURE, 1.0 - SURE, says="1e-9 to 1 - 1e-9", digits=9),
        "y": truth("N"),
        "recall": number(0.01, 1.0, says="0.01 to 1"),
    },
    inputs=(
        _pixels,
        _pixels,
        partial(_many_pixels, least=0.012, most=0.016),
        partial(_many_pixels, least=0.3, most=1.0),
    ),
    by_hand=(
        (np.array([0.9, 0.5, 0.2, 0.1]), np.array([True, True, False, True]), 0.4),  # two of three: 0.5, weight 1
        (np.array([0.9, 0.5, 0.2, 0.1]), np.array([True, True, False, True]), 0.3),  # the surest one: weight 1 / 9
        # A little more than two of three, so that all three must be found: 0.1, weight 9.
        (np.array([0.9, 0.5, 0.2, 0.1]), np.array([True, True, False, True]), 0.6667),
        (np.array([1e-6, 0.2]), np.array([True, False]), 1.0),  # weight 999,999
        # Two alike, weight 21/79. In floats 21/79 * 0.79 < 0.21: tried against the limit itself, they are not found.
        (np.array([0.79, 0.79, 0.1, 0.8]), np.array([True, True, True, False]), 0.6),
        (np.array([0.4]), np.array([True]), 0.5),
        (np.array([SURE, *[0.5] * 19]), np.ones(20, bool), 1.0),  # weight 999,999,999
        (np.array([0.1, *[0.5] * 9]), np.ones(10, bool), 0.9001),  # nine of ten are hardly too few
    ),
    edges=3,
    random_cases=12,
    atol=0.0,
    rtol=1e-5,  # weights tried one after the other come near, and not to the answer
    points=3,
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def first_or_untold(found):
    """The first of some numbers; without any, an answer gives what its author thought of."""
    for one in found:
        return float(one)
    raise Untold


def called(weights, q1, y):
    """How many pixels each weight calls class 1, in floats, and how many of these are of it."""
    order = np.argsort(q1)
    q1, hits = q1[order], np.append(np.cumsum(y[order][::-1])[::-1], 0)
    first, last = np.zeros(len(weights), int), np.full(len(weights), len(q1))
    while (wide := first < last).any():
        middle = np.minimum((first + last) // 2, len(q1) - 1)
        is_called = weights * q1[middle] >= 1.0 - q1[middle]  # and so is each surer pixel
        first, last = np.where(wide & ~is_called, middle + 1, first), np.where(wide & is_called, middle, last)
    return len(q1) - first, hits[first]


@wrong("Recall is a share of the pixels that truly are of class 1: which of q1 do you sort?")
def of_all_pixels(q1, y, recall):
    return weight_for_recall(q1, np.ones_like(y), recall)


@wrong("Pixels are found from the surest to the least sure; you start with the least sure one.")
def from_below(q1, y, recall):
    return 1.0 / weight_for_recall(1.0 - q1, y, recall)


@wrong("0.4 of three pixels are 1.2 pixels. Is one found pixel enough for a share of at least 0.4?")
def one_too_few(q1, y, recall):
    found_first = np.sort(q1[y])[::-1]
    last = found_first[max(int(recall * len(found_first)), 1) - 1]
    return float((1.0 - last) / last)


@wrong("You have the probability of the last pixel that must be found. Which w lifts w q1 to 1 - q1 there?")
def the_threshold(q1, y, recall):
    return 1.0 / (1.0 + weight_for_recall(q1, y, recall))


@wrong("Class 1 is predicted where w q1 reaches 1 - q1: what must w q1 reach in your answer?")
def against_one(q1, y, recall):
    return 1.0 + weight_for_recall(q1, y, recall)


@wrong("A quantile may lie between two pixels; what decides is the last pixel that must be found.")
def at_a_quantile(q1, y, recall):
    last = np.quantile(q1[y], 1.0 - recall)
    return float((1.0 - last) / last)


@wrong("You find one pixel more than you promised: sorted from the surest, the k-th has the index k - 1.")
def one_too_many(q1, y, recall):
    found_first = np.sort(q1[y])[::-1]
    last = found_first[min(int(np.ceil(recall * len(found_first))), len(found_first) - 1)]
    return float((1.0 - last) / last)


@wrong("A weight may be below 1: the surest pixels alone may keep the promise.")
def at_least_one(q1, y, recall):
    return max(weight_for_recall(q1, y, recall), 1.0)


@wrong(
    "By rounding, (1 - q) / q * q can be just below 1 - q. Give the limit a little slack, or sort the pixels instead."
)
def tried_without_room(q1, y, recall):
    odds = np.unique((1.0 - q1) / q1)  # a larger one finds no fewer
    return odds[bisect_left(odds, True, key=lambda w: np.mean(w * q1[y] >= 1.0 - q1[y]) >= recall)]


@wrong(
    "For a pixel of q1 = 0.000001 the weight is 999,999: where does your search end?",
    limit=(10.0, 100.0, 1000.0, 10_000.0),
)
def searched_up_to_a(q1, y, recall, limit):
    return min(weight_for_recall(q1, y, recall), limit)


@wrong(
    "For a pixel of q1 = 0.000001 the weight is 999,999: where does your search end?", limit=(100.0, 1000.0, 10_000.0)
)
def searched_between(q1, y, recall, limit):
    return float(np.clip(weight_for_recall(q1, y, recall), 1.0 / limit, limit))


@wrong("Recall is a share of the pixels that truly are of class 1: which of q1 do you sort?")
def as_many_of_all_pixels(q1, y, recall):
    last = np.sort(q1)[::-1][int(np.ceil(recall * y.sum())) - 1]
    return float((1.0 - last) / last)


@wrong("You divide by the pixels that are predicted as class 1, and that is precision: what is recall a share of?")
def weight_for_precision(q1, y, recall):
    odds = np.unique((1.0 - q1) / q1)
    count, hits = called(odds, q1, y)
    return first_or_untold(odds[hits / np.maximum(count, 1) >= recall])


@wrong("You divide by the pixels that are predicted as class 1, and that is precision: what is recall a share of?")
def surest_pixels_with_precision(q1, y, recall):
    surest_first = np.argsort(-q1)
    precision = np.cumsum(y[surest_first]) / np.arange(1, len(y) + 1)
    last = first_or_untold(q1[surest_first][precision >= recall])
    return (1.0 - last) / last


@wrong("0.4 of three pixels are 1.2 pixels: is the nearest whole number, one, at least a share of 0.4?")
def rounded_to_the_nearest(q1, y, recall):
    found = np.sort(q1[y])[::-1]
    last = found[max(round(recall * len(found)), 1) - 1]
    return (1 - last) / last


@wrong("Two pixels with the same probability are two pixels: np.unique counts them once.")
def equal_ones_counted_once(q1, y, recall):
    once = np.unique(q1[y])
    return weight_for_recall(once, np.ones(len(once), bool), recall)


@wrong("You divide by the pixels that are predicted as class 1, and that is precision: what is recall a share of?")
def largest_pixel_with_precision(q1, y, recall):
    """The least sure pixel down to which enough of those that are called class 1 are."""
    order = np.argsort(q1)
    last, hits = q1[order], np.cumsum(y[order][::-1])[::-1]
    first = np.searchsorted(last, last)  # of those that are alike
    last = last[hits[first] / (len(y) - first) >= recall]
    return float((1.0 - last[0]) / last[0]) if len(last) else 1.0


@wrong("Accuracy counts the pixels of class 0, too. Recall is a share of the pixels that truly are of class 1.")
def weight_for_accuracy(q1, y, recall):
    odds = np.sort((1.0 - q1) / q1)
    count, hits = called(odds, q1, y)
    right = hits + np.count_nonzero(~y) - (count - hits)
    enough = odds[right / len(y) >= recall]
    return float(enough[0] if len(enough) else odds[-1])
