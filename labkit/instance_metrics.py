"""How well are things told apart? Scores of numbered things, as the papers on unseen objects define them (topic 03).

The truth of a picture and what was found in it are images of numbers, (H, W): 0 is no thing, pixels of one number are
one thing. The numbers themselves mean nothing, so true and found things are first paired: one to one, with the greatest
sum of F over the pairs, and only where they overlap. Then the pixels that pairs share are counted, twice: all pixels of
the things (overlap), and their edges alone, which forgive a few pixels (boundary). Precision is the share of what was
found that is right, recall the share of what is true that was found, and F = 2 P R / (P + R).

Xie et al., "Unseen object instance segmentation for robotic environments" (T-RO 2021), and Xiang et al., "Learning
RGB-D feature embeddings for unseen object instance segmentation" (CoRL 2020), whose published code settles the details.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Int64, Integer
from scipy.optimize import linear_sum_assignment

from labkit.support.validation import check_shape, require

REACH = 0.003  # of the picture's diagonal: how far from an edge the other edge may lie


@dataclass(frozen=True)
class InstanceScores:
    """What one picture's things score.

    true, found: how many things. iou: for each true thing, in the order of its number, the IoU with the found thing
    that it shares most with. detected: pairs whose F is over 0.75, which the papers call detected. overlap, boundary:
    precision, recall and F. foreground: pixels that are some thing in both images, and in either.
    """

    true: int
    found: int
    iou: tuple[float, ...]
    detected: int
    overlap: tuple[float, float, float]
    boundary: tuple[float, float, float]
    foreground: tuple[int, int]

    @property
    def foreground_iou(self) -> float:
        """IoU of all things together, told apart or not; NaN if neither image has one."""
        both, either = self.foreground
        return both / either if either else float("nan")

    def over(self, least: float) -> int:
        """How many true things are found as one piece: their IoU is over `least`, 0.5 or more.

        Two found things cannot both have an IoU over a half with one true thing, so this count needs no pairs.
        """
        require("least", 0.5 <= least < 1.0, "0.5 or more, below 1", least)
        return sum(iou > least for iou in self.iou)


def score_instances(
    true: Integer[np.ndarray, "H W"], found: Integer[np.ndarray, "H W"], ignore: int | None = None
) -> InstanceScores:
    """Score found things against true ones; both images hold a number of at least 0 for each pixel, 0 for no thing.

    ignore: the number of true pixels that do not count; they belong to no thing in either image. Where there is no
    found thing precision is 1, and where there is no true one recall is 1, since nothing is wrong there; F is 0 if one
    of the two images has things and the other none. Raises ValueError for images of other kinds or of two shapes.

    >>> true = np.array([[1, 1, 2, 2, 0, 0]])
    >>> found = np.array([[7, 7, 7, 0, 9, 9]])  # one takes half of its neighbour, one is no thing
    >>> scores = score_instances(true, found)
    >>> scores.iou, scores.over(0.5), scores.foreground
    ((0.6666666666666666, 0.25), 1, (3, 6))
    >>> scores.overlap  # 2 of 5 found pixels, 2 of 4 true ones
    (0.4, 0.5, 0.4444444444444445)
    """
    true, found = _checked(true, found, ignore)
    shared, of_true, of_found = shared_pixels(true, found)
    F = 2.0 * shared / (of_true[:, None] + of_found)
    t, f = linear_sum_assignment(F, maximize=True)
    t, f = t[F[t, f] > 0.0], f[F[t, f] > 0.0]  # the rest are pairs for want of others
    edges = _shared_edges(true, found, t, f)
    iou = shared / (of_true[:, None] + of_found - shared)
    return InstanceScores(
        true=len(of_true),
        found=len(of_found),
        iou=tuple(iou.max(axis=1, initial=0.0).tolist()),
        detected=int(np.count_nonzero(F[t, f] > 0.75)),
        overlap=_precision_recall_f(shared[t, f].sum(), of_found.sum(), shared[t, f].sum(), of_true.sum()),
        boundary=_precision_recall_f(*edges),
        foreground=(int(shared.sum()), int(of_true.sum() + of_found.sum() - shared.sum())),
    )


def shared_pixels(
    true: Integer[np.ndarray, "H W"], found: Integer[np.ndarray, "H W"]
) -> tuple[Int64[np.ndarray, "T F"], Int64[np.ndarray, " T"], Int64[np.ndarray, " F"]]:
    """Count the pixels that each true thing shares with each found one, (T, F), and the pixels of each, (T,), (F,).

    The things of an image are in the order of their numbers. The first count is a confusion matrix (topic 04) without
    the row and the column of 0, only that nothing says which found thing belongs to which row.
    """
    things, pixels = zip(*(np.unique(image, return_inverse=True) for image in (true, found)), strict=True)
    rows, columns = map(len, things)
    n = np.bincount(pixels[0].ravel() * columns + pixels[1].ravel(), minlength=rows * columns).reshape(rows, columns)
    is_true, is_found = (numbers > 0 for numbers in things)
    return n[is_true][:, is_found], n[is_true].sum(axis=1), n[:, is_found].sum(axis=0)


def edge(mask: Bool[np.ndarray, "H W"]) -> Bool[np.ndarray, "H W"]:
    """Mark the pixels whose right, lower or lower right neighbour is on the other side of the mask's outline.

    So an outline is one pixel thick, half a pixel up and to the left of where it is; the picture's border is none.

    >>> edge(np.array([[0, 0, 0], [0, 1, 1], [0, 1, 1]], bool)).astype(int)
    array([[1, 1, 1], [1, 0, 0], [1, 0, 0]])
    """
    m = np.pad(mask, ((0, 1), (0, 1)), mode="edge")
    here = m[:-1, :-1]
    return (here != m[:-1, 1:]) | (here != m[1:, :-1]) | (here != m[1:, 1:])


def near(lines: Bool[np.ndarray, "H W"]) -> Bool[np.ndarray, "H W"]:
    """Mark the pixels within 0.3 % of the picture's diagonal, rounded up, of a marked one: 3 pixels at 640 x 480."""
    radius = int(np.ceil(REACH * np.hypot(*lines.shape)))
    y, x = np.mgrid[-radius : radius + 1, -radius : radius + 1]
    return cv2.dilate(lines.astype(np.uint8), (x * x + y * y <= radius * radius).astype(np.uint8)) == 1


