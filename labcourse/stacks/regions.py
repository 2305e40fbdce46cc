"""Segmentation without labels: k-means of colours, connected components, and the choice of one (topic 09)."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float64, Integer, UInt8
from scipy import ndimage
from scipy.cluster import vq

from labkit.support.validation import check_finite, check_rgb, check_shape, require

SAMPLE = 4096  # pixels that the means are found from; all pixels are then assigned to them


def kmeans(
    X: Float[np.ndarray, "N D"], k: int, seed: int = 0, iterations: int = 50
) -> tuple[Float64[np.ndarray, "k D"], Integer[np.ndarray, " N"]]:
    """Cluster points by Lloyd's algorithm from a k-means++ start; returns the means and each point's cluster.

    Raises ValueError for fewer than k different points.

    >>> means, labels = kmeans(np.array([[0.0], [1.0], [10.0]]), 2)
    >>> sorted(means.ravel().tolist()), bool(labels[0] == labels[1])
    ([0.5, 10.0], True)
    """
    X = check_finite("X", check_shape("X", X, (None, None))).astype(np.float64)
    if not 1 <= k <= len(np.unique(X, axis=0)):
        raise ValueError(f"k: expected 1 to {len(np.unique(X, axis=0))}, the number of different points, got {k}")
    means, _ = vq.kmeans2(X, k, iter=iterations, minit="++", missing="raise", rng=np.random.default_rng(seed))
    return means, vq.vq(X, means)[0]


def segment_kmeans(rgb: UInt8[np.ndarray, "H W 3"], k: int, seed: int = 0) -> UInt8[np.ndarray, "H W"]:
    """Split an image into k regions of similar colour, numbered from 0 by their size, largest first.

    Colours are compared in CIE L*a*b*, where distance is closer to what is seen; the means are found from a few
    thousand pixels. A region need not be connected: `components` takes it apart. Raises ValueError if the image has
    fewer than k colours among them. Topic 09.
    """
    lab = cv2.cvtColor(check_rgb("rgb", rgb).astype(np.float32) / 255.0, cv2.COLOR_RGB2Lab).reshape(-1, 3)
    means, _ = kmeans(lab[:: max(1, len(lab) // SAMPLE)], k, seed)
    regions = vq.vq(lab, means)[0]
    order = np.argsort(-np.bincount(regions, minlength=k), kind="stable")
    rank = np.empty(k, np.uint8)
    rank[order] = np.arange(k)
    return rank[regions].reshape(rgb.shape[:2])


def components(regions: Integer[np.ndarray, "H W"], connectivity: int = 4) -> Integer[np.ndarray, "H W"]:
    """Number the connected pieces of equal value from 1, in the order in which their first pixels are read.

    connectivity: 4 or 8 neighbours. Every pixel belongs to a piece; the value 0 is no background.

    >>> components(np.array([[5, 5, 0], [0, 5, 5]]))
    array([[1, 1, 2],
           [3, 1, 1]], dtype=int32)
    """
    regions = check_shape("regions", regions, (None, None))
    require("connectivity", connectivity in (4, 8), "4 or 8", repr(connectivity))
    pieces, structure = np.zeros(regions.shape, np.int32), ndimage.generate_binary_structure(2, connectivity // 4)
    for value in np.unique(regions):
        found, _ = ndimage.label(regions == value, structure)
        pieces += np.where(found > 0, found + pieces.max(), 0)
    _, first, pieces = np.unique(pieces, return_index=True, return_inverse=True)
    return (1 + first.argsort().argsort()[pieces]).astype(np.int32)


@dataclass(frozen=True, eq=False)
class Measurements:
    """Measures of pieces 1 to n, each an array of length n (row i is piece i + 1); pixels.

    area; centroid (u, v); box: first and last column and row, (u0, v0, u1, v1); extent: share of its box that a piece
    fills; elongation: ratio of the longer to the shorter axis of the ellipse with its second moments; at_border: it
    touches the image's edge, and may go on beyond.
    """

    area: Integer[np.ndarray, " n"]
    centroid: Float[np.ndarray, "n 2"]
    box: Integer[np.ndarray, "n 4"]
    extent: Float[np.ndarray, " n"]
    elongation: Float[np.ndarray, " n"]
    at_border: Bool[np.ndarray, " n"]

    def features(self) -> Float[np.ndarray, "n 3"]:
        """What a piece looks like wherever it lies: log area, log elongation, extent."""
        return np.stack([np.log(self.area), np.log(self.elongation), self.extent], axis=1)


def region_properties(pieces: Integer[np.ndarray, "H W"]) -> Measurements:
    """Measure the pieces of an image of `components`; pixels of value 0 belong to none.

    A pixel counts as a unit square, so a single one has an elongation of 1. Raises ValueError for a negative value or a
    number without a pixel.
    """
    pieces = check_shape("pieces", pieces, (None, None))
    if pieces.dtype.kind not in "iu" or (pieces.size and pieces.min() < 0):
        raise ValueError(f"pieces: expected integers of at least 0, got dtype {pieces.dtype}")
    H, W = pieces.shape
    flat = pieces.ravel().astype(np.int64)
    area = np.bincount(flat)[1:]
    if not area.all():
        raise ValueError(f"pieces: expected a pixel of each number up to {len(area)}, got none of {area.argmin() + 1}")
    v, u = (grid.ravel().astype(np.float64) for grid in np.mgrid[:H, :W])

    def mean(values):
        return np.bincount(flat, values, len(area) + 1)[1:] / area

    centroid = np.stack([mean(u), mean(v)], axis=1)
    uu, vv = mean(u * u) - centroid[:, 0] ** 2 + 1 / 12, mean(v * v) - centroid[:, 1] ** 2 + 1 / 12
    uv = mean(u * v) - centroid[:, 0] * centroid[:, 1]
    middle, radius = (uu + vv) / 2, np.hypot((uu - vv) / 2, uv)
    box = np.array([(u.start, v.start, u.stop - 1, v.stop - 1) for v, u in ndimage.find_objects(pieces)])
    box = box.reshape(-1, 4)
    sides = box[:, 2:] - box[:, :2] + 1
    return Measurements(
        area=area,
        centroid=centroid,
        box=box,
        extent=area / sides.prod(axis=1),
        elongation=np.sqrt((middle + radius) / np.maximum(middle - radius, 1 / 12)),
        at_border=(box[:, :2] == 0).any(axis=1) | (box[:, 2:] == (W - 1, H - 1)).any(axis=1),
    )


measure = region_properties  # its name in lab 09 of courses that began before 0.3


@dataclass(frozen=True, eq=False)
class Typical:
    """What the wanted pieces look like: mean and covariance of their features."""

    mean: Float64[np.ndarray, "3"]
    covariance: Float64[np.ndarray, "3 3"]


def learn_typical(masks: Sequence[Bool[np.ndarray, "H W"]]) -> Typical:
    """Learn what wanted pieces look like from true masks of one each; raises ValueError for fewer than five."""
    rows = [region_properties(mask.astype(np.int32)).features() for mask in masks if mask.any()]
    require("masks", len(rows) >= 5, "at least five with a pixel, to learn three features from", len(rows))
    features = np.concatenate(rows)
    return Typical(features.mean(axis=0), np.cov(features.T) + 1e-6 * np.eye(3))


def choose_region(measurements: Measurements, typical: Typical, allowed: Bool[np.ndarray, " n"]) -> int:
    """Select the piece that looks most like the wanted ones: least Mahalanobis distance; its number, 0 if none may be.

    allowed: which pieces may be chosen, such as `~measurements.at_border`. Topic 09.
    """
    allowed = check_shape("allowed", allowed, measurements.area.shape)
    if not allowed.any():
        return 0
    off = measurements.features() - typical.mean
    distance = np.einsum("ni,ij,nj->n", off, np.linalg.inv(typical.covariance), off)
    return 1 + int(np.where(allowed, distance, np.inf).argmin())


def colorize_regions(pieces: Integer[np.ndarray, "H W"]) -> UInt8[np.ndarray, "H W 3"]:
    """Paint pieces so that neighbours in number differ clearly: hues in steps of the golden angle; 0 is black (RGB).

    >>> colorize_regions(np.array([[0, 1]])).tolist()[0][0]
    [0, 0, 0]
    """
    pieces = check_shape("pieces", pieces, (None, None))
    numbers = np.arange(int(pieces.max(initial=0)) + 1)
    hsv = np.stack([(numbers * 137.508) % 360.0, 0.55 + 0.35 * (numbers % 2), 0.95 - 0.3 * (numbers % 3 == 2)], axis=1)
    hsv[0] = 0.0
    colours = cv2.cvtColor(hsv[None].astype(np.float32), cv2.COLOR_HSV2RGB)[0]
    return np.round(255.0 * colours).astype(np.uint8)[pieces]
