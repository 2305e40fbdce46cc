"""Which pixels are one target, which of them a robot may grasp, and why none is left (topics 06 and 07).

A target is what hangs together of the points labelled so, or what has one number; it lies in the workspace, or stands
on the table that was found.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Integer, UInt8

from labkit.frame import RGBDFrame
from labkit.geometry import Table, cluster_indices, find_tables, inlier_indices
from labkit.geometry.depth_units import other_unit
from labkit.geometry.standing import reasons_against
from labkit.geometry.tables import table_at
from labkit.labels import IGNORE, OBSTACLE
from labkit.support.validation import check_finite, check_labels, check_pixel, check_shape, require

# What the Panda can reach and meet, in front of it: x, y from its base, z from the table; metres.
WORKSPACE = ((0.15, 1.0), (-0.7, 0.7), (-0.02, 0.5))
# Where nobody knows it: what was seen over the table, and a little under it for the noise.
EVERYWHERE = ((-20.0, 20.0), (-20.0, 20.0), (-0.02, 0.5))
FEW = 30  # points: of fewer, no length is told
NO_TARGET = "no target points"  # as the planner says
ON_TABLE = 0.01  # metres over or under the table's height: what is there is the table


@dataclass(frozen=True, eq=False)
class Segmentation:
    """What is seen in a frame pixel by pixel: labels, and what they were chosen by, if anything.

    target_class: the class to grasp. probabilities: (H, W, C), of a network; instances: numbers of objects, (H, W), 0
    for none; certainty: of each of these, number 1 first. why_no_target: why no target stands where one was asked for.
    outliers_removed: whether the objects' pixels are without outliers already.
    """

    labels: UInt8[np.ndarray, "H W"]
    target_class: int
    probabilities: Float[np.ndarray, "H W C"] | None = None
    instances: Integer[np.ndarray, "H W"] | None = None
    certainty: tuple[float, ...] | None = None
    why_no_target: str = ""
    outliers_removed: bool = False


@dataclass(frozen=True, eq=False)
class Targets:
    """What was found: the fields of a `labkit.pipeline.Perception`, and why nothing is to be grasped, if so."""

    labels: UInt8[np.ndarray, "H W"]
    pixels: list[Integer[np.ndarray, "_"]]
    clouds: list[Float[np.ndarray, "_ 3"]]
    scene: Float[np.ndarray, "M 3"]
    certainty: tuple[float, ...]
    left_out: tuple[str, ...]
    tables: tuple[Table, ...]
    why_none: str


@dataclass(frozen=True)
class Clicks:
    """Pixels (u, v): `at` lie on the thing that is asked for, `not_at` on what is no part of it."""

    at: tuple[tuple[int, int], ...] = ()
    not_at: tuple[tuple[int, int], ...] = ()

    @classmethod
    def of(cls, frame: RGBDFrame, at: Sequence | None, not_at: Sequence | None) -> "Clicks":
        """Clicks on a frame, each a pixel, several or None; raises ValueError naming the one that does not fit.

        >>> frame = RGBDFrame(np.zeros((6, 8, 3), np.uint8), np.ones((6, 8), np.float32), np.eye(3), np.eye(4))
        >>> Clicks.of(frame, (3, 4), [(5, 2), (6.0, 2.2)])
        Clicks(at=((3, 4),), not_at=((5, 2), (6, 2)))
        """
        given = {name: () if many is None else many for name, many in (("at", at), ("not_at", not_at))}
        alone = {name: (many,) if len(many) and np.ndim(many[0]) == 0 else many for name, many in given.items()}
        at, not_at = (tuple(check_pixel(name, one, frame.size) for one in many) for name, many in alone.items())
        require("not_at", at or not not_at, "a pixel `at` the thing beside it", not_at)
        twice = [pixel for pixel in not_at if pixel in at]
        require("not_at", not twice, "other pixels than `at`", lambda: f"{twice[0]} in both")
        return cls(at, not_at)


NO_CLICK = Clicks()


class TargetFinder:
    """Finds targets as a `Pipeline` of the same arguments does: workspace, split and unit_known."""

    def __init__(self, workspace: Sequence[Sequence[float]] | str, split: Callable, unit_known: bool = False):
        self.split, self.unit_known = split, unit_known
        self.only_on_table = isinstance(workspace, str)
        if self.only_on_table:
            require("workspace", workspace == "table", '((x, x), (y, y), (z, z)) or "table"', repr(workspace))
            workspace = EVERYWHERE
        self.workspace = check_finite("workspace", check_shape("workspace", workspace, (3, 2))).astype(np.float64)
        in_order = (self.workspace[:, 0] < self.workspace[:, 1]).all()
        require("workspace", in_order, "from < to for each of x, y and z", self.workspace.tolist)

    def find(
        self, seen: Segmentation, points: Float[np.ndarray, "H W 3"], frame: RGBDFrame, clicks: Clicks = NO_CLICK
    ) -> Targets:
        """Find the targets of a frame. points: of the base frame, metres, NaN without depth."""
        if clicks.at:
            seen = self._only_at(clicks, seen, points, frame)
        flat = points.reshape(-1, 3)
        pixels, inside = self._pixels(seen, flat, frame.table_z)
        tables, left_out = (), ()
        if self.only_on_table and not clicks.at:
            tables, pixels, left_out = _those_on_the_table(points, pixels, frame)
        scene = flat.compress(inside, axis=0)
        if not len(scene):
            why_none = "nothing that the camera saw lies in the workspace"
        else:
            why_none = "" if pixels else seen.why_no_target or "; ".join(left_out) or self._why_none(seen, flat, frame)
        unit = "" if self.unit_known else self._other_unit(seen, flat, pixels, frame)
        why_none = "; ".join(filter(None, (why_none, unit)))
        clouds, certainty = [flat[chosen] for chosen in pixels], self._certainty(seen, pixels)
        return Targets(seen.labels, pixels, clouds, scene, certainty, left_out, tables, why_none)

    def _pixels(self, seen: Segmentation, points: Float[np.ndarray, "N 3"], table_z: float):
        """The pixels of each target, indices v * W + u, and which pixels lie in the workspace."""
        low, high = (self.workspace.T + np.outer([1.0, 1.0], [0.0, 0.0, table_z])).astype(points.dtype)
        inside = [(x > a) & (x < b) for x, a, b in zip(points.T, low, high, strict=True)]
        inside = np.logical_and.reduce(inside)  # NaN lies nowhere
        pixels = np.flatnonzero(inside & (seen.labels.ravel() == seen.target_class))
        if seen.instances is None:
            groups = self.split(points[pixels])
        else:
            numbers = seen.instances.ravel()[pixels]
            groups = separate_instances(points[pixels], numbers, clean=not seen.outliers_removed)
        return [pixels[group] for group in groups], inside

    def _certainty(self, seen: Segmentation, pixels: Sequence[Integer[np.ndarray, "_"]]) -> tuple[float, ...]:
        """For each target its own certainty, or the mean probability of its class; 1 where nothing is known."""
        if seen.certainty is not None:
            numbers = seen.instances.reshape(-1)
            return tuple(float(seen.certainty[numbers[chosen[0]] - 1]) for chosen in pixels)
        if seen.probabilities is None:
            return tuple(1.0 for _ in pixels)
        of_target = seen.probabilities[..., seen.target_class].reshape(-1)
        return tuple(float(of_target[chosen].mean(dtype=np.float64)) for chosen in pixels)

    def _only_at(self, clicks: Clicks, seen: Segmentation, points, frame: RGBDFrame) -> Segmentation:
        """Make the thing that was clicked the only target; what else was one is an obstacle.

        Its certainty is its own, or that it is target or obstacle rather than anything else: it counts in any class.
        """
        numbers, removed = seen.instances, seen.outliers_removed
        if numbers is None:
            removed = True  # as `split` does
            numbers = np.zeros(seen.labels.shape, np.int32)
            pixels = np.flatnonzero(np.isin(seen.labels, (seen.target_class, OBSTACLE)) & np.isfinite(points[..., 2]))
            for number, group in enumerate(self.split(points.reshape(-1, 3)[pixels]), start=1):
                numbers.ravel()[pixels[group]] = number
        labels = np.where(seen.labels == seen.target_class, OBSTACLE, seen.labels).astype(np.uint8)
        why_none, chosen = clicked(clicks, numbers, points, frame)
        if why_none:
            return replace(seen, labels=labels, instances=np.zeros_like(numbers), why_no_target=why_none)
        labels[chosen] = seen.target_class
        if seen.certainty is not None:
            certainty = min(seen.certainty[number - 1] for number in np.unique(numbers[chosen]).tolist())
        elif seen.probabilities is not None:
            of_classes = seen.probabilities[chosen].mean(axis=0, dtype=np.float64)
            certainty = float(sum(of_classes[c] for c in {seen.target_class, OBSTACLE} if c < len(of_classes)))
        else:
            certainty = 1.0
        seen = replace(seen, labels=labels, outliers_removed=removed)
        return replace(seen, instances=chosen.astype(np.int32), certainty=(certainty,))

    def _other_unit(self, seen: Segmentation, points: Float[np.ndarray, "N 3"], pixels, frame: RGBDFrame) -> str:
        """What `other_unit` says of the targets, or of what would be some if it were in the workspace."""
        if not pixels:
            labelled = np.flatnonzero((seen.labels.ravel() == seen.target_class) & np.isfinite(points[:, 2]))
            numbers = np.ones(len(labelled), int) if seen.instances is None else seen.instances.ravel()[labelled]
            pixels = [labelled[numbers == number] for number in np.unique(numbers[numbers > 0])]
        clouds = [points[chosen].astype(np.float64) for chosen in pixels if len(chosen) >= FEW]
        if not clouds:
            return ""
        away = [np.linalg.norm(np.median(P, axis=0) - frame.T_base_cam[:3, 3]) for P in clouds]
        lengths = [np.ptp(np.percentile(P, [2, 98], axis=0), axis=0).max() for P in clouds]
        return other_unit(float(np.median(away)), float(np.median(lengths)))

    def _why_none(self, seen: Segmentation, points: Float[np.ndarray, "N 3"], frame: RGBDFrame) -> str:
        """Say why no pixel that is labelled target became part of one."""
        P = points[seen.labels.ravel() == seen.target_class]
        if not len(P):
            return NO_TARGET
        known = P[np.isfinite(P[:, 2])] - (0.0, 0.0, frame.table_z)
        if not len(known):
            return f"{NO_TARGET}: the {len(P)} pixels labelled target have no depth"
        sides = ("before", "beyond"), ("right of", "left of"), ("under", "above")
        outside = Counter()
        for axis, (low, high) in enumerate(self.workspace):
            outside[sides[axis][0]] = np.count_nonzero(known[:, axis] <= low)
            outside[sides[axis][1]] = np.count_nonzero(known[:, axis] >= high)
        where, count = outside.most_common(1)[0]
        if count > 0.5 * len(known):
            span = " ".join(f"{x:g}" for x in self.workspace.ravel())
            return f"{NO_TARGET}: {count} of the {len(P)} labelled target lie {where} the workspace, {span}"
        return f"{NO_TARGET} that hang together: {len(P)} pixels are labelled target, {len(known)} of them have depth"


def clicked(clicks: Clicks, numbers: Integer[np.ndarray, "H W"], points, frame: RGBDFrame):
    """The pixels of the thing at the clicks, parted from what it must not be; and why there is none, "" if there is."""
    known = np.isfinite(points[..., 2])
    for u, v in clicks.at:
        if numbers[v, u] == 0:
            shown = _shown_at(float(points[v, u, 2]) - frame.table_z)
            return f"no thing was found at ({u}, {v}): the pixel shows {shown}", None
    chosen = np.isin(numbers, [numbers[v, u] for u, v in clicks.at])
    if not clicks.not_at:
        return "", chosen
    for u, v in clicks.not_at:
        if not chosen[v, u]:
            first = clicks.at[0]
            return (
                f"({u}, {v}) is not on the thing at {first}, which it is to be parted from: leave that click out",
                None,
            )
    for u, v in (*clicks.at, *clicks.not_at):
        if not known[v, u]:
            return f"there is no depth at ({u}, {v}), where the thing is to be parted: click beside it", None
    from labkit.crf.clicks import cut_between  # numba: loaded only where it is wanted

    return "", cut_between(chosen, frame.rgb, points, clicks.at, clicks.not_at)


def _shown_at(height: float) -> str:
    """What a pixel shows that lies so many metres over the table, NaN without depth."""
    if np.isnan(height):
        return "what has no depth"
    if abs(height) < ON_TABLE:
        return "the table"
    return f"what lies {1000.0 * abs(height):.0f} mm {'over' if height > 0.0 else 'under'} the table"


def _those_on_the_table(points, pixels, frame: RGBDFrame) -> tuple[tuple[Table, ...], list, tuple[str, ...]]:
    """The planes that were found, the targets that stand on the table, and what is said of the others."""
    tables = find_tables(points, frame.T_base_cam[:3, 3], up=(0.0, 0.0, 1.0))
    table = table_at(tables, frame.table_z)
    if table is None:
        why = [f"do not stand on the table, for there is no plane at its height, {frame.table_z:.3f} m"] * len(pixels)
    else:
        why = reasons_against(table, tables, points, pixels)
    kept = [chosen for chosen, reason in zip(pixels, why, strict=True) if not reason]
    counts = Counter(filter(None, why))
    said = (
        f"{n} of {len(pixels)} targets {reason}; a workspace says what the arm may meet" for reason, n in counts.items()
    )
    return tuple(tables), kept, tuple(said)


def labels_in(frame: RGBDFrame, labels) -> UInt8[np.ndarray, "H W"]:
    """Return labels of a frame's pixels as uint8; raises ValueError if they are none."""
    labels = check_labels("labels", check_shape("labels", labels, frame.depth.shape), IGNORE)
    return labels.astype(np.uint8, copy=False)


