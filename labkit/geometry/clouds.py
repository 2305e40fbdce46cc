"""What a cloud of points says: centroid, covariance and axes, the plane of a table, outliers and separate objects."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Integer

from labkit.geometry.projection import Scalar
from labkit.support.validation import check_finite, check_points, check_shape, check_whole, require


def centroid_and_covariance(
    P: Float[np.ndarray, "N 3"],
) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3 3"]]:
    """Compute the mean of a cloud and its covariance with 1/N (not 1/(N - 1)), as topic 07 defines them.

    Float64, whatever the points are: the float32 mean height of 40,000 points of a table is wrong in the fourth digit.
    An empty cloud is an error: there is no mean of nothing.

    >>> mu, Sigma = centroid_and_covariance(np.array([[0.0, 0.0, 1.0], [2.0, 0.0, 1.0]]))
    >>> mu
    array([1., 0., 1.])
    >>> Sigma
    array([[1., 0., 0.],
           [0., 0., 0.],
           [0., 0., 0.]])
    """
    P = _check_cloud("P", P)
    require("P", len(P) > 0, "at least one point", "an empty cloud (0, 3)")
    return _moments(P)


def _moments(P) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3 3"]]:
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
    """Find the principal axes of a cloud: the eigenvectors of its covariance, the widest spread first (topic 07).

    Where two variances differ by less than `tolerance` (0..1) of the larger one, any direction in their plane would do,
    so those axes are reported as undetermined (NaN, with the reason in words) instead of picked by rounding errors. A
    sphere or fewer than four points has no axis, a line only its first, a disc only its normal. An axis has no sign:
    the largest component is made positive here, then the third axis turned so that the three are right-handed.

    >>> box = np.array([[x, y, z] for x in (-3.0, 3.0) for y in (-1.0, 1.0) for z in (-2.0, 2.0)])
    >>> principal_axes(box).axes.round(3) + 0.0  # longest in x, then in z, then in y
    array([[ 1.,  0.,  0.],
           [ 0.,  0., -1.],
           [ 0.,  1.,  0.]])
    >>> principal_axes(box[:3]).problem
    'only 3 points: at least 4 are needed for axes'
    """
    require("tolerance", 0.0 <= tolerance < 1.0, "a share in 0..1", tolerance)
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
    the side of `viewer`, the camera's place. Fewer than three points, or points on a line, are an error. Topic 06.

    >>> x, y = np.meshgrid(np.arange(10.0), np.arange(8.0))
    >>> table = np.stack([x, y, np.full_like(x, 2.0)], axis=-1).reshape(-1, 3)
    >>> fit_plane(np.vstack([table, [[3.0, 3.0, 1.0]]]))
    Plane(80 of 81 points, 0.00 mm)
    """
    P = _check_cloud("P", P).astype(np.float64)
    _check_reach("tolerance", tolerance, P)
    check_whole("tries", tries, 1)
    require("P", len(P) >= 3, "at least three points", len(P))
    rng = np.random.default_rng(seed)
    some = P[rng.permutation(len(P))[:3000]]  # enough to tell which of two planes holds more points
    a, b, c = some[rng.integers(len(some), size=(3, tries))]
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1)
    spread = np.linalg.norm(b - a, axis=1) * np.linalg.norm(c - a, axis=1)
    usable = lengths > 1e-6 * spread + 1e-12  # not three points of a line
    require("P", usable.any(), "points that span a plane", "points on a line")
    normals = normals[usable] / lengths[usable, None]
    offsets = -(normals * a[usable]).sum(axis=1)
    votes = [np.count_nonzero(np.abs(some @ n + d) < tolerance) for n, d in zip(normals, offsets, strict=True)]
    best = int(np.argmax(votes))
    on_plane = np.abs(P @ normals[best] + offsets[best]) < tolerance
    for _ in range(3):
        centroid, covariance = _moments(P[on_plane])
        normal = np.linalg.eigh(covariance)[1][:, 0]  # of the smallest variance
        heights = (P - centroid) @ normal
        on_plane = np.abs(heights) < tolerance
    offset = -float(normal @ centroid)
    if normal @ np.asarray(viewer, np.float64) + offset < 0.0:
        normal, offset = -normal, -offset
    return Plane(normal, offset, on_plane, float(np.sqrt(np.mean(heights[on_plane] ** 2))))


# ------------------------------------------------------------------------------------- outliers and separate objects


def inlier_indices(
    P: Float[np.ndarray, "N 3"], radius: Scalar = 0.01, min_neighbours: int = 4
) -> Integer[np.ndarray, "M"]:
    """Find the points with at least `min_neighbours` others within `radius` metres: their indices in P, ascending.

    Left out by this radius outlier removal is what floats between a surface and what is behind it, where a sensor mixed
    two depths in one pixel. `radius` should span two or three pixels at the cloud's distance.

    >>> P = np.array([[0.0, 0.0, 0.0], [0.001, 0.0, 0.0], [0.5, 0.0, 0.0]])
    >>> inlier_indices(P, radius=0.01, min_neighbours=1).tolist()
    [0, 1]
    """
    from labkit.support.geometry_kernels import count_neighbours, sort_into_cells

    P = _check_cloud("P", P)
    _check_reach("radius", radius, P)
    check_whole("min_neighbours", min_neighbours, 0)
    order, points, cells = sort_into_cells(P, radius)
    keep = np.empty(len(P), bool)
    keep[order] = count_neighbours(points, *cells, radius, min_neighbours) >= min_neighbours
    return np.flatnonzero(keep)


def cluster_indices(
    P: Float[np.ndarray, "N 3"], gap: Scalar = 0.015, min_points: int = 30
) -> list[Integer[np.ndarray, "_"]]:
    """Split a cloud into separate objects, the one with the most points first: indices of their points in P, ascending.

    Two points belong together if a chain of points with steps of at most `gap` metres joins them (single linkage).
    Groups of fewer than `min_points` are dropped as noise. An empty cloud gives an empty list.

    >>> P = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.31, 0.0, 0.0]])
    >>> [group.tolist() for group in cluster_indices(P, gap=0.015, min_points=1)]
    [[1, 2], [0]]
    """
    from labkit.support.geometry_kernels import link_cells, sort_into_cells

    P = _check_cloud("P", P)
    _check_reach("gap", gap, P)
    check_whole("min_points", min_points, 1)
    order, points, cells = sort_into_cells(P, gap)
    group = np.empty(len(P), np.int64)
    group[order] = link_cells(points, *cells, gap)
    sizes = np.bincount(group)
    largest_first = np.argsort(-sizes, kind="stable")
    return [np.flatnonzero(group == g) for g in largest_first if sizes[g] >= min_points]


def _check_cloud(name: str, P) -> Float[np.ndarray, "N 3"]:
    return check_finite(name, check_points(name, check_shape(name, P, (None, 3))))


def _check_reach(name: str, reach, P: Float[np.ndarray, "N 3"]) -> None:
    require(name, np.ndim(reach) == 0 and np.isfinite(reach) and reach > 0.0, "metres above 0", reach)
    # The keys of the grid's cells would not fit in 64 bits.
    if len(P) and np.ptp(P.astype(np.float64), axis=0).max() > 1e6 * reach:
        raise ValueError(f"{name}: expected more than a millionth of the cloud's width, got {reach}")
