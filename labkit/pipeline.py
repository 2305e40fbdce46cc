"""The whole chain: RGBDFrame -> class probabilities -> labels -> target clouds in the base frame -> grasps."""

import time
from collections.abc import Callable, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property

import cv2
import numpy as np
from jaxtyping import Float, Integer, UInt8

from labkit.frame import RGBDFrame
from labkit.geometry import Table, back_project_to_base
from labkit.grasp import GraspPlan, Gripper, plan_grasps, weighed
from labkit.labels import IGNORE
from labkit.learning.engines import class_number, open_engine
from labkit.learning.inference import Engine, FunctionEngine, check_probabilities
from labkit.learning.things import predicts_instances, segment_instances
from labkit.notices import notices
from labkit.support.validation import check_height, check_rgb, check_whole, require
from labkit.targets import (
    WORKSPACE,
    Clicks,
    Segmentation,
    TargetFinder,
    certainty_in,
    instances_in,
    labels_in,
    separate_objects,
)


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


class Pipeline:
    """The chain as one object: `Pipeline(model).run(frame)`, which is `perceive` and then `locate`.

    - model: any PyTorch network (`labkit.network.TorchEngine` says how it states what it takes, and which outputs are
      understood), or any function from an RGB image, uint8 (H, W, 3), to class probabilities (H, W, C) that sum to 1;
      None if only `locate` is used.
    - table_z: height of the table in the base frame, metres; None takes the frame's own, or else 0.
    - target_class: the class to grasp, its number or its name in the id2label of a Hugging Face model; None is the
      kit's target, 2, or 1 where there are two classes, as of one channel with a sigmoid.
    - processor: the image processor of a Hugging Face model, which then sees the picture as that prepares it.
    - find_objects: in place of a model, any function from a frame to the numbers of objects, integers (H, W), 0 for
      none, or to `labkit.learning.things.Instances`, such as its `instance_finder` makes of a network; each is a
      target.
    - flip_tta: test-time flip: a network sees the image and its mirror image, and the mean of both counts: a little
      better, at twice its time; None does so for a network that sees the canonical view, which has one size.
    - engine: "torch", "opencv" or "onnxruntime" runs the network there (`labkit.learning.engines`): equal numbers,
      other speeds; the model may then be an ONNX file of `labkit export`.
    - crf: True refines the labels with the kit's CRF, or a function (probabilities, frame) -> labels (H, W) does; None
      refines those of a network, and leaves those of a plain function, which decides for itself.
    - workspace: ((x, x), (y, y), (z, z)), from and to, metres in the base frame, z from the table: what the arm can
      meet; nothing outside is a target or an obstacle. "table" if nobody knows it: then the table is looked for at its
      height, and what does not stand on it, or hangs into the picture from its border, is no target.
    - gripper: the hand that the planner plans for; the Panda's if none is given.
    - back_project: a function (depth, K, T_base_cam) -> (H, W, 3), in place of the kit's.
    - split: a function of the target's points (N, 3) to a list of index arrays, one for each object.
    - grasp: a function (clouds, scene, table_z, camera_position) -> GraspPlan, in place of the kit's planner.
    - unit_known: True if the unit of depth is certain. Otherwise nothing is grasped where the targets' distance and
      sizes fit another unit and not this one; the plan's reason says so (`labkit.geometry.depth_units.other_unit`).

    Raises ValueError for an argument that does not fit. Topics 03, 06 and 07.

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
        target_class: int | str | None = None,
        *,
        processor=None,
        find_objects: Callable[[RGBDFrame], object] | None = None,
        flip_tta: bool | None = None,
        engine: str = "torch",
        crf: bool | Callable[[np.ndarray, RGBDFrame], np.ndarray] | None = None,
        workspace: Sequence[Sequence[float]] | str = WORKSPACE,
        gripper: Gripper | None = None,
        back_project: Callable = back_project_to_base,
        split: Callable[[np.ndarray], Sequence[np.ndarray]] = separate_objects,
        grasp: Callable[..., GraspPlan] | None = None,
        unit_known: bool = False,
    ):
        require("find_objects", model is None or find_objects is None, "none beside a model", "both")
        require("gripper", grasp is None or gripper is None, "none beside `grasp`, which plans for its own", "both")
        require("processor", processor is None or model is not None, "a model beside it", "none")
        self.model = None if model is None else open_engine(model, engine, processor)
        self.find_objects = find_objects
        self.target_given, self.target_class = target_class is not None, class_number(target_class, self.model)
        check_whole("target_class", self.target_class, 0, (getattr(self.model, "num_classes", None) or IGNORE) - 1)
        self.table_z = None if table_z is None else check_height("table_z", table_z)
        sees_view = isinstance(self.model, Engine) and self.model.takes.pixel is not None
        self.flip_tta = sees_view if flip_tta is None else flip_tta
        crf = not isinstance(self.model, FunctionEngine) if crf is None else crf
        self.crf = refine_labels if crf is True else crf
        self.targets = TargetFinder(workspace, split, unit_known)
        self.back_project = back_project
        self.gripper = gripper or Gripper()
        self.grasp = grasp

    def run(self, frame: RGBDFrame, at: Sequence | None = None, not_at: Sequence | None = None) -> Perception:
        """From a frame to grasps: `perceive`, then `locate`.

        at: a pixel (u, v), column and row: the thing there is the only target, whatever its class and wherever in the
        workspace it stands; if there is none, the plan's reason says what is there. A network that tells things apart,
        or `find_objects`, says which pixels it has; of a network of classes alone those that hang together. not_at: a
        pixel of that thing that is none of it, such as of the can on which a can stands: an exact cut on colour and
        depth parts them (`labkit.crf.clicks`, topic 02). Either may be several pixels. Raises ValueError for a pixel
        outside the picture, one that is both, or `not_at` alone.
        """
        frame, seconds = self._with_table_z(frame), {}
        clicks = Clicks.of(frame, at, not_at)
        seen = self._perceive(frame, seconds, bool(clicks.at))
        return self._locate(frame, seen, seconds, clicks)

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
        not_at: Sequence | None = None,
    ) -> Perception:
        """Find the labelled targets in space, and grasps for them.

        labels: of this pipeline's `perceive`, true ones, or anybody's: any classes, 255 for "unknown". probabilities:
        what they were chosen by, if anything. instances: numbers of objects, 0 for none, in place of `split`: of the
        pixels labelled target, those of one number are one target. at, not_at: as in `run`. Raises ValueError naming
        the argument that does not fit.
        """
        labels, target = labels_in(frame, labels), self.target_class
        if probabilities is not None:
            target = self._target_in(check_probabilities(probabilities, labels.shape))
        if instances is not None:
            instances = instances_in(frame, instances)
        seen = Segmentation(labels, target, probabilities, instances)
        return self._locate(self._with_table_z(frame), seen, {}, Clicks.of(frame, at, not_at))

    def _with_table_z(self, frame: RGBDFrame) -> RGBDFrame:
        """The frame with the height of the table that counts: this pipeline's, or else its own, or else 0."""
        known = frame.table_z if self.table_z is None else self.table_z
        return replace(frame, table_z=known or 0.0)

    def _target_in(self, probabilities: Float[np.ndarray, "H W C"]) -> int:
        """The class to grasp among those of probabilities."""
        C = probabilities.shape[-1]
        target = self.target_class if self.target_given or C != 2 else 1
        require("target_class", target < C, f"one of the {C} classes of probabilities", target)
        return target

    def _perceive(self, frame: RGBDFrame, seconds: dict[str, float], things: bool = False) -> Segmentation:
        """things: tell things apart beside their classes, if the network can."""
        if self.find_objects is not None:
            with timed(seconds, "objects"):
                found = self.find_objects(frame)
                instances = instances_in(frame, getattr(found, "instances", found))
            labels = np.where(instances > 0, self.target_class, 0).astype(np.uint8)
            certainty = certainty_in(instances, getattr(found, "certainty", None))
            return Segmentation(labels, self.target_class, instances=instances, certainty=certainty)
        require("model", self.model is not None, "one to perceive with", "None; `locate` takes labels from elsewhere")
        instances = certainty = None
        with timed(seconds, "network"):
            if things and predicts_instances(self.model):
                found = segment_instances(self.model, frame, self.flip_tta)
                instances, certainty, probabilities = found.instances, found.certainty, found.probabilities
            else:
                probabilities = self.model(frame, self.flip_tta)
        target = self._target_in(probabilities)
        with timed(seconds, "crf" if self.crf else "labels"):
            labels = self.crf(probabilities, frame) if self.crf else most_probable(probabilities)
        return Segmentation(labels_in(frame, labels), target, probabilities, instances, certainty)

    def _locate(self, frame: RGBDFrame, seen: Segmentation, seconds: dict[str, float], clicks: Clicks) -> Perception:
        with timed(seconds, "back_projection"):
            points = self.back_project(frame.depth, frame.K, frame.T_base_cam)
        with timed(seconds, "clouds"):
            found = self.targets.find(seen, points, frame, clicks)
        with timed(seconds, "grasps"):
            plan = self.plan(found.clouds, found.scene, frame, found.certainty, found.why_none)
        return Perception(
            frame=frame,
            target_class=seen.target_class,
            labels=found.labels,
            probabilities=seen.probabilities,
            points=points,
            pixels=found.pixels,
            clouds=found.clouds,
            scene=found.scene,
            certainty=found.certainty,
            plan=plan,
            seconds=seconds,
            left_out=found.left_out,
            tables=found.tables,
        )

    def plan(self, clouds, scene: Float[np.ndarray, "M 3"], frame: RGBDFrame, certainty, why_none: str) -> GraspPlan:
        """Plan grasps of the clouds among the scene; without any cloud, or with a reason, the plan says why not."""
        if why_none or not clouds:
            return GraspPlan(reason=why_none)
        camera_position = frame.T_base_cam[:3, 3]
        if self.grasp is not None:
            return weighed(self.grasp(clouds, scene, frame.table_z, camera_position), certainty)
        return plan_grasps(clouds, scene, frame.table_z, camera_position, self.gripper, certainty)


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
