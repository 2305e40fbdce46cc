"""07_grasp.points_in_fingers: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labcourse.kinds import array, number, poses, rotation
from labcourse.questions.t07_grasp import (
    FACING_X,
    FROM_BELOW,
    LAST_ROW,
    LENGTH,
    PLACES,
    TURNED,
    TURNED_OVER,
    WITHIN,
    across,
    quarter_turns,
    transform,
)
from labgrader.question import Question, wrong


def points_in_fingers(P, T_base_grasp, width, half, thickness, tips):
    """Count the points of the base frame that lie where the two open fingers would be."""
    x, y, z = ((P - T_base_grasp[:3, 3]) @ T_base_grasp[:3, :3]).T
    out = np.abs(y) - width / 2
    return int(np.count_nonzero((np.abs(x) <= half) & (out >= 0.0) & (out <= thickness) & (z <= tips)))


def moved(P, T):
    """Coordinates x, y, z (3, N) of points in the frame that T maps to."""
    return (P @ T[:3, :3].T + T[:3, 3]).T


def _scene_round_a_grasp(rng):
    """Draw a hand that comes from anywhere, near the base's origin, and points round it, more on one side of it.

    In half of the draws its axes are the base's in another order and all is a multiple of an eighth, so that many
    points lie on a border.
    """
    if rng.random() < 0.5:
        T = transform(quarter_turns(rng), rng.integers(-16, 17, 3) / 8.0)
        in_grasp = rng.integers((-8, -8, -11), (9, 7, 5), (120, 3)) / 8.0
        return moved(in_grasp, T).T, T, 1.0, 0.25, 0.25, float(rng.choice([0.125, 0.25]))
    # A little off: whoever forgets it or takes it off too late still counts some.
    T = transform(rotation(rng), rng.choice([-1.0, 1.0], 3) * rng.uniform(0.005, 0.02, 3))
    P = moved(rng.uniform([-0.02, -0.06, -0.05], [0.02, 0.08, 0.03], (120, 3)), T).T
    width, half = float(rng.uniform(0.03, 0.05)), float(rng.uniform(0.009, 0.012))
    return P, T, width, half, float(rng.uniform(0.013, 0.02)), float(rng.uniform(0.005, 0.012))


def _thin_and_far(rng):
    """Draw fingers as thin as a sheet of card, and points just in and just outside of them, or 11 m up and more."""
    R, width = rotation(rng), float(rng.uniform(0.03, 0.08))
    half, thickness, tips = map(float, rng.uniform(2e-4, 6e-4, 3))
    part = rng.uniform(0.1, 0.9, (36, 3))  # of the way to a border
    for k in range(3):
        part[5 * k : 5 * k + 5, k] = rng.uniform(1.1, 1.5, 5)
    x, out, z = (part * (half, thickness, tips)).T
    z[-8:] -= rng.uniform(11.0, 13.5, 8)
    x_side, y_side = rng.choice([-1.0, 1.0], (2, 36))
    T = transform(R, across(rng, R[:, 2]))
    in_grasp = np.stack([x_side * x, y_side * (width / 2 + out), z], axis=1)
    return moved(in_grasp, T).T, T, width, half, thickness, tips


# Beside the jaws along the base's x. Those that count: at the pad, a finger's thickness outside it, three at the tips,
# high above, and in the other finger. How many lie on a border tells the borders apart.
_AT_TIPS = [[2.625, 1.0, 0.25], [2.625, 0.875, 0.25], [2.5625, 1.0, 0.25]]
_IN = [[2.5, 1.0, 0.5], [2.75, 1.0, 0.5], *_AT_TIPS, [2.625, 1.25, 1.5], [1.375, 0.75, 0.5]]
# Those that do not: just inside the pad, beyond the finger, beside it on both sides, and below the tips.
_OUT = [[2.25, 1.0, 0.5], [3.0, 1.0, 0.5], [2.625, 1.5, 0.5], [2.625, 0.5, 0.5], [2.625, 1.0, 0.125]]

# These are in the grasp frame. Of a hand of which no axis is level: one beside the fingers, four in them.
_BESIDE = np.array([[0.2, 0.55, -0.3], [-0.2, 0.35, 0.05], [0.0, -0.45, 0.05], [0.0, -0.45, -0.4], [-0.05, 0.25, -0.2]])
# Just inside and just outside of boxes whose numbers have five digits or six.
_CLOSE = np.array([[0.0, 0.123416, 0.0], [0.0, 0.12345, 0.0], [0.123415, 0.2, 0.0], [0.0, 0.2, 0.123415]])
_FINE = (
    (0.24684, 0.05, 0.01, 0.05),
    (0.25, 0.12342, 0.1, 0.05),
    (0.153168, 0.01, 0.12342, 0.2),
    (0.25, 0.05, 0.1, 0.12342),
)
_HALF_OFF = transform(FACING_X[:3, :3], [2.00042, -1.00037, 0.50046])
_FAR = np.array([[0.9, 1.4, 0.9], [-0.5, -1.4, -3.0], [1.1, 1.4, 0.9]])
_HIGH_UP = transform(TURNED[:3, :3], [-7.5, -7.5, 9.5])

MOST_POINTS = 80_000  # more than a scene of 320 x 240 pixels has


QUESTION = Question(
    reference=points_in_fingers,
    kinds={
        "P": array(
            "N 3",
            **PLACES,
            lengths={"N": (0, MOST_POINTS)},
            says=("N from 0 to 80,000", WITHIN),
            free=("reversed along N",),
        ),
        "T_base_grasp": poses(free=(LAST_ROW,)),
        "width": number(0.01, 1.0, says="0.01 to 1"),
        "half": LENGTH,
        "thickness": LENGTH,
        "tips": LENGTH,
    },
    inputs=(_scene_round_a_grasp, _scene_round_a_grasp, _thin_and_far),
    by_hand=(
        (np.array([_OUT[0], *_IN, *_OUT[1:]]), FACING_X, 1.0, 0.25, 0.25, 0.25),
        (np.array(_IN[:1]), FACING_X, 1.0, 0.25, 0.25, 0.25),
        (np.array(_OUT), FACING_X, 1.0, 0.25, 0.25, 0.25),
        (np.zeros((0, 3)), FACING_X, 1.0, 0.25, 0.25, 0.25),
        (np.resize(10 * _IN + _OUT, (MOST_POINTS, 3)), FACING_X, 1.0, 0.25, 0.25, 0.25),  # more than 16 bits count
        (np.resize(_IN, (1999, 3)), FACING_X, 1.0, 0.25, 0.25, 0.25),  # no multiple of a round number
        *((moved(_BESIDE, T).T.round(6), T, 0.48, 0.22, 0.28, 0.12) for T in (FROM_BELOW, TURNED, TURNED_OVER)),
        (np.array([[0.0, 0.6, 0.0], [0.0, 0.4, 0.0]]), np.diag([-1.0, 1.0, -1.0, 1.0]), 1.0, 0.25, 0.25, 0.1),
        (np.array([[2.125, 1.0, 0.5], [2.0, 1.0, 0.375]]), FACING_X, 0.25, 0.0, 0.0, 0.0),  # lines for fingers
        (np.array([[2.0075, 1.0, 0.5], [2.0, 1.0, 0.5]]), FACING_X, 0.01, 0.1, 0.1, 0.1),  # hardly open
        (moved(_FAR, _HIGH_UP).T, _HIGH_UP, 1.0, 1.0, 1.0, 1.0),  # the largest numbers
        *((moved(_CLOSE, _HALF_OFF).T, _HALF_OFF, *boxes) for boxes in _FINE),  # few digits do not hold these
    ),
    edges=12,
    random_cases=12,
    points=3,
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def in_boxes(x, y, z, width, half, thickness, tips):
    return points_in_fingers(np.stack([x, y, z], axis=1), np.eye(4), width, half, thickness, tips)


@wrong("The points are in the base frame: which transform takes base coordinates to the grasp frame?")
def transform_not_inverted(P, T_base_grasp, *boxes):
    return in_boxes(*moved(P, T_base_grasp), *boxes)


@wrong("The position is a point of the base frame: subtract it before you rotate, not after.")
def position_taken_off_after_the_turn(P, T_base_grasp, *boxes):
    return in_boxes(*(P @ T_base_grasp[:3, :3] - T_base_grasp[:3, 3]).T, *boxes)


@wrong("You move the points to the grasp's origin: along which axes do the fingers lie, and along which your x, y, z?")
def shifted_alone(P, T_base_grasp, *boxes):
    return in_boxes(*(P - T_base_grasp[:3, 3]).T, *boxes)


@wrong("What lies lower than the tips is not in the way. The frame's z points down.")
def below_the_tips_too(P, T_base_grasp, width, half, thickness, tips):
    return points_in_fingers(P, T_base_grasp, width, half, thickness, np.inf)


@wrong("You count what is under the tips: the grasp frame's z points down, so above is smaller z.")
def below_the_tips_alone(P, T_base_grasp, width, half, thickness, tips):
    x, y, z = moved(P, np.linalg.inv(T_base_grasp))
    return in_boxes(x, y, -z, width, half, thickness, -tips)


@wrong("There are two fingers, at y and at -y.")
def one_finger(P, T_base_grasp, width, half, thickness, tips):
    x, y, z = moved(P, np.linalg.inv(T_base_grasp))
    return in_boxes(x, np.where(y >= 0.0, y, np.nan), z, width, half, thickness, tips)


@wrong("What is between the pads is what you want to hold: it is not in the way.")
def between_the_pads_too(P, T_base_grasp, width, half, thickness, tips):
    x, y, z = moved(P, np.linalg.inv(T_base_grasp))
    inside = (np.abs(x) <= half) & (np.abs(y) <= width / 2 + thickness) & (z <= tips)
    return int(inside.sum())


@wrong("The fingers extend upwards from the tips without limit: a point with z far below 0 is in their way, too.")
def near_the_tips_alone(P, T_base_grasp, *boxes):
    x, y, z = moved(P, np.linalg.inv(T_base_grasp))
    return in_boxes(x, y, np.abs(z), *boxes)


@wrong("The borders belong to the boxes: what lies on one counts, with <= and >=.")
def borders_left_out(P, T_base_grasp, width, half, thickness, tips):
    x, y, z = moved(P, np.linalg.inv(T_base_grasp))
    out = np.abs(y) - width / 2
    return int(((np.abs(x) < half) & (out > 0.0) & (out < thickness) & (z < tips)).sum())


@wrong("The hand may lean: what is above the tips is so along z of the grasp frame, not of the base.")
def heights_of_the_base_frame(P, T_base_grasp, width, half, thickness, tips):
    x, y, _ = moved(P, np.linalg.inv(T_base_grasp))
    return in_boxes(x, y, T_base_grasp[2, 3] - P[:, 2], width, half, thickness, tips)


@wrong("A finger begins at its pad and extends outwards; yours has the pad in its middle.")
def fingers_astride_their_pads(P, T_base_grasp, width, half, thickness, tips):
    return points_in_fingers(P, T_base_grasp, width - thickness, half, thickness, tips)


@wrong("A finger ends `thickness` outside its pad: anything further out is not in the way.")
def fingers_without_an_outer_side(P, T_base_grasp, width, half, thickness, tips):
    return points_in_fingers(P, T_base_grasp, width, half, np.inf, tips)


@wrong("That is a share of the points: how many are they?")
def share_of_the_points(P, *others):
    return points_in_fingers(P, *others) / len(P) if len(P) else np.nan


@wrong("A mask has an entry for each point, whatever it says: which entries do you want to count?")
def length_of_the_mask(P, *others):
    return len(P)


@wrong("You count fingers that are hit. How many points are in their way?")
def fingers_hit(P, T_base_grasp, *boxes):
    x, y, z = moved(P, np.linalg.inv(T_base_grasp))
    return sum(in_boxes(x, np.where(side * y >= 0.0, y, np.nan), z, *boxes) > 0 for side in (1.0, -1.0))


@wrong("You return the points themselves: how many are they?")
def the_points(P, T_base_grasp, width, half, thickness, tips):
    x, y, z = moved(P, np.linalg.inv(T_base_grasp))
    out = np.abs(y) - width / 2
    return P[(np.abs(x) <= half) & (out >= 0.0) & (out <= thickness) & (z <= tips)]


@wrong("thickness counts from the pad outwards: from where does |y| count?")
def thickness_from_the_middle(P, T_base_grasp, width, half, thickness, tips):
    return points_in_fingers(P, T_base_grasp, width, half, thickness - width / 2, tips)


@wrong("The borders belong to the boxes: what lies on one counts, with <= and >=.")
def pads_and_outer_sides_left_out(P, T_base_grasp, width, half, thickness, tips):
    x, y, z = moved(P, np.linalg.inv(T_base_grasp))
    out = np.abs(y) - width / 2
    return int(((np.abs(x) <= half) & (out > 0.0) & (out < thickness) & (z <= tips)).sum())


@wrong("Python reads & before |, as it reads * before +: which finger do your x and z apply to?", first=(1.0, -1.0))
def or_after_and(P, T_base_grasp, width, half, thickness, tips, first):
    x, y, z = moved(P, np.linalg.inv(T_base_grasp))
    out, near = first * y - width / 2, (np.abs(x) <= half) & (z <= tips)
    other = -first * y - width / 2
    return int((((out >= 0.0) & (out <= thickness)) | ((other >= 0.0) & (other <= thickness) & near)).sum())


@wrong("The hand may lean: its pads need not be level. Which number of the x axis is left out?")
def pads_taken_as_level(P, T_base_grasp, *boxes):
    _, y, z = moved(P, np.linalg.inv(T_base_grasp))
    return in_boxes((P - T_base_grasp[:3, 3])[:, :2] @ T_base_grasp[:2, 0], y, z, *boxes)


@wrong("x has two signs: what does x <= half say about a point far away on the negative side?")
def pads_without_an_end(P, T_base_grasp, width, half, thickness, tips):
    x, y, z = moved(P, np.linalg.inv(T_base_grasp))
    return in_boxes(np.maximum(x, 0.0), y, z, width, half, thickness, tips)


@wrong("The jaws close along y of the grasp frame, and the fingers are broad along x.")
def axes_exchanged(P, T_base_grasp, *boxes):
    x, y, z = moved(P, np.linalg.inv(T_base_grasp))
    return in_boxes(y, x, z, *boxes)


@wrong("z points down: the tips are at z = tips, not at -tips, and what is above them has a smaller z.")
def heights_counted_upwards(P, T_base_grasp, *boxes):
    x, y, z = moved(P, np.linalg.inv(T_base_grasp))
    return in_boxes(x, y, -z, *boxes)
