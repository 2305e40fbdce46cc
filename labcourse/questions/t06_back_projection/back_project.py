"""06_back_projection.back_project: the question, and wrong answers with the hints that they earn."""

from functools import partial

import numpy as np

from labcourse.kinds import LONG, array, intrinsics, truth
from labcourse.questions.t06_back_projection import K_SMALL, K_of, camera
from labgrader.question import Question, holds, wrong


def back_project(depth, K, along_ray):
    """Turn an image of depths, or of distances along the rays, into camera-frame points; NaN where nothing was read."""
    H, W = depth.shape
    v, u = np.mgrid[0:H, 0:W]
    rays = np.stack([u, v, np.ones((H, W))], axis=-1) @ np.linalg.inv(K).T
    if along_ray:
        rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    return np.where(depth > 0.0, depth, np.nan)[..., None] * rays


def _depth_image(rng, shape=None):
    """Draw depths of 0.3 to 2 m, some that are nearer and farther, and some without a reading, 0 or NaN; H != W."""
    H, W = shape or (int(rng.integers(6, 10)), int(rng.integers(11, 16)))
    depth = rng.uniform(0.3, 2.0, (H, W)).astype(np.float32)
    depth[rng.random((H, W)) < 0.15] = 0.0
    depth[rng.random((H, W)) < 0.1] = np.nan
    depth.flat[[1, 2, -3, -2]] = rng.uniform((1.1e-4, 0.001, 15.0, 70.0), (0.001, 0.09, 60.0, 100.0))
    return depth.astype(rng.choice([np.float32, np.float64])), camera(rng, H, W), bool(rng.random() < 0.6)


QUESTION = Question(
    reference=back_project,
    kinds={
        "depth": array(
            "H W",
            1e-4,
            100.0,
            also=(0.0, np.nan),
            dtype="float32 float64",
            says=("1e-4 to 100", "0 or NaN"),
            free=("NaN to 0", "0 to NaN"),
        ),
        "K": intrinsics(),
        "along_ray": truth(),
    },
    inputs=(_depth_image, partial(_depth_image, shape=(LONG, 1)), partial(_depth_image, shape=(1, LONG))),
    by_hand=(
        (np.array([[0.5, 0.0, 0.5]]), K_SMALL, False),
        (np.array([[2.0, np.nan], [1.0, 4.0], [0.0, 2.0]]), K_of(4.0, 2.0, 0.0, 1.0), False),
        (np.array([[0.0, 3.0], [np.nan, 2.0], [0.5, 0.0]]), K_of(1.0, 2.0, 3.0, 1.0), True),  # rays (-2, -1/2, 1), ...
        (np.array([[1.0, 2.0], [2.0, 4.0]]), K_SMALL, True),  # no holes
        (np.array([[0.05, 0.0], [0.004, 30.0]]), K_SMALL, False),  # near, nothing, nearer, far
        (np.array([[1e-4, 80.0]]), K_SMALL, False),
    ),
    edges=1,
    random_cases=10,
)


@holds("z is the depth itself, or with along_ray the point's distance from the camera is")
def at_its_distance(depth, K, along_ray, P):
    distance = np.linalg.norm(P, axis=-1) if along_ray else P[..., 2]
    return np.allclose(distance[depth > 0.0], depth[depth > 0.0], rtol=1e-3)


# ---------------------------------------------------------------------------------------------------- wrong answers


def plain_rays(shape, K, offset=0.0):
    """Give q(u, v) for every pixel of an image; offset is added to both pixel coordinates."""
    v, u = np.mgrid[: shape[0], : shape[1]] + offset
    return np.dstack([(u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1], np.ones(shape)])


def length(q):
    return np.linalg.norm(q, axis=-1, keepdims=True)


def rays(shape, K, along_ray, offset=0.0):
    """The same, of length 1 where the distance along the ray is measured."""
    q = plain_rays(shape, K, offset)
    return q / length(q) if along_ray else q


def holes(depth):
    return np.where(depth > 0.0, depth, np.nan)[..., None]


@wrong("That is the lesson's point, for depth along z. Along the ray a number is the point's distance: how long is q?")
def always_along_z(depth, K, along_ray):
    return back_project(depth, K, False)


@wrong("You swapped the two cases: which of them needs rays of length 1?")
def cases_exchanged(depth, K, along_ray):
    return back_project(depth, K, not along_ray)


@wrong("Each pixel's ray has its own length: which axis holds x, y and z?")
def one_length_for_all(depth, K, along_ray):
    q = plain_rays(depth.shape, K)
    return holes(depth) * q / (np.linalg.norm(q) if along_ray else 1.0)


