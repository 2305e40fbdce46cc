"""One sweep of mean field over the pixel grid, compiled by numba."""

import numpy as np
from numba import njit


@njit(cache=True)
def mean_field_sweep(unary, weights, offsets, T, q):
    """Update q in place, pixel by pixel: q_p(c) ~ exp(-(psi_p(c) - sum over neighbours of w q_neighbour(c)) / T)."""
    H, W, C = unary.shape
    cost = np.empty(C)
    for v in range(H):
        for u in range(W):
            for c in range(C):
                cost[c] = unary[v, u, c]
            for d in range(len(offsets)):
                down, right = offsets[d]
                if weights[d, v, u] > 0.0:
                    for c in range(C):
                        cost[c] -= weights[d, v, u] * q[v + down, u + right, c]
                up, left = v - down, u - right
                if up >= 0 and 0 <= left < W and weights[d, up, left] > 0.0:
                    for c in range(C):
                        cost[c] -= weights[d, up, left] * q[up, left, c]
            lowest = cost.min()
            total = 0.0
            for c in range(C):
                q[v, u, c] = np.exp((lowest - cost[c]) / T)
                total += q[v, u, c]
            for c in range(C):
                q[v, u, c] /= total
