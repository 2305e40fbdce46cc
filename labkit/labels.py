"""Label images: which classes there are, one-hot tensors and back, and how labels are drawn (topic 01)."""

import numpy as np
from jaxtyping import Integer, Num, UInt8

from labkit.support.validation import (
    as_array,
    check_labels,
    check_rgb,
    check_same_size,
    check_shape,
    check_whole,
    require,
)

CLASSES = ("background", "surface", "target", "obstacle")
BACKGROUND, SURFACE, TARGET, OBSTACLE = range(4)
IGNORE = 255

# Colours that stay apart for colour-blind readers (Okabe and Ito's palette); background stays dark.
PALETTE = np.array([[40, 44, 52], [86, 180, 233], [230, 97, 0], [0, 158, 115]], dtype=np.uint8)
IGNORE_COLOUR = np.array([255, 255, 255], dtype=np.uint8)


def unknown_number(instances) -> int:
    """The number in an image of objects' numbers that says "nobody knows": the greatest of its type, 255 or 65535.

    instances: an array, or a tensor as an array. An image of more bits has none.

    >>> unknown_number(np.zeros((2, 2), np.uint8)), unknown_number(np.zeros((2, 2), np.uint16))
    (255, 65535)
    """
    return int(np.iinfo(instances.dtype).max)


def one_hot(y: Integer[np.ndarray, "*shape"], C: int = len(CLASSES)) -> UInt8[np.ndarray, "*shape C"]:
    """Turn labels into the one-hot tensor Y, with one more axis, of length C; an ignored pixel is all zeros.

    Raises ValueError if a label is neither in 0 .. C - 1 nor 255. Topic 01.

    >>> one_hot(np.array([[0, 2]]), 3)
    array([[[1, 0, 0], [0, 0, 1]]], dtype=uint8)
    """
    y = check_labels("y", y, check_whole("C", C, 1, IGNORE))
    return (y[..., None] == np.arange(C)).astype(np.uint8)


def from_one_hot(Y: Num[np.ndarray, "*shape C"]) -> UInt8[np.ndarray, "*shape"]:
    """Turn a one-hot tensor back into labels; all zeros become 255 (ignore).

    Raises ValueError if an entry is not 0 or 1, or a pixel has several classes. Topic 01.

    >>> from_one_hot(np.array([[1, 0], [0, 1], [0, 0]]))
    array([  0,   1, 255], dtype=uint8)
    """
    Y = as_array("Y", Y)
    if Y.ndim < 1 or not 1 <= Y.shape[-1] <= IGNORE:
        raise ValueError(f"Y: expected classes on its last axis, 1 to {IGNORE} of them, got shape {Y.shape}")
    if not np.isin(Y, (0, 1)).all():
        raise ValueError("Y: expected only 0 and 1; for probabilities use argmax over the last axis")
    count = Y.sum(axis=-1)
    most = int(count.max(initial=0))
    require("Y", most <= 1, "at most one class per pixel", f"a pixel with {most}")
    return np.where(count == 0, IGNORE, Y.argmax(axis=-1)).astype(np.uint8)


def colorize(y: Integer[np.ndarray, "H W"]) -> UInt8[np.ndarray, "H W 3"]:
    """Paint a label image in the kit's colours (RGB); ignored pixels are white.

    >>> colorize(np.array([[2]])).tolist()
    [[[230, 97, 0]]]
    """
    y = check_shape("y", check_labels("y", y, len(CLASSES)), (None, None))
    colours = np.vstack([PALETTE, IGNORE_COLOUR])
    return colours[np.where(y == IGNORE, len(PALETTE), y)]


def overlay(
    rgb: UInt8[np.ndarray, "H W 3"], y: Integer[np.ndarray, "H W"], alpha: float = 0.5
) -> UInt8[np.ndarray, "H W 3"]:
    """Lay the label colours over an image; `alpha` is the share of the label colour, background stays as it is.

    >>> overlay(np.full((1, 2, 3), 100, np.uint8), np.array([[0, 2]])).tolist()
    [[[100, 100, 100], [165, 98, 50]]]
    """
    rgb = check_rgb("rgb", rgb)
    colours = colorize(y)
    check_same_size("rgb", rgb, "y", colours)
    require("alpha", 0.0 <= alpha <= 1.0, "a share in 0..1", alpha)
    mixed = (1.0 - alpha) * rgb + alpha * colours
    return np.where((np.asarray(y) == BACKGROUND)[..., None], rgb, mixed).astype(np.uint8)