def instances_in(frame: RGBDFrame, instances) -> Integer[np.ndarray, "H W"]:
    """Return numbers of objects at a frame's pixels; raises ValueError if they are none."""
    instances = check_shape("instances", instances, frame.depth.shape)
    fits = instances.dtype.kind in "iu" and instances.min(initial=0) >= 0
    require("instances", fits, "whole numbers of at least 0", f"{instances.dtype} from {instances.min()}")
    return instances


def certainty_in(instances: Integer[np.ndarray, "H W"], certainty) -> tuple[float, ...] | None:
    """Return how sure each object is, by its number from 1 on; None if nobody says; raises ValueError if they differ.

    >>> certainty_in(np.array([[0, 7]]), [0.9])
    Traceback (most recent call last):
    ...
    ValueError: certainty: expected one for each number of an object, 1 to 7, got 1
    """
    if certainty is None:
        return None
    certainty = check_finite("certainty", check_shape("certainty", certainty, (None,)))
    count = int(instances.max(initial=0))
    require("certainty", len(certainty) == count, f"one for each number of an object, 1 to {count}", len(certainty))
    fits = count == 0 or (certainty.min() >= 0.0 and certainty.max() <= 1.0)
    require("certainty", fits, "numbers in 0..1", lambda: certainty.tolist())
    return tuple(certainty.tolist())


def separate_objects(P: Float[np.ndarray, "N 3"]) -> list[Integer[np.ndarray, "_"]]:
    """Clean the points of the target class and split them: two targets are two lists of indices into P."""
    kept = inlier_indices(P)
    return [kept[group] for group in cluster_indices(P[kept])]


def separate_instances(P: Float[np.ndarray, "N 3"], numbers: Integer[np.ndarray, "N"], clean: bool = True) -> list:
    """A list of indices into P for each object, a number above 0, without outliers; the most points first."""
    groups = [np.flatnonzero(numbers == number) for number in np.unique(numbers[numbers > 0])]
    cleaned = [group[inlier_indices(P[group])] for group in groups] if clean else groups
    return sorted(filter(len, cleaned), key=len, reverse=True)
