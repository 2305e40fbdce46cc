"""06_back_projection.intrinsics: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.questions.question import Property, Question, wrong
from labkit.course.questions.t06_back_projection import K_of


def intrinsics(fov_y, width, height):
    """Write K for a vertical field of view; the principal point is where the simulator's renderer has it."""
    f = height / (2.0 * np.tan(fov_y / 2.0))
    return np.array([[f, 0.0, width / 2.0], [0.0, f, height / 2.0 - 1.0], [0.0, 0.0, 1.0]])


QUESTION = Question(
    name="06_back_projection.intrinsics",
    reference=intrinsics,
    inputs=lambda rng: (float(rng.uniform(0.5, 1.3)), int(rng.integers(200, 700)), int(rng.integers(80, 190)) * 2),
    by_hand=((np.pi / 2.0, 320, 240), (2.0 * np.arctan(0.5), 640, 480)),
    rtol=1e-5,  # half a pixel of the principal point shall show
    points=2,
    properties=(
        Property("the last row of K is 0, 0, 1", lambda arguments, K: np.array_equal(np.asarray(K)[2], [0, 0, 1])),
    ),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def focal_length(fov, pixels):
    return pixels / (2.0 * np.tan(fov / 2.0))


def with_centre(fov_y, width, height, cx, cy):
    f = focal_length(fov_y, height)
    return K_of(f, f, cx, cy)


@wrong(QUESTION, "fov_y opens upwards and downwards: which side of the image does it span, H or W?")
def horizontal_field_of_view(fov_y, width, height):
    f = focal_length(fov_y, width)
    return K_of(f, f, width / 2.0, height / 2.0 - 1.0)


@wrong(QUESTION, "Square pixels have fx = fy; fov_y belongs to the height alone, and the width sees a larger angle.")
def two_focal_lengths(fov_y, width, height):
    return K_of(focal_length(fov_y, width), focal_length(fov_y, height), width / 2.0, height / 2.0 - 1.0)


@wrong(
    QUESTION, "A good rule for many cameras, but this renderer was measured: read the principal point in the docstring."
)
def principal_point_in_the_middle_of_the_pixels(fov_y, width, height):
    return with_centre(fov_y, width, height, (width - 1) / 2, (height - 1) / 2)


@wrong(QUESTION, "u runs along the width: in which row of K does W / 2 belong?")
def cx_and_cy_swapped(fov_y, width, height):
    return with_centre(fov_y, width, height, height / 2 - 1, width / 2)
