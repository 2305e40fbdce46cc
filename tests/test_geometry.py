"""Geometry against slow and certain ways: loops over pixels, finite differences, SciPy's rotations, brute force."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.sparse.csgraph import connected_components
from scipy.spatial.transform import Rotation

from labkit import geometry
from labkit.geometry import (
    back_project,
    back_project_to_base,
    back_projection_jacobian,
    back_projection_noise,
    backproject_to_base,
    centroid_and_covariance,
    cluster,
    invert_transform,
    pixel_rays,
    principal_axes,
    project,
    projection,
    remove_outliers,
    transform_points,
)

# Nothing symmetric: H != W, fx != fy, skew, a principal point off the centre, a general pose.
K = np.array([[310.0, 2.5, 9.25], [0.0, 290.0, 6.75], [0.0, 0.0, 1.0]])


def pose(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    T = np.eye(4)
    T[:3, :3] = Rotation.random(random_state=rng).as_matrix()
    T[:3, 3] = rng.uniform(-1.0, 1.0, 3)
    return T


def depth_with_holes(seed: int, shape=(13, 21)) -> np.ndarray:
    """Depths of 0.3 to 2 m, a fifth of the pixels without a reading, in both spellings."""
    rng = np.random.default_rng(seed)
    depth = rng.uniform(0.3, 2.0, shape).astype(np.float32)
    missing = rng.random(shape)
    depth[missing < 0.2] = 0.0
    depth[missing < 0.1] = np.nan
    return depth


def back_project_by_loop(depth, K, T) -> np.ndarray:
    """The formula of the text's section 4, pixel by pixel, in float64."""
    P = np.full((*depth.shape, 3), np.nan)
    for v in range(depth.shape[0]):
        for u in range(depth.shape[1]):
            d = float(depth[v, u])
            if d > 0.0:
                P_cam = d * np.linalg.solve(K, [u, v, 1.0])
                P[v, u] = (T @ [*P_cam, 1.0])[:3]
    return P


