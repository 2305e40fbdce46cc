"""07_grasp.closing_yaw: the question, and wrong answers with the hints that they earn."""

from functools import partial

import numpy as np

from labcourse.kinds import array, number
from labcourse.questions.t07_grasp import cloud
from labgrader.question import Question, holds, wrong


def closing_yaw(Sigma, now):
    """Find the direction, seen from above, in which a cloud is narrowest: of its angles from x the nearest to `now`."""
    _, axes = np.linalg.eigh(Sigma[:2, :2])
    x, y = axes[:, 0]
    yaw = np.arctan2(y, x)
    return yaw + np.pi * np.round((now - yaw) / np.pi)


MILLIMETRES = 1e8  # of squares: then a covariance has large numbers


def _covariance(rng, unit=1.0):
    """The covariance of a thing of centimetres, in square metres or in another unit; no disc, seen from above."""
    while True:
        Sigma = np.cov(cloud(rng).T, bias=True) * unit
        narrow, long = np.linalg.eigvalsh(Sigma[:2, :2])
        if long >= 1.1 * narrow:
            return Sigma


def _covariance_and_hand(rng, unit=1.0):
    """Draw a covariance, and a hand less than a quarter turn off, in any of its turns."""
    Sigma, turns = _covariance(rng, unit), rng.choice([12.0, 12.0, 950.0])
    off = rng.choice([-1.0, 1.0]) * rng.uniform(0.3, 1.5)
    return Sigma, float(closing_yaw(Sigma, rng.uniform(-turns, turns)) + off)


QUESTION = Question(
    reference=closing_yaw,
    kinds={
        "Sigma": array(
            "3 3",
            form=lambda rng, _: _covariance(rng, rng.choice([1.0, MILLIMETRES])),
            says=("symmetric", "variances of 1e-6 to 1e6", "at least a tenth larger than the smallest"),
            # What is upright does not count, and of two equal entries one is enough.
            free=("* at ??, 2]", "* at ?2, ?]", "* at ?0, 1]"),
        ),
        "now": number(-1000.0, 1000.0, says="-1000 to 1000"),
    },
    inputs=(_covariance_and_hand, partial(_covariance_and_hand, unit=MILLIMETRES)),
    by_hand=(
        (np.diag([4.0, 1.0, 9.0]), -1.0),  # long in x: close along y
        (np.diag([1.0, 4.0, 0.5]), 3.0),  # long in y, and flat: close along x
        (np.array([[2.0, 1.0, 0.0], [1.0, 2.0, 0.0], [0.0, 0.0, 1.0]]), 0.0),  # long along the diagonal
        (np.array([[5.0, -2.0, 1.0], [-2.0, 2.0, 0.0], [1.0, 0.0, 3.0]]), -7.0),  # more than a whole turn away
        (np.array([[5.0, 2.0, 1.0], [2.0, 2.0, 0.0], [1.0, 0.0, 3.0]]), 1000.0),  # and as far as the statement allows
        (np.array([[3.0, 2.0, 1.0], [2.0, 3.0, 0.0], [1.0, 0.0, 3.0]]), -1000.0),
        (np.diag([1.0, 4.0, 0.5]), 7.8537),  # hardly less than a quarter turn off, which few digits hide
        (np.array([[1.1e-6, 9e-9, 0.0], [9e-9, 1e-6, 0.0], [0.0, 0.0, 1e-6]]), 1.0),  # a screw, in square metres
    ),
    edges=4,
    random_cases=10,
    atol=1e-4,
    points=3,
    forbidden=("sklearn", "cv2"),
)


@holds("modulo pi it is the angle of the narrowest direction, seen from above")
def narrowest(Sigma, now, yaw):
    return abs(np.sin(yaw - closing_yaw(Sigma, now))) < 1e-3


@holds("it is at most a quarter turn away from `now`")
def near_the_hand(Sigma, now, yaw):
    return abs(yaw - now) < np.pi / 2 + 1e-3


# ---------------------------------------------------------------------------------------------------- wrong answers

AS_IT_COMES, FROM_0, ROUND_0, NEAREST = "as it comes", "from 0 to pi", "from -pi/2 to pi/2", "the nearest"


