"""The whole chain: RGBDFrame -> class probabilities -> labels -> target clouds in the base frame -> grasps."""

import time
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import cv2
import numpy as np
from jaxtyping import Float, Integer, UInt8

from labkit.frame import RGBDFrame
from labkit.geometry import Table, back_project_to_base, cluster_indices, find_tables, inliers
from labkit.geometry.tables import reasons_against, table_at
from labkit.grasp import Grasp, GraspPlan, Gripper, plan_grasps
from labkit.labels import IGNORE, OBSTACLE, TARGET
from labkit.learning.engines import open_engine
from labkit.learning.inference import Engine, FunctionEngine, check_probabilities
from labkit.notices import notices
from labkit.support.validation import (
    check_finite,
    check_height,
    check_labels,
    check_rgb,
    check_shape,
    check_whole,
    require,
)

# What the Panda can reach and meet, in front of it: x, y from its base, z from the table; metres.
WORKSPACE = ((0.15, 1.0), (-0.7, 0.7), (-0.02, 0.5))
# Where nothing is said: what was seen over the table, and a little under it for the noise.
EVERYWHERE = ((-20.0, 20.0), (-20.0, 20.0), (-0.02, 0.5))


@dataclass(frozen=True, eq=False)
class Perception:
    """What a robot knows after one frame.

    frame: what was looked at, with the table's height that counts. target_class: what was looked for. labels: uint8 (H,
    W). probabilities: (H, W, C) in 0..1, or None where labels came without. points: every pixel in the base frame, (H,
    W, 3), metres, NaN without depth. pixels: the pixels of each target, indices v * W + u, the largest target first.
    clouds: their points, an (N, 3) for each target. scene: all points of the workspace, (M, 3). certainty: for each
    target the mean probability of its class over its pixels, or that of the thing if things were found, 1 without
    either. plan: the grasps, the best first, whose scores are multiplied by that certainty already, or the reason why
    there is none. seconds: time spent by stage. left_out: what was labelled target and is none, and why, in sentences.
    tables: without a workspace, the planes that could be the table, the likeliest first.
    """

    frame: RGBDFrame
    target_class: int
    labels: UInt8[np.ndarray, "H W"]
    probabilities: Float[np.ndarray, "H W C"] | None
    points: Float[np.ndarray, "H W 3"]
    pixels: list[Integer[np.ndarray, "_"]]
    clouds: list[Float[np.ndarray, "_ 3"]]
    scene: Float[np.ndarray, "M 3"]
    certainty: tuple[float, ...]
    plan: GraspPlan
    seconds: dict[str, float] = field(default_factory=dict)
    left_out: tuple[str, ...] = ()
    tables: tuple[Table, ...] = ()

    @cached_property
    def notices(self) -> tuple[str, ...]:
        """What looks wrong about this frame or what was found in it, in sentences; none if all is as it should be."""
        return notices(self.frame, self)

    def __repr__(self) -> str:
        targets = f"clouds of {', '.join(str(len(cloud)) for cloud in self.clouds) or 'no'} points"
        grasps = f"{len(self.plan.grasps)} grasps" if self.plan.grasps else f"no grasp: {self.plan.reason}"
        return f"Perception({self.labels.shape[1]} x {self.labels.shape[0]}, {targets}, {grasps})"


@dataclass(frozen=True, eq=False)
class Labelled:
    """What is seen in a frame pixel by pixel: labels, and what they were chosen by, if anything.

    probabilities: (H, W, C), of a network; instances: numbers of objects, (H, W), 0 for none; certainty: of each of
    these, number 1 first. nothing: why no target stands where one was asked for. cleaned: whether the objects' pixels
    are without outliers already.
    """

    labels: UInt8[np.ndarray, "H W"]
    probabilities: Float[np.ndarray, "H W C"] | None = None
    instances: Integer[np.ndarray, "H W"] | None = None
    certainty: tuple[float, ...] | None = None
    nothing: str = ""
    cleaned: bool = False


