"""The questions of lab 07: what a cloud says, where the jaws close, and (in t07_hand) where the hand goes."""

import numpy as np

from labkit.course.questions import answers_07 as answers
from labkit.course.questions.question import Misconception, Property, Question
from labkit.course.questions.t07_hand import GRASP_HEIGHT, GRASP_POSE, POINTS_IN_FINGERS, cloud

# ------------------------------------------------------------------------------------------ centroid and covariance


def centroid_and_covariance(P):
    """Compute the mean of the points and their covariance with 1/N."""
    mu = P.mean(axis=0)
    centred = P - mu
    return mu, centred.T @ centred / len(P)


_TWO_POINTS = np.array([[0.0, 0.0, 1.0], [2.0, 0.0, 1.0]])
_RECTANGLE = np.array([[4.0, 1.0, 0.0], [4.0, 3.0, 0.0], [0.0, 1.0, 0.0], [0.0, 3.0, 0.0], [2.0, 2.0, 0.0]])

CENTROID_AND_COVARIANCE = Question(
    name="07_grasp.centroid_and_covariance",
    reference=centroid_and_covariance,
    inputs=lambda rng: (cloud(rng),),
    by_hand=((_TWO_POINTS,), (_RECTANGLE,), (_RECTANGLE[:1],)),
    atol=1e-8,
    points=2,
    properties=(
        Property("the covariance is symmetric", lambda arguments, out: np.allclose(out[1], out[1].T, atol=1e-9)),
        Property(
            "a cloud that is moved has the same covariance; its trace is the mean squared distance from the centroid",
            lambda arguments, out: np.isclose(
                np.trace(out[1]), ((arguments[0] - out[0]) ** 2).sum(axis=1).mean(), rtol=1e-4
            ),
        ),
    ),
    misconceptions=(
        Misconception(
            "1/(N - 1)",
            answers.covariance_of_a_sample,
            "Your axes are right, your variances a little too large: which of 1/N and 1/(N - 1) does the text state?",
        ),
        Misconception(
            "np.cov over the wrong axis",
            answers.covariance_of_columns_as_samples,
            "A covariance with a row for each point? np.cov takes rows as variables unless told otherwise.",
        ),
        Misconception(
            "not centred",
            answers.not_centred,
            "Move the cloud by a metre: the spread must stay as it is. What should be subtracted first?",
        ),
        Misconception(
            "sum instead of mean",
            answers.not_divided,
            "List every point twice: the shape is the same, but your covariance doubles.",
        ),
        Misconception(
            "variances alone",
            answers.spreads_alone,
            "Off the diagonal stands how x, y and z vary together; without it no object is ever turned.",
        ),
        Misconception(
            "median",
            answers.median_for_mean,
            "The text's centroid is the mean; yours is the median, which another cloud of the same mean moves.",
        ),
        Misconception(
            "one mean for x, y and z",
            answers.one_mean_for_all,
            "The three coordinates of your centroid are equal: over which axis does the mean run?",
        ),
    ),
    alternatives=(
        answers.centroid_loops,
        answers.centroid_einsum,
        answers.centroid_torch,
        answers.centroid_float32,
        answers.centroid_numpy_cov,
    ),
    forbidden=("sklearn", "scipy"),
)


# ------------------------------------------------------------------------------------------------- the closing yaw


def closing_yaw(Sigma):
    """Find the direction, seen from above, in which a cloud of covariance Sigma is narrowest: its angle from x."""
    _, axes = np.linalg.eigh(Sigma[:2, :2])
    x, y = axes[:, 0]
    return np.arctan2(y, x)


def _covariance(rng):
    return (centroid_and_covariance(cloud(rng))[1],)


