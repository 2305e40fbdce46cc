"""07_grasp.grasp_pose: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.questions.question import Property, Question, wrong


def grasp_pose(position, yaw):
    """Build T_base_grasp: z down, y where the jaws close (at the angle yaw from the base's x), x = y cross z."""
    c, s = np.cos(yaw), np.sin(yaw)
    x, y, z = position
    return np.array([[-s, c, 0.0, x], [c, s, 0.0, y], [0.0, 0.0, -1.0, z], [0.0, 0.0, 0.0, 1.0]])


def _same_for_both_ways(T):
    """The jaws are alike: x and y may both be negated, and this stays."""
    return np.outer(T[:3, 0], T[:3, 1]), np.outer(T[:3, 1], T[:3, 1]), T[:, 2:], T[3]


QUESTION = Question(
    name="07_grasp.grasp_pose",
    reference=grasp_pose,
    inputs=lambda rng: (
        rng.uniform([0.4, -0.3, 0.01], [0.6, 0.3, 0.1]),
        float(rng.uniform(0.2, 1.4) + rng.choice([0.0, np.pi / 2])),
    ),
    by_hand=((np.array([0.5, -0.25, 0.125]), 0.0), (np.array([0.5, 0.25, 0.0]), np.pi / 2)),
    atol=1e-5,
    points=3,
    properties=(
        Property("the last row is 0 0 0 1", lambda arguments, T: np.allclose(T[3], (0.0, 0.0, 0.0, 1.0))),
        Property(
            "the three axes are at right angles and of length 1",
            lambda arguments, T: np.allclose(T[:3, :3].T @ T[:3, :3], np.eye(3), atol=1e-4),
        ),
        Property(
            "the frame is right-handed: its determinant is 1", lambda arguments, T: np.linalg.det(T[:3, :3]) > 0.0
        ),
        Property("the hand looks down", lambda arguments, T: T[2, 2] < -0.99),
    ),
    canonical=_same_for_both_ways,
    forbidden=("scipy",),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def pose(x, y, z, origin):
    T = np.eye(4)
    T[:3] = np.column_stack([x, y, z, origin])
    return T


def unit(yaw):
    return np.array([np.cos(yaw), np.sin(yaw), 0.0])


DOWN = np.array([0.0, 0.0, -1.0])


@wrong(
    QUESTION, "Your determinant is -1, a mirror image that no hand can take: in which order does the cross product go?"
)
def left_handed_pose(position, yaw):
    return pose(np.cross(DOWN, unit(yaw)), unit(yaw), DOWN, position)


@wrong(QUESTION, "The approach axis points where the hand moves to: down, towards the table.")
def approach_from_below(position, yaw):
    return pose(np.cross(unit(yaw), -DOWN), unit(yaw), -DOWN, position)


@wrong(QUESTION, "Right at 0 and 90 degrees, mirrored between: what is the closing direction at 45 degrees?")
def yaw_the_other_way(position, yaw):
    return grasp_pose(position, -yaw)
