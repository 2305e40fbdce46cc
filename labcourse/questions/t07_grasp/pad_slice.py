"""07_grasp.pad_slice: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labcourse.kinds import array, poses, rotation
from labcourse.questions.t07_grasp import (
    ANY_ORDER,
    FACING_X,
    FROM_BELOW,
    LAST_ROW,
    LENGTH,
    MOST_OF_ONE,
    PLACES,
    TURNED,
    WITHIN,
    across,
    axes_of_yaw,
    cloud,
    quarter_turns,
    transform,
)
from labgrader.question import Question, wrong


def pad_slice(P, T_base_grasp, half):
    """Give the middle and the width, along y of the grasp frame, of the points within half of the pads' middle."""
    x, y, _ = ((P - T_base_grasp[:3, 3]) @ T_base_grasp[:3, :3]).T
    touched = y[np.abs(x) <= half]
    if len(touched) == 0:
        return 0.0, 0.0
    return (touched.min() + touched.max()) / 2, touched.max() - touched.min()


def _cloud_and_grasp(rng):
    """Draw points and a hand that comes from anywhere; nothing, one point or several lie between its pads."""
    if rng.random() < 0.3:  # multiples of an eighth, so that points lie on the pads' edges
        T = transform(quarter_turns(rng), rng.integers(-16, 17, 3) / 8.0)
        return rng.integers(-3, 4, (12, 3)) / 8.0 + T[:3, 3], T, float(rng.choice([0.125, 0.25]))
    P = cloud(rng)
    P -= P.mean(axis=0)  # near the base's origin: whoever forgets the grasp's place still meets some points
    T = transform(rotation(rng), rng.choice([-1.0, 1.0], 3) * rng.uniform(0.005, 0.02, 3))
    T[:3, 3] += rng.choice([0.0, 0.1]) * T[:3, 1]  # in some cases all of it lies on one side
    x, y, _ = ((P - T[:3, 3]) @ T[:3, :3]).T
    nearest = np.sort(np.abs(x))
    kind = rng.random()
    if kind < 0.3:  # nothing between the pads
        return P, T, float(nearest[0] / 2.0)
    if kind < 0.6:  # one point
        return P, T, float(nearest[:2].mean())
    half = np.abs(x)[np.abs(y).argsort()[2]] + 0.003  # three points at least, but seldom the outermost
    return P, T, float(half)


def _far_along_y(rng):
    """Draw a hand, and points that are more than 10 m away from it along y, one way or the other."""
    R, P = rotation(rng), cloud(rng)
    origin = across(rng, R[:, 1]) * rng.choice([-1.0, 1.0])
    return P - P.mean(axis=0) - origin, transform(R, origin), float(rng.uniform(0.02, 0.05))


# In the frame FACING_X, whose y is the base's x and whose x is the base's y: an L.
_L = np.array([[1.5, 1.0, 0.5], [2.25, 1.125, 0.5], [1.75, 0.5, 0.5], [5.0, 1.5, 0.5], [2.5, 0.75, 0.0]])
_MANY = np.vstack([np.resize(_L, (MOST_OF_ONE - 2, 3)), [[0.5, 1.0, 0.5], [4.25, 1.0, 0.5]]])


