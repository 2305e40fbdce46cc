"""06_back_projection.back_project: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.checker.question import Question, wrong
from labkit.course.topics.t06_back_projection import K_SMALL, K_of, camera


def back_project(depth, K):
    """Turn a depth image into an image of camera-frame points, d K^-1 (u, v, 1); NaN where there is no reading."""
    H, W = depth.shape
    v, u = np.mgrid[0:H, 0:W]
    rays = np.stack([u, v, np.ones((H, W))], axis=-1) @ np.linalg.inv(K).T
    return np.where(depth > 0.0, depth, np.nan)[..., None] * rays


def _depth_image(rng):
    """Draw depths of 0.3 to 2 m, some without a reading in either spelling, 0 and NaN; H != W."""
    H, W = int(rng.integers(6, 10)), int(rng.integers(11, 16))
    depth = rng.uniform(0.3, 2.0, (H, W)).astype(np.float32)
    depth[rng.random((H, W)) < 0.15] = 0.0
    depth[rng.random((H, W)) < 0.1] = np.nan
    return depth, camera(rng, H, W)


QUESTION = Question(
    reference=back_project,
    inputs=_depth_image,
    by_hand=(
        (np.array([[0.5, 0.0, 0.5]]), K_SMALL),
        (np.array([[2.0, np.nan], [1.0, 4.0], [0.0, 2.0]]), K_of(4.0, 2.0, 0.0, 1.0)),
        (np.array([[1.0, 2.0], [2.0, 4.0]]), K_SMALL),  # no holes
    ),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def rays(shape, K, offset=0.0):
    """Give q(u, v) for every pixel of an image; offset is added to both pixel coordinates."""
    v, u = np.mgrid[: shape[0], : shape[1]] + offset
    return np.dstack([(u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1], np.ones(shape)])


def holes(depth):
    return np.where(depth > 0.0, depth, np.nan)[..., None]


@wrong("Your cloud is mirrored and sheared: u counts columns, v counts rows, and the array is indexed [v, u].")
def u_is_the_row(depth, K):
    return holes(depth) * rays(depth.shape[::-1], K).swapaxes(0, 1)


@wrong("A wall seen head-on has one depth, and it must come out flat: is z the depth, or the length of the ray?")
def length_of_the_ray(depth, K):
    q = rays(depth.shape, K)
    return holes(depth) * q / np.linalg.norm(q, axis=-1, keepdims=True)


@wrong("You are off by half a pixel: in this kit the first pixel's centre is at u = v = 0.")
def centres_at_halves(depth, K):
    return holes(depth) * rays(depth.shape, K, 0.5)


@wrong("You are off by a pixel: the first one has u = v = 0, not 1.")
def counted_from_one(depth, K):
    return holes(depth) * rays(depth.shape, K, 1.0)


@wrong("u and x go with fx and cx, the first row of K; v and y go with fy and cy.")
def focal_lengths_exchanged(depth, K):
    return back_project(depth, K_of(K[1, 1], K[0, 0], K[0, 2], K[1, 2]))


@wrong("x is right and y is not: which entry of K belongs to the rows?")
def one_focal_length(depth, K):
    return back_project(depth, K_of(K[0, 0], K[0, 0], K[0, 2], K[1, 2]))


@wrong("Your cloud lies behind the camera: here x points right, y down and z forward.")
def opengl_axes(depth, K):
    return back_project(depth, K) * (1.0, -1.0, -1.0)


@wrong("The numbers are right and stand in the wrong places: reshape does not move an axis.")
def reshaped(depth, K):
    return np.moveaxis(back_project(depth, K), -1, 0).reshape(*depth.shape, 3)


@wrong("A hole has no point: its z is NaN as well, not 0.")
def holes_at_depth_zero(depth, K):
    P = back_project(depth, K)
    P[..., 2] = depth
    return P


@wrong("The optical axis meets the image at (cx, cy), where x and y are 0: from where do you count u and v?")
def counted_from_the_first_pixel(depth, K):
    return back_project(depth, K_of(K[0, 0], K[1, 1], 0.0, 0.0))


@wrong("The principal point is what K says, cx and cy; it need not be the middle of the image.")
def middle_of_the_image(depth, K):
    H, W = depth.shape
    return back_project(depth, K_of(K[0, 0], K[1, 1], (W - 1) / 2, (H - 1) / 2))


@wrong("A hole has no point: its x and y are NaN as well, not 0.")
def holes_without_z_alone(depth, K):
    P = np.nan_to_num(back_project(depth, K))
    P[..., 2:] = holes(depth)
    return P


@wrong("np.meshgrid with indexing='ij' stands on its side, and reshape does not turn it: which axis is u?")
def grid_on_its_side(depth, K):
    return holes(depth) * rays(depth.shape, K).swapaxes(0, 1).reshape(*depth.shape, 3)


@wrong("An image of points is asked for, one at each pixel's place: what stands where there is no reading?")
def list_of_points(depth, K):
    return (holes(depth) * rays(depth.shape, K))[depth > 0.0]
