"""The Panda's kinematics in NumPy: where the links are for given joints, and which joints put the hand on a grasp.

Frames: the base frame is link 0's and the world's. The grasp frame (the URDF's panda_grasptarget) lies between the
pads: z is the approach direction, the jaws close along y, x runs along the pads (topic 07). Metres and radians.
Nothing here imports PyBullet.
"""

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import RigidTransform, Rotation

PANDA_URDF = "franka_panda/panda.urdf"  # within pybullet_data

# Seven arm joints (rad), then two finger joints (m): folded back over the base, the hand pointing down, fingers open.
# From the front or the sides nothing of the arm stands between a camera and the workspace (x >= 0.35 m).
HOME = (0.0, -1.5, 0.0, -2.7, 0.0, 1.2, 0.7853981633974483, 0.04, 0.04)

# The URDF's numbers. Joints keep within its soft limits, which lie a little inside the hard ones.
LOWER = np.array([-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973])
UPPER = np.array([2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973])
MAX_VELOCITY = np.array([2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61])  # rad/s
MAX_EFFORT = np.array([87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0])  # N m
FINGER_MAX = 0.04  # m, how far each finger opens from the middle
FINGER_MAX_VELOCITY = 0.2  # m/s
FINGER_MAX_EFFORT = 20.0  # N, each finger

# One entry per joint, in the order of Craig's convention: turn about x by alpha, shift along x by a, turn about z by
# the joint angle, shift along z by d.
ALPHA = np.pi / 2 * np.array([0, -1, 1, 1, -1, 1, 1])
A = np.array([0.0, 0.0, 0.0, 0.0825, -0.0825, 0.0, 0.088])
D = np.array([0.333, 0.0, 0.316, 0.0, 0.384, 0.0, 0.0])
FLANGE = 0.107  # from joint 7 to the hand, along z; the hand is turned by -45 degrees about it
HAND_TO_FINGERS = 0.0584
HAND_TO_GRASP = 0.105
T_LINK7_HAND = RigidTransform.from_components((0, 0, FLANGE), Rotation.from_euler("z", -np.pi / 4)).as_matrix()
T_HAND_GRASP = RigidTransform.from_translation((0, 0, HAND_TO_GRASP)).as_matrix()

POSITION_TOLERANCE = 1e-4  # m
ANGLE_TOLERANCE = 1e-3  # rad


def link_frames(q: Float[np.ndarray, "*batch 7"]) -> Float[np.ndarray, "*batch 9 4 4"]:
    """Frames of link 0 to link 7 and of the hand in the base frame, T_base_link, for joint angles q in rad.

    >>> link_frames(np.array(HOME[:7]))[8, :3, 3].round(3)
    array([0.107, 0.   , 0.547])
    """
    q = np.asarray(q, dtype=np.float64)
    ca, sa = np.round(np.cos(ALPHA)), np.round(np.sin(ALPHA))  # alpha is a multiple of 90 degrees
    c, s, o = np.cos(q), np.sin(q), np.zeros_like(q)
    T_prev_link = np.array([[     c,      -s,       o,       o + A],
                            [s * ca,  c * ca,  o - sa,  o - sa * D],
                            [s * sa,  c * sa,  o + ca,  o + ca * D],
                            [     o,       o,       o,       o + 1]])  # fmt: skip
    T_prev_link = np.moveaxis(T_prev_link, (0, 1), (-2, -1))
    frames = np.empty((*q.shape[:-1], 9, 4, 4))
    frames[..., 0, :, :] = np.eye(4)
    for i in range(7):
        frames[..., i + 1, :, :] = frames[..., i, :, :] @ T_prev_link[..., i, :, :]
    frames[..., 8, :, :] = frames[..., 7, :, :] @ T_LINK7_HAND
    return frames


def forward_kinematics(q: Float[np.ndarray, "*batch 7"]) -> Float[np.ndarray, "*batch 4 4"]:
    """The grasp frame in the base frame, T_base_grasp, for joint angles q in rad.

    >>> forward_kinematics(np.array(HOME[:7]))[:3, 3].round(3)
    array([0.107, 0.   , 0.442])
    """
    return link_frames(q)[..., 8, :, :] @ T_HAND_GRASP


def jacobian(frames: Float[np.ndarray, "*batch 9 4 4"]) -> Float[np.ndarray, "*batch 6 7"]:
    """How the grasp frame moves with each joint: metres, then radians about the base axes, per radian.

    A turning joint moves the grasp point by (its axis) x (the lever from the joint to the point).

    >>> jacobian(link_frames(np.array(HOME[:7])))[:, 0].round(3)
    array([0.   , 0.107, 0.   , 0.   , 0.   , 1.   ])
    """
    axes = frames[..., 1:8, :3, 2]
    p = (frames[..., 8, :, :] @ T_HAND_GRASP)[..., :3, 3]
    levers = p[..., None, :] - frames[..., 1:8, :3, 3]
    return np.concatenate([np.cross(axes, levers), axes], axis=-1).swapaxes(-1, -2)


