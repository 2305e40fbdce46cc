"""The Potts energy against a loop over pixels, its integer version against its promises, and bad input."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_crf import as_crf, random_crf

from labkit.crf import PottsCRF, dense_crf, refine, solve, unary_from_probabilities
from labkit.crf.integers import quantise


def energy_by_loop(unary, image, lam, sigma_I, sigma_p, connectivity, y):
    """The text's formula, pixel by pixel and pair by pair."""
    H, W, _ = unary.shape
    total = sum(unary[v, u, y[v, u]] for v in range(H) for u in range(W))
    for v in range(H):
        for u in range(W):
            for b in range(H):
                for a in range(W):
                    far = (v - b) ** 2 + (u - a) ** 2
                    neighbours = far == 1 or (connectivity == 8 and far == 2)
                    if neighbours and (v, u) < (b, a) and y[v, u] != y[b, a]:
                        colour = ((image[v, u].astype(float) - image[b, a].astype(float)) ** 2).sum()
                        total += lam * np.exp(-colour / (2 * sigma_I**2) - far / (2 * sigma_p**2))
    return total


@pytest.mark.parametrize("connectivity", [4, 8])
@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
@pytest.mark.parametrize("labels", [np.uint8, np.int16, np.int64])
def test_energy_is_the_formula_of_the_text(connectivity, dtype, labels):
    rng = np.random.default_rng(3)
    unary, image = rng.normal(size=(4, 5, 3)), rng.integers(0, 256, (4, 5, 3)).astype(dtype)
    y = rng.integers(0, 3, (4, 5)).astype(labels)
    crf = PottsCRF.from_image(unary, image, 1.7, 60.0, 1.3, connectivity)
    assert crf.energy(y) == pytest.approx(energy_by_loop(unary, image, 1.7, 60.0, 1.3, connectivity, y), rel=1e-12)


def test_a_depth_edge_lowers_the_weight_and_a_missing_reading_does_not():
    image, depth = np.zeros((1, 4)), np.array([[1.0, 1.0, 1.1, np.nan]])
    w = PottsCRF.from_image(np.zeros((1, 4, 2)), image, 1.0, 1.0, extra=((depth, 0.05),)).weights[0, 0]
    flat = np.exp(-0.5)
    assert w[:3] == pytest.approx([flat, flat * np.exp(-(0.1**2) / (2 * 0.05**2)), flat])


def test_a_forbidden_class_costs_infinity():
    unary = np.zeros((1, 2, 2))
    unary[0, 0, 1] = np.inf
    crf = PottsCRF(unary, np.zeros((2, 1, 2)))
    assert crf.energy(np.array([[1, 0]])) == np.inf
    assert crf.energy(np.array([[0, 1]])) == 0.0


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    lam=st.sampled_from([0.0, 1e-9, 0.3, 5.0, 1e4, 1e12]),
    unit=st.sampled_from([1e-6, 1.0, 1e7]),
    forbidden=st.sampled_from([0.0, 0.4]),
)
def test_integer_energy_never_exceeds_the_real_one(seed, lam, unit, forbidden):
    crf = random_crf(seed, 3, 4, 3, 8, lam, forbidden)
    crf = PottsCRF(unit * crf.unary + 3 * unit, crf.weights)
    integer = quantise(crf)
    assert integer.unary.min(axis=1).max() == 0
    y = np.random.default_rng(seed).integers(0, 3, (3, 4))
    assert integer.lower_bound(int(as_crf(integer).energy(y)), crf.energy(y)) <= crf.energy(y)
    # Costs stay in the range that the solvers' sums allow for.
    assert integer.unary.max() < np.iinfo(integer.unary.dtype).max / 3


def test_integers_are_fine_enough():
    crf = random_crf(1, 20, 30, 4, 8, 2.0)
    y = solve(crf).labels  # no cost that it pays was cut off
    integer = quantise(crf)
    assert integer.unary.dtype == np.int32
    assert integer.offset + as_crf(integer).energy(y) / integer.scale == pytest.approx(crf.energy(y), abs=1e-4)


def test_unary_of_probabilities_is_minus_log_p_above_the_floor():
    p = np.array([[[0.5, 0.499, 0.001]]])
    assert np.exp(-unary_from_probabilities(p, floor=0.01))[0, 0] == pytest.approx([0.5, 0.499, 0.01])


def test_refining_without_pairwise_term_is_the_argmax_of_the_network():
    rng = np.random.default_rng(5)
    p = rng.dirichlet(np.ones(4), (12, 15))
    image, depth = rng.integers(0, 256, (12, 15, 3), np.uint8), rng.uniform(0.5, 1.0, (12, 15)).astype(np.float32)
    assert np.array_equal(refine(p, image, depth, lam=0.0).labels, p.argmax(axis=2))


