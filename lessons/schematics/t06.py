"""Schematics of topic 06: the similar triangles of a pinhole camera, and the frames with a ray and its uncertainty."""

import numpy as np
from matplotlib.patches import Ellipse, Polygon
from style import COLD, HOT, INK, LEAF, SMALL, SOFT, TINTS, arrow, line, schematic, word


def by(place, right: float, up: float):
    """A place to the right of another and above it, in centimetres."""
    return np.asarray(place) + np.array([right, up])


@schematic("06_triangles", width=16, height=7)
def triangles(axes) -> None:
    """Side view of a camera: optical centre, image plane at f, a point at depth z, two similar triangles."""
    centre, f, z, y = np.array([1.6, 5.2]), 3.6, 10.0, 3.3
    foot, point = by(centre, z, 0), by(centre, z, -y)
    image, axis = by(centre, f, -y * f / z), by(centre, f, 0)
    axes.add_patch(Polygon([centre, foot, point], facecolor=TINTS[COLD], edgecolor="none"))
    axes.add_patch(Polygon([centre, axis, image], facecolor=TINTS[HOT], edgecolor="none"))
    arrow(axes, centre, by(centre, 13.2, 0))
    word(axes, by(centre, 13.5, 0.35), "z, the optical axis", ha="right")
    arrow(axes, centre, by(centre, 0, -2.6))
    word(axes, by(centre, -0.35, -2.5), "y")
    line(axes, centre, point, colour=COLD, width=1.8)
    line(axes, foot, point)
    line(axes, by(axis, 0, 1.3), by(axis, 0, -3.6), width=2.4)
    word(axes, by(axis, 0.1, -3.9), "image plane", colour=SOFT)
    for place in (centre, point, image):
        axes.plot(*place, "o", color=INK, markersize=5, zorder=6)
    word(axes, by(centre, -0.2, 0.45), "optical centre")
    word(axes, by(point, 0.3, -0.4), "point (y, z)")
    word(axes, by((axis + image) / 2, 0.25, 0.0), r"$v - c_y$", ha="left", colour=HOT)
    word(axes, by((foot + point) / 2, 0.3, 0), "y", ha="left", colour=COLD)
    word(axes, by(axis, -0.15, 0.4), r"$c_y$", ha="right")
    for x, name, below, colour in ((f, "f", 0.75, HOT), (z, "z", 1.25, COLD)):
        arrow(axes, by(centre, x / 2, below), by(centre, x, below), colour=colour)
        arrow(axes, by(centre, x / 2, below), by(centre, 0, below), colour=colour)
        word(axes, by(centre, x / 2 + 0.6, below + 0.28), name, colour=colour)
    word(axes, (8.0, 0.6), r"the small triangle and the large one are similar:  $(v - c_y)\,/\,f = y\,/\,z$")


def frame_axes(axes, at, ends, names) -> None:
    """Three axes of a frame, drawn as on paper."""
    for end, name in zip(ends, names, strict=True):
        end = np.asarray(end)
        arrow(axes, at, at + end)
        word(axes, at + end * 1.25, name, size=SMALL)


@schematic("06_frames", width=16, height=8)
def frames(axes) -> None:
    """Base frame and camera frame, the pose between them, and a ray whose depth is uncertain."""
    base, camera, point = np.array([2.4, 1.6]), np.array([3.6, 6.3]), np.array([10.4, 2.2])
    line(axes, (0.6, 0.9), (15.4, 0.9), colour=SOFT, width=0.8)
    word(axes, (14.6, 0.55), "table", colour=SOFT, size=SMALL)
    frame_axes(axes, base, ((0, 1.5), (1.5, 0), (0.95, 0.5)), ("z", "x", "y"))
    word(axes, by(base, -1.2, 0.7), "base")
    along = (point - camera) / np.linalg.norm(point - camera)
    across = np.array([along[1], -along[0]])
    frame_axes(axes, camera, (1.6 * along, 1.1 * across, (-0.95, -0.3)), ("", "y", "x"))
    word(axes, camera + 1.6 * along - 0.35 * across, "z", size=SMALL)  # beside the ray
    word(axes, by(camera, -0.5, 0.5), "camera")
    arrow(axes, base, camera, colour=LEAF, gap=0.15, dashed=True, width=1.8)
    word(axes, (3.9, 3.9), r"$T_{base\_cam}$", colour=LEAF)
    line(axes, camera + 1.6 * along, point, colour=COLD, width=1.6)
    word(axes, (7.7, 4.7), r"$d\,\mathbf{q}(u, v)$", colour=COLD)
    arrow(axes, base, point, gap=0.15, dashed=True, colour=HOT)
    word(axes, (7.3, 1.45), r"$P_{base}$", colour=HOT)
    turn = np.degrees(np.arctan2(along[1], along[0]))
    look = {"facecolor": TINTS[HOT], "edgecolor": HOT, "alpha": 0.8, "zorder": 2, "linewidth": 1.5}
    axes.add_patch(Ellipse(point, 2.6, 0.7, angle=turn, **look))
    axes.plot(*point, "o", color=INK, markersize=5, zorder=6)
    word(axes, by(point, 0.9, 1.1), r"$\Sigma_P = J S J^{\top}$", ha="left", colour=HOT)
    word(axes, by(point, 0.9, 0.55), "long along the ray: depth", ha="left", size=SMALL)
    word(axes, by(point, 0.9, 0.15), "short across it: pixels", ha="left", size=SMALL)
    word(axes, (11.4, 7.3), r"$P_{base} = T_{base\_cam}\ P_{cam}$:  the frames cancel")
