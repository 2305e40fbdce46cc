"""The explorers of 05_class_weights: boundaries and scores against sampling and counting, and controls that redraw."""

from itertools import pairwise

import numpy as np
import pytest
from scenes import random_frame

from labcourse.explorers import class_weights
from labkit.labels import TARGET
from labkit.losses import softmax, weighted_optimum


@pytest.mark.parametrize(("distance", "share", "weight"), [(2.0, 0.02, 1.0), (2.0, 0.02, 49.0), (1.0, 0.3, 0.5)])
def test_scores_of_the_gaussians_are_those_of_drawn_pixels(distance, share, weight):
    rng = np.random.default_rng(0)
    y = rng.random(400_000) < share
    x = rng.normal(size=y.size) + distance * y
    p = np.stack([(1 - share) * np.exp(-(x**2) / 2), share * np.exp(-((x - distance) ** 2) / 2)], axis=-1)
    p /= p.sum(axis=-1, keepdims=True)
    said = weighted_optimum(p, np.array([1.0, weight])).argmax(axis=-1) == 1
    boundary, precision, recall, overlap = class_weights.gaussian_scores(distance, share, np.array([weight]))
    np.testing.assert_array_equal(said, x > boundary)
    both = (said & y).sum()
    counted = [both / said.sum(), both / y.sum(), both / (said | y).sum()]
    np.testing.assert_allclose([precision[0], recall[0], overlap[0]], counted, atol=0.03)


@pytest.fixture
def scenes():
    """Two frames with random probabilities, different in size."""
    frames = {"first": random_frame(0, (12, 17)), "second": random_frame(1, (15, 9))}
    rng = np.random.default_rng(0)
    return {
        name: (f, softmax(rng.normal(size=(*f.labels.shape, 4)) + np.eye(4)[f.labels])) for name, f in frames.items()
    }


def test_weighing_a_networks_answers_only_adds_target_pixels(scenes):
    frame, p = scenes["first"]
    masks = [class_weights.reweighted(p, exponent) == TARGET for exponent in (-2.0, 0.0, 1.0, 5.0)]
    np.testing.assert_array_equal(masks[1], p.argmax(axis=-1) == TARGET)
    for small, large in pairwise(masks):
        assert (large >= small).all() and large.sum() > small.sum()
    truth = frame.labels == TARGET
    for exponent, mask in zip((-2.0, 0.0, 1.0, 5.0), masks, strict=True):
        both = (mask & truth).sum()
        expected = both / mask.sum(), both / truth.sum(), both / (mask | truth).sum()
        assert class_weights.target_scores(frame.labels, p, exponent) == pytest.approx(expected)