def told(yaw, now, how):
    """One of the angles of an axis: students with a wrong axis choose it in any of these ways."""
    if how == NEAREST:
        return yaw + np.pi * np.round((now - yaw) / np.pi)
    if how == ROUND_0:
        return (yaw + np.pi / 2) % np.pi - np.pi / 2
    return yaw % np.pi if how == FROM_0 else yaw


def yaw_of(axis):
    return np.arctan2(axis[1], axis[0])


@wrong(
    "The axis is right, as in the lesson. Here its angle must be the one nearest to `now`: add half turns to it.",
    how=(AS_IT_COMES, FROM_0, ROUND_0),
)
def whatever_the_hand_has_now(Sigma, now, how):
    return told(yaw_of(np.linalg.eigh(Sigma[:2, :2])[1][:, 0]), now, how)


@wrong("An axis returns to itself after half a turn, pi, not after a whole one: which multiples may you add?")
def nearest_by_whole_turns(Sigma, now):
    yaw = yaw_of(np.linalg.eigh(Sigma[:2, :2])[1][:, 0])
    return yaw + 2 * np.pi * np.round((now - yaw) / (2 * np.pi))


@wrong("Within half a turn of `now` there are two angles of an axis: is yours the nearer one?")
def less_than_half_a_turn_away(Sigma, now):
    yaw = yaw_of(np.linalg.eigh(Sigma[:2, :2])[1][:, 0])
    while abs(yaw - now) >= np.pi:
        yaw += np.copysign(np.pi, now - yaw)
    return yaw


FEW_TURNS = (
    "The hand may have turned several times, either way: a fixed number of half turns need not bring you near `now`."
)


@wrong(FEW_TURNS, turns=((-1, 0, 1), (-2, -1, 0, 1, 2), (0, 1), (-1, 0)))
def fixed_half_turns(Sigma, now, turns):
    yaw = yaw_of(np.linalg.eigh(Sigma[:2, :2])[1][:, 0])
    return min((yaw + turn * np.pi for turn in turns), key=lambda angle: abs(angle - now))


@wrong(FEW_TURNS, turn=(np.pi, -np.pi))
def half_a_turn_where_it_is_far(Sigma, now, turn):
    yaw = yaw_of(np.linalg.eigh(Sigma[:2, :2])[1][:, 0])
    return yaw + turn * (abs(yaw - now) > np.pi / 2)


@wrong("That is the next angle above `now`, up to half a turn away: the one below may be nearer.")
def next_one_above(Sigma, now):
    return now + (yaw_of(np.linalg.eigh(Sigma[:2, :2])[1][:, 0]) - now) % np.pi


@wrong("That is the next angle below `now`, up to half a turn away: the one above may be nearer.")
def next_one_below(Sigma, now):
    return now - (now - yaw_of(np.linalg.eigh(Sigma[:2, :2])[1][:, 0])) % np.pi


@wrong("Half a turn is pi: adding quarter turns confuses closing along x with closing along y.")
def nearest_by_quarter_turns(Sigma, now):
    yaw = yaw_of(np.linalg.eigh(Sigma[:2, :2])[1][:, 0])
    return yaw + np.pi / 2 * np.round((now - yaw) / (np.pi / 2))


@wrong(
    "That is the direction in which the cloud is longest. The jaws close at right angles to it.",
    how=(AS_IT_COMES, FROM_0, NEAREST),
)
def longest_direction(Sigma, now, how):
    return told(yaw_of(np.linalg.eigh(Sigma[:2, :2])[1][:, 1]), now, how)


@wrong(
    "Check Sigma @ v against w * v for the v that you took: is an eigenvector a row or a column?",
    how=(AS_IT_COMES, NEAREST),
)
def axes_as_rows(Sigma, now, how):
    return told(yaw_of(np.linalg.eigh(Sigma)[1][0]), now, how)


@wrong(
    "np.linalg.eig promises no order: sometimes your first axis is the long one. Sort, or take eigh.",
    how=(AS_IT_COMES, NEAREST),
)
def order_of_eig(Sigma, now, how):
    return told(yaw_of(np.linalg.eig(Sigma[:2, :2])[1][:, 0]), now, how)


@wrong(
    "A flat thing is narrowest upwards, but the jaws close in the table's plane: which block of Sigma is that?",
    how=(AS_IT_COMES, NEAREST),
)
def least_of_three(Sigma, now, how):
    return told(yaw_of(np.linalg.eigh(Sigma)[1][:, 0]), now, how)


