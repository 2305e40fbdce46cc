"""What stands on a table, and what hangs over it or stands elsewhere (topic 06).

A thing stands where it touches what is below it: the table, or other things that stand. So a box that the picture's
border cuts off still stands, and a robot that comes in from there does not: it touches nothing, or only with its end.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, Integer

from labkit.geometry.clouds import cluster_indices
from labkit.geometry.projection import transform_points
from labkit.geometry.tables import HIGH, STANDING, THICK, Table, well_over

BORDER = 0.01  # of the picture's length: what is nearer to its border comes in from there
GAP = 0.02  # metres of empty space between two things, at least
SHELF = 0.25  # metres: a wider plane over the table is no top of a thing
FOOT = 0.035  # metres over the table: what reaches down so far touches it
REACHES = 0.45  # of a thing's length: its middle lies no further from where it touches what is below it
TOUCHES = 12  # points of a thing, of up to MOST, that touch what it stands on, at least
MOST = 1500  # points of a thing that are looked at
HANGS = "hang into the picture from its border, as a robot does"
BESIDE = "do not stand on the table, but beside it"
ABOVE = "stand well over the table, as on a shelf"


def reasons_against(
    table: Table,
    tables: Sequence[Table],
    points: Float[np.ndarray, "H W 3"],
    things: Sequence[Integer[np.ndarray, "_"]],
) -> list[str]:
    """Say of each thing in a picture why it does not stand on a table; "" if it does.

    tables: all that were found, the table among them. things: the pixels of each, v * W + u. Three things speak against
    one: it hangs together with something that comes in from the picture's border high over the table, as a robot does,
    and touches neither the table nor what stands there; two fifths of it lie beside the table's outline, and it does
    not touch the table; or it stands on another plane over the table, such as a shelf, or begins more than 35 cm over
    it.
    """
    flat = points.reshape(-1, 3)
    bodies = [_body(table, flat[pixels]) for pixels in things]
    hanging, ground = _hanging(table, points).ravel(), _ground(table, flat)
    shelves = [other for other in tables if well_over(other, table) and other.sides[1] > SHELF]
    reasons = []
    for pixels, body in zip(things, bodies, strict=True):
        P = flat[pixels].astype(np.float64)
        inside, height = table.over(P)
        on_shelf = [np.mean(over & (above > -THICK)) for over, above in (shelf.over(P) for shelf in shelves)]
        if any(share > 0.5 for share in on_shelf) or np.median(height) > STANDING[1]:
            reasons.append(ABOVE)
        elif np.mean(hanging[pixels]) > 0.3:
            reasons.append("" if body.rests_on(body.foot()) else HANGS)
        else:
            reasons.append(
                "" if np.mean(inside) > 0.6 or body.rests_on(body.foot() & body.touching(ground)) else BESIDE
            )
    return _unless_on_others(bodies, reasons)


@dataclass(frozen=True, eq=False)
class Body:
    """The largest piece of a thing that hangs together: a mask's seam that lies on what is behind it is left out.

    P: its points in the table's frame, some of them, (N, 3), z over the table as it shows. gap: for each, how far off
    what it touches may lie.
    """

    P: Float[np.ndarray, "N 3"]
    gap: Float[np.ndarray, "N"]

    def foot(self) -> Bool[np.ndarray, "N"]:
        """Which points are near the table; none if it does not reach down so far."""
        if not len(self.P):
            return np.zeros(0, bool)
        low = np.percentile(self.P[:, 2], 2)
        return (self.P[:, 2] < low + GAP) & (low < FOOT / GAP * self.gap)

    def touching(self, Q: Float[np.ndarray, "M 3"]) -> Bool[np.ndarray, "N"]:
        """Which points touch a cloud in the table's frame."""
        from scipy.spatial import cKDTree

        if not len(Q) or not len(self.P):
            return np.zeros(len(self.P), bool)
        return cKDTree(Q).query(self.P, distance_upper_bound=float(self.gap.max()))[0] < self.gap

    def rests_on(self, contact: Bool[np.ndarray, "N"]) -> bool:
        """Whether it stands where it touches: its middle lies over that, or nearly, and it is no taller than things."""
        if np.count_nonzero(contact) < TOUCHES or np.percentile(self.P[:, 2], 98) > STANDING[1]:
            return False
        xy = self.P[:, :2]
        off = np.linalg.norm(xy[contact] - xy.mean(axis=0), axis=1).min()
        return bool(off <= REACHES * np.linalg.norm(np.ptp(np.percentile(xy, [2, 98], axis=0), axis=0)))


def _body(table: Table, P: Float[np.ndarray, "N 3"]) -> Body:
    P = P[np.isfinite(P).all(axis=1)].astype(np.float64)
    P = P[:: max(1, len(P) // MOST)]
    if not len(P):
        return Body(P, np.zeros(0))
    return _seen_over(table, P[cluster_indices(P, float(table.slack(P, GAP).max()), min_points=1)[0]])


def _seen_over(table: Table, P: Float[np.ndarray, "N 3"]) -> Body:
    height = table.over(P)[1]
    return Body(np.column_stack([transform_points(table.T_table_frame, P)[:, :2], height]), table.slack(P, GAP))


def _unless_on_others(bodies: Sequence[Body], reasons: Sequence[str]) -> list[str]:
    """The reasons of those that do not stand on things that stand: one after the other, from the table upwards."""
    reasons, more = list(reasons), [True]
    while any(more):
        below = [body.P for body, reason in zip(bodies, reasons, strict=True) if not reason]
        below = np.concatenate(below) if below else np.zeros((0, 3))
        more = [
            reason in (HANGS, BESIDE) and body.rests_on(body.touching(below))
            for body, reason in zip(bodies, reasons, strict=True)
        ]
        reasons = ["" if rests else reason for rests, reason in zip(more, reasons, strict=True)]
    return reasons


def _ground(table: Table, P: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "M 3"]:
    """Some of the table's points, in its own frame."""
    P = P[np.isfinite(P[:, 2])].astype(np.float64)
    P = P[:: max(1, len(P) // 60_000)]
    inside, height = table.over(P)
    return _seen_over(table, P[inside & (np.abs(height) < table.slack(P, THICK))]).P


def _hanging(table: Table, points: Float[np.ndarray, "H W 3"]) -> Bool[np.ndarray, "H W"]:
    """Pixels of what hangs together with something that is high over the table at the picture's border.

    Only what is half as high links, and not where it goes down to lower things with its middle over them: that is a
    bin's wall, or a carton.
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
        if np.count_nonzero((border & high)[group]) <= 5:
            continue
        P = some[tuple(rising[group].T)]
        body = _seen_over(table, P)
        if not body.rests_on(body.P[:, 2] < HIGH / 2.0 + body.gap):
            hanging[tuple(rising[group].T)] = True
    wide = cv2.dilate(hanging.astype(np.uint8), np.ones((3, 3), np.uint8))
    return np.kron(wide, np.ones((step, step), np.uint8))[:H, :W] > 0
