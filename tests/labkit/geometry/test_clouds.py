"""Clouds against NumPy's statistics, brute force over all pairs of points, and shapes whose answer is known."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scenes import pose
from scipy.sparse.csgraph import connected_components

from labkit.geometry import (
    centroid_and_covariance,
    cluster_indices,
    fit_plane,
    inlier_indices,
    principal_axes,
    transform_points,
)

finite = {"allow_nan": False, "allow_infinity": False}


@given(P=arrays(np.float64, st.tuples(st.integers(1, 30), st.just(3)), elements=st.floats(-100.0, 100.0, **finite)))
@settings(max_examples=60, deadline=None)
def test_centroid_and_covariance_agree_with_numpy(P):
    mu, Sigma = centroid_and_covariance(P)
    np.testing.assert_allclose(mu, P.mean(axis=0), atol=1e-10)
    np.testing.assert_allclose(Sigma, np.cov(P.T, bias=True), atol=1e-9)


def test_reductions_are_float64_because_float32_ones_are_wrong_in_the_fourth_digit():
    x, y = np.meshgrid(np.linspace(0.3, 0.7, 200), np.linspace(-0.2, 0.2, 200))
    table = np.column_stack([x.ravel(), y.ravel(), np.full(40_000, 0.7)]).astype(np.float32)
    mu, Sigma = centroid_and_covariance(table)
    assert abs(table.mean(axis=0)[2] - table[0, 2]) > 2e-4  # what NumPy does with float32 unasked: a quarter millimetre
    assert abs(mu[2] - float(table[0, 2])) < 1e-12
    np.testing.assert_allclose(Sigma, np.cov(table.T.astype(np.float64), bias=True), rtol=1e-9, atol=1e-15)


def box_cloud(edges, n: int = 4000) -> np.ndarray:
    return np.random.default_rng(17).uniform(-0.5, 0.5, (n, 3)) * edges


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
    P = transform_points(T, box_cloud(edges)).astype(np.float32)
    found = principal_axes(P)
    assert found.problem == "" and found.determined.all()
    for column, edge in enumerate((0, 2, 1)):  # longest first
        assert angle_between(found.axes[:, column], T[:3, edge]) < 2.0
    np.testing.assert_allclose(found.variances, np.sort(edges**2 / 12.0)[::-1], rtol=0.1)
    np.testing.assert_allclose(found.axes.T @ found.axes, np.eye(3), atol=1e-12)
    assert np.linalg.det(found.axes) > 0.999
    shuffled = np.random.default_rng(0).permutation(P)  # an axis does not flip with the order of the points
    np.testing.assert_allclose(principal_axes(shuffled).axes, found.axes, atol=1e-6)


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
        (box_cloud((0.1, 0.05, 0.0)), [True, True, True], "", T[:3, 0]),  # a flat rectangle has all three
    ]
    for P, determined, words, axis in cases:
        found = principal_axes(transform_points(T, P).astype(np.float32))
        assert found.determined.tolist() == determined, words
        assert words in found.problem
        assert np.isnan(found.axes[:, ~found.determined]).all()
        assert np.isfinite(found.variances).all() and (found.variances >= 0.0).all()
        if axis is not None:
            assert angle_between(found.axes[:, found.determined][:, 0], axis) < (0.1 if words else 2.0)


def test_the_tolerance_decides_what_counts_as_equal():
    corners = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-0.9, 0.9) for z in (-0.3, 0.3)])
    assert principal_axes(corners, tolerance=0.1).determined.all()  # 0.81 of the variance of x
    assert principal_axes(corners, tolerance=0.3).determined.tolist() == [False, False, True]


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
    plane = fit_plane(np.vstack([table, things]).astype(np.float32))
    assert np.degrees(np.arccos(min(1.0, -plane.normal @ normal))) < 0.05, "towards the viewer, who is on the near side"
    assert abs(plane.offset - 0.8) < 0.0005
    assert plane.inliers[:4000].mean() > 0.999 and plane.inliers[4000:].mean() < 0.05
    assert plane.residual == pytest.approx(0.002, rel=0.1)


# Outliers and separate objects


def squared_distances(P) -> np.ndarray:
    x, y, z = (P[:, None] - P[None]).astype(np.float64).transpose(2, 0, 1)
    return x * x + y * y + z * z


# Points on a lattice make many distances that are exactly the gap; free ones make all the others.
clouds = st.one_of(
    arrays(np.float64, st.tuples(st.integers(0, 60), st.just(3)), elements=st.integers(-4, 4).map(float)),
    arrays(np.float64, st.tuples(st.integers(0, 60), st.just(3)), elements=st.floats(-4.0, 4.0, **finite)),
    arrays(np.float32, st.tuples(st.integers(0, 60), st.just(3)), elements=st.floats(-2.0, 2.0, width=32, **finite)),
)
reaches = st.sampled_from([0.25, 0.7, 1.0, 1.5, 1.7, 3.0])


@given(P=clouds, gap=reaches, min_points=st.integers(1, 5))
@settings(max_examples=100, deadline=None)
def test_clusters_are_those_of_brute_force_single_linkage(P, gap, min_points):
    found = [P[group] for group in cluster_indices(P, gap=gap, min_points=min_points)]
    if len(P) == 0:
        assert found == []
        return
    _, group = connected_components(squared_distances(P) <= gap * gap)
    expected = [P[group == g] for g in range(group.max() + 1)]
    expected = [points for points in expected if len(points) >= min_points]
    sizes = [len(points) for points in found]
    assert sizes == sorted((len(points) for points in expected), reverse=True)
    assert {points.tobytes() for points in found} == {points.tobytes() for points in expected}


@given(P=clouds, radius=reaches, min_neighbours=st.integers(0, 6))
@settings(max_examples=100, deadline=None)
def test_outliers_are_those_that_brute_force_finds(P, radius, min_neighbours):
    neighbours = (squared_distances(P) <= radius * radius).sum(axis=1) - 1 if len(P) else np.zeros(0)
    expected = np.flatnonzero(neighbours >= min_neighbours)
    np.testing.assert_array_equal(inlier_indices(P, radius, min_neighbours), expected)


def test_dense_clouds_agree_with_brute_force_too():
    rng = np.random.default_rng(19)
    P = (rng.normal(size=(700, 3)) * (0.06, 0.06, 0.01) + (0.5, -0.2, 0.0)).astype(np.float32)
    near = squared_distances(P) <= 0.01**2
    np.testing.assert_array_equal(inlier_indices(P, 0.01, 6), np.flatnonzero(near.sum(axis=1) - 1 >= 6))
    _, group = connected_components(near)
    sizes = sorted(np.bincount(group), reverse=True)
    assert [len(points) for points in cluster_indices(P, 0.01, 1)] == sizes
    far = np.vstack([P, np.array([[90.0, -90.0, 90.0]], np.float32)])  # one far point does not disturb the rest
    assert [len(points) for points in cluster_indices(far, 0.01, 1)] == [*sizes, 1]


@pytest.mark.parametrize("away", [(5e5, 0.0, 0.0), (0.0, -5e5, 3e5)])
def test_a_small_cloud_that_is_far_away_is_as_good_as_any(away):
    """What counts is its own width along each axis, not how the axes differ."""
    P = box_cloud((0.05, 0.03, 0.02), 300)
    far = P + away
    groups, near = cluster_indices(far, 0.01, 5), cluster_indices(P, 0.01, 5)
    assert [g.tolist() for g in groups] == [g.tolist() for g in near] and len(inlier_indices(far, 0.01)) > 200
    sheet = np.where([1, 1, 0], P, 0.0) + away
    assert fit_plane(sheet, 0.001).inliers.all()


# Bad input

CLOUD, NAN_CLOUD = np.zeros((5, 3)), np.array([[0.0, 0.0, np.nan]])

BAD = [
    ("P", centroid_and_covariance, {"P": np.zeros((0, 3))}),
    ("P", principal_axes, {"P": np.zeros((0, 3))}),
    ("tolerance", principal_axes, {"P": CLOUD, "tolerance": 1.5}),
    ("P", fit_plane, {"P": np.zeros((2, 3))}),
    ("P", fit_plane, {"P": np.outer(np.arange(20.0), [1.0, 2.0, 3.0])}),
    ("P", inlier_indices, {"P": NAN_CLOUD}),
    ("radius", inlier_indices, {"P": CLOUD, "radius": 0.0}),
    ("radius", inlier_indices, {"P": CLOUD + np.arange(5.0)[:, None], "radius": 1e-9}),
    ("min_neighbours", inlier_indices, {"P": CLOUD, "min_neighbours": -1}),
    ("min_neighbours", inlier_indices, {"P": CLOUD, "min_neighbours": 2.5}),
    ("gap", cluster_indices, {"P": CLOUD, "gap": -0.1}),
    ("min_points", cluster_indices, {"P": CLOUD, "min_points": 0}),
]


@pytest.mark.bad_input
@pytest.mark.parametrize(("name", "function", "arguments"), BAD)
def test_bad_input_is_an_error_that_names_the_argument(name, function, arguments):
    with pytest.raises(ValueError, match=rf"^{name}: expected "):
        function(**arguments)
