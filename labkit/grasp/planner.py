"""Top-down grasps with two parallel jaws, from what one camera saw (the text's sections 4 and 5).

The text ends with a centroid and a covariance, "heuristic top-down grasps aligned with principal directions"; that
is `principal_axis_grasp`. `plan_grasps` starts there and looks around first: it turns the hand through many yaws, lets
it down beside every part of the target, and keeps what fits between the points of the scene, above the table, and as
far as possible outside the shadows that the camera could not look into. Nothing but points, the camera's position, the
table's height and the gripper's measures goes in.
"""

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np
from jaxtyping import Float

from labkit.geometry import centroid_and_covariance
from labkit.support.validation import check_finite, check_shape

TIP_CLEARANCE = 0.004  # metres of air between the tips and the table
FINGER_MARGIN, HAND_MARGIN = 0.0015, 0.004  # metres around fingers and palm that must be free
SPARE, LEAST = 0.010, 0.002  # metres beside the target: what an open jaw should leave, and the least
FAN = 10  # yaws tried besides those of the target's axes
RADIUS = 0.17  # metres around a target in which the scene matters
MEASURED = 20  # grips of a target that are looked at closely
RANKED = 10  # grasps of a target that are reported

# What makes a grip bad, and how bad at worst. Each shortcoming is 0 (none) to 1; `_score` says of what.
WEIGHTS = {
    "shallow": 1.0,
    "wide": 0.4,
    "tight": 0.5,
    "offset": 0.6,
    "shadow": 1.0,
    "short": 0.3,
    "skew": 0.5,
    "unseen": 0.5,
}


@dataclass(frozen=True)
class Gripper:
    """The Panda's hand, metres; the defaults are read off the collision meshes of PyBullet's Panda.

    Heights count from the fingertips upwards. A finger is thin at its tip and thickens evenly up to `root_above_tips`;
    the palm is the underside of the hand, and the body behind it is wider. `tips_below_grasp`: from panda_grasptarget,
    the origin of a grasp, to the tips.

    >>> Gripper().max_opening
    0.08
    """

    max_opening: float = 0.08
    pad_width: float = 0.0174
    finger_width: float = 0.0210
    tip_thickness: float = 0.0144
    root_thickness: float = 0.0265
    root_above_tips: float = 0.0347
    tips_below_grasp: float = 0.0072
    palm_above_tips: float = 0.0462
    palm_length: float = 0.208
    palm_width: float = 0.040
    body_above_tips: float = 0.066
    body_width: float = 0.0634


@dataclass(frozen=True, eq=False)
class Grasp:
    """Where to close the jaws.

    T_base_grasp: (4, 4), the grasp frame in the base frame: z = approach, y = the direction in which the jaws close,
    x = across the pads, origin = the point between the pads (panda_grasptarget). width: metres between the pads to
    come down with. score: 1 for a grip without a shortcoming, less for others. target: number of the cloud.
    """

    T_base_grasp: Float[np.ndarray, "4 4"]
    width: float
    score: float = 0.0
    target: int = 0


@dataclass(frozen=True)
class GraspPlan:
    """Grasps from best to worst over all targets; without any, `reason` says why in words."""

    grasps: tuple[Grasp, ...] = ()
    reason: str = ""


def plan_grasps(
    targets: Sequence[Float[np.ndarray, "_ 3"]],
    scene: Float[np.ndarray, "M 3"],
    table_z: float,
    camera_position: Float[np.ndarray, "3"] | None = None,
    gripper: Gripper = Gripper(),
) -> GraspPlan:
    """Rank top-down grasps of one or several targets among everything that the camera saw.

    targets: a cloud each. scene: the points of targets, table and obstacles. table_z: height of the table.
    camera_position: where the camera stands; without it nothing is known of shadows. Metres, base frame. No candidate
    is a reason in words, not an error. Raises ValueError for an argument that is not finite or of another shape.
    Sections 4 and 5 of the text.

    >>> x, y, z = np.meshgrid(np.arange(0.48, 0.521, 0.002), np.arange(-0.01, 0.011, 0.002), np.arange(0, 0.031, 0.002))
    >>> box = np.stack([x, y, z], axis=-1).reshape(-1, 3)  # 4 cm long in x, 2 cm wide in y
    >>> grasp = plan_grasps([box], box, table_z=0.0).grasps[0]
    >>> grasp.T_base_grasp[:3, 3].round(2), abs(grasp.T_base_grasp[:3, 1]).round(3)
    (array([0.5 , 0.  , 0.01]), array([0., 1., 0.]))
    >>> plan_grasps([], box, table_z=0.0).reason
    'no target points'
    """
    scene = _cloud("scene", scene)
    targets = [_cloud(f"targets[{i}]", target) for i, target in enumerate(targets)]
    table_z = float(check_finite("table_z", check_shape("table_z", table_z, ())))
    if camera_position is not None:
        camera_position = check_finite("camera_position", check_shape("camera_position", camera_position, (3,)))
        camera_position = camera_position.astype(np.float64)

    def plan_one(number: int) -> list[Grasp] | str:
        return _plan_one(number, targets[number], scene, table_z, camera_position, gripper)

    others = [_threads().submit(plan_one, number) for number in range(1, len(targets))]
    plans = [plan_one(0), *(other.result() for other in others)] if targets else []
    grasps, reasons = [], []
    for found in plans:
        if isinstance(found, str):
            reasons.append(found)
        else:
            grasps += found
    grasps.sort(key=lambda grasp: -grasp.score)
    reason = "" if grasps else "; ".join(dict.fromkeys(reasons)) or "no target points"
    return GraspPlan(tuple(grasps), reason)


