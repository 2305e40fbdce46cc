"""06_back_projection.transform_points: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.questions.question import Property, Question, wrong
from labkit.course.questions.t06_back_projection import pose


def transform_points(T, P):
    """Apply a rigid transform to points, P -> R P + t."""
    return P @ T[:3, :3].T + T[:3, 3]


def _pose_and_points(rng):
    P = rng.normal(size=(int(rng.integers(4, 7)), int(rng.integers(8, 11)), 3))
    P[1, 2] = np.nan
    return pose(rng), P


QUESTION = Question(
    name="06_back_projection.transform_points",
    reference=transform_points,
    inputs=_pose_and_points,
    by_hand=(
        (np.array([[0.0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]), np.array([[1.0, 0.0, 0.0]])),
        (
            np.array([[0.0, -1, 0, 0.5], [-1, 0, 0, 0], [0, 0, -1, 2], [0, 0, 0, 1]]),
            np.array([[[0.0, 0, 0], [0, 0, 2]]]),
        ),
    ),
    points=2,
    properties=(
        Property(
            "distances between points stay as they are",
            lambda arguments, P: np.allclose(
                np.linalg.norm(np.diff(P, axis=-2), axis=-1),
                np.linalg.norm(np.diff(arguments[1], axis=-2), axis=-1),
                rtol=1e-3,
                equal_nan=True,
            ),
        ),
    ),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


@wrong(QUESTION, "Rotate first, then translate: what does T (0, 0, 0, 1) give?")
def translated_first(T, P):
    return (P + T[:3, 3]) @ T[:3, :3].T