QUESTION = Question(
    reference=pad_slice,
    kinds={
        "P": array(
            "N 3", **PLACES, lengths={"N": (1, MOST_OF_ONE)}, says=("N from 1 to 10,000", WITHIN), free=ANY_ORDER
        ),
        "T_base_grasp": poses(free=(LAST_ROW, "* at ??, 2]")),  # nor on what is along the approach
        "half": LENGTH,
    },
    inputs=(_cloud_and_grasp, _cloud_and_grasp, _far_along_y),
    by_hand=(
        (_L, FACING_X, 0.25),  # the point at the edge of the pads counts
        (_L, FACING_X, 0.125),
        (_L, FACING_X, 0.5),
        (_L[:1], FACING_X, 0.25),
        (np.array([[3.0, 1.0, 0.5], [5.0, 1.0, 0.5], [2.0, 5.0, 0.5]]), FACING_X, 0.25),  # all on one side
        (_L[3:4], FACING_X, 0.25),  # nothing between the pads
        (np.array([[-0.2, 0.4, -0.7], [-0.5, 0.55, -1.3], [-0.4, 0.05, -1.2]]), FROM_BELOW, 0.25),  # x: 0.2, 0.3, 0
        (np.array([[0.2, -0.4, 1.3], [0.5, -0.55, 0.7], [0.4, -0.05, 0.8]]), TURNED, 0.25),
        (np.array([[0.0, -1.0, 0.0], [0.1, 3.0, 0.0], [0.9, 7.0, 0.0]]), np.diag([-1.0, 1.0, -1.0, 1.0]), 0.5),
        (
            np.array([[1.5, 1.0, 0.5], [2.25, 1.125, 0.0], [1.0, 1.0005, 0.5]]),
            FACING_X,
            0.0,
        ),  # what lies in the middle is touched
        (np.array([[9.25, 1.95, 0.5], [-9.25, 1.0, 0.5], [0.0, 5.0, 0.5]]), FACING_X, 1.0),  # the largest numbers
        (
            np.array([[1.5, 1.123418, 0.5], [2.0, 1.0, 0.5], [2.5, 1.123422, 0.5]]),
            FACING_X,
            0.12342,
        ),  # few digits do not hold these
        (_MANY, FACING_X, 0.25),  # the last two are the outermost
    ),
    edges=7,
    random_cases=14,
    points=4,
    forbidden=("scipy", "cv2"),
    outputs=("middle", "width"),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def in_grasp(P, T):
    return ((P - T[:3, 3]) @ T[:3, :3]).T


def middle_and_width(y):
    return ((y.min() + y.max()) / 2, np.ptp(y)) if len(y) else (0.0, 0.0)


@wrong("What lies beside the pads touches nothing: which of the points lie between them?")
def whole_cloud(P, T_base_grasp, half):
    return middle_and_width(in_grasp(P, T_base_grasp)[1])


@wrong("A median is pulled towards the side with more points; the jaws meet the two outermost ones.")
def median_for_the_middle(P, T_base_grasp, half):
    x, y, _ = in_grasp(P, T_base_grasp)
    y = y[np.abs(x) <= half]
    return (np.median(y), np.ptp(y)) if len(y) else (0.0, 0.0)


@wrong("A mean is pulled towards the side with more points; the jaws meet the two outermost ones.")
def mean_for_the_middle(P, T_base_grasp, half):
    x, y, _ = in_grasp(P, T_base_grasp)
    y = y[np.abs(x) <= half]
    return (y.mean(), np.ptp(y)) if len(y) else (0.0, 0.0)


@wrong("The jaws close along y of the grasp frame, and the pads are wide along x.")
def x_for_y(P, T_base_grasp, half):
    x, y, _ = in_grasp(P, T_base_grasp)
    return middle_and_width(x[np.abs(y) <= half])


@wrong("A pad is wide along x, and says nothing of z: which points beside its middle do you leave out?")
def within_half_of_the_closing_axis(P, T_base_grasp, half):
    x, y, z = in_grasp(P, T_base_grasp)
    return middle_and_width(y[np.hypot(x, z) <= half])


@wrong("Your extremes begin at 0, as if a point lay there: of which points alone are they to be?")
def extremes_that_begin_at_0(P, T_base_grasp, half):
    x, y, _ = in_grasp(P, T_base_grasp)
    y = y[np.abs(x) <= half]
    return middle_and_width(np.append(y, 0.0))


@wrong("P has no order: need the first and the last of the points between the pads be the outermost?")
def first_and_last(P, T_base_grasp, half):
    x, y, _ = in_grasp(P, T_base_grasp)
    return middle_and_width(y[np.abs(x) <= half][[0, -1]]) if (np.abs(x) <= half).any() else (0.0, 0.0)


@wrong("The hand may lean: the points and its axes have three components each, and you drop the third.")
def seen_from_above(P, T_base_grasp, half):
    x, y = ((P - T_base_grasp[:3, 3])[:, :2] @ T_base_grasp[:2, :2]).T
    return middle_and_width(y[np.abs(x) <= half])


@wrong("Cut the points in the grasp frame: does a pad know where the base's axes point?")
def cut_in_the_base_frame(P, T_base_grasp, half):
    x, y, _ = (P - T_base_grasp[:3, 3]).T
    return middle_and_width(y[np.abs(x) <= half])


@wrong("A pad extends half its width to either side of the middle.")
def one_side_of_the_pad(P, T_base_grasp, half):
    x, y, _ = in_grasp(P, T_base_grasp)
    return middle_and_width(y[(x >= 0.0) & (x <= half)])


@wrong("A single point between the pads is a slice, too: its middle is that point and its width is 0.")
def one_point_is_nothing(P, T_base_grasp, half):
    middle, width = pad_slice(P, T_base_grasp, half)
    return (middle if width > 0.0 else 0.0), width


@wrong("Half of the width is a length, not a place: what is the mean of the outermost two?")
def half_of_the_width(P, T_base_grasp, half):
    width = pad_slice(P, T_base_grasp, half)[1]
    return width / 2, width


@wrong("The position is a point of the base frame: subtract it before you rotate, not after.")
def position_taken_off_after_the_turn(P, T_base_grasp, half):
    x, y, _ = (P @ T_base_grasp[:3, :3] - T_base_grasp[:3, 3]).T
    return middle_and_width(y[np.abs(x) <= half])


@wrong("You set y to 0 outside the pads: may a point that is not in the slice be one of the outermost?")
def zero_beside_the_pads(P, T_base_grasp, half):
    x, y, _ = in_grasp(P, T_base_grasp)
    return middle_and_width(y * (np.abs(x) <= half))


@wrong("Your middle is a y of the base frame. In which frame do the jaws close along y?")
def middle_in_the_base_frame(P, T_base_grasp, half):
    between = np.abs(in_grasp(P, T_base_grasp)[0]) <= half
    return middle_and_width(P[between, 1])[0], pad_slice(P, T_base_grasp, half)[1]


@wrong("Twice the largest |y|: is the thing as wide on one side of the middle of the jaws as on the other?")
def twice_the_larger_side(P, T_base_grasp, half):
    x, y, _ = in_grasp(P, T_base_grasp)
    y = y[np.abs(x) <= half]
    return middle_and_width(y)[0], 2.0 * np.abs(y).max(initial=0.0)


@wrong("The pads are wide along x: which coordinate says whether a point lies between them?")
def cut_along_y(P, T_base_grasp, half):
    _, y, _ = in_grasp(P, T_base_grasp)
    return middle_and_width(y[np.abs(y) <= half])


@wrong("The points are in the base frame: which transform takes base coordinates to the grasp frame?")
def transform_not_inverted(P, T_base_grasp, half):
    x, y, _ = (P @ T_base_grasp[:3, :3].T + T_base_grasp[:3, 3]).T
    return middle_and_width(y[np.abs(x) <= half])


@wrong("You rotate the points: where is the origin of the grasp frame, and where is yours?")
def position_not_taken_off(P, T_base_grasp, half):
    x, y, _ = (P @ T_base_grasp[:3, :3]).T
    return middle_and_width(y[np.abs(x) <= half])


@wrong("The hand may lean: an axis has three components, and a yaw knows two. Which column of T is the axis?")
def axes_of_a_yaw(P, T_base_grasp, half):
    y, x = ((P - T_base_grasp[:3, 3])[:, :2] @ axis for axis in axes_of_yaw(T_base_grasp))
    return middle_and_width(y[np.abs(x) <= half])


@wrong("A point at the very edge of a pad is touched, too: is x < half true of it?")
def edges_left_out(P, T_base_grasp, half):
    x, y, _ = in_grasp(P, T_base_grasp)
    return middle_and_width(y[np.abs(x) < half])


@wrong("x has two signs: what does x <= half say about a point far away on the negative side?")
def one_edge_alone(P, T_base_grasp, half):
    x, y, _ = in_grasp(P, T_base_grasp)
    return middle_and_width(y[x <= half])


@wrong("The hand may lean: its pads need not be level. Which number of the x axis is left out?", by_yaw=(False, True))
def pads_taken_as_level(P, T_base_grasp, half, by_yaw):
    _, y, _ = in_grasp(P, T_base_grasp)
    pads = axes_of_yaw(T_base_grasp)[1] if by_yaw else T_base_grasp[:2, 0]
    return middle_and_width(y[np.abs((P - T_base_grasp[:3, 3])[:, :2] @ pads) <= half])