class Pipeline:
    """The chain as one object: `Pipeline(model).run(frame)`, which is `perceive` and then `locate`.

    model: any PyTorch network (`labkit.network.TorchEngine` says how it states what it takes), or any function from an
    RGB image, uint8 (H, W, 3), to class probabilities (H, W, C) that sum to 1. None if labels come from elsewhere, and
    only `locate` is used. table_z: height of the table in the base frame, metres; None takes the frame's own, or else
    0. target_class: what to grasp.
    find_objects: in place of a model, any function from a frame to the numbers of objects, integers (H, W), 0 for none,
    or to such things as `labkit.learning.things.find_things` gives, which have these numbers and a certainty each: then
    each object is a target. `anything` makes such a function of a network.
    mirror: let a network look at the image and at its mirror image, and average: a little better, at twice its time
    (and where `at` asks for a thing in two sizes as well, at three times that); None does so for a network that sees
    the canonical view, whose size, and so its time, no picture changes.
    engine: "torch", "opencv" or "onnxruntime" runs the network there (labkit.learning.engines): equal numbers, other
    speeds; the model may then be an ONNX file of `labkit export`.
    crf: True refines the labels with the kit's CRF, or a function (probabilities, frame) -> labels (H, W) does; None
    refines those of a network, and leaves those of a plain function, which decides for itself.
    workspace: ((x, x), (y, y), (z, z)), from and to, metres in the base frame, z from the table: what the arm can meet;
    nothing outside is a target or an obstacle. None if nobody knows it: then the table is looked for at its height, and
    what does not stand on it, or hangs into the picture from its border, is no target. gripper: the hand that the
    planner plans for.
    back_project: function (depth, K, T_base_cam) -> (H, W, 3). split: function of the target's points (N, 3) to a list
    of index arrays, one for each object. grasp: function (clouds, scene, table_z, camera_position) -> GraspPlan, in
    place of the kit's planner. Raises ValueError for an argument that does not fit. Topics 03, 06 and 07.

    >>> def sees_nothing(rgb):
    ...     return np.dstack([np.ones(rgb.shape[:2]), np.zeros((*rgb.shape[:2], 3))])
    >>> rgb, depth = np.zeros((6, 8, 3), np.uint8), np.ones((6, 8), np.float32)
    >>> frame = RGBDFrame(rgb, depth, K=np.diag([9.0, 9.0, 1.0]), T_base_cam=np.eye(4))
    >>> Pipeline(sees_nothing).run(frame)
    Perception(8 x 6, clouds of no points, no grasp: nothing that the camera saw lies in the workspace)
    """

    def __init__(
        self,
        model=None,
        table_z: float | None = None,
        target_class: int = TARGET,
        *,
        find_objects: Callable[[RGBDFrame], object] | None = None,
        mirror: bool | None = None,
        engine: str = "torch",
        crf: bool | Callable[[np.ndarray, RGBDFrame], np.ndarray] | None = None,
        workspace: Sequence[Sequence[float]] | None = WORKSPACE,
        gripper: Gripper | None = None,
        back_project: Callable = back_project_to_base,
        split: Callable[[np.ndarray], Sequence[np.ndarray]] | None = None,
        grasp: Callable[..., GraspPlan] | None = None,
    ):
        require("find_objects", model is None or find_objects is None, "none beside a model", "both")
        self.model = None if model is None else open_engine(model, engine)
        self.find_objects = find_objects
        check_whole("target_class", target_class, 0, (getattr(self.model, "num_classes", None) or IGNORE) - 1)
        if grasp is not None and gripper is not None:
            raise ValueError("gripper: expected none beside `grasp`, which plans for its own; got both")
        self.table_z = None if table_z is None else check_height("table_z", table_z)
        self.target_class = target_class
        sees_view = isinstance(self.model, Engine) and self.model.takes.pixel is not None
        self.mirror = sees_view if mirror is None else mirror
        crf = not isinstance(self.model, FunctionEngine) if crf is None else crf
        self.crf = refine_labels if crf is True else crf
        self.only_on_table = workspace is None
        workspace = EVERYWHERE if workspace is None else workspace
        self.workspace = check_finite("workspace", check_shape("workspace", workspace, (3, 2))).astype(np.float64)
        if not (self.workspace[:, 0] < self.workspace[:, 1]).all():
            raise ValueError(f"workspace: expected from < to for each of x, y and z, got {self.workspace.tolist()}")
        self.back_project = back_project
        self.split = split or separate_objects
        self.gripper = gripper or Gripper()
        self.grasp = grasp or partial(plan_grasps, gripper=self.gripper)

    def run(self, frame: RGBDFrame, at: Sequence | None = None) -> Perception:
        """From a frame to grasps: `perceive`, then `locate`.

        at: a pixel (u, v), column and row: the thing there is the only target, whatever its class and wherever in the
        workspace it stands; if there is none, the plan's reason says what is there. A network that tells things apart,
        or `find_objects`, says which pixels it has; of a network of classes alone those that hang together. Raises
        ValueError for a pixel outside the picture.
        """
        frame, seconds = self._with_table_z(frame), {}
        at = None if at is None else _check_pixel("at", at, frame.size)
        seen = self._perceive(frame, seconds, at is not None)
        return self._locate(frame, seen, seconds, at)

    def perceive(self, frame: RGBDFrame) -> tuple[UInt8[np.ndarray, "H W"], Float[np.ndarray, "H W C"] | None]:
        """Label every pixel: labels, and the class probabilities that they were chosen by.

        `find_objects` has no probabilities, and its labels are the target's or 0. Raises ValueError without it and a
        model, or for a model that gives no probabilities or has no such class as the target.
        """
        seen = self._perceive(self._with_table_z(frame), {})
        return seen.labels, seen.probabilities

    def locate(
        self,
        frame: RGBDFrame,
        labels: Integer[np.ndarray, "H W"],
        probabilities: Float[np.ndarray, "H W C"] | None = None,
        instances: Integer[np.ndarray, "H W"] | None = None,
        at: Sequence | None = None,
    ) -> Perception:
        """Find the labelled targets in space, and grasps for them.

        labels: of this pipeline's `perceive`, true ones, or anybody's: any classes, 255 for "unknown". probabilities:
        what they were chosen by, if anything. instances: numbers of objects, 0 for none, in place of `split`: of the
        pixels labelled target, those of one number are one target. at: as in `run`. Raises ValueError naming the
        argument that does not fit.
        """
        labels = _check_labels_of(frame, labels)
        if probabilities is not None:
            probabilities = self._with_target(check_probabilities(probabilities, labels.shape))
        if instances is not None:
            instances = _check_instances_of(frame, instances)
        at = None if at is None else _check_pixel("at", at, frame.size)
        return self._locate(self._with_table_z(frame), Labelled(labels, probabilities, instances), {}, at)

    def _with_table_z(self, frame: RGBDFrame) -> RGBDFrame:
        """The frame with the height of the table that counts: this pipeline's, or else its own, or else 0."""
        known = frame.table_z if self.table_z is None else self.table_z
        return replace(frame, table_z=known or 0.0)

    def _with_target(self, probabilities: Float[np.ndarray, "H W C"]) -> Float[np.ndarray, "H W C"]:
        if self.target_class >= probabilities.shape[-1]:
            C = probabilities.shape[-1]
            raise ValueError(f"target_class: expected one of the {C} classes of probabilities, got {self.target_class}")
        return probabilities

    def _perceive(self, frame: RGBDFrame, seconds: dict[str, float], things: bool = False) -> Labelled:
        """things: tell things apart beside their classes, if the network can."""
        if self.find_objects is not None:
            with timed(seconds, "objects"):
                instances, certainty = _numbers(frame, self.find_objects(frame))
            labels = np.where(instances > 0, self.target_class, 0).astype(np.uint8)
            return Labelled(labels, instances=instances, certainty=certainty)
        require("model", self.model is not None, "one to perceive with", "None; `locate` takes labels from elsewhere")
        instances = certainty = None
        with timed(seconds, "network"):
            if things and tells_things(self.model):
                from labkit.learning.things import find_things

                found = find_things(self.model, frame, self.mirror)
                instances, certainty = _numbers(frame, found)
                probabilities = self._with_target(found.probabilities)
            else:
                probabilities = self._with_target(self.model(frame, self.mirror))
        with timed(seconds, "labels"):
            labels = most_probable(probabilities)
        if self.crf:  # it takes the probabilities, and its labels stand in the place of those above
            with timed(seconds, "crf"):
                labels = self.crf(probabilities, frame)
        return Labelled(_check_labels_of(frame, labels), probabilities, instances, certainty)

    def _locate(self, frame: RGBDFrame, seen: Labelled, seconds: dict[str, float], at=None) -> Perception:
        with timed(seconds, "back_projection"):
            points = self.back_project(frame.depth, frame.K, frame.T_base_cam)
        with timed(seconds, "clouds"):
            if at is not None:
                seen = self._only_at(at, seen, points, frame.table_z)
            pixels, clouds, scene = self._targets(seen, points, frame.table_z)
            tables, left_out = (), ()
            if self.only_on_table and at is None:
                tables, kept, left_out = _those_on_the_table(points, pixels, frame)
                pixels, clouds = [pixels[i] for i in kept], [clouds[i] for i in kept]
        with timed(seconds, "grasps"):
            plan = self.plan(clouds, scene, frame.table_z, frame.T_base_cam[:3, 3])
            if not clouds and len(scene):
                plan = replace(plan, reason=seen.nothing or "; ".join(left_out) or self._why_none(seen, points, frame))
            certainty = self._certainty(seen, pixels)
            plan = rank(plan, certainty)
        return Perception(
            frame=frame,
            target_class=self.target_class,
            labels=seen.labels,
            probabilities=seen.probabilities,
            points=points,
            pixels=pixels,
            clouds=clouds,
            scene=scene,
            certainty=certainty,
            plan=plan,
            seconds=seconds,
            left_out=left_out,
            tables=tables,
        )

    def _certainty(self, seen: Labelled, pixels: Sequence[Integer[np.ndarray, "_"]]) -> tuple[float, ...]:
        """For each target its own certainty, or the mean probability of its class; 1 where nothing is known."""
        if seen.certainty is not None:
            numbers = seen.instances.reshape(-1)
            return tuple(float(seen.certainty[numbers[chosen[0]] - 1]) for chosen in pixels)
        if seen.probabilities is None:
            return tuple(1.0 for _ in pixels)
        of_target = seen.probabilities[..., self.target_class].reshape(-1)
        return tuple(float(of_target[chosen].mean(dtype=np.float64)) for chosen in pixels)

    def _only_at(self, at: tuple[int, int], seen: Labelled, points, table_z: float) -> Labelled:
        """Make the thing at a pixel (u, v) the only target; what else was one is an obstacle.

        Its certainty is its own, or that it is target or obstacle rather than anything else: it counts in any class.
        """
        u, v = at
        numbers, cleaned = seen.instances, seen.cleaned
        if numbers is None:
            cleaned = True  # as `split` does
            numbers = np.zeros(seen.labels.shape, np.int32)
            pixels = np.flatnonzero(np.isin(seen.labels, (self.target_class, OBSTACLE)) & np.isfinite(points[..., 2]))
            for number, group in enumerate(self.split(points.reshape(-1, 3)[pixels]), start=1):
                numbers.ravel()[pixels[group]] = number
        labels = np.where(seen.labels == self.target_class, OBSTACLE, seen.labels).astype(np.uint8)
        number, height = int(numbers[v, u]), float(points[v, u, 2]) - table_z
        if number == 0:
            said = f"no thing was found at ({u}, {v}): the pixel shows {_shown_at(height)}"
            return replace(seen, labels=labels, instances=np.zeros_like(numbers), nothing=said)
        chosen = numbers == number
        labels[chosen] = self.target_class
        if seen.certainty is not None:
            certainty = seen.certainty[number - 1]
        elif seen.probabilities is not None:
            of_classes = seen.probabilities[chosen].mean(axis=0, dtype=np.float64)
            certainty = float(sum(of_classes[c] for c in {self.target_class, OBSTACLE} if c < len(of_classes)))
        else:
            certainty = 1.0
        return replace(seen, labels=labels, instances=chosen.astype(np.int32), certainty=(certainty,), cleaned=cleaned)

    def _why_none(self, seen: Labelled, points: Float[np.ndarray, "H W 3"], frame: RGBDFrame) -> str:
        """Say why no pixel that is labelled target became part of one."""
        P = points[seen.labels == self.target_class]
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

    def _targets(
        self, seen: Labelled, points: Float[np.ndarray, "H W 3"], table_z: float
    ) -> tuple[list[Integer[np.ndarray, "_"]], list[Float[np.ndarray, "_ 3"]], Float[np.ndarray, "M 3"]]:
        """Find each target's pixels (indices v * W + u) and points, and all points of the workspace.

        points: of the base frame, metres, NaN without depth.
        """
        points = points.reshape(-1, 3)
        low, high = (self.workspace.T + np.outer([1.0, 1.0], [0.0, 0.0, table_z])).astype(points.dtype)
        inside = [(x > a) & (x < b) for x, a, b in zip(points.T, low, high, strict=True)]
        inside = np.logical_and.reduce(inside)  # NaN lies nowhere
        pixels = np.flatnonzero(inside & (seen.labels.ravel() == self.target_class))
        P = points[pixels]
        if seen.instances is None:
            groups = self.split(P)
        else:
            groups = separate_instances(P, seen.instances.ravel()[pixels], clean=not seen.cleaned)
        each = [pixels[group] for group in groups]
        return each, [points[chosen] for chosen in each], points.compress(inside, axis=0)

    def plan(
        self,
        clouds: Sequence[Float[np.ndarray, "_ 3"]],
        scene: Float[np.ndarray, "M 3"],
        table_z: float,
        camera_position: Float[np.ndarray, "3"],
    ) -> GraspPlan:
        """Plan grasps of the clouds among the scene; where nothing is known to be free, there is none."""
        if len(scene) == 0:
            return GraspPlan(reason="nothing that the camera saw lies in the workspace")
        return self.grasp(clouds, scene, table_z, camera_position)


