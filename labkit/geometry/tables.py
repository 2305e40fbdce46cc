"""Which plane of a picture is the table: not the largest, but the one within reach that things stand on (topic 06)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from jaxtyping import Bool, Float, Integer

from labkit.geometry.clouds import Plane, cluster_indices, fit_plane
from labkit.geometry.projection import transform_points
from labkit.support.validation import check_shape

SAMPLE = 15_000  # points of a picture that planes are looked for in
PLANES, LEAST = 8, 0.03  # planes that are looked at, the largest first; the share of the points that a table has
THICK = 0.012  # metres over or under a plane where no second one is looked for
NARROW = 0.08  # metres: a plane whose outline is narrower is the face of a thing
REACH = 1.6  # metres from the camera to the nearest tenth of a plane: further off nothing is grasped
FLAT = 0.2  # sine of the angle between a plane and the sight, at least: of flatter ones little is seen
SAME_HEIGHT = 0.03  # metres: two planes that are less far apart, and parallel, are one surface
PARALLEL = 0.9  # cosine of the angle between two planes, at least
STANDING = 0.012, 0.35  # metres over a table from which, and up to which, points belong to what stands on it
LEVEL = 0.9  # cosine of the angle between a table and the horizon, if that is known
CELL = 0.02  # metres: the grid on which a table's points hang together, over up to four cells that things hide
STATED = 0.05  # metres that a table may lie off its stated height
HIGH, BORDER = 0.1, 0.01  # metres over the table, at that share of the picture from its border: what is there hangs in
GAP = 0.02  # metres of empty space between two things, at least
SHELF = 0.25  # metres: a wider plane over the table is no top of a thing
HANGS = "hang into the picture from its border, as a robot does"
BESIDE = "do not stand on the table, but beside it"
ABOVE = "stand well over the table, as on a shelf"


@dataclass(frozen=True, eq=False)
class Table:
    """A plane that things may stand on.

    plane: its normal points to the camera. T_table_frame: (4, 4), maps points of the frame that it was found in to the
    table's own, where z is the height over it (`base_on_table`). outline: convex, (M, 2), x and y of that frame: where
    the table was seen. things: the share of all points that belong to what stands on it. distance: metres from the
    camera to its nearest tenth. sine: of the angle between it and the line of sight.
    """

    plane: Plane
    T_table_frame: Float[np.ndarray, "4 4"]
    outline: Float[np.ndarray, "M 2"]
    things: float
    distance: float
    sine: float

    @property
    def score(self) -> float:
        """How likely it is the table: things on it, points of it, and a sight that is not along it, multiplied.

        The wall of a bin has nearly as much before it as the bin's floor has on it, but it is smaller and seen flatly.
        """
        return self.things * self.plane.inliers.mean() * self.sine

    def over(self, P: Float[np.ndarray, "N 3"]) -> tuple[Bool[np.ndarray, "N"], Float[np.ndarray, "N"]]:
        """Which points lie over or under the outline, and all points' heights over the plane, metres."""
        Q = transform_points(self.T_table_frame, P)
        return in_convex_outline(self.outline, Q[:, :2]), Q[:, 2]

    @property
    def sides(self) -> tuple[float, float]:
        """Length and width of the smallest rectangle around the outline, metres."""
        width, length = sorted(cv2.minAreaRect(self.outline.astype(np.float32))[1])
        return length, width

    def __repr__(self) -> str:
        return f"Table({self.plane!r}, {self.things:.0%} of all points stand on it)"


def find_tables(
    points: Float[np.ndarray, "H W 3"], viewer=(0.0, 0.0, 0.0), up: Sequence[float] | None = None
) -> list[Table]:
    """Find the planes that could be the table, the likeliest first; none if there is no plane.

    points: of a picture's pixels, metres, NaN without depth, in the camera's frame or the base frame. viewer: where the
    camera stands in that frame. up: what is up in it, if it is known; planes that lean against it by more than 26
    degrees are left out then. The planes come from RANSAC, one after the
    other. First come those within reach of the camera, and of these the one of highest `score`: what stands on it lies
    over its outline by 12 mm to 35 cm, and over no other such plane in between. So a floor that fills most of the
    picture comes after the low table with the things on it. Topic 06.
    """
    points = check_shape("points", points, (None, None, 3))
    step = max(1, round(np.sqrt(points.shape[0] * points.shape[1] / SAMPLE)))
    some = points[::step, ::step].astype(np.float64)
    seen = np.isfinite(some).all(axis=-1)
    P, left = some[seen], np.ones(np.count_nonzero(seen), bool)
    least = max(100.0, LEAST * len(P))
    tables: list[Table] = []
    for _ in range(PLANES):
        if np.count_nonzero(left) < least:
            break
        try:
            plane = fit_plane(P[left], viewer=viewer)
        except ValueError:  # points on a line
            break
        height = np.full(seen.shape, np.inf)
        height[seen] = np.abs(P @ plane.normal + plane.offset)
        left &= height[seen] > THICK
        plane = replace(plane, inliers=height[seen] < THICK)
        solid = _without_specks(height < min(THICK, 3.0 * plane.residual + 0.001))
        table = _table(plane, some, solid, np.asarray(viewer, np.float64), least)
        level = up is None or plane.normal @ np.asarray(up) > LEVEL
        if table is not None and level and not any(_same(table, other) for other in tables):
            tables.append(table)
    shares = [_standing(table, [other for other in tables if other is not table], P) for table in tables]
    tables = [replace(table, things=share) for table, share in zip(tables, shares, strict=True)]
    return sorted(tables, key=lambda table: (table.distance > REACH, -table.score, -table.plane.inliers.sum()))


