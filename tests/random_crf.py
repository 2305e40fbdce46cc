"""Random Potts energies for the tests of every solver."""

import numpy as np

from labkit.crf.energy import PottsCRF
from labkit.crf.integers import IntegerPotts, inside


def as_crf(integer: IntegerPotts) -> PottsCRF:
    """The integer model as one with real costs."""
    unary, weights = (inside(flat, integer.size).astype(float) for flat in (integer.unary, integer.weights))
    return PottsCRF(unary, weights.transpose(2, 0, 1))


def random_crf(seed, H, W, C, connectivity=4, lam=1.0, forbidden=0.0) -> PottsCRF:
    rng = np.random.default_rng(seed)
    unary = rng.normal(0.0, 1.0, (H, W, C))
    hit = rng.random((H, W, C)) < forbidden
    hit[..., rng.integers(C)] = False  # one class stays allowed everywhere
    unary[hit] = np.inf
    return PottsCRF.from_image(unary, rng.random((H, W, 3)), lam, 0.4, 1.0, connectivity)