NO_TARGET = "no target points"  # as the planner says
ON_TABLE = 0.01  # metres over or under the table's height: what is there is the table


def _shown_at(height: float) -> str:
    """What a pixel shows that lies so many metres over the table, NaN without depth."""
    if np.isnan(height):
        return "what has no depth"
    if abs(height) < ON_TABLE:
        return "the table"
    return f"what lies {1000.0 * abs(height):.0f} mm {'over' if height > 0.0 else 'under'} the table"


def anything(model=None, mirror: bool = True) -> Callable[[RGBDFrame], object]:
    """Make a function that finds things of any class, for `find_objects`: `labkit.learning.things.find_things`.

    model: a network or an engine that tells things apart; None is the kit's own, unet_rgbd. mirror: as for
    `find_things`.
    Raises ValueError for a network of classes alone. Topic 03.
    """
    from labkit.learning.network import load_model, weights_path
    from labkit.learning.things import check_tells_things, find_things

    engine = open_engine(load_model(weights_path("unet_rgbd")) if model is None else model)
    return partial(find_things, check_tells_things(engine), mirror=mirror)


def tells_things(model) -> bool:
    """Whether a network or an engine says at each pixel which thing it belongs to."""
    return bool(getattr(open_engine(model), "things", False))


def _those_on_the_table(points, pixels, frame: RGBDFrame) -> tuple[tuple[Table, ...], list[int], tuple[str, ...]]:
    """The planes that were found, which things stand on the table, and what is said of the others."""
    tables = find_tables(points, frame.T_base_cam[:3, 3], up=(0.0, 0.0, 1.0))
    table = table_at(tables, frame.table_z)
    if table is None:
        why = [f"do not stand on the table, for there is no plane at its height, {frame.table_z:.3f} m"] * len(pixels)
    else:
        why = reasons_against(table, tables, points, pixels)
    kept = [i for i, reason in enumerate(why) if not reason]
    counts = Counter(filter(None, why))
    said = (
        f"{n} of {len(pixels)} targets {reason}; a workspace says what the arm may meet" for reason, n in counts.items()
    )
    return tuple(tables), kept, tuple(said)


