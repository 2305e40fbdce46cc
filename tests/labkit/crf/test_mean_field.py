"""Enumeration and mean field against each other, the lattice against the sum over all pairs of pixels."""

import itertools

import numpy as np
import pytest
from random_crf import random_crf
from scipy.ndimage import gaussian_filter
from scipy.special import logsumexp, softmax

from labkit.crf import PottsCRF, dense_crf, log_partition, marginals
from labkit.crf.dense import GaussianFilter, elevation
from labkit.crf.energy import pair_slices
from labkit.crf.mean_field import mean_field_marginals


def free_energy(crf, q):
    """F(q) = <E>_q - entropy(q)."""
    used = q > 0.0  # 0 log 0 = 0, and a class without probability costs nothing
    F = (q[used] * (crf.unary[used] + np.log(q[used]))).sum()
    for w, offset in zip(crf.weights, crf.offsets, strict=True):
        a, b = pair_slices(offset)
        F += (w[a] * (1.0 - (q[a] * q[b]).sum(axis=2))).sum()
    return F


def test_without_pairwise_term_Z_and_marginals_factorise():
    """Problem 3 of the text, for the whole distribution."""
    crf = random_crf(0, 2, 3, 3, lam=0.0)
    assert log_partition(crf) == pytest.approx(logsumexp(-crf.unary, axis=2).sum())
    assert marginals(crf) == pytest.approx(softmax(-crf.unary, axis=2))


def test_Z_of_two_pixels_by_hand():
    psi, w = np.array([[[0.2, 1.0], [0.7, 0.1]]]), 0.9
    crf = PottsCRF(psi, np.array([[[w, 0.0]], [[0.0, 0.0]]]))
    Z = np.exp(-0.9) + np.exp(-0.2 - 0.1 - w) + np.exp(-1.0 - 0.7 - w) + np.exp(-1.1)
    assert log_partition(crf) == pytest.approx(np.log(Z))
    assert marginals(crf)[0, 0, 0] == pytest.approx((np.exp(-0.9) + np.exp(-0.2 - 0.1 - w)) / Z)


def test_marginals_are_the_gradient_of_log_Z():
    crf, step = random_crf(4, 2, 3, 3, 8), 1e-5
    p = marginals(crf)
    for index in [(0, 0, 0), (1, 2, 1), (0, 1, 2)]:
        nudge = np.zeros(crf.shape)
        nudge[index] = step
        up, down = (log_partition(PottsCRF(crf.unary + sign * nudge, crf.weights)) for sign in (1, -1))
        assert (down - up) / (2 * step) == pytest.approx(p[index], abs=1e-8)


def test_a_forbidden_class_has_no_probability():
    crf = random_crf(5, 2, 4, 3, forbidden=0.5)
    p = marginals(crf)
    assert (p[np.isinf(crf.unary)] == 0.0).all() and p.sum(axis=2) == pytest.approx(np.ones((2, 4)))
    assert np.isfinite(free_energy(crf, mean_field_marginals(crf)))


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("connectivity", [4, 8])
def test_free_energy_bounds_log_Z_and_falls_with_every_sweep(seed, connectivity):
    crf = random_crf(seed, 3, 4, 2, connectivity, lam=1.5)
    falling = [free_energy(crf, mean_field_marginals(crf, n)) for n in range(1, 8)]
    assert all(later <= earlier + 1e-12 for earlier, later in itertools.pairwise(falling))
    assert falling[-1] >= -log_partition(crf)


def test_mean_field_stops_where_each_pixel_is_the_softmax_of_its_mean_cost():
    crf = random_crf(6, 4, 5, 3, 4, lam=0.4)
    q = mean_field_marginals(crf, 200)
    cost = crf.unary.copy()
    cost[:, 1:] -= crf.weights[0][:, :-1, None] * q[:, :-1]
    cost[:, :-1] -= crf.weights[0][:, :-1, None] * q[:, 1:]
    cost[1:] -= crf.weights[1][:-1, :, None] * q[:-1]
    cost[:-1] -= crf.weights[1][:-1, :, None] * q[1:]
    assert q == pytest.approx(softmax(-cost, axis=2), abs=1e-9)