def top_down_joints(T_base_grasp: Float[np.ndarray, "4 4"]) -> Float[np.ndarray, "7"]:
    """Joints for a grasp from straight above, in closed form: joints 3 and 5 stay 0, so the arm bends in one plane.

    Joint 1 turns that plane to the grasp; in it, shoulder, elbow and wrist are a triangle with two known sides (law of
    cosines); joint 6 makes the hand point down and joint 7 sets the yaw. A point out of reach gets the stretched arm, a
    tilted grasp a near miss: the caller checks by forward kinematics.
    """
    x, y, z = T_base_grasp[:3, 3]
    q1 = np.arctan2(y, x)
    shoulder_to_wrist = np.array([np.hypot(x, y) - A[6], z + FLANGE + HAND_TO_GRASP - D[0]])
    upper, lower = np.hypot(D[2], A[3]), np.hypot(D[4], A[3])
    beta_upper, beta_lower = np.arctan2(A[3], D[2]), np.arctan2(A[3], D[4])
    reach = np.clip(np.hypot(*shoulder_to_wrist), 1e-6, upper + lower)
    at_elbow = np.arccos(np.clip((upper**2 + lower**2 - reach**2) / (2 * upper * lower), -1.0, 1.0))
    at_shoulder = np.arccos(np.clip((upper**2 + reach**2 - lower**2) / (2 * upper * reach), -1.0, 1.0))
    q2 = np.arctan2(*shoulder_to_wrist) - at_shoulder - beta_upper
    q4 = at_elbow - np.pi - beta_upper - beta_lower
    q7 = np.pi / 4 + q1 - np.arctan2(T_base_grasp[1, 0], T_base_grasp[0, 0])
    return np.array([q1, q2, 0.0, q4, 0.0, q2 - q4, (q7 + np.pi) % (2 * np.pi) - np.pi])


def inverse_kinematics(
    T_base_grasp: Float[np.ndarray, "4 4"], q0: Float[np.ndarray, "7"] | None = None
) -> Float[np.ndarray, "7"] | None:
    """Joint angles within the limits that put the grasp frame at T_base_grasp to 0.1 mm and 0.001 rad, or None.

    Damped least squares from several starts: first q0 (the way to stay near it) and the closed form for a grasp from
    above, then random ones, always the same. `plan_grasp` checks what comes here.

    >>> T = forward_kinematics(np.array([0.1, 0.2, 0.3, -2.0, 0.1, 2.0, 0.5]))
    >>> np.allclose(forward_kinematics(inverse_kinematics(T)), T, atol=1e-3)
    True
    """
    if _wrist_out_of_reach(T_base_grasp):
        return None
    first = [q for q in (q0, top_down_joints(T_base_grasp)) if q is not None]
    q = _damped_least_squares(T_base_grasp, np.array(first))
    if q is None:
        q = _damped_least_squares(T_base_grasp, np.random.default_rng(0).uniform(LOWER, UPPER, (24, 7)))
    return q


def _wrist_out_of_reach(T_base_grasp) -> bool:
    """Whether joint 6, wherever joint 7 turns it on its circle about the hand's axis, is too far from the shoulder."""
    circle = (T_base_grasp @ np.array([0.0, 0.0, -FLANGE - HAND_TO_GRASP, 1.0]))[:3] - (0.0, 0.0, D[0])
    return bool(np.linalg.norm(circle) > np.hypot(D[2], A[3]) + np.hypot(D[4], A[3]) + A[6])


def _damped_least_squares(T, q: Float[np.ndarray, "starts 7"], iterations: int = 60) -> Float[np.ndarray, "7"] | None:
    """Improve all starts together until the first of them arrives; None if none does.

    Each step solves min |J dq - e|^2 + damping |dq|^2: with a large error e the damping keeps steps short near singular
    postures, with a small one it fades and the iteration becomes Newton's.
    """
    q = np.clip(q, LOWER, UPPER)
    for _ in range(iterations):
        frames = link_frames(q)
        here = frames[:, 8] @ T_HAND_GRASP
        shift = T[:3, 3] - here[:, :3, 3]
        turn = Rotation.from_matrix(T[:3, :3] @ here[:, :3, :3].swapaxes(1, 2)).as_rotvec()
        arrived = (np.linalg.norm(shift, axis=1) < POSITION_TOLERANCE) & (
            np.linalg.norm(turn, axis=1) < ANGLE_TOLERANCE
        )
        if arrived.any():
            return q[arrived.argmax()]
        e = np.concatenate([shift, turn], axis=1)[..., None]
        J = jacobian(frames)
        damping = 0.01 * (e * e).sum(axis=1, keepdims=True) + 1e-6
        dq = J.swapaxes(1, 2) @ np.linalg.solve(J @ J.swapaxes(1, 2) + damping * np.eye(6), e)
        q = np.clip(q + np.clip(dq[..., 0], -0.5, 0.5), LOWER, UPPER)
    return None
