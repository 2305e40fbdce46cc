"""Gaussian filtering of many dimensions on the permutohedral lattice (Adams, Baek and Davis 2010), compiled by numba.

A Gaussian over d features of N pixels sums N^2 terms. Instead, each pixel gives its values to the d + 1 corners of the
simplex around its features (splat), the corners exchange with their neighbours along d + 1 directions (blur), and each
pixel collects from its corners again (slice). The work is linear in N and in d^2.

A corner has integer coordinates; they are packed into one integer, key = coordinates . stride, so that a step along a
direction adds a constant to the key. Corner 0 stands for "none" and always holds zeros.
"""

import numpy as np
from numba import njit


@njit(cache=True)
def elevate(features, E):
    """Map each pixel's features to the plane sum(x) = 0: (N, d + 1), with the least and largest of each coordinate."""
    N, d = features.shape
    elevated = np.zeros((N, d + 1), np.float32)
    least, largest = np.full(d + 1, np.inf, np.float32), np.full(d + 1, -np.inf, np.float32)
    for n in range(N):
        for i in range(d + 1):
            for j in range(d):
                elevated[n, i] += E[i, j] * features[n, j]
            least[i] = min(least[i], elevated[n, i])
            largest[i] = max(largest[i], elevated[n, i])
    return elevated, least, largest


@njit(cache=True)
def corners_of_pixels(elevated, lowest, stride):
    """Find the simplex around each point of the plane sum(x) = 0: the keys and barycentric weights of its corners."""
    N, d1 = elevated.shape
    keys = np.empty((N, d1), np.int64)
    weights = np.empty((N, d1), np.float32)
    base, rank = np.empty(d1, np.int64), np.empty(d1, np.int64)
    rest, barycentric = np.empty(d1, np.float32), np.empty(d1 + 1, np.float32)
    for n in range(N):
        # The nearest point whose coordinates are all multiples of d + 1, before they are made to sum to 0.
        excess = 0
        for i in range(d1):
            multiple = int(np.floor(elevated[n, i] / d1 + np.float32(0.5)))
            base[i] = multiple * d1
            rest[i] = elevated[n, i] - base[i]
            excess += multiple
        # Rank 0 lies furthest above its multiple.
        rank[:] = excess
        for i in range(d1):
            for j in range(i + 1, d1):
                if rest[i] < rest[j]:
                    rank[i] += 1
                else:
                    rank[j] += 1
        barycentric[:] = 0.0
        for i in range(d1):
            if rank[i] < 0:
                rank[i] += d1
                base[i] += d1
            elif rank[i] >= d1:
                rank[i] -= d1
                base[i] -= d1
            part = (elevated[n, i] - base[i]) / d1
            barycentric[d1 - 1 - rank[i]] += part
            barycentric[d1 - rank[i]] -= part
        barycentric[0] += 1.0 + barycentric[d1]
        # Corner r lies r above the base in the coordinates of low rank and r - (d + 1) in the others.
        for r in range(d1):
            key = 0
            for i in range(d1 - 1):
                key += (base[i] + (r if rank[i] < d1 - r else r - d1) - lowest[i]) * stride[i]
            keys[n, r] = key
            weights[n, r] = barycentric[r]
    return keys, weights


@njit(cache=True)
def slot_of(table_keys, key):
    """Where a key is in the hash table, or where it would go: the first free slot from its hash on."""
    mask = len(table_keys) - 1
    slot = ((key * -7046029254386353131) >> 20) & mask
    while table_keys[slot] >= 0 and table_keys[slot] != key:
        slot = (slot + 1) & mask
    return slot


@njit(cache=True)
def number_corners(keys):
    """Number the distinct keys from 1 in the order of their appearance: (corner of each key, keys, hash table)."""
    N, d1 = keys.shape
    corner = np.empty((N, d1), np.int32)
    found = np.empty(N * d1 + 1, np.int64)
    table_keys, table_corners = np.full(1 << 14, -1, np.int64), np.zeros(1 << 14, np.int32)
    M = 0
    for n in range(N):
        if 4 * (M + d1) > 2 * len(table_keys):  # half full: twice the size
            size = 2 * len(table_keys)
            table_keys, table_corners = np.full(size, -1, np.int64), np.zeros(size, np.int32)
            for m in range(1, M + 1):
                slot = slot_of(table_keys, found[m])
                table_keys[slot], table_corners[slot] = found[m], m
        for r in range(d1):
            key = keys[n, r]
            if n > 0 and keys[n - 1, r] == key:  # pixels side by side often share a simplex
                corner[n, r] = corner[n - 1, r]
                continue
            slot = slot_of(table_keys, key)
            if table_keys[slot] < 0:
                M += 1
                found[M] = key
                table_keys[slot], table_corners[slot] = key, M
            corner[n, r] = table_corners[slot]
    return corner, found[: M + 1].copy(), table_keys, table_corners


@njit(cache=True)
def neighbour_corners(found, table_keys, table_corners, steps):
    """Look up each corner's two neighbours along each direction: (directions, M + 1, 2), 0 where there is none."""
    near = np.zeros((len(steps), len(found), 2), np.int32)
    for j in range(len(steps)):
        for m in range(1, len(found)):
            slot = slot_of(table_keys, found[m] + steps[j])
            if table_keys[slot] >= 0:
                other = table_corners[slot]
                near[j, m, 1] = other
                near[j, other, 0] = m
    return near


@njit(cache=True)
def lattice_filter(values, scale, corner, weights, near, out):
    """Splat, blur and slice: out += scale * filtered (scale * values); values and out (N, C), scale (N,)."""
    N, d1 = corner.shape
    C = values.shape[1]
    old = np.zeros((near.shape[1], C), np.float32)
    new = np.zeros_like(old)
    for n in range(N):
        pixel = values[n]
        for r in range(d1):
            w = weights[n, r] * scale[n]
            lattice_point = old[corner[n, r]]
            for c in range(C):
                lattice_point[c] += w * pixel[c]
    for j in range(d1):
        for m in range(1, len(old)):
            blurred, centre, one, other = new[m], old[m], old[near[j, m, 0]], old[near[j, m, 1]]
            for c in range(C):
                blurred[c] = centre[c] + np.float32(0.5) * (one[c] + other[c])
        old, new = new, old
    for n in range(N):
        pixel = out[n]
        for r in range(d1):
            w = weights[n, r] * scale[n]
            lattice_point = old[corner[n, r]]
            for c in range(C):
                pixel[c] += w * lattice_point[c]


@njit(cache=True)
def softmax(z, q):
    """q = softmax of each row of z."""
    N, C = z.shape
    for n in range(N):
        top = z[n, 0]
        for c in range(1, C):
            top = max(top, z[n, c])
        total = np.float32(0.0)
        for c in range(C):
            q[n, c] = np.exp(z[n, c] - top)
            total += q[n, c]
        for c in range(C):
            q[n, c] /= total