finite = {"allow_nan": False, "allow_infinity": False}
intrinsics = st.builds(
    lambda fx, fy, skew, cx, cy: np.array([[fx, skew, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]),
    st.floats(50.0, 2000.0),
    st.floats(50.0, 2000.0),
    st.floats(-20.0, 20.0),
    st.floats(0.0, 1000.0),
    st.floats(0.0, 1000.0),
)


# ---------------------------------------------------------------------------------------- pixels, rays and points


def test_rays_solve_K_q_equals_pixel():
    rays = pixel_rays((4, 7), K)
    for v in range(4):
        for u in range(7):
            np.testing.assert_allclose(K @ rays[v, u], [u, v, 1.0], atol=1e-12)


@pytest.mark.parametrize("shape", [(13, 21), (16, 5), (1, 1), (6, 1)])
def test_back_projection_agrees_with_a_loop_over_pixels(shape):
    depth, T = depth_with_holes(1, shape), pose(2)
    np.testing.assert_allclose(back_project(depth, K), back_project_by_loop(depth, K, np.eye(4)), atol=1e-6)
    np.testing.assert_allclose(back_project_to_base(depth, K, T), back_project_by_loop(depth, K, T), atol=1e-6)


def test_depth_is_measured_along_z_so_a_wall_seen_head_on_has_one_z():
    P = back_project(np.full((9, 12), 0.7, np.float32), K)
    assert np.unique(P[..., 2]).tolist() == [np.float32(0.7)]


@pytest.mark.parametrize("hole", [0.0, -0.0, np.nan])
def test_a_pixel_without_a_reading_has_no_point_in_any_frame(hole):
    depth = np.array([[0.5, hole]], np.float32)
    for P in (back_project(depth, K), back_project_to_base(depth, K, pose(0))):
        assert np.isfinite(P[0, 0]).all()
        assert np.isnan(P[0, 1]).all()


def test_a_batch_of_images_gives_each_ones_points():
    depths = np.stack([depth_with_holes(seed) for seed in range(6)]).reshape(2, 3, 13, 21)
    T = pose(1)
    np.testing.assert_array_equal(back_project(depths, K)[1, 2], back_project(depths[1, 2], K))
    np.testing.assert_array_equal(back_project_to_base(depths, K, T)[0, 1], back_project_to_base(depths[0, 1], K, T))
    assert back_project(depths[:0], K).shape == (0, 3, 13, 21, 3)


def test_an_image_without_any_reading_has_only_nan_points():
    assert np.isnan(back_project_to_base(np.zeros((3, 4), np.float32), K, pose(0))).all()


def test_the_depth_image_of_the_caller_is_left_alone():
    depth = depth_with_holes(3)
    before = depth.copy()
    back_project_to_base(depth, K, pose(0))
    np.testing.assert_array_equal(depth, before)


def test_any_float_type_and_memory_layout_of_depth_gives_the_same_points():
    depth = depth_with_holes(4, (12, 20))
    expected = back_project(depth, K)
    np.testing.assert_array_equal(back_project(depth.astype(np.float64), K), expected)
    np.testing.assert_array_equal(back_project(np.asfortranarray(depth), K), expected)
    np.testing.assert_array_equal(back_project(np.repeat(depth, 2, axis=1)[:, ::2], K), expected)
    assert expected.dtype == np.float32 and expected.flags.c_contiguous


@given(K=intrinsics, d=st.floats(0.1, 10.0))
@settings(max_examples=60, deadline=None)
def test_project_is_the_inverse_of_back_projection(K, d):
    P = d * pixel_rays((5, 8), K)
    u, v = project(P, K)
    rows, columns = np.mgrid[:5, :8]
    np.testing.assert_allclose(u, columns, atol=1e-8)
    np.testing.assert_allclose(v, rows, atol=1e-8)


def test_project_inverts_the_whole_chain_from_pixels_to_the_base_frame_and_back():
    depth, T_base_cam = depth_with_holes(5), pose(6)
    P_cam = transform_points(invert_transform(T_base_cam), back_project_to_base(depth, K, T_base_cam))
    u, v = project(P_cam, K)
    seen = depth > 0.0
    rows, columns = np.nonzero(seen)
    np.testing.assert_allclose(u[seen], columns, atol=2e-3)
    np.testing.assert_allclose(v[seen], rows, atol=2e-3)
    np.testing.assert_allclose(P_cam[seen][:, 2], depth[seen], atol=1e-6)
    assert np.isnan(u[~seen]).all() and np.isnan(v[~seen]).all()


def test_what_is_not_in_front_of_the_camera_has_no_pixel():
    u, v = project(np.array([[0.1, 0.1, -1.0], [0.0, 0.0, 0.0], [0.1, np.nan, 1.0], [0.0, 0.0, 1.0]]), K)
    assert np.isnan(u[:3]).tolist() == [True, True, True] and np.isnan(v[:3]).tolist() == [True, True, True]
    assert (u[3], v[3]) == (K[0, 2], K[1, 2])


def test_a_single_point_has_a_single_pixel():
    u, v = project(np.array([0.2, -0.1, 0.5]), K)
    assert u.shape == v.shape == ()
    np.testing.assert_allclose(0.5 * np.linalg.solve(K, [u, v, 1.0]), [0.2, -0.1, 0.5], atol=1e-12)


# ------------------------------------------------------------------------------------------------------ the mask


def text_listing(mask, depth, K, T_base_cam, target_class):
    """What the text's section 6 computes, in our own words: every pixel of the class, with depth or without."""
    v, u = np.where(mask == target_class)
    P_cam = np.linalg.inv(K) @ np.stack([u, v, np.ones(len(u))]) * depth[v, u]
    return (T_base_cam @ np.vstack([P_cam, np.ones(len(u))]))[:3].T


def test_the_masked_cloud_is_the_texts_without_the_pixels_that_have_no_depth():
    rng = np.random.default_rng(7)
    depth, T = depth_with_holes(8), pose(9)
    mask = rng.integers(0, 4, depth.shape).astype(np.uint8)
    P = backproject_to_base(mask, depth, K, T, 2)
    with_depth = depth[mask == 2] > 0.0
    assert 0 < with_depth.sum() < len(with_depth)
    np.testing.assert_allclose(P, text_listing(mask, depth, K, T, 2)[with_depth], atol=1e-6)
    np.testing.assert_array_equal(P, back_project_to_base(depth, K, T)[(mask == 2) & (depth > 0.0)])


def test_erratum_the_texts_listing_puts_pixels_without_depth_at_the_camera():
    depth, T = np.array([[0.0, 0.0, 0.5]]), pose(10)
    mask = np.full((1, 3), 2)
    np.testing.assert_allclose(text_listing(mask, depth, K, T, 2)[:2], [T[:3, 3]] * 2)
    assert len(backproject_to_base(mask, depth, K, T, 2)) == 1


def test_a_mask_without_target_pixels_or_without_depth_gives_an_empty_cloud():
    depth = np.ones((2, 3), np.float32)
    for cloud in (
        backproject_to_base(np.zeros((2, 3), np.uint8), depth, K, pose(0), 2),
        backproject_to_base(np.full((2, 3), 2, np.int64), 0.0 * depth, K, pose(0), np.uint8(2)),
    ):
        assert cloud.shape == (0, 3) and cloud.dtype == np.float32


# ----------------------------------------------------------------------------------------------------- the cache


def test_matrices_changed_in_place_are_a_new_camera():
    depth = depth_with_holes(11)
    K_live, T_live = K.copy(), pose(12)
    for change in range(3):
        np.testing.assert_allclose(
            back_project_to_base(depth, K_live, T_live), back_project_by_loop(depth, K_live, T_live), atol=1e-6
        )
        if change == 0:
            K_live[0, 0] *= 1.5
        else:
            T_live[:] = pose(12 + change)


def test_images_of_another_shape_with_as_many_pixels_do_not_share_rays():
    depth, T = depth_with_holes(13, (6, 8)), pose(14)
    for shape in ((6, 8), (8, 6), (4, 12), (6, 8)):
        seen = depth.reshape(shape)
        np.testing.assert_allclose(back_project_to_base(seen, K, T), back_project_by_loop(seen, K, T), atol=1e-6)


def test_writing_into_a_result_does_not_reach_the_next_one():
    depth = np.ones((4, 5), np.float32)
    mask = np.full((4, 5), 2, np.uint8)
    first = back_project(depth, K).copy()
    for P in (back_project(depth, K), backproject_to_base(mask, depth, K, np.eye(4), 2)):
        P[:] = -7.0
    np.testing.assert_array_equal(back_project(depth, K), first)


def test_the_cache_is_bounded():
    depth = np.ones((2, 3), np.float32)
    for seed in range(30):
        back_project_to_base(depth, K, pose(seed))
    info = projection._base_rays.cache_info()
    assert info.currsize <= info.maxsize < 10


def test_threads_with_different_cameras_get_their_own_points():
    depths = [depth_with_holes(seed, (30, 40)) for seed in range(8)]
    jobs = [(depths[i % 8], K + np.diag([i % 5, 0.0, 0.0]), pose(i % 7)) for i in range(200)]
    expected = [back_project_to_base(*job) for job in jobs]
    with ThreadPoolExecutor(8) as pool:
        for got, want in zip(pool.map(lambda job: back_project_to_base(*job), jobs), expected, strict=True):
            np.testing.assert_array_equal(got, want)


# ----------------------------------------------------------------------------- how errors in u, v and d move a point


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


def test_problem_4_the_last_column_is_the_ray_and_does_not_depend_on_the_depth():
    near, far = back_projection_jacobian(3, 2, 0.4, K), back_projection_jacobian(3, 2, 4.0, K)
    np.testing.assert_allclose(near[:, 2], pixel_rays((5, 7), K)[2, 3])
    np.testing.assert_array_equal(far[:, 2], near[:, 2])
    np.testing.assert_allclose(far[:, :2], 10.0 * near[:, :2])


def test_noise_agrees_with_the_spread_of_many_noisy_readings():
    rng = np.random.default_rng(15)
    u, v, d, sigma_pixel, sigma_depth = 250.0, 180.0, 0.9, 0.5, 0.004
    noisy = np.array([u, v, d]) + rng.normal(size=(200_000, 3)) * (sigma_pixel, sigma_pixel, sigma_depth)
    P = noisy[:, 2:] * np.linalg.solve(K, np.column_stack([noisy[:, :2], np.ones(len(noisy))]).T).T
    Sigma = back_projection_noise(u, v, d, K, sigma_pixel, sigma_depth)
    np.testing.assert_allclose(Sigma, np.cov(P.T), rtol=0.02, atol=2e-8)


def test_depth_noise_alone_moves_a_point_along_its_ray_only():
    Sigma = back_projection_noise(20.0, 3.0, 0.9, K, 0.0, 0.004)
    q = pixel_rays((4, 21), K)[3, 20]
    np.testing.assert_allclose(Sigma, 0.004**2 * np.outer(q, q), atol=1e-18)


# ------------------------------------------------------------------------------------------------ rigid transforms


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=50, deadline=None)
def test_transforms_agree_with_scipy_and_numpy(seed):
    T, P = pose(seed), np.random.default_rng(seed).normal(size=(9, 3))
    rotation = Rotation.from_matrix(T[:3, :3])
    np.testing.assert_allclose(transform_points(T, P), rotation.apply(P) + T[:3, 3], atol=1e-12)
    np.testing.assert_allclose(invert_transform(T), np.linalg.inv(T), atol=1e-12)
    np.testing.assert_allclose(transform_points(invert_transform(T), transform_points(T, P)), P, atol=1e-12)