def _numbers(frame: RGBDFrame, found) -> tuple[Integer[np.ndarray, "H W"], tuple[float, ...] | None]:
    """The numbers of objects that `find_objects` gave, and the certainty of each if it said so."""
    instances = _check_instances_of(frame, getattr(found, "instances", found))
    return instances, getattr(found, "certainty", None)


def _check_pixel(name: str, at, size: tuple[int, int]) -> tuple[int, int]:
    """Return a pixel (u, v) as whole numbers if it lies in a picture of (width, height) `size`."""
    u, v = check_finite(name, check_shape(name, at, (2,)))
    fits = 0 <= round(u) < size[0] and 0 <= round(v) < size[1]
    require(name, fits, f"a pixel (u, v) of the picture of {size[0]} x {size[1]}", f"({u:g}, {v:g})")
    return round(u), round(v)


def _check_labels_of(frame: RGBDFrame, labels) -> UInt8[np.ndarray, "H W"]:
    labels = check_labels("labels", check_shape("labels", labels, frame.depth.shape), IGNORE)
    return labels.astype(np.uint8, copy=False)


def _check_instances_of(frame: RGBDFrame, instances) -> Integer[np.ndarray, "H W"]:
    instances = check_shape("instances", instances, frame.depth.shape)
    fits = instances.dtype.kind in "iu" and instances.min(initial=0) >= 0
    require("instances", fits, "whole numbers of at least 0", f"{instances.dtype} from {instances.min()}")
    return instances


