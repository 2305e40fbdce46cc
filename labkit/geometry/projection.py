"""Pixels to points and back: d K^-1 (u, v, 1), how errors in u, v and d move a point, and rigid transforms (topic 06).

Frames: "cam" is the camera's optical frame (x right, y down, z forward), "base" the robot's base link. T_base_cam maps
camera coordinates to base coordinates. Pixel centres lie at integer u (column) and v (row). Metres.
"""

from functools import lru_cache

import numpy as np
from jaxtyping import Float, Float32, Integer, Real

from labkit.support.validation import (
    as_array,
    check_depth,
    check_finite,
    check_K,
    check_points,
    check_same_size,
    check_shape,
    check_T,
    check_whole,
    require,
)

Scalar = int | float | np.integer | np.floating


def pixel_rays(shape: tuple[int, int], K: Real[np.ndarray, "3 3"]) -> Float[np.ndarray, "H W 3"]:
    """Compute the ray q(u, v) = K^-1 (u, v, 1) of every pixel of an image of `shape` (H, W), in the camera frame.

    A ray has z = 1: the point at depth d is d q, so depth is measured along z and not along the ray. Float64.

    >>> K = np.array([[2.0, 0.0, 1.0],
    ...               [0.0, 4.0, 0.0],
    ...               [0.0, 0.0, 1.0]])
    >>> pixel_rays((2, 3), K)[1, 2].tolist()
    [0.5, 0.25, 1.0]
    """
    return _rays(np.linalg.inv(check_K("K", K)), *_check_size("shape", shape), np.float64)


def back_project(
    depth: Float[np.ndarray, "*batch H W"], K: Real[np.ndarray, "3 3"]
) -> Float32[np.ndarray, "*batch H W 3"]:
    """Turn a depth image, or a batch of one camera's, into images of points in the camera frame: d K^-1 (u, v, 1).

    depth: metres, 0 or NaN where there is no reading; such a pixel has the point NaN, never a made-up one.

    >>> K = np.array([[2.0, 0.0, 1.0],
    ...               [0.0, 4.0, 0.0],
    ...               [0.0, 0.0, 1.0]])
    >>> back_project(np.array([[0.5, 0.0, 0.5]]), K)[0].tolist()
    [[-0.25, 0.0, 0.5], [nan, nan, nan], [0.25, 0.0, 0.5]]
    """
    return _back_project(depth, check_K("K", K), np.eye(4))


def back_project_to_base(
    depth: Float[np.ndarray, "*batch H W"], K: Real[np.ndarray, "3 3"], T_base_cam: Real[np.ndarray, "4 4"]
) -> Float32[np.ndarray, "*batch H W 3"]:
    """Turn a depth image, or a batch of one camera's, into images of points in the base frame; NaN without a reading.

    P_base = R d q + t = d (R q) + t: the rotated rays R q depend on the camera alone and are kept for the next frame,
    so that the base frame costs no more than the camera frame.

    >>> T_base_cam = np.array([[ 0.0, -1.0,  0.0, 1.0],  # the camera looks down from a height of 2
    ...                        [-1.0,  0.0,  0.0, 0.0],
    ...                        [ 0.0,  0.0, -1.0, 2.0],
    ...                        [ 0.0,  0.0,  0.0, 1.0]])
    >>> back_project_to_base(np.array([[1.5, 0.0]]), np.eye(3), T_base_cam)[0].tolist()
    [[1.0, 0.0, 0.5], [nan, nan, nan]]
    """
    return _back_project(depth, check_K("K", K), check_T("T_base_cam", T_base_cam))


def masked_cloud_to_base(
    mask: Integer[np.ndarray, "H W"],
    depth: Float[np.ndarray, "H W"],
    K: Real[np.ndarray, "3 3"],
    T_base_cam: Real[np.ndarray, "4 4"],
    target_class: int | np.integer,
) -> Float32[np.ndarray, "N 3"]:
    """Collect the base-frame points of the pixels that are labelled `target_class` and have depth, row by row.

    A common listing of this name forgets the formula's d > 0; its pixels without a reading all become points at the
    camera's own place. No such pixel gives an empty (0, 3) cloud.

    >>> mask, depth = np.array([[2, 2, 1]]), np.array([[0.5, 0.0, 0.5]])
    >>> masked_cloud_to_base(mask, depth, np.eye(3), np.eye(4), target_class=2).tolist()
    [[0.0, 0.0, 0.5]]
    """
    depth = _check_depth_images(check_shape("depth", depth, (None, None)))
    mask = check_shape("mask", mask, (None, None))
    require("mask", mask.dtype.kind in "iu", "integer labels", f"dtype {mask.dtype}")
    check_same_size("depth", depth, "mask", mask)
    check_whole("target_class", target_class, 0)
    K, T_base_cam = check_K("K", K), check_T("T_base_cam", T_base_cam)

    chosen = np.flatnonzero((mask == target_class) & (depth > 0.0))  # NaN > 0 is False
    P = _base_rays(K.tobytes(), T_base_cam[:3, :3].tobytes(), *depth.shape).reshape(-1, 3)[chosen]
    P *= depth.reshape(-1)[chosen, None]
    P += T_base_cam[:3, 3].astype(np.float32)
    return P


