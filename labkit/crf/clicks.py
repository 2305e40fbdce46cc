"""Clicks that part a thing: an exact cut between pixels that are of it and pixels that are not (topic 02).

A network that takes a can on a can for one thing has both in one mask. Each pixel of the mask is near some click, by
ways on which every change of colour and every bend and step of the surface makes a pixel longer: that is its unary
term. The pairwise term lets the seam run where there are such changes. Of two classes a minimum cut is the best
labelling there is.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, Integer, UInt8
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from labkit.crf.energy import OFFSETS, PottsCRF, pair_slices
from labkit.crf.exact import min_cut
from labkit.support.validation import check_pixel, check_rgb, check_shape, require

SMOOTH = 1.0, 2.5  # pixels: standard deviations of the Gaussians that smooth a surface, and its normals
FAR = 1e6  # a way that there is not
LAM = 8.0  # of the pairwise term; the unary term is 0 to 1
# A change that makes a step a pixel longer, and the scale of the pairwise term: of colours, of metres off the plane
# of the neighbour, of radians between normals.
LONGER, SIGMA = (3.0, 0.003, 0.04), (20.0, 0.008, 0.1)


def cut_between(
    mask: Bool[np.ndarray, "H W"],
    rgb: UInt8[np.ndarray, "H W 3"],
    points: Float[np.ndarray, "H W 3"],
    inside: Sequence[tuple[int, int]],
    outside: Sequence[tuple[int, int]],
) -> Bool[np.ndarray, "H W"]:
    """Part a mask: the pixels of it that belong to the clicks `inside`, rather than to those `outside`.

    mask: of what is one thing so far. points: what each pixel shows, metres, in any frame, NaN without depth. inside,
    outside: pixels (u, v) of the mask, at least one of each. Raises ValueError for a click that is not on the mask or
    is of both kinds.

    >>> rgb, (v, u) = np.zeros((8, 20, 3), np.uint8), np.mgrid[:8, :20] / 100.0
    >>> rgb[:, 12:] = 200
    >>> part = cut_between(np.ones((8, 20), bool), rgb, np.stack([u, v, 0 * u], axis=-1), [(2, 4)], [(18, 4)])
    >>> part.sum(axis=0).tolist()
    [8, 8, 8, 8, 8, 8, 8, 8, 8, 8, 8, 8, 0, 0, 0, 0, 0, 0, 0, 0]
    """
    mask = check_shape("mask", mask, (None, None)).astype(bool)
    rgb = check_rgb("rgb", check_shape("rgb", rgb, (*mask.shape, 3)))
    points = check_shape("points", points, (*mask.shape, 3))
    clicks = [places_on(mask, name, many) for name, many in (("inside", inside), ("outside", outside))]
    twice = set(zip(*clicks[0], strict=True)) & set(zip(*clicks[1], strict=True))
    require("outside", not twice, "other pixels than inside", sorted((int(u), int(v)) for v, u in twice))
    v, u = np.nonzero(mask)
    box = np.s_[v.min() : v.max() + 1, u.min() : u.max() + 1]
    clicks = [(down - v.min(), right - u.min()) for down, right in clicks]
    here = mask[box]
    pairs = [_pairs(offset, here, rgb[box].astype(np.float64), *surface(points[box], here)) for offset in OFFSETS[8]]
    ways = np.stack([_ways(here, pairs, places) for places in clicks], axis=-1)
    psi = ways / np.maximum(ways.sum(axis=-1, keepdims=True), 1e-9)
    psi[~here] = 0.0
    weights = np.zeros((len(pairs), *here.shape))
    for w, pair in zip(weights, pairs, strict=True):
        w[pair.p] = np.where(pair.steps, LAM * np.exp(-0.5 * (pair.length**2 + pair.changes(SIGMA))), 0.0)
    for k, places in enumerate(clicks):
        psi[(*places, 1 - k)] = np.inf
    part = np.zeros(mask.shape, bool)
    part[box] = here & (min_cut(PottsCRF(psi, weights)).labels == 0)
    return part


def places_on(mask: Bool[np.ndarray, "H W"], name: str, clicks) -> tuple[Integer[np.ndarray, "n"], ...]:
    """Rows and columns of clicks (u, v); raises ValueError that calls them `name` for none, or one off the mask."""
    require(name, len(clicks) > 0, "at least one click", "none")
    pixels = [check_pixel(name, click, mask.shape[::-1]) for click in clicks]
    off = [pixel for pixel in pixels if not mask[pixel[1], pixel[0]]]
    require(name, not off, "pixels of the mask", off)
    u, v = np.array(pixels).T
    return v, u


def surface(points: Float[np.ndarray, "h w 3"], mask: Bool[np.ndarray, "h w"]):
    """The points of a mask, smoothed, and the surface's unit normals there: each (h, w, 3), NaN without depth."""
    known = mask & np.isfinite(points).all(axis=-1)
    middle = points[known].mean(axis=0, dtype=np.float64) if known.any() else np.zeros(3)  # float32 keeps millimetres
    P = np.where(known[..., None], points - middle, 0.0).astype(np.float32)
    near, wide = (
        cv2.GaussianBlur(P, (0, 0), sigma)
        / np.maximum(cv2.GaussianBlur(known.astype(np.float32), (0, 0), sigma), 1e-6)[..., None]
        for sigma in SMOOTH
    )
    down, right = (np.gradient(wide, axis=axis) if P.shape[axis] > 1 else np.zeros_like(P) for axis in (0, 1))
    normals = np.cross(right, down)
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-9)
    return np.where(known[..., None], near, np.nan), np.where(known[..., None], normals, np.nan)


