"""Questions of topic 04: the confusion matrix and the scores that follow from it (section 3, problem 2 of the text)."""

import numpy as np

from labkit.course.questions import answers_04 as answers
from labkit.course.questions.question import Misconception, Property, Question

# ------------------------------------------------------------------------------------------ the confusion matrix


def confusion_matrix(y_true, y_pred, num_classes, ignore):
    """Count n[i, j], the pixels of true class i that are predicted as j; those with y_true == ignore are left out."""
    counted = y_true != ignore
    n = np.zeros((num_classes, num_classes), np.int64)
    np.add.at(n, (y_true[counted], y_pred[counted]), 1)
    return n


def _label_pair(rng):
    """Two label images that agree on two pixels in three; what is ignored is 255 or one of the classes."""
    num_classes = int(rng.choice([3, 4, 20]))
    y_true = rng.choice(num_classes, size=(9, 14), p=rng.dirichlet(np.full(num_classes, 2.0))).astype(np.uint8)
    y_pred = np.where(rng.random(y_true.shape) < 0.65, y_true, rng.integers(num_classes, size=y_true.shape))
    ignore = int(rng.choice([0, 255]))
    y_true[rng.random(y_true.shape) < 0.15] = ignore
    return y_true, y_pred.astype(np.uint8), num_classes, ignore


CONFUSION_MATRIX = Question(
    name="04_iou.confusion_matrix",
    reference=confusion_matrix,
    inputs=_label_pair,
    by_hand=(
        (np.array([[0, 0, 1]], np.uint8), np.array([[0, 1, 1]], np.uint8), 2, 255),
        (np.array([[2, 255], [2, 1], [0, 2]], np.uint8), np.array([[1, 0], [1, 1], [0, 2]], np.uint8), 3, 255),
        (np.array([[0, 1, 2, 1]], np.uint8), np.array([[1, 0, 2, 1]], np.uint8), 4, 0),
        (np.array([[19, 19, 18]], np.uint8), np.array([[19, 18, 19]], np.uint8), 20, 255),
    ),
    random_cases=6,
    rtol=0.0,
    atol=0.0,
    points=2,
    properties=(
        Property(
            "the entries of n add up to the number of pixels that are not ignored",
            lambda arguments, n: np.sum(n) == np.count_nonzero(arguments[0] != arguments[3]),
        ),
    ),
    misconceptions=(
        Misconception(
            "transposed", answers.transposed, "Which index of n is the truth? Try one pixel: true 0, predicted 1."
        ),
        Misconception(
            "each pair counted once",
            answers.each_pair_once,
            "No entry exceeds 1: with repeated indices, n[i, j] += 1 writes once. What adds up repeated indices?",
        ),
        Misconception(
            "ignored pixels counted as class 0",
            answers.ignored_as_class_0,
            "Row 0 is too full: what became of the pixels whose true label is `ignore`?",
        ),
        Misconception(
            "predictions ignored too",
            answers.prediction_ignored_too,
            "Whether a pixel counts is up to the truth alone; one that is predicted as `ignore` still counts.",
        ),
        Misconception(
            "shares instead of counts",
            answers.shares_of_rows,
            "n holds whole numbers of pixels: nothing is divided yet.",
        ),
        Misconception(
            "overflow of uint8",
            answers.overflowing_bytes,
            "With 20 classes the numbers go wrong: what is 19 * 20 + 19 in uint8, which ends at 255?",
        ),
    ),
    alternatives=(
        answers.confusion_loops,
        answers.confusion_bincount,
        answers.confusion_one_hot,
        answers.confusion_torch,
    ),
    forbidden=("sklearn", "torchmetrics"),
)


# ------------------------------------------------------------------------------------------------------------ IoU


def iou(n):
    """Score each class with TP / (TP + FP + FN); NaN where a class is neither true nor predicted."""
    correct = np.diagonal(n)
    with np.errstate(invalid="ignore"):
        return correct / (n.sum(axis=0) + n.sum(axis=1) - correct)


def _counts(rng):
    """Draw an asymmetric confusion matrix; in some one class is absent, in some one is predicted only."""
    C = int(rng.choice([3, 4, 6]))
    n = rng.integers(0, 60, (C, C)) + np.diag(rng.integers(20, 400, C))
    kind = rng.integers(3)
    if kind < 2:
        n[rng.integers(C)] = 0  # a class that is never true ...
    if kind == 1:
        absent = np.flatnonzero(n.sum(axis=1) == 0)[0]
        n[:, absent] = 0  # ... and never predicted either
    return (n.astype(np.int64),)


# Two classes confused with each other; a class in neither image; a class that is predicted but never true; one perfect.
_SMALL_COUNTS = (
    (np.array([[6, 2], [1, 4]]),),
    (np.array([[6, 2, 0], [0, 4, 0], [0, 0, 0]]),),
    (np.array([[5, 0, 3], [1, 2, 0], [0, 0, 0]]),),
    (np.array([[0, 7], [2, 0]]),),
    (np.diag([3, 0, 1]),),
)

