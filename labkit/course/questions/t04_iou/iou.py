"""04_iou.iou: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.questions.question import Property, Question, wrong
from labkit.course.questions.t04_iou import SMALL_COUNTS, counts, divide, iou_of, parts, precision_of, recall_of


def iou(n):
    """Score each class with TP / (TP + FP + FN); NaN where a class is neither true nor predicted."""
    correct = np.diagonal(n)
    with np.errstate(invalid="ignore"):
        return correct / (n.sum(axis=0) + n.sum(axis=1) - correct)


QUESTION = Question(
    name="04_iou.iou",
    reference=iou,
    inputs=counts,
    by_hand=SMALL_COUNTS,
    random_cases=6,
    points=2,
    properties=(
        Property(
            "no IoU is below 0 or above 1",
            lambda arguments, scores: bool(np.all(np.isnan(scores) | ((scores >= 0.0) & (scores <= 1.0)))),
        ),
    ),
    forbidden=("sklearn", "torchmetrics"),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


@wrong(QUESTION, "That is Dice (F1), another score: the overlap stands once in an IoU, not twice.")
def dice(n):
    correct, predicted, true = parts(n)
    return divide(2.0 * correct, predicted + true)


@wrong(QUESTION, "A perfect mask scores one half: how often is the overlap in row sum plus column sum?")
def union_counts_the_overlap_twice(n):
    correct, predicted, true = parts(n)
    return divide(correct, predicted + true)


@wrong(QUESTION, "Each class is divided by its own union, not by the whole image: does a tiny perfect mask score 1?")
def share_of_all_pixels(n):
    return np.diagonal(n) / n.sum()


@wrong(QUESTION, "A class in neither image has no score: is a mask wrong that found nothing where nothing was?")
def absent_is_0(n):
    return iou_of(n, empty=0.0)


@wrong(QUESTION, "A class in neither image has no score: should a class that never occurs raise the mean?")
def absent_is_1(n):
    return iou_of(n, empty=1.0)


@wrong(QUESTION, "Call the whole image class c: your score is perfect. Who pays for it?")
def recall(n):
    return recall_of(n)


@wrong(QUESTION, "Mark one sure pixel as class c: your score is perfect. Who misses the others?")
def precision(n):
    return precision_of(n)
