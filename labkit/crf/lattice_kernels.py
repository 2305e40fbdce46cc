"""Gaussian filtering of many dimensions on the permutohedral lattice (Adams, Baek and Davis 2010), compiled by numba.

A Gaussian over d features of N pixels sums N^2 terms. Instead, each pixel gives its values to the d + 1 corners of the
simplex around its features (splat), the corners exchange with their neighbours along d + 1 directions (blur), and each
pixel collects from its corners again (slice). The work is linear in N and in d^2.

A corner has integer coordinates; they are packed into one integer, key = coordinates . stride, so that a step along a
direction adds a constant to the key. Corner 0 stands for "none" and always holds zeros.
"""

import numpy as np

from labkit.support.compiled import kernel


@kernel
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


def neighbour_corners(found, steps):
    """Look up each corner's two neighbours along each direction: (directions, M + 1, 2), 0 where there is none.

    found: the M keys, ascending; corner m + 1 has the key found[m].
    """
    near = np.zeros((len(steps), len(found) + 1, 2), np.int32)
    for j, step in enumerate(steps):
        place = np.minimum(np.searchsorted(found, found + step), len(found) - 1)
        m = np.flatnonzero(found[place] == found + step)
        near[j, 1 + m, 1] = 1 + place[m]
        near[j, 1 + place[m], 0] = 1 + m
    return near


@kernel
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
