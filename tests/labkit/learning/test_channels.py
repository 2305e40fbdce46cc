"""What a network sees of depth: planes, spheres and brute force say what each channel must be."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from labkit.geometry import back_project_to_base
from labkit.learning.channels import CHANNELS, FOOTPRINT, HEIGHTS, geometry_channels, mirrored
from labkit.sim.spec import Camera

K = np.array([[310.0, 0.0, 81.0], [0.0, 300.0, 58.0], [0.0, 0.0, 1.0]])
SIZE = (120, 160)
INSIDE = np.s_[3:-3, 3:-3]  # where the 5 x 5 window of the normal is whole


def pose(elevation=0.7, azimuth=0.4, roll=0.2, distance=0.9):
    camera = Camera.looking_at((0.5, 0.1, 0.05), distance, azimuth, elevation, roll)
    return np.array(camera.T_base_cam)


def depth_of_plane(T_base_cam, normal, point):
    """Depth at which each pixel's ray meets a plane of the base frame."""
    v, u = np.mgrid[: SIZE[0], : SIZE[1]]
    rays = np.dstack([u, v, np.ones(SIZE)]) @ np.linalg.inv(K).T @ T_base_cam[:3, :3].T
    return ((point - T_base_cam[:3, 3]) @ normal) / (rays @ normal)


def channel(g, name):
    return g[..., CHANNELS.index(name)]


@pytest.mark.parametrize("elevation", [0.6, 0.9, 1.5])
@pytest.mark.parametrize("tilt", [(0.0, 0.0), (0.2, 0.0), (-0.15, 0.2)])
def test_a_plane_has_its_heights_its_normal_and_its_size(elevation, tilt):
    T = pose(elevation)
    normal = Rotation.from_euler("xy", tilt).apply([0.0, 0.0, 1.0])
    depth = depth_of_plane(T, normal, np.array([0.5, 0.1, 0.03]))
    g = geometry_channels(depth, K, T, table_z=0.02)
    z = back_project_to_base(depth, K, T)[..., 2] - 0.02
    for name, reach in zip(("height", "height, fine"), HEIGHTS, strict=True):
        np.testing.assert_allclose(channel(g, name), 0.5 + 0.5 * np.clip(z / reach, -1, 1), atol=2e-4)
    right = T[:3, 0] * (1, 1, 0) / np.linalg.norm(T[:2, 0])
    away = np.cross([0.0, 0.0, 1.0], right)
    for name, axis in (("right", right), ("away", away), ("up", np.array([0.0, 0.0, 1.0]))):
        np.testing.assert_allclose(channel(g, name)[INSIDE], 0.5 + 0.5 * normal @ axis, atol=2e-3)
    octaves = np.log2(depth / np.sqrt(310.0 * 300.0) / FOOTPRINT)
    np.testing.assert_allclose(channel(g, "footprint"), 0.5 + 0.5 * np.clip(octaves / 3.0, -1, 1), atol=1e-5)
    assert (channel(g, "known") == 1.0).all() and g.dtype == np.float32


def test_channels_do_not_depend_on_where_the_camera_stands_about_the_table():
    """The same scene on a turned and shifted table, at the same height: the camera turns with it, the channels stay."""
    T, rng = pose(), np.random.default_rng(0)
    depth = depth_of_plane(T, np.array([0.1, 0.0, 1.0]), np.array([0.5, 0.1, 0.03])) + rng.uniform(0, 0.02, SIZE)
    turned = np.eye(4)
    turned[:3, :3] = Rotation.from_euler("z", 1.3).as_matrix()
    turned[:3, 3] = 0.3, -0.2, 0.0
    np.testing.assert_allclose(geometry_channels(depth, K, turned @ T), geometry_channels(depth, K, T), atol=1e-4)


@pytest.mark.parametrize("missing", [0.0, np.nan])
def test_a_pixel_without_depth_is_neutral_and_spoils_no_height_beside_it(missing):
    T = pose()
    depth = depth_of_plane(T, np.array([0.0, 0.0, 1.0]), np.array([0.5, 0.1, 0.03]))
    whole = geometry_channels(depth, K, T)
    lost = np.random.default_rng(1).random(SIZE) < 0.2
    g = geometry_channels(np.where(lost, missing, depth), K, T)
    assert (g[lost] == 0.5).all()
    keep = [CHANNELS.index(name) for name in ("height", "height, fine", "known", "footprint")]
    np.testing.assert_allclose(g[~lost][:, keep], whole[~lost][:, keep], atol=1e-6)
    tilt = np.abs(channel(g, "up") - 1.0)[INSIDE][~lost[INSIDE]]
    assert np.median(tilt) < 0.02


def test_an_image_without_any_depth_is_neutral_everywhere():
    assert (geometry_channels(np.zeros(SIZE), K, pose()) == 0.5).all()


def test_a_mirror_image_is_the_scene_in_a_mirror():
    """Mirrored channels are those of the mirrored depth under the mirrored camera."""
    T = pose(roll=0.0, azimuth=0.0)  # looking along the x axis, so that the mirror is the plane y = 0.1
    bump = 0.01 * np.random.default_rng(2).random(SIZE)
    depth = depth_of_plane(T, np.array([0.0, 0.3, 1.0]), np.array([0.5, 0.1, 0.03])) + bump
    K_mirrored = K.copy()
    K_mirrored[0, 2] = SIZE[1] - 1 - K[0, 2]
    expected = geometry_channels(depth[:, ::-1].copy(), K_mirrored, T)
    np.testing.assert_allclose(mirrored(geometry_channels(depth, K, T)), expected, atol=1e-4)
