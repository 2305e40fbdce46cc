"""The energy in integers, in which cuts and messages are exact and a lower bound is a proof.

Every cost is multiplied by one scale and rounded *down*. So the integer energy of a labelling never exceeds `scale`
times its real one, and whatever is proven from below about the first holds for the second.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from labkit.crf.energy import PottsCRF, pair_slices

# A pixel's costs and messages together stay below 16 times the largest weight: 2^26 keeps that within 31 bits, and
# 2^36 keeps the sum over 8 million pixels within 63.
WEIGHT_BITS = {np.int32: 26, np.int64: 36}
# The mean unary cost is worth at least 2^12 integer steps, or else the integers are made wider.
ENOUGH_BITS = 12
# Rounding errors of float64 sums relative to their terms: 2^-53 for each of some 50 additions in a row, with room.
ROUNDING = 2.0**-44


@dataclass(frozen=True, eq=False)
class IntegerPotts:
    """A Potts model whose costs are integers >= 0: energy ~ offset + integer energy / scale, from below.

    unary: (H, W, C) with a 0 at each pixel. weights: (D, H, W). offset: what the pixels cost at the least, in float64.
    magnitude: the sum of the sizes of the terms of `offset`.
    """

    unary: Int[np.ndarray, "H W C"]
    weights: Int[np.ndarray, "D H W"]
    scale: float
    offset: float
    magnitude: float

    def lower_bound(self, integer_bound: int, energy: float) -> float:
        """Turn a bound on the integer energy into one on the float64 energy, less what rounding could have added.

        energy: that of any labelling; with `magnitude` it limits the size of the terms that the optimum sums.
        """
        bound = self.offset + integer_bound / self.scale
        return float(bound - ROUNDING * (2.0 * self.magnitude + abs(energy)))


def quantise(crf: PottsCRF) -> IntegerPotts:
    """Round a Potts model down to integers, leaving out costs that no best labelling pays; the minimum stays the same.

    The least unary cost of each pixel is kept apart as a constant. A class that costs more than the cheapest one
    by all that the neighbours can charge together is never worth its cost, so its cost is cut off just above that
    sum, and +inf becomes a number. A weight above the whole energy of a constant labelling is cut off likewise.
    """
    lowest = crf.unary.min(axis=2)
    excess = crf.unary - lowest[..., None]
    weights = crf.weights
    constant = float(excess.sum(axis=(0, 1)).min())
    if 0.0 < 1.01 * constant < weights.max():
        weights = np.minimum(weights, 1.01 * constant)
    dtype, scale = integer_scale(excess, weights, crf.offsets)
    integer_weights = np.floor(weights * scale).astype(dtype)
    with np.errstate(over="ignore"):
        excess *= scale
    np.minimum(excess, incident_sum(integer_weights, crf.offsets)[..., None] + 1.0, out=excess)
    np.floor(excess, out=excess)
    magnitude = float(np.abs(lowest).sum())
    return IntegerPotts(excess.astype(dtype), integer_weights, scale, float(lowest.sum()), magnitude)


def integer_scale(excess: Float[np.ndarray, "H W C"], weights: Float[np.ndarray, "D H W"], offsets: tuple):
    """Choose the dtype of the integers and what a cost of 1 becomes: a power of two, as large as the dtype allows."""
    largest = weights.max()
    if largest == 0.0:  # the pixels are independent: a class is the cheapest, or it costs at least one step
        return np.int32, float(2.0 / np.min(excess, where=excess > 1e-300, initial=1.0))
    typical = np.minimum(excess, incident_sum(weights, offsets)[..., None]).mean()
    for dtype, bits in WEIGHT_BITS.items():  # noqa: B007 (the one it stops at is returned)
        scale = float(2.0 ** min(np.floor(bits - np.log2(largest)), 1000.0))
        if typical == 0.0 or typical * scale >= 2.0**ENOUGH_BITS:
            break
    return dtype, scale


def incident_sum(weights: np.ndarray, offsets: tuple[tuple[int, int], ...]) -> np.ndarray:
    """Sum the weights of all pairs of each pixel, (D, H, W) -> (H, W)."""
    total = np.zeros(weights.shape[1:], weights.dtype)
    for w, offset in zip(weights, offsets, strict=True):
        p, q = pair_slices(offset)
        total[p] += w[p]
        total[q] += w[p]
    return total