@wrong("The whole ray is scaled to length 1: x and y become shorter by the same factor as z.")
def z_alone_shortened(depth, K, along_ray):
    P = back_project(depth, K, False)
    P[..., 2] = back_project(depth, K, along_ray)[..., 2]
    return P


@wrong("You divide by the square of the ray's length: where is the root?")
def squared_length(depth, K, along_ray):
    q = plain_rays(depth.shape, K)
    return holes(depth) * q / (length(q) ** 2 if along_ray else 1.0)


@wrong("A ray has three components, the 1 included: what is the length of (x, y, 1)?")
def length_without_the_1(depth, K, along_ray):
    q = plain_rays(depth.shape, K)
    with np.errstate(divide="ignore", invalid="ignore"):
        return holes(depth) * q / (length(q[..., :2]) if along_ray else 1.0)


@wrong("You are off by half a pixel: in this kit the first pixel's centre is at u = v = 0.")
def centres_at_halves(depth, K, along_ray):
    return holes(depth) * rays(depth.shape, K, along_ray, 0.5)


@wrong("You are off by a pixel: the first one has u = v = 0, not 1.")
def counted_from_one(depth, K, along_ray):
    return holes(depth) * rays(depth.shape, K, along_ray, 1.0)


@wrong("u and x go with fx and cx, the first row of K; v and y go with fy and cy.")
def focal_lengths_exchanged(depth, K, along_ray):
    return back_project(depth, K_of(K[1, 1], K[0, 0], K[0, 2], K[1, 2]), along_ray)


@wrong("x is right and y is not: which entry of K belongs to the rows?")
def one_focal_length(depth, K, along_ray):
    return back_project(depth, K_of(K[0, 0], K[0, 0], K[0, 2], K[1, 2]), along_ray)


@wrong("Your cloud lies behind the camera: here x points right, y down and z forward.")
def opengl_axes(depth, K, along_ray):
    return back_project(depth, K, along_ray) * (1.0, -1.0, -1.0)


@wrong("The numbers are right but in the wrong places: reshape does not move an axis.")
def reshaped(depth, K, along_ray):
    return np.moveaxis(back_project(depth, K, along_ray), -1, 0).reshape(*depth.shape, 3)


@wrong("A hole has no point: its z is NaN as well, not 0.")
def holes_at_depth_zero(depth, K, along_ray):
    P = back_project(depth, K, along_ray)
    P[..., 2] = np.where(depth > 0.0, P[..., 2], depth)
    return P


@wrong("The optical axis meets the image at (cx, cy), where x and y are 0: from which point do you count u and v?")
def counted_from_the_first_pixel(depth, K, along_ray):
    return back_project(depth, K_of(K[0, 0], K[1, 1], 0.0, 0.0), along_ray)


@wrong("The principal point is what K says, cx and cy; it need not be the middle of the image.")
def middle_of_the_image(depth, K, along_ray):
    H, W = depth.shape
    return back_project(depth, K_of(K[0, 0], K[1, 1], (W - 1) / 2, (H - 1) / 2), along_ray)


@wrong("A hole has no point: its x and y are NaN as well, not 0.")
def holes_without_z_alone(depth, K, along_ray):
    P = back_project(depth, K, along_ray)
    return np.dstack([np.nan_to_num(P[..., :2]), P[..., 2]])


@wrong("np.meshgrid with indexing='ij' is transposed, and reshape does not undo that: which axis is u?")
def grid_on_its_side(depth, K, along_ray):
    return holes(depth) * rays(depth.shape, K, along_ray).swapaxes(0, 1).reshape(*depth.shape, 3)


@wrong("The result is an image of points, one per pixel: what is the entry where there is no reading?")
def list_of_points(depth, K, along_ray):
    return back_project(depth, K, along_ray)[depth > 0.0]


@wrong("You took the length of (u, v, 1), which is in pixels. The ray is K^-1 (u, v, 1): how long is that?")
def length_in_pixels(depth, K, along_ray):
    v, u = np.indices(depth.shape)
    pixels = np.stack([u, v, np.ones(depth.shape)], axis=-1)
    return holes(depth) * plain_rays(depth.shape, K) / (length(pixels) if along_ray else 1.0)


@wrong("x and y shrink with the ray, too: only if d were the depth along z would x be d (u - cx) / fx.")
def z_by_pythagoras(depth, K, along_ray):
    P = back_project(depth, K, False)
    with np.errstate(invalid="ignore"):
        z = np.sqrt(depth**2 - P[..., 0] ** 2 - P[..., 1] ** 2) if along_ray else P[..., 2]
    return np.dstack([P[..., :2], z])


@wrong("All your points lie at a distance of 1. It is the ray that needs length 1, before d multiplies it.")
def points_of_length_1(depth, K, along_ray):
    P = back_project(depth, K, along_ray)
    return P / length(P) if along_ray else P