def test_a_product_of_transforms_is_one_after_the_other():
    T_a_b, T_b_c, P_c = pose(1), pose(2), np.random.default_rng(3).normal(size=(4, 3))
    expected = transform_points(T_a_b, transform_points(T_b_c, P_c))
    np.testing.assert_allclose(transform_points(T_a_b @ T_b_c, P_c), expected, atol=1e-12)


def test_points_keep_their_shape_and_precision_and_nan_stays_nan():
    P = np.random.default_rng(4).normal(size=(3, 4, 3)).astype(np.float32)
    P[1, 2] = np.nan
    Q = transform_points(pose(5), P)
    assert Q.shape == P.shape and Q.dtype == np.float32
    np.testing.assert_array_equal(np.isnan(Q), np.isnan(P))
    assert transform_points(pose(5), P[0, 0]).shape == (3,)
    assert transform_points(pose(5), np.zeros((0, 3))).shape == (0, 3)


# ------------------------------------------------------------------------------------------------ what a cloud says


@given(P=arrays(np.float64, st.tuples(st.integers(1, 30), st.just(3)), elements=st.floats(-100.0, 100.0, **finite)))
@settings(max_examples=60, deadline=None)
def test_centroid_and_covariance_agree_with_numpy(P):
    mu, Sigma = centroid_and_covariance(P)
    np.testing.assert_allclose(mu, P.mean(axis=0), atol=1e-10)
    np.testing.assert_allclose(Sigma, np.cov(P.T, bias=True), atol=1e-9)


