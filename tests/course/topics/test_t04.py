"""The references of topic 04 against the kit's own scores, OpenCV, and counting again."""

import cv2
import numpy as np
import pytest
from references import assert_reference_is

from labkit import metrics


def merge_classes(n, group):
    """Counted again, pixel by pixel, with every label renamed."""
    y_true, y_pred = np.repeat(np.argwhere(n >= 0), n.ravel(), axis=0).T
    return metrics.confusion_matrix(group[y_true][None], group[y_pred][None], int(group.max()) + 1)


def trimap_band(y, width):
    """A pixel that was judged is in the band if some class other than its own, dilated, reaches it."""
    window = np.ones((2 * width + 1, 2 * width + 1), np.uint8)
    reached = {c: cv2.dilate((y == c).astype(np.uint8), window) > 0 for c in set(y.ravel().tolist()) - {255}}
    others = [reached[c] & (y != c) for c in reached]
    return np.any(others, axis=0) & (y != 255)


KIT = {
    "confusion_matrix": metrics.confusion_matrix,
    "iou": metrics.iou,
    "mean_iou": lambda n_frames: metrics.mean_iou(n_frames.sum(axis=0)),
    "merge_classes": merge_classes,
    "trimap_band": trimap_band,
}


@pytest.mark.parametrize("name", KIT)
def test_a_reference_gives_what_the_kit_gives(name):
    assert_reference_is(f"04_iou.{name}", KIT[name])
