"""How good is a mask: the confusion matrix and every score that follows from it (topic 04).

Counts add up over frames and scores do not: keep one confusion matrix (and one pair of boundary counts) for a whole
test set, add each frame's to it, and divide once at the end. A score of 0 / 0 is NaN, neither 0 nor 1. So PASCAL VOC
scores segmentation (Everingham et al., 2010, doi:10.1007/s11263-009-0275-4).
"""

import math

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float64, Int64, Integer, Num, UInt8

from labkit.labels import IGNORE
from labkit.support.validation import (
    as_array,
    check_finite,
    check_labels,
    check_number,
    check_shape,
    check_whole,
    require,
)


def confusion_matrix(
    y_true: Integer[np.ndarray, "*shape"],
    y_pred: Integer[np.ndarray, "*shape"],
    num_classes: int,
    ignore: int | None = IGNORE,
) -> Int64[np.ndarray, "{num_classes} {num_classes}"]:
    """Count n[i, j], the pixels of true class i that are predicted as j.

    y_true, y_pred: labels of any one shape and any integer dtype. A pixel with y_true == ignore is left out, whatever
    is predicted there; ignore=None leaves out none. Raises ValueError if the shapes differ, or if a label of a counted
    pixel is not in 0 .. num_classes - 1. Topic 04.

    >>> confusion_matrix(np.array([0, 0, 1, 255]), np.array([0, 1, 1, 0]), 2)
    array([[1, 1], [0, 1]])
    """
    y_true, y_pred = _check_pair(y_true, y_pred, num_classes)
    _check_counted(y_true, y_pred, num_classes, ignore)
    counted = y_true != ignore
    pairs = num_classes * y_true[counted].astype(np.intp) + y_pred[counted].astype(np.intp)
    return np.bincount(pairs, minlength=num_classes**2).reshape(num_classes, num_classes)


def iou(n: Num[np.ndarray, "C C"]) -> Float64[np.ndarray, " C"]:
    """Score each class with TP / (TP + FP + FN): intersection over union of its true and its predicted pixels.

    n: confusion matrix. NaN where a class is in neither image, because 0 / 0 is not a score. Raises ValueError if n is
    not a square matrix of counts. Topic 04.

    >>> iou(np.array([[6, 2, 0], [0, 4, 0], [0, 0, 0]]))
    array([0.75 , 0.66666667, nan])
    """
    n = _check_counts(n)
    intersection = np.diagonal(n)
    return _ratio(intersection, n.sum(axis=0) + n.sum(axis=1) - intersection)


def mean_iou(n: Num[np.ndarray, "C C"]) -> float:
    """Average the IoU over the classes that are present, in the truth or in the prediction; NaN if none is.

    Dividing by C instead would score a class that is in neither image with 0 / 0. A class that is only predicted
    counts, with an IoU of 0. n: confusion matrix. Topic 04.

    >>> round(mean_iou(np.array([[6, 2, 0], [0, 4, 0], [0, 0, 0]])), 4)
    0.7083
    """
    scores = iou(n)
    scores = scores[~np.isnan(scores)]
    return float(scores.mean()) if scores.size else float("nan")


def pixel_accuracy(n: Num[np.ndarray, "C C"]) -> float:
    """Give the share of the counted pixels whose class is right; NaN if no pixel is counted (topic 04).

    >>> pixel_accuracy(np.array([[6, 2], [0, 4]])) == 10 / 12
    True
    """
    n = _check_counts(n)
    return float(_ratio(np.trace(n), n.sum()))


def precision_recall(n: Num[np.ndarray, "C C"]) -> tuple[Float64[np.ndarray, " C"], Float64[np.ndarray, " C"]]:
    """Score each class with TP / (TP + FP) and TP / (TP + FN).

    n: confusion matrix. Precision is NaN for a class that is never predicted, recall for one that is never true. IoU
    cannot tell a mask that is too large from one that is too small; these two can. Topic 04.

    >>> precision_recall(np.array([[6, 2], [0, 4]]))
    (array([1. , 0.66666667]), array([0.75, 1. ]))
    """
    n = _check_counts(n)
    correct = np.diagonal(n)
    return _ratio(correct, n.sum(axis=0)), _ratio(correct, n.sum(axis=1))


