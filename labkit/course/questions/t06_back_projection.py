"""Questions of topic 06: K, points from pixels, rigid transforms, the Jacobian, and what depth noise does to a height.

Section 4 and problem 4 of the text.
"""

import numpy as np

from labkit.course.questions import answers_06 as answers
from labkit.course.questions.question import Misconception, Property, Question

# ------------------------------------------------------------------------------------------ K by hand


def intrinsics(fov_y, width, height):
    """Write K for a vertical field of view; the principal point is where the simulator's renderer has it."""
    f = height / (2.0 * np.tan(fov_y / 2.0))
    return np.array([[f, 0.0, width / 2.0], [0.0, f, height / 2.0 - 1.0], [0.0, 0.0, 1.0]])


INTRINSICS = Question(
    name="06_back_projection.intrinsics",
    reference=intrinsics,
    inputs=lambda rng: (float(rng.uniform(0.5, 1.3)), int(rng.integers(200, 700)), int(rng.integers(80, 190)) * 2),
    by_hand=((np.pi / 2.0, 320, 240), (2.0 * np.arctan(0.5), 640, 480)),
    rtol=1e-5,  # half a pixel of the principal point shall show
    points=2,
    properties=(
        Property("the last row of K is 0, 0, 1", lambda arguments, K: np.array_equal(np.asarray(K)[2], [0, 0, 1])),
    ),
    misconceptions=(
        Misconception(
            "the field of view is taken for horizontal",
            answers.horizontal_field_of_view,
            "fov_y opens upwards and downwards: which side of the image does it span, H or W?",
        ),
        Misconception(
            "two focal lengths from one angle",
            answers.two_focal_lengths,
            "Square pixels have fx = fy; fov_y belongs to the height alone, and the width sees a larger angle.",
        ),
        Misconception(
            "degrees",
            lambda fov_y, width, height: intrinsics(np.radians(fov_y), width, height),
            "The angle comes in radians, and NumPy's functions take radians.",
        ),
        Misconception(
            "the whole angle",
            answers.whole_angle,
            "Draw the triangle from the camera to the image's upper half: which angle does it have at the camera?",
        ),
        Misconception(
            "principal point in the middle of the pixels",
            lambda fov_y, width, height: answers.with_centre(fov_y, width, height, (width - 1) / 2, (height - 1) / 2),
            "A good rule for many cameras, but this renderer was measured: read the principal point in the docstring.",
        ),
        Misconception(
            "cx and cy swapped",
            lambda fov_y, width, height: answers.with_centre(fov_y, width, height, height / 2 - 1, width / 2),
            "u runs along the width: in which row of K does W / 2 belong?",
        ),
        Misconception(
            "transposed",
            lambda *arguments: intrinsics(*arguments).T,
            "K is upper triangular: K (x, y, z) = z (u, v, 1).",
        ),
    ),
    alternatives=(answers.intrinsics_product, answers.intrinsics_float32, answers.intrinsics_torch),
)

# ------------------------------------------------------------------------------------------ back-projection


def back_project(depth, K):
    """Turn a depth image into an image of camera-frame points, d K^-1 (u, v, 1); NaN where there is no reading."""
    H, W = depth.shape
    v, u = np.mgrid[0:H, 0:W]
    rays = np.stack([u, v, np.ones((H, W))], axis=-1) @ np.linalg.inv(K).T
    return np.where(depth > 0.0, depth, np.nan)[..., None] * rays


def _camera(rng, H, W):
    """Draw an intrinsic matrix with unequal focal lengths and a principal point off the middle; no skew."""
    fx, fy = rng.uniform(0.8, 1.1) * W, rng.uniform(1.2, 1.6) * W
    return np.array([[fx, 0.0, rng.uniform(0.4, 0.6) * W], [0.0, fy, rng.uniform(0.3, 0.5) * H], [0.0, 0.0, 1.0]])


def _depth_image(rng):
    """Draw depths of 0.3 to 2 m, some without a reading in either spelling, 0 and NaN; H != W."""
    H, W = int(rng.integers(6, 10)), int(rng.integers(11, 16))
    depth = rng.uniform(0.3, 2.0, (H, W)).astype(np.float32)
    depth[rng.random((H, W)) < 0.15] = 0.0
    depth[rng.random((H, W)) < 0.1] = np.nan
    return depth, _camera(rng, H, W)


