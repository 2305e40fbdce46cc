"""04_iou.mean_iou: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labcourse.questions.t04_iou import counts_of_frames, iou_of, parts
from labgrader.question import Question, wrong


def mean_iou(n_frames):
    """Add up the frames' confusion matrices, score each class once, average over the classes that occur at all."""
    n = n_frames.sum(axis=0)
    correct = np.diagonal(n)
    with np.errstate(invalid="ignore"):
        return np.nanmean(correct / (n.sum(axis=0) + n.sum(axis=1) - correct))


QUESTION = Question(
    reference=mean_iou,
    inputs=counts_of_frames,
    by_hand=(
        (np.array([[[0, 0], [0, 1]], [[0, 99], [0, 0]]]),),  # class 1: 1/1 in one frame, 0/99 in the other
        (np.array([[[6, 2, 0], [0, 4, 0], [0, 0, 0]]]),),
        (np.array([[[5, 0, 1], [1, 2, 0], [0, 0, 0]], [[9, 1, 0], [0, 2, 0], [0, 0, 0]]]),),  # one pixel of class 2
        (np.array([[[30_000, 2_000], [0, 500]]] * 3),),  # more pixels than 16 bits count
    ),
    random_cases=6,
    forbidden=("sklearn", "torchmetrics"),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


@wrong("1/1 in one frame and 0/99 in another: is that one half, or one hundredth? Add counts, divide once.")
def mean_of_frames_means(n_frames):
    return np.mean([np.nanmean(iou_of(n)) for n in n_frames if n.sum()])


@wrong("Should a frame with three pixels of a class weigh as much as one with three thousand? Add counts first.")
def mean_of_frames_by_class(n_frames):
    scores = np.array([iou_of(n) for n in n_frames])
    seen = ~np.isnan(scores).all(axis=0)
    return np.nanmean(scores[:, seen], axis=0).mean()


@wrong("Each class of each frame counts once in your mean, however few pixels it has. Add counts first, divide once.")
def mean_of_all_scores(n_frames):
    return np.nanmean([iou_of(n) for n in n_frames])


@wrong("In your sum a class with many pixels outweighs the others: here each class counts once, whatever its size.")
def sum_over_sum(n_frames):
    correct, predicted, true = parts(n_frames.sum(axis=0))
    return correct.sum() / (predicted + true - correct).sum()


@wrong("A class that is predicted but never true is a mistake: its IoU is 0, and it counts.")
def truth_only(n_frames):
    n = n_frames.sum(axis=0)
    return iou_of(n)[n.sum(axis=1) > 0].mean()


@wrong("A class whose IoU is 0 occurs all the same: it counts. Which number says whether a class occurs?")
def found_only(n_frames):
    scores = iou_of(n_frames.sum(axis=0))
    return scores[scores > 0.0].mean()


@wrong("That is the share of pixels that are right; where are the unions?")
def accuracy(n_frames):
    n = n_frames.sum(axis=0)
    return np.trace(n) / n.sum()


@wrong("The mean IoU gives each class the same weight, not the weight of its pixels.")
def weighted_by_frequency(n_frames):
    n = n_frames.sum(axis=0)
    return np.nansum(iou_of(n) * n.sum(axis=1)) / n.sum()


@wrong("A class that is in no frame and never predicted raises your mean: over how many classes do you average?")
def absent_is_1(n_frames):
    return iou_of(n_frames.sum(axis=0), empty=1.0).mean()


@wrong("What is the mean of some numbers if one of them is NaN?")
def nan_in_the_mean(n_frames):
    return iou_of(n_frames.sum(axis=0)).mean()


@wrong("Background is a class like the others: over which classes do you average?")
def without_background(n_frames):
    return np.nanmean(iou_of(n_frames.sum(axis=0))[1:])


@wrong("16 bits hold numbers up to 32,767: how many pixels can a class have in all frames together?")
def added_in_16_bits(n_frames):
    return np.nanmean(iou_of(n_frames.sum(axis=0, dtype=np.int16)))


@wrong("Means of counts need not be integers: what does the cast to integers do to a class of few pixels?")
def means_cut_to_whole_numbers(n_frames):
    return np.nanmean(iou_of(n_frames.mean(axis=0).astype(int)))


@wrong("Weighting the frames' scores by pixels is not pooling: add the frames' counts, then divide once.")
def mean_of_frames_by_their_pixels(n_frames):
    return np.average([np.nanmean(iou_of(n)) for n in n_frames], weights=n_frames.sum(axis=(1, 2)))