@cache
def _threads() -> ThreadPoolExecutor:
    """For several targets at once: the search is compiled and lets other threads run."""
    return ThreadPoolExecutor(thread_name_prefix="grasps")


os.register_at_fork(after_in_child=_threads.cache_clear)  # a child process has none of its parent's threads


def top_down_grasp(
    cloud: Float[np.ndarray, "N 3"],
    scene: Float[np.ndarray, "M 3"] | None = None,
    table_z: float | None = None,
    camera_position: Float[np.ndarray, "3"] | None = None,
    gripper: Gripper = Gripper(),
) -> Grasp:
    """Give the best grasp of one cloud; where the planner finds none, the one of its principal axis, with score 0.

    scene: what else is there, default nothing; table_z: default the cloud's lowest point. Raises ValueError for an
    empty cloud, which has no centroid. Section 4 of the text.

    >>> stick = np.array([[0.5, 0.001 * i, 0.05] for i in range(100)])
    >>> T = top_down_grasp(stick, table_z=0.03).T_base_grasp
    >>> abs(T[:3, 1]).round(2), T[:3, 2]
    (array([1., 0., 0.]), array([ 0.,  0., -1.]))
    """
    cloud = _cloud("cloud", cloud)
    table_z = cloud[:, 2].min(initial=np.inf) if table_z is None else table_z
    fallback = principal_axis_grasp(cloud, table_z, gripper)
    plan = plan_grasps([cloud], cloud if scene is None else scene, table_z, camera_position, gripper)
    return plan.grasps[0] if plan.grasps else fallback


def principal_axis_grasp(
    cloud: Float[np.ndarray, "N 3"], table_z: float | None = None, gripper: Gripper = Gripper()
) -> Grasp:
    """Grasp as the text suggests: at the centroid, closing across the longer principal direction seen from above.

    The jaws start fully open, the tips end as low as palm and table (if its height is given) let them. Nobody looks
    what is in the way, so the score is 0. Raises ValueError for an empty cloud. Section 4 of the text.
    """
    cloud = _cloud("cloud", cloud)
    mu, _ = centroid_and_covariance(cloud)
    tip = max(cloud[:, 2].max() - gripper.palm_above_tips + HAND_MARGIN, cloud[:, 2].min())
    if table_z is not None:
        tip = max(tip, table_z + TIP_CLEARANCE)
    T = _frames(np.array([_principal_yaw(cloud) + np.pi / 2]), mu[None, :2], np.array([tip + gripper.tips_below_grasp]))
    return Grasp(T[0], gripper.max_opening)


def _cloud(name: str, points) -> Float[np.ndarray, "N 3"]:
    return np.ascontiguousarray(check_finite(name, check_shape(name, points, (None, 3))), dtype=np.float64)


def _principal_yaw(P: Float[np.ndarray, "N 3"]) -> float:
    """Direction in which a cloud is longest, seen from above; radians from x."""
    centred = P[:, :2] - P[:, :2].mean(axis=0)
    C = centred.T @ centred
    return 0.5 * np.arctan2(2.0 * C[0, 1], C[0, 0] - C[1, 1])


def _frames(yaw, xy, z) -> Float[np.ndarray, "n 4 4"]:
    """Grasp frames: y (the closing direction) at an angle yaw from the base's x axis, z down."""
    T = np.zeros((len(yaw), 4, 4))
    T[:, 0, 1] = T[:, 1, 0] = np.cos(yaw)
    T[:, 1, 1] = np.sin(yaw)
    T[:, 0, 0] = -np.sin(yaw)
    T[:, 2, 2] = -1.0
    T[:, :2, 3], T[:, 2, 3], T[:, 3, 3] = xy, z, 1.0
    return T


