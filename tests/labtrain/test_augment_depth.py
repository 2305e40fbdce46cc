"""Augmented RGB-D frames stay frames of one scene: what moved a pixel moved its colour, depth, label and camera."""

import numpy as np
import pytest
import torch

from labkit.frame import RGBDFrame
from labkit.geometry import back_project_to_base
from labkit.learning.channels import CHANNELS
from labkit.sim.spec import Camera
from labtrain.augment_depth import (
    augment_frames,
    correlated_noise,
    flying_pixels,
    random_calibration,
    random_sensor,
    random_size,
    random_view,
    stereo_shadow,
)

SIZE = (96, 128)
K = np.array([[260.0, 0.0, 80.0], [0.0, 260.0, 59.0], [0.0, 0.0, 1.0]])


def colour_of(P):
    """A colour that tells where on the table a point lies."""
    return np.dstack([128 + 300 * (P[..., 0] - 0.5), 128 + 300 * (P[..., 1] - 0.1), np.full(P.shape[:2], 50)])


@pytest.fixture(scope="module")
def view():
    """A table with its place painted on it, its far half labelled target."""
    T = np.array(Camera.looking_at((0.5, 0.1, 0.02), 0.9, 0.4, 0.8, 0.1).T_base_cam)
    v, u = np.mgrid[:120, :160]
    rays = np.dstack([u, v, np.ones(u.shape)]) @ np.linalg.inv(K).T @ T[:3, :3].T
    depth = ((0.02 - T[2, 3]) / rays[..., 2]).astype(np.float32)
    P = back_project_to_base(depth, K, T)
    y = np.where(P[..., 0] > 0.5, 2, 1).astype(np.uint8)
    return RGBDFrame(np.clip(colour_of(P), 0, 255).astype(np.uint8), depth, K, T, y, table_z=0.02)


def test_a_random_view_shows_the_same_scene(view):
    rng = np.random.default_rng(0)
    shares = []
    for _ in range(20):
        new = random_view(view, SIZE, rng)
        inside = new.depth > 0.0
        shares.append(inside.mean())
        P = back_project_to_base(new.depth, new.K, new.T_base_cam)
        # Nearest neighbours: a depth is that of a place half a pixel away, which is 4 mm along this slanted table.
        assert np.abs(P[inside, 2] - 0.02).max() < 0.004
        inner = inside & (P[..., 0] > 0.35) & (P[..., 0] < 0.65) & (abs(P[..., 1] - 0.1) < 0.15)
        assert np.abs(new.rgb[inner] - colour_of(P)[inner]).max() < 5.0
        sure = inside & (abs(P[..., 0] - 0.5) > 0.004)
        assert (new.labels[sure] == np.where(P[sure][:, 0] > 0.5, 2, 1)).all()
        assert (new.labels[~inside] == 255).all()
        assert np.allclose(new.T_base_cam[:3, :3].T @ new.T_base_cam[:3, :3], np.eye(3))
    assert min(shares) > 0.5 and np.mean(shares) > 0.85


def test_sensors_range_from_exact_to_blind(view):
    rng = np.random.default_rng(1)
    seen = [random_sensor(view.depth, rng) for _ in range(200)]
    exact = [np.array_equal(depth, view.depth) for depth in seen]
    blind = [not depth.any() for depth in seen]
    assert 0.12 < np.mean(exact) < 0.3 and 0.0 < np.mean(blind) < 0.08
    errors = [np.abs(d - view.depth)[d > 0.0].mean() for d, e, b in zip(seen, exact, blind, strict=True) if not e | b]
    assert 0.0005 < np.median(errors) < 0.003 and 0.003 < max(errors) < 0.009
    assert all(depth.shape == view.depth.shape and depth.dtype == np.float32 for depth in seen)


def test_noise_is_up_to_4_mm_at_1_m_and_neighbours_have_it_in_common():
    rng = np.random.default_rng(5)
    fields = [correlated_noise((120, 160), rng) for _ in range(60)]
    spread = np.array([field.std() for field in fields])
    assert spread.max() < 0.00401 and spread.min() < 0.001 and spread.mean() == pytest.approx(0.002, abs=0.0004)
    steps = np.array([np.diff(field, axis=1).std() for field in fields]) / spread
    assert steps.max() < 1.0 < np.sqrt(2.0), "independent pixels differ by sqrt(2) standard deviations"
    assert steps.min() < 0.2, "some errors reach over many pixels"