def test_reductions_are_float64_because_float32_ones_are_wrong_in_the_fourth_digit():
    x, y = np.meshgrid(np.linspace(0.3, 0.7, 200), np.linspace(-0.2, 0.2, 200))
    table = np.column_stack([x.ravel(), y.ravel(), np.full(40_000, 0.7)]).astype(np.float32)
    height = float(table[0, 2])
    mu, Sigma = centroid_and_covariance(table)
    assert mu.dtype == Sigma.dtype == np.float64
    assert abs(table.mean(axis=0)[2] - height) > 2e-4  # what NumPy does with float32 unasked: a quarter millimetre
    assert abs(mu[2] - height) < 1e-12
    assert abs(Sigma[2, 2]) < 1e-20
    np.testing.assert_allclose(Sigma, np.cov(table.T.astype(np.float64), bias=True), rtol=1e-9, atol=1e-15)


def box_cloud(edges, n: int = 4000, seed: int = 17) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-0.5, 0.5, (n, 3)) * edges


def ball_cloud(n: int = 4000) -> np.ndarray:
    """Points spread evenly over a sphere of radius 5 cm (a golden spiral)."""
    k = np.arange(n) + 0.5
    z, angle = 1.0 - 2.0 * k / n, np.pi * (1.0 + 5.0**0.5) * k
    return 0.05 * np.column_stack([np.sqrt(1 - z * z) * np.cos(angle), np.sqrt(1 - z * z) * np.sin(angle), z])


