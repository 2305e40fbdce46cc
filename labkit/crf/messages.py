"""Message passing: TRW-S, which proves how good a labelling is, and ICM, which only walks downhill.

TRW-S (Kolmogorov 2006, doi:10.1109/TPAMI.2006.200) splits the energy into chains of pixels, whose minima are easy, and
moves cost between them until the chains agree as far as they can. The sum of the chains' minima is a lower bound on the
energy of every labelling. For two classes it reaches the optimum; for more it usually comes within a fraction of a
percent.
"""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Int, Integer, UInt8

from labkit.crf.energy import MapResult, PottsCRF, pair_slices, timed
from labkit.crf.energy_kernels import icm_sweep
from labkit.crf.integers import IntegerPotts, inside, quantise
from labkit.crf.message_kernels import Skew, skewed, trws_labels, trws_sweep
from labkit.support.validation import MAX_ITERATIONS, check_whole

# How often labels are read off the messages, in iterations.
LABEL_EVERY = 5


@timed
def trws(crf: PottsCRF, iterations: int = 50, tolerance: float = 1e-5) -> MapResult:
    """Minimise by sequential tree-reweighted message passing, with a proven lower bound (topic 02).

    One iteration is a sweep forward and one backward. It stops early once the gap is below `tolerance`. Exact integer
    arithmetic makes the bound a proof.

    >>> psi = np.array([[[0.0, 2.0, 2.0], [1.0, 2.0, 0.8], [0.0, 2.0, 2.0]]])
    >>> result = trws(PottsCRF(psi, np.array([[[0.5, 0.5, 0.0]], [[0.0, 0.0, 0.0]]])))
    >>> result.labels, round(result.energy, 3), result.gap < 1e-6
    (array([[0, 0, 0]], dtype=uint8), 1.0, True)
    """
    check_whole("iterations", iterations, 1, MAX_ITERATIONS)
    return _trws(crf, quantise(crf), iterations, tolerance)


def _trws(crf: PottsCRF, integer: IntegerPotts, iterations: int, tolerance: float) -> MapResult:
    best = MapResult(crf.unary.argmin(axis=2).astype(np.uint8), np.inf)
    unary, weights = inside(integer.unary, integer.size), inside(integer.weights, integer.size)
    for iteration, labels, proven in message_passing(unary, weights, crf.offsets, iterations):
        energy = crf._energy(labels)
        if energy > best.energy:
            labels, energy = best.labels, best.energy
        best = MapResult(labels, energy, integer.lower_bound(proven, energy), iteration)
        if best.gap <= tolerance:
            break
    return best


def message_passing(
    unary: Int[np.ndarray, "H W C"], weights: Int[np.ndarray, "H W D"], offsets: tuple, iterations: int
) -> Iterator[tuple[int, UInt8[np.ndarray, "H W"], int]]:
    """Run TRW-S on integer costs >= 0; yield, now and then, the number of iterations, labels and the proven bound."""
    slant = 1 if len(offsets) == 2 else 2
    skew = Skew(slant, unary.shape[1], np.array([(right + slant * down, down) for down, right in offsets]))
    ahead, behind = (skewed(count[..., None], slant)[:, 0] for count in pair_counts(weights, offsets))
    # A belief is shared among 1, 2 or 4 pairs, at least as many as there are: powers of two divide by a shift.
    shift = np.ceil(np.log2(np.maximum(np.maximum(ahead, behind), 1))).astype(unary.dtype)
    unary, weights = skewed(unary, slant), skewed(weights, slant)
    messages = np.zeros((len(offsets), *unary.shape), unary.dtype)
    proven = 0  # no integer cost is negative
    for iteration in range(1, iterations + 1):
        proven = max(proven, trws_sweep(unary, weights, messages, skew, shift, ahead, True))
        proven = max(proven, trws_sweep(unary, weights, messages, skew, shift, behind, False))
        if iteration % LABEL_EVERY == 0 or iteration == iterations:
            yield iteration, trws_labels(unary, weights, messages, skew), proven


@timed
def icm(crf: PottsCRF, labels: Integer[np.ndarray, "H W"] | None = None, iterations: int = 100) -> MapResult:
    """Iterated conditional modes: change single pixels while that lowers the energy, from the unary one or `labels`.

    iterations counts sweeps over the image. A local minimum only: the baseline for the others.
    """
    check_whole("iterations", iterations, 1, MAX_ITERATIONS)
    labels = (crf.unary.argmin(axis=2) if labels is None else crf.check_labelling("labels", labels)).astype(np.uint8)
    sweep = 0
    while sweep < iterations:
        sweep += 1
        if not icm_sweep(crf.unary, crf.weights, np.array(crf.offsets), labels):
            break
    return MapResult(labels, crf.energy(labels), iterations=sweep)


def pair_counts(
    weights: Int[np.ndarray, "H W D"], offsets: tuple
) -> tuple[Int[np.ndarray, "H W"], Int[np.ndarray, "H W"]]:
    """Count the pairs of weight above 0 of each pixel: with the neighbours ahead of it, and with those behind it."""
    ahead = np.count_nonzero(weights, axis=2).astype(weights.dtype)
    behind = np.zeros_like(ahead)
    for d, offset in enumerate(offsets):
        p, q = pair_slices(offset)
        behind[q] += weights[..., d][p] > 0
    return ahead, behind
