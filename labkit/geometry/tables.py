"""Which plane of a picture is the table: not the largest, but the one within reach that things stand on (topic 06)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from jaxtyping import Bool, Float

from labkit.geometry.clouds import Plane, fit_plane
from labkit.geometry.projection import transform_points
from labkit.support.validation import check_shape

SAMPLE = 15_000  # points of a picture that planes are looked for in
PLANES, LEAST = 8, 0.03  # planes that are looked at, the largest first; the share of the points that a table has
THICK = 0.012  # metres over or under a plane where no second one is looked for, at up to a metre (`slack`)
CURVED = 0.03  # metres, at up to a metre: how far a depth camera bends a table
STEEP, ACROSS = 0.5, 2  # sine of a slope that no table has, measured over so many pixels of the sample to both sides
GROWS = 5  # times that a bent table is followed beyond where it was found
NARROW = 0.08  # metres: a plane whose outline is narrower is the face of a thing
REACH = 1.6  # metres from the camera to the nearest tenth of a plane: further off nothing is grasped
FLAT = 0.2  # sine of the angle between a plane and the sight, at least: of flatter ones little is seen
SAME_HEIGHT = 0.03  # metres: two planes that are less far apart, and parallel, are one surface
PARALLEL = 0.9  # cosine of the angle between two planes, at least
BENT = 0.985  # cosine of the angle between two pieces of one bent surface, at least
STANDING = 0.012, 0.35  # metres over a table from which, and up to which, points belong to what stands on it
LEVEL = 0.9  # cosine of the angle between a table and the horizon, if that is known
CELL = 0.02  # metres: the grid on which a table's points hang together, over up to four cells that things hide
STATED = 0.05  # metres that a table may lie off its stated height
HIGH = 0.1  # metres between a table and another plane that is well over it


@dataclass(frozen=True, eq=False)
class Table:
    """A plane that things may stand on.

    plane: its normal points to the camera. T_table_frame: (4, 4), maps points of the frame that it was found in to the
    table's own, where z is the height over it (`base_on_table`). outline: convex, (M, 2), x and y of that frame: where
    the table was seen. things: the share of all points that belong to what stands on it. distance: metres from the
    camera to its nearest tenth. sine: of the angle between it and the line of sight. viewer: where the camera stands.
    bend: how high a depth camera shows its surface over the plane, as a polynomial of x and y (`surface`): what is flat
    is not quite so to a camera, which errs with the square of distance.
    """

    plane: Plane
    T_table_frame: Float[np.ndarray, "4 4"]
    outline: Float[np.ndarray, "M 2"]
    things: float
    distance: float
    sine: float
    viewer: Float[np.ndarray, "3"]
    bend: Float[np.ndarray, "6"]

    @property
    def score(self) -> float:
        """How likely it is the table: things on it, points of it, and a sight that is not along it, multiplied.

        The wall of a bin has nearly as much before it as the bin's floor has on it, but it is smaller and seen flatly.
        """
        return self.things * self.plane.inliers.mean() * self.sine

    def over(self, P: Float[np.ndarray, "N 3"]) -> tuple[Bool[np.ndarray, "N"], Float[np.ndarray, "N"]]:
        """Which points lie over or under the outline, and all points' heights over the table as it shows, metres."""
        Q = transform_points(self.T_table_frame, P)
        return in_convex_outline(self.outline, Q[:, :2]), Q[:, 2] - self.surface(Q[:, :2])

    def surface(self, xy: Float[np.ndarray, "N 2"]) -> Float[np.ndarray, "N"]:
        """How high over the plane the table shows at (x, y), metres; beside its outline as at the nearest end."""
        return _powers(np.clip(xy, self.outline.min(axis=0), self.outline.max(axis=0))) @ self.bend

    def slack(self, P: Float[np.ndarray, "N 3"], metres: float) -> Float[np.ndarray, "N"]:
        """A tolerance at each point: so many metres up to a metre from the camera, growing with the square beyond."""
        return slack(metres, np.linalg.norm(P - self.viewer, axis=1))

    @property
    def area(self) -> float:
        """Area of the outline, square metres."""
        return cv2.contourArea(self.outline.astype(np.float32))

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
        if table is not None:
            table = _grown(table, some, least)
            inside, over = table.over(P)
            left &= ~(inside & (np.abs(over) < table.slack(P, THICK)))
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


def slack(metres: float, distance: Float[np.ndarray, "N"]) -> Float[np.ndarray, "N"]:
    """A tolerance for points so far from a depth camera, whose errors grow with the square of distance (topic 06).

    >>> slack(0.01, np.array([0.5, 1.0, 2.0])).tolist()
    [0.01, 0.01, 0.04]
    """
    return metres * np.maximum(1.0, distance**2)


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


def _powers(xy: Float[np.ndarray, "N 2"]) -> Float[np.ndarray, "N 6"]:
    x, y = xy.T
    return np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)