def angle_between(a, b) -> float:
    """Angle between two axes in degrees; an axis has no sign."""
    return float(np.degrees(np.arccos(min(1.0, abs(a @ b)))))


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=30, deadline=None)
def test_a_turned_box_gives_back_its_axes(seed):
    T, edges = pose(seed), np.array([0.10, 0.03, 0.06])
    found = principal_axes(transform_points(T, box_cloud(edges)).astype(np.float32))
    assert found.problem == "" and found.determined.all()
    for column, edge in enumerate((0, 2, 1)):  # longest first
        assert angle_between(found.axes[:, column], T[:3, edge]) < 2.0
    np.testing.assert_allclose(found.variances, np.sort(edges**2 / 12.0)[::-1], rtol=0.1)
    np.testing.assert_allclose(found.axes.T @ found.axes, np.eye(3), atol=1e-12)
    assert np.linalg.det(found.axes) > 0.999


def test_axes_and_variances_solve_the_eigenvalue_problem_of_the_covariance():
    P = box_cloud((0.1, 0.02, 0.05))
    found, (mu, Sigma) = principal_axes(P), centroid_and_covariance(P)
    np.testing.assert_allclose(Sigma @ found.axes, found.axes * found.variances, atol=1e-15)
    np.testing.assert_array_equal(found.centroid, mu)


def test_an_axis_does_not_flip_when_the_points_come_in_another_order():
    P = box_cloud((0.1, 0.02, 0.05))
    shuffled = np.random.default_rng(0).permutation(P)
    np.testing.assert_allclose(principal_axes(shuffled).axes, principal_axes(P).axes, atol=1e-9)


@pytest.mark.parametrize("centre", [(0.0, 0.0, 0.0), (0.5, -0.3, 0.1), (3.0, 2.0, 1.0)])
def test_degenerate_clouds_are_reported_and_their_axes_are_not_guessed(centre):
    T = pose(18)
    T[:3, 3] = centre
    line = np.outer(np.linspace(-0.1, 0.1, 50), [0.0, 1.0, 0.0])
    angle = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    disc = 0.05 * np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])
    tube = np.vstack([disc + np.array([0.0, 0.0, z]) for z in np.linspace(-0.2, 0.2, 20)])
    cases = [
        (line, [True, False, False], "line", T[:3, 1]),
        (disc, [False, False, True], "two larger", T[:3, 2]),
        (tube, [True, False, False], "two smaller", T[:3, 2]),
        (ball_cloud(), [False, False, False], "all directions", None),
        (np.zeros((9, 3)), [False, False, False], "coincide", None),
        (line[:1], [False, False, False], "1 points", None),
        (box_cloud((0.1, 0.02, 0.05), n=3), [False, False, False], "3 points", None),
    ]
    for P, determined, words, axis in cases:
        found = principal_axes(transform_points(T, P).astype(np.float32))
        assert found.determined.tolist() == determined, words
        assert words in found.problem
        assert np.isnan(found.axes[:, ~found.determined]).all()
        assert np.isfinite(found.variances).all() and (found.variances >= 0.0).all()
        if axis is not None:
            assert angle_between(found.axes[:, found.determined][:, 0], axis) < 0.1


def test_a_flat_rectangle_has_all_three_axes():
    found = principal_axes(box_cloud((0.1, 0.05, 0.0)))
    assert found.determined.all() and found.variances[2] == 0.0
    assert angle_between(found.axes[:, 2], np.array([0.0, 0.0, 1.0])) < 1e-6


def test_the_tolerance_decides_what_counts_as_equal():
    corners = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-0.9, 0.9) for z in (-0.3, 0.3)])
    assert principal_axes(corners, tolerance=0.1).determined.all()  # 0.81 of the variance of x
    assert principal_axes(corners, tolerance=0.3).determined.tolist() == [False, False, True]


# ------------------------------------------------------------------------------------- outliers and separate objects


def squared_distances(P) -> np.ndarray:
    x, y, z = (P[:, None] - P[None]).astype(np.float64).transpose(2, 0, 1)
    return x * x + y * y + z * z


# Points on a lattice make many distances that are exactly the gap; free ones make all the others.
clouds = st.one_of(
    arrays(np.float64, st.tuples(st.integers(0, 60), st.just(3)), elements=st.integers(-4, 4).map(float)),
    arrays(np.float64, st.tuples(st.integers(0, 60), st.just(3)), elements=st.floats(-4.0, 4.0, **finite)),
    arrays(np.float32, st.tuples(st.integers(0, 60), st.just(3)), elements=st.floats(-2.0, 2.0, width=32, **finite)),
)