def base_on_table(plane: Plane) -> Float[np.ndarray, "4 4"]:
    """Lay a base frame on a table that was found in the camera's frame: T_base_cam.

    The origin is the table's point under the camera, z is the table's normal, and x points away from the camera, along
    its line of sight; looking straight down, along the picture's upper edge. Topic 06.

    >>> base_on_table(Plane(np.array([0.0, 0.0, -1.0]), 0.7, np.ones(4, bool), 0.0))[:3, 3].tolist()
    [0.0, 0.0, 0.7]
    """
    z = plane.normal
    ahead = np.array([0.0, 0.0, 1.0])
    if abs(z @ ahead) > 0.999:
        ahead = np.array([0.0, -1.0, 0.0])
    x = ahead - (ahead @ z) * z
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3] = np.stack([x, np.cross(z, x), z])
    T[2, 3] = plane.offset
    return T


def in_convex_outline(outline: Float[np.ndarray, "M 2"], xy: Float[np.ndarray, "N 2"]) -> Bool[np.ndarray, "N"]:
    """Which places lie in a convex outline, or on it.

    >>> in_convex_outline(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), np.array([[0.2, 0.2], [0.8, 0.8]])).tolist()
    [True, False]
    """
    left, right = np.ones((2, len(xy)), bool)
    for corner, (dx, dy) in zip(outline, np.roll(outline, -1, axis=0) - outline, strict=True):
        side = dx * (xy[:, 1] - corner[1]) - dy * (xy[:, 0] - corner[0])
        left, right = left & (side >= 0.0), right & (side <= 0.0)
    return left | right


def _without_specks(mask: Bool[np.ndarray, "h w"]) -> Bool[np.ndarray, "h w"]:
    """A mask without what is narrower than three pixels, such as the line where a plane cuts a thing."""
    return cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)) > 0


def _table(plane: Plane, points, solid: Bool[np.ndarray, "h w"], viewer, least: float) -> Table | None:
    """A plane as a table: the largest piece of it that hangs together; None if that is too small or seen too flatly.

    Where the camera sees through the plane, to something that lies under it, there is no table, nor close by: what
    crosses the plane there is a thing behind the table's edge.
    """
    T = base_on_table(plane)
    seen = points[np.isfinite(points[..., 2])]
    height = seen @ plane.normal + plane.offset
    over = viewer @ plane.normal + plane.offset
    under = height < -max(THICK, 4.0 * plane.residual)
    crossed = viewer + (seen[under] - viewer) * (over / (over - height[under]))[:, None]
    P = points[solid]
    if len(P) < least:
        return None
    cells = np.floor(transform_points(T, np.concatenate([P, crossed]))[:, :2] / CELL).astype(int)
    cells -= cells[: len(P)].min(axis=0) - 1
    size = cells[: len(P)].max(axis=0) + 2
    if (size > 3000).any():  # a hundred metres: not a table
        return None
    through = np.zeros(size, np.uint8)
    cells, gone = cells[: len(P)], cells[len(P) :]
    through[tuple(gone[((gone >= 0) & (gone < size)).all(axis=1)].T)] = 1
    there = cv2.dilate(through, np.ones((3, 3), np.uint8))[tuple(cells.T)] == 0
    P, cells = P[there], cells[there]
    grid = np.zeros(size, np.uint8)
    grid[tuple(cells.T)] = 1
    piece = cv2.connectedComponents(cv2.dilate(grid, np.ones((5, 5), np.uint8)))[1][tuple(cells.T)]
    largest = piece == np.bincount(piece, minlength=2).argmax()
    if np.count_nonzero(largest) < least:
        return None
    P = P[largest]
    outline = cv2.convexHull(transform_points(T, P)[:, :2].astype(np.float32))[:, 0].astype(np.float64)
    away = np.linalg.norm(P - viewer, axis=1)
    sine = over / np.median(away)
    table = Table(plane, T, outline, 0.0, float(np.percentile(away, 10)), float(sine))
    return table if sine > FLAT and table.sides[1] > NARROW else None


