"""Spoilt depth: noise, holes at edges, and a camera that is not quite where it is said to be."""

import numpy as np
import pytest

from labkit.frame import RGBDFrame
from labkit.geometry.sensor import DepthSensor, StereoSensor, perturbed


def test_the_sensors_noise_grows_with_the_square_of_depth():
    sensor = DepthSensor(noise=0.002, step=0.0, loss=0.0, edge_loss=0.0)
    K, rgb = np.diag([50.0, 50.0, 1.0]), np.zeros((200, 200, 3), np.uint8)
    spread = []
    for d in (1.0, 2.0):
        frame = RGBDFrame(rgb, np.full((200, 200), d, np.float32), K, np.eye(4))
        spread.append(sensor.apply(frame, np.random.default_rng(0)).depth.std())
    assert np.isclose(spread[0], 0.002, rtol=0.05) and np.isclose(spread[1] / spread[0], 4.0, rtol=0.05)


def test_the_sensor_loses_pixels_at_edges():
    depth = np.ones((100, 100), np.float32)
    depth[:, 50:] = 1.5
    frame = RGBDFrame(np.zeros((100, 100, 3), np.uint8), depth, np.diag([50.0, 50.0, 1.0]), np.eye(4))
    seen = DepthSensor(noise=0.0, step=0.0, edge_loss=1.0, loss=0.0).apply(frame, np.random.default_rng(0)).depth
    assert (seen[:, 49:51] == 0).all() and (seen[:, :49] > 0).all() and (seen[:, 51:] > 0).all()


@pytest.mark.parametrize("seed", range(5))
def test_a_perturbed_frame_has_a_pose_that_is_off_by_what_it_says_and_a_sensors_depth(seed):
    T = np.eye(4)
    T[:3, :3] = [[0, -1, 0], [-1, 0, 0], [0, 0, -1]]
    frame = RGBDFrame(np.zeros((40, 40, 3), np.uint8), np.ones((40, 40), np.float32), np.diag([50.0, 50.0, 1.0]), T)
    seen = perturbed(frame, np.random.default_rng(seed), metres=0.01, degrees=2.0)
    E = np.linalg.inv(T) @ seen.T_base_cam
    assert np.linalg.norm(E[:3, 3]) == pytest.approx(0.01)
    assert np.degrees(np.arccos((np.trace(E[:3, :3]) - 1.0) / 2.0)) == pytest.approx(2.0)
    assert 0.0005 < np.abs(seen.depth[seen.depth > 0.0] - 1.0).mean() < 0.003
    again = perturbed(frame, np.random.default_rng(seed), metres=0.01, degrees=2.0)
    assert np.array_equal(again.depth, seen.depth) and np.array_equal(again.T_base_cam, seen.T_base_cam)


def test_a_stereo_sensor_loses_what_its_right_camera_cannot_see():
    """Left of something nearer it is blind for as many pixels as the two disparities differ."""
    K = np.array([[200.0, 0.0, 80.0], [0.0, 200.0, 5.0], [0.0, 0.0, 1.0]])
    depth = np.full((10, 160), 1.0, np.float32)
    depth[:, 90:120] = 0.5  # disparities 10 and 20 pixels
    frame = RGBDFrame(np.zeros((10, 160, 3), np.uint8), depth, K, np.eye(4))
    seen = StereoSensor(noise=0.0).apply(frame, np.random.default_rng(0)).depth
    assert (np.flatnonzero(seen[4] == 0.0) == np.arange(80, 90)).all()
    assert seen[seen > 0.0] == pytest.approx(depth[seen > 0.0])


def test_a_stereo_sensor_errs_with_the_square_of_depth():
    K = np.array([[200.0, 0.0, 80.0], [0.0, 200.0, 5.0], [0.0, 0.0, 1.0]])
    errors = []
    for d in (0.5, 1.0):
        frame = RGBDFrame(np.zeros((300, 300, 3), np.uint8), np.full((300, 300), d, np.float32), K, np.eye(4))
        errors.append(np.std(StereoSensor(step=1e-6).apply(frame, np.random.default_rng(0)).depth))
    assert errors[1] / errors[0] == pytest.approx(4.0, rel=0.02)
