"""The whole chain: RGBDFrame -> class probabilities -> labels -> target clouds in the base frame -> grasps."""

import time
from collections.abc import Callable, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import cv2
import numpy as np
from jaxtyping import Float, Integer, UInt8

from labkit.frame import RGBDFrame
from labkit.geometry import back_project_to_base, cluster_indices, inliers
from labkit.grasp import Grasp, GraspPlan, Gripper, plan_grasps
from labkit.labels import IGNORE, TARGET
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


@dataclass(frozen=True, eq=False)
class Perception:
    """What a robot knows after one frame.

    frame: what was looked at, with the table's height that counts. target_class: what was looked for. labels: uint8
    (H, W). probabilities: (H, W, C) in 0..1, or None where labels came without. points: every pixel in the base frame,
    (H, W, 3), metres, NaN without depth. pixels: the pixels of each target, indices v * W + u, the largest target
    first. clouds: their points, an (N, 3) for each target. scene: all points of the workspace, (M, 3). certainty: for
    each target the mean probability of its class over its pixels, 1 without probabilities. plan: the grasps ranked by
    their score times that certainty, or the reason why there is none. seconds: time spent by stage.
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

    @cached_property
    def notices(self) -> tuple[str, ...]:
        """What looks wrong about this frame or what was found in it, in sentences; none if all is as it should be."""
        return notices(self.frame, self)

    def __repr__(self) -> str:
        targets = f"clouds of {', '.join(str(len(cloud)) for cloud in self.clouds) or 'no'} points"
        grasps = f"{len(self.plan.grasps)} grasps" if self.plan.grasps else f"no grasp: {self.plan.reason}"
        return f"Perception({self.labels.shape[1]} x {self.labels.shape[0]}, {targets}, {grasps})"


class Pipeline:
    """The chain as one object: `Pipeline(model).run(frame)`, which is `perceive` and then `locate`.

    model: any PyTorch network (`labkit.network.TorchEngine` says how it states what it takes), or any function from an
    RGB image, uint8 (H, W, 3), to class probabilities (H, W, C) that sum to 1; or any function from a frame to the
    numbers of objects, integers (H, W), 0 for none, whose attribute `gives_instances` is True, such as
    `labkit.stacks.objects.on_the_table`: then each object is a target. None if labels come from elsewhere, and only
    `locate` is used. table_z: height of the table in the base frame, metres; None takes the frame's own, or else 0.
    target_class: what to grasp.
    mirror: let a network look at the image and at its mirror image, and average: a little better, at twice its time;
    None does so for a network that sees the canonical view, whose size, and so its time, no picture changes.
    engine: "torch", "opencv" or "onnxruntime" runs the network there (labkit.learning.engines): equal numbers, other
    speeds; the model may then be an ONNX file of `labkit export`.
    crf: True refines the labels with the kit's CRF, or a function (probabilities, frame) -> labels (H, W) does; None
    refines those of a network, and leaves those of a plain function, which decides for itself.
    workspace: ((x, x), (y, y), (z, z)), from and to, metres in the base frame, z from the table: what the arm can meet;
    nothing outside is a target or an obstacle. gripper: the hand that the planner plans for.
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
        mirror: bool | None = None,
        engine: str = "torch",
        crf: bool | Callable[[np.ndarray, RGBDFrame], np.ndarray] | None = None,
        workspace: Sequence[Sequence[float]] = WORKSPACE,
        gripper: Gripper | None = None,
        back_project: Callable = back_project_to_base,
        split: Callable[[np.ndarray], Sequence[np.ndarray]] | None = None,
        grasp: Callable[..., GraspPlan] | None = None,
    ):
        self.gives_instances = getattr(model, "gives_instances", False)
        self.model = model if model is None or self.gives_instances else open_engine(model, engine)
        check_whole("target_class", target_class, 0, (getattr(self.model, "num_classes", None) or IGNORE) - 1)
        if grasp is not None and gripper is not None:
            raise ValueError("gripper: expected none beside `grasp`, which plans for its own; got both")
        self.table_z = None if table_z is None else check_height("table_z", table_z)
        self.target_class = target_class
        sees_view = isinstance(self.model, Engine) and self.model.takes.pixel is not None
        self.mirror = sees_view if mirror is None else mirror
        crf = not isinstance(self.model, FunctionEngine) if crf is None else crf
        self.crf = refine_labels if crf is True else crf
        self.workspace = check_finite("workspace", check_shape("workspace", workspace, (3, 2))).astype(np.float64)
        if not (self.workspace[:, 0] < self.workspace[:, 1]).all():
            raise ValueError(f"workspace: expected from < to for each of x, y and z, got {self.workspace.tolist()}")
        self.back_project = back_project
        self.split = split or separate_objects
        self.grasp = grasp or partial(plan_grasps, gripper=gripper or Gripper())

    def run(self, frame: RGBDFrame) -> Perception:
        """From a frame to grasps: `perceive`, then `locate`."""
        frame, seconds = self._on_table(frame), {}
        labels, probabilities, instances = self._perceive(frame, seconds)
        return self._locate(frame, _check_labels_of(frame, labels), probabilities, instances, seconds)

    def perceive(self, frame: RGBDFrame) -> tuple[UInt8[np.ndarray, "H W"], Float[np.ndarray, "H W C"] | None]:
        """Label every pixel: labels, and the class probabilities that they were chosen by.

        A model that gives instances has no probabilities, and its labels are the target's or 0. Raises ValueError
        without a model, or for one that gives no probabilities or has no such class as the target.
        """
        return self._perceive(self._on_table(frame), {})[:2]

    def locate(
        self,
        frame: RGBDFrame,
        labels: Integer[np.ndarray, "H W"],
        probabilities: Float[np.ndarray, "H W C"] | None = None,
        instances: Integer[np.ndarray, "H W"] | None = None,
    ) -> Perception:
        """Find the labelled targets in space, and grasps for them.

        labels: of this pipeline's `perceive`, true ones, or anybody's: any classes, 255 for "unknown". probabilities:
        what they were chosen by, if anything. instances: numbers of objects, 0 for none, in place of `split`: of the
        pixels labelled target, those of one number are one target. Raises ValueError naming the argument that does not
        fit.
        """
        labels = _check_labels_of(frame, labels)
        if probabilities is not None:
            probabilities = self._with_target(check_probabilities(probabilities, labels.shape))
        if instances is not None:
            instances = _check_instances_of(frame, instances)
        return self._locate(self._on_table(frame), labels, probabilities, instances, {})

    def _on_table(self, frame: RGBDFrame) -> RGBDFrame:
        """The frame with the height of the table that counts: this pipeline's, or else its own, or else 0."""
        known = frame.table_z if self.table_z is None else self.table_z
        return replace(frame, table_z=known or 0.0)

    def _with_target(self, probabilities: Float[np.ndarray, "H W C"]) -> Float[np.ndarray, "H W C"]:
        if self.target_class >= probabilities.shape[-1]:
            C = probabilities.shape[-1]
            raise ValueError(f"target_class: expected one of the {C} classes of probabilities, got {self.target_class}")
        return probabilities

    def _perceive(self, frame: RGBDFrame, seconds: dict[str, float]):
        require("model", self.model is not None, "one to perceive with", "None; `locate` takes labels from elsewhere")
        if self.gives_instances:
            with timed(seconds, "objects"):
                instances = _check_instances_of(frame, self.model(frame))
            return np.where(instances > 0, self.target_class, 0).astype(np.uint8), None, instances
        with timed(seconds, "network"):
            probabilities = self._with_target(self.model(frame, self.mirror))
        with timed(seconds, "labels"):
            labels = most_probable(probabilities)
        if self.crf:
            with timed(seconds, "crf"):
                labels = self.crf(probabilities, frame)
        return labels, probabilities, None

    def _locate(self, frame: RGBDFrame, labels, probabilities, instances, seconds: dict[str, float]) -> Perception:
        with timed(seconds, "back_projection"):
            points = self.back_project(frame.depth, frame.K, frame.T_base_cam)
        with timed(seconds, "clouds"):
            pixels, clouds, scene = self.targets(labels, points, frame.table_z, instances)
        with timed(seconds, "grasps"):
            plan = self.plan(clouds, scene, frame.table_z, frame.T_base_cam[:3, 3])
            certainty = tuple(1.0 for _ in pixels)
            if probabilities is not None:
                of_target = probabilities[..., self.target_class].reshape(-1)
                certainty = tuple(float(of_target[chosen].mean(dtype=np.float64)) for chosen in pixels)
            plan = rank(plan, certainty)
        known = labels, probabilities, points, pixels, clouds, scene, certainty, plan, seconds
        return Perception(frame, self.target_class, *known)

    def targets(
        self,
        labels: UInt8[np.ndarray, "H W"],
        points: Float[np.ndarray, "H W 3"],
        table_z: float,
        instances: Integer[np.ndarray, "H W"] | None = None,
    ) -> tuple[list[Integer[np.ndarray, "_"]], list[Float[np.ndarray, "_ 3"]], Float[np.ndarray, "M 3"]]:
        """Find each target's pixels (indices v * W + u) and points, and all points of the workspace."""
        points = points.reshape(-1, 3)
        low, high = (self.workspace.T + np.outer([1.0, 1.0], [0.0, 0.0, table_z])).astype(points.dtype)
        inside = [(x > a) & (x < b) for x, a, b in zip(points.T, low, high, strict=True)]
        inside = np.logical_and.reduce(inside)  # NaN lies nowhere
        pixels = np.flatnonzero(inside & (labels.ravel() == self.target_class))
        P = points[pixels]
        groups = self.split(P) if instances is None else separate_instances(P, instances.ravel()[pixels])
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


def separate_instances(P: Float[np.ndarray, "N 3"], numbers: Integer[np.ndarray, "N"]) -> list:
    """Clean the points of each object: a list of indices into P for each number above 0, the most points first."""
    groups = [np.flatnonzero(numbers == number) for number in np.unique(numbers[numbers > 0])]
    cleaned = [group[inliers(P[group])] for group in groups]
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