def _same(a: Table, b: Table) -> bool:
    """Whether two planes are one surface, of which one was fitted to what is not quite flat of it."""
    between = abs(_middle(b) @ a.plane.normal + a.plane.offset)
    return bool(between < SAME_HEIGHT and a.plane.normal @ b.plane.normal > PARALLEL)


def _standing(table: Table, others: list[Table], P: Float[np.ndarray, "N 3"]) -> float:
    """The share of the points that belong to what stands on a table, and on no other table well over it."""
    inside, height = table.over(P)
    stands = inside & (height > STANDING[0]) & (height < STANDING[1])
    for other in others:
        if _well_over(other, table):
            over, above = other.over(P)
            stands &= ~(over & (above > -THICK))
    return float(np.mean(stands))


def table_at(tables: Sequence[Table], z: float) -> Table | None:
    """Of tables found in the base frame, the likeliest at a height z, give or take 5 cm; None without one."""
    return next((table for table in tables if abs(height_of(table) - z) < STATED), None)


def height_of(table: Table) -> float:
    """How high a table lies over z = 0 of the frame it was found in: its outline's middle, metres."""
    return float(_middle(table)[2])


def reasons_against(
    table: Table,
    tables: Sequence[Table],
    points: Float[np.ndarray, "H W 3"],
    things: Sequence[Integer[np.ndarray, "_"]],
) -> list[str]:
    """Say of each thing in a picture why it does not stand on a table; "" if it does.

    tables: all that were found, the table among them. things: the pixels of each, v * W + u. Three things speak against
    one: it hangs together with something that comes in from the picture's border high over the table, as a robot does;
    two fifths of it lie beside the table's outline; or it stands on another plane over the table, such as a shelf, or
    begins more than 35 cm over it.
    """
    hanging = _hanging(table, points).ravel()
    flat = points.reshape(-1, 3)
    shelves = [other for other in tables if _well_over(other, table) and other.sides[1] > SHELF]
    reasons = []
    for pixels in things:
        P = flat[pixels].astype(np.float64)
        inside, height = table.over(P)
        on_shelf = [np.mean(over & (above > -THICK)) for over, above in (shelf.over(P) for shelf in shelves)]
        if np.mean(hanging[pixels]) > 0.3:
            reasons.append(HANGS)
        elif np.mean(inside) < 0.6:
            reasons.append(BESIDE)
        elif any(share > 0.5 for share in on_shelf) or np.percentile(height, 2) > STANDING[1]:
            reasons.append(ABOVE)
        else:
            reasons.append("")
    return reasons


def _well_over(other: Table, table: Table) -> bool:
    """Whether another plane is parallel to a table, and high above it."""
    parallel = other is not table and other.plane.normal @ table.plane.normal > PARALLEL
    return bool(parallel and _middle(other) @ table.plane.normal + table.plane.offset > HIGH)


def _middle(table: Table) -> Float[np.ndarray, "3"]:
    """The middle of a table's outline, in the frame that the table was found in."""
    return (np.linalg.inv(table.T_table_frame) @ (*table.outline.mean(axis=0), 0.0, 1.0))[:3]


def _hanging(table: Table, points: Float[np.ndarray, "H W 3"]) -> Bool[np.ndarray, "H W"]:
    """Pixels of what hangs together with something that is high over the table at the picture's border.

    Only what is half as high links: the walls of a bin come in from the border, too, and go down to what lies in it.
    """
    H, W = points.shape[:2]
    step = max(1, round(np.sqrt(H * W / 40_000)))
    some = points[::step, ::step].astype(np.float64)
    height = np.full(some.shape[:2], -np.inf)
    seen = np.isfinite(some).all(axis=-1)
    height[seen] = table.over(some[seen])[1]
    rising = np.argwhere(height > HIGH / 2.0)
    border = (np.minimum(rising, np.array(height.shape) - 1 - rising) < BORDER * max(height.shape)).any(axis=1)
    high = height[tuple(rising.T)] > HIGH
    hanging = np.zeros(height.shape, bool)
    for group in cluster_indices(some[tuple(rising.T)], GAP):
        if np.count_nonzero((border & high)[group]) > 5:
            hanging[tuple(rising[group].T)] = True
    wide = cv2.dilate(hanging.astype(np.uint8), np.ones((3, 3), np.uint8))
    return np.kron(wide, np.ones((step, step), np.uint8))[:H, :W] > 0
