"""Every solver against brute force, one another, scipy's maximum flow, and attempts to refute its lower bound."""

import time
from itertools import product

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from random_crf import random_crf
from scipy.ndimage import gaussian_filter
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import maximum_flow

from labkit.crf import METHODS, MapResult, PottsCRF, solve
from labkit.crf.energy import pair_slices
from labkit.crf.exact import grid_max_flow
from labkit.crf.integers import inside, quantise

APPROXIMATE = ("icm", "mean_field", "expansion", "trws", "trws+expansion", "persistency")
BOUNDED = ("unary", "trws", "trws+expansion", "persistency")

# Shapes with at most 3^9 or 2^12 labellings, degenerate ones included.
tiny = st.one_of(
    st.tuples(st.integers(1, 3), st.integers(1, 3), st.integers(2, 3)),
    st.tuples(st.just(1), st.integers(1, 6), st.integers(2, 4)),
    st.tuples(st.integers(1, 6), st.just(1), st.integers(2, 4)),
    st.tuples(st.integers(2, 3), st.integers(2, 4), st.just(2)),
    st.tuples(st.just(1), st.integers(1, 2), st.integers(5, 21)),
)
models = st.builds(
    lambda shape, seed, connectivity, lam, forbidden: random_crf(seed, *shape, connectivity, lam, forbidden),
    shape=tiny,
    seed=st.integers(0, 2**32 - 1),
    connectivity=st.sampled_from([4, 8]),
    lam=st.sampled_from([0.0, 0.2, 1.0, 4.0, 1e6, 1e11]),
    forbidden=st.sampled_from([0.0, 0.0, 0.3]),
)


@settings(max_examples=150, deadline=None)
@given(crf=models)
@example(crf=random_crf(7656, 1, 3, 2, 4, lam=1e11))  # one class is the cheapest at each pixel, by far less than lam
def test_against_brute_force(crf):
    optimum = solve(crf, "brute_force").energy
    close = 1e-9 * (1.0 + abs(optimum))
    for method in (*APPROXIMATE, *BOUNDED, *(["min_cut"] if crf.shape[2] == 2 else [])):
        result = solve(crf, method)
        assert result.energy >= optimum - close, method
        assert result.energy == pytest.approx(crf.energy(result.labels), rel=1e-12, abs=1e-12)
        assert result.lower_bound <= optimum, method  # sound: not even by a rounding error above
        assert result.labels.dtype == np.uint8 and result.labels.shape == crf.shape[:2]
    if crf.shape[2] == 2:
        for method in ("min_cut", "trws"):
            tight = solve(crf, method, **({"iterations": 300, "tolerance": 0.0} if method == "trws" else {}))
            assert tight.energy == pytest.approx(optimum, abs=1e-4 * (1.0 + abs(optimum))), method
            assert tight.lower_bound == pytest.approx(optimum, abs=1e-3 * (1.0 + abs(optimum))), method


@settings(max_examples=60, deadline=None)
@given(crf=models, seed=st.integers(0, 1000))
def test_expansion_reaches_twice_the_optimum_at_most_and_no_single_move_is_left(crf, seed):
    result = solve(crf, "expansion", labels=crf.unary.argmin(axis=2))
    shifted = PottsCRF(crf.unary - crf.unary.min(axis=2, keepdims=True), crf.weights)  # costs >= 0, as the theorem asks
    assert shifted.energy(result.labels) <= 2.0 * solve(shifted, "brute_force").energy + 1e-4
    rng = np.random.default_rng(seed)
    for alpha in range(crf.shape[2]):
        moved = np.where(rng.random(crf.shape[:2]) < 0.5, alpha, result.labels)
        assert crf.energy(moved) >= result.energy - 1e-4 * (1.0 + abs(result.energy))


@pytest.mark.parametrize(("method", "C"), [*product((*APPROXIMATE, "unary"), (2, 5, 21)), ("min_cut", 2)])
def test_without_pairwise_term_all_methods_give_the_cheapest_class(method, C):
    """Problem 3 of the text."""
    crf = random_crf(C, 17, 23, C, 8, lam=0.0)
    result = solve(crf, method)
    assert np.array_equal(result.labels, crf.unary.argmin(axis=2))
    if method in BOUNDED:
        assert result.gap < 1e-11


def test_order_of_the_methods_on_a_noisy_image():
    crf = noisy_image(0, 60, 80, 4, 0.5, 1.5)
    energy = {method: solve(crf, method).energy for method in (*APPROXIMATE, "unary")}
    assert energy["trws+expansion"] <= energy["expansion"] < energy["icm"] < energy["unary"]
    assert energy["trws+expansion"] <= energy["trws"]
    annealed = solve(crf, "mean_field", temperatures=(2.0, 0.2), iterations=20)
    assert annealed.energy < energy["mean_field"]


@pytest.mark.parametrize("connectivity", [4, 8])
def test_the_default_certifies_its_answer(connectivity):
    result = solve(noisy_image(1, 120, 160, 5, 0.55, 1.2, connectivity))
    assert 0.0 <= result.gap < 2e-3
    assert result.seconds > 0.0 and result.iterations > 0