def test_refining_breaks_at_a_depth_edge_that_colour_does_not_show():
    p = np.full((20, 20, 2), 0.5)
    p[:, 2], p[:, -3] = (0.95, 0.05), (0.05, 0.95)  # evidence at the far left and the far right only
    depth = np.full((20, 20), 0.8, np.float32)
    depth[:, 13:] = 0.7
    labels = refine(p, np.full((20, 20, 3), 90, np.uint8), depth).labels
    assert np.array_equal(labels, np.broadcast_to(np.arange(20) >= 13, (20, 20)))


U, IMAGE, W = np.zeros((2, 3, 2)), np.zeros((2, 3, 3), np.uint8), np.zeros((2, 2, 3))
NAN = np.full((2, 3, 2), np.nan)
OUTSIDE = np.ones((2, 2, 3))


@pytest.mark.bad_input
@pytest.mark.parametrize(
    ("name", "call"),
    [
        ("unary", lambda: PottsCRF(NAN, W)),
        ("unary", lambda: PottsCRF(np.full((2, 3, 2), -np.inf), W)),
        ("unary", lambda: PottsCRF(np.full((2, 3, 2), np.inf), W)),
        ("unary", lambda: PottsCRF(np.zeros((2, 3, 1)), W)),
        ("unary", lambda: PottsCRF(U.astype(complex), W)),
        ("weights", lambda: PottsCRF(U, -W - 1.0)),
        ("weights", lambda: PottsCRF(U, W + np.nan)),
        ("weights", lambda: PottsCRF(U, np.zeros((3, 2, 3)))),
        ("weights", lambda: PottsCRF(U, np.zeros((2, 3, 2)))),
        ("weights", lambda: PottsCRF(U, OUTSIDE)),
        ("image", lambda: PottsCRF.from_image(U, IMAGE[:, :2], 1.0, 1.0)),
        ("image", lambda: PottsCRF.from_image(U, IMAGE + np.nan, 1.0, 1.0)),
        ("extra", lambda: PottsCRF.from_image(U, IMAGE, 1.0, 1.0, extra=((np.zeros((3, 3)), 1.0),))),
        ("extra", lambda: PottsCRF.from_image(U, IMAGE, 1.0, 1.0, extra=((np.zeros((2, 3)), 0.0),))),
        ("lam", lambda: PottsCRF.from_image(U, IMAGE, -1.0, 1.0)),
        ("sigma_I", lambda: PottsCRF.from_image(U, IMAGE, 1.0, 0.0)),
        ("sigma_p", lambda: PottsCRF.from_image(U, IMAGE, 1.0, 1.0, np.inf)),
        ("connectivity", lambda: PottsCRF.from_image(U, IMAGE, 1.0, 1.0, connectivity=6)),
        ("y", lambda: PottsCRF(U, W).energy(np.zeros((3, 2), int))),
        ("y", lambda: PottsCRF(U, W).energy(np.full((2, 3), 2))),
        ("method", lambda: solve(PottsCRF(U, W), "simulated annealing")),
        ("iterations", lambda: solve(PottsCRF(U, W), "trws", iterations=0)),
        ("iterations", lambda: solve(PottsCRF(U, W), "mean_field", iterations=0)),
        ("temperatures", lambda: solve(PottsCRF(U, W), "mean_field", temperatures=(1.0, 0.0))),
        ("labels", lambda: solve(PottsCRF(U, W), "icm", labels=np.full((2, 3), 2))),
        ("crf", lambda: solve(PottsCRF(np.zeros((2, 3, 3)), W), "min_cut")),
        ("crf", lambda: solve(PottsCRF(np.zeros((9, 9, 2)), np.zeros((2, 9, 9))), "brute_force")),
        ("probabilities", lambda: unary_from_probabilities(np.full((2, 3, 2), 3.0))),
        ("floor", lambda: unary_from_probabilities(np.full((2, 3, 2), 0.5), floor=0.0)),
        ("depth", lambda: refine(np.full((2, 3, 2), 0.5), IMAGE, np.full((2, 3), 800.0))),
    ],
)
def test_bad_input_names_the_argument(name, call):
    with pytest.raises(ValueError, match=name):
        call()


@pytest.mark.bad_input
@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.float64])
def test_colours_in_0_to_1_beside_a_scale_of_0_to_255_are_refused_with_both_remedies(dtype):
    """Their contrast would be 255 times too small, and no edge would show."""
    rgb = np.random.default_rng(0).integers(0, 256, (4, 5, 3), dtype=np.uint8)
    p, unit = np.full((4, 5, 2), 0.5), (rgb / 255.0).astype(dtype)
    for of_image in (
        lambda image, scale: PottsCRF.from_image(p, image, 1.0, scale).weights,
        lambda image, scale: refine(p, image, sigma_I=scale).labels,
        lambda image, scale: dense_crf(p, image, theta_beta=scale),
    ):
        with pytest.raises(ValueError, match=r"^image: .*multiply it, or divide (sigma_I|theta_beta), by 255"):
            of_image(unit, 30.0)
        assert np.allclose(of_image(unit, 30.0 / 255.0), of_image(rgb, 30.0), atol=2e-2)
        of_image(np.zeros((4, 5, 3), dtype), 30.0)  # black is black in any unit
    of_image(unit, 0.5)  # as lesson 02 has it
