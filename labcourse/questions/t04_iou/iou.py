"""04_iou.iou: the question, and wrong answers with the hints that they earn."""

from dataclasses import replace

import numpy as np

from labcourse.questions.t04_iou import COUNTS, SMALL_COUNTS, counts, counts_of_many_classes, divide, iou_of, parts
from labgrader.question import Question, holds, wrong


def iou(n):
    """Score each class with TP / (TP + FP + FN); NaN where a class is neither true nor predicted."""
    correct = np.diagonal(n)
    with np.errstate(invalid="ignore"):
        return correct / (n.sum(axis=0) + n.sum(axis=1) - correct)


QUESTION = Question(
    reference=iou,
    kinds={"n": replace(COUNTS, free=("-|x|", "transposed"))},
    inputs=(counts, counts_of_many_classes, counts),
    by_hand=SMALL_COUNTS,
    edges=2,
    random_cases=6,
    forbidden=("sklearn", "torchmetrics"),
)


@holds("each score is from 0 to 1, or NaN")
def scores_are_shares(n, out):
    return not ((np.asarray(out) < 0.0) | (np.asarray(out) > 1.0)).any()


# ---------------------------------------------------------------------------------------------------- wrong answers


@wrong("The overlap is in the row sum and in the column sum: how often is it in your union?")
def overlap_twice_in_the_union(n):
    correct, predicted, true = parts(n)
    return divide(correct, predicted + true)


@wrong("That is Dice (F1), another score: an IoU has the overlap once, not twice.", absent=(np.nan, 0.0))
def dice(n, absent):
    correct, predicted, true = parts(n)
    return divide(2.0 * correct, predicted + true, absent)


@wrong("A pixel of class 1 that is predicted as 2 is in neither set of class 0: is it in your union of class 0?")
def all_but_the_other_hits(n):
    return divide(np.diagonal(n), n.sum() - np.trace(n) + np.diagonal(n))


@wrong("FP is the column without the diagonal cell, FN the row without it: how often is it in your union?")
def overlap_three_times_in_the_union(n):
    correct, predicted, true = parts(n)
    return divide(correct, predicted + true + correct)


@wrong("C classes have C scores: what is the entry of a class that is neither true nor predicted?")
def absent_classes_left_out(n):
    scores = iou_of(n)
    return scores[~np.isnan(scores)]


@wrong("A class that is neither true nor predicted has no score: what would a score of 0 say about it?")
def absent_classes_score_0(n):
    return iou_of(n, empty=0.0)


@wrong("That is recall, the share of a class's true pixels that are found: where are the false positives?")
def recall(n):
    correct, _, true = parts(n)
    return divide(correct, true)


@wrong("That is precision, the share of a class's predictions that are right: where are the false negatives?")
def precision(n):
    correct, predicted, _ = parts(n)
    return divide(correct, predicted)


@wrong("A class that is predicted and never true has a union: how large is its overlap?")
def nan_where_never_true(n):
    return np.where(n.sum(axis=1) > 0, iou_of(n), np.nan)


@wrong("A class that is true and never predicted has a union: how large is its overlap?")
def nan_where_never_predicted(n):
    return np.where(n.sum(axis=0) > 0, iou_of(n), np.nan)


@wrong("You count pixels that are neither labelled nor predicted as class c as right: are they in its union?")
def accuracy_by_class(n):
    correct, predicted, true = parts(n)
    return 1.0 - (predicted + true - 2.0 * correct) / n.sum()


@wrong("You add 1 to both to avoid 0 / 0: what should a class that occurs nowhere score?")
def smoothed(n):
    correct, predicted, true = parts(n)
    return (correct + 1.0) / (predicted + true - correct + 1.0)


@wrong(
    "You divide by all pixels: most of them are neither truly class c nor called c. Which ones are in its union?",
    absent=(0.0, np.nan),
)
def share_of_all_pixels(n, absent):
    correct, predicted, true = parts(n)
    return np.where(predicted + true > 0, correct / n.sum(), absent)


@wrong("The larger of two sets is less than their union: what of the smaller one lies outside of it?")
def the_larger_set(n):
    correct, predicted, true = parts(n)
    return divide(correct, np.maximum(predicted, true))


@wrong("The smaller of two sets is less than their union: what of the larger one lies outside of it?")
def the_smaller_set(n):
    correct, predicted, true = parts(n)
    return divide(correct, np.minimum(predicted, true))


@wrong("FP and FN are both in the union, once each: which of them do you add twice?", twice=("FP", "FN"))
def one_of_the_errors_twice(n, twice):
    correct, predicted, true = parts(n)
    return divide(correct, 2 * (predicted if twice == "FP" else true) - correct)


@wrong(
    "That is made of precision and recall, and it is no IoU: what is in the union of two sets?", of=("sum", "product")
)
def mean_or_product_of_precision_and_recall(n, of):
    p, r = precision(n), recall(n)
    return p * r if of == "product" else (p + r) / 2
