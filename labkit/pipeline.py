"""The whole chain: RGBDFrame -> class probabilities -> labels -> target clouds in the base frame -> grasps."""

import sys
import time
from collections.abc import Callable, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import cv2
import numpy as np
from jaxtyping import Float, Integer, UInt8

from labkit.frame import RGBDFrame
from labkit.geometry import back_project_to_base, cluster, remove_outliers
from labkit.grasp import GraspPlan, plan_grasps
from labkit.labels import CLASSES, TARGET, one_hot
from labkit.stacks.engines import Engine, open_engine
from labkit.support.validation import check_labels, check_rgb, check_same_size, check_shape

# What the arm can meet: points outside this box (base frame, metres; z from the table) do not concern the grasp.
WORKSPACE = ((0.15, 1.0), (-0.7, 0.7), (-0.02, 0.5))


@dataclass(frozen=True, eq=False)
class Perception:
    """What a robot knows after one frame.

    probabilities: (H, W, C) in 0..1. labels: uint8 (H, W). points: every pixel in the base frame, (H, W, 3), metres,
    NaN without depth. clouds: one (N, 3) a target, largest first. certainty: for each cloud the mean probability of the
    target class where it was seen. scene: all points of the workspace, (M, 3). plan: the grasps ranked by their score
    times that certainty, or the reason why there is none. seconds: time spent by stage.
    """

    probabilities: Float[np.ndarray, "H W C"]
    labels: UInt8[np.ndarray, "H W"]
    points: Float[np.ndarray, "H W 3"]
    clouds: list[np.ndarray]
    scene: Float[np.ndarray, "M 3"]
    plan: GraspPlan
    certainty: tuple[float, ...] = ()
    seconds: dict[str, float] = field(default_factory=dict)


class Pipeline:
    """The chain as one object: `Pipeline(model, table_z).run(frame)`.

    model: a network of labkit.network, or any function from an RGB image, uint8 (H, W, 3), to class probabilities
    (H, W, C). table_z: height of the calibrated table plane in the base frame, metres. target_class: what to grasp.
    mirror: let a network look at the image and at its mirror image, and average: better, at twice the time.
    engine: "torch", "opencv" or "onnxruntime" runs the network there (labkit.stacks.engines): equal numbers, other
    speeds; the model may then be an ONNX file of `labkit export`.
    crf: True refines the labels with the kit's CRF; or a function (probabilities, frame) -> labels (H, W).
    back_project: function (depth, K, T_base_cam) -> (H, W, 3); split: function of the target's points to a list of
    clouds; grasp: function (clouds, scene, table_z, camera_position) -> GraspPlan. The defaults are the kit's; each
    may be replaced by one's own, as the labs do. Raises ValueError for an argument that does not fit. Sections 1 to 5.

    >>> def sees_nothing(rgb):
    ...     return np.dstack([np.ones(rgb.shape[:2]), np.zeros((*rgb.shape[:2], 3))])
    >>> rgb, depth = np.zeros((6, 8, 3), np.uint8), np.ones((6, 8), np.float32)
    >>> frame = RGBDFrame(rgb, depth, K=np.diag([9.0, 9.0, 1.0]), T_base_cam=np.eye(4))
    >>> perception = Pipeline(sees_nothing).run(frame)
    >>> len(perception.clouds), perception.plan.grasps
    (0, ())
    """

    def __init__(
        self,
        model,
        table_z: float = 0.0,
        target_class: int = TARGET,
        *,
        mirror: bool = True,
        engine: str | None = None,
        crf: bool | Callable[[np.ndarray, RGBDFrame], np.ndarray] = False,
        back_project: Callable = back_project_to_base,
        split: Callable[[np.ndarray], Sequence[np.ndarray]] | None = None,
        grasp: Callable[..., GraspPlan] = plan_grasps,
    ):
        if engine is not None:
            model = open_engine(engine, model)
        if not callable(model):
            raise ValueError(f"model: expected a network or a function of an RGB image, got {type(model).__name__}")
        if not np.isfinite(table_z):
            raise ValueError(f"table_z: expected a height in metres, got {table_z}")
        if target_class not in range(len(CLASSES)):
            raise ValueError(f"target_class: expected 0 to {len(CLASSES) - 1}, got {target_class!r}")
        self.model = model
        self.table_z = float(table_z)
        self.target_class = target_class
        self.mirror = mirror
        self.crf = refine_labels if crf is True else crf
        self.back_project = back_project
        self.split = split or separate_objects
        self.grasp = grasp

    def run(self, frame: RGBDFrame, labels: Integer[np.ndarray, "H W"] | None = None) -> Perception:
        """Perceive one frame. `labels`, when given, stand in for the network's: true masks, or anyone else's."""
        seconds = {}
        with _timed(seconds, "network"):
            if labels is None:
                probabilities = class_probabilities(self.model, frame.rgb, self.mirror)
            else:
                labels = check_shape("labels", check_labels("labels", labels, len(CLASSES)), (None, None))
                check_same_size("frame.rgb", frame.rgb, "labels", labels)
                probabilities = one_hot(labels).astype(np.float32)
        with _timed(seconds, "labels"):
            labels = most_probable(probabilities)
        if self.crf:
            with _timed(seconds, "crf"):
                labels = self.crf(probabilities, frame)
        with _timed(seconds, "back_projection"):
            points = self.back_project(frame.depth, frame.K, frame.T_base_cam)
        with _timed(seconds, "clouds"):
            seen = np.isfinite(points[..., 2])
            clouds = list(self.split(points[seen & (labels == self.target_class)]))
            scene = self._in_workspace(points)
        with _timed(seconds, "grasps"):
            certainty = tuple(mean_under(cloud, probabilities[..., self.target_class], frame) for cloud in clouds)
            plan = rank(self.grasp(clouds, scene, self.table_z, frame.T_base_cam[:3, 3]), certainty)
        return Perception(probabilities, labels, points, clouds, scene, plan, certainty, seconds)

    def _in_workspace(self, points: Float[np.ndarray, "H W 3"]) -> Float[np.ndarray, "M 3"]:
        from labkit.support.geometry_kernels import points_in_box  # numba takes its time to import

        low, high = np.array(WORKSPACE).T + np.outer([1.0, 1.0], [0.0, 0.0, self.table_z])
        return points_in_box(np.ascontiguousarray(points).reshape(-1, 3), low, high)


