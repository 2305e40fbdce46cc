"""06_back_projection.back_projection_jacobian: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.questions.question import Property, Question, wrong
from labkit.course.questions.t06_back_projection import K_SMALL, columns, pixel


def back_projection_jacobian(u, v, d, K):
    """Differentiate P_cam(u, v, d) = d K^-1 (u, v, 1): the columns are dP/du, dP/dv and dP/dd."""
    K_inv = np.linalg.inv(K)
    return np.column_stack([d * K_inv[:, 0], d * K_inv[:, 1], K_inv @ (u, v, 1.0)])


QUESTION = Question(
    name="06_back_projection.back_projection_jacobian",
    reference=back_projection_jacobian,
    inputs=pixel,
    by_hand=((2.0, 1.0, 0.5, K_SMALL), (1.0, 0.0, 3.0, K_SMALL)),
    points=3,
    properties=(
        Property(
            "times d, the last column is the point itself",
            lambda arguments, J: np.allclose(
                arguments[2] * np.asarray(J)[:, 2],
                arguments[2] * np.linalg.solve(arguments[3], np.array([*arguments[:2], 1.0])),
                rtol=1e-3,
            ),
        ),
    ),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


@wrong(QUESTION, "Depth is measured along z: how much does z change when d grows by 1?")
def unit_ray(u, v, d, K):
    du, dv, dd = columns(u, v, d, K)
    return np.stack([du, dv, dd / np.linalg.norm(dd)], axis=1)