@contextmanager
def timed(seconds: dict[str, float], stage: str):
    """Write the seconds that a block takes down under the name of its stage."""
    start = time.perf_counter()
    yield
    seconds[stage] = time.perf_counter() - start


def most_probable(probabilities: Float[np.ndarray, "H W C"]) -> UInt8[np.ndarray, "H W"]:
    """The label of each pixel: the class of highest probability, the first one of equals (topic 03).

    >>> most_probable(np.array([[[0.2, 0.8], [0.5, 0.5]]]))
    array([[1, 0]], dtype=uint8)
    """
    p = np.asarray(probabilities)
    highest, labels = p[..., 0], np.zeros(p.shape[:-1], np.uint8)
    for c in range(1, p.shape[-1]):  # class by class: faster than argmax over so short an axis
        np.copyto(labels, c, where=p[..., c] > highest)
        highest = np.maximum(highest, p[..., c])
    return labels


def refine_labels(probabilities: Float[np.ndarray, "H W C"], frame: RGBDFrame) -> UInt8[np.ndarray, "H W"]:
    """Labels that are smooth except at edges of colour or depth: a CRF on top of a network (topic 02)."""
    from labkit.crf import refine  # numba: loaded only where it is wanted

    return refine(probabilities, frame.rgb, frame.depth).labels