def test_more_iterations_of_trws_do_not_lower_what_is_proven():
    crf = noisy_image(3, 40, 50, 5, 0.3, 2.0)
    bounds = [solve(crf, "trws", iterations=n, tolerance=0.0).lower_bound for n in (1, 3, 10, 30)]
    assert bounds == sorted(bounds)


def test_icm_never_raises_the_energy_of_its_start():
    crf = noisy_image(4, 30, 40, 5, 0.4, 1.2, 8)
    start = np.random.default_rng(0).integers(0, 5, (30, 40))
    before = start.copy()
    energies = [solve(crf, "icm", labels=start, iterations=n).energy for n in (1, 2, 5, 100)]
    assert [crf.energy(start), *energies] == sorted([crf.energy(start), *energies], reverse=True)
    assert np.array_equal(start, before)


@pytest.mark.parametrize("connectivity", [4, 8])
def test_flow_through_a_whole_image_equals_scipys(connectivity):
    crf = noisy_image(5, 240, 320, 2, 0.3, 2.0, connectivity)
    integer = quantise(crf)
    unary, weights = (inside(flat, integer.size) >> 6 for flat in (integer.unary, integer.weights))
    excess, weights = unary[..., 1] - unary[..., 0], weights.transpose(2, 0, 1)  # scipy takes int32 sums only
    flow, source_side = grid_max_flow(excess, weights, crf.offsets)
    assert flow == scipy_flow(excess, weights, crf.offsets)
    # The cut that the labels describe costs what flows: duality, and so both are optimal.
    y = source_side == 0
    cut = excess[(excess > 0) & y].sum(dtype=np.int64) - excess[(excess < 0) & ~y].sum(dtype=np.int64)
    for w, offset in zip(weights, crf.offsets, strict=True):
        p, q = pair_slices(offset)
        cut += w[p][y[p] != y[q]].sum(dtype=np.int64)
    assert flow == cut


@settings(max_examples=60, deadline=None)
@given(
    shape=st.tuples(st.integers(1, 7), st.integers(1, 7)), seed=st.integers(0, 10**6), top=st.sampled_from([1, 3, 1000])
)
def test_flow_through_small_grids_with_many_ties_equals_scipys(shape, seed, top):
    rng = np.random.default_rng(seed)
    excess = rng.integers(-top, top + 1, shape).astype(np.int32)
    weights = np.zeros((4, *shape), np.int32)
    offsets = ((0, 1), (1, 0), (1, 1), (1, -1))
    for d, offset in enumerate(offsets):
        p, _ = pair_slices(offset)
        weights[d][p] = rng.integers(0, top + 1, weights[d][p].shape)
    assert grid_max_flow(excess, weights, offsets)[0] == scipy_flow(excess, weights, offsets)


@pytest.mark.parametrize("method", METHODS)
def test_every_method_says_its_seconds_whoever_calls_it(method):
    crf = noisy_image(0, 3, 4, 2, 1.0, 0.5)
    start = time.perf_counter()
    own, by_name = METHODS[method](crf), solve(crf, method)
    assert own.seconds > 0.0 and by_name.seconds > 0.0
    assert own.seconds + by_name.seconds < time.perf_counter() - start
    assert np.array_equal(own.labels, by_name.labels)


def test_gap_is_relative_and_infinite_without_proof():
    labels = np.zeros((1, 1), np.uint8)
    assert MapResult(labels, 10.0, 9.0).gap == pytest.approx(0.1)
    assert MapResult(labels, -10.0, -11.0).gap == pytest.approx(0.1)
    assert MapResult(labels, 0.0, 0.0).gap == 0.0
    assert MapResult(labels, 10.0).gap == np.inf
    assert set(METHODS) == {"brute_force", "min_cut", "unary", *APPROXIMATE}


def noisy_image(seed, H, W, C, snr, lam, connectivity=4) -> PottsCRF:
    """Blobs of C classes, noisy scores, and an image that shows the blobs' edges."""
    rng = np.random.default_rng(seed)
    y = gaussian_filter(rng.normal(size=(H, W, C)), (8, 8, 0)).argmax(axis=2)
    psi = -2.0 * snr * np.eye(C)[y] + rng.normal(0.0, 0.85, (H, W, C))
    image = rng.random((C, 3))[y] + rng.normal(0.0, 0.05, (H, W, 3))
    return PottsCRF.from_image(psi, image, lam, 0.12, 1.0, connectivity)


def scipy_flow(excess, weights, offsets) -> int:
    """The maximum flow of the same graph, as a list of arcs between numbered nodes."""
    H, W = excess.shape
    node = np.arange(H * W).reshape(H, W)
    source, sink = H * W, H * W + 1
    tails, heads, room = [], [], []
    for w, offset in zip(weights, offsets, strict=True):
        p, q = pair_slices(offset)
        tails += [node[p].ravel(), node[q].ravel()]
        heads += [node[q].ravel(), node[p].ravel()]
        room += [w[p].ravel(), w[p].ravel()]
    tails += [np.full(H * W, source), node.ravel()]
    heads += [node.ravel(), np.full(H * W, sink)]
    room += [np.maximum(excess, 0).ravel(), np.maximum(-excess, 0).ravel()]
    arcs = coo_matrix((np.concatenate(room), (np.concatenate(tails), np.concatenate(heads))), (H * W + 2,) * 2)
    return int(maximum_flow(arcs.tocsr().astype(np.int32), source, sink).flow_value)
