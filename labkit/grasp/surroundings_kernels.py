"""What matters around a target: its middle, the points near it, and what the camera could not see there."""

from typing import NamedTuple

import numpy as np

from labkit.support.compiled import kernel


class Surroundings(NamedTuple):
    """A target and what is around it, metres in the base frame.

    centre: x, y of the target's middle. target: its points (N, 3). near: the scene's points near it (M, 3), without
    what is lower than the lowest tips. hidden: one point (K, 3) for each cell that the camera did not see, as high as
    something might stand there.
    """

    centre: np.ndarray
    target: np.ndarray
    near: np.ndarray
    hidden: np.ndarray


class Square(NamedTuple):
    """A square of the table, seen from above: its corner of least x and y, and the edge of a cell, metres."""

    x: float
    y: float
    cell: float


def surroundings(target, scene, camera, lowest, hand) -> Surroundings:
    """Collect what matters to a hand around a target. lowest: height of the lowest tips, metres.

    camera: its position, or None if it is unknown; then nothing counts as hidden.
    """
    centre = middle_of_area(target, hand.cell)
    radius = (hand.columns + 1) / 2 * hand.cell
    hidden = np.empty((0, 3))
    if camera is not None:
        hidden = hidden_points(scene, centre, radius, hand.cell, camera)
        hidden = hidden[hidden[:, 2] > lowest]
    raised = scene.compress(scene[:, 2] > lowest, axis=0)
    x, y = raised[:, 0] - centre[0], raised[:, 1] - centre[1]
    near = raised.compress((np.abs(x) < radius) & (np.abs(y) < radius), axis=0)
    return Surroundings(centre, target, near, hidden)


def middle_of_area(points, cell):
    """Find the middle of what points cover, seen from above: every cell counts once, however many points it has."""
    corner = points[:, :2].min(axis=0)
    cells = ((points[:, :2] - corner) / cell).astype(int)
    seen = np.zeros(cells.max(axis=0) + 1, bool)
    seen[tuple(cells.T)] = True
    return corner + (np.argwhere(seen).mean(axis=0) + 0.5) * cell


def hidden_points(scene, centre, radius, cell, camera):
    """Bound from above what the camera cannot see: one point (K, 3) per cell without a reading, near a place (x, y).

    A ray that grazes the top of what is seen passes over the cells behind it; what stood higher there would have been
    seen. So walk from the cell towards the camera to the first one that was seen, and use that along a ray
    tau = (camera height - z) / distance over ground stays the same.
    """
    n = int(2.0 * radius / cell)
    tau, z = np.full((n, n), np.inf), np.empty((n, n))
    square = Square(centre[0] - radius, centre[1] - radius, cell)
    cast_shadows(scene, camera, square, tau, z)
    row, column = np.nonzero(np.isinf(tau))
    return np.column_stack([square.x + (column + 0.5) * cell, square.y + (row + 0.5) * cell, z[row, column]])


@kernel
def cast_shadows(scene, camera, square, tau, z):
    """Fill tau (n, n) by cell, infinite without a reading, and z (n, n) there: how high something might stand."""
    n, cell = len(tau), square.cell
    for i in range(len(scene)):
        dx, dy = scene[i, 0] - square.x, scene[i, 1] - square.y
        if 0.0 <= dx < n * cell and 0.0 <= dy < n * cell:
            r, c = int(dy / cell), int(dx / cell)
            distance = max(np.sqrt((scene[i, 0] - camera[0]) ** 2 + (scene[i, 1] - camera[1]) ** 2), cell)
            tau[r, c] = min(tau[r, c], (camera[2] - scene[i, 2]) / distance)
    for r in range(n):
        for c in range(n):
            if tau[r, c] < np.inf:
                continue
            dx = camera[0] - (square.x + (c + 0.5) * cell)
            dy = camera[1] - (square.y + (r + 0.5) * cell)
            step = max(abs(dx), abs(dy), cell)
            grazed = np.inf
            u, v = c + 0.5, r + 0.5
            while grazed == np.inf and 0.0 <= u < n and 0.0 <= v < n:
                grazed = tau[int(v), int(u)]
                u, v = u + dx / step, v + dy / step
            z[r, c] = camera[2] - grazed * np.sqrt(dx**2 + dy**2)
