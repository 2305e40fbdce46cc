"""What can be solved exactly: tiny grids by enumeration, no pairwise term, and two classes by a minimum cut.

These are the oracles that the approximate solvers are tested against.
"""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float, Int, UInt8

from labkit.crf.energy import OFFSETS, MapResult, PottsCRF, pair_slices, timed
from labkit.crf.integers import grid_steps, inside, pixel_numbers, quantise
from labkit.crf.maxflow_kernels import SOURCE, Graph, both_ways, max_flow, new_forest
from labkit.support.validation import as_array, check_shape, require

MAX_LABELLINGS = 2**22
CHUNK = 2**14
# How far flow is pushed on without search trees, in pixels: what takes the least time (`push_nearby`).
NEAR = 4


def log_partition(crf: PottsCRF) -> float:
    """Return log Z, with Z the sum of exp(-E(y)) over all C^(H W) labellings: tiny grids only (topic 02).

    Raises ValueError beyond 2^22 labellings.

    >>> crf = PottsCRF(np.zeros((1, 2, 2)), np.zeros((2, 1, 2)))  # four labellings of energy 0
    >>> round(log_partition(crf) / float(np.log(4.0)), 6)
    1.0
    """
    log_Z = -np.inf
    for _, energies in enumerate_labellings(crf):
        log_Z = np.logaddexp(log_Z, np.logaddexp.reduce(-energies))
    return float(log_Z)


def marginals(crf: PottsCRF) -> Float[np.ndarray, "H W C"]:
    """Return the probability of each class at each pixel under exp(-E(y)) / Z: tiny grids only (topic 02).

    Raises ValueError beyond 2^22 labellings.
    """
    log_Z = log_partition(crf)
    p = np.zeros(crf.shape)
    for labellings, energies in enumerate_labellings(crf):
        weights = np.exp(-energies - log_Z)
        for c in range(crf.shape[2]):
            p[..., c] += np.tensordot(weights, labellings == c, axes=1)
    return p


@timed
def brute_force(crf: PottsCRF) -> MapResult:
    """Return the labelling of least energy out of all C^(H W); raises ValueError beyond 2^22 of them."""
    chunks = ((energies.min(), labellings[energies.argmin()]) for labellings, energies in enumerate_labellings(crf))
    _, labels = min(chunks, key=lambda pair: pair[0])
    energy = crf.energy(labels)
    return MapResult(labels, energy, lower_bound=energy, iterations=1)


@timed
def unary(crf: PottsCRF) -> MapResult:
    """Return each pixel's cheapest class: exact if the pairwise terms vanish (topic 02), else where solvers start.

    The bound ignores the pairwise terms, which are never negative.
    """
    labels = crf.unary.argmin(axis=2).astype(np.uint8)
    cheapest = crf.unary.min(axis=2)
    slack = 2.0**-44 * float(np.abs(cheapest).sum())  # another order of summation rounds otherwise
    bound = float(cheapest.sum())
    energy = crf.energy(labels)
    return MapResult(labels, energy, lower_bound=energy if not crf.weights.any() else bound - slack, iterations=1)


@timed
def min_cut(crf: PottsCRF) -> MapResult:
    """Return the labelling of least energy for two classes: the cheapest cut between a source and a sink (topic 02).

    A pixel on the source's side gets class 0, so the arc to the sink costs psi(0) and the arc from the source psi(1):
    the one is cut that the label pays. Neighbours on different sides cut the arc between them, which costs w. Then
    the cut's cost is the energy, and the maximum flow equals the minimum cut.

    Exact up to the rounding of `quantise`, about 1e-7 of the largest weight per pixel; the bound accounts for it.
    Raises ValueError for more than two classes.

    >>> psi = np.array([[[0.0, 2.0], [1.0, 0.8], [0.0, 2.0]]])  # the pixel in the middle is noise
    >>> w = np.array([[[0.5, 0.5, 0.0]], [[0.0, 0.0, 0.0]]])
    >>> min_cut(PottsCRF(psi, w)).labels
    array([[0, 0, 0]], dtype=uint8)
    """
    require("crf", crf.shape[2] == 2, "two classes for a minimum cut", f"{crf.shape[2]}; use expansion or trws")
    integer = quantise(crf)
    # Each pixel's cheaper class costs 0, so that only one of its arcs to the terminals has a capacity.
    flow, labels = cut_grid(integer.unary[:, 1] - integer.unary[:, 0], integer.weights, integer.step, integer.size)
    energy = crf._energy(labels)
    return MapResult(labels, energy, integer.lower_bound(flow, energy), iterations=1)


