"""What NumPy and SciPy are too slow at, compiled by numba: one pass over a depth image, and which points are near.

For the image NumPy needs a pass over memory for each operation. For the points SciPy's exact k-d trees take several
times as long as a grid of cubes. The benchmark of this topic measures both.
"""

from typing import NamedTuple

import numpy as np

from labkit.support.compiled import inline, kernel


def scale_rays(depth, rays, t):
    """Compute d * ray + t for every pixel of depth images (N, H, W), and NaN where d is not above 0 (or is NaN itself).

    rays: (H, W, 3). t: (3,). All float32.
    """
    N, H, W = depth.shape
    P = np.empty((N, H, W, 3), np.float32)
    scale_rows(depth, rays.reshape(H, 3 * W), np.tile(t, W), P.reshape(N, H, 3 * W))
    return P


@kernel
def scale_rows(depth, rays, t, P):
    """Fill P (N, H, 3 W) with d * ray + t; x, y and z of a row's pixels stand in turn.

    Row by row, d is first repeated for x, y and z: then the sum runs over plain rows of numbers, which the compiler
    turns into vector instructions. Twice as fast as the obvious loop over pixels.
    """
    N, H, W = depth.shape
    for n in range(N):
        for v in range(H):
            row, ray = P[n, v], rays[v]
            for u in range(W):
                d = depth[n, v, u] if depth[n, v, u] > 0.0 else np.float32(np.nan)
                row[3 * u] = row[3 * u + 1] = row[3 * u + 2] = d
            for k in range(3 * W):
                row[k] = row[k] * ray[k] + t[k]


class Viewpoint(NamedTuple):
    """What the geometry channels depend on besides depth; all float32.

    axes: (3, 3), from the gradient (q_u, q_v, q_1) of 1 / depth to the normal's parts. slant: (3,), the height that a
    ray gains for each metre of depth is its product with (u, v, 1). height: of the camera over the table. reach: the
    metres of the two height channels. footprint: metres at which its channel is 0.5, times the focal length.
    """

    axes: np.ndarray
    slant: np.ndarray
    height: np.float32
    reach: np.ndarray
    footprint: np.float32


@kernel
def fill_channels(depth, q, q_u, q_v, viewpoint, out):
    """Compute the geometry channels of every pixel, `out` (H, W, 7) in 0..1, from 1 / depth and its slopes.

    All float32; `out` comes as 0.5 everywhere, which a pixel without depth keeps.
    """
    axes, slant, camera_height, reach, footprint = viewpoint
    H, W = depth.shape
    half, one = np.float32(0.5), np.float32(1.0)
    for v in range(H):
        for u in range(W):
            d = depth[v, u]
            if d > 0.0:
                height = d * (slant[0] * u + slant[1] * v + slant[2]) + camera_height
                a, b = q_u[v, u], q_v[v, u]
                c = q[v, u] - a * u - b * v
                x = axes[0, 0] * a + axes[0, 1] * b + axes[0, 2] * c
                y = axes[1, 0] * a + axes[1, 1] * b + axes[1, 2] * c
                z = axes[2, 0] * a + axes[2, 1] * b + axes[2, 2] * c
                scale = half / (np.sqrt(x * x + y * y + z * z) + np.float32(1e-12))
                out[v, u, 0] += half * min(one, max(-one, height / reach[0]))
                out[v, u, 1] += half * min(one, max(-one, height / reach[1]))
                out[v, u, 2] = one
                out[v, u, 3] += scale * x
                out[v, u, 4] += scale * y
                out[v, u, 5] += scale * z
                out[v, u, 6] += half * min(one, max(-one, np.log2(d / footprint) / np.float32(3.0)))


