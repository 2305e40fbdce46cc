"""The references of 09_other_stacks are the kit's functions, or OpenCV's."""

import cv2
import numpy as np
import pytest

from labkit.course.questions import t09_other_stacks as t09
from labkit.course.questions import t09_regions
from labkit.course.questions.question import of_topic
from labkit.stacks import regions
from labkit.stacks.engines import labels_of_scores
from labkit.stacks.threshold import HSVRange, hsv_mask

SEEDS = pytest.mark.parametrize("seed", range(4))


def draw(question, seed):
    return question.inputs(np.random.default_rng(seed))


@SEEDS
def test_the_blob_is_opencvs(seed):
    (bgr,) = draw(t09.MAKE_BLOB, seed)
    np.testing.assert_allclose(t09.make_blob(bgr), cv2.dnn.blobFromImage(bgr, 1 / 255, swapRB=True), atol=1e-6)
    assert t09.make_blob(bgr).dtype == np.float32


@SEEDS
def test_the_labels_are_the_kits(seed):
    (scores,) = draw(t09.LABELS_FROM_BLOB, seed)
    np.testing.assert_array_equal(t09.labels_from_blob(scores), labels_of_scores(scores))


@SEEDS
def test_the_nearest_pixel_is_opencvs(seed):
    labels, size = draw(t09.ENLARGE, seed)
    np.testing.assert_array_equal(t09.enlarge(labels, size), cv2.resize(labels, size, interpolation=cv2.INTER_NEAREST))


def test_a_whole_mask_is_enlarged_as_opencv_does():
    labels = np.random.default_rng(0).integers(0, 4, (240, 320)).astype(np.uint8)
    expected = cv2.resize(labels, (640, 480), interpolation=cv2.INTER_NEAREST)
    np.testing.assert_array_equal(t09.enlarge(labels, (640, 480)), expected)


@SEEDS
def test_the_mask_of_colours_is_the_kits(seed):
    rgb = np.random.default_rng(seed).integers(0, 256, (11, 17, 3), dtype=np.uint8)
    _, lower, upper = draw(t09_regions.HSV_MASK, seed)
    found = t09_regions.hsv_mask(cv2.cvtColor(rgb, cv2.COLOR_RGB2HSV), lower, upper)
    np.testing.assert_array_equal(found, hsv_mask(rgb, HSVRange(tuple(lower.tolist()), tuple(upper.tolist()))))


@SEEDS
def test_the_measures_and_the_choice_are_the_kits(seed):
    (pieces,) = draw(t09_regions.MEASURE_PIECES, seed)
    area, centroid, box = t09_regions.measure_pieces(pieces)
    kits = regions.measure(pieces)
    np.testing.assert_array_equal(area, kits.area)
    np.testing.assert_allclose(centroid, kits.centroid)
    np.testing.assert_array_equal(box, kits.box)
    features, rng = kits.features(), np.random.default_rng(seed)
    typical = regions.Typical(features.mean(axis=0), np.cov(features.T) + 0.1 * np.eye(3))
    allowed = rng.random(len(area)) < 0.6
    chosen = t09_regions.choose_region(features, typical.mean, typical.covariance, allowed)
    assert chosen == regions.choose_region(kits, typical, allowed)


def test_the_topic_has_its_questions():
    questions = of_topic("09_other_stacks")
    assert 3 <= len(questions) <= 6
    for question in questions.values():
        assert len(question.misconceptions) >= 5 and len(question.alternatives) >= 3
