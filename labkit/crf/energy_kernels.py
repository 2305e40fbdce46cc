"""Loops over the pixel grid, compiled by numba: weights of neighbours, energy, and sweeps of ICM and mean field."""

import numpy as np

from labkit.support.compiled import inline, kernel


@kernel
def pair_exponents(image, scale, extra, offsets, nearness, exponents):
    """Fill exponents[d, v, u] = nearness[d] - |f_p - f_q|^2 / 2 for the pair of pixel (v, u) and the one offsets[d] on.

    The features f of a pixel are scale * image and the channels of `extra`, in which NaN differs from nothing. A pair
    that leaves the image gets -inf, and so the weight 0.
    """
    H, W, channels = image.shape
    features = np.empty((2, channels + extra.shape[2], W))
    here, below = features[0], features[1]
    for v in range(-1, H):
        here, below = below, here
        if v + 1 < H:
            load_row(image, scale, extra, v + 1, below)
        for d in range(len(offsets) if v >= 0 else 0):
            down, right = offsets[d, 0], offsets[d, 1]
            exponents[d, v] = -np.inf
            if v + down < H:
                other = below if down else here
                first, last = max(0, -right), W - max(0, right)
                pairs = exponents[d, v, first:last]
                pairs[:] = nearness[d]
                for c in range(len(here)):
                    add_contrast(here[c, first:last], other[c, first + right : last + right], pairs)


@inline
def load_row(image, scale, extra, v, row):
    """Copy the features of one row of pixels, channel by channel."""
    channels = image.shape[2]
    for c in range(channels):
        for u in range(image.shape[1]):
            row[c, u] = image[v, u, c] * scale
    for c in range(extra.shape[2]):
        for u in range(image.shape[1]):
            row[channels + c, u] = extra[v, u, c]


@inline
def add_contrast(a, b, pairs):
    """Subtract |a - b|^2 / 2 pair by pair, except where the difference is NaN."""
    for i in range(len(pairs)):
        difference = a[i] - b[i]
        pairs[i] -= 0.5 * difference * difference if difference == difference else 0.0


@kernel
def energy_by_row(unary, weights, offsets, y):
    """Sum the energy of the labels `y` (H, W) row by row, so that no sum has more terms than a row: (H,)."""
    H, W = y.shape
    rows = np.zeros(H)
    for v in range(H):
        total = 0.0
        for u in range(W):
            total += unary[v, u, y[v, u]]
        for d in range(len(offsets)):
            down, right = offsets[d, 0], offsets[d, 1]
            if v + down < H:
                for u in range(max(0, -right), W - max(0, right)):
                    total += weights[d, v, u] if y[v, u] != y[v + down, u + right] else 0.0
        rows[v] = total
    return rows


@kernel
def icm_sweep(unary, weights, offsets, labels):
    """Give each pixel in turn the class that is best given its neighbours; return how many changed."""
    H, W, C = unary.shape
    cost = np.empty(C)
    changed = 0
    for v in range(H):
        for u in range(W):
            for c in range(C):
                cost[c] = unary[v, u, c]
            for d in range(len(offsets)):
                down, right = offsets[d]
                if weights[d, v, u] > 0.0:  # agreeing saves what disagreeing costs
                    cost[labels[v + down, u + right]] -= weights[d, v, u]
                up, left = v - down, u - right
                if up >= 0 and 0 <= left < W and weights[d, up, left] > 0.0:
                    cost[labels[up, left]] -= weights[d, up, left]
            best = labels[v, u]
            for c in range(C):
                if cost[c] < cost[best]:
                    best = c
            if best != labels[v, u]:
                labels[v, u] = best
                changed += 1
    return changed


@kernel
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