def separate_objects(P: Float[np.ndarray, "N 3"]) -> list[Integer[np.ndarray, "_"]]:
    """Clean the points of the target class and split them: two targets are two lists of indices into P."""
    kept = inliers(P)
    return [kept[group] for group in cluster_indices(P[kept])]


def separate_instances(P: Float[np.ndarray, "N 3"], numbers: Integer[np.ndarray, "N"], clean: bool = True) -> list:
    """A list of indices into P for each object, a number above 0, without outliers; the most points first."""
    groups = [np.flatnonzero(numbers == number) for number in np.unique(numbers[numbers > 0])]
    cleaned = [group[inliers(P[group])] for group in groups] if clean else groups
    return sorted(filter(len, cleaned), key=len, reverse=True)


def rank(plan: GraspPlan, certainty: Sequence[float]) -> GraspPlan:
    """Weigh the grasps with how certain their targets are, and sort: a fine grip on an obstacle is worth little."""

    def weighed(grasp: Grasp) -> Grasp:
        return replace(grasp, score=grasp.score * certainty[grasp.target])

    return replace(plan, grasps=tuple(sorted(map(weighed, plan.grasps), key=lambda grasp: -grasp.score)))


def segment_rgb_image(model, image: UInt8[np.ndarray, "H W 3"], order: str = "rgb") -> UInt8[np.ndarray, "H W"]:
    """Label each pixel of an image with a model as in `Pipeline` (topics 03 and 08).

    order: "rgb", or "bgr" for an image as OpenCV and many ROS cameras give it: a common listing always swaps channels,
    whichever it is given; here the caller says. Raises ValueError for another order or no uint8 image.

    >>> segment_rgb_image(lambda rgb: rgb / 255.0, np.array([[[255, 0, 0]]], np.uint8), order="bgr")
    array([[2]], dtype=uint8)
    """
    require("order", order in ("rgb", "bgr"), '"rgb" or "bgr"', repr(order))
    image = check_rgb("image", image)
    rgb = cv2.cvtColor(image, cv2.COLOR_BGR2RGB) if order == "bgr" else image
    return most_probable(open_engine(model)(rgb))