@given(P=clouds, gap=st.sampled_from([0.25, 0.7, 1.0, 1.5, 1.7, 3.0]), min_points=st.integers(1, 5))
@settings(max_examples=100, deadline=None)
def test_clusters_are_those_of_brute_force_single_linkage(P, gap, min_points):
    found = cluster(P, gap=gap, min_points=min_points)
    if len(P) == 0:
        assert found == []
        return
    _, group = connected_components(squared_distances(P) <= gap * gap)
    expected = [P[group == g] for g in range(group.max() + 1)]
    expected = [points for points in expected if len(points) >= min_points]
    sizes = [len(points) for points in found]
    assert sizes == sorted((len(points) for points in expected), reverse=True)
    assert {points.tobytes() for points in found} == {points.tobytes() for points in expected}


@given(P=clouds, radius=st.sampled_from([0.25, 0.7, 1.0, 1.5, 1.7, 3.0]), min_neighbours=st.integers(0, 6))
@settings(max_examples=100, deadline=None)
def test_outliers_are_those_that_brute_force_finds(P, radius, min_neighbours):
    neighbours = (squared_distances(P) <= radius * radius).sum(axis=1) - 1 if len(P) else np.zeros(0)
    np.testing.assert_array_equal(remove_outliers(P, radius, min_neighbours), P[neighbours >= min_neighbours])


def test_dense_clouds_agree_with_brute_force_too():
    rng = np.random.default_rng(19)
    P = (rng.normal(size=(700, 3)) * (0.06, 0.06, 0.01) + (0.5, -0.2, 0.0)).astype(np.float32)
    near = squared_distances(P) <= 0.01**2
    np.testing.assert_array_equal(remove_outliers(P, 0.01, 6), P[near.sum(axis=1) - 1 >= 6])
    _, group = connected_components(near)
    assert [len(points) for points in cluster(P, 0.01, 1)] == sorted(np.bincount(group), reverse=True)


def test_two_targets_are_two_clouds_the_larger_first_and_a_third_one_too_small_is_noise():
    T = pose(20)
    small, large, noise = (transform_points(T, box_cloud((0.06, 0.04, 0.03), n)) for n in (500, 900, 12))
    aside = np.array([0.3, 0.0, 0.0])
    P = np.vstack([small + aside, noise - aside, large]).astype(np.float32)
    found = cluster(P, gap=0.02, min_points=30)
    assert [len(points) for points in found] == [900, 500]
    np.testing.assert_array_equal(found[0], P[512:])
    np.testing.assert_array_equal(found[1], P[:500])
    assert found[0].dtype == np.float32


def test_objects_are_told_apart_by_just_more_than_the_gap():
    x = np.arange(40) * 0.004
    first = np.column_stack([x, 0.0 * x, 0.0 * x])
    for distance, count in ((0.0149, 1), (0.0151, 2)):
        both = np.vstack([first, first + np.array([0.0, distance, 0.0])])
        assert len(cluster(both, gap=0.015, min_points=10)) == count


def test_reach_is_the_same_along_a_diagonal_as_along_an_axis():
    for direction in ([1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 1.0, 1.0], [-1.0, 1.0, 1.0], [1.0, -1.0, 1.0]):
        for distance, together in ((0.0149, True), (0.0151, False)):
            step = distance * np.array(direction) / np.linalg.norm(direction)
            pair = np.array([0.3 * step, 1.3 * step])
            assert len(cluster(pair, gap=0.015, min_points=1)) == (1 if together else 2)
            assert len(remove_outliers(pair, radius=0.015, min_neighbours=1)) == (2 if together else 0)


def test_flying_pixels_between_an_object_and_the_wall_are_removed_and_the_object_stays():
    rng = np.random.default_rng(21)
    rows, columns = np.mgrid[:25, :25] * 0.003
    surface = np.column_stack([columns.ravel(), rows.ravel(), np.full(625, 0.8)])
    flying = surface[:25] + np.column_stack([np.zeros((25, 2)), 0.02 + 0.3 * np.linspace(0, 1, 25)])
    P = rng.permutation(np.vstack([surface, flying]))
    cleaned = remove_outliers(P, radius=0.01, min_neighbours=4)
    assert len(cleaned) == 625 and (cleaned[:, 2] == 0.8).all()