BACK_PROJECT = Question(
    name="06_back_projection.back_project",
    reference=back_project,
    inputs=_depth_image,
    by_hand=(
        (np.array([[0.5, 0.0, 0.5]]), np.array([[2.0, 0.0, 1.0], [0.0, 4.0, 0.0], [0.0, 0.0, 1.0]])),
        (
            np.array([[2.0, np.nan], [1.0, 4.0], [0.0, 2.0]]),
            np.array([[4.0, 0.0, 0.0], [0.0, 2.0, 1.0], [0.0, 0.0, 1.0]]),
        ),
    ),
    points=3,
    properties=(
        Property(
            "the third coordinate, z, is the depth itself",
            lambda arguments, P: np.allclose(
                P[..., 2], np.where(arguments[0] > 0, arguments[0], np.nan), equal_nan=True
            ),
        ),
    ),
    misconceptions=(
        Misconception(
            "u taken for the row",
            answers.u_is_the_row,
            "Your cloud is mirrored and sheared: u counts columns, v counts rows, and the array is indexed [v, u].",
        ),
        Misconception(
            "depth taken for the length of the ray",
            answers.length_of_the_ray,
            "A wall seen head-on has one depth, and it must come out flat: is z the depth, or the length of the ray?",
        ),
        Misconception(
            "pixel centres at halves",
            answers.centres_at_halves,
            "You are off by half a pixel: in this kit the first pixel's centre is at u = v = 0.",
        ),
        Misconception(
            "holes become points at the camera",
            answers.holes_at_the_camera,
            "0 and NaN mean that nothing was read: such a pixel has no point, and (0, 0, 0) is one.",
        ),
        Misconception(
            "K not inverted", answers.K_not_inverted, "K takes a point to a pixel; which way do you want to go?"
        ),
        Misconception(
            "one focal length for both",
            answers.one_focal_length,
            "x is right and y is not: which entry of K belongs to the rows?",
        ),
        Misconception(
            "OpenGL's axes",
            answers.opengl_axes,
            "Your cloud lies behind the camera: here x points right, y down and z forward.",
        ),
        Misconception(
            "reshaped instead of transposed",
            answers.reshaped,
            "The numbers are right and stand in the wrong places: reshape does not move an axis.",
        ),
    ),
    alternatives=(
        answers.back_project_closed_form,
        answers.back_project_loops,
        answers.back_project_einsum,
        answers.back_project_torch,
    ),
)

# ------------------------------------------------------------------------------------------ rigid transforms


def transform_points(T, P):
    """Apply a rigid transform to points, P -> R P + t."""
    return P @ T[:3, :3].T + T[:3, 3]


def _pose(rng):
    """Draw a general pose: a rotation about a slanted axis, and a translation of up to a metre."""
    Q, R = np.linalg.qr(rng.normal(size=(3, 3)))
    Q *= np.sign(np.diagonal(R))
    Q[:, 0] *= np.linalg.det(Q)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Q, rng.uniform(0.2, 1.0, 3) * rng.choice([-1.0, 1.0], 3)
    return T


def _pose_and_points(rng):
    P = rng.normal(size=(int(rng.integers(4, 7)), int(rng.integers(8, 11)), 3))
    P[1, 2] = np.nan
    return _pose(rng), P


TRANSFORM_POINTS = Question(
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
    misconceptions=(
        Misconception(
            "rotation transposed",
            answers.rotation_transposed,
            "Points in rows stand left of the matrix: compare one row of your result with R @ p for that point.",
        ),
        Misconception("no translation", answers.no_translation, "Where does the camera's own position (0, 0, 0) land?"),
        Misconception(
            "translated first", answers.translated_first, "Rotate first, then translate: what does T (0, 0, 0, 1) give?"
        ),
        Misconception(
            "the inverse",
            answers.inverse,
            "You went from base to camera coordinates, as a view matrix does: where must (0, 0, 0) land?",
        ),
        Misconception(
            "rows taken for columns",
            answers.row_major,
            "The last row of T is 0 0 0 1, and the translation stands in the last column: which did you read?",
        ),
        Misconception(
            "translation subtracted", answers.translation_subtracted, "Check the sign: (0, 0, 0) must land on t."
        ),
    ),
    alternatives=(
        answers.transform_homogeneous,
        answers.transform_einsum,
        answers.transform_loops,
        answers.transform_torch,
    ),
)

# ------------------------------------------------------------------------------------------ the Jacobian


def back_projection_jacobian(u, v, d, K):
    """Differentiate P_cam(u, v, d) = d K^-1 (u, v, 1): the columns are dP/du, dP/dv and dP/dd."""
    K_inv = np.linalg.inv(K)
    return np.column_stack([d * K_inv[:, 0], d * K_inv[:, 1], K_inv @ (u, v, 1.0)])


def _pixel(rng):
    H, W = 120, 160
    return float(rng.uniform(5, 50)), float(rng.uniform(70, 115)), float(rng.uniform(0.4, 1.6)), _camera(rng, H, W)


_K_SMALL = np.array([[2.0, 0.0, 1.0], [0.0, 4.0, 0.0], [0.0, 0.0, 1.0]])

