"""From a grasp to a motion: over, straight down, straight up, checked against what the robot knows (topic 07).

The planner sees the grasp, the joint angles, the camera's points, the table plane and the robot model. The simulator's
objects are never asked. Metres, radians, base frame.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import RigidTransform, Rotation, Slerp

from labkit.sim.collision import Margin, first_contact, thin, without_robot
from labkit.sim.kinematics import FINGER_MAX, MAX_VELOCITY, forward_kinematics, inverse_kinematics
from labkit.support.validation import check_finite, check_shape, check_T

LIFT = 0.18  # m
APPROACHES = (0.10, 0.16, 0.22)  # m, how far above the grasp the descent may begin
DETOURS = (0.15, 0.3)  # m, how far above the descent a raised waypoint may lie
TRANSIT = Margin()
# Going down, the fingers pass close by the object on purpose, and by what the grasp was chosen to clear.
DESCENT = Margin(arm=0.004, fingers=-0.002, table=0.0005)
ON_TABLE = 0.005  # m, points lower than this belong to the table, which is checked as a plane
SPEED_SHARE = 0.8  # of the joints' velocity limits
RAMP = 0.25  # s, from rest to full speed
JOINT_STEP = 0.03  # rad, at most, between two checked postures
LINE_STEP = 0.02  # m, at most, between two postures on a straight line


@dataclass(frozen=True, eq=False)
class MotionPlan:
    """Joint paths of a grasp, rows of seven angles in rad: `transit` to above it, `descent`, and `lift` straight up.

    T_base_grasp: where the jaws will close, (4, 4). opening: distance of the pads before that, metres.
    """

    T_base_grasp: Float[np.ndarray, "4 4"]
    opening: float
    transit: tuple[Float[np.ndarray, "_ 7"], ...]
    descent: Float[np.ndarray, "_ 7"]
    lift: Float[np.ndarray, "_ 7"]

    def __repr__(self) -> str:
        x, y, z = self.T_base_grasp[:3, 3]
        return f"MotionPlan(to ({x:.3f}, {y:.3f}, {z:.3f}) in {len(self.transit)} leg(s), down, and up)"


def plan_grasp(
    T_base_grasp: Float[np.ndarray, "4 4"],
    opening: float,
    q: Float[np.ndarray, "7"],
    points: Float[np.ndarray, "M 3"],
    table_z: float,
    finger: float = FINGER_MAX,
) -> MotionPlan | str:
    """Plan from joint angles q to a grasp and up again; the reason in words if there is no way.

    opening: distance of the pads to descend with. points: what the camera saw; those on the table plane and on the arm
    itself (as it stands at q, each finger `finger` from the middle) are left out here. The jaws are symmetric, so the
    grasp turned by pi about its approach is tried too. Raises ValueError for an argument that does not fit.

    >>> from labkit.sim.kinematics import HOME
    >>> T = np.diag([1.0, -1.0, -1.0, 1.0]); T[:3, 3] = 0.5, 0.1, 0.02
    >>> plan_grasp(T, 0.05, np.array(HOME[:7]), np.zeros((0, 3)), 0.0).opening
    0.05
    >>> T[0, 3] = 1.5
    >>> plan_grasp(T, 0.05, np.array(HOME[:7]), np.zeros((0, 3)), 0.0)
    'out of reach'
    """
    T = check_T("T_base_grasp", T_base_grasp)
    q = check_finite("q", check_shape("q", q, (7,)))
    points = check_finite("points", check_shape("points", points, (None, 3)))
    if not 0.0 < opening <= 2 * FINGER_MAX:
        return f"too wide for the jaws: an opening of {1000 * opening:.0f} mm, at most {2000 * FINGER_MAX:.0f}"
    points = thin(without_robot(points[points[:, 2] > table_z + ON_TABLE], q, finger))
    reason = "out of reach"
    for approach in APPROACHES:
        plans = [_lines(turned, opening, approach) for turned in (T, T @ np.diag([-1.0, -1.0, 1.0, 1.0]))]
        plans = [plan for plan in plans if plan is not None]
        plans.sort(key=lambda lines: np.abs(lines[0][0] - q).max())
        for descent, lift in plans:
            blocked = first_contact(descent, opening / 2, points, table_z, DESCENT)
            if blocked is None:
                transit = plan_transit(q, descent[0], opening / 2, points, table_z)
                if not isinstance(transit, str):
                    return MotionPlan(T, opening, transit, descent, lift)
                blocked = transit
            reason = f"no path: {blocked}"
    return reason


def _lines(T_base_grasp, opening: float, approach: float):
    """Joint paths down onto the grasp and up from it, or None where the arm does not reach."""
    T_above = T_base_grasp.copy()
    T_above[:3, 3] -= approach * T_base_grasp[:3, 2]
    descent = straight_line(T_above, T_base_grasp)
    lift = None if descent is None else straight_up(descent[-1])
    return None if lift is None else (descent, lift)


def straight_up(q: Float[np.ndarray, "7"], height: float = LIFT) -> Float[np.ndarray, "_ 7"] | None:
    """Joint angles that raise the grasp frame from where it is at q by `height` metres, or None out of reach."""
    T_from = forward_kinematics(q)
    T_to = T_from.copy()
    T_to[2, 3] += height
    return straight_line(T_from, T_to, q)


def straight_line(
    T_from: Float[np.ndarray, "4 4"], T_to: Float[np.ndarray, "4 4"], q0: Float[np.ndarray, "7"] | None = None
) -> Float[np.ndarray, "_ 7"] | None:
    """Joint angles along which the grasp frame moves on a straight line, beginning near q0 if given.

    None where the arm does not reach, or where it would have to jump to another posture on the way.

    >>> T = np.diag([1.0, -1.0, -1.0, 1.0]); T[:3, 3] = 0.5, 0.0, 0.2
    >>> down = T.copy(); down[2, 3] = 0.1
    >>> straight_line(T, down).shape
    (6, 7)
    """
    steps = int(np.ceil(np.linalg.norm(T_to[:3, 3] - T_from[:3, 3]) / LINE_STEP)) + 1
    share = np.linspace(0.0, 1.0, max(steps, 2))
    turn = Slerp([0.0, 1.0], Rotation.from_matrix([T_from[:3, :3], T_to[:3, :3]]))
    shift = np.outer(1.0 - share, T_from[:3, 3]) + np.outer(share, T_to[:3, 3])
    path = []
    for T in RigidTransform.from_components(shift, turn(share)).as_matrix():
        q = inverse_kinematics(T, path[-1] if path else q0)
        if q is None or (path and np.abs(q - path[-1]).max() > 10 * JOINT_STEP):
            return None
        path.append(q)
    return np.array(path)


def plan_transit(
    q_from: Float[np.ndarray, "7"], q_to: Float[np.ndarray, "7"], finger: float, points, table_z: float
) -> tuple[np.ndarray, ...] | str:
    """Joint paths from q_from to q_to that touch nothing: straight, or around by one or two raised waypoints.

    finger: how far each finger is from the middle, metres; points: of the base frame. Gives the legs, at whose ends the
    arm stands still, or what is in the way in words.
    """
    blocked = None
    for waypoints in _detours(q_from, q_to):
        corners = [q_from, *waypoints, q_to]
        legs = tuple(straight_joints(a, b) for a, b in pairwise(corners))
        touched = first_contact(np.vstack(legs), finger, points, table_z, TRANSIT)
        if touched is None:
            return legs
        blocked = blocked or touched
    return blocked


def _detours(q_from, q_to):
    """Lists of waypoints to try: none, raised above the goal, raised above start and goal."""
    yield []
    for height in DETOURS:
        over_goal, over_start = straight_up(q_to, height), straight_up(q_from, height)
        if over_goal is not None:
            yield [over_goal[-1]]
            if over_start is not None:
                yield [over_start[-1], over_goal[-1]]


def straight_joints(q_from: Float[np.ndarray, "7"], q_to: Float[np.ndarray, "7"]) -> Float[np.ndarray, "_ 7"]:
    """Evenly spaced joint angles from q_from to q_to, no joint moving more than 0.03 rad from row to row.

    >>> straight_joints(np.zeros(7), np.full(7, 0.05))[:, 0]
    array([0.   , 0.025, 0.05 ])
    """
    steps = int(np.ceil(np.abs(q_to - q_from).max() / JOINT_STEP)) + 1
    return np.linspace(q_from, q_to, max(steps, 2))


def trajectory(
    path: Float[np.ndarray, "N 7"], time_step: float, line_speed: float = np.inf
) -> Float[np.ndarray, "K 7"]:
    """Joint angles (rad) after each time step along a path, from rest to rest.

    Speed grows evenly, stays, and falls evenly, so that no joint exceeds 0.8 of its velocity limit and the grasp point
    stays below line_speed, m/s.

    >>> q = trajectory(np.array([np.zeros(7), np.ones(7)]), 1 / 240)
    >>> bool(np.diff(q, axis=0).max() * 240 <= 0.8 * 2.175)
    True
    """
    position = forward_kinematics(path)[:, :3, 3]
    at_joint_limit = (np.abs(np.diff(path, axis=0)) / (SPEED_SHARE * MAX_VELOCITY)).max(axis=1)
    at_line_speed = np.linalg.norm(np.diff(position, axis=0), axis=1) / line_speed
    # When each row would be reached if all went at full speed; the ramps then stretch this clock.
    clock = np.concatenate([[0.0], np.cumsum(np.maximum(at_joint_limit, at_line_speed))])
    seconds = clock[-1] + RAMP if clock[-1] > RAMP else 2.0 * np.sqrt(clock[-1] * RAMP)
    t = time_step * np.arange(1, int(np.ceil(seconds / time_step)) + 1)
    speed = np.clip(np.minimum(t, seconds - t + time_step) / RAMP, 0.0, 1.0)
    now = np.cumsum(speed) * clock[-1] / speed.sum()
    return np.stack([np.interp(now, clock, joint) for joint in path.T], axis=1)