def test_a_stereo_camera_is_blind_behind_things_on_the_side_away_from_its_second_eye():
    depth = np.full((60, 80), 1.0, np.float32)
    depth[20:40, 30:50] = 0.8
    sides = set()
    for seed in range(40):
        hidden = stereo_shadow(depth, np.random.default_rng(seed))
        rows, columns = np.nonzero(hidden)
        beside = [columns < 30, columns >= 50, rows < 20, rows >= 40]
        names = ("left", "right", "above", "below")
        side = next(name for name, there in zip(names, beside, strict=True) if there.all())
        sides.add(side)
        inside = (rows >= 20) & (rows < 40) if side in ("left", "right") else (columns >= 30) & (columns < 50)
        assert inside.all()
        # Disparity D at 1 m is D / 0.8 at 0.8 m: D / 4 pixels lie in the shadow.
        assert 8 / 4 - 1 <= len(rows) / 20 <= 40 / 4 + 1
    assert len(sides) == 4
    assert not stereo_shadow(np.full((6, 8), 1.0, np.float32), np.random.default_rng(0)).any()


def test_flying_pixels_hang_between_the_two_sides_of_a_jump():
    depth = np.full((40, 50), 1.0, np.float32)
    depth[:, 25:], depth[:3] = 0.7, 0.0
    seen = flying_pixels(depth, np.random.default_rng(0))
    moved = np.nonzero(seen != depth)
    assert 10 < len(moved[0]) < 74 and set(moved[1]) == {24, 25}
    assert (seen[moved] > 0.7).all() and (seen[moved] < 1.0).all() and not seen[:3].any()


def test_calibrations_are_off_by_about_a_centimetre_a_degree_and_half_a_centimetre(view):
    rng = np.random.default_rng(2)
    moves, turns, heights = [], [], []
    for _ in range(400):
        seen = random_calibration(view, rng)
        E = np.linalg.inv(view.T_base_cam) @ seen.T_base_cam
        moves.append(np.linalg.norm(E[:3, 3]))
        turns.append(np.degrees(np.arccos(np.clip((np.trace(E[:3, :3]) - 1) / 2, -1, 1))))
        heights.append(seen.table_z - view.table_z)
    rms = [float(np.sqrt(np.mean(np.square(x)))) for x in (moves, turns, heights)]
    assert 0.008 < rms[0] < 0.012 and 0.7 < rms[1] < 1.1 and 0.004 < rms[2] < 0.006
    assert np.mean(np.array(moves) < 1e-9) == pytest.approx(0.2, abs=0.06)


def test_another_size_is_the_same_scene_in_other_metres(view):
    rng = np.random.default_rng(4)
    for _ in range(5):
        new = random_size(view, rng)
        factor = float(new.depth[0, 0] / view.depth[0, 0])
        P, Q = (back_project_to_base(f.depth, f.K, f.T_base_cam) for f in (view, new))
        np.testing.assert_allclose(Q, factor * (P - (0.0, 0.0, 0.02)), atol=1e-5)
        assert new.table_z == 0.0 and 0.85 < factor < 1.15


def test_a_batch_is_a_function_of_its_generator_and_lies_in_its_range(view):
    batches = [augment_frames([view] * 6, SIZE, torch.Generator().manual_seed(seed)) for seed in (3, 3, 4)]
    first, again, other = batches
    assert all(torch.equal(a, b) for a, b in zip(first, again, strict=True)) and not torch.equal(first[0], other[0])
    x, geometry, y, instances = first
    assert (instances == 255).all()  # nobody knows them
    assert x.shape == (6, 3, *SIZE) and geometry.shape == (6, len(CHANNELS), *SIZE) and y.shape == (6, *SIZE)
    assert all(array.min() >= 0.0 and array.max() <= 1.0 for array in (x, geometry))
    assert set(y.unique().tolist()) <= {1, 2, 255}
    known = geometry[:, CHANNELS.index("known")] == 1.0
    height = 0.25 * (2.0 * geometry[:, CHANNELS.index("height")] - 1.0)
    assert known.any() and height[known].abs().median() < 0.03  # the table, by a calibration that is off
    assert (geometry.permute(0, 2, 3, 1)[~known] == 0.5).all()
