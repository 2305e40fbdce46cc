"""Questions of lab 07 about the hand: how low it goes, its frame, and what stands in its fingers' way."""

import numpy as np

from labkit.course.questions import answers_07_hand as answers
from labkit.course.questions.question import Misconception, Property, Question


def cloud(rng):
    """Draw a cloud of few points somewhere on a table: long, less wide, in some cases high, turned by any yaw."""
    count = int(rng.integers(7, 40))
    long, wide, high = rng.uniform(0.05, 0.07), rng.uniform(0.015, 0.03), rng.choice([0.008, 0.04, 0.1])
    yaw, lean = rng.uniform(0.0, np.pi), rng.uniform(-0.3, 0.3)
    x, y, z = rng.uniform(-1.0, 1.0, (count, 3)).T * np.array([[long], [wide], [high]])
    z = z + lean * x
    x, y = x * np.cos(yaw) - y * np.sin(yaw), x * np.sin(yaw) + y * np.cos(yaw)
    return np.stack([x, y, z], axis=1) + rng.uniform([0.4, -0.3, 0.05], [0.6, 0.3, 0.2])


# ------------------------------------------------------------------------------------------------ the grasp's height


def grasp_height(P, table_z, palm, tips, clearance):
    """Put the grasp as low as table and palm let it, and no lower than what was seen of the object."""
    lowest_tips = max(P[:, 2].max() - palm, P[:, 2].min(), table_z + clearance)
    return lowest_tips + tips


def _heights(rng):
    """Draw a cloud of which each of the three bounds is sometimes the one that counts."""
    P, kind = cloud(rng), rng.integers(3)
    table_z = float(P[:, 2].min() - rng.uniform(0.01, 0.03)) if kind else float(P[:, 2].min() + 0.002)
    high = np.ptp(P[:, 2])
    palm = float(high * (0.6 if kind == 1 else 1.5))
    return P, table_z, palm, float(rng.uniform(0.005, 0.012)), float(rng.uniform(0.003, 0.008))


def _upright(low, high):
    return np.array([[0.5, 0.1, low], [0.5, 0.1, high], [0.52, 0.1, 0.5 * (low + high)]])


GRASP_HEIGHT = Question(
    name="07_grasp.grasp_height",
    reference=grasp_height,
    inputs=_heights,
    by_hand=(
        (_upright(0.125, 0.5), 0.125, 0.25, 0.0625, 0.03125),  # a tall thing: the palm stops at its top
        (_upright(0.125, 0.1875), 0.125, 0.25, 0.0625, 0.03125),  # a flat one: the tips stay off the table
        (_upright(0.375, 0.5), 0.125, 0.25, 0.0625, 0.03125),  # only its upper part was seen
        (_upright(-0.5, -0.25), -0.5, 0.5, 0.0625, 0.03125),  # a table below the robot's base
    ),
    random_cases=8,
    atol=1e-5,
    points=2,
    properties=(
        Property(
            "the tips keep off the table",
            lambda arguments, z: z - arguments[3] >= arguments[1] + arguments[4] - 1e-5,
        ),
        Property(
            "the palm stays above the top of the object",
            lambda arguments, z: z - arguments[3] + arguments[2] >= arguments[0][:, 2].max() - 1e-5,
        ),
    ),
    misconceptions=(
        Misconception(
            "the centroid's height",
            answers.height_of_centroid,
            "The centroid does not know the table nor the palm: how low may the tips go, and who stops them?",
        ),
        Misconception(
            "the tips' height",
            answers.height_of_tips,
            "You give the height of the tips; the grasp's origin is the point between the pads, above them.",
        ),
        Misconception(
            "tips taken off",
            answers.tips_taken_off,
            "The tips are the lowest thing of the hand: does the grasp's origin lie above or below them?",
        ),
        Misconception(
            "the table at zero",
            answers.table_at_zero,
            "The base frame's origin is the robot's foot; the table has a height of its own.",
        ),
        Misconception(
            "no palm",
            answers.palm_forgotten,
            "A bottle is taller than the fingers are long: what does its top meet?",
        ),
        Misconception(
            "below what was seen",
            answers.unseen_depth,
            "Only the upper part was seen, and you reach below it: nobody knows what is there.",
        ),
        Misconception(
            "the least of the bounds",
            answers.least_of_the_bounds,
            "Each bound says: not lower than this. Which of them satisfies all?",
        ),
        Misconception(
            "no air over the table",
            answers.clearance_forgotten,
            "Your tips touch the table: what is `clearance` for?",
        ),
    ),
    alternatives=(answers.height_with, answers.height_loops, answers.height_torch, answers.height_float32),
)


# ---------------------------------------------------------------------------------------------------- the grasp frame


def grasp_pose(position, yaw):
    """Build T_base_grasp: z down, y where the jaws close (at the angle yaw from the base's x), x = y cross z."""
    c, s = np.cos(yaw), np.sin(yaw)
    x, y, z = position
    return np.array([[-s, c, 0.0, x], [c, s, 0.0, y], [0.0, 0.0, -1.0, z], [0.0, 0.0, 0.0, 1.0]])


def _same_for_both_ways(T):
    """The jaws are alike: x and y may both be negated, and this stays."""
    return np.outer(T[:3, 0], T[:3, 1]), np.outer(T[:3, 1], T[:3, 1]), T[:, 2:], T[3]


