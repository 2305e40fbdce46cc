"""Mean field: the distribution of independent pixels that is closest to the CRF (topic 02).

Among all q(y) = product of q_p(y_p), it looks for the least Kullback-Leibler divergence from p(y) = exp(-E(y)) / Z,
which is the least free energy F(q) = <E>_q - entropy(q) >= -log Z. With all but one pixel fixed, the best q_p is a
softmax of what the pixel costs on average; sweeping over the pixels lowers F with every step.
"""

import numpy as np
from jaxtyping import Float

from labkit.crf.energy import MapResult, PottsCRF, timed
from labkit.crf.energy_kernels import mean_field_sweep
from labkit.support.validation import MAX_ITERATIONS, check_whole, require


@timed
def mean_field(crf: PottsCRF, iterations: int = 10, temperatures: tuple[float, float] | None = None) -> MapResult:
    """Return each pixel's most probable class under the mean-field distribution; `temperatures` as below. No bound."""
    q = mean_field_marginals(crf, iterations, temperatures)
    labels = q.argmax(axis=2).astype(np.uint8)
    return MapResult(labels, crf.energy(labels), iterations=iterations)


def mean_field_marginals(
    crf: PottsCRF, iterations: int = 10, temperatures: tuple[float, float] | None = None
) -> Float[np.ndarray, "H W C"]:
    """Return q (H, W, C) after `iterations` sweeps from the softmax of the unary term (topic 02).

    temperatures: first and last value of T in exp(-E / T), falling geometrically; (2.0, 0.2) anneals, which finds lower
    energies but no longer the marginals. Default: T = 1. Raises ValueError for T <= 0 or no iteration.

    >>> crf = PottsCRF(np.array([[[0.0, 1.0], [0.5, 0.0]]]), np.zeros((2, 1, 2)))
    >>> mean_field_marginals(crf).round(3)  # no pairwise term: exp(-psi) / sum(exp(-psi))
    array([[[0.731, 0.269], [0.378, 0.622]]])
    """
    check_whole("iterations", iterations, 1, MAX_ITERATIONS)
    first, last = temperatures if temperatures is not None else (1.0, 1.0)
    require("temperatures", 0.0 < first < np.inf and 0.0 < last < np.inf, "two numbers above 0", temperatures)
    offsets = np.array(crf.offsets)
    q = np.exp(-(crf.unary - crf.unary.min(axis=2, keepdims=True)))
    q /= q.sum(axis=2, keepdims=True)
    for T in np.geomspace(first, last, iterations):
        mean_field_sweep(crf.unary, crf.weights, offsets, T, q)
    return q
