"""An independent judge of surfaces: the distance of points from triangles, by brute force."""

import numpy as np


def distance_to_mesh(points, vertices, faces):
    """Distance of each point (N, 3) from the nearest triangle, after Ericson, Real-Time Collision Detection, 5.1.5."""
    a, b, c = (vertices[faces[:, i]][None] for i in range(3))
    p = points[:, None]
    ab, ac, ap = b - a, c - a, p - a
    d1, d2 = dot(ab, ap), dot(ac, ap)
    d3, d4 = dot(ab, p - b), dot(ac, p - b)
    d5, d6 = dot(ab, p - c), dot(ac, p - c)
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    with np.errstate(divide="ignore", invalid="ignore"):
        v, w = vb / (va + vb + vc), vc / (va + vb + vc)
        choices = [
            ((d1 <= 0) & (d2 <= 0), 0.0, 0.0),
            ((d3 >= 0) & (d4 <= d3), 1.0, 0.0),
            ((d6 >= 0) & (d5 <= d6), 0.0, 1.0),
            ((vc <= 0) & (d1 >= 0) & (d3 <= 0), d1 / (d1 - d3), 0.0),
            ((vb <= 0) & (d2 >= 0) & (d6 <= 0), 0.0, d2 / (d2 - d6)),
            (
                (va <= 0) & (d4 >= d3) & (d5 >= d6),
                1.0 - (d4 - d3) / (d4 - d3 + d5 - d6),
                (d4 - d3) / (d4 - d3 + d5 - d6),
            ),
        ]
    conditions = [condition for condition, _, _ in choices]
    v = np.select(conditions, [np.broadcast_to(x, v.shape) for _, x, _ in choices], v)
    w = np.select(conditions, [np.broadcast_to(x, w.shape) for _, _, x in choices], w)
    nearest = a + v[..., None] * ab + w[..., None] * ac
    return np.nanmin(np.linalg.norm(p - nearest, axis=-1), axis=1)


def dot(x, y):
    return np.einsum("...i,...i->...", x, y)
