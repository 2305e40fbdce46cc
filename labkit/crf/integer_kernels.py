"""Rounding a Potts model to integers in a few passes over memory, compiled by numba."""

from collections import namedtuple

import numpy as np

from labkit.support.compiled import inline, kernel

# offset, magnitude: sums of each pixel's least cost and of its size. typical: sum of the costs above it, each cut off
# at the weights of the pixel. smallest: of the costs above 0. constant: sum of the costs of the best single class.
Size = namedtuple("Size", "offset magnitude typical smallest constant")


@kernel
def size_of(unary, weights, offsets, highest):
    """Measure the costs of a model whose weights are cut off at `highest`; sums run over rows of sums over a row."""
    H, W, C = unary.shape
    sums, row = np.zeros(3 + C), np.empty(3 + C)
    smallest = 1.0
    incident = np.empty(W)
    for v in range(H):
        clear(incident)
        for d in range(len(offsets)):
            down, right = offsets[d, 0], offsets[d, 1]
            add_capped(incident, weights[d, v], highest)
            if v >= down:
                first, last = max(0, -right), W - max(0, right)
                add_capped(incident[first + right : last + right], weights[d, v - down, first:last], highest)
        clear(row)
        for u in range(W):
            least = lowest(unary, v, u)
            row[0] += least
            row[1] += abs(least)
            for c in range(C):
                excess = unary[v, u, c] - least
                row[2] += min(excess, incident[u])
                row[3 + c] += excess
                if 1e-300 < excess < smallest:
                    smallest = excess
        add_capped(sums, row, np.inf)
    constant = sums[3]
    for c in range(1, C):
        constant = min(constant, sums[3 + c])
    return Size(sums[0], sums[1], sums[2], smallest, constant)


@inline
def clear(row):
    """Set a row to 0."""
    for i in range(len(row)):
        row[i] = 0.0


@inline
def lowest(unary, v, u):
    """The least cost of a pixel; a loop over few classes is faster than numba's own minimum."""
    least = unary[v, u, 0]
    for c in range(1, unary.shape[2]):
        least = min(least, unary[v, u, c])
    return least


@inline
def add_capped(total, terms, highest):
    """Add the terms, each cut off at `highest`."""
    for i in range(len(terms)):
        total[i] += min(terms[i], highest)


@kernel
def round_weights(weights, highest, scale, out):
    """Round min(weights, highest) * scale down, from (D, H, W) to (H + 2, W + 2, D)."""
    D, H, W = weights.shape
    for v in range(H):
        for d in range(D):
            for u in range(W):
                out[v + 1, u + 1, d] = int(min(weights[d, v, u], highest) * scale)


@kernel
def round_unary(unary, weights, step, scale, out):
    """Round each cost above the pixel's least one down, cut off just above the sum of the pixel's integer weights."""
    H, W, C = unary.shape
    D = weights.shape[1]
    for v in range(H):
        for u in range(W):
            n = (v + 1) * (W + 2) + u + 1
            enough = 1.0
            for d in range(D):
                enough += weights[n, d] + weights[n - step[d], d]
            least = lowest(unary, v, u)
            for c in range(C):
                out[n, c] = int(min((unary[v, u, c] - least) * scale, enough))