def project(
    P_cam: Float[np.ndarray, "*points 3"], K: Real[np.ndarray, "3 3"]
) -> tuple[Float[np.ndarray, "*points"], Float[np.ndarray, "*points"]]:
    """Project camera-frame points to pixels (u, v) = (column, row), float64; the inverse of `back_project`.

    A point that is not in front of the camera (z <= 0) or is NaN has no pixel: u and v are NaN. Nothing is rounded or
    held inside an image.

    >>> K = np.array([[2.0, 0.0, 1.0],
    ...               [0.0, 4.0, 0.0],
    ...               [0.0, 0.0, 1.0]])
    >>> u, v = project(np.array([0.25, 0.0, 0.5]), K)
    >>> float(u), float(v)
    (2.0, 0.0)
    """
    P_cam, K = check_points("P_cam", P_cam), check_K("K", K)
    x, y, z = np.moveaxis(P_cam.astype(np.float64, copy=False), -1, 0)
    z = np.where(z > 0.0, z, np.nan)
    u, v = (K[0, 0] * x + K[0, 1] * y) / z + K[0, 2], K[1, 1] * y / z + K[1, 2]
    return np.asarray(u), np.asarray(v)  # of a single point too, which NumPy would make plain numbers


# ----------------------------------------------------------------------------- how errors in u, v and d move a point


def back_projection_jacobian(u: Scalar, v: Scalar, d: Scalar, K: Real[np.ndarray, "3 3"]) -> Float[np.ndarray, "3 3"]:
    """Differentiate P_cam(u, v, d) = d K^-1 (u, v, 1): the columns are dP/du, dP/dv and dP/dd.

    u, v in pixels, d in metres, above 0; camera frame. dP/dd is the ray q(u, v); the other two grow with d.

    >>> K = np.array([[2.0, 0.0, 1.0],
    ...               [0.0, 4.0, 0.0],
    ...               [0.0, 0.0, 1.0]])
    >>> back_projection_jacobian(2.0, 1.0, 0.5, K)
    array([[0.25 , 0.   , 0.5  ],
           [0.   , 0.125, 0.25 ],
           [0.   , 0.   , 1.   ]])
    """
    for name, value in (("u", u), ("v", v), ("d", d)):
        check_finite(name, check_shape(name, value, ()))
    require("d", d > 0.0, "a depth in metres above 0", d)
    K_inv = np.linalg.inv(check_K("K", K))
    return np.column_stack([d * K_inv[:, 0], d * K_inv[:, 1], K_inv @ (u, v, 1.0)])


def back_projection_noise(
    u: Scalar, v: Scalar, d: Scalar, K: Real[np.ndarray, "3 3"], sigma_pixel: Scalar, sigma_depth: Scalar
) -> Float[np.ndarray, "3 3"]:
    """Carry independent noise of u, v (std `sigma_pixel`) and d (std `sigma_depth`) to the point: J diag(sigma^2) J^T.

    Returns the covariance of P_cam in m^2, to first order. sigma_pixel in pixels, sigma_depth in metres, not negative.

    >>> back_projection_noise(0.0, 0.0, 1.0, np.eye(3), sigma_pixel=0.0, sigma_depth=0.1).round(3)
    array([[0.  , 0.  , 0.  ],
           [0.  , 0.  , 0.  ],
           [0.  , 0.  , 0.01]])
    """
    for name, sigma in (("sigma_pixel", sigma_pixel), ("sigma_depth", sigma_depth)):
        if not (np.ndim(sigma) == 0 and np.isfinite(sigma) and sigma >= 0.0):
            raise ValueError(f"{name}: expected a standard deviation of 0 or more, got {sigma}")
    J = back_projection_jacobian(u, v, d, K)
    return J @ np.diag(np.square([sigma_pixel, sigma_pixel, sigma_depth])) @ J.T


# ------------------------------------------------------------------------------------------------ rigid transforms


def transform_points(T: Real[np.ndarray, "4 4"], P: Float[np.ndarray, "*points 3"]) -> Float[np.ndarray, "*points 3"]:
    """Apply a rigid transform to points (..., 3): with T_base_cam, camera coordinates become base coordinates.

    Keeps the points' precision; NaN stays NaN.

    >>> T_base_cam = np.array([[0.0, -1.0, 0.0, 1.0],
    ...                        [1.0,  0.0, 0.0, 2.0],
    ...                        [0.0,  0.0, 1.0, 3.0],
    ...                        [0.0,  0.0, 0.0, 1.0]])
    >>> transform_points(T_base_cam, np.array([[1.0, 0.0, 0.0]])).tolist()
    [[1.0, 3.0, 3.0]]
    """
    P = check_points("P", P)
    T = check_T("T", T).astype(P.dtype)
    return P @ T[:3, :3].T + T[:3, 3]


