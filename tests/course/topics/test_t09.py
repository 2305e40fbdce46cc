"""The references of 09_other_stacks are OpenCV's, PyTorch's, SciPy's or the kit's functions; and a contract holds."""

import cv2
import numpy as np
import pytest
import torch
from references import drawn
from scipy.spatial.distance import mahalanobis

from labkit.course.topics import find
from labkit.stacks import regions
from labkit.stacks.threshold import HSVRange
from labkit.stacks.threshold import hsv_mask as kits_hsv_mask

SEEDS = pytest.mark.parametrize("seed", range(4))


@SEEDS
def test_a_blob_is_opencvs_of_the_padded_image(seed):
    make_blob, (bgr, multiple) = drawn("09_other_stacks.make_blob", seed)
    blob = make_blob(bgr, multiple)
    H, W = blob.shape[2:]
    padded = cv2.copyMakeBorder(bgr, 0, H - bgr.shape[0], 0, W - bgr.shape[1], cv2.BORDER_CONSTANT, value=(0, 0, 0))
    np.testing.assert_allclose(blob, cv2.dnn.blobFromImage(padded, 1 / 255, swapRB=True), atol=1e-6)
    assert H % multiple == W % multiple == 0 and bgr.shape[0] + multiple > H and bgr.shape[1] + multiple > W


@SEEDS
def test_a_label_image_is_enlarged_as_by_pytorchs_exact_nearest(seed):
    enlarge, (labels, (W, H)) = drawn("09_other_stacks.enlarge", seed)
    image = torch.from_numpy(labels.astype(float))[None, None]
    expected = torch.nn.functional.interpolate(image, (H, W), mode="nearest-exact")[0, 0]
    assert np.array_equal(enlarge(labels, (W, H)), expected)


@SEEDS
def test_a_label_changes_only_where_the_contract_says_that_it_may(seed):
    """For engines that keep to it; and some that keep to it change a label of a margin of nearly two tolerances."""
    engine_contract, rng = find("09_other_stacks.engine_contract").reference, np.random.default_rng(seed)
    reference = rng.normal(size=(4, 30, 40)).astype(np.float32)
    other = reference + rng.choice([-0.25, 0.25], reference.shape).astype(np.float32)
    kept, changed, at_risk = engine_contract(reference, other, 0.25 + 1e-6)
    assert kept and 0.0 < changed <= at_risk < 0.6
    z = np.sort(reference, axis=0)
    assert (z[-1] - z[-2])[reference.argmax(axis=0) != other.argmax(axis=0)].max() > 0.4
    assert not engine_contract(reference, other, 0.24)[0]


@SEEDS
def test_a_range_of_colours_is_the_kits(seed):
    hsv_mask, (hsv, lower, upper) = drawn("09_other_stacks.hsv_mask", seed)
    bounds = HSVRange(tuple(lower.tolist()), tuple(upper.tolist()))
    rgb = cv2.cvtColor(hsv, cv2.COLOR_HSV2RGB)
    again = cv2.cvtColor(rgb, cv2.COLOR_RGB2HSV)
    assert np.array_equal(hsv_mask(again, lower, upper), kits_hsv_mask(rgb, bounds))


@SEEDS
def test_pieces_are_measured_as_by_the_kit(seed):
    measure_pieces, (pieces,) = drawn("09_other_stacks.measure_pieces", seed)
    area, centroid, _ = measure_pieces(pieces)
    kits = regions.measure(pieces)
    assert np.array_equal(area, kits.area) and np.allclose(centroid, kits.centroid)


@SEEDS
def test_the_chosen_piece_is_the_nearest_by_scipys_distance(seed):
    choose_region, (features, mean, covariance, allowed) = drawn("09_other_stacks.choose_region", seed)
    far = [
        mahalanobis(f, mean, np.linalg.inv(covariance)) if a else np.inf for f, a in zip(features, allowed, strict=True)
    ]
    assert choose_region(features, mean, covariance, allowed) == 1 + np.argmin(far)