def boundary_iou(
    y_true: Integer[np.ndarray, "*batch H W"],
    y_pred: Integer[np.ndarray, "*batch H W"],
    num_classes: int,
    width: int | None = None,
    ignore: int | None = IGNORE,
) -> Float64[np.ndarray, " {num_classes}"]:
    """Score the edge of each class's mask: IoU of the pixels that lie inside it and within `width` of its boundary.

    Boundary IoU of Cheng et al. (2021), over one image or a batch of them. A width that reaches the middle of every
    mask gives the plain IoU. NaN where a class is in neither mask. Arguments and errors as in `boundary_counts`, which
    are what to add up over batches. Topic 04.

    >>> y = np.zeros((5, 5), int); y[1:4, 1:4] = 1
    >>> boundary_iou(y, np.roll(y, 1, axis=1), 2, width=1)[1]  # moved by a pixel, a rim of 8 shares 4: 4 / (8 + 8 - 4)
    np.float64(0.3333333333333333)
    """
    return _ratio(*boundary_counts(y_true, y_pred, num_classes, width, ignore))


def boundary_counts(
    y_true: Integer[np.ndarray, "*batch H W"],
    y_pred: Integer[np.ndarray, "*batch H W"],
    num_classes: int,
    width: int | None = None,
    ignore: int | None = IGNORE,
) -> tuple[Int64[np.ndarray, " {num_classes}"], Int64[np.ndarray, " {num_classes}"]]:
    """Count, class by class, the pixels in the intersection and in the union of the true and predicted boundary bands.

    The band of a mask: its pixels with a pixel outside it, or the image's border, within `width` rows and columns.
    width: pixels, at least 1; None is the paper's 2 % of the image's diagonal. An ignored pixel belongs to no mask,
    true or predicted. The counts of a batch (..., H, W) are summed. Raises ValueError if the shapes differ, a label is
    out of range, or width is below 1.

    >>> boundary_counts(np.array([[0, 0, 1, 1]]), np.array([[0, 1, 1, 1]]), 2, width=1)
    (array([1, 2]), array([2, 3]))
    """
    y_true, y_pred = _check_pair(y_true, y_pred, num_classes)
    require("y_true", y_true.ndim >= 2, "images (..., H, W)", f"shape {y_true.shape}")
    _check_counted(y_true, y_pred, num_classes, ignore)
    if width is None:
        width = max(1, round(0.02 * np.hypot(*y_true.shape[-2:])))
    require("width", width >= 1, "at least 1 pixel", width)

    ignored = y_true == ignore
    true, pred = (np.where(ignored, np.uint8(IGNORE), y.astype(np.uint8)) for y in (y_true, y_pred))
    true_band, pred_band = _boundary_bands(true, width), _boundary_bands(pred, width)

    def pixels_per_class(labels):  # entry 255, the ignored pixels, is cut off
        return np.bincount(labels, minlength=IGNORE + 1)[:num_classes].astype(np.int64)

    intersection = pixels_per_class(true[true_band & pred_band & (true == pred)])
    return intersection, pixels_per_class(true[true_band]) + pixels_per_class(pred[pred_band]) - intersection


def _boundary_bands(y: UInt8[np.ndarray, "*batch H W"], width: int) -> Bool[np.ndarray, "*batch H W"]:
    """In each image, mark the pixels that have another label, or the image's border, within `width` rows and columns.

    One erosion and one dilation serve all classes at once: a window holds one label only if its minimum is its maximum.
    """
    width = min(width, max(y.shape[-2:]))  # a wider window sees no more
    window = np.ones((2 * width + 1, 2 * width + 1), np.uint8)
    bands = np.empty(y.shape, bool)
    for image in np.ndindex(y.shape[:-2]):
        # OpenCV's windows end where the image does; a frame of another label makes the image's border a boundary.
        framed = np.pad(y[image], 1, constant_values=IGNORE)
        bands[image] = (cv2.erode(framed, window) != cv2.dilate(framed, window))[1:-1, 1:-1]
    return bands


def wilson_interval(successes: int, trials: int, confidence: float = 0.95) -> tuple[float, float]:
    """Bound a success rate, such as the share of objects lifted, by Wilson's score interval.

    Unlike rate +- 1.96 sqrt(rate (1 - rate) / trials), it stays in 0..1 and does not shrink to a point at 0 or all
    successes. Raises ValueError without a trial, or if successes are not in 0 .. trials.

    >>> [round(bound, 3) for bound in wilson_interval(20, 20)]
    [0.839, 1.0]
    """
    check_whole("trials", trials, 1)
    check_whole("successes", successes, 0)
    check_number("confidence", confidence, 0.0, 1.0)
    require("successes", 0 <= successes <= trials, f"0 to {trials}", successes)
    require("confidence", 0.0 < confidence < 1.0, "a share between 0 and 1", confidence)
    from scipy.stats import binomtest  # takes its time to import

    interval = binomtest(int(successes), int(trials)).proportion_ci(confidence, "wilson")
    return float(interval.low), float(interval.high)


