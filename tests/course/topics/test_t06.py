"""The references of topic 06 against the kit's geometry, OpenCV, resized pictures and a search for the best plane."""

import cv2
import numpy as np
import pytest
from references import drawn
from scipy.optimize import minimize

from labkit import geometry
from labkit.course.checker.run import judge
from labkit.course.topics import of_topic

QUESTIONS = of_topic("06_back_projection")
SEEDS = pytest.mark.parametrize("seed", range(5))


@SEEDS
def test_points_are_the_kits(seed):
    back_project, (depth, K) = drawn("06_back_projection.back_project", seed)
    np.testing.assert_allclose(back_project(depth, K), geometry.back_project(depth, K), rtol=1e-5)


@SEEDS
def test_the_lens_is_taken_back_as_opencv_does_it(seed):
    undistort, (pixels, K, k) = drawn("06_back_projection.undistort", seed)
    stop = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 200, 1e-12)
    expected = cv2.undistortPoints(pixels[:, None], K, np.array([*k, 0.0, 0.0]), P=K, criteria=stop)[:, 0]
    np.testing.assert_allclose(undistort(pixels, K, k), expected, atol=1e-6)


@SEEDS
def test_guessing_that_stops_too_early_is_refused(seed):
    def twelve_rounds(pixels, K, k):
        seen = ideal = (pixels - K[:2, 2]) / np.diagonal(K)[:2]
        for _ in range(12):
            r2 = (ideal**2).sum(axis=1, keepdims=True)
            ideal = seen / (1.0 + k[0] * r2 + k[1] * r2**2)
        return K[:2, 2] + np.diagonal(K)[:2] * ideal

    assert not judge(QUESTIONS["undistort"], twelve_rounds, seed).passed


@pytest.mark.parametrize("scale", [0.25, 0.5, 3.0])
def test_a_crop_is_resized_as_opencv_does_it(scale):
    """An image that holds each pixel's place says after cropping and resizing where each new pixel was."""
    K = np.array([[50.0, 0.0, 31.0], [0.0, 60.0, 20.0], [0.0, 0.0, 1.0]])
    v, u = np.mgrid[0:48, 0:64].astype(np.float64)
    cropped = np.dstack([u, v])[8:, 12:]
    how = cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR
    before = cv2.resize(cropped, None, fx=scale, fy=scale, interpolation=how)
    new = QUESTIONS["cropped_intrinsics"].reference(K, 12, 8, scale)
    row, column = 5, 6
    pixel = np.array([*before[row, column], 1.0])
    np.testing.assert_allclose(np.linalg.solve(new, [column, row, 1.0]), np.linalg.solve(K, pixel), atol=1e-6)


@SEEDS
def test_no_plane_fits_better(seed):
    fit_plane, (P, sigma) = drawn("06_back_projection.fit_plane", seed)
    n, d = fit_plane(P, sigma)

    def misfit(x):
        return np.sum(((P @ x[:3] - x[3]) / np.linalg.norm(x[:3]) / sigma) ** 2)

    best = minimize(misfit, [*n + 0.05, d + 0.05], tol=1e-12).x
    np.testing.assert_allclose([*n, d], best / np.linalg.norm(best[:3]), atol=1e-4)


@SEEDS
def test_the_height_noise_is_the_kits(seed):
    height_noise, (u, v, d, K, T_base_cam, sigma_pixel, sigma_depth) = drawn("06_back_projection.height_noise", seed)
    R = T_base_cam[:3, :3]
    Sigma = R @ geometry.back_projection_noise(u, v, d, K, sigma_pixel, sigma_depth) @ R.T
    assert height_noise(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth) == pytest.approx(np.sqrt(Sigma[2, 2]))


def test_the_height_noise_by_hand():
    """Looking down only depth counts; looking level a pixel down is d / fy, and depth lifts the point along its ray."""
    by_hand = [QUESTIONS["height_noise"].reference(*arguments) for arguments in QUESTIONS["height_noise"].by_hand]
    np.testing.assert_allclose(by_hand, [0.01, np.hypot(0.5 * 0.125, 0.25 * 0.01), 0.5 * 0.02], rtol=1e-12)
