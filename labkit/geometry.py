"""From pixels with depth to points in the robot's base frame, and what a cloud of them says (the text's section 4).

Frames: "cam" is the camera's optical frame (x right, y down, z forward), "base" the robot's base link. T_base_cam maps
camera coordinates to base coordinates. Pixel centres lie at integer u (column) and v (row). Metres throughout.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float, Float32, Integer, Real

from labkit.support.validation import check_depth, check_finite, check_K, check_same_size, check_shape, check_T

Scalar = int | float | np.integer | np.floating

# ---------------------------------------------------------------------------------------- pixels, rays and points


def pixel_rays(shape: tuple[int, int], K: Real[np.ndarray, "3 3"]) -> Float[np.ndarray, "H W 3"]:
    """Compute the ray q(u, v) = K^-1 (u, v, 1) of every pixel of an image of `shape` (H, W); its z is 1.

    Camera frame, float64; a point on the ray at depth d is d q, so d is measured along z and not along the ray.
    Raises ValueError for a shape without pixels or a K that is not an intrinsic matrix. Section 4 of the text.

    >>> pixel_rays((2, 3), np.array([[2.0, 0.0, 1.0], [0.0, 4.0, 0.0], [0.0, 0.0, 1.0]]))[1, 2].tolist()
    [0.5, 0.25, 1.0]
    """
    H, W = _check_pixels("shape", shape)
    return _rays(np.linalg.inv(check_K("K", K)), H, W, np.float64)


def back_project(depth: Float[np.ndarray, "H W"], K: Real[np.ndarray, "3 3"]) -> Float32[np.ndarray, "H W 3"]:
    """Turn a depth image into an image of points in the camera frame: P_cam = d K^-1 (u, v, 1).

    depth: metres, 0 or NaN where there is no reading; such a pixel has the point NaN, never a made-up one. Raises
    ValueError naming depth or K if it does not fit. Section 4 and problem 4 of the text.

    >>> K = np.array([[2.0, 0.0, 1.0], [0.0, 4.0, 0.0], [0.0, 0.0, 1.0]])
    >>> back_project(np.array([[0.5, 0.0, 0.5]]), K)[0].tolist()
    [[-0.25, 0.0, 0.5], [nan, nan, nan], [0.25, 0.0, 0.5]]
    """
    return _back_project(depth, check_K("K", K), np.eye(4))


def back_project_to_base(
    depth: Float[np.ndarray, "H W"], K: Real[np.ndarray, "3 3"], T_base_cam: Real[np.ndarray, "4 4"]
) -> Float32[np.ndarray, "H W 3"]:
    """Turn a depth image into an image of points in the base frame; NaN where there is no reading.

    P_base = R d q + t = d (R q) + t: the rotated rays R q depend on the camera alone and are kept for the next frame,
    so that the base frame costs no more than the camera frame. Raises ValueError naming the argument that does not fit.
    Section 4 of the text.

    >>> T_base_cam = np.array([[0.0, -1, 0, 1], [-1, 0, 0, 0], [0, 0, -1, 2], [0, 0, 0, 1]])  # looks down from z = 2
    >>> back_project_to_base(np.array([[1.5, 0.0]]), np.eye(3), T_base_cam)[0].tolist()
    [[1.0, 0.0, 0.5], [nan, nan, nan]]
    """
    return _back_project(depth, check_K("K", K), check_T("T_base_cam", T_base_cam))


def backproject_to_base(
    mask: Integer[np.ndarray, "H W"],
    depth: Float[np.ndarray, "H W"],
    K: Real[np.ndarray, "3 3"],
    T_base_cam: Real[np.ndarray, "4 4"],
    target_class: int | np.integer,
) -> Float32[np.ndarray, "N 3"]:
    """Collect the base-frame points of the pixels that are labelled `target_class` and have depth, row by row.

    Unlike the text's listing of the same name it leaves out pixels without a reading (0 or NaN), as the formula's d > 0
    asks; there they would all become the camera's own position. No such pixel gives an empty (0, 3) cloud. Raises
    ValueError naming the argument that does not fit. Sections 4 and 6 of the text.

    >>> mask, depth = np.array([[2, 2, 1]]), np.array([[0.5, 0.0, 0.5]])
    >>> backproject_to_base(mask, depth, np.eye(3), np.eye(4), target_class=2).tolist()
    [[0.0, 0.0, 0.5]]
    """
    depth = _check_depth_image(depth)
    mask = check_shape("mask", mask, (None, None))
    if mask.dtype.kind not in "iu":
        raise ValueError(f"mask: expected integer labels, got dtype {mask.dtype}")
    check_same_size("depth", depth, "mask", mask)
    if isinstance(target_class, bool) or not isinstance(target_class, int | np.integer) or target_class < 0:
        raise ValueError(f"target_class: expected one class number, 0 or more, got {target_class!r}")
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
    held inside an image. Raises ValueError if the last axis is not x, y, z, or K does not fit. Section 4 of the text.

    >>> u, v = project(np.array([0.25, 0.0, 0.5]), np.array([[2.0, 0.0, 1.0], [0.0, 4.0, 0.0], [0.0, 0.0, 1.0]]))
    >>> float(u), float(v)
    (2.0, 0.0)
    """
    P_cam, K = _check_points("P_cam", P_cam), check_K("K", K)
    x, y, z = np.moveaxis(P_cam.astype(np.float64, copy=False), -1, 0)
    z = np.where(z > 0.0, z, np.nan)
    u, v = (K[0, 0] * x + K[0, 1] * y) / z + K[0, 2], K[1, 1] * y / z + K[1, 2]
    return np.asarray(u), np.asarray(v)  # of a single point too, which NumPy would make plain numbers