def _table(plane: Plane, points, solid: Bool[np.ndarray, "h w"], viewer, least: float, bend=(0.0,) * 6) -> Table | None:
    """A plane as a table: the largest piece of it that hangs together; None if that is too small or seen too flatly.

    Where the camera sees through the plane, to something that lies under it, there is no table, nor close by: what
    crosses the plane there is a thing behind the table's edge.
    """
    T, bend = base_on_table(plane), np.asarray(bend)
    seen = points[np.isfinite(points[..., 2])]
    height = seen @ plane.normal + plane.offset
    over = viewer @ plane.normal + plane.offset
    # Not at the bent surface: far off, a polynomial says nothing.
    under = (
        height < -slack(max(THICK, 4.0 * plane.residual), np.linalg.norm(seen - viewer, axis=1)) - CURVED * bend.any()
    )
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
    table = Table(plane, T, outline, 0.0, float(np.percentile(away, 10)), float(sine), viewer, bend)
    return table if sine > FLAT and table.sides[1] > NARROW else None


def _grown(table: Table, points, least: float) -> Table:
    """Follow a table beyond where it was found, as far as it bends away from its plane no more than cameras do."""
    seen = np.isfinite(points).all(axis=-1)
    P = points[seen]
    Q, curved = transform_points(table.T_table_frame, P), table.slack(P, CURVED)
    powers = _powers(Q[:, :2])
    heights = np.full(seen.shape, np.nan)
    heights[seen] = Q[:, 2]
    level = ~_upright(heights, points)[seen]
    for _ in range(GROWS):
        inside, height = table.over(P)
        on = inside & (np.abs(height) < table.slack(P, THICK))
        bend = np.linalg.lstsq(powers[on], Q[on, 2], rcond=None)[0]
        shown = powers @ bend
        off = np.abs(Q[:, 2] - shown)
        thick = min(THICK, 3.0 * float(np.sqrt(np.mean(off[on] ** 2))) + 0.001)
        solid = np.zeros(seen.shape, bool)
        solid[seen] = (off < table.slack(P, thick)) & (np.abs(shown) < curved) & level
        larger = _table(table.plane, points, _without_specks(solid), table.viewer, least, bend)
        if larger is None or larger.area < 0.97 * table.area:
            break
        grown, table = larger.area > 1.01 * table.area, larger
        if not grown:
            break
    return table


def _upright(height: Float[np.ndarray, "h w"], points) -> Bool[np.ndarray, "h w"]:
    """Where a surface is steep: the face of a thing beside a table crosses its height, and is no piece of it."""
    upright = np.zeros(height.shape, bool)
    for axis, length in enumerate(height.shape):
        back, ahead = (np.clip(np.arange(length) + by, 0, length - 1) for by in (-ACROSS, ACROSS))
        rise = np.abs(height.take(ahead, axis) - height.take(back, axis))
        run = np.linalg.norm(points.take(ahead, axis) - points.take(back, axis), axis=-1)
        upright |= (rise > STEEP * run) & (run < NARROW)  # beyond a wide gap begins another surface
    return upright


def _same(a: Table, b: Table) -> bool:
    """Whether two planes are one surface, of which one was fitted to what is not quite flat of it.

    One of them then goes through the other's middle: of two steps neither does.
    """
    level = a.plane.normal @ b.plane.normal
    between, back = (abs(_middle(y) @ x.plane.normal + x.plane.offset) for x, y in ((a, b), (b, a)))
    return bool((between < SAME_HEIGHT and level > PARALLEL) or (back < SAME_HEIGHT and level > BENT))


def _standing(table: Table, others: list[Table], P: Float[np.ndarray, "N 3"]) -> float:
    """The share of the points that belong to what stands on a table, and on no other table well over it."""
    inside, height = table.over(P)
    stands = inside & (height > table.slack(P, STANDING[0])) & (height < STANDING[1])
    for other in others:
        if well_over(other, table):
            over, above = other.over(P)
            stands &= ~(over & (above > -THICK))
    return float(np.mean(stands))


def planes_beside(tables: Sequence[Table], table: Table | None) -> list[Table]:
    """Of tables found in the base frame, those at another height than one of them: not its own pieces and slopes."""
    return [other for other in tables if table is None or abs(height_of(other) - height_of(table)) > SAME_HEIGHT]


def table_at(tables: Sequence[Table], z: float) -> Table | None:
    """Of tables found in the base frame, the likeliest at a height z, give or take 5 cm; None without one."""
    return next((table for table in tables if abs(height_of(table) - z) < STATED), None)


def height_of(table: Table) -> float:
    """How high a table lies over z = 0 of the frame it was found in: its outline's middle, metres."""
    return float(_middle(table)[2])


def well_over(other: Table, table: Table) -> bool:
    """Whether another plane is parallel to a table, and high above it."""
    parallel = other is not table and other.plane.normal @ table.plane.normal > PARALLEL
    return bool(parallel and _middle(other) @ table.plane.normal + table.plane.offset > HIGH)


def _middle(table: Table) -> Float[np.ndarray, "3"]:
    """The middle of a table's outline, in the frame that the table was found in."""
    return (np.linalg.inv(table.T_table_frame) @ (*table.outline.mean(axis=0), 0.0, 1.0))[:3]
