"""04_iou.precision_recall: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.questions.question import Question, wrong
from labkit.course.questions.t04_iou import SMALL_COUNTS, counts, divide, iou_of, parts, precision_of, recall_of


def precision_recall(n):
    """Score each class with TP / (TP + FP) and with TP / (TP + FN); NaN where nothing is predicted, or nothing true."""
    correct = np.diagonal(n)
    with np.errstate(invalid="ignore"):
        return correct / n.sum(axis=0), correct / n.sum(axis=1)


QUESTION = Question(
    name="04_iou.precision_recall",
    reference=precision_recall,
    inputs=counts,
    by_hand=SMALL_COUNTS,
    random_cases=6,
    points=2,
    forbidden=("sklearn", "torchmetrics"),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


@wrong(QUESTION, "You count the wrong ones: a perfect prediction must score 1 in both.")
def false_ones_over_true_ones(n):
    correct, predicted, true = parts(n)
    return divide(predicted - correct, predicted), divide(true - correct, true)


@wrong(QUESTION, "Divide by the pixels predicted as the class, and by those that truly are; not by all pixels.")
def over_all_pixels(n):
    correct = np.diagonal(n)
    return correct / n.sum(), correct / n.sum()


@wrong(QUESTION, "A score above 1? The pixels predicted as a class include the right ones.")
def off_the_diagonal_only(n):
    """Divide by FP and FN alone, as if TP were not among what is predicted, or true."""
    correct, predicted, true = parts(n)
    return divide(correct, predicted - correct), divide(correct, true - correct)


@wrong(QUESTION, "Precision asks of what is predicted, recall of what is true: which of them runs down a column of n?")
def swapped(n):
    return (recall_of(n), precision_of(n))


@wrong(QUESTION, "Of a class that is never predicted no prediction was wrong: 0/0 is NaN here, not 0.")
def with_0_where_there_is_nothing(n):
    return (np.nan_to_num(precision_of(n)), np.nan_to_num(recall_of(n)))


@wrong(QUESTION, "Your two answers are the same: precision knows nothing of FN, and recall nothing of FP.")
def both_are_iou(n):
    return (iou_of(n), iou_of(n))
