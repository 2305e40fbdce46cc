"""Ways in which a mask goes wrong, at a strength: what a mask's error costs is measured with them.

A mask is bool (H, W). Every function gives a new one; the truth is left as it is.
"""

import cv2
import numpy as np
from jaxtyping import Bool

from labkit.support.validation import check_shape, require


def erode(mask: Bool[np.ndarray, "H W"], pixels: int) -> Bool[np.ndarray, "H W"]:
    """Take away what lies within `pixels` of the mask's edge: the mask of a network that is too careful.

    What the image's border cuts off is no edge. Raises ValueError if mask is no mask, or pixels is negative.

    >>> erode(np.ones((1, 5), bool), 1), erode(np.array([[0, 1, 1, 1, 0]], bool), 1)
    (array([[ True,  True,  True,  True,  True]]), array([[False, False,  True, False, False]]))
    """
    return ~dilate(~_check_mask(mask), pixels)


def dilate(mask: Bool[np.ndarray, "H W"], pixels: int) -> Bool[np.ndarray, "H W"]:
    """Add what lies within `pixels` of the mask: the mask of a network that bleeds over the edge.

    Raises ValueError if mask is no mask, or pixels is negative.

    >>> dilate(np.array([[0, 0, 1, 0, 0]], bool), 1).astype(int)
    array([[0, 1, 1, 1, 0]])
    """
    require("pixels", pixels >= 0, "0 or more", pixels)
    reach = np.arange(-pixels, pixels + 1)
    disc = (reach**2 + reach[:, None] ** 2 <= pixels**2).astype(np.uint8)
    return cv2.dilate(_check_mask(mask).astype(np.uint8), disc).astype(bool)


def shift(mask: Bool[np.ndarray, "H W"], right: int, down: int) -> Bool[np.ndarray, "H W"]:
    """Move the mask by whole pixels: labels that come late, or of another camera. What leaves the image is lost.

    >>> shift(np.array([[1, 0, 1], [0, 0, 0]], bool), right=1, down=1).astype(int)
    array([[0, 0, 0], [0, 1, 0]])
    """
    mask = _check_mask(mask)
    moved = np.zeros_like(mask)
    v, u = np.nonzero(mask)
    v, u = v + down, u + right
    inside = (v >= 0) & (v < mask.shape[0]) & (u >= 0) & (u < mask.shape[1])
    moved[v[inside], u[inside]] = True
    return moved


def holes(mask: Bool[np.ndarray, "H W"], share: float, rng: np.random.Generator) -> Bool[np.ndarray, "H W"]:
    """Punch round holes at random places until at least `share` of the mask's pixels are gone.

    A hole is about a twentieth of the mask. Raises ValueError if mask is no mask, or share is not in 0..1.

    >>> mask = np.ones((40, 50), bool)
    >>> bool(0.5 <= 1.0 - holes(mask, 0.5, np.random.default_rng(0)).mean() < 0.56)
    True
    """
    left, area = _check_mask(mask).copy(), int(mask.sum())
    v, u = np.nonzero(mask)
    rows, columns = np.indices(mask.shape)
    while area - left.sum() < _check_share(share) * area:
        middle = rng.integers(area)
        left &= (rows - v[middle]) ** 2 + (columns - u[middle]) ** 2 > area / 20 / np.pi
    return left


def cut(mask: Bool[np.ndarray, "H W"], share: float, direction: float) -> Bool[np.ndarray, "H W"]:
    """Cut off `share` of the mask's pixels by a straight line: a part of the object is taken for something else.

    direction: the side that is lost, radians from right (0) over down (pi / 2). Of pixels that lie equally far the
    later ones go first. Raises ValueError if mask is no mask, or share is not in 0..1.

    >>> cut(np.ones((2, 4), bool), 0.5, 0.0).astype(int)
    array([[1, 1, 0, 0], [1, 1, 0, 0]])
    """
    left = _check_mask(mask).copy()
    v, u = np.nonzero(mask)
    lost = round(_check_share(share) * len(u))
    order = np.argsort(u * np.cos(direction) + v * np.sin(direction), kind="stable")[len(u) - lost :]
    left[v[order], u[order]] = False
    return left


def _check_mask(mask) -> Bool[np.ndarray, "H W"]:
    mask = check_shape("mask", mask, (None, None))
    require("mask", mask.dtype == bool, "bool", f"dtype {mask.dtype}")
    return mask


def _check_share(share: float) -> float:
    require("share", 0.0 <= share <= 1.0, "a share in 0..1", share)
    return share
