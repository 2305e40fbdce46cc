"""07_grasp.closing_yaw: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.checker.question import Question, wrong
from labkit.course.topics.t07_grasp import cloud


def closing_yaw(Sigma):
    """Find the direction, seen from above, in which a cloud of covariance Sigma is narrowest: its angle from x."""
    _, axes = np.linalg.eigh(Sigma[:2, :2])
    x, y = axes[:, 0]
    return np.arctan2(y, x)


def _covariance(rng):
    return (np.cov(cloud(rng).T, bias=True),)


def _variance(Sigma, yaw):
    d = np.array([np.cos(yaw), np.sin(yaw)])
    return d @ Sigma[:2, :2] @ d


QUESTION = Question(
    reference=closing_yaw,
    inputs=_covariance,
    by_hand=(
        (np.diag([4.0, 1.0, 9.0]),),  # long in x: close along y
        (np.diag([1.0, 4.0, 0.5]),),  # long in y, and flat: close along x
        (np.array([[2.0, 1.0, 0.0], [1.0, 2.0, 0.0], [0.0, 0.0, 1.0]]),),  # long along the diagonal
        (np.array([[5.0, -2.0, 1.0], [-2.0, 2.0, 0.0], [1.0, 0.0, 3.0]]),),
    ),
    random_cases=10,
    atol=1e-4,
    points=3,
    # An axis has no sign: yaw and yaw + pi are the same grasp, and have the same double angle on the circle.
    canonical=lambda yaw: np.array([np.cos(2.0 * yaw), np.sin(2.0 * yaw)]),
    forbidden=("sklearn", "cv2"),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def yaw_of(axis):
    return np.arctan2(axis[1], axis[0])


@wrong("That is the direction in which the cloud is longest. The jaws close across it.")
def longest_direction(Sigma):
    return yaw_of(np.linalg.eigh(Sigma[:2, :2])[1][:, 1])


@wrong("Check Sigma @ v against w * v for the v that you took: is an eigenvector a row or a column?")
def axes_as_rows(Sigma):
    return yaw_of(np.linalg.eigh(Sigma)[1][0])


@wrong("np.linalg.eig promises no order: sometimes your first axis is the long one. Sort, or take eigh.")
def order_of_eig(Sigma):
    return yaw_of(np.linalg.eig(Sigma[:2, :2])[1][:, 0])


@wrong("A flat thing is narrowest upwards, but the jaws close in the table's plane: which block of Sigma is that?")
def least_of_three(Sigma):
    return yaw_of(np.linalg.eigh(Sigma)[1][:, 0])


@wrong("For a tall thing the upright axis has the most spread, not the least; look at x and y alone.")
def middle_of_three(Sigma):
    return yaw_of(np.linalg.eigh(Sigma)[1][:, 1])


@wrong("For a cloud long in x the answer is 90 degrees, and yours is 0: which argument comes first in arctan2?")
def yaw_with_x_and_y_swapped(Sigma):
    return np.pi / 2 - closing_yaw(Sigma)


@wrong("Turn the object by 10 degrees: your yaw turns by 20. The formula gives twice the angle.")
def double_angle_not_halved(Sigma):
    return np.arctan2(2.0 * Sigma[0, 1], Sigma[0, 0] - Sigma[1, 1]) + np.pi / 2


@wrong("Your yaw does not see the sign of Sigma[0, 1], so it cannot tell a thing from its mirror image.")
def variances_as_a_direction(Sigma):
    return np.arctan2(Sigma[1, 1], Sigma[0, 0]) + np.pi / 2


@wrong("Only 0 and 90 degrees are in your choice. A thing can lie at any angle: what does Sigma[0, 1] tell?")
def smaller_of_the_two_variances(Sigma):
    return 0.0 if Sigma[0, 0] < Sigma[1, 1] else np.pi / 2


@wrong("From above one sees x and y: which rows and columns of Sigma are they?")
def seen_from_the_side(Sigma):
    return yaw_of(np.linalg.eigh(Sigma[1:, 1:])[1][:, 0])


@wrong("Is the direction (1, -2) the same as (1, 2)? Only both signs together may change.")
def signs_dropped(Sigma):
    return yaw_of(np.abs(np.linalg.eigh(Sigma[:2, :2])[1][:, 0]))


@wrong("Of -1 / -2 and 1 / 2, arctan sees the same quotient: which function takes both numbers?")
def arctan_of_the_quotient(Sigma):
    with np.errstate(divide="ignore"):
        return 0.5 * np.arctan(2.0 * Sigma[0, 1] / (Sigma[0, 0] - Sigma[1, 1])) + np.pi / 2


@wrong("Modulo pi / 2 takes closing along x for closing along y: which turn brings an axis back to itself?")
def modulo_a_right_angle(Sigma):
    return yaw_of(np.linalg.eigh(Sigma[:2, :2])[1][:, 0]) % (np.pi / 2)