@lru_cache(maxsize=4)  # a few cameras: each entry takes 12 bytes a pixel. Its lock makes it safe to share by threads.
def _base_rays(K: bytes, R_base_cam: bytes, H: int, W: int) -> Float32[np.ndarray, "H W 3"]:
    """Rotate every pixel's ray into the base frame, once a camera.

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
    depth: Float[np.ndarray, "H W"], K: Float[np.ndarray, "3 3"], T: Float[np.ndarray, "4 4"]
) -> Float32[np.ndarray, "H W 3"]:
    """Compute d (R q) + t for every pixel; NaN where there is no reading."""
    from labkit.support.geometry_kernels import scale_rays  # numba: loaded when an image is first back-projected

    depth = _check_depth_image(depth)
    rays = _base_rays(K.tobytes(), T[:3, :3].tobytes(), *depth.shape)
    return scale_rays(depth, rays, T[:3, 3].astype(np.float32))


# ----------------------------------------------------------------------------- how errors in u, v and d move a point


def back_projection_jacobian(u: Scalar, v: Scalar, d: Scalar, K: Real[np.ndarray, "3 3"]) -> Float[np.ndarray, "3 3"]:
    """Differentiate P_cam(u, v, d) = d K^-1 (u, v, 1): the columns are dP/du, dP/dv and dP/dd.

    u, v in pixels, d in metres, above 0; camera frame. dP/dd is the ray q(u, v), the answer to problem 4 of the text;
    the other two grow with d. Raises ValueError naming the argument that does not fit.

    >>> K = np.array([[2.0, 0.0, 1.0], [0.0, 4.0, 0.0], [0.0, 0.0, 1.0]])
    >>> back_projection_jacobian(2.0, 1.0, 0.5, K).tolist()
    [[0.25, 0.0, 0.5], [0.0, 0.125, 0.25], [0.0, 0.0, 1.0]]
    """
    for name, value in (("u", u), ("v", v), ("d", d)):
        check_finite(name, check_shape(name, value, ()))
    if not d > 0.0:
        raise ValueError(f"d: expected a depth in metres above 0, got {d}")
    K_inv = np.linalg.inv(check_K("K", K))
    return np.column_stack([d * K_inv[:, 0], d * K_inv[:, 1], K_inv @ (u, v, 1.0)])


def back_projection_noise(
    u: Scalar, v: Scalar, d: Scalar, K: Real[np.ndarray, "3 3"], sigma_pixel: Scalar, sigma_depth: Scalar
) -> Float[np.ndarray, "3 3"]:
    """Carry independent noise of u, v (std `sigma_pixel`) and d (std `sigma_depth`) to the point: J diag(sigma^2) J^T.

    Returns the covariance of P_cam in m^2, to first order. sigma_pixel in pixels, sigma_depth in metres, not negative.
    Raises ValueError naming the argument that does not fit. Problem 4 of the text.

    >>> back_projection_noise(0.0, 0.0, 1.0, np.eye(3), sigma_pixel=0.0, sigma_depth=0.1).round(3).tolist()
    [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.01]]
    """
    for name, sigma in (("sigma_pixel", sigma_pixel), ("sigma_depth", sigma_depth)):
        if not (np.ndim(sigma) == 0 and np.isfinite(sigma) and sigma >= 0.0):
            raise ValueError(f"{name}: expected a standard deviation of 0 or more, got {sigma}")
    J = back_projection_jacobian(u, v, d, K)
    return J @ np.diag(np.square([sigma_pixel, sigma_pixel, sigma_depth])) @ J.T


# ------------------------------------------------------------------------------------------------ rigid transforms


def transform_points(T: Real[np.ndarray, "4 4"], P: Float[np.ndarray, "*points 3"]) -> Float[np.ndarray, "*points 3"]:
    """Apply a rigid transform to points (..., 3): with T_base_cam, camera coordinates become base coordinates.

    Keeps the points' precision; NaN stays NaN. Raises ValueError if T is not in SE(3) or the last axis is not x, y, z.
    Section 4 of the text.

    >>> T_base_cam = np.array([[0.0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]])
    >>> transform_points(T_base_cam, np.array([[1.0, 0.0, 0.0]])).tolist()
    [[1.0, 3.0, 3.0]]
    """
    P = _check_points("P", P)
    T = check_T("T", T).astype(P.dtype)
    return P @ T[:3, :3].T + T[:3, 3]


def invert_transform(T: Real[np.ndarray, "4 4"]) -> Float[np.ndarray, "4 4"]:
    """Invert a rigid transform by R^T and -R^T t: T_cam_base from T_base_cam. Raises ValueError if T is not in SE(3).

    >>> invert_transform(np.array([[0.0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]))[:3, 3].tolist()
    [-2.0, 1.0, -3.0]
    """
    T = check_T("T", T)
    inverse = np.eye(4)
    inverse[:3, :3] = T[:3, :3].T
    inverse[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    return inverse


# ------------------------------------------------------------------------------------------------ what a cloud says


def centroid_and_covariance(
    P: Float[np.ndarray, "N 3"],
) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3 3"]]:
    """Compute the mean of a cloud and its covariance with 1/N (not 1/(N - 1)), as the text defines them.

    Float64, whatever the points are: the float32 mean height of 40,000 points of a table is wrong in the fourth digit.
    Raises ValueError if the cloud is empty (there is no mean of nothing) or holds NaN. Section 4 of the text.

    >>> mu, Sigma = centroid_and_covariance(np.array([[0.0, 0.0, 1.0], [2.0, 0.0, 1.0]]))
    >>> mu.tolist(), Sigma[0].tolist()
    ([1.0, 0.0, 1.0], [1.0, 0.0, 0.0])
    """
    P = _check_cloud("P", P)
    if len(P) == 0:
        raise ValueError("P: expected at least one point, got an empty cloud (0, 3)")
    mu = P.mean(axis=0, dtype=np.float64)
    centred = P - mu
    return mu, centred.T @ centred / len(P)


@dataclass(frozen=True, eq=False)
class PrincipalAxes:
    """The directions in which a cloud spreads, and how much.

    centroid: (3,). variances: (3,), descending, m^2. axes: (3, 3), unit vectors as columns in the same order,
    right-handed; a column is NaN where the cloud does not determine that axis, and `problem` then says why ("" if all
    is well). Either all three axes are determined, or one, or none: two of them would fix the third.
    """

    centroid: Float[np.ndarray, "3"]
    variances: Float[np.ndarray, "3"]
    axes: Float[np.ndarray, "3 3"]
    problem: str = ""

    @property
    def determined(self) -> Bool[np.ndarray, "3"]:
        """Which of the three axes the cloud determines."""
        return ~np.isnan(self.axes[0])


def principal_axes(P: Float[np.ndarray, "N 3"], tolerance: Scalar = 0.05) -> PrincipalAxes:
    """Find the principal axes of a cloud: the eigenvectors of its covariance, the widest spread first.

    Where two variances differ by less than `tolerance` of the larger one, any direction in their plane would do, so
    those axes are reported as undetermined (NaN, with the reason in words) instead of picked by rounding errors. A
    sphere or fewer than four points has no axis, a line only its first, a disc only its normal. An axis has no sign:
    the largest component is made positive here, then the third axis turned so that the three are right-handed.

    Raises ValueError if the cloud is empty or holds NaN, or tolerance is not in 0..1. Section 4 of the text.

    >>> box = np.array([[x, y, z] for x in (-3.0, 3.0) for y in (-1.0, 1.0) for z in (-2.0, 2.0)])
    >>> principal_axes(box).axes[:, 1].tolist()
    [0.0, 0.0, 1.0]
    >>> principal_axes(box[:3]).problem
    'only 3 points: at least 4 are needed for axes'
    """
    if not 0.0 <= tolerance < 1.0:
        raise ValueError(f"tolerance: expected a share in 0..1, got {tolerance}")
    centroid, covariance = centroid_and_covariance(P)
    variances, axes = np.linalg.eigh(covariance)  # ascending
    variances, axes = np.maximum(variances[::-1], 0.0), axes[:, ::-1]  # rounding can leave -1e-20

    # A spread below a millionth of the coordinates is the rounding of float32, not a shape.
    rounding = (1e-6 * float(np.abs(P).max())) ** 2
    gap = variances[:2] - variances[1:] > np.maximum(tolerance * variances[:2], rounding)
    determined, problem = _determined_axes(len(P), variances, gap, rounding)

    axes = axes * np.sign(axes[np.abs(axes).argmax(axis=0), range(3)])
    if np.linalg.det(axes) < 0.0:
        axes[:, 2] *= -1.0
    return PrincipalAxes(centroid, variances, np.where(determined, axes, np.nan), problem)


def _determined_axes(count: int, variances, gap, rounding: float) -> tuple[tuple[bool, bool, bool], str]:
    """Say which axes a cloud determines, given which of its neighbouring variances differ, and why not the others."""
    if count < 4:
        return (False, False, False), f"only {count} points: at least 4 are needed for axes"
    if variances[0] <= rounding:
        return (False, False, False), "all points coincide"
    if gap.all():
        return (True, True, True), ""
    if gap[0]:
        line = "the points lie on a line" if variances[1] <= rounding else "the two smaller variances are equal"
        return (True, False, False), f"{line}: only the first axis is determined"
    if gap[1]:
        return (False, False, True), "the two larger variances are equal: only the third axis is determined"
    return (False, False, False), "the variances are equal in all directions: no axis is determined"


# --------------------------------------------------------------------------------------------------- the table's plane


@dataclass(frozen=True, eq=False)
class Plane:
    """A plane and what speaks for it: the height of a point P over it is normal @ P + offset, metres.

    normal: unit vector (3,). offset: metres. inliers: bool (N,), which points lie on it. residual: their root mean
    square height, metres.
    """

    normal: Float[np.ndarray, "3"]
    offset: float
    inliers: Bool[np.ndarray, "N"]
    residual: float

    def __repr__(self) -> str:
        return f"Plane({self.inliers.sum()} of {self.inliers.size} points, {1000.0 * self.residual:.2f} mm)"


def fit_plane(
    P: Float[np.ndarray, "N 3"], tolerance: Scalar = 0.008, tries: int = 400, seed: int = 0, viewer=(0.0, 0.0, 0.0)
) -> Plane:
    """Find the plane on which most points of a cloud lie: a table, seen with everything that stands on it.

    RANSAC (Fischler and Bolles, 1981): of `tries` planes through three random points the one with most points within
    `tolerance` metres wins; then least squares over these points, and over those that it finds. The normal points to
    the side of `viewer`, the camera's place. Raises ValueError if the cloud holds NaN, fewer than three points, or only
    points on a line. Topic 06.

    >>> x, y = np.meshgrid(np.arange(10.0), np.arange(8.0))
    >>> table = np.stack([x, y, np.full_like(x, 2.0)], axis=-1).reshape(-1, 3)
    >>> fit_plane(np.vstack([table, [[3.0, 3.0, 1.0]]]))
    Plane(80 of 81 points, 0.00 mm)
    """
    P = _check_cloud("P", P).astype(np.float64)
    _check_reach("tolerance", tolerance, P)
    _check_count("tries", tries, 1)
    if len(P) < 3:
        raise ValueError(f"P: expected at least three points, got {len(P)}")
    rng = np.random.default_rng(seed)
    some = P[rng.permutation(len(P))[:3000]]  # enough to tell which of two planes holds more points
    a, b, c = some[rng.integers(len(some), size=(3, tries))]
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1)
    spread = np.linalg.norm(b - a, axis=1) * np.linalg.norm(c - a, axis=1)
    usable = lengths > 1e-6 * spread + 1e-12  # not three points of a line
    if not usable.any():
        raise ValueError("P: expected points that span a plane, got points on a line")
    normals = normals[usable] / lengths[usable, None]
    offsets = -(normals * a[usable]).sum(axis=1)
    votes = [np.count_nonzero(np.abs(some @ n + d) < tolerance) for n, d in zip(normals, offsets, strict=True)]
    best = int(np.argmax(votes))
    inliers = np.abs(P @ normals[best] + offsets[best]) < tolerance
    for _ in range(3):
        centroid, covariance = centroid_and_covariance(P[inliers])
        normal = np.linalg.eigh(covariance)[1][:, 0]  # of the smallest variance
        heights = (P - centroid) @ normal
        inliers = np.abs(heights) < tolerance
    offset = -float(normal @ centroid)
    if normal @ np.asarray(viewer, np.float64) + offset < 0.0:
        normal, offset = -normal, -offset
    return Plane(normal, offset, inliers, float(np.sqrt(np.mean(heights[inliers] ** 2))))


# ------------------------------------------------------------------------------------- outliers and separate objects


def remove_outliers(
    P: Float[np.ndarray, "N 3"], radius: Scalar = 0.01, min_neighbours: int = 4
) -> Float[np.ndarray, "M 3"]:
    """Drop the points with fewer than `min_neighbours` other points within `radius` metres (radius outlier removal).

    Such points float between a surface and what is behind it, where a sensor mixed two depths in one pixel. `radius`
    should span two or three pixels at the cloud's distance. The order is kept; an empty cloud stays empty. Raises
    ValueError if the cloud holds NaN, radius is not above 0, or min_neighbours is negative.

    >>> P = np.array([[0.0, 0.0, 0.0], [0.001, 0.0, 0.0], [0.5, 0.0, 0.0]])
    >>> remove_outliers(P, radius=0.01, min_neighbours=1)[:, 0].tolist()
    [0.0, 0.001]
    """
    return P[inliers(P, radius, min_neighbours)]


def inliers(P: Float[np.ndarray, "N 3"], radius: Scalar = 0.01, min_neighbours: int = 4) -> Integer[np.ndarray, "M"]:
    """Find the points that `remove_outliers` keeps: their indices in P, ascending."""
    from labkit.support.geometry_kernels import count_neighbours, sort_into_cells

    P = _check_cloud("P", P)
    _check_reach("radius", radius, P)
    _check_count("min_neighbours", min_neighbours, 0)
    order, points, cells = sort_into_cells(P, radius)
    keep = np.empty(len(P), bool)
    keep[order] = count_neighbours(points, *cells, radius, min_neighbours) >= min_neighbours
    return np.flatnonzero(keep)


def cluster(P: Float[np.ndarray, "N 3"], gap: Scalar = 0.015, min_points: int = 30) -> list[Float[np.ndarray, "_ 3"]]:
    """Split a cloud into separate objects, the one with the most points first.

    Two points belong together if a chain of points with steps of at most `gap` metres joins them (single linkage).
    Groups of fewer than `min_points` are dropped as noise; within a group the order is kept. An empty cloud gives an
    empty list. Raises ValueError if the cloud holds NaN, gap is not above 0, or min_points is below 1.

    >>> P = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.31, 0.0, 0.0]])
    >>> [len(group) for group in cluster(P, gap=0.015, min_points=1)]
    [2, 1]
    """
    return [P[group] for group in cluster_indices(P, gap, min_points)]


def cluster_indices(
    P: Float[np.ndarray, "N 3"], gap: Scalar = 0.015, min_points: int = 30
) -> list[Integer[np.ndarray, "_"]]:
    """Split a cloud as `cluster` does; for each object the indices of its points in P, ascending."""
    from labkit.support.geometry_kernels import link_cells, sort_into_cells

    P = _check_cloud("P", P)
    _check_reach("gap", gap, P)
    _check_count("min_points", min_points, 1)
    order, points, cells = sort_into_cells(P, gap)
    group = np.empty(len(P), np.int64)
    group[order] = link_cells(points, *cells, gap)
    sizes = np.bincount(group)
    largest_first = np.argsort(-sizes, kind="stable")
    return [np.flatnonzero(group == g) for g in largest_first if sizes[g] >= min_points]


# ---------------------------------------------------------------------------------------------------------- checks


def _check_pixels(name: str, shape) -> tuple[int, int]:
    if len(shape) != 2 or not all(isinstance(n, int | np.integer) and n > 0 for n in shape):
        raise ValueError(f"{name}: expected (H, W) with at least one pixel, got {shape}")
    return int(shape[0]), int(shape[1])


def _check_depth_image(depth) -> Float32[np.ndarray, "H W"]:
    depth = check_depth("depth", depth)
    _check_pixels("depth", depth.shape)
    return np.ascontiguousarray(depth, dtype=np.float32)


def _check_points(name: str, P) -> Float[np.ndarray, "*points 3"]:
    P = np.asarray(P)
    if P.ndim == 0 or P.shape[-1] != 3 or P.dtype.kind != "f":
        raise ValueError(f"{name}: expected floating-point x, y, z on the last axis, got {P.dtype} {P.shape}")
    return P


def _check_cloud(name: str, P) -> Float[np.ndarray, "N 3"]:
    return check_finite(name, _check_points(name, check_shape(name, P, (None, 3))))


def _check_reach(name: str, reach, P: Float[np.ndarray, "N 3"]) -> None:
    if not (np.ndim(reach) == 0 and np.isfinite(reach) and reach > 0.0):
        raise ValueError(f"{name}: expected metres above 0, got {reach}")
    if len(P) and P.max() - P.min() > 1e6 * reach:  # the keys of the grid's cells would not fit in 64 bits
        raise ValueError(f"{name}: expected more than a millionth of the cloud's width, got {reach}")


def _check_count(name: str, value, least: int) -> None:
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
        raise ValueError(f"{name}: expected a whole number of at least {least}, got {value!r}")