def grid_max_flow(
    excess: Int[np.ndarray, "H W"], weights: Int[np.ndarray, "D H W"], offsets: tuple[tuple[int, int], ...]
) -> tuple[int, UInt8[np.ndarray, "H W"]]:
    """Return the maximum flow through a grid, and 1 on the source's side of a minimum cut (the larger side), 0 beyond.

    excess: capacity from the source where positive, to the sink where negative. weights: capacity of the arcs, both
    ways, between a pixel and the one `offsets[d]` from it. Raises ValueError for capacities whose sums are
    no integers of their dtype any more.
    """
    excess, weights = as_array("excess", excess), as_array("weights", weights)
    for name, values in (("excess", excess), ("weights", weights)):
        require(name, values.dtype.kind == "i", "signed integers", values.dtype)
    require("weights", weights.min(initial=0) >= 0, "capacities >= 0", lambda: weights.min())
    check_shape("weights", weights, (len(offsets), *check_shape("excess", excess, (None, None)).shape))
    require("offsets", tuple(offsets) in OFFSETS.values(), "the pairs of 4 or 8 neighbours", offsets)
    for d, offset in enumerate(offsets):
        outside = np.ones(excess.shape, bool)
        outside[pair_slices(offset)[0]] = False
        require("weights", not weights[d][outside].any(), "0 where a pair leaves the image", f"others in weights[{d}]")
    # All that can meet at a pixel stays within its dtype, and all flow within 63 bits.
    largest = [float(np.abs(values, dtype=np.float64).max(initial=0.0)) for values in (excess, weights)]
    most = float(np.iinfo(excess.dtype).max) / 2.0
    fits = largest[0] + 2.0 * len(weights) * largest[1] <= min(most, 2.0**61 / max(1, excess.size))
    require(
        "excess", fits, f"capacities that add up within {excess.dtype}", lambda: f"{largest[0]:g} and {largest[1]:g}"
    )
    H, W = excess.shape
    ring = ((1, 1), (1, 1), (0, 0))
    padded = np.pad(np.moveaxis(weights, 0, 2), ring).reshape(-1, len(weights))
    excess = np.pad(excess, 1).ravel()
    flow, sink_side = cut_grid(excess, padded.astype(excess.dtype), grid_steps(offsets, W), (H, W))
    return flow, 1 - sink_side


def cut_grid(
    excess: Int[np.ndarray, "N"], weights: Int[np.ndarray, "N D"], step: Int[np.ndarray, "K"], size: tuple[int, int]
) -> tuple[int, UInt8[np.ndarray, "H W"]]:
    """Return the maximum flow through a flat grid with a ring (`integers`), and 1 on the sink's side of a cut."""
    nodes = pixel_numbers(size)
    trees = new_forest(len(excess))
    # Arcs go both ways, so that source and sink can change places: the source's side is the one that max_flow tells.
    flow = max_flow(Graph(both_ways(weights, step), -excess, step), *trees, nodes, NEAR)
    return int(flow), (inside(trees[0].tree, size) == SOURCE).astype(np.uint8)


def enumerate_labellings(crf: PottsCRF) -> Iterator[tuple[UInt8[np.ndarray, "n H W"], Float[np.ndarray, "n"]]]:
    """Yield all labellings of a tiny grid with their energies, some thousands at a time."""
    H, W, C = crf.shape
    count = C ** (H * W)
    require("crf", count <= MAX_LABELLINGS, f"at most {MAX_LABELLINGS} labellings to enumerate", f"{C}^{H * W}")
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
