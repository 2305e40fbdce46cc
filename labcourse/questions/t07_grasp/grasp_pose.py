"""07_grasp.grasp_pose: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labcourse.kinds import array, rotation
from labcourse.questions.t07_grasp import PLACES, WITHIN
from labgrader.question import Question, holds, wrong


def grasp_pose(position, approach, closing):
    """Build T_base_grasp: z along the approach, y the part of closing at right angles to it, x = y cross z."""
    z = approach / np.linalg.norm(approach)
    y = closing - (closing @ z) * z
    y = y / np.linalg.norm(y)
    T = np.eye(4)
    T[:3] = np.column_stack([np.cross(y, z), y, z, position])
    return T


def _same_for_both_ways(T):
    """The jaws are alike: x and y may both be negated, and this stays."""
    return np.outer(T[:3, 0], T[:3, 1]), np.outer(T[:3, 1], T[:3, 1]), T[:, 2:], T[3]


def _any_directions(rng):
    """Draw where a hand is, where it goes, and about where it closes: to any side, of any length, a degree apart."""
    R, angle = rotation(rng), rng.uniform(0.02, np.pi - 0.02)
    approach, closing = R[:, 0], np.cos(angle) * R[:, 0] + np.sin(angle) * R[:, 1]
    return rng.uniform(-1.0, 1.0, 3), approach * 10 ** rng.uniform(-3, 6), closing * 10 ** rng.uniform(-3, 6)


QUESTION = Question(
    reference=grasp_pose,
    kinds={
        "position": array("3", **PLACES, says=WITHIN),
        "approach": array("3", form=lambda rng, _: _any_directions(rng)[1], says="of lengths 1e-3 to 1e6"),
        "closing": array(
            "3",
            form=lambda rng, _: _any_directions(rng)[2],
            says="at least a degree away from the approach, and from its opposite",
        ),
    },
    inputs=_any_directions,
    by_hand=(
        (np.array([0.5, -0.25, 0.125]), np.array([0.0, 0.0, -1.0]), np.array([1.0, 0.0, 0.0])),
        (np.array([0.5, 0.25, 0.0]), np.array([0.0, 0.0, -2.0]), np.array([0.6, 0.8, 0.5])),
        (np.array([0.4, 0.1, 0.2]), np.array([0.6, 0.0, -0.8]), np.array([0.0, 1.0, 0.0])),
        (np.array([0.4, 0.1, 0.2]), np.array([0.6, 0.0, -0.8]), np.array([1.0, 0.0, 0.0])),
        (np.array([-0.4, 0.1, -0.2]), np.array([-1.0, 2.0, 2.0]), np.array([-3.0, 0.0, 3.0])),  # upwards
        (np.array([0.5, 0.1, 0.02]), np.array([0.0, 0.0, -2.0]), np.array([3.0, 0.0, 4.0])),
        (np.array([9.5, -9.5, -7.0]), np.array([8e5, -4e5, 4e5]), np.array([-7e5, 7e5, 3e4])),  # the largest numbers
        (
            np.array([0.5, 0.2, 0.1]),
            np.array([0.0, 0.0, -1e-3]),
            np.array([1.2e-5, -1.6e-5, 1e-3]),
        ),  # the smallest ones
        (np.array([0.4, -0.1, 0.2]), np.array([0.0, -0.5, 0.0]), np.array([-0.25, 0.25, 0.0])),  # level
        (np.array([0.123454, 0.2, 0.1]), np.array([0.0, 0.0, -1.0]), np.array([1.0, 2.0, 0.0])),  # few digits do not do
    ),
    edges=6,
    random_cases=10,
    rtol=1e-6,
    atol=1e-6,
    points=4,
    canonical=_same_for_both_ways,
    forbidden=("scipy",),
)


@holds("the third column, z, is the direction of the approach, of length 1")
def z_is_the_approach(position, approach, closing, T):
    return np.allclose(T[:3, 2], approach / np.linalg.norm(approach), atol=1e-4)


# ---------------------------------------------------------------------------------------------------- wrong answers


def unit(v):
    return v / np.linalg.norm(v)


def pose(x, y, z, origin):
    T = np.eye(4)
    T[:3] = np.column_stack([x, y, z, origin])
    return T


@wrong("Your determinant is -1, a mirror image that no hand can take: in which order does the cross product go?")
def left_handed_pose(position, approach, closing):
    _x, y, z = grasp_pose(position, approach, closing)[:3, :3].T
    return pose(np.cross(z, y), y, z, position)


@wrong("Is y dot z 0? First subtract the part of the closing direction that lies along the approach.")
def closing_taken_as_it_is(position, approach, closing):
    y, z = unit(closing), unit(approach)
    return pose(np.cross(y, z), y, z, position)


@wrong("A cross product with closing is at right angles to it: your jaws close a quarter turn off.")
def closing_crossed_with_the_approach(position, approach, closing):
    z = unit(approach)
    y = unit(np.cross(z, closing))
    return pose(np.cross(y, z), y, z, position)


@wrong("Leaving out z works only for a hand from above: subtract the part along the approach, wherever it points.")
def closing_made_level(position, approach, closing):
    y, z = unit(closing * (1.0, 1.0, 0.0)), unit(approach)
    return pose(np.cross(y, z), y, z, position)


@wrong("The hand goes where the approach says; it is the closing direction that gives way, not z.")
def approach_bent(position, approach, closing):
    y = unit(closing)
    z = unit(approach - (approach @ y) * y)
    return pose(np.cross(y, z), y, z, position)


@wrong("How long is the approach that you are given? The part that you subtract must not depend on its length.")
def projected_on_a_long_vector(position, approach, closing):
    y, z = unit(closing - (closing @ approach) * approach), unit(approach)
    return pose(np.cross(y, z), y, z, position)


@wrong("y gets shorter when the part along z is subtracted: what is its length at the end?")
def closing_left_short(position, approach, closing):
    y, z = unit(closing), unit(approach)
    y = y - (y @ z) * z
    return pose(np.cross(y, z), y, z, position)


@wrong(
    "The columns of a rotation have length 1: how long is your y once the part along z is subtracted?",
    by=("nothing", "largest"),
)
def closing_of_another_length(position, approach, closing, by):
    z = unit(approach)
    y = closing - (closing @ z) * z
    y = y / np.abs(y).max() if by == "largest" else y
    return pose(np.cross(y, z), y, z, position)


@wrong("The hand's axes are the columns of T_base_grasp, and yours are its rows.")
def axes_as_rows(position, approach, closing):
    T = grasp_pose(position, approach, closing)
    T[:3, :3] = T[:3, :3].T.copy()
    return T


@wrong("T_base_grasp takes the grasp's origin to its place in the base frame: what is its last column?")
def position_of_the_inverse(position, approach, closing):
    T = grasp_pose(position, approach, closing)
    T[:3, 3] = -T[:3, :3].T @ position
    return T


@wrong("That is the base in the grasp frame, the inverse: where does T_base_grasp take (0, 0, 0)?")
def inverse_of_the_pose(position, approach, closing):
    return np.linalg.inv(grasp_pose(position, approach, closing))


@wrong("T times (0, 0, 0, 1) is the grasp's origin: does it pick a row of T, or a column?")
def position_in_the_last_row(position, approach, closing):
    T = grasp_pose(position, approach, closing)
    T[:3, 3], T[3, :3] = 0.0, position
    return T


@wrong("Leaving out z works only for a hand from above: subtract the part along the approach, wherever it points.")
def closing_made_level_and_x_a_unit(position, approach, closing):
    y, z = unit(closing * (1.0, 1.0, 0.0)), unit(approach)
    return pose(unit(np.cross(y, z)), y, z, position)


@wrong("How long is the approach that you are given, and how long must z be?")
def approach_left_long(position, approach, closing):
    y = unit(closing - (closing @ approach) / (approach @ approach) * approach)
    return pose(np.cross(y, approach), y, approach, position)


@wrong("QR gives each direction but for its sign: does your z point along the approach, or against it?", sign=(1, -1))
def directions_of_any_sign(position, approach, closing, sign):
    Q, _ = np.linalg.qr(np.column_stack([approach, closing]))
    z, y = sign * Q[:, 0], Q[:, 1]
    return pose(np.cross(y, z), y, z, position)


@wrong("The hand may come from below as well: which z has an approach that points up?")
def always_downwards(position, approach, closing):
    z = unit(approach) * (1.0 if approach[2] <= 0.0 else -1.0)
    y = unit(closing - (closing @ z) * z)
    return pose(np.cross(y, z), y, z, position)


@wrong("You keep the part of the closing direction that lies along the approach: what is left without it?")
def along_the_approach(position, approach, closing):
    z = unit(approach)
    y = unit((closing @ z) * z)
    return pose(np.cross(y, z), y, z, position)
