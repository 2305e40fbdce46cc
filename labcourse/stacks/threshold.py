"""Segmentation by colour: a range of hue, saturation and value, fitted to labelled images (the Java listing)."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Integer, UInt8

from labkit.support.validation import check_rgb, check_same_size, check_shape, require

HUES = 180  # OpenCV's hue is half an angle, so that it fits into a byte
STEP = 4  # saturation and value are fitted in steps of this


@dataclass(frozen=True)
class HSVRange:
    """Lower and upper bounds of (hue, saturation, value), both included; hue 0..179, the others 0..255.

    A lower hue above the upper one goes round through red, where the circle of hues begins and ends. Raises ValueError
    for bounds outside, or a saturation or value whose lower bound is above its upper one.

    >>> HSVRange((170, 50, 50), (10, 255, 255)).wraps
    True
    """

    lower: tuple[int, int, int]
    upper: tuple[int, int, int]

    def __post_init__(self):
        for name, bound in (("lower", self.lower), ("upper", self.upper)):
            fits = len(bound) == 3 and all(0 <= b <= top for b, top in zip(bound, (HUES - 1, 255, 255), strict=True))
            require(name, fits, "hue 0..179, saturation 0..255 and value 0..255", bound)
        if self.lower[1] > self.upper[1] or self.lower[2] > self.upper[2]:
            raise ValueError(f"lower: expected saturation and value at most {self.upper[1:]}, got {self.lower[1:]}")

    @property
    def wraps(self) -> bool:
        """Whether the range of hues goes round through red."""
        return self.lower[0] > self.upper[0]


BROWN = HSVRange((5, 50, 50), (20, 255, 255))  # the listing's range for a table


def hsv_mask(rgb: UInt8[np.ndarray, "H W 3"], colours: HSVRange) -> Bool[np.ndarray, "H W"]:
    """Which pixels of an RGB image have a colour in the range (topic 09).

    >>> hsv_mask(np.array([[[150, 90, 40], [40, 90, 150]]], np.uint8), BROWN)
    array([[ True, False]])
    """
    hsv = cv2.cvtColor(check_rgb("rgb", rgb), cv2.COLOR_RGB2HSV)
    low, high = colours.lower, colours.upper
    if not colours.wraps:
        return cv2.inRange(hsv, low, high) > 0
    above = cv2.inRange(hsv, low, (HUES - 1, *high[1:]))
    below = cv2.inRange(hsv, (0, *low[1:]), high)
    return (above | below) > 0


def fit_hsv(images: Sequence[UInt8[np.ndarray, "H W 3"]], masks: Sequence[Bool[np.ndarray, "H W"]]) -> HSVRange:
    """Find the range whose mask has the best IoU with the true masks, over all images together.

    One channel's interval after the other is replaced by the best one, given the two others, until none improves; so it
    is a local optimum, and no interval of a single channel is better. Raises ValueError without any true pixel.
    """
    inside, outside = _histograms(images, masks)
    require("masks", inside.any(), "some true pixels to fit to", "none")
    bins = inside.shape
    bounds = [(0, n - 1) for n in bins]
    best = -1.0
    while True:
        before = best
        for axis in range(3):
            others = [_members(bounds[a], bins[a]) if a != axis else np.ones(bins[a], bool) for a in range(3)]
            chosen = np.ix_(*others)
            rest = tuple(a for a in range(3) if a != axis)
            score, interval = _best_interval(
                inside[chosen].sum(axis=rest), outside[chosen].sum(axis=rest), int(inside.sum()), circular=axis == 0
            )
            if score > best:
                best, bounds[axis] = score, interval
        if best <= before:
            break
    (h0, h1), (s0, s1), (v0, v1) = bounds
    last = STEP - 1
    return HSVRange((h0, STEP * s0, STEP * v0), (h1, STEP * s1 + last, STEP * v1 + last))


def _histograms(images, masks) -> tuple[Integer[np.ndarray, "180 64 64"], Integer[np.ndarray, "180 64 64"]]:
    """Count the colours inside and outside the masks."""
    counts = np.zeros((2, HUES, 256 // STEP, 256 // STEP), np.int64)
    for rgb, mask in zip(images, masks, strict=True):
        rgb, mask = check_rgb("images", rgb), check_shape("masks", mask, (None, None)).astype(bool)
        check_same_size("images", rgb, "masks", mask)
        hsv = cv2.cvtColor(rgb, cv2.COLOR_RGB2HSV).astype(np.int64)
        colour = np.ravel_multi_index((hsv[..., 0], hsv[..., 1] // STEP, hsv[..., 2] // STEP), counts.shape[1:])
        for k, chosen in enumerate((mask, ~mask)):
            counts[k] += np.bincount(colour[chosen], minlength=counts[k].size).reshape(counts[k].shape)
    return counts[0], counts[1]


def _members(interval: tuple[int, int], n: int) -> Bool[np.ndarray, " n"]:
    """Which of n bins belong to an interval, that may go round."""
    low, high = interval
    i = np.arange(n)
    return (i >= low) & (i <= high) if low <= high else (i >= low) | (i <= high)


def _best_interval(
    inside: Integer[np.ndarray, " n"], outside: Integer[np.ndarray, " n"], total: int, circular: bool
) -> tuple[float, tuple[int, int]]:
    """The interval of bins [low, high] of best IoU, inside / (total + outside), the first one of equals."""
    n = len(inside)
    sums = [np.concatenate([[0], np.cumsum(counts)]) for counts in (inside, outside)]
    low, high = np.mgrid[:n, :n]
    hit, extra = (s[high + 1] - s[low] + np.where(high < low, s[n], 0) for s in sums)
    score = np.where((high >= low) | circular, hit / (total + extra), -1.0)
    best = int(score.argmax())
    return float(score.flat[best]), (best // n, best % n)


def things_on_table(table: Bool[np.ndarray, "H W"], min_pixels: int = 40) -> Bool[np.ndarray, "H W"]:
    """What stands on a table that only its colour tells: what is not of its colour, within the table's outline.

    The outline is the convex hull of the largest connected piece of `table`; pieces of fewer than `min_pixels` are
    dropped. All things are one class here: a colour range knows the table, not what stands on it.
    """
    table = check_shape("table", table, (None, None)).astype(np.uint8)
    things = np.zeros(table.shape, bool)
    count, pieces, stats, _ = cv2.connectedComponentsWithStats(table, connectivity=4)
    if count == 1:
        return things
    largest = 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax())
    outline = cv2.convexHull(cv2.findNonZero((pieces == largest).astype(np.uint8)))
    hull = cv2.fillConvexPoly(np.zeros_like(table), outline, 1)
    other = cv2.morphologyEx(hull & (1 - table), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    _, pieces, stats, _ = cv2.connectedComponentsWithStats(other, connectivity=4)
    kept = stats[:, cv2.CC_STAT_AREA] >= min_pixels
    kept[0] = False
    return kept[pieces]