def test_one_far_point_does_not_disturb_the_rest():
    P = np.vstack([box_cloud((0.05, 0.05, 0.05), 300), [[90.0, -90.0, 90.0]]])
    assert [len(points) for points in cluster(P, gap=0.02, min_points=1)] == [300, 1]


# ----------------------------------------------------------------------------------------------------- bad input

DEPTH = np.ones((2, 3), np.float32)
MASK = np.zeros((2, 3), np.uint8)
CLOUD = np.zeros((5, 3))
NAN_CLOUD = np.array([[0.0, 0.0, np.nan]])
K_TRANSPOSED, K_SINGULAR, K_NAN = K.T, np.diag([0.0, 1.0, 1.0]), np.diag([1.0, np.nan, 1.0])
T_STRETCHED, T_MIRROR, T_TRANSPOSED = np.diag([2.0, 1.0, 1.0, 1.0]), np.diag([1.0, 1.0, -1.0, 1.0]), pose(0).T

BAD = [
    ("K", lambda: pixel_rays((2, 3), K_TRANSPOSED)),
    ("shape", lambda: pixel_rays((2, 0), K)),
    ("shape", lambda: pixel_rays((2.5, 3), K)),
    ("shape", lambda: pixel_rays((2, 3, 3), K)),
    ("K", lambda: back_project(DEPTH, K_TRANSPOSED)),
    ("K", lambda: back_project(DEPTH, K_SINGULAR)),
    ("K", lambda: back_project(DEPTH, K_NAN)),
    ("K", lambda: back_project(DEPTH, np.eye(4))),
    ("depth", lambda: back_project(1000.0 * DEPTH, K)),
    ("depth", lambda: back_project(-DEPTH, K)),
    ("depth", lambda: back_project(DEPTH.astype(np.uint16), K)),
    ("depth", lambda: back_project(np.full((2, 3), np.inf), K)),
    ("depth", lambda: back_project(DEPTH[0], K)),
    ("depth", lambda: back_project(np.ones((0, 3)), K)),
    ("T_base_cam", lambda: back_project_to_base(DEPTH, K, T_STRETCHED)),
    ("T_base_cam", lambda: back_project_to_base(DEPTH, K, T_MIRROR)),
    ("T_base_cam", lambda: back_project_to_base(DEPTH, K, T_TRANSPOSED)),
    ("T_base_cam", lambda: back_project_to_base(DEPTH, K, np.eye(3))),
    ("mask", lambda: backproject_to_base(MASK[:, :2], DEPTH, K, np.eye(4), 2)),
    ("mask", lambda: backproject_to_base(MASK.astype(float), DEPTH, K, np.eye(4), 2)),
    ("mask", lambda: backproject_to_base(MASK[..., None], DEPTH, K, np.eye(4), 2)),
    ("depth", lambda: backproject_to_base(MASK, 1000.0 * DEPTH, K, np.eye(4), 2)),
    ("K", lambda: backproject_to_base(MASK, DEPTH, K_TRANSPOSED, np.eye(4), 2)),
    ("T_base_cam", lambda: backproject_to_base(MASK, DEPTH, K, T_STRETCHED, 2)),
    ("target_class", lambda: backproject_to_base(MASK, DEPTH, K, np.eye(4), -1)),
    ("target_class", lambda: backproject_to_base(MASK, DEPTH, K, np.eye(4), 2.0)),
    ("target_class", lambda: backproject_to_base(MASK, DEPTH, K, np.eye(4), True)),
    ("target_class", lambda: backproject_to_base(MASK, DEPTH, K, np.eye(4), "target")),
    ("P_cam", lambda: project(np.zeros((4, 2)), K)),
    ("P_cam", lambda: project(np.zeros((3, 4)), K)),
    ("K", lambda: project(CLOUD, K_SINGULAR)),
    ("u", lambda: back_projection_jacobian(np.nan, 1.0, 1.0, K)),
    ("v", lambda: back_projection_jacobian(1.0, np.array([1.0, 2.0]), 1.0, K)),
    ("d", lambda: back_projection_jacobian(1.0, 1.0, 0.0, K)),
    ("d", lambda: back_projection_jacobian(1.0, 1.0, np.nan, K)),
    ("K", lambda: back_projection_jacobian(1.0, 1.0, 1.0, K_TRANSPOSED)),
    ("sigma_pixel", lambda: back_projection_noise(1.0, 1.0, 1.0, K, -0.5, 0.1)),
    ("sigma_depth", lambda: back_projection_noise(1.0, 1.0, 1.0, K, 0.5, np.nan)),
    ("T", lambda: transform_points(T_MIRROR, CLOUD)),
    ("P", lambda: transform_points(np.eye(4), np.zeros((5, 4)))),
    ("P", lambda: transform_points(np.eye(4), np.zeros((5, 3), int))),
    ("P", lambda: transform_points(np.eye(4), np.float64(1.0))),
    ("T", lambda: invert_transform(T_STRETCHED)),
    ("P", lambda: centroid_and_covariance(np.zeros((0, 3)))),
    ("P", lambda: centroid_and_covariance(NAN_CLOUD)),
    ("P", lambda: centroid_and_covariance(np.zeros((3, 5)))),
    ("P", lambda: principal_axes(np.zeros((0, 3)))),
    ("P", lambda: principal_axes(NAN_CLOUD)),
    ("tolerance", lambda: principal_axes(CLOUD, tolerance=1.5)),
    ("tolerance", lambda: principal_axes(CLOUD, tolerance=np.nan)),
    ("P", lambda: remove_outliers(NAN_CLOUD)),
    ("P", lambda: remove_outliers(np.zeros((2, 2, 3)))),
    ("radius", lambda: remove_outliers(CLOUD, radius=0.0)),
    ("radius", lambda: remove_outliers(CLOUD + np.arange(5.0)[:, None], radius=1e-9)),
    ("min_neighbours", lambda: remove_outliers(CLOUD, min_neighbours=-1)),
    ("min_neighbours", lambda: remove_outliers(CLOUD, min_neighbours=2.5)),
    ("P", lambda: cluster(NAN_CLOUD)),
    ("gap", lambda: cluster(CLOUD, gap=-0.1)),
    ("gap", lambda: cluster(CLOUD, gap=np.inf)),
    ("min_points", lambda: cluster(CLOUD, min_points=0)),
]


