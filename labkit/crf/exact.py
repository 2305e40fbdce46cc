"""What can be solved exactly: tiny grids by enumeration, no pairwise term, and two classes by a minimum cut.

Section 2 and problem 3 of the text. These are the oracles that the approximate solvers are tested against.
"""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float, Int, UInt8

from labkit.crf.energy import MapResult, PottsCRF, pair_slices
from labkit.crf.integers import quantise

MAX_LABELLINGS = 2**22
CHUNK = 2**14


def log_partition(crf: PottsCRF) -> float:
    """Return log Z, with Z the sum of exp(-E(y)) over all C^(H W) labellings: tiny grids only.

    Raises ValueError beyond 2^22 labellings. Section 2 of the text.

    >>> crf = PottsCRF(np.zeros((1, 2, 2)), np.zeros((2, 1, 2)))  # four labellings of energy 0
    >>> round(log_partition(crf) / float(np.log(4.0)), 6)
    1.0
    """
    log_Z = -np.inf
    for _, energies in enumerate_labellings(crf):
        log_Z = np.logaddexp(log_Z, log_sum_exp(-energies))
    return float(log_Z)


def marginals(crf: PottsCRF) -> Float[np.ndarray, "H W C"]:
    """Return the probability of each class at each pixel under exp(-E(y)) / Z, by enumeration: tiny grids only.

    Raises ValueError beyond 2^22 labellings. Section 2 of the text.
    """
    log_Z = log_partition(crf)
    p = np.zeros(crf.shape)
    for labellings, energies in enumerate_labellings(crf):
        weights = np.exp(-energies - log_Z)
        for c in range(crf.shape[2]):
            p[..., c] += np.tensordot(weights, labellings == c, axes=1)
    return p


def brute_force(crf: PottsCRF) -> MapResult:
    """Return the labelling of least energy out of all C^(H W); raises ValueError beyond 2^22 of them."""
    best = min(
        ((energies.min(), labellings[energies.argmin()]) for labellings, energies in enumerate_labellings(crf)),
        key=lambda pair: pair[0],
    )
    energy = crf.energy(best[1])
    return MapResult(best[1], energy, lower_bound=energy, iterations=1)


def unary(crf: PottsCRF) -> MapResult:
    """Return each pixel's cheapest class: exact if the pairwise terms vanish (problem 3), else where solvers start.

    The bound ignores the pairwise terms, which are never negative.
    """
    labels = crf.unary.argmin(axis=2).astype(np.uint8)
    cheapest = crf.unary.min(axis=2)
    slack = 2.0**-44 * float(np.abs(cheapest).sum())  # another order of summation rounds otherwise
    bound = float(cheapest.sum())
    energy = crf.energy(labels)
    return MapResult(labels, energy, lower_bound=energy if not crf.weights.any() else bound - slack, iterations=1)


def min_cut(crf: PottsCRF) -> MapResult:
    """Return the labelling of least energy for two classes: the cheapest cut between a source and a sink.

    A pixel on the source's side gets class 0, so the arc to the sink costs psi(0) and the arc from the source psi(1):
    the one is cut that the label pays. Neighbours on different sides cut the arc between them, which costs w. Then
    the cut's cost is the energy, and the maximum flow equals the minimum cut. It takes a submodular pairwise term,
    theta(0,0) + theta(1,1) <= theta(0,1) + theta(1,0): otherwise that arc's capacity would be negative.

    Exact up to the rounding of `quantise`, about 1e-7 of the largest weight a pixel; the bound accounts for it.
    Raises ValueError for more than two classes. Section 2 of the text.

    >>> psi = np.array([[[0.0, 2.0], [1.0, 0.8], [0.0, 2.0]]])  # the pixel in the middle is noise
    >>> w = np.array([[[0.5, 0.5, 0.0]], [[0.0, 0.0, 0.0]]])
    >>> min_cut(PottsCRF(psi, w)).labels
    array([[0, 0, 0]], dtype=uint8)
    """
    if crf.shape[2] != 2:
        raise ValueError(f"crf: expected two classes for a minimum cut, got {crf.shape[2]}; use expansion or trws")
    w = crf.weights.min()
    if not is_submodular(np.array([[0.0, w], [w, 0.0]])):
        raise ValueError("weights: expected a submodular pairwise term; one with w < 0 has no cut")
    integer = quantise(crf)
    source_to_pixel, pixel_to_sink = integer.unary[..., 1], integer.unary[..., 0]
    # What flows straight through a pixel needs no search: only the difference of its two arcs matters.
    straight = np.minimum(source_to_pixel, pixel_to_sink).sum(dtype=np.int64)
    flow, source_side = grid_max_flow(source_to_pixel - pixel_to_sink, integer.weights, crf.offsets)
    labels = np.where(source_side, 0, 1).astype(np.uint8)
    energy = crf.energy(labels)
    return MapResult(labels, energy, integer.lower_bound(int(straight) + flow, energy), iterations=1)