GRASP_POSE = Question(
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
    misconceptions=(
        Misconception(
            "left-handed",
            answers.left_handed_pose,
            "Your determinant is -1, a mirror image that no hand can take: in which order does the cross product go?",
        ),
        Misconception(
            "approach from below",
            answers.approach_from_below,
            "The approach axis points where the hand moves to: down, towards the table.",
        ),
        Misconception(
            "closing along x",
            answers.closing_along_x,
            "The jaws close along the frame's y axis; you put the direction into x.",
        ),
        Misconception(
            "yaw the other way",
            answers.yaw_the_other_way,
            "Right at 0 and 90 degrees, mirrored between: what is the closing direction at 45 degrees?",
        ),
        Misconception("degrees", answers.yaw_as_degrees, "The yaw comes in radians already."),
        Misconception(
            "position in the last row",
            answers.position_in_the_last_row,
            "Is your last row 0 0 0 1? The position is the last column.",
        ),
    ),
    alternatives=(
        answers.grasp_pose_cross,
        answers.grasp_pose_other_way_round,
        answers.grasp_pose_product,
        answers.grasp_pose_loops,
        answers.grasp_pose_torch,
        answers.grasp_pose_float32,
    ),
    canonical=_same_for_both_ways,
    forbidden=("scipy",),
)


# ---------------------------------------------------------------------------------------- points where the fingers go


def points_in_fingers(P, T_base_grasp, width, half, thickness, tips):
    """Count the points of the base frame that lie where the two open fingers would be."""
    x, y, z = ((P - T_base_grasp[:3, 3]) @ T_base_grasp[:3, :3]).T
    out = np.abs(y) - width / 2
    return int(np.count_nonzero((np.abs(x) <= half) & (out >= 0.0) & (out <= thickness) & (z <= tips)))


def _scene_round_a_grasp(rng):
    """Draw a grasp that leans, and points all round it, with more on one side than on the other."""
    T = grasp_pose(rng.uniform([0.4, -0.3, 0.02], [0.6, 0.3, 0.1]), float(rng.uniform(0.2, 1.3)))
    lean = rng.uniform(0.3, 0.6)
    c, s = np.cos(lean), np.sin(lean)
    T[:3, :3] = T[:3, :3] @ np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    in_grasp = rng.uniform([-0.02, -0.06, -0.05], [0.02, 0.08, 0.03], (400, 3))
    P = in_grasp @ T[:3, :3].T + T[:3, 3]
    width, half = float(rng.uniform(0.03, 0.05)), float(rng.uniform(0.009, 0.012))
    return P, T, width, half, float(rng.uniform(0.013, 0.02)), float(rng.uniform(0.005, 0.012))


_FACING_X = np.array([[0.0, 1.0, 0.0, 2.0], [1.0, 0.0, 0.0, 1.0], [0.0, 0.0, -1.0, 0.5], [0.0, 0.0, 0.0, 1.0]])
# Beside the jaws along the base's x: at the pad and a finger's thickness outside it (both count), just inside the pad,
# beyond the finger, beside it, below the tips, at the tips (counts), high above (counts), and in the other finger.
_ROUND_IT = np.array(
    [
        [2.5, 1.0, 0.5],
        [2.75, 1.0, 0.5],
        [2.25, 1.0, 0.5],
        [3.0, 1.0, 0.5],
        [2.625, 1.5, 0.5],
        [2.625, 1.0, 0.125],
        [2.625, 1.0, 0.25],
        [2.625, 1.25, 1.5],
        [1.375, 0.75, 0.5],
    ]
)

POINTS_IN_FINGERS = Question(
    name="07_grasp.points_in_fingers",
    reference=points_in_fingers,
    inputs=_scene_round_a_grasp,
    by_hand=(
        (_ROUND_IT, _FACING_X, 1.0, 0.25, 0.25, 0.25),
        (_ROUND_IT[:1], _FACING_X, 1.0, 0.25, 0.25, 0.25),
        (_ROUND_IT[2:6], _FACING_X, 1.0, 0.25, 0.25, 0.25),
        (np.zeros((0, 3)), _FACING_X, 1.0, 0.25, 0.25, 0.25),
    ),
    random_cases=5,
    points=3,
    properties=(
        Property(
            "there are not more points in the fingers than there are points",
            lambda arguments, count: 0 <= count <= len(arguments[0]),
        ),
    ),
    misconceptions=(
        Misconception(
            "T_base_grasp not inverted",
            answers.transform_not_inverted,
            "The points are in the base frame: which transform takes base coordinates to the grasp frame?",
        ),
        Misconception(
            "not turned",
            answers.translated_only,
            "You moved the points but did not turn them: the fingers stand at a yaw.",
        ),
        Misconception(
            "points below the tips",
            answers.below_the_tips_too,
            "What lies lower than the tips is in nobody's way. The frame's z points down.",
        ),
        Misconception(
            "z taken for upwards",
            answers.below_the_tips_alone,
            "You count what is under the tips: the grasp frame's z points down, so above is smaller z.",
        ),
        Misconception("one finger", answers.one_finger, "There are two fingers, at y and at -y."),
        Misconception(
            "the object counted too",
            answers.between_the_pads_too,
            "What stands between the pads is what you want to hold: it is not in the way.",
        ),
        Misconception(
            "the whole width on each side",
            answers.pads_at_the_whole_width,
            "`width` is from pad to pad: how far is a pad from the middle?",
        ),
        Misconception(
            "x taken for the closing axis",
            answers.closing_axis_taken_for_x,
            "The jaws close along the frame's y; along x they have the fingers' breadth.",
        ),
    ),
    alternatives=(answers.points_by_inverse, answers.points_loops, answers.points_einsum, answers.points_float32),
)