@pytest.mark.bad_input
@pytest.mark.parametrize(("name", "call"), BAD, ids=[f"{i}-{name}" for i, (name, _) in enumerate(BAD)])
def test_bad_input_is_an_error_that_names_the_argument(name, call):
    with pytest.raises(ValueError, match=rf"^{name}: expected "):
        call()


# --------------------------------------------------------------------------------------------------- the table's plane


@pytest.mark.parametrize("seed", range(4))
def test_the_fitted_plane_is_the_tables_among_things_and_noise(seed):
    """Half of the points stand on the table or float; the plane is within the standard error of the true one."""
    rng = np.random.default_rng(seed)
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    u = np.cross(normal, [1.0, 0.0, 0.0])
    u /= np.linalg.norm(u)
    v = np.cross(normal, u)
    a, b = rng.uniform(-0.5, 0.5, (2, 4000))
    table = 0.8 * normal + a[:, None] * u + b[:, None] * v + rng.normal(0.0, 0.002, (4000, 1)) * normal
    things = 0.8 * normal + rng.uniform(-0.5, 0.5, (4000, 2)) @ [u, v] + rng.uniform(-0.3, -0.03, (4000, 1)) * normal
    plane = geometry.fit_plane(np.vstack([table, things]).astype(np.float32))
    assert np.degrees(np.arccos(min(1.0, -plane.normal @ normal))) < 0.05, "towards the viewer, who is on the near side"
    assert abs(plane.offset - 0.8) < 0.0005
    assert plane.inliers[:4000].mean() > 0.999 and plane.inliers[4000:].mean() < 0.05
    assert plane.residual == pytest.approx(0.002, rel=0.1)


@pytest.mark.parametrize(
    ("P", "message"),
    [
        (np.zeros((2, 3)), "three points"),
        (np.outer(np.arange(20.0), [1.0, 2.0, 3.0]), "on a line"),
        (np.full((5, 3), np.nan), "P"),
    ],
)
def test_what_spans_no_plane_is_refused(P, message):
    with pytest.raises(ValueError, match=message):
        geometry.fit_plane(P)