def _shared_edges(true, found, t, f) -> tuple[int, int, int, int]:
    """Edge pixels of found things near their partner's edge, of all found ones, and the same of the true ones."""
    edges = [[edge(image == number) for number in np.unique(image[image > 0])] for image in (true, found)]
    right = sum(int((edges[1][j] & near(edges[0][i])).sum()) for i, j in zip(t, f, strict=True))
    seen = sum(int((edges[0][i] & near(edges[1][j])).sum()) for i, j in zip(t, f, strict=True))
    of_true, of_found = (sum(int(line.sum()) for line in lines) for lines in edges)
    return right, of_found, seen, of_true


def _precision_recall_f(right, of_found, seen, of_true) -> tuple[float, float, float]:
    """right of of_found pixels and seen of of_true, as precision, recall and F; 0 / 0 is 1."""
    P = float(right / of_found) if of_found else 1.0
    R = float(seen / of_true) if of_true else 1.0
    either_is_empty = bool(of_found) != bool(of_true)
    return P, R, 0.0 if either_is_empty or P + R == 0.0 else 2.0 * P * R / (P + R)


@dataclass(frozen=True)
class PooledScores:
    """The scores of several pictures: things are counted over all, precisions and recalls are means over pictures.

    over_half, over_three_quarters: true things found as one piece, with an IoU over 0.5 and 0.75. detected: with an F
    over 0.75. foreground_iou: one intersection and one union over all pictures, NaN if neither image has a thing.
    """

    pictures: int
    true: int
    found: int
    over_half: int
    over_three_quarters: int
    detected: int
    overlap: tuple[float, float, float]
    boundary: tuple[float, float, float]
    foreground_iou: float


def pool(scores: Iterable[InstanceScores]) -> PooledScores:
    """Pool the scores of pictures as the papers do; raises ValueError without any."""
    scores = list(scores)
    require("scores", scores, "at least one picture's", "none")

    def mean(kind: str) -> tuple[float, float, float]:
        return tuple(np.mean([getattr(one, kind) for one in scores], axis=0).tolist())

    both, either = np.sum([one.foreground for one in scores], axis=0)
    return PooledScores(
        pictures=len(scores),
        true=sum(one.true for one in scores),
        found=sum(one.found for one in scores),
        over_half=sum(one.over(0.5) for one in scores),
        over_three_quarters=sum(one.over(0.75) for one in scores),
        detected=sum(one.detected for one in scores),
        overlap=mean("overlap"),
        boundary=mean("boundary"),
        foreground_iou=float(both / either) if either else float("nan"),
    )


def _checked(true, found, ignore) -> tuple[np.ndarray, np.ndarray]:
    """The two images, with 0 where a pixel does not count."""
    true = check_shape("true", true, (None, None))
    found = check_shape("found", found, true.shape)
    counts = np.ones(true.shape, bool) if ignore is None else true != ignore
    for name, image in (("true", true), ("found", found)):
        fits = image.dtype.kind in "iu" and image.min(initial=0) >= 0
        require(name, fits, "whole numbers of at least 0", lambda image=image: f"{image.dtype} from {image.min()}")
    return np.where(counts, true, 0), np.where(counts, found, 0)