def paired_difference(gained: int, lost: int, trials: int) -> tuple[float, float, float]:
    """Compare two success rates that were measured in the same trials: a 95 % interval of their difference, and p.

    gained, lost: in how many trials only the first succeeded, and only the second. The interval is Bonett and Price's
    (2012, doi:10.3102/1076998611411915): that of the mean of +1, -1 and 0, after one trial more of either kind was
    counted, so that it does not shrink to nothing where few trials differ. p is the exact one of McNemar's test: how
    often a fair coin would split gained + lost trials as unevenly, or more. Raises ValueError unless
    0 <= gained + lost <= trials. Topic 07_grasp.

    >>> low, high, p = paired_difference(4, 0, 40)
    >>> round(low, 3), round(high, 3), p
    (-0.015, 0.206, 0.125)
    """
    check_whole("gained", gained, 0)
    check_whole("lost", lost, 0)
    check_whole("trials", trials, 1)
    require("trials", trials >= max(1, gained + lost), f"at least gained + lost, {gained + lost}, and 1", trials)
    first, second = (gained + 1) / (trials + 2), (lost + 1) / (trials + 2)
    half = 1.96 * math.sqrt((first + second - (first - second) ** 2) / (trials + 2))
    tail = sum(math.comb(gained + lost, k) for k in range(min(gained, lost) + 1))
    p = min(1.0, 2 * tail / 2 ** (gained + lost))
    return max(-1.0, first - second - half), min(1.0, first - second + half), p


def reliability_counts(
    p: Float[np.ndarray, "*shape"], true: Bool[np.ndarray, "*shape"], bins: int = 10
) -> Float64[np.ndarray, "{bins} 3"]:
    """Count how often what is called so probable is true: pixels, the sum of their p, and how many are true, by p.

    p: probabilities; bin k holds those from k / bins to (k + 1) / bins, the last one 1 as well. Counts add up over
    frames, as a confusion matrix does; a point of a reliability diagram is (sum of p, true) / pixels. Raises ValueError
    for shapes that differ, a p outside 0..1, or no bin. Topic 07_grasp.

    >>> reliability_counts(np.array([0.1, 0.2, 0.9]), np.array([False, True, True]), bins=2)
    array([[2. , 0.3, 1. ], [1. , 0.9, 1. ]])
    """
    p = check_finite("p", p)
    true = check_shape("true", true, p.shape)
    if p.size and not (p.min() >= 0.0 and p.max() <= 1.0):
        raise ValueError(f"p: expected probabilities in 0..1, got {p.min():.4g} to {p.max():.4g}")
    edges = np.arange(1, check_whole("bins", bins, 1)) / bins  # p * bins would round 0.29 * 100 down to 28
    place = np.searchsorted(edges.astype(p.dtype if p.dtype.kind == "f" else np.float64), p.ravel(), side="right")
    columns = (np.ones(p.size), p.ravel(), true.ravel())
    return np.column_stack([np.bincount(place, weights, minlength=bins) for weights in columns]).astype(np.float64)


def _ratio(part, whole):
    """Divide in float64; 0 / 0 is NaN without a warning."""
    with np.errstate(invalid="ignore"):
        return np.true_divide(part, whole, dtype=np.float64)


def _check_counts(n) -> np.ndarray:
    n = check_finite("n", n)
    require("n", n.ndim == 2 and n.shape[0] == n.shape[1], "a square confusion matrix (C, C)", f"shape {n.shape}")
    require("n", n.min(initial=0) >= 0, "counts of at least 0", n.min(initial=0))
    return n.astype(np.float64)


def _check_pair(y_true, y_pred, num_classes) -> tuple[np.ndarray, np.ndarray]:
    check_whole("num_classes", num_classes, 1, IGNORE)
    y_true, y_pred = as_array("y_true", y_true), as_array("y_pred", y_pred)
    for name, y in (("y_true", y_true), ("y_pred", y_pred)):
        require(name, y.dtype.kind in "iu", "integer labels", lambda y=y: f"dtype {y.dtype}")
    require("y_pred", y_true.shape == y_pred.shape, f"the shape of y_true, {y_true.shape}", y_pred.shape)
    return y_true, y_pred


def _check_counted(y_true, y_pred, num_classes, ignore) -> None:
    """Raise if a pixel that counts has a label out of range."""
    check_labels("y_true", y_true, num_classes, ignore)
    check_labels("y_pred", y_pred[y_true != ignore], num_classes, ignore=None)
