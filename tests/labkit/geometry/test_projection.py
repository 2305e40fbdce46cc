"""Pixels, rays and points against slow and certain ways: loops over pixels, finite differences, SciPy's transforms."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import pose
from scipy.spatial.transform import RigidTransform, Rotation

from labkit.geometry import (
    back_project,
    back_project_to_base,
    back_projection_jacobian,
    back_projection_noise,
    invert_transform,
    masked_cloud_to_base,
    nearest_rotation,
    pixel_rays,
    project,
    transform_points,
)

# Nothing symmetric: H != W, fx != fy, skew, a principal point off the centre, a general pose.
K = np.array([[310.0, 2.5, 9.25], [0.0, 290.0, 6.75], [0.0, 0.0, 1.0]])


def depth_with_holes(seed: int, shape=(13, 21)) -> np.ndarray:
    """Depths of 0.3 to 2 m, a fifth of the pixels without a reading, in every spelling."""
    rng = np.random.default_rng(seed)
    depth = rng.uniform(0.3, 2.0, shape).astype(np.float32)
    for share, hole in ((0.2, 0.0), (0.12, -0.0), (0.08, np.nan)):
        depth[rng.random(shape) < share] = hole
    return depth


def back_project_by_loop(depth, K, T) -> np.ndarray:
    """The formula of topic 06, pixel by pixel, in float64."""
    P = np.full((*depth.shape, 3), np.nan)
    for v in range(depth.shape[0]):
        for u in range(depth.shape[1]):
            d = float(depth[v, u])
            if d > 0.0:
                P_cam = d * np.linalg.solve(K, [u, v, 1.0])
                P[v, u] = (T @ [*P_cam, 1.0])[:3]
    return P


intrinsics = st.builds(
    lambda fx, fy, skew, cx, cy: np.array([[fx, skew, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]),
    st.floats(50.0, 2000.0),
    st.floats(50.0, 2000.0),
    st.floats(-20.0, 20.0),
    st.floats(0.0, 1000.0),
    st.floats(0.0, 1000.0),
)


@pytest.mark.parametrize("shape", [(13, 21), (16, 5), (1, 1), (6, 1)])
def test_back_projection_agrees_with_a_loop_over_pixels(shape):
    """Holes included: a pixel without a reading has the point NaN in either frame."""
    depth, T = depth_with_holes(1, shape), pose(2)
    np.testing.assert_allclose(back_project(depth, K), back_project_by_loop(depth, K, np.eye(4)), atol=1e-6)
    np.testing.assert_allclose(back_project_to_base(depth, K, T), back_project_by_loop(depth, K, T), atol=1e-6)
    v, u = np.indices(shape)
    np.testing.assert_allclose(pixel_rays(shape, K) @ K.T, np.stack([u, v, np.ones(shape)], axis=-1), atol=1e-12)


def test_any_float_type_and_memory_layout_of_depth_gives_the_same_points_and_stays_as_it_is():
    depth = depth_with_holes(4, (12, 20))
    expected, before = back_project(depth, K), depth.copy()
    for same in (depth.astype(np.float64), np.asfortranarray(depth), np.repeat(depth, 2, axis=1)[:, ::2]):
        np.testing.assert_array_equal(back_project(same, K), expected)
        np.testing.assert_array_equal(same, before)
    assert expected.dtype == np.float32 and expected.flags.c_contiguous


def test_a_batch_of_images_gives_each_ones_points():
    depths = np.stack([depth_with_holes(seed) for seed in range(6)]).reshape(2, 3, 13, 21)
    T = pose(1)
    np.testing.assert_array_equal(back_project(depths, K)[1, 2], back_project(depths[1, 2], K))
    np.testing.assert_array_equal(back_project_to_base(depths, K, T)[0, 1], back_project_to_base(depths[0, 1], K, T))
    assert back_project(depths[:0], K).shape == (0, 3, 13, 21, 3)


@given(K=intrinsics, d=st.floats(0.1, 10.0))
@settings(max_examples=60, deadline=None)
def test_project_is_the_inverse_of_back_projection(K, d):
    u, v = project(d * pixel_rays((5, 8), K), K)
    rows, columns = np.mgrid[:5, :8]
    np.testing.assert_allclose(u, columns, atol=1e-8)
    np.testing.assert_allclose(v, rows, atol=1e-8)


def test_what_is_not_in_front_of_the_camera_has_no_pixel():
    u, v = project(np.array([[0.1, 0.1, -1.0], [0.0, 0.0, 0.0], [0.1, np.nan, 1.0], [0.0, 0.0, 1.0]]), K)
    assert np.isnan(u[:3]).all() and np.isnan(v[:3]).all()
    assert (u[3], v[3]) == (K[0, 2], K[1, 2])
    u, v = project(np.array([0.2, -0.1, 0.5]), K)  # a single point has a single pixel
    assert u.shape == v.shape == ()


def test_the_masked_cloud_is_that_of_the_image_where_the_mask_is_and_depth():
    depth, T = depth_with_holes(8), pose(9)
    mask = np.random.default_rng(7).integers(0, 4, depth.shape).astype(np.uint8)
    P = masked_cloud_to_base(mask, depth, K, T, 2)
    assert 0 < len(P) < np.count_nonzero(mask == 2)
    np.testing.assert_array_equal(P, back_project_to_base(depth, K, T)[(mask == 2) & (depth > 0.0)])


def test_a_mask_without_target_pixels_or_without_depth_gives_an_empty_cloud():
    depth = np.ones((2, 3), np.float32)
    for cloud in (
        masked_cloud_to_base(np.zeros((2, 3), np.uint8), depth, K, pose(0), 2),
        masked_cloud_to_base(np.full((2, 3), 2, np.int64), 0.0 * depth, K, pose(0), np.uint8(2)),
    ):
        assert cloud.shape == (0, 3) and cloud.dtype == np.float32


# The rays that are kept for the next frame


def test_matrices_changed_in_place_and_images_of_another_shape_get_their_own_rays():
    K_live, T_live = K.copy(), pose(12)
    for shape in ((6, 8), (8, 6), (4, 12), (6, 8)):
        depth = depth_with_holes(11, shape)
        got = back_project_to_base(depth, K_live, T_live)
        np.testing.assert_allclose(got, back_project_by_loop(depth, K_live, T_live), atol=1e-6)
        got[:] = -7.0  # writing into a result does not reach the next one
        K_live[0, 0] *= 1.5
        T_live[:] = pose(shape[0])


def test_threads_with_different_cameras_get_their_own_points():
    depths = [depth_with_holes(seed, (30, 40)) for seed in range(8)]
    jobs = [(depths[i % 8], K + np.diag([i % 5, 0.0, 0.0]), pose(i % 7)) for i in range(200)]
    expected = [back_project_to_base(*job) for job in jobs]
    with ThreadPoolExecutor(8) as pool:
        for got, want in zip(pool.map(lambda job: back_project_to_base(*job), jobs), expected, strict=True):
            np.testing.assert_array_equal(got, want)


# How errors in u, v and d move a point


@given(K=intrinsics, u=st.floats(0.0, 1000.0), v=st.floats(0.0, 1000.0), d=st.floats(0.1, 10.0))
@settings(max_examples=100, deadline=None)
def test_the_jacobian_agrees_with_central_differences(K, u, v, d):
    def point(u, v, d):
        return d * np.linalg.solve(K, [u, v, 1.0])

    h = 1e-4  # the function is linear in each argument: only rounding limits the difference
    differences = [
        (point(u + h, v, d) - point(u - h, v, d)) / (2 * h),
        (point(u, v + h, d) - point(u, v - h, d)) / (2 * h),
        (point(u, v, d + h) - point(u, v, d - h)) / (2 * h),
    ]
    np.testing.assert_allclose(back_projection_jacobian(u, v, d, K), np.column_stack(differences), atol=1e-7, rtol=1e-7)


def test_noise_agrees_with_the_spread_of_many_noisy_readings():
    u, v, d, sigma_pixel, sigma_depth = 250.0, 180.0, 0.9, 0.5, 0.004
    noise = np.random.default_rng(15).normal(size=(200_000, 3)) * (sigma_pixel, sigma_pixel, sigma_depth)
    noisy = np.array([u, v, d]) + noise
    P = noisy[:, 2:] * np.linalg.solve(K, np.column_stack([noisy[:, :2], np.ones(len(noisy))]).T).T
    Sigma = back_projection_noise(u, v, d, K, sigma_pixel, sigma_depth)
    np.testing.assert_allclose(Sigma, np.cov(P.T), rtol=0.02, atol=2e-8)


# Rigid transforms


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=50, deadline=None)
def test_transforms_agree_with_scipy(seed):
    T, P = pose(seed), np.random.default_rng(seed).normal(size=(9, 3))
    T_scipy = RigidTransform.from_matrix(T)
    np.testing.assert_allclose(transform_points(T, P), T_scipy.apply(P), atol=1e-12)
    np.testing.assert_allclose(invert_transform(T), T_scipy.inv().as_matrix(), atol=1e-12)


def test_points_keep_their_shape_and_precision_and_nan_stays_nan():
    P = np.random.default_rng(4).normal(size=(3, 4, 3)).astype(np.float32)
    P[1, 2] = np.nan
    Q = transform_points(pose(5), P)
    assert Q.shape == P.shape and Q.dtype == np.float32
    np.testing.assert_array_equal(np.isnan(Q), np.isnan(P))
    assert transform_points(pose(5), P[0, 0]).shape == (3,)
    assert transform_points(pose(5), np.zeros((0, 3))).shape == (0, 3)


# Bad input

DEPTH, MASK, CLOUD = np.ones((2, 3), np.float32), np.zeros((2, 3), np.uint8), np.zeros((5, 3))
K_TRANSPOSED, K_SINGULAR = K.T, np.diag([0.0, 1.0, 1.0])
T_STRETCHED, T_MIRROR = np.diag([2.0, 1.0, 1.0, 1.0]), np.diag([1.0, 1.0, -1.0, 1.0])
T_MILLIMETRES = np.eye(4) + np.diag([700.0], 3)

BAD = [
    ("K", pixel_rays, (2, 3), K_TRANSPOSED),
    ("shape", pixel_rays, (2, 0), K),
    ("shape", pixel_rays, (2, 3, 3), K),
    ("K", back_project, DEPTH, K_TRANSPOSED),
    ("depth", back_project, DEPTH.astype(np.uint16), K),
    ("depth", back_project, DEPTH[0], K),
    ("depth", back_project, 1000.0 * np.ones((2, 2, 3)), K),
    ("T_base_cam", back_project_to_base, DEPTH, K, T_STRETCHED),
    ("T_base_cam", back_project_to_base, DEPTH, K, T_MILLIMETRES),
    ("mask", masked_cloud_to_base, MASK[:, :2], DEPTH, K, np.eye(4), 2),
    ("mask", masked_cloud_to_base, MASK.astype(float), DEPTH, K, np.eye(4), 2),
    ("mask", masked_cloud_to_base, MASK[..., None], DEPTH, K, np.eye(4), 2),
    ("depth", masked_cloud_to_base, MASK, DEPTH[None], K, np.eye(4), 2),
    ("K", masked_cloud_to_base, MASK, DEPTH, K_TRANSPOSED, np.eye(4), 2),
    ("T_base_cam", masked_cloud_to_base, MASK, DEPTH, K, T_STRETCHED, 2),
    ("target_class", masked_cloud_to_base, MASK, DEPTH, K, np.eye(4), -1),
    ("target_class", masked_cloud_to_base, MASK, DEPTH, K, np.eye(4), 2.0),
    ("P_cam", project, np.zeros((4, 2)), K),
    ("P_cam", project, np.zeros((3, 4)), K),
    ("K", project, CLOUD, K_SINGULAR),
    ("u", back_projection_jacobian, np.nan, 1.0, 1.0, K),
    ("v", back_projection_jacobian, 1.0, np.array([1.0, 2.0]), 1.0, K),
    ("d", back_projection_jacobian, 1.0, 1.0, 0.0, K),
    ("K", back_projection_jacobian, 1.0, 1.0, 1.0, K_TRANSPOSED),
    ("sigma_pixel", back_projection_noise, 1.0, 1.0, 1.0, K, -0.5, 0.1),
    ("sigma_depth", back_projection_noise, 1.0, 1.0, 1.0, K, 0.5, np.nan),
    ("T", transform_points, T_MIRROR, CLOUD),
    ("P", transform_points, np.eye(4), np.zeros((5, 4))),
    ("P", transform_points, np.eye(4), np.zeros((5, 3), int)),
    ("T", invert_transform, T_STRETCHED),
]


@pytest.mark.bad_input
@pytest.mark.parametrize("case", BAD, ids=lambda case: f"{case[1].__name__}-{case[0]}")
def test_bad_input_is_an_error_that_names_the_argument(case):
    name, function, *arguments = case
    with pytest.raises(ValueError, match=rf"^{name}: expected "):
        function(*arguments)


@pytest.mark.parametrize("decimals", [3, 4, 6])
def test_the_nearest_rotation_is_the_nearest_of_many(decimals):
    """SciPy's own, and no small turn of it lies nearer to the matrix."""
    rng = np.random.default_rng(decimals)
    for R in Rotation.random(20, rng=rng).as_matrix():
        rounded = R.round(decimals)
        ours = nearest_rotation(rounded)
        assert np.allclose(ours @ ours.T, np.eye(3), atol=1e-12) and np.linalg.det(ours) > 0.0
        assert np.allclose(ours, Rotation.from_matrix(rounded, assume_valid=False).as_matrix(), atol=1e-9)
        off = np.linalg.norm(ours - rounded)
        for turn in Rotation.from_rotvec(1e-4 * rng.standard_normal((50, 3))).as_matrix():
            assert np.linalg.norm(ours @ turn - rounded) >= off
        assert off <= np.linalg.norm(R - rounded) + 1e-12


@pytest.mark.bad_input
@pytest.mark.parametrize("R", [np.diag([1.0, 1.0, -1.0]), np.zeros((3, 3)), np.diag([1.0, 1.0, 0.0]), np.eye(4)])
def test_what_is_near_to_no_rotation_is_refused(R):
    with pytest.raises(ValueError, match=r"^R: "):
        nearest_rotation(R)
