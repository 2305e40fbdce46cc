"""Numbers that no solver can compute with are refused, and the message names the argument."""

import numpy as np
import pytest

from labkit.crf import METHODS, PottsCRF, solve
from labkit.crf.exact import grid_max_flow

pytestmark = pytest.mark.bad_input
ITERATING = ("icm", "mean_field", "trws", "trws+expansion", "persistency")


def model(unary=None, **options):
    unary = np.tile((0.0, 1.0), (3, 4, 1)) if unary is None else unary
    return PottsCRF.from_image(unary, np.zeros((3, 4, 3), np.uint8), **{"lam": 1.0, "sigma_I": 10.0, **options})


@pytest.mark.parametrize("method", ITERATING)
@pytest.mark.parametrize("iterations", [10**9, 0, 2.5, True, "5"])
def test_iterations_are_a_whole_number_that_ends(method, iterations):
    with pytest.raises(ValueError, match="iterations: expected a whole number of at least 1, at most 10000"):
        solve(model(), method, iterations=iterations)


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("unary", {"unary": np.full((3, 4, 2), 1e300)}),
        ("unary", {"unary": np.full((3, 4, 2), -1e300)}),
        ("unary", {"unary": np.ma.masked_all((3, 4, 2))}),
        ("lam", {"lam": 1e300}),
        ("lam", {"lam": None}),
        ("sigma_I", {"sigma_I": 1e-320}),
        ("sigma_p", {"sigma_p": 1e-200}),
        ("sigma_p", {"sigma_p": "1"}),
        ("extra", {"extra": ((np.ma.masked_all((3, 4)), 1.0),)}),
    ],
)
def test_costs_and_scales_have_limits(name, options):
    with pytest.raises(ValueError, match=f"^{name}: expected"):
        model(**options)


@pytest.mark.parametrize("method", METHODS)
def test_the_largest_costs_that_are_taken_are_solved(method):
    """Each pixel's cheaper class is the optimum where all pixels agree on it, at any scale of the costs."""
    result = solve(model(np.tile((1e150, 0.0), (3, 4, 1)), lam=1e150), method)
    assert result.labels.all() and result.energy == 0.0


@pytest.mark.parametrize("dtype", [np.int32, np.int64])
def test_capacities_near_the_end_of_the_integers_are_refused(dtype):
    largest = np.iinfo(dtype).max
    for excess, weights in ((largest, 1), (1, largest), (-largest, 1)):
        with pytest.raises(ValueError, match="excess: expected capacities that add up"):
            inside = np.full((2, 3, 4), weights, dtype)
            inside[0, :, -1] = inside[1, -1] = 0
            grid_max_flow(np.full((3, 4), excess, dtype), inside, ((0, 1), (1, 0)))
    with pytest.raises(ValueError, match="weights: expected 0 where a pair leaves the image"):
        grid_max_flow(np.ones((3, 4), dtype), np.ones((2, 3, 4), dtype), ((0, 1), (1, 0)))
    with pytest.raises(ValueError, match="offsets: expected the pairs of 4 or 8 neighbours"):
        grid_max_flow(np.ones((3, 4), dtype), np.zeros((2, 3, 4), dtype), ((0, 1), (9, 0)))
    with pytest.raises(ValueError, match="weights: expected capacities >= 0"):
        grid_max_flow(np.ones((3, 4), dtype), np.full((2, 3, 4), -1, dtype), ((0, 1), (1, 0)))
