"""Pixels that are called certain, against all labellings of tiny grids, and the solver that fixes them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_crf import as_crf, random_crf
from scipy.ndimage import gaussian_filter

from labkit.crf import PottsCRF, refine, solve
from labkit.crf.cuts import Moves
from labkit.crf.exact import enumerate_labellings
from labkit.crf.integers import inside, quantise
from labkit.crf.messages import message_passing
from labkit.crf.move_kernels import cheapest
from labkit.crf.persistency import fix_certain


@settings(max_examples=150, deadline=None)
@given(
    shape=st.sampled_from([(2, 2, 5), (2, 3, 3), (3, 3, 2), (2, 4, 3), (1, 6, 4), (3, 4, 2)]),
    seed=st.integers(0, 2**32 - 1),
    connectivity=st.sampled_from([4, 8]),
    lam=st.sampled_from([0.1, 0.3, 1.0, 4.0]),
    order=st.permutations([*range(5), None]),
    reaches=st.sampled_from([(), (1,), (1, 2)]),
)
def test_some_best_labelling_keeps_every_certain_pixel(shape, seed, connectivity, lam, order, reaches):
    """Whatever labels are tested one after the other: all of one class, or those of least cost (None)."""
    crf = random_crf(seed, *shape, connectivity, lam, 0.1)
    integer = quantise(crf)
    cheapest = crf.unary.argmin(axis=2)
    moves = Moves(integer, cheapest)
    ((y, energies),) = enumerate_labellings(as_crf(integer))  # integers, and so exact
    keeps = np.ones(len(y), bool)
    for alpha in order:
        if alpha is None or alpha < shape[2]:
            start = np.pad(cheapest, 1).ravel() if alpha is None else np.full(len(moves.labels), alpha)
            moves.labels[moves.nodes] = start[moves.nodes]
            fix_certain(moves, reaches)
            fixed = ~inside(moves.free, integer.size)
            keeps = (y[:, fixed] == inside(moves.labels, integer.size)[fixed]).all(axis=1)
            assert energies[keeps].min() == energies.min()


def test_a_strong_opinion_is_certain_and_a_weak_one_among_others_is_not():
    unary = np.array([[[0.0, 9.0], [0.0, 9.0], [0.1, 0.0], [0.0, 0.1], [9.0, 0.0], [9.0, 0.0]]])
    weights = np.zeros((2, 1, 6))
    weights[0, 0, :5] = 1.0
    moves = Moves(quantise(PottsCRF(unary, weights)), unary.argmin(axis=2))
    fix_certain(moves)
    assert inside(moves.free, (1, 6)).tolist() == [[False, False, True, True, False, False]]


@pytest.mark.parametrize("connectivity", [4, 8])
@pytest.mark.parametrize("reaches", [(1,), (3,), (2, 5), (40,)])
def test_a_cut_near_the_sources_leaves_the_same_pixels_as_one_of_all(connectivity, reaches):
    """Whether it is wide enough at once, after a wider one, or not, and whichever pixels were fixed before."""
    p, image, depth = like_a_network(2, 60, 70)
    extra = ((depth, 0.03),)
    crf = PottsCRF.from_image(-np.log(p + 1e-4), image, 8.0, 30.0, 1.0, connectivity, extra)
    local, whole = (Moves(quantise(crf), crf.unary.argmin(axis=2)) for _ in range(2))
    assert np.array_equal(cheapest(crf.unary), crf.unary.argmin(axis=2))
    for alpha in (None, 2, 0, 1, 3):
        for moves, steps in ((local, reaches), (whole, ())):
            if alpha is not None:
                moves.labels[moves.nodes] = alpha
            fix_certain(moves, steps)
        assert np.array_equal(local.nodes, whole.nodes) and np.array_equal(local.free, whole.free)
        assert alpha is not None or 0 < len(local.nodes) < 0.3 * p.shape[0] * p.shape[1]


def like_a_network(seed, H, W, C=4):
    """Probabilities that are sure but in patches; an image and a depth image that show the regions."""
    rng = np.random.default_rng(seed)
    y = gaussian_filter(rng.normal(size=(H, W, C)), (9, 9, 0)).argmax(axis=2)
    doubt = gaussian_filter(rng.normal(size=(H, W, 1)), (7, 7, 0))
    z = 9.0 * np.eye(C)[y] * (1.0 - 0.9 * (doubt > 0.02)) + gaussian_filter(rng.normal(0.0, 6.0, (H, W, C)), (2, 2, 0))
    p = np.exp(z - z.max(axis=2, keepdims=True))
    image = (rng.integers(40, 216, (C, 3))[y] + rng.normal(0.0, 8.0, (H, W, 3))).astype(np.uint8)
    return p / p.sum(axis=2, keepdims=True), image, (0.5 + 0.02 * y).astype(np.float32)


@pytest.mark.parametrize("connectivity", [4, 8])
@pytest.mark.parametrize("seed", [0, 1])
def test_the_whole_image_is_certified(seed, connectivity):
    """The energy is no worse than without fixed pixels, and neither solver finds less than the other's bound."""
    p, image, depth = like_a_network(seed, 100, 130)
    ours, other = (
        refine(p, image, depth, connectivity=connectivity, method=name) for name in ("persistency", "trws+expansion")
    )
    assert (ours.labels != p.argmax(axis=2)).mean() > 0.003  # there was something to do
    assert ours.energy <= other.energy * (1.0 + 1e-4)
    assert max(ours.lower_bound, other.lower_bound) <= min(ours.energy, other.energy)
    assert ours.gap <= 1e-4


def test_an_image_full_of_doubts_is_solved_as_a_whole():
    crf = random_crf(3, 40, 50, 4, 8, 1.0)
    ours, other = solve(crf, "persistency"), solve(crf, "trws+expansion")
    assert np.array_equal(ours.labels, other.labels) and ours.lower_bound == other.lower_bound


@pytest.mark.parametrize("connectivity", [4, 8])
def test_message_passing_among_scattered_pixels_is_that_over_the_image(connectivity):
    """With no pixel fixed the two implementations send the same messages in another order."""
    from labkit.crf.message_kernels import trws_bound

    integer = quantise(random_crf(5, 14, 11, 3, connectivity, 1.5))
    moves = Moves(integer, np.zeros(integer.size, int))
    place = np.full(len(moves.free), -1, np.int32)
    place[moves.nodes] = np.arange(len(moves.nodes))
    unary, weights = (inside(flat, integer.size) for flat in (integer.unary, integer.weights))
    offsets = ((0, 1), (1, 0), (1, 1), (1, -1))[: connectivity // 2]
    for iterations in (1, 4, 30):
        *_, (_, _, proven) = message_passing(unary, weights, offsets, iterations)
        ours = trws_bound(integer.unary, integer.weights, integer.step, moves.nodes, place, iterations, np.inf)
        assert ours == (proven, iterations)
