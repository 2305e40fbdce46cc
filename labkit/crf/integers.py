"""The energy in integers, in which cuts and messages are exact and a lower bound is a proof.

Every cost is multiplied by one scale and rounded *down*. So the integer energy of a labelling never exceeds `scale`
times its real one, and whatever is proven from below about the first holds for the second.

All arrays have a ring of one pixel without costs around the image, so that no loop asks where the border is, and are
flat: pixel (v, u) is number n = (v + 1) (W + 2) + u + 1, and its k-th neighbour is number n + step[k].
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Int

from labkit.crf.energy import PottsCRF
from labkit.crf.integer_kernels import round_unary, round_weights, size_of

# A pixel's costs and messages together stay below 16 times the largest weight: 2^26 keeps that within 31 bits, and
# 2^36 keeps the sum over 8 million pixels within 63.
WEIGHT_BITS = {np.int32: 26, np.int64: 36}
# The mean unary cost is worth at least 2^12 integer steps, or else the integers are made wider.
ENOUGH_BITS = 12
# Rounding errors of float64 sums relative to their terms: 2^-53 for each of the additions in a row, here up to 2^13.
ROUNDING = 2.0**-40


@dataclass(frozen=True, eq=False)
class IntegerPotts:
    """A Potts model whose costs are integers >= 0: energy ~ offset + integer energy / scale, from below.

    size: (H, W). unary: (N, C) with a 0 at each pixel. weights: (N, D), of the pairs with the first half of the
    neighbours. step: (2 D,), neighbour k is the reverse of 2 D - 1 - k. offset: what the pixels cost at the least, in
    float64. magnitude: the sum of the sizes of the terms of `offset`.
    """

    size: tuple[int, int]
    unary: Int[np.ndarray, "N C"]
    weights: Int[np.ndarray, "N D"]
    step: Int[np.ndarray, "K"]
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
    H, W, C = crf.shape
    offsets = np.array(crf.offsets)
    size, largest = size_of(crf.unary, crf.weights, offsets, np.inf), crf.weights.max()
    highest = max(1.01 * size.constant, size.smallest)  # where one class is the cheapest everywhere, `constant` is 0
    if highest >= largest:
        highest = np.inf
    else:
        size = size_of(crf.unary, crf.weights, offsets, highest)
    dtype, scale = integer_scale(min(largest, highest), size.typical / crf.unary.size, size.smallest)
    step = grid_steps(crf.offsets, W)
    weights = np.zeros(((H + 2) * (W + 2), len(offsets)), dtype)
    round_weights(crf.weights, highest, scale, weights.reshape(H + 2, W + 2, -1))
    unary = np.zeros((len(weights), C), dtype)
    round_unary(crf.unary, weights, step, scale, unary)
    return IntegerPotts((H, W), unary, weights, step, scale, size.offset, size.magnitude)


def integer_scale(largest: float, typical: float, smallest: float) -> tuple[type, float]:
    """Choose the dtype of the integers, and the scale that costs are multiplied by: a power of two as large as fits.

    largest: the largest weight. typical: the mean unary cost. smallest: the smallest unary cost above 0; the scale
    depends on it only if all weights are 0.
    """
    if largest == 0.0:  # the pixels are independent: a class is the cheapest, or it costs at least one step
        return np.int32, 2.0 / smallest
    for dtype, bits in WEIGHT_BITS.items():  # noqa: B007 (the one it stops at is returned)
        scale = float(2.0 ** min(np.floor(bits - np.log2(largest)), 1000.0))
        if typical == 0.0 or typical * scale >= 2.0**ENOUGH_BITS:
            break
    return dtype, scale


def grid_steps(offsets: tuple[tuple[int, int], ...], W: int) -> Int[np.ndarray, "K"]:
    """Return what to add to a pixel's number for each neighbour, in an image W wide with a ring of one pixel around.

    Neighbours come in the order of `offsets` and then back through their reverses, so that k comes back as K - 1 - k.

    >>> grid_steps(((0, 1), (1, 0)), W=3)
    array([ 1,  5, -5, -1], dtype=int32)
    """
    forward = [down * (W + 2) + right for down, right in offsets]
    return np.array(forward + [-step for step in reversed(forward)], np.int32)


def inside(flat: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """View a flat array with a ring as the image that it holds, (H, W) or (H, W, k)."""
    return flat.reshape(size[0] + 2, size[1] + 2, *flat.shape[1:])[1:-1, 1:-1]


def pixel_numbers(size: tuple[int, int]) -> Int[np.ndarray, "n"]:
    """Return the numbers of all pixels, row by row."""
    return inside(np.arange((size[0] + 2) * (size[1] + 2), dtype=np.int32), size).ravel()
