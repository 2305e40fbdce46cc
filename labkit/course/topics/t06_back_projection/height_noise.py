"""06_back_projection.height_noise: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.checker.question import Question, wrong
from labkit.course.topics.t06_back_projection import K_SMALL, columns, pixel, pose, straight_ahead


def height_noise(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth):
    """Standard deviation of a point's height in the base frame, to first order, for independent noise of u, v and d."""
    K_inv = np.linalg.inv(K)
    J = np.column_stack([d * K_inv[:, 0], d * K_inv[:, 1], K_inv @ (u, v, 1.0)])
    return np.linalg.norm(T_base_cam[2, :3] @ J * (sigma_pixel, sigma_pixel, sigma_depth))


def _noisy_pixel(rng):
    return *pixel(rng), pose(rng), float(rng.uniform(0.5, 3.0)), float(rng.uniform(0.003, 0.02))


# Looks down from 2 m: its z is the base frame's -z, its x the base frame's -y.
_LOOKS_DOWN = np.array([[0.0, -1.0, 0.0, 1.0], [-1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 2.0], [0.0, 0.0, 0.0, 1.0]])


# Looks along the base frame's x axis, level.
_LOOKS_LEVEL = np.array([[0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 0.5], [0.0, 0.0, 0.0, 1.0]])


QUESTION = Question(
    reference=height_noise,
    inputs=_noisy_pixel,
    by_hand=(
        (2.0, 1.0, 0.5, K_SMALL, _LOOKS_DOWN, 0.5, 0.01),  # only depth matters: 0.01
        (2.0, 1.0, 0.5, K_SMALL, _LOOKS_LEVEL, 0.5, 0.01),  # a pixel down is 0.125 m: hypot(0.0625, 0.0025)
        (3.0, 2.0, 1.0, K_SMALL, _LOOKS_LEVEL, 0.0, 0.02),  # depth alone, off the axis: 0.5 * 0.02
    ),
    atol=1e-9,
    points=3,
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def shares(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth):
    """Give how far u, v and d each move the height, one standard deviation."""
    J = np.stack(columns(u, v, d, K), axis=1)
    return T_base_cam[2, :3] @ J * np.array([sigma_pixel, sigma_pixel, sigma_depth])


@wrong("Independent errors rarely point the same way: what adds up is not the standard deviations.")
def stds_added(*arguments):
    return np.sum(np.abs(shares(*arguments)))


@wrong("fx and fy are two numbers: which one belongs to v?")
def one_focal_length(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth):
    same = K.copy()
    same[1, 1] = K[0, 0]
    return height_noise(u, v, d, same, T_base_cam, sigma_pixel, sigma_depth)


@wrong("Two errors of independent signs do not cancel: square before you add.")
def signed_stds_added(*arguments):
    return np.abs(np.sum(shares(*arguments)))


@wrong("An error of depth moves the point along its ray, and off the optical axis that is not the z axis.")
def ray_straight_ahead(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth):
    J = straight_ahead(u, v, d, K)
    return np.linalg.norm(T_base_cam[2, :3] @ J * np.array([sigma_pixel, sigma_pixel, sigma_depth]))


@wrong("You have the whole error of the point; only its component along the base frame's z is asked for.")
def all_directions(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth):
    J = np.stack(columns(u, v, d, K), axis=1)
    return np.linalg.norm(J * (sigma_pixel, sigma_pixel, sigma_depth))


@wrong("x, y and z of the camera err together: turn the covariance, r3 J S J^T r3, not the three deviations.")
def deviations_turned(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth):
    J = np.stack(columns(u, v, d, K), axis=1)
    return abs(T_base_cam[2, :3] @ np.linalg.norm(J * (sigma_pixel, sigma_pixel, sigma_depth), axis=1))


@wrong("You count the depth alone, and along the optical axis: u and v err as well, and depth acts along q.")
def depth_straight_ahead_alone(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth):
    return abs(T_base_cam[2, 2]) * sigma_depth


@wrong("The depth alone errs in yours: u and v err as well, and move the point sideways by d / f.")
def depth_alone(*arguments):
    return abs(shares(*arguments)[2])


@wrong("Both pixel coordinates err, u and v: yours has the share of one of them.")
def errors_of_u_and_d(*arguments):
    return np.linalg.norm(shares(*arguments)[[0, 2]])


@wrong("A covariance holds squares: diag(sigma_p, sigma_p, sigma_d) is not yet the S of the lesson.")
def deviations_taken_for_variances(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth):
    return np.linalg.norm(shares(u, v, d, K, T_base_cam, np.sqrt(sigma_pixel), np.sqrt(sigma_depth)))


@wrong("Depth is measured along z: its column of J is q, whose third entry is 1, not a unit vector.")
def depth_along_a_unit_ray(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth):
    length = np.linalg.norm(columns(u, v, d, K)[2])
    return np.linalg.norm(shares(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth / length))


@wrong("By how much does a translation change the difference of two points? Noise is a difference.")
def translation_added(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth):
    J = np.vstack([np.stack(columns(u, v, d, K), axis=1), np.ones(3)])
    return np.linalg.norm(T_base_cam[2] @ J * (sigma_pixel, sigma_pixel, sigma_depth))


@wrong("That is the noise along the camera's z axis: which row of T makes heights of camera coordinates?")
def along_the_optical_axis(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth):
    return sigma_depth


@wrong("All three errors at once, in one direction, are one draw: what do independent errors do one by one?")
def all_three_at_once(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth):
    def height(u, v, d):
        return d * (T_base_cam[2, :3] @ np.linalg.inv(K) @ (u, v, 1.0))

    return abs(height(u + sigma_pixel, v + sigma_pixel, d + sigma_depth) - height(u, v, d))
