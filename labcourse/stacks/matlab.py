"""What the MATLAB listing does before it makes a cloud: labels with scores, and a montage (topic 09)."""

import numpy as np
from jaxtyping import Bool, Float, UInt8

from labkit.learning.engines import open_engine
from labkit.support.validation import check_rgb, check_same_size, check_shape


def semanticseg(rgb: UInt8[np.ndarray, "H W 3"], net) -> tuple[UInt8[np.ndarray, "H W"], Float[np.ndarray, "H W"]]:
    """Label an image and say how sure the network is: the best class of each pixel, and its probability.

    net: a network, an engine or a function of the RGB image, as `labkit.learning.engines.open_engine` takes it.

    >>> labels, scores = semanticseg(np.zeros((1, 1, 3), np.uint8), lambda rgb: np.array([[[0.1, 0.7, 0.2]]]))
    >>> int(labels[0, 0]), float(scores[0, 0])
    (1, 0.7)
    """
    p = open_engine(net)(rgb)
    return p.argmax(axis=2).astype(np.uint8), p.max(axis=2)


def montage(rgb: UInt8[np.ndarray, "H W 3"], mask: Bool[np.ndarray, "H W"]) -> UInt8[np.ndarray, "H W2 3"]:
    """Put an image and its mask side by side, the mask in white on black, as imshowpair(..., "montage") does.

    >>> montage(np.zeros((2, 3, 3), np.uint8), np.ones((2, 3), bool)).shape
    (2, 6, 3)
    """
    check_same_size("rgb", check_rgb("rgb", rgb), "mask", check_shape("mask", mask, (None, None)))
    white = np.where(mask[..., None], 255, 0).astype(np.uint8)
    return np.hstack([rgb, np.repeat(white, 3, axis=2)])