IOU = Question(
    name="04_iou.iou",
    reference=iou,
    inputs=_counts,
    by_hand=_SMALL_COUNTS,
    random_cases=6,
    points=2,
    properties=(
        Property(
            "no IoU is below 0 or above 1",
            lambda arguments, scores: bool(np.all(np.isnan(scores) | ((scores >= 0.0) & (scores <= 1.0)))),
        ),
    ),
    misconceptions=(
        Misconception(
            "absent is 0",
            lambda n: answers.iou_of(n, empty=0.0),
            "A class in neither image has no score: is a mask wrong that found nothing where nothing was?",
        ),
        Misconception(
            "absent is 1",
            lambda n: answers.iou_of(n, empty=1.0),
            "A class in neither image has no score: should a class that never occurs raise the mean?",
        ),
        Misconception(
            "recall", answers.recall_of, "Call the whole image class c: your score is perfect. Who pays for it?"
        ),
        Misconception(
            "precision",
            answers.precision_of,
            "Mark one sure pixel as class c: your score is perfect. Who misses the others?",
        ),
        Misconception(
            "Dice", answers.dice, "That is Dice (F1), another score: the overlap stands once in an IoU, not twice."
        ),
        Misconception(
            "overlap counted twice",
            answers.union_counts_the_overlap_twice,
            "A perfect mask scores one half: how often is the overlap in row sum plus column sum?",
        ),
        Misconception(
            "share of all pixels",
            answers.share_of_all_pixels,
            "Each class is divided by its own union, not by the whole image: does a tiny perfect mask score 1?",
        ),
    ),
    alternatives=(answers.iou_loops, answers.iou_einsum, answers.iou_torch, answers.iou_float32),
    forbidden=("sklearn", "torchmetrics"),
)


# --------------------------------------------------------------------------------------------- precision and recall


def precision_recall(n):
    """Score each class with TP / (TP + FP) and with TP / (TP + FN); NaN where nothing is predicted, or nothing true."""
    correct = np.diagonal(n)
    with np.errstate(invalid="ignore"):
        return correct / n.sum(axis=0), correct / n.sum(axis=1)


PRECISION_RECALL = Question(
    name="04_iou.precision_recall",
    reference=precision_recall,
    inputs=_counts,
    by_hand=_SMALL_COUNTS,
    random_cases=6,
    points=2,
    misconceptions=(
        Misconception(
            "swapped",
            lambda n: (answers.recall_of(n), answers.precision_of(n)),
            "Precision asks of what is predicted, recall of what is true: which of them runs down a column of n?",
        ),
        Misconception(
            "0 where there is nothing",
            lambda n: (np.nan_to_num(answers.precision_of(n)), np.nan_to_num(answers.recall_of(n))),
            "Of a class that is never predicted no prediction was wrong: 0/0 is NaN here, not 0.",
        ),
        Misconception(
            "both are IoU",
            lambda n: (answers.iou_of(n), answers.iou_of(n)),
            "Your two answers are the same: precision knows nothing of FN, and recall nothing of FP.",
        ),
        Misconception(
            "error rates",
            answers.false_ones_over_true_ones,
            "You count the wrong ones: a perfect prediction must score 1 in both.",
        ),
        Misconception(
            "over all pixels",
            answers.over_all_pixels,
            "Divide by the pixels predicted as the class, and by those that truly are; not by all pixels.",
        ),
        Misconception(
            "true positives left out of the sum",
            answers.off_the_diagonal_only,
            "A score above 1? The pixels predicted as a class include the right ones.",
        ),
    ),
    alternatives=(answers.precision_recall_loops, answers.precision_recall_einsum, answers.precision_recall_torch),
    forbidden=("sklearn", "torchmetrics"),
)


# ------------------------------------------------------------------------------------------ mean IoU of many frames


def mean_iou(n_frames):
    """Add up the frames' confusion matrices, score each class once, average over the classes that occur at all."""
    n = n_frames.sum(axis=0)
    correct = np.diagonal(n)
    with np.errstate(invalid="ignore"):
        return np.nanmean(correct / (n.sum(axis=0) + n.sum(axis=1) - correct))


def _counts_of_frames(rng):
    """Draw the confusion matrices of a few frames of unlike size; a class is often absent from a frame, or from all."""
    F, C = int(rng.choice([3, 6])), int(rng.choice([4, 5]))
    n = rng.integers(0, 30, (F, C, C)) + np.eye(C, dtype=np.int64) * rng.integers(10, 500, (F, C, 1))
    n *= rng.integers(1, 20, (F, 1, 1))
    for frame in n[1:]:
        absent = rng.integers(C)
        frame[absent], frame[:, absent] = 0, 0
    if rng.random() < 0.7:
        n[:, 1], n[:, :, 1] = 0, 0
    if rng.random() < 0.7:
        n[:, 2] = 0
    return (n.astype(np.int64),)


