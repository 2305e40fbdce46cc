"""07_grasp.width_across: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.questions.question import Property, Question, wrong
from labkit.course.questions.t07_grasp import RECTANGLE, cloud


def width_across(P, yaw):
    """Measure how wide a cloud is, seen from above, in the direction at the angle yaw from x."""
    across = P[:, 0] * np.cos(yaw) + P[:, 1] * np.sin(yaw)
    return across.max() - across.min()


QUESTION = Question(
    name="07_grasp.width_across",
    reference=width_across,
    inputs=lambda rng: (cloud(rng), float(rng.uniform(0.2, 1.4) + rng.choice([0.0, np.pi / 2]))),
    by_hand=(
        (RECTANGLE, 0.0),
        (RECTANGLE, np.pi / 2),
        (RECTANGLE[:2], np.pi / 6),  # a stick along y, 2 long, 30 degrees from x: 2 sin(30) = 1
        (RECTANGLE[:1], 1.0),
        (RECTANGLE - RECTANGLE.mean(axis=0), 0.5),  # to both sides of the origin
    ),
    points=2,
    properties=(
        Property("a width is not negative", lambda arguments, width: bool(width >= 0.0)),
        Property(
            "half a turn of the jaws changes nothing",
            lambda arguments, width: np.isclose(width, width_across(arguments[0], arguments[1] + np.pi), rtol=1e-3),
        ),
    ),
    forbidden=("cv2", "scipy"),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def extent(values):
    return values.max() - values.min()


@wrong(QUESTION, "Your width does not depend on yaw: measure along the direction in which the jaws close.")
def width_without_turning(P, yaw):
    return max(extent(P[:, 0]), extent(P[:, 1]))


@wrong(QUESTION, "A spread is no width: the jaws must pass the outermost point, not most of them.")
def width_by_sigma(P, yaw):
    return 4.0 * (P[:, 0] * np.cos(yaw) + P[:, 1] * np.sin(yaw)).std()


@wrong(QUESTION, "From the outermost point on one side to the outermost on the other: the mean is not in the middle.")
def twice_the_furthest(P, yaw):
    across = P[:, 0] * np.cos(yaw) + P[:, 1] * np.sin(yaw)
    return 2.0 * np.abs(across - across.mean()).max()


@wrong(QUESTION, "Move the object by a metre: it is as wide as before. From where to where do you measure?")
def furthest_coordinate(P, yaw):
    return (P[:, 0] * np.cos(yaw) + P[:, 1] * np.sin(yaw)).max()