@wrong(
    "For a tall thing the upright axis has the most spread, not the least; look at x and y alone.",
    how=(AS_IT_COMES, NEAREST),
)
def middle_of_three(Sigma, now, how):
    return told(yaw_of(np.linalg.eigh(Sigma)[1][:, 1]), now, how)


@wrong(
    "For a cloud long in x the answer is 90 degrees, and yours is 0: which argument comes first in arctan2?",
    how=(AS_IT_COMES, NEAREST),
)
def yaw_with_x_and_y_swapped(Sigma, now, how):
    x, y = np.linalg.eigh(Sigma[:2, :2])[1][:, 0]
    return told(np.arctan2(x, y), now, how)


@wrong(
    "Turn the object by 10 degrees: your yaw turns by 20. The formula gives twice the angle.",
    how=(AS_IT_COMES, NEAREST),
)
def double_angle_not_halved(Sigma, now, how):
    return told(np.arctan2(2.0 * Sigma[0, 1], Sigma[0, 0] - Sigma[1, 1]) + np.pi / 2, now, how)


@wrong(
    "Your yaw ignores the sign of Sigma[0, 1], so it cannot tell a thing from its mirror image.",
    how=(AS_IT_COMES, NEAREST),
)
def variances_as_a_direction(Sigma, now, how):
    return told(np.arctan2(Sigma[1, 1], Sigma[0, 0]) + np.pi / 2, now, how)


@wrong(
    "You choose only between 0 and 90 degrees. A thing can lie at any angle: what does Sigma[0, 1] tell you?",
    how=(AS_IT_COMES, NEAREST),
)
def smaller_of_the_two_variances(Sigma, now, how):
    return told(0.0 if Sigma[0, 0] < Sigma[1, 1] else np.pi / 2, now, how)


@wrong("From above you see x and y: which rows and columns of Sigma are they?", how=(AS_IT_COMES, NEAREST))
def seen_from_the_side(Sigma, now, how):
    return told(yaw_of(np.linalg.eigh(Sigma[1:, 1:])[1][:, 0]), now, how)


@wrong("Is the direction (1, -2) the same as (1, 2)? Only both signs together may change.", how=(AS_IT_COMES, NEAREST))
def signs_dropped(Sigma, now, how):
    return told(yaw_of(np.abs(np.linalg.eigh(Sigma[:2, :2])[1][:, 0])), now, how)


@wrong(
    "Of -1 / -2 and 1 / 2, arctan sees the same quotient: which function takes both numbers?",
    how=(AS_IT_COMES, NEAREST),
)
def arctan_of_the_quotient(Sigma, now, how):
    with np.errstate(divide="ignore"):
        return told(0.5 * np.arctan(2.0 * Sigma[0, 1] / (Sigma[0, 0] - Sigma[1, 1])) + np.pi / 2, now, how)


@wrong("Modulo pi / 2 confuses closing along x with closing along y: which turn brings an axis back to itself?")
def modulo_a_right_angle(Sigma, now):
    return yaw_of(np.linalg.eigh(Sigma[:2, :2])[1][:, 0]) % (np.pi / 2)


@wrong(FEW_TURNS, turns=((-1, 0, 1), (-2, -1, 0, 1, 2), (0, 1), (-1, 0)))
def fixed_half_turns_from_0(Sigma, now, turns):
    yaw = yaw_of(np.linalg.eigh(Sigma[:2, :2])[1][:, 0]) % np.pi
    return min((yaw + turn * np.pi for turn in turns), key=lambda angle: abs(angle - now))


@wrong("`now` is in radians, and so is the answer: where do degrees come in?", nearest=(False, True))
def in_degrees(Sigma, now, nearest):
    yaw = np.degrees(yaw_of(np.linalg.eigh(Sigma[:2, :2])[1][:, 0]))
    return yaw + 180 * np.round((now - yaw) / 180) if nearest else yaw


@wrong(
    "Your angle is made of variances, which have no direction. Which vector tells one?", of=("eigenvalues", "diagonal")
)
def angle_of_variances(Sigma, now, of):
    variances = np.linalg.eigvalsh(Sigma[:2, :2]) if of == "eigenvalues" else np.sqrt(np.diagonal(Sigma)[[1, 0]])
    yaw = np.arctan2(*variances)
    return yaw + np.pi * np.round((now - yaw) / np.pi)