CLOSING_YAW = Question(
    name="07_grasp.closing_yaw",
    reference=closing_yaw,
    inputs=_covariance,
    by_hand=(
        (np.diag([4.0, 1.0, 9.0]),),  # long in x: close along y
        (np.diag([1.0, 4.0, 0.5]),),  # long in y, and flat: close along x
        (np.array([[2.0, 1.0, 0.0], [1.0, 2.0, 0.0], [0.0, 0.0, 1.0]]),),  # long along the diagonal
        (np.array([[5.0, -2.0, 1.0], [-2.0, 2.0, 0.0], [1.0, 0.0, 3.0]]),),
    ),
    random_cases=6,
    atol=1e-4,
    points=3,
    properties=(
        Property(
            "among all directions of the table's plane the jaws close in the one of least variance",
            lambda arguments, yaw: (
                _variance(arguments[0], yaw) <= 1.001 * np.linalg.eigvalsh(arguments[0][:2, :2])[0] + 1e-12
            ),
        ),
    ),
    misconceptions=(
        Misconception(
            "along the long side",
            answers.along_the_long_side,
            "You close the jaws along the long side: they have 80 mm. In what order does eigh give its axes?",
        ),
        Misconception(
            "axes read as rows",
            answers.axes_as_rows,
            "Check Sigma @ v against w * v for the v that you took: is an eigenvector a row or a column?",
        ),
        Misconception(
            "the order of eig",
            answers.order_of_eig,
            "np.linalg.eig promises no order: sometimes your first axis is the long one. Sort, or take eigh.",
        ),
        Misconception(
            "the least of three axes",
            answers.least_of_three,
            "A flat thing is narrowest upwards, but the jaws close in the table's plane: which block of Sigma is that?",
        ),
        Misconception(
            "the middle of three axes",
            answers.middle_of_three,
            "For a tall thing the upright axis has the most spread, not the least; look at x and y alone.",
        ),
        Misconception(
            "x and y swapped",
            answers.yaw_with_x_and_y_swapped,
            "For a cloud long in x the answer is 90 degrees, and yours is 0: which argument comes first in arctan2?",
        ),
        Misconception("degrees", answers.yaw_in_degrees, "The kit's angles are radians."),
        Misconception(
            "double angle",
            answers.double_angle_not_halved,
            "Turn the object by 10 degrees: your yaw turns by 20. The formula gives twice the angle.",
        ),
        Misconception(
            "variances taken for a direction",
            answers.variances_as_a_direction,
            "Your yaw does not see the sign of Sigma[0, 1], so it cannot tell a thing from its mirror image.",
        ),
    ),
    alternatives=(
        answers.closing_yaw_formula,
        answers.closing_yaw_svd,
        answers.closing_yaw_across_the_long_axis,
        answers.closing_yaw_loop,
        answers.closing_yaw_torch,
        answers.closing_yaw_float32,
    ),
    # An axis has no sign: yaw and yaw + pi are the same grasp, and have the same double angle on the circle.
    canonical=lambda yaw: np.array([np.cos(2.0 * yaw), np.sin(2.0 * yaw)]),
    forbidden=("sklearn", "cv2"),
)


def _variance(Sigma, yaw):
    d = np.array([np.cos(yaw), np.sin(yaw)])
    return d @ Sigma[:2, :2] @ d


# ----------------------------------------------------------------------------------------------- width across the jaws


def width_across(P, yaw):
    """Measure how wide a cloud is, seen from above, in the direction at the angle yaw from x."""
    across = P[:, 0] * np.cos(yaw) + P[:, 1] * np.sin(yaw)
    return across.max() - across.min()


WIDTH_ACROSS = Question(
    name="07_grasp.width_across",
    reference=width_across,
    inputs=lambda rng: (cloud(rng), float(rng.uniform(0.2, 1.4) + rng.choice([0.0, np.pi / 2]))),
    by_hand=(
        (_RECTANGLE, 0.0),
        (_RECTANGLE, np.pi / 2),
        (_RECTANGLE[:2], np.pi / 6),  # a stick along y, 2 long, 30 degrees from x: 2 sin(30) = 1
        (_RECTANGLE[:1], 1.0),
    ),
    points=2,
    properties=(
        Property("a width is not negative", lambda arguments, width: bool(width >= 0.0)),
        Property(
            "half a turn of the jaws changes nothing",
            lambda arguments, width: np.isclose(width, width_across(arguments[0], arguments[1] + np.pi), rtol=1e-3),
        ),
    ),
    misconceptions=(
        Misconception(
            "along the pads",
            answers.width_along,
            "At yaw 0 the jaws close along x: your width is that along y.",
        ),
        Misconception(
            "turned the other way",
            answers.width_turned_the_other_way,
            "Right at 0 and 90 degrees, wrong between: the unit vector at the angle yaw is (cos, sin).",
        ),
        Misconception("degrees", answers.width_in_degrees, "The yaw comes in radians already."),
        Misconception(
            "not turned at all",
            answers.width_without_turning,
            "Your width does not depend on yaw: measure along the direction in which the jaws close.",
        ),
        Misconception(
            "four sigma",
            answers.width_by_sigma,
            "A spread is no width: the jaws must pass the outermost point, not most of them.",
        ),
        Misconception(
            "twice the furthest point",
            answers.twice_the_furthest,
            "From the outermost point on one side to the outermost on the other: the mean is not in the middle.",
        ),
        Misconception(
            "largest coordinate",
            answers.furthest_coordinate,
            "Move the object by a metre: it is as wide as before. From where to where do you measure?",
        ),
    ),
    alternatives=(answers.width_loops, answers.width_einsum, answers.width_torch, answers.width_float32),
    forbidden=("cv2", "scipy"),
)


QUESTIONS = (
    CENTROID_AND_COVARIANCE,
    CLOSING_YAW,
    WIDTH_ACROSS,
    GRASP_HEIGHT,
    GRASP_POSE,
    POINTS_IN_FINGERS,
)