def all_pairs_filter(features, values):
    """The symmetrically normalised Gaussian, summed over all pairs."""
    f = features.reshape(-1, features.shape[2])
    K = np.exp(-0.5 * ((f[:, None] - f[None]) ** 2).sum(axis=2))
    scale = 1.0 / np.sqrt(K.sum(axis=1))
    return scale[:, None] * (K @ (scale[:, None] * values))


@pytest.mark.parametrize("colours", [0, 1, 3])
def test_the_lattice_is_close_to_the_sum_over_all_pairs(colours):
    rng = np.random.default_rng(colours)
    v, u = np.indices((24, 32)) / 5.0
    shades = [np.sin(0.3 * (k + 1) * u) + 0.5 * v for k in range(colours)]
    features = np.stack([u, v, *shades], axis=2)
    values = rng.random((24 * 32, 2)).astype(np.float32) + (u.ravel()[:, None] > 3)
    filtered = GaussianFilter("features", features).filtered(values)
    exact = all_pairs_filter(features, values)
    error = np.abs(filtered - exact) / exact.mean()
    assert np.median(error) < 0.03 and error.max() < 0.25
    assert np.corrcoef(filtered.ravel(), exact.ravel())[0, 1] > 0.995


def lattice_by_hand(features, values):
    """The permutohedral lattice pixel by pixel, its corners in a dict: splat, blur along each direction, slice."""
    d = features.shape[1]
    corners = []  # of each pixel: (coordinates, weight)
    for y in features @ elevation(d).T:
        base = (d + 1) * np.round(y / (d + 1)).astype(int)
        order = np.argsort(base - y, kind="stable")  # furthest above its multiple first
        for _ in range(abs(excess := base.sum() // (d + 1))):
            if excess > 0:  # the least above is lowered
                last = order[-1]
                base[last] -= d + 1
                order = np.append(last, order[:-1])
            else:
                first = order[0]
                base[first] += d + 1
                order = np.append(order[1:], first)
        above = (y - base)[order] / (d + 1)
        weights = [1.0 - above[0] + above[-1], *(above[:-1] - above[1:])[::-1]]
        for r, weight in enumerate(weights):
            step = np.full(d + 1, r)
            step[order[d + 1 - r :]] -= d + 1
            corners.append((tuple(base + step), weight))
    size = len(features)

    def filtered(pixels):
        at = {corner: 0.0 for corner, _ in corners}
        for k, (corner, weight) in enumerate(corners):
            at[corner] = at[corner] + weight * pixels[k // (d + 1)]
        for j in range(d + 1):
            step = (d + 1) * np.eye(d + 1, dtype=int)[j] - 1
            near = {corner: (tuple(corner + step), tuple(corner - step)) for corner in at}
            at = {c: at[c] + 0.5 * sum(at.get(other, 0.0) for other in near[c]) for c in at}
        sliced = [weight * at[corner] for corner, weight in corners]
        return np.array(sliced).reshape(size, d + 1, -1).sum(axis=1)

    scale = 1.0 / np.sqrt(filtered(np.ones((size, 1))))
    return scale * filtered(scale * values)


@pytest.mark.parametrize("d", [1, 2, 3, 5, 6])
def test_the_lattice_is_the_one_of_the_paper(d):
    """The same sums as in plain loops over pixels and corners, whichever numbers the corners got."""
    rng = np.random.default_rng(d)
    features, values = rng.normal(0.0, 2.0, (8, 10, d)), rng.random((80, 3)).astype(np.float32)
    expected = lattice_by_hand(features.reshape(-1, d), values)
    assert GaussianFilter("features", features).filtered(values) == pytest.approx(expected, rel=1e-3, abs=1e-4)


@pytest.mark.parametrize(("noise", "share"), [(False, 0.015), pytest.param(True, 0.2, marks=pytest.mark.nightly)])
def test_the_dense_crf_is_as_far_from_exact_mean_field_as_it_says(noise, share):
    rng = np.random.default_rng(3)
    H, W, C = 40, 60, 4
    y = np.stack([gaussian_filter(rng.normal(size=(H, W)), 6.0) for _ in range(C)]).argmax(axis=0)
    image = rng.integers(0, 256, (H, W, 3)) if noise else rng.integers(0, 256, (C, 3))[y] + rng.normal(0, 8, (H, W, 3))
    unary = rng.normal(size=(H, W, C)) - (0.0 if noise else 1.0) * np.eye(C)[y]
    v, u = np.indices((H, W))
    q = softmax(-unary.reshape(-1, C), axis=1)
    for _ in range(10):
        appearance = all_pairs_filter(np.dstack([u / 60.0, v / 60.0, image / 10.0]), q)
        q = softmax(-unary.reshape(-1, C) + 10 * appearance + 3 * all_pairs_filter(np.dstack([u, v]) / 3.0, q), axis=1)
    differ = (dense_crf(unary, image).argmax(axis=2).ravel() != q.argmax(axis=1)).mean()
    assert (0.05 if noise else 0.0) <= differ < share


def test_dense_mean_field_on_a_small_image_is_close_to_all_pairs():
    rng = np.random.default_rng(1)
    H, W, C = 16, 20, 3
    image = np.zeros((H, W, 3))
    image[:, 10:] = 100.0
    unary = rng.normal(size=(H, W, C)) - 0.5 * np.eye(C)[(np.arange(W) >= 10) * 2]
    v, u = np.indices((H, W))
    q = softmax(-unary.reshape(-1, C), axis=1)
    for _ in range(5):
        appearance = all_pairs_filter(np.dstack([u / 8.0, v / 8.0, image / 20.0]), q)
        q = softmax(-unary.reshape(-1, C) + 4.0 * appearance + all_pairs_filter(np.dstack([u, v]) / 2.0, q), axis=1)
    options = {"theta_alpha": 8.0, "theta_beta": 20.0, "w_appearance": 4.0, "theta_gamma": 2.0, "w_smoothness": 1.0}
    ours = dense_crf(unary, image, iterations=5, **options)
    agree = ours.argmax(axis=2).ravel() == q.argmax(axis=1)
    assert agree.mean() > 0.97
    assert ours.sum(axis=2) == pytest.approx(np.ones((H, W)), abs=1e-5)


def test_dense_crf_without_weights_is_the_softmax_of_the_unary_term():
    unary = np.random.default_rng(2).normal(size=(6, 7, 4))
    q = dense_crf(unary, np.zeros((6, 7)), w_appearance=0.0, w_smoothness=0.0)
    assert q == pytest.approx(softmax(-unary, axis=2), abs=1e-6)


@pytest.mark.bad_input
@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("unary", {"unary": np.full((4, 5, 2), np.inf)}),
        ("image", {"image": np.zeros((5, 4, 3))}),
        ("theta_alpha", {"theta_alpha": 0.0}),
        ("theta_beta", {"theta_beta": np.nan}),
        ("w_smoothness", {"w_smoothness": -1.0}),
        ("iterations", {"iterations": -1}),
        ("iterations", {"iterations": 10**9}),
        ("iterations", {"iterations": True}),
        ("theta_gamma", {"theta_gamma": 1e-8}),
        ("theta_gamma", {"theta_gamma": "3"}),
        ("theta_beta", {"image": np.full((4, 5, 3), 2**62)}),
        ("unary", {"unary": np.full((4, 5, 2), 2.0**62) * 1e20}),
        ("w_appearance", {"w_appearance": 1e300}),
        ("image", {"image": np.zeros((4, 5, 17))}),
        ("image", {"image": np.ma.masked_all((4, 5, 3))}),
        ("unary", {"unary": np.ma.masked_greater(np.eye(20).reshape(20, 10, 2), 0.5)}),
        ("theta", {"theta_alpha": 1e-4, "theta_beta": 1e-6, "image": np.arange(60).reshape(4, 5, 3) * 1.0}),
    ],
)
def test_bad_input_names_the_argument(name, arguments):
    with pytest.raises(ValueError, match=name):
        dense_crf(**{"unary": np.zeros((4, 5, 2)), "image": np.zeros((4, 5, 3)), **arguments})


@pytest.mark.parametrize(
    "options", [{"w_appearance": 1e30, "w_smoothness": 1e30}, {"theta_gamma": 1e-3}, {"theta_beta": 1.0}]
)
def test_the_largest_that_is_taken_gives_probabilities(options):
    """At the limits each pixel's classes still sum to 1: no NaN in silence."""
    image = np.random.default_rng(0).integers(0, 256, (4, 5, 3))
    q = dense_crf(np.full((4, 5, 2), 1e30), image, **{"theta_beta": 10.0, **options})
    assert q.sum(axis=2) == pytest.approx(np.ones((4, 5)))
