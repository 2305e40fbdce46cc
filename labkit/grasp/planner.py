"""Top-down grasps with two parallel jaws, from what one camera saw (topic 07).

`principal_axis_grasp` is the simplest: at the centroid of the target's cloud, closing along its shorter principal
direction. `plan_grasps` starts there and looks around: it turns the hand through many yaws, lets it down beside every
part of the target, and keeps what fits between the points of the scene, above the table, and as far as possible outside
the shadows that the camera could not look into. It knows points, the camera's position, the table's height and the
gripper's measures, and nothing else.
"""

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields, replace
from functools import cache

import cv2
import numpy as np
from jaxtyping import Float

from labkit.geometry import centroid_and_covariance
from labkit.support.validation import check_finite, check_height, check_shape, require

# Metres that sensor and arm may be wrong by, whatever the gripper.
TIP_CLEARANCE = 0.004  # of air between the tips and the table
FINGER_MARGIN, HAND_MARGIN = 0.0015, 0.004  # around fingers and palm that must be free
SPARE, LEAST = 0.010, 0.002  # beside the target: what an open jaw should leave, and the least
MAX_POSITION = 20.0  # from the base; a larger number is a length in millimetres

FAN = 10  # yaws tried besides those of the target's axes
MEASURED = 20  # grips of a target that are looked at closely
RANKED = 10  # grasps of a target that are reported

