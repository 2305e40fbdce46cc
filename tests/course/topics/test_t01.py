"""The references of topic 01 are the kit's own, OpenCV's and the simulator's."""

import cv2
import numpy as np
import pytest
from references import assert_reference_is

from labkit import labels, metrics
from labkit.course.topics import find


def class_shares(y, C):
    n = np.diagonal(metrics.confusion_matrix(y, np.where(y == 255, 0, y), C))
    return n / n.sum()


def resize_labels(y, height, width):
    return cv2.resize(y, (width, height), interpolation=cv2.INTER_NEAREST_EXACT)


@pytest.mark.parametrize("function", [labels.one_hot, class_shares, resize_labels])
def test_a_reference_gives_what_the_kit_or_opencv_gives(function):
    assert_reference_is(f"01_labels.{function.__name__}", function)


def test_colours_are_the_kits():
    y = np.random.default_rng(0).integers(0, 4, (5, 7)).astype(np.uint8)
    y[2, 3] = 255
    assert np.array_equal(find("01_labels.labels_from_colours").reference(labels.colorize(y), labels.PALETTE), y)