@contextmanager
def _timed(seconds: dict[str, float], stage: str):
    start = time.perf_counter()
    yield
    seconds[stage] = time.perf_counter() - start


def class_probabilities(model, rgb: UInt8[np.ndarray, "H W 3"], mirror: bool = False) -> Float[np.ndarray, "H W C"]:
    """Class probabilities of an RGB image from a network, an engine or a function; checks that they are some.

    mirror: as in `labkit.network.predict_probabilities`; a function decides for itself. Raises ValueError
    if they are not of shape (H, W, C), or not finite (a network with NaN weights, say).
    """
    torch = sys.modules.get("torch")  # heavy: a pipeline around a plain function does without it
    if torch is not None and isinstance(model, torch.nn.Module):
        from labkit.network import predict_probabilities

        p = predict_probabilities(model, rgb, mirror)
    elif isinstance(model, Engine):
        p = model(rgb, mirror)
    else:
        p = np.asarray(model(check_rgb("rgb", rgb)))
    p = check_shape("probabilities", p, (*rgb.shape[:2], None))
    if not np.isfinite(p).all():
        raise ValueError("probabilities: expected finite numbers from the model, got NaN or infinity")
    return p


def most_probable(probabilities: Float[np.ndarray, "H W C"]) -> UInt8[np.ndarray, "H W"]:
    """The label of each pixel: the class of highest probability (problem 3 of the text), the first one of equals.

    >>> most_probable(np.array([[[0.2, 0.8], [0.5, 0.5]]]))
    array([[1, 0]], dtype=uint8)
    """
    from labkit.support import labels_kernels  # numba takes its time to import

    return labels_kernels.most_probable(np.asarray(probabilities))


def refine_labels(probabilities: Float[np.ndarray, "H W C"], frame: RGBDFrame) -> UInt8[np.ndarray, "H W"]:
    """Labels that are smooth except at edges of colour or depth: the CRF of section 2 on top of a network."""
    from labkit.crf import refine  # numba: loaded only where it is wanted

    return refine(probabilities, frame.rgb, frame.depth).labels


def separate_objects(P: Float[np.ndarray, "N 3"]) -> list[Float[np.ndarray, "_ 3"]]:
    """Clean the points of the target class and split them: two targets are two clouds."""
    return cluster(remove_outliers(P))


def mean_under(P: Float[np.ndarray, "N 3"], image: Float[np.ndarray, "H W"], frame: RGBDFrame) -> float:
    """Mean of an image over the pixels in which a frame's camera sees points (base frame); 0 if it sees none.

    >>> rgb, depth = np.zeros((2, 2, 3), np.uint8), np.ones((2, 2), np.float32)
    >>> frame = RGBDFrame(rgb, depth, K=np.eye(3), T_base_cam=np.eye(4))
    >>> mean_under(np.array([[1.0, 0.0, 1.0], [1.0, 1.0, 1.0]]), np.array([[0.1, 0.2], [0.3, 0.6]]), frame)
    0.4
    """
    R, t = frame.T_base_cam[:3, :3], frame.T_base_cam[:3, 3]
    x, y, z = frame.K @ R.T @ (P - t).T
    with np.errstate(all="ignore"):
        u, v = np.rint(x / z), np.rint(y / z)
        inside = (z > 0.0) & (u >= 0) & (u < image.shape[1]) & (v >= 0) & (v < image.shape[0])
    return float(image[v[inside].astype(int), u[inside].astype(int)].mean(dtype=np.float64)) if inside.any() else 0.0


def rank(plan: GraspPlan, certainty: Sequence[float]) -> GraspPlan:
    """Weigh the grasps with how certain their targets are, and sort: a fine grip on an obstacle is worth little."""
    weighed = [replace(grasp, score=grasp.score * certainty[grasp.target]) for grasp in plan.grasps]
    return replace(plan, grasps=tuple(sorted(weighed, key=lambda grasp: -grasp.score)))


def segment_rgb_image(model, image: UInt8[np.ndarray, "H W 3"], order: str = "rgb") -> UInt8[np.ndarray, "H W"]:
    """Label each pixel of an image (the text's function of section 6).

    order: "rgb", or "bgr" for an image as OpenCV and many ROS cameras give it. The text's version takes either and
    always swaps; here the caller says which it is. Raises ValueError for another order or no uint8 image.

    >>> segment_rgb_image(lambda rgb: rgb / 255.0, np.array([[[255, 0, 0]]], np.uint8), order="bgr")
    array([[2]], dtype=uint8)
    """
    if order not in ("rgb", "bgr"):
        raise ValueError(f'order: expected "rgb" or "bgr", got {order!r}')
    image = check_rgb("image", image)
    rgb = cv2.cvtColor(image, cv2.COLOR_BGR2RGB) if order == "bgr" else image
    return most_probable(class_probabilities(model, rgb))
