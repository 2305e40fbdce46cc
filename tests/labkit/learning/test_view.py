"""The canonical view: each of its pixels shows what the picture shows there, however the camera is held."""

import numpy as np
import pytest

from labkit.frame import RGBDFrame
from labkit.geometry import back_project_to_base, invert_transform, project, transform_points
from labkit.learning import view as views
from labkit.learning.engines import open_engine
from labkit.learning.network import load_model, weights_path
from labkit.learning.view import PIXEL, canonical_view
from labkit.sim.spec import Camera

K = np.array([[230.0, 0.0, 83.2], [0.0, 221.0, 57.9], [0.0, 0.0, 1.0]])
QUARTER = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def frame_of(elevation=0.7, roll=0.0, distance=0.9, size=(120, 160), K=K, table_z=0.03) -> RGBDFrame:
    """A rough table of random colours, seen by a camera that is held somehow."""
    rng = np.random.default_rng(0)
    T = np.array(Camera.looking_at((0.5, 0.1, table_z), distance, 0.4, elevation, roll).T_base_cam)
    v, u = np.mgrid[: size[0], : size[1]]
    rays = np.dstack([u, v, np.ones(size)]) @ np.linalg.inv(K).T @ T[:3, :3].T
    depth = (table_z - T[2, 3]) / rays[..., 2] + rng.uniform(0.0, 0.01, size)
    depth[(rng.random(size) < 0.1) | (depth < 0.0) | (depth > 3.0)] = 0.0
    rgb = rng.integers(0, 256, (*size, 3), np.uint8)
    return RGBDFrame(rgb, depth.astype(np.float32), K, T, table_z=table_z)


def turned(frame: RGBDFrame, quarters: int) -> RGBDFrame:
    """What a camera sees that is turned about its axis by so many quarters; its picture turns counter-clockwise."""
    for _ in range(quarters):
        K_new, T = frame.K[[1, 0, 2]][:, [1, 0, 2]], frame.T_base_cam.copy()
        K_new[1, 2] = frame.size[0] - 1 - K_new[1, 2]
        T[:3, :3] = T[:3, :3] @ QUARTER
        rgb, depth = np.rot90(frame.rgb).copy(), np.rot90(frame.depth).copy()
        frame = RGBDFrame(rgb, depth, K_new, T, table_z=frame.table_z)
    return frame


@pytest.mark.parametrize("elevation", [0.3, 0.9, 1.45, np.pi / 2])
@pytest.mark.parametrize("roll", [0.0, 0.5, -2.0])
def test_quarter_turns_of_a_picture_have_the_very_same_view_and_turned_results(elevation, roll):
    frame = frame_of(elevation, roll)
    straight = canonical_view(frame)
    p = np.random.default_rng(1).random((*straight.frame.depth.shape, 6), np.float32)
    for quarters in (1, 2, 3):
        other = canonical_view(turned(frame, quarters))
        for name in ("rgb", "depth", "K", "T_base_cam"):
            np.testing.assert_array_equal(getattr(other.frame, name), getattr(straight.frame, name), name)
        np.testing.assert_array_equal(other.back(p), np.rot90(straight.back(p), quarters))


def test_a_network_labels_a_turned_picture_as_it_labels_the_straight_one():
    engine, frame = open_engine(load_model(weights_path("unet_rgbd"))), frame_of()
    for quarters in (1, 2, 3):
        np.testing.assert_array_equal(engine(turned(frame, quarters)), np.rot90(engine(frame), quarters))