JACOBIAN = Question(
    name="06_back_projection.back_projection_jacobian",
    reference=back_projection_jacobian,
    inputs=_pixel,
    by_hand=((2.0, 1.0, 0.5, _K_SMALL), (1.0, 0.0, 3.0, _K_SMALL)),
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
    misconceptions=(
        Misconception(
            "transposed",
            lambda *arguments: answers.jacobian_closed_form(*arguments).T,
            "Each column is one derivative, of all three coordinates; you have it in a row.",
        ),
        Misconception(
            "columns in another order", answers.depth_first, "The columns' order is u, v, d: which of yours is the ray?"
        ),
        Misconception(
            "pixel columns without depth",
            answers.without_depth,
            "One pixel to the right: is that the same step in metres at 0.5 m as at 2 m?",
        ),
        Misconception(
            "last column times d", answers.depth_times_ray, "That is the point. P is linear in d: what stands beside d?"
        ),
        Misconception(
            "unit ray", answers.unit_ray, "Depth is measured along z: how much does z change when d grows by 1?"
        ),
        Misconception("K for its inverse", answers.times_K, "In which direction does K lead, and in which does P?"),
        Misconception(
            "ray straight ahead",
            answers.straight_ahead,
            "Only on the optical axis does depth move a point along z alone; where is this pixel?",
        ),
    ),
    alternatives=(
        answers.jacobian_closed_form,
        answers.jacobian_differences,
        answers.jacobian_torch,
        answers.jacobian_float32,
    ),
)

# ------------------------------------------------------------------------------------------ noise of the height


def height_noise(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth):
    """Standard deviation of a point's height in the base frame, to first order, for independent noise of u, v and d."""
    K_inv = np.linalg.inv(K)
    J = np.column_stack([d * K_inv[:, 0], d * K_inv[:, 1], K_inv @ (u, v, 1.0)])
    return np.linalg.norm(T_base_cam[2, :3] @ J * (sigma_pixel, sigma_pixel, sigma_depth))


def _noisy_pixel(rng):
    return *_pixel(rng), _pose(rng), float(rng.uniform(0.5, 3.0)), float(rng.uniform(0.003, 0.02))


# Looks down from 2 m: its z is the base frame's -z, its x the base frame's -y.
_LOOKS_DOWN = np.array([[0.0, -1.0, 0.0, 1.0], [-1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 2.0], [0.0, 0.0, 0.0, 1.0]])
# Looks along the base frame's x axis, level.
_LOOKS_LEVEL = np.array([[0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 0.5], [0.0, 0.0, 0.0, 1.0]])

HEIGHT_NOISE = Question(
    name="06_back_projection.height_noise",
    reference=height_noise,
    inputs=_noisy_pixel,
    by_hand=(
        (2.0, 1.0, 0.5, _K_SMALL, _LOOKS_DOWN, 0.5, 0.01),  # only depth matters: 0.01
        (2.0, 1.0, 0.5, _K_SMALL, _LOOKS_LEVEL, 0.5, 0.01),  # a pixel down is 0.125 m: hypot(0.0625, 0.0025)
        (3.0, 2.0, 1.0, _K_SMALL, _LOOKS_LEVEL, 0.0, 0.02),  # depth alone, off the axis: 0.5 * 0.02
    ),
    rtol=1e-4,
    atol=1e-9,
    points=3,
    misconceptions=(
        Misconception("variance", answers.variance, "Check the unit: square metres, or metres?"),
        Misconception(
            "standard deviations added",
            answers.stds_added,
            "Independent errors rarely point the same way: what adds up is not the standard deviations.",
        ),
        Misconception(
            "signed deviations added",
            answers.signed_stds_added,
            "Two errors of independent signs do not cancel: square before you add.",
        ),
        Misconception(
            "along the camera's z",
            answers.along_the_camera,
            "Height is the base frame's z: turn the camera and it changes. Where does T_base_cam come in?",
        ),
        Misconception(
            "a column of the rotation",
            answers.column_of_the_rotation,
            "z of the base frame is one number of R P + t: does a row or a column of R make it?",
        ),
        Misconception(
            "pixel noise forgotten",
            answers.depth_only,
            "With sigma_depth = 0 you get no noise at all: what of u and v?",
        ),
        Misconception(
            "depth moves the point straight ahead",
            answers.ray_straight_ahead,
            "An error of depth moves the point along its ray, and off the optical axis that is not the z axis.",
        ),
        Misconception(
            "noise in all directions",
            answers.all_directions,
            "You have the whole error of the point; only its component along the base frame's z is asked for.",
        ),
    ),
    alternatives=(
        answers.height_noise_covariance,
        answers.height_noise_loops,
        answers.height_noise_einsum,
        answers.height_noise_torch,
    ),
)

QUESTIONS = (INTRINSICS, BACK_PROJECT, TRANSFORM_POINTS, JACOBIAN, HEIGHT_NOISE)