# How much each shortcoming of a grip counts; labkit.grasp.search_kernels.Shortcomings says what they are.
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
    """The measures of a parallel jaw, metres; the defaults are those of the Panda's hand.

    max_opening: between the pads. pad_width: of the flat pad that touches, across the closing direction. finger_width:
    of the whole finger, likewise. tip_thickness, root_thickness: of a finger along the closing direction, at its tip
    and at its thickest, which it reaches evenly at the height root_above_tips. palm_above_tips: height of the hand's
    underside over the tips; palm_length along and palm_width across the closing direction. body_above_tips,
    body_width: the wider part of the hand behind the palm, likewise. tips_below_grasp: from the origin of the grasp
    frame down to the tips. Raises ValueError for a length that is not above 0 or is as large as one in millimetres.

    >>> wide = Gripper(max_opening=0.14, palm_length=0.25)
    >>> wide.pad_width  # what is not given is the Panda's
    0.0174
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

    def __post_init__(self):
        for field in fields(self):
            value = getattr(self, field.name)
            fits = np.ndim(value) == 0 and 0.0 <= value < 1.0 and (value > 0.0 or field.name == "tips_below_grasp")
            require(field.name, fits, "metres above 0 and below 1", f"{value}; multiply millimetres by 0.001")
        at_most = {"tip_thickness": "root_thickness", "pad_width": "finger_width", "root_above_tips": "palm_above_tips"}
        for smaller, larger in at_most.items():
            value, most = getattr(self, smaller), getattr(self, larger)
            require(smaller, value <= most, f"at most {larger}, {most}", value)


@dataclass(frozen=True, eq=False)
class Grasp:
    """Where to close the jaws.

    T_base_grasp: (4, 4), the grasp frame in the base frame: z = approach, y = the direction in which the jaws close,
    x = along the pads, origin = the point between the pads (the Panda's panda_grasptarget). width: metres between the
    pads to come down with. score: 1 for a grip without a shortcoming, less for others; a `Pipeline` multiplies it by
    its target's certainty. target: index of the cloud, from 0.
    """

    T_base_grasp: Float[np.ndarray, "4 4"]
    width: float
    score: float = 0.0
    target: int = 0

    def __repr__(self) -> str:
        x, y, z = self.T_base_grasp[:3, 3]
        closing = self.T_base_grasp[:3, 1]
        yaw = np.degrees(np.arctan2(closing[1], closing[0])) % 180.0
        return (
            f"Grasp(at ({x:.3f}, {y:.3f}, {z:.3f}), closing at {yaw:.0f} degrees, {1000.0 * self.width:.0f} mm open, "
            f"score {self.score:.2f})"
        )


@dataclass(frozen=True)
class GraspPlan:
    """Grasps from best to worst over all targets; without any, `reason` says why in words."""

    grasps: tuple[Grasp, ...] = ()
    reason: str = ""

    def __repr__(self) -> str:
        grasps = f"{len(self.grasps)} grasps, the best {self.grasps[0]}" if self.grasps else f"no grasp: {self.reason}"
        return f"GraspPlan({grasps})"


def plan_grasps(
    targets: Sequence[Float[np.ndarray, "_ 3"]],
    scene: Float[np.ndarray, "M 3"],
    table_z: float,
    camera_position: Float[np.ndarray, "3"] | None = None,
    gripper: Gripper = Gripper(),
    certainty: Sequence[float] | None = None,
) -> GraspPlan:
    """Rank top-down grasps of one or several targets among everything that the camera saw.

    targets: a cloud each. scene: the points of targets, table and obstacles. table_z: height of the table.
    camera_position: where the camera stands; without it nothing is known of shadows. gripper: the hand, the Panda's by
    default. certainty: of each target, in 0..1, by which the scores of its grasps are multiplied. Metres, base frame.
    Without any grasp the plan says why. Raises ValueError for an argument that is not finite, of another shape, or in
    millimetres. Topic 07.

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
    table_z = check_height("table_z", table_z)
    if camera_position is not None:
        camera_position = _cloud("camera_position", check_shape("camera_position", camera_position, (3,))[None])[0]

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
    plan = GraspPlan(tuple(grasps), reason)
    return plan if certainty is None else weighed(plan, certainty)


@cache
def _threads() -> ThreadPoolExecutor:
    """For several targets at once: the search is compiled and lets other threads run."""
    return ThreadPoolExecutor(thread_name_prefix="grasps")


if hasattr(os, "register_at_fork"):  # Windows has no fork
    os.register_at_fork(after_in_child=_threads.cache_clear)  # a child process has none of its parent's threads


def weighed(plan: GraspPlan, certainty: Sequence[float]) -> GraspPlan:
    """Multiply scores by how certain their targets are, and sort: a fine grip on an obstacle is worth little."""
    grasps = [replace(grasp, score=grasp.score * certainty[grasp.target]) for grasp in plan.grasps]
    return replace(plan, grasps=tuple(sorted(grasps, key=lambda grasp: -grasp.score)))


def principal_axis_grasp(
    cloud: Float[np.ndarray, "N 3"], table_z: float | None = None, gripper: Gripper = Gripper()
) -> Grasp:
    """Grasp a cloud at its centroid, closing across the longer of its principal directions seen from above.

    Metres, base frame. The jaws start fully open; the tips end as low as palm and table (if its height is given) let
    them. This grasp takes no account of what stands in the way, so its score is 0. Raises ValueError for an empty
    cloud. Topic 07.
    """
    cloud = _cloud("cloud", cloud)
    mu, _ = centroid_and_covariance(cloud)
    tip = max(cloud[:, 2].max() - gripper.palm_above_tips + HAND_MARGIN, cloud[:, 2].min())
    if table_z is not None:
        tip = max(tip, check_height("table_z", table_z) + TIP_CLEARANCE)
    T = _frames(np.array([_principal_yaw(cloud) + np.pi / 2]), mu[None, :2], np.array([tip + gripper.tips_below_grasp]))
    return Grasp(T[0], gripper.max_opening)


def _cloud(name: str, points) -> Float[np.ndarray, "N 3"]:
    """Return points in metres as float64, in one block of memory."""
    points = np.ascontiguousarray(check_shape(name, points, (None, 3)), dtype=np.float64)
    if len(points) and not (points.min() >= -MAX_POSITION and points.max() <= MAX_POSITION):  # NaN fails too
        check_finite(name, points)
        most = np.abs(points).max()
        raise ValueError(f"{name}: expected metres, got {most:.6g}, which looks like millimetres: multiply by 0.001")
    return points


def _principal_yaw(P: Float[np.ndarray, "N 3"]) -> float:
    """Direction in which a cloud is longest, seen from above; radians from x."""
    centred = P[:, :2] - P[:, :2].mean(axis=0)
    C = centred.T @ centred
    return 0.5 * np.arctan2(2.0 * C[0, 1], C[0, 0] - C[1, 1])


def _frames(yaw, xy, z) -> Float[np.ndarray, "n 4 4"]:
    """Grasp frames: y (the closing direction) at an angle yaw from the base's x axis, z down."""
    s, c, o, i = np.sin(yaw), np.cos(yaw), np.zeros(len(yaw)), np.ones(len(yaw))
    x, y = xy.T
    return np.array([[-s, c,  o, x],
                     [ c, s,  o, y],
                     [ o, o, -i, z],
                     [ o, o,  o, i]]).transpose(2, 0, 1)  # fmt: skip


def _plan_one(number, target, scene, table_z, camera_position, gripper) -> list[Grasp] | str:
    """Grasps of one target, or why there is none."""
    from labkit.grasp import search_kernels as kernels  # numba takes its time to import
    from labkit.grasp.measure_kernels import measure_grips
    from labkit.grasp.surroundings_kernels import surroundings

    if len(target) == 0:
        return "no target points"
    lowest = table_z + TIP_CLEARANCE
    target = target[target[:, 2] > lowest]
    if len(target) == 0:
        return "the target is too flat: nothing of it is higher than the lowest tips"
    hand = _hand(gripper, kernels)
    rules = kernels.Rules(lowest, hand, kernels.Shortcomings(**WEIGHTS), _enough(gripper, kernels))
    seen = surroundings(target, scene, camera_position, lowest, hand)

    def find(seen):
        grips, dropped = kernels.search(seen, _yaws(target), rules)
        best = np.argsort(grips["cost"], kind="stable")[: np.isfinite(grips["cost"]).sum()]
        return measure_grips(grips[best], seen, rules, MEASURED, dropped), dropped

    grips, dropped = find(seen)
    if len(grips) == 0:
        alone, dropped_alone = find(seen._replace(near=target, hidden=seen.hidden[:0]))
        return _why_none(dropped, len(alone) > 0, dropped_alone, kernels)
    grips = grips[np.argsort(grips["cost"], kind="stable")[:RANKED]]
    a, b, cos, sin = grips["a"], grips["b"], np.cos(grips["yaw"]), np.sin(grips["yaw"])
    xy = seen.centre + np.stack([a * cos - b * sin, a * sin + b * cos], axis=1)
    T = _frames(grips["yaw"], xy, grips["tip"] + gripper.tips_below_grasp)
    found = zip(T, grips["opening"].tolist(), (1.0 - grips["cost"] / sum(rules.weights)).tolist(), strict=True)
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


def _why_none(dropped, fits_alone: bool, dropped_alone, kernels) -> str:
    """Say in words why a target has no grasp, given what happens among the scene and if it stood alone."""
    if not fits_alone:
        too_wide = dropped_alone[kernels.WIDE] or dropped_alone[kernels.SLIPPERY]
        return "too wide for the gripper in every direction" if too_wide else "the target is too flat to be gripped"
    if dropped[kernels.PALM]:
        return "no room for the palm: something beside the target is too high"
    return "no room for the fingers beside the target"