def sort_into_cells(P, reach):
    """Sort the points of a cloud (N, 3) into cubes, so that points within `reach` are in the same or in nearby cubes.

    The edge of a cube is a hair under reach / sqrt(3): points in one cube are always within reach of each other, and
    points within reach are at most two cubes apart along each axis. A cube has the key x * x_step + y * y_step + z,
    with a margin of two empty cubes in y and z, so that two apart never means round the corner. The cloud must be less
    than a million times as wide as `reach`, so that keys fit in 64 bits.

    Returns the order that sorts the points by cube, the sorted points in float64, and (keys, starts, x_step, y_step) of
    the cubes that are not empty: cube i holds the sorted points starts[i] to starts[i + 1].
    """
    points = P.astype(np.float64)
    xyz = np.floor((points - points.min(axis=0, initial=np.inf)) * (1.7321 / reach)).astype(np.int64)
    y_step = xyz[:, 2].max(initial=0) + 3
    x_step = (xyz[:, 1].max(initial=0) + 3) * y_step
    key = xyz @ np.array([x_step, y_step, 1])
    order = np.argsort(key, kind="stable")
    keys, starts = np.unique(key[order], return_index=True)
    return order, points[order], (keys, np.append(starts, len(P)), x_step, y_step)


@inline
def nearby_cells(keys, offset):
    """Find, for every cell a, the run of cells first[a] to last[a] whose keys are within 2 of keys[a] + offset.

    `offset` is a step in x and y, so the run is that column's cells at most two apart in z. The keys are sorted: the
    run only moves forward while a does, and no search is needed.
    """
    first, last = np.empty(len(keys), np.int64), np.empty(len(keys), np.int64)
    low = high = 0
    for a in range(len(keys)):
        while low < len(keys) and keys[low] < keys[a] + offset - 2:
            low += 1
        while high < len(keys) and keys[high] <= keys[a] + offset + 2:
            high += 1
        first[a], last[a] = low, high
    return first, last


@inline
def closer_than(points, i, j, reach):
    """Say whether two points are at most `reach` apart."""
    x, y, z = points[i, 0] - points[j, 0], points[i, 1] - points[j, 1], points[i, 2] - points[j, 2]
    return x * x + y * y + z * z <= reach * reach


def count_neighbours(points, keys, starts, x_step, y_step, reach, enough):
    """Count the other points within `reach` of each point; the search for a point ends at `enough`."""
    sizes = np.diff(starts)
    count = np.repeat(sizes - 1, sizes)  # a point's own cube is all within reach
    add_neighbours(points, keys, starts, x_step, y_step, reach, enough, count)
    return count


@kernel
def add_neighbours(points, keys, starts, x_step, y_step, reach, enough, count):
    """Add to the count of each point its neighbours in other cubes."""
    for dx in range(-2, 3):
        for dy in range(-2, 3):
            first, last = nearby_cells(keys, dx * x_step + dy * y_step)
            for a in range(len(keys)):
                for i in range(starts[a], starts[a + 1]):
                    for j in range(starts[first[a]], starts[last[a]]):
                        if count[i] >= enough:
                            break
                        if not starts[a] <= j < starts[a + 1]:
                            count[i] += closer_than(points, i, j, reach)


@inline
def root(parent, a):
    """Follow a cell to the root of its tree, shortening the way for the next time."""
    while parent[a] != a:
        parent[a] = parent[parent[a]]
        a = parent[a]
    return a


@inline
def touch(points, starts, a, b, reach):
    """Say whether any point of cell a is within `reach` of any point of cell b."""
    for i in range(starts[a], starts[a + 1]):
        for j in range(starts[b], starts[b + 1]):
            if closer_than(points, i, j, reach):
                return True
    return False


def link_cells(points, keys, starts, x_step, y_step, reach):
    """Number the groups of points that chains with steps of at most `reach` hold together."""
    parent = np.arange(len(keys))
    join_cells(points, keys, starts, x_step, y_step, reach, parent)
    return np.repeat(parent, np.diff(starts))


@kernel
def join_cells(points, keys, starts, x_step, y_step, reach, parent):
    """Union-find over cells: afterwards the parent of each is the root that its group shares."""
    for dx in range(3):  # a pair of cells is met once from either side: half of the columns is enough
        for dy in range(-2 if dx else 0, 3):
            first, last = nearby_cells(keys, dx * x_step + dy * y_step)
            for a in range(len(keys)):
                for b in range(first[a], last[a]):
                    root_a, root_b = root(parent, a), root(parent, b)
                    if root_a != root_b and touch(points, starts, a, b, reach):
                        parent[max(root_a, root_b)] = min(root_a, root_b)
    for a in range(len(keys)):
        parent[a] = root(parent, a)