def _plan_one(number, target, scene, table_z, camera_position, gripper) -> list[Grasp] | str:
    """Grasps of one target, or why there is none."""
    from labkit.grasp import search_kernels as kernels  # numba takes its time to import
    from labkit.grasp.measure_kernels import find_grips

    if len(target) == 0:
        return "no target points"
    lowest = table_z + TIP_CLEARANCE
    target = target[target[:, 2] > lowest]
    if len(target) == 0:
        return "the target is too flat: nothing of it is higher than the lowest tips"
    hand, enough = _hand(gripper, kernels), _enough(gripper, kernels)
    weights = kernels.Shortcomings(**WEIGHTS)
    camera = np.zeros(0) if camera_position is None else camera_position
    centre, near, hidden = kernels.surroundings(target, scene, camera, lowest, hand)

    def find(scene, hidden):
        return find_grips(target, scene, hidden, centre, _yaws(target), lowest, hand, weights, enough, MEASURED)

    grips, measures, dropped = find(near, hidden)
    if len(grips) == 0:
        _, _, alone = found_alone = find(target, hidden[:0])
        if len(found_alone[0]) == 0:
            too_wide = alone[kernels.WIDE] or alone[kernels.SLIPPERY]
            return "too wide for the gripper in every direction" if too_wide else "the target is too flat to be gripped"
        if dropped[kernels.PALM]:
            return "no room for the palm: something beside the target is too high"
        return "no room for the fingers beside the target"
    scores = _score(measures, weights, enough)
    best = np.argsort(-scores)[:RANKED]
    grips, measures, scores = grips[best], measures[best], scores[best]
    cos, sin = np.cos(grips["yaw"]), np.sin(grips["yaw"])
    a, b = measures["middle"], grips["b"]
    xy = centre + np.stack([a * cos - b * sin, a * sin + b * cos], axis=1)
    T = _frames(grips["yaw"], xy, grips["tip"] + gripper.tips_below_grasp)
    found = zip(T, measures["opening"].tolist(), scores.tolist(), strict=True)
    return [Grasp(T, width, score, number) for T, width, score in found]


def _hand(gripper: Gripper, kernels):
    """The gripper with its margins, as the kernels take it, and the size of the maps that it needs."""
    cell = gripper.max_opening / kernels.CELLS
    outwards = np.arange(0.0, gripper.root_thickness + FINGER_MARGIN, cell)
    rise = gripper.root_above_tips / max(gripper.root_thickness - gripper.tip_thickness, 1e-6)
    underside = (outwards - gripper.tip_thickness - FINGER_MARGIN) * rise
    palm_reach, body_half = gripper.palm_length / 2 + HAND_MARGIN, gripper.body_width / 2 + HAND_MARGIN
    return kernels.Hand(
        cell=cell,
        columns=2 * (kernels.OUTWARDS + int(np.ceil(palm_reach / cell))),
        rows=2 * (kernels.REACH + int(np.ceil(body_half / cell))) + 1,
        slot=int(np.ceil((gripper.tip_thickness + HAND_MARGIN) / cell)),
        opening=gripper.max_opening,
        pad=gripper.pad_width / 2,
        finger=gripper.finger_width / 2 + FINGER_MARGIN,
        thickness=gripper.tip_thickness,
        underside=np.clip(underside, 0.0, gripper.root_above_tips).astype(np.float32),
        palm=gripper.palm_above_tips - HAND_MARGIN,
        palm_half=gripper.palm_width / 2 + HAND_MARGIN,
        palm_reach=palm_reach,
        body=gripper.body_above_tips - HAND_MARGIN,
        body_half=body_half,
        spare=SPARE,
        least=LEAST,
    )


def _enough(gripper: Gripper, kernels):
    """From which length on, in metres, a shortcoming is as bad as can be (or, for depth, air and touch, is gone)."""
    opening, pad = gripper.max_opening, gripper.pad_width
    return kernels.Shortcomings(
        shallow=opening / 4,
        wide=opening,
        tight=SPARE,
        offset=opening / 2,
        shadow=opening / 4,
        short=0.92 * pad,
        skew=pad / 2,
        unseen=opening / 8,
    )


def _yaws(target) -> Float[np.ndarray, "Y"]:
    """Directions to close in: the principal axes, the sides of the smallest rectangle around, and a fan."""
    _, _, degrees = cv2.minAreaRect(np.float32(target[:, :2] - target[0, :2]))
    axes = np.array([_principal_yaw(target), np.radians(degrees)])
    return np.concatenate([axes, axes + np.pi / 2, np.arange(FAN) * np.pi / FAN])


def _score(m, weights, enough) -> Float[np.ndarray, "n"]:
    """1 minus the weighted mean of the shortcomings, each from 0 to 1."""
    shortcomings = type(weights)(
        shallow=1.0 - m["depth"] / enough.shallow,
        wide=m["width"] / enough.wide,
        tight=1.0 - m["clearance"] / enough.tight,
        offset=m["offset"] / enough.offset,
        shadow=m["shadow"] / enough.shadow,
        short=1.0 - m["patch"] / enough.short,
        skew=m["skew"] / enough.skew,
        unseen=m["unseen"] / enough.unseen,
    )
    return 1.0 - np.array(weights) @ np.clip(shortcomings, 0.0, 1.0) / sum(weights)