@pytest.mark.parametrize("elevation", [0.3, 0.9, 1.5])
@pytest.mark.parametrize("roll", [0.2, 1.7, -2.6])
@pytest.mark.parametrize("distance", [0.25, 0.9, 2.0])
def test_each_pixel_of_the_view_is_where_its_camera_says(elevation, roll, distance):
    skewed = K + np.array([[0.0, 4.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    frame = frame_of(elevation, roll, distance, K=skewed)
    view = canonical_view(frame).frame
    P = back_project_to_base(view.depth, view.K, view.T_base_cam)[view.depth > 0.0]
    u, v = project(transform_points(invert_transform(frame.T_base_cam), P.astype(np.float64)), frame.K)
    nearest = np.round([v, u]).astype(int)
    sure = (np.abs(np.array([v, u]) - nearest) < 0.45).all(axis=0)  # between two pixels either may be taken
    assert sure.mean() > 0.7
    np.testing.assert_array_equal(view.depth[view.depth > 0.0][sure], frame.depth[tuple(nearest[:, sure])])


@pytest.mark.parametrize("elevation", [0.3, 0.9, 1.35])
@pytest.mark.parametrize("roll", [0.0, 0.5, -2.0, 3.1])
def test_base_z_points_up_in_the_view(elevation, roll):
    up = canonical_view(frame_of(elevation, roll)).frame.T_base_cam[2, :2]
    assert abs(up[0]) < 1e-12 and up[1] < 0.0


@pytest.mark.parametrize("roll", [0.0, 0.5, -2.0, 3.1])
def test_a_camera_that_looks_down_is_turned_by_the_nearest_quarter_and_no_more(roll):
    frame = frame_of(1.45, roll)
    view = canonical_view(frame)
    up = view.frame.T_base_cam[2, :2]
    assert up[1] <= -abs(up[0])
    M = view.to_turned[:, :2] / np.sqrt(abs(np.linalg.det(view.to_turned[:, :2])))
    assert max(abs(M[0, 1]), abs(M[1, 0])) < 1e-12


@pytest.mark.parametrize("distance", [0.3, 0.9, 1.1])
@pytest.mark.parametrize("size", [(60, 80), (240, 320)])
def test_the_median_pixel_covers_as_much_of_the_table_as_asked(distance, size):
    scaled = K * np.array([[size[1] / 160.0], [size[0] / 120.0], [1.0]])
    view = canonical_view(frame_of(0.9, 0.3, distance, size, scaled)).frame
    covered = np.median(view.depth[view.depth > 0.0]) / view.K[0, 0]
    assert covered == pytest.approx(PIXEL, rel=0.02)


def test_what_is_far_over_or_under_the_table_does_not_change_the_scale():
    frame = frame_of()
    depth = frame.depth.copy()
    depth[:, :100] = 5.0  # a hall behind the table
    seen = canonical_view(RGBDFrame(frame.rgb, depth, frame.K, frame.T_base_cam, table_z=frame.table_z)).frame
    assert seen.K[0, 0] == pytest.approx(canonical_view(frame).frame.K[0, 0], rel=0.1)


def test_a_view_is_bounded_in_size():
    near, far = (canonical_view(frame_of(distance=distance)).frame for distance in (0.02, 2.8))
    assert near.size[0] >= 160 * views.SCALES[0] and near.K[0, 0] >= views.SCALES[0] * 225.0
    assert far.depth.size <= 1.01 * views.MOST_PIXELS and far.K[0, 0] <= views.SCALES[1] * 226.0


@pytest.mark.parametrize("roll", [0.0, 0.6, 2.0])
def test_smooth_numbers_come_back_where_they_were(roll):
    frame = frame_of(0.8, roll)
    view = canonical_view(frame)
    v, u = np.mgrid[:120, :160]
    smooth = np.dstack([np.sin(u / 40.0), np.cos(v / 30.0), u / 160.0, v / 120.0, np.sin((u + v) / 50.0)])
    # What the view shows of a function of the picture's pixels: brute force, from the points and both cameras.
    h, w = view.frame.depth.shape
    there = np.stack([*np.meshgrid(np.arange(w), np.arange(h)), np.ones((h, w))], axis=-1) @ view.to_turned.T
    size = frame.size if view.turns % 2 == 0 else frame.size[::-1]
    for _ in range(view.turns):  # undo the turns, one by one
        size = size[::-1]
        there = np.stack([size[0] - 1 - there[..., 1], there[..., 0]], axis=-1)
    x, y = there[..., 0], there[..., 1]
    shown = np.dstack([np.sin(x / 40.0), np.cos(y / 30.0), x / 160.0, y / 120.0, np.sin((x + y) / 50.0)])
    np.testing.assert_allclose(view.back(shown.astype(np.float32)), smooth, atol=0.02)


def test_labels_come_along_and_are_ignored_beyond_the_picture():
    frame = frame_of(0.8, 0.6)
    labels = np.where(frame.depth > 0.0, 1, 0)
    seen = canonical_view(RGBDFrame(frame.rgb, frame.depth, frame.K, frame.T_base_cam, labels, table_z=0.03)).frame
    np.testing.assert_array_equal(seen.labels == 1, seen.depth > 0.0)
    assert set(np.unique(seen.labels)) == {0, 1, 255} and (seen.labels[0, [0, -1]] == 255).all()


@pytest.mark.parametrize("nothing", [0.0, np.nan])
def test_without_depth_there_is_no_view(nothing):
    frame = frame_of()
    depth = np.full_like(frame.depth, nothing)
    assert canonical_view(RGBDFrame(frame.rgb, depth, frame.K, frame.T_base_cam)) is None