MEAN_IOU = Question(
    name="04_iou.mean_iou",
    reference=mean_iou,
    inputs=_counts_of_frames,
    by_hand=(
        (np.array([[[0, 0], [0, 1]], [[0, 99], [0, 0]]]),),  # class 1: 1/1 in one frame, 0/99 in the other
        (np.array([[[6, 2, 0], [0, 4, 0], [0, 0, 0]]]),),
        (np.array([[[5, 0, 3], [1, 2, 0], [0, 0, 0]], [[9, 1, 0], [0, 2, 0], [0, 0, 0]]]),),
    ),
    random_cases=6,
    points=2,
    misconceptions=(
        Misconception(
            "the frames' mIoU averaged",
            answers.mean_of_frames_means,
            "1/1 in one frame and 0/99 in another: is that one half, or one hundredth? Add counts, divide once.",
        ),
        Misconception(
            "the frames' IoU averaged by class",
            answers.mean_of_frames_by_class,
            "Should a frame with three pixels of a class weigh as much as one with three thousand? Add counts first.",
        ),
        Misconception(
            "absent is 0",
            lambda n_frames: np.nan_to_num(answers.iou_of(n_frames.sum(axis=0))).mean(),
            "A class that no frame holds or predicts pulls your mean down: over how many classes do you average?",
        ),
        Misconception(
            "absent is 1",
            lambda n_frames: answers.iou_of(n_frames.sum(axis=0), empty=1.0).mean(),
            "A class that no frame holds or predicts lifts your mean: over how many classes do you average?",
        ),
        Misconception(
            "sum of intersections over sum of unions",
            answers.sum_over_sum,
            "Your background wins: each class has one vote here, however many pixels it has.",
        ),
        Misconception(
            "only classes of the truth",
            answers.truth_only,
            "A class that is predicted but never true is a mistake: its IoU is 0, and it counts.",
        ),
        Misconception(
            "pixel accuracy", answers.accuracy, "That is the share of pixels that are right; where are the unions?"
        ),
        Misconception(
            "weighted by frequency",
            answers.weighted_by_frequency,
            "The text's mean gives each class the same weight, not the weight of its pixels.",
        ),
    ),
    alternatives=(answers.mean_iou_loops, answers.mean_iou_einsum, answers.mean_iou_torch),
    forbidden=("sklearn", "torchmetrics"),
)


# -------------------------------------------------------------------------------------------------- boundary bands


def boundary_band(mask, width):
    """Mark the mask's pixels that have a pixel outside it, or the image's border, within `width` rows and columns."""
    H, W = mask.shape
    framed = np.pad(mask, width)
    inside = mask.copy()
    for down in range(2 * width + 1):
        for right in range(2 * width + 1):
            inside &= framed[down : down + H, right : right + W]
    return mask & ~inside


def _blob(rng):
    """Draw a mask of a rectangle that touches the border, a slanted half-plane cut out of it, and a hole."""
    H, W = int(rng.integers(15, 19)), int(rng.integers(20, 26))
    v, u = np.mgrid[0:H, 0:W]
    mask = (v < H - 2) & (u >= 3) & (0.5 * u + v < 0.5 * W + 0.55 * H)
    mask[rng.integers(2, 6), rng.integers(7, 12)] = False
    return np.roll(mask, rng.integers(0, 3), axis=1), int(rng.integers(1, 4))


def _square(size, low, high):
    mask = np.zeros(size, bool)
    mask[low:high, low:high] = True
    return mask


BOUNDARY_BAND = Question(
    name="04_iou.boundary_band",
    reference=boundary_band,
    inputs=_blob,
    by_hand=(
        (_square((5, 6), 1, 4), 1),  # a 3 x 3 square: all but its middle
        (_square((6, 7), 0, 4), 1),  # the same kind of square in the corner of the image
        (np.ones((5, 8), bool), 2),
        (np.zeros((3, 4), bool), 1),
    ),
    rtol=0.0,
    atol=0.0,
    points=3,
    properties=(
        Property(
            "every pixel of the band is a pixel of the mask",
            lambda arguments, band: not np.any(np.asarray(band, bool) & ~arguments[0]),
        ),
    ),
    misconceptions=(
        Misconception(
            "outside the mask",
            answers.outer_band,
            "Your band lies around the mask: it should be the part of the mask that is near its edge.",
        ),
        Misconception(
            "both sides of the edge", answers.both_sides, "A pixel that is not in the mask is not in its band."
        ),
        Misconception(
            "the inside",
            answers.the_inside,
            "You return what is far from the edge; for a 3 x 3 square and width 1 all but the middle is band.",
        ),
        Misconception(
            "the image's border is no edge",
            answers.border_is_no_edge,
            "Take a mask that fills the image: where it meets the image's border is an edge too.",
        ),
        Misconception(
            "a cross instead of a square",
            answers.cross_window,
            "Look at a corner that is cut into the mask: a pixel diagonal to it is within one row and one column.",
        ),
        Misconception(
            "one pixel too wide",
            lambda mask, width: answers.band_with_window(mask, width + 1, width + 1),
            "For a 3 x 3 square and width 1 the middle pixel is not in the band: how far does your window reach?",
        ),
    ),
    alternatives=(answers.band_loops, answers.band_repeated_erosion, answers.band_windows, answers.band_torch),
    forbidden=("cv2", "scipy", "skimage"),
)


QUESTIONS = (CONFUSION_MATRIX, IOU, PRECISION_RECALL, MEAN_IOU, BOUNDARY_BAND)
