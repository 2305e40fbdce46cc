"""06_back_projection.height_noise: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labcourse.kinds import intrinsics, number, pose, poses
from labcourse.questions.t06_back_projection import K_SMALL, K_of, columns, pixel, straight_ahead
from labgrader.question import Question, wrong


def height_noise(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth, sigma_tilt):
    """Standard deviation of a point's height, to first order: noise of u, v, d and of the camera's turn about its x."""
    K_inv = np.linalg.inv(K)
    q = K_inv @ (u, v, 1.0)
    J = np.column_stack([d * K_inv[:, 0], d * K_inv[:, 1], q, d * np.array([0.0, -q[2], q[1]])])
    return np.linalg.norm(T_base_cam[2, :3] @ J * (sigma_pixel, sigma_pixel, sigma_depth, sigma_tilt))


def _noisy_pixel(rng):
    noise = rng.uniform((0.5, 0.003, 0.01), (3.0, 0.02, 0.05))
    return *pixel(rng), pose(rng), *(float(sigma) for sigma in noise)


def _any_camera(rng):
    """Draw a pixel of a large picture, its depth, a camera, its pose, and noise of which each kind counts."""
    u, v, d = map(float, rng.uniform((0.0, 0.0, 0.1), (4000.0, 4000.0, 100.0)))
    return u, v, d, intrinsics().draw(rng), pose(rng), *map(float, rng.uniform(0.0, (100.0, 10.0, 1.0)))


# Looks down from 2 m: its z is the base frame's -z, its x the base frame's -y.
_LOOKS_DOWN = np.array([[0.0, -1.0, 0.0, 1.0], [-1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 2.0], [0.0, 0.0, 0.0, 1.0]])
# Looks along the base frame's x axis, level.
_LOOKS_LEVEL = np.array([[0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 0.5], [0.0, 0.0, 0.0, 1.0]])
# Looks along the base frame's y axis, its own x up.
_ON_ITS_SIDE = np.array([[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 0.0, 0.5], [0.0, 0.0, 0.0, 1.0]])
# No axis is level, and neither is it in the second, which is turned round.
_SLANTED = np.array([[0.8, 0.36, 0.48, 0.1], [0.0, 0.8, -0.6, 0.2], [-0.6, 0.48, 0.64, 0.3], [0.0, 0.0, 0.0, 1.0]])
_TURNED_OVER = np.diag([1.0, -1.0, -1.0, 1.0]) @ _SLANTED


QUESTION = Question(
    reference=height_noise,
    kinds={
        "u": number(0.0, 4000.0, says="0 to 4000", free=("a thousandth*",)),
        "v": number(0.0, 4000.0, says="0 to 4000", free=("a thousandth*",)),
        "d": number(0.01, 100.0, says="0.01 to 100"),
        "K": intrinsics(),
        "T_base_cam": poses(free=("*at ?0, *", "*at ?1, *", "*at ?3, *", "*at ?2, 3]")),
        "sigma_pixel": number(0.0, 100.0, says="0 to 100"),
        "sigma_depth": number(0.0, 10.0, says="0 to 10"),
        "sigma_tilt": number(0.0, 1.0, says="0 to 1"),
    },
    inputs=(_noisy_pixel, _any_camera),
    by_hand=(
        (2.0, 1.0, 0.5, K_SMALL, _LOOKS_DOWN, 0.5, 0.01, 0.0),  # only depth matters: 0.01
        (2.0, 1.0, 0.5, K_SMALL, _LOOKS_DOWN, 0.5, 0.01, 0.1),  # y is 0.125 m: hypot(0.01, 0.0125)
        (2.0, 1.0, 0.5, K_SMALL, _LOOKS_LEVEL, 0.5, 0.01, 0.0),  # a pixel down is 0.125 m: hypot(0.0625, 0.0025)
        (3.0, 2.0, 1.0, K_SMALL, _LOOKS_LEVEL, 0.0, 0.02, 0.05),  # hypot(0.5 * 0.02, 1 * 0.05)
        (2.0, 2.0, 1.0, K_SMALL, _SLANTED, 0.0, 0.1, 0.0),  # 0.1 (-0.3 + 0.24 + 0.64)
        (2.0, 2.0, 1.0, K_SMALL, _TURNED_OVER, 0.0, 0.0, 0.1),  # 0.1 (-0.64 * 0.5 + 0.48)
        # far off the axis, and each noise at its largest: 100 / 20 (0.6, 0.48), 10 * 0.16 and 100 * 0.48
        (4000.0, 3000.0, 100.0, K_of(2000.0, 2000.0, 0.0, 0.0), _TURNED_OVER, 100.0, 10.0, 1.0),
        # near the axis: 0.01 * 0.0002, 0.01 * 0.1001; a hundredth of a pixel, near: 0.0126 * 0.0124 / 4
        (1.0006, 0.0, 0.5, K_of(2.0, 4.0, 1.0002, 0.0), _ON_ITS_SIDE, 0.0, 0.01, 0.0),
        (0.0, 3900.4004, 0.5, K_of(2.0, 4.0, 1.0, 3900.0), _LOOKS_LEVEL, 0.0, 0.01, 0.0),
        (2.0, 1.0, 0.0124, K_SMALL, _LOOKS_LEVEL, 0.0126, 0.0, 0.0),
    ),
    edges=4,
    atol=1e-9,
    points=3,
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def turned_about(axis, P):
    """How a point moves, per radian, when the camera turns about an axis of its own."""
    return np.cross(np.eye(3)[axis], P)


def shares(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth, sigma_tilt, moves=columns, axis=0):
    """Give how far u, v, d and the tilt each move the height, one standard deviation."""
    J = jacobian(u, v, d, K, moves, axis)
    return T_base_cam[2, :3] @ J * (sigma_pixel, sigma_pixel, sigma_depth, sigma_tilt)


def jacobian(u, v, d, K, moves=columns, axis=0):
    du, dv, q = moves(u, v, d, K)
    return np.stack([du, dv, q, turned_about(axis, d * np.linalg.inv(K) @ (u, v, 1.0))], axis=1)


@wrong("The camera turns about its own x axis: a point's x stays, and y and z change.", axis=(1, 2))
def another_axis_of_the_camera(*arguments, axis):
    return np.linalg.norm(shares(*arguments, axis=axis))


@wrong(
    "The camera's own x axis is meant, not the base frame's: turn P_cam before T takes it to the base frame.",
    through=(0.0, 1.0),  # the camera's place, or the base frame's
)
def about_the_base_frames_x(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth, sigma_tilt, through):
    noise = shares(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth, sigma_tilt)
    P_base = (T_base_cam @ [*(d * np.linalg.inv(K) @ (u, v, 1.0)), through])[:3]
    return np.hypot(np.linalg.norm(noise[:3]), turned_about(0, P_base)[2] * sigma_tilt)


@wrong("A turn about x moves both y and z: by -z and y for each radian. Yours has one of the two.", kept=(1, 2))
def one_part_of_the_turn(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth, sigma_tilt, kept):
    noise = shares(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth, sigma_tilt)
    moved = turned_about(0, d * np.linalg.inv(K) @ (u, v, 1.0))[kept]
    return np.hypot(np.linalg.norm(noise[:3]), T_base_cam[2, kept] * moved * sigma_tilt)


@wrong("y and z move in opposite senses when the camera turns: one of the two entries, -z and y, has a minus.")
def turn_without_the_minus(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth, sigma_tilt):
    noise = shares(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth, sigma_tilt)
    _, y, z = d * np.linalg.inv(K) @ (u, v, 1.0)
    return np.hypot(np.linalg.norm(noise[:3]), T_base_cam[2, :3] @ (0.0, z, y) * sigma_tilt)


@wrong("The point turns, not its ray: for each radian it moves by its own y and z, which grow with the depth d.")
def ray_turned(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth, sigma_tilt):
    noise = shares(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth, sigma_tilt)
    return np.hypot(np.linalg.norm(noise[:3]), noise[3] / d)


@wrong("A tilt moves the point by -z and y along the camera's y and z: how much of that is height? r3 decides.")
def whole_way_of_the_tilt(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth, sigma_tilt):
    noise = shares(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth, sigma_tilt)
    moved = turned_about(0, d * np.linalg.inv(K) @ (u, v, 1.0))
    return np.hypot(np.linalg.norm(noise[:3]), np.linalg.norm(moved) * sigma_tilt)


@wrong(
    "A tilt moves the point by -z and y along the camera's y and z: how much of that is height? r3 decides.",
    part=(1, 2),
)
def one_way_of_the_tilt(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth, sigma_tilt, part):
    noise = shares(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth, sigma_tilt)
    moved = turned_about(0, d * np.linalg.inv(K) @ (u, v, 1.0))
    return np.hypot(np.linalg.norm(noise[:3]), moved[part] * sigma_tilt)


@wrong("You count the height of the turned point. An error is a change: by how much does the turn change the height?")
def turned_point_itself(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth, sigma_tilt):
    noise = shares(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth, sigma_tilt)
    P = d * np.linalg.inv(K) @ (u, v, 1.0)
    c, s = np.cos(sigma_tilt), np.sin(sigma_tilt)
    turned = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]) @ P
    return np.hypot(np.linalg.norm(noise[:3]), T_base_cam[2, :3] @ turned)


@wrong("The noise is that of small turns. One radian is not a small step for a difference.")
def differences_over_a_radian(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth, sigma_tilt):
    return height_noise(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth, np.sin(1.0) * sigma_tilt)


@wrong("sigma_tilt is in radians already.")
def tilt_in_degrees(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth, sigma_tilt):
    return height_noise(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth, np.radians(sigma_tilt))


@wrong("The tilt is an error like the others and independent of them: square its share before you add.")
def tilt_added_outside_of_the_root(*arguments):
    noise = shares(*arguments)
    return np.linalg.norm(noise[:3]) + abs(noise[3])


@wrong("Independent errors rarely point the same way: what adds up is not the standard deviations.")
def stds_added(*arguments):
    return np.sum(np.abs(shares(*arguments)))


@wrong("fx and fy are two numbers: which one belongs to v?")
def one_focal_length(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth, sigma_tilt):
    same = K.copy()
    same[1, 1] = K[0, 0]
    return height_noise(u, v, d, same, T_base_cam, sigma_pixel, sigma_depth, sigma_tilt)


@wrong("Two errors with independent signs do not cancel: square before you add.")
def signed_stds_added(*arguments):
    return np.abs(np.sum(shares(*arguments)))


@wrong("u and v err independently: their shares do not cancel, and each is squared before they are added.")
def pixel_errors_together(*arguments):
    noise = shares(*arguments)
    return np.linalg.norm([noise[0] + noise[1], *noise[2:]])


def straight(u, v, d, K):
    return straight_ahead(u, v, d, K).T


@wrong("An error of depth moves the point along its ray, and off the optical axis that is not the z axis.")
def ray_straight_ahead(*arguments):
    return np.linalg.norm(shares(*arguments, moves=straight))


@wrong("You have the whole error of the point; the task asks only for its component along the base frame's z.")
def all_directions(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth, sigma_tilt):
    return np.linalg.norm(jacobian(u, v, d, K) * (sigma_pixel, sigma_pixel, sigma_depth, sigma_tilt))


@wrong("x, y and z of the camera err together: turn the covariance, r3 J S J^T r3, not the three deviations.")
def deviations_turned(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth, sigma_tilt):
    J = jacobian(u, v, d, K)
    return abs(T_base_cam[2, :3] @ np.linalg.norm(J * (sigma_pixel, sigma_pixel, sigma_depth, sigma_tilt), axis=1))


FOUR_ERRORS = "There are four errors: u and v move the point sideways, d along its ray, and the tilt turns it about x."


@wrong(FOUR_ERRORS, kept=((2,), (2, 3), (0, 2, 3), (1, 2, 3), (0, 1, 3), (3,)))
def some_errors_alone(*arguments, kept):
    return np.linalg.norm(shares(*arguments)[list(kept)])


@wrong("A covariance contains squares: diag(sigma_p, sigma_p, sigma_d, sigma_t) is not yet S.")
def deviations_taken_for_variances(u, v, d, K, T_base_cam, *sigmas):
    return np.linalg.norm(shares(u, v, d, K, T_base_cam, *np.sqrt(sigmas)))


@wrong("Depth is measured along z: its column of J is q, whose third entry is 1, not a unit vector.")
def depth_along_a_unit_ray(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth, sigma_tilt):
    length = np.linalg.norm(columns(u, v, d, K)[2])
    return np.linalg.norm(shares(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth / length, sigma_tilt))


@wrong("Noise is a difference of two points, and a translation changes no difference. Where do you use it?")
def translation_added(u, v, d, K, T_base_cam, *sigmas):
    J = np.vstack([jacobian(u, v, d, K), np.ones(4)])
    return np.linalg.norm(T_base_cam[2] @ J * (sigmas[0], *sigmas))


@wrong("That is the noise along the camera's z axis: which row of T makes heights of camera coordinates?")
def along_the_optical_axis(u, v, d, K, T_base_cam, *sigmas):
    return np.linalg.norm(jacobian(u, v, d, K)[2] * (sigmas[0], *sigmas))
