"""Spoilt depth: noise, holes at edges, and a camera that is not quite where it is said to be."""

import numpy as np
import pytest

from labkit.frame import RGBDFrame
from labkit.geometry.sensor import DepthSensor, StereoSensor, perturbed

K = np.array([[200.0, 0.0, 80.0], [0.0, 200.0, 5.0], [0.0, 0.0, 1.0]])


def frame_of(depth, T_base_cam=None) -> RGBDFrame:
    """A black frame with this depth."""
    depth, T = np.asarray(depth, np.float32), np.eye(4) if T_base_cam is None else T_base_cam
    return RGBDFrame(np.zeros((*depth.shape, 3), np.uint8), depth, K, T)


def seen_by(sensor, depth) -> np.ndarray:
    """What a sensor makes of a depth image."""
    return sensor.apply(frame_of(depth), np.random.default_rng(0)).depth


@pytest.mark.parametrize(
    ("sensor", "at_one_metre"),
    [
        (DepthSensor(noise=0.002, step=0.0, loss=0.0, edge_loss=0.0), 0.002),
        (StereoSensor(step=1e-6), 2 / 3 * 0.08 / (200.0 * 0.05)),  # of 0.08 pixels interpolation leaves two thirds
    ],
)
def test_the_noise_grows_with_the_square_of_depth(sensor, at_one_metre):
    half, one = (seen_by(sensor, np.full((300, 300), d)).std() for d in (0.5, 1.0))
    assert one == pytest.approx(at_one_metre, rel=0.05) and one / half == pytest.approx(4.0, rel=0.02)


def test_the_sensor_loses_pixels_at_edges():
    depth = np.ones((100, 100))
    depth[:, 50:] = 1.5
    seen = seen_by(DepthSensor(noise=0.0, step=0.0, edge_loss=1.0, loss=0.0), depth)
    assert (seen[:, 49:51] == 0).all() and (seen[:, :49] > 0).all() and (seen[:, 51:] > 0).all()


@pytest.mark.parametrize("seed", range(5))
def test_a_perturbed_frame_has_a_pose_that_is_off_by_what_it_says_and_a_sensors_depth(seed):
    T = np.eye(4)
    T[:3, :3] = [[0, -1, 0], [-1, 0, 0], [0, 0, -1]]
    frame = frame_of(np.ones((40, 40)), T)
    seen, again = (perturbed(frame, np.random.default_rng(seed), metres=0.01, degrees=2.0) for _ in range(2))
    E = np.linalg.inv(T) @ seen.T_base_cam
    assert np.linalg.norm(E[:3, 3]) == pytest.approx(0.01)
    assert np.degrees(np.arccos((np.trace(E[:3, :3]) - 1.0) / 2.0)) == pytest.approx(2.0)
    assert 0.0005 < np.abs(seen.depth[seen.depth > 0.0] - 1.0).mean() < 0.003
    assert np.array_equal(again.depth, seen.depth) and np.array_equal(again.T_base_cam, seen.T_base_cam)


def test_a_stereo_sensor_loses_what_its_right_camera_cannot_see():
    """Left of something nearer it is blind for as many pixels as the two disparities differ."""
    depth = np.full((10, 160), 1.0, np.float32)
    depth[:, 90:120] = 0.5  # disparities 10 and 20 pixels
    seen = seen_by(StereoSensor(noise=0.0), depth)
    assert (np.flatnonzero(seen[4] == 0.0) == np.arange(80, 90)).all()
    assert seen[seen > 0.0] == pytest.approx(depth[seen > 0.0])
