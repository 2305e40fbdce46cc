"""07_grasp.slip_across: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labcourse.kinds import array, poses, rotation
from labcourse.questions.t07_grasp import FACING_X, FROM_BELOW, LAST_ROW, PLACES, TURNED, WITHIN, axes_of_yaw, transform
from labgrader.question import Question, wrong


def slip_across(T_base_grasp, middle):
    """Split the way from the grasp to a thing's middle, millimetres: what the jaws push, and what they leave."""
    off = T_base_grasp[:3, :3].T @ (middle - T_base_grasp[:3, 3])
    return 1000 * np.abs(off[1]), 1000 * np.abs(off[0])


def _grasp_and_middle(rng):
    """Draw a hand that comes from anywhere, and a middle that is off by unlike distances, either way."""
    R, origin = rotation(rng), rng.uniform(-1.0, 1.0, 3)
    off = rng.choice([-1.0, 1.0], 3) * rng.permutation(rng.uniform([0.001, 0.02, 0.2], [0.003, 0.04, 0.5]))
    return transform(R, origin), origin + R @ off


_LEANING = np.array([[0.0, 0.6, 0.8, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.8, -0.6, 0.0], [0.0, 0.0, 0.0, 1.0]])


QUESTION = Question(
    reference=slip_across,
    kinds={
        "T_base_grasp": poses(free=(LAST_ROW, "* at ??, 2]")),  # nor on what is along the approach
        "middle": array("3", **PLACES, says=WITHIN),
    },
    inputs=_grasp_and_middle,
    by_hand=(
        (FACING_X, np.array([2.0, 1.0, 0.4])),  # only the height is off
        (FACING_X, np.array([2.03, 1.02, 0.4])),
        (FACING_X, np.array([1.97, 0.98, 0.5])),
        (TURNED, np.array([0.56, -0.28, 1.06])),
        (transform(np.diag([-1.0, 1.0, -1.0]), [8.0, -9.0, 7.0]), np.array([0.0, 9.5, -9.5])),
        (FROM_BELOW, np.array([-0.47, 0.31, -1.06])),  # off by (0.03, 0.06, -0.06)
        (_LEANING, np.array([1.1, 0.0, 0.7])),  # no slip, which rounding must not make NaN
    ),
    edges=4,
    random_cases=6,
    atol=1e-4,
    forbidden=("scipy",),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


@wrong("Turn the hand by 90 degrees: which of the two errors do the jaws undo then? Which frame tells you?")
def in_the_base_frame(T_base_grasp, middle):
    off = 1000.0 * np.abs(middle - T_base_grasp[:3, 3])
    return off[1], off[0]


@wrong("Height is not slip: what is left is along the pads, the x axis of the grasp frame.")
def height_counted_too(T_base_grasp, middle):
    off = 1000.0 * T_base_grasp[:3, :3].T @ (middle - T_base_grasp[:3, 3])
    return np.abs(off[1]), np.hypot(off[0], off[2])


@wrong("You turned by R where R transposed is needed: from the base's axes to the hand's.")
def turned_the_wrong_way(T_base_grasp, middle):
    off = 1000.0 * np.abs(T_base_grasp[:3, :3] @ (middle - T_base_grasp[:3, 3]))
    return off[1], off[0]


@wrong("The hand may lean: the error and its axes have three components each, and you drop the third.")
def seen_from_above(T_base_grasp, middle):
    off = 1000.0 * np.abs((middle - T_base_grasp[:3, 3])[:2] @ T_base_grasp[:2, :2])
    return off[1], off[0]


@wrong("The hand may lean: its pads need not lie in the table's plane. What is left is along the pads.")
def left_in_the_tables_plane(T_base_grasp, middle):
    off = 1000.0 * (middle - T_base_grasp[:3, 3]) * (1.0, 1.0, 0.0)
    pushed = np.abs(off @ T_base_grasp[:3, 1])
    return pushed, np.sqrt(np.maximum(off @ off - pushed**2, 0.0))


@wrong("The jaws close along the base's x only in the example: which column of T gives the direction for any hand?")
def in_the_base_frame_of_the_example(T_base_grasp, middle):
    off = 1000.0 * np.abs(middle - T_base_grasp[:3, 3])
    return off[0], off[1]


@wrong("The position is a point of the base frame: subtract it before you rotate, not after.")
def position_taken_off_after_the_turn(T_base_grasp, middle):
    off = 1000.0 * np.abs(T_base_grasp[:3, :3].T @ middle - T_base_grasp[:3, 3])
    return off[1], off[0]


@wrong("Distances at right angles add as squares: the whole minus the pushed part is not the slip.")
def lengths_subtracted(T_base_grasp, middle):
    off = 1000.0 * (middle - T_base_grasp[:3, 3])
    pushed = np.abs(off @ T_base_grasp[:3, 1])
    return pushed, np.linalg.norm(off[:2]) - pushed


@wrong("The hand may lean: your slip is what is left over in the base's x and y, not along the hand's pads.")
def left_of_the_way_seen_from_above(T_base_grasp, middle):
    off = 1000.0 * (middle - T_base_grasp[:3, 3])
    pushed = np.abs(off @ T_base_grasp[:3, 1])
    return pushed, np.sqrt(np.maximum(off[0] ** 2 + off[1] ** 2 - pushed**2, 0.0))


@wrong("Your distances are 1000 times too small: the points are in metres, and which unit is asked for?")
def in_metres(T_base_grasp, middle):
    off = np.abs(T_base_grasp[:3, :3].T @ (middle - T_base_grasp[:3, 3]))
    return off[1], off[0]


@wrong("The jaws close along y of the grasp frame: that part is pushed, and it comes first.")
def exchanged(T_base_grasp, middle):
    off = 1000.0 * np.abs(T_base_grasp[:3, :3].T @ (middle - T_base_grasp[:3, 3]))
    return off[0], off[1]


@wrong("In which unit are the two asked for? And the jaws close along y: that part is pushed, and it comes first.")
def exchanged_in_metres(T_base_grasp, middle):
    off = np.abs(T_base_grasp[:3, :3].T @ (middle - T_base_grasp[:3, 3]))
    return off[0], off[1]


@wrong("A slip is a distance: what is yours if the middle lies on the other side of the hand?")
def with_signs(T_base_grasp, middle):
    off = 1000.0 * T_base_grasp[:3, :3].T @ (middle - T_base_grasp[:3, 3])
    return off[1], off[0]


@wrong("A part that points against the axis is not 0: how far off is a middle on the other side of the hand?")
def one_side_alone(T_base_grasp, middle):
    off = 1000.0 * T_base_grasp[:3, :3].T @ (middle - T_base_grasp[:3, 3])
    return np.maximum(off[1], 0.0), np.maximum(off[0], 0.0)


@wrong("The middle is a point of the base frame: where is it, seen from the grasp's origin?")
def middle_taken_as_it_is(T_base_grasp, middle):
    x, y = T_base_grasp[:3, 0], T_base_grasp[:3, 1]
    return 1000 * abs(middle @ y), 1000 * abs(middle @ x)


@wrong("The hand may lean: its pads need not be level. Which number of the x axis is left out?")
def pads_taken_as_level(T_base_grasp, middle):
    off = 1000.0 * (middle - T_base_grasp[:3, 3])
    return np.abs(off @ T_base_grasp[:3, 1]), np.abs(off[:2] @ T_base_grasp[:2, 0])


@wrong("The middle is a point of the base frame: which transform takes base coordinates to the grasp frame?")
def transform_not_inverted(T_base_grasp, middle):
    off = 1000.0 * np.abs(T_base_grasp[:3, :3] @ middle + T_base_grasp[:3, 3])
    return off[1], off[0]


@wrong("The hand may lean: an axis has three components, and a yaw knows two. Which column of T is the axis?")
def axes_of_a_yaw(T_base_grasp, middle):
    off = 1000.0 * (middle - T_base_grasp[:3, 3])
    pushed, left = (np.abs(off[:2] @ axis) for axis in axes_of_yaw(T_base_grasp))
    return pushed, left


@wrong("That is the whole distance: what is pushed, and what lies along the approach, do not slip.")
def the_whole_distance(T_base_grasp, middle):
    off = 1000.0 * (middle - T_base_grasp[:3, 3])
    return np.abs(off @ T_base_grasp[:3, 1]), np.linalg.norm(off)