@dataclass(frozen=True, eq=False)
class Pairs:
    """Pairs of neighbours: p and q, slices of an image; which are both of the mask; their distance; what changes."""

    p: tuple[slice, slice]
    q: tuple[slice, slice]
    steps: Bool[np.ndarray, "_ _"]
    length: float
    between: tuple[Float[np.ndarray, "_ _"], ...]

    def changes(self, scales: Sequence[float]) -> Float[np.ndarray, "_ _"]:
        """The sum of squares of colour's change, the step off the plane and the bend, each in its own scale."""
        return sum((change / scale) ** 2 for change, scale in zip(self.between, scales, strict=True))


def _pairs(offset: tuple[int, int], mask, colours, P, normals) -> Pairs:
    """The pairs one offset apart. What has no depth neither steps nor bends."""
    p, q = pair_slices(offset)
    ahead = P[q] - P[p]
    off = np.maximum(*(np.abs((ahead * normals[end]).sum(axis=-1)) for end in (p, q)))
    bend = np.linalg.norm(normals[q] - normals[p], axis=-1)
    between = np.linalg.norm(colours[q] - colours[p], axis=-1), np.nan_to_num(off), np.nan_to_num(bend)
    return Pairs(p, q, mask[p] & mask[q], float(np.hypot(*offset)), between)


def _ways(mask: Bool[np.ndarray, "h w"], pairs: Sequence[Pairs], places) -> Float[np.ndarray, "h w"]:
    """How far each pixel of a mask is from the nearest of some, on ways within the mask; FAR where none leads."""
    number = np.cumsum(mask).reshape(mask.shape) - 1
    steps = [pair.length * (1.0 + np.sqrt(pair.changes(LONGER)))[pair.steps] for pair in pairs]
    ends = [np.concatenate([number[end(pair)][pair.steps] for pair in pairs]) for end in (lambda x: x.p, lambda x: x.q)]
    size = np.count_nonzero(mask)
    graph = coo_array((np.concatenate(steps), tuple(ends)), shape=(size, size)).tocsr()
    away = dijkstra(graph, directed=False, indices=number[places], min_only=True)
    ways = np.full(mask.shape, FAR)
    ways[mask] = np.minimum(away, FAR)
    return ways