def invert_transform(T: Real[np.ndarray, "4 4"]) -> Float[np.ndarray, "4 4"]:
    """Invert a rigid transform by R^T and -R^T t: T_cam_base from T_base_cam.

    >>> T_base_cam = np.array([[0.0, -1.0, 0.0, 1.0],
    ...                        [1.0,  0.0, 0.0, 2.0],
    ...                        [0.0,  0.0, 1.0, 3.0],
    ...                        [0.0,  0.0, 0.0, 1.0]])
    >>> invert_transform(T_base_cam)[:3, 3].tolist()
    [-2.0, 1.0, -3.0]
    """
    T = check_T("T", T)
    inverse = np.eye(4)
    inverse[:3, :3] = T[:3, :3].T
    inverse[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    return inverse


def nearest_rotation(R: Real[np.ndarray, "3 3"]) -> Float[np.ndarray, "3 3"]:
    """Find the rotation nearest to a matrix that is one but for rounding: U V^T of its singular value decomposition.

    Nearest in the sum of squared differences (Schoenemann 1966). Raises ValueError for a mirror image or a matrix of a
    rank below 3, whose nearest rotation would be a guess. Topic 06.

    >>> nearest_rotation(np.array([[0.0, -1.002, 0.0],
    ...                            [1.002, 0.0, 0.0],
    ...                            [0.0, 0.0, 0.998]])).round(6) + 0.0
    array([[ 0., -1.,  0.],
           [ 1.,  0.,  0.],
           [ 0.,  0.,  1.]])
    """
    R = check_finite("R", check_shape("R", R, (3, 3))).astype(np.float64)
    U, sizes, Vt = np.linalg.svd(R)
    mirrored = np.linalg.det(U @ Vt) < 0.0
    require("R", sizes[2] > 1e-6 * sizes[0] > 0.0 and not mirrored, "nearly a rotation", R.tolist)
    return U @ Vt


# ---------------------------------------------------------------------------------------------------- inside


@lru_cache(maxsize=4)  # a few cameras: each entry takes 12 bytes per pixel. Threads may share it.
def _base_rays(K: bytes, R_base_cam: bytes, H: int, W: int) -> Float32[np.ndarray, "H W 3"]:
    """Rotate every pixel's ray into the base frame, once per camera.

    The key is what the matrices hold, not which objects they are: one that is changed in place is another camera.
    """
    K, R_base_cam = (np.frombuffer(data).reshape(3, 3) for data in (K, R_base_cam))
    rays = _rays(R_base_cam @ np.linalg.inv(K), H, W, np.float32)
    rays.setflags(write=False)  # every caller gets this same array
    return rays


def _rays(M: Float[np.ndarray, "3 3"], H: int, W: int, dtype) -> Float[np.ndarray, "H W 3"]:
    """Compute M (u, v, 1) for every pixel: a part that depends on u alone plus one that depends on v alone."""
    across = np.arange(W)[:, None] * M[:, 0]
    down = np.arange(H)[:, None] * M[:, 1] + M[:, 2]
    rays = np.empty((H, W, 3), dtype)
    for axis in range(3):  # sums in float64, rounded once
        np.add.outer(down[:, axis], across[:, axis], out=rays[..., axis], casting="same_kind")
    return rays


def _back_project(
    depth: Float[np.ndarray, "*batch H W"], K: Float[np.ndarray, "3 3"], T: Float[np.ndarray, "4 4"]
) -> Float32[np.ndarray, "*batch H W 3"]:
    """Compute d (R q) + t for every pixel; NaN where there is no reading."""
    from labkit.support.geometry_kernels import scale_rays  # numba: loaded when an image is first back-projected

    depth = _check_depth_images(depth)
    H, W = depth.shape[-2:]
    rays = _base_rays(K.tobytes(), T[:3, :3].tobytes(), H, W)
    return scale_rays(depth.reshape(-1, H, W), rays, T[:3, 3].astype(np.float32)).reshape(*depth.shape, 3)


def _check_size(name: str, size) -> tuple[int, int]:
    if len(size) != 2 or not all(isinstance(n, int | np.integer) and n > 0 for n in size):
        raise ValueError(f"{name}: expected (H, W) with at least one pixel, got {size}")
    return int(size[0]), int(size[1])


def _check_depth_images(depth) -> Float32[np.ndarray, "*batch H W"]:
    depth = as_array("depth", depth)
    require("depth", depth.ndim >= 2, "shape (H, W) or (..., H, W)", depth.shape)
    _check_size("depth", depth.shape[-2:])
    check_depth("depth", depth.reshape(-1, depth.shape[-1]))  # one tall image: what is checked is its numbers
    return np.ascontiguousarray(depth, dtype=np.float32)