def is_submodular(theta: Float[np.ndarray, "2 2"]) -> bool:
    """Say whether a pairwise term of two binary labels fits into a cut: agreeing must not cost more than disagreeing.

    >>> is_submodular(np.array([[0.0, 1.0], [1.0, 0.0]])), is_submodular(np.array([[1.0, 0.0], [0.0, 1.0]]))
    (True, False)
    """
    return bool(theta[0, 0] + theta[1, 1] <= theta[0, 1] + theta[1, 0])


def grid_max_flow(
    excess: Int[np.ndarray, "H W"], weights: Int[np.ndarray, "D H W"], offsets: tuple[tuple[int, int], ...]
) -> tuple[int, UInt8[np.ndarray, "H W"]]:
    """Return the maximum flow through a grid, and 1 on the source's side of a minimum cut (the larger side), 0 beyond.

    excess: capacity from the source where positive, to the sink where negative. weights: capacity of the arcs, both
    ways, between a pixel and the one `offsets[d]` from it.
    """
    from labkit.crf.maxflow_kernels import SINK, max_flow

    H, W = excess.shape
    steps = grid_steps(offsets, W)
    capacity = np.zeros((H + 2, W + 2, len(steps)), excess.dtype)
    padded_excess = np.zeros((H + 2, W + 2), excess.dtype)
    padded_excess[1:-1, 1:-1] = excess
    inner = capacity[1:-1, 1:-1]
    for d, offset in enumerate(offsets):
        p, q = pair_slices(offset)
        inner[..., d] = weights[d]
        inner[..., len(steps) - 1 - d][q] = weights[d][p]
    flow, tree = max_flow(capacity.reshape(-1, len(steps)), padded_excess.ravel(), steps)
    return int(flow), (tree.reshape(H + 2, W + 2)[1:-1, 1:-1] != SINK).astype(np.uint8)


def grid_steps(offsets: tuple[tuple[int, int], ...], W: int) -> Int[np.ndarray, "K"]:
    """Return what to add to a pixel's index for each of its arcs, in an image W wide with a ring of one pixel around.

    Arcs come in the order of `offsets` and then back through their reverses, so that arc k returns as arc K - 1 - k.

    >>> grid_steps(((0, 1), (1, 0)), W=3)
    array([ 1,  5, -5, -1], dtype=int32)
    """
    forward = [down * (W + 2) + right for down, right in offsets]
    return np.array(forward + [-step for step in reversed(forward)], np.int32)


def enumerate_labellings(crf: PottsCRF) -> Iterator[tuple[UInt8[np.ndarray, "n H W"], Float[np.ndarray, "n"]]]:
    """Yield all labellings of a tiny grid with their energies, some thousands at a time."""
    H, W, C = crf.shape
    count = C ** (H * W)
    if count > MAX_LABELLINGS:
        raise ValueError(f"crf: expected at most {MAX_LABELLINGS} labellings to enumerate, got {C}^{H * W}")
    place = C ** np.arange(H * W).reshape(H, W)
    rows, columns = np.indices((H, W))
    for start in range(0, count, CHUNK):
        numbers = np.arange(start, min(start + CHUNK, count))
        y = (numbers[:, None, None] // place % C).astype(np.uint8)
        energies = crf.unary[rows, columns, y].sum(axis=(1, 2))
        for w, offset in zip(crf.weights, crf.offsets, strict=True):
            p, q = pair_slices(offset)
            energies += ((y[:, *p] != y[:, *q]) * w[p]).sum(axis=(1, 2))
        yield y, energies


def log_sum_exp(x: Float[np.ndarray, "n"]) -> float:
    """Return log(sum(exp(x))) without overflow; -inf entries add nothing.

    >>> round(log_sum_exp(np.array([1000.0, 1000.0])) - 1000.0, 6)
    0.693147
    """
    top = x.max()
    return float(top + np.log(np.exp(x - top).sum())) if np.isfinite(top) else float(top)
