"""Lenses: where a real one puts what a pinhole camera would see elsewhere, and how its pictures are made straight.

(x, y) = ((u - cx) / fx, (v - cy) / fy) are coordinates of a ray, or of the pixel where it comes out. A lens maps one to
the other, in closed form one way and by iteration the other; which way has the formula is what models differ in.
Topic 06.
"""

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from jaxtyping import Float, Real, Shaped

from labkit.support.validation import check_K, require

COUNTS = {"brown_conrady": (4, 5, 8, 12, 14), "modified_brown_conrady": (4, 5), "inverse_brown_conrady": (4, 5)}
STEPS, CLOSE = 20, 1e-8  # of the iteration that inverts a formula, and when it has


@dataclass(frozen=True)
class Lens:
    """A lens of coefficients k1, k2, p1, p2, k3 and, as OpenCV has them, k4 to k6, s1 to s4 and the sensor's tilts.

    model: "brown_conrady", which maps rays to pixels (OpenCV, ROS's plumb_bob and rational_polynomial);
    "modified_brown_conrady", the same but that p1 and p2 act on what k1 to k3 have moved already (librealsense);
    "inverse_brown_conrady", whose formula maps pixels to rays (librealsense's documentation, "Projection"). Raises
    ValueError for another model or count. Topic 06.

    >>> barrel = Lens((-0.1, 0.0, 0.0, 0.0), "inverse_brown_conrady")
    >>> barrel.to_rays(np.array([[0.5, 0.0]])).round(4).tolist()  # 0.5 (1 - 0.1 0.5^2)
    [[0.4875, 0.0]]
    >>> barrel.to_pixels(np.array([[0.4875, 0.0]])).round(4).tolist()
    [[0.5, 0.0]]
    """

    coefficients: tuple[float, ...]
    model: str = "brown_conrady"

    def __post_init__(self):
        require("model", self.model in COUNTS, f"one of {', '.join(COUNTS)}", repr(self.model))
        counts, got = COUNTS[self.model], len(self.coefficients)
        require("coefficients", got in counts, f"{', '.join(map(str, counts))} numbers k1, k2, p1, p2, ...", got)
        require("coefficients", np.isfinite(self.coefficients).all(), "finite numbers", self.coefficients)

    def to_rays(self, xy: Float[np.ndarray, "N 2"]) -> Float[np.ndarray, "N 2"]:
        """Which ray comes out at a place: a point at depth d on it is d (x, y, 1). NaN where none does."""
        if self.model == "inverse_brown_conrady":
            return self._formula(xy)
        return self._inverted(self.to_pixels, xy)

    def to_pixels(self, xy: Float[np.ndarray, "N 2"]) -> Float[np.ndarray, "N 2"]:
        """Where a ray comes out; NaN where the lens does not show it."""
        if self.model == "inverse_brown_conrady":
            return self._inverted(self._formula, xy)
        if self.model == "modified_brown_conrady":
            return self._formula(xy)
        rays = np.column_stack([xy, np.ones(len(xy))])
        zero = np.zeros(3)
        return cv2.projectPoints(rays, zero, zero, np.eye(3), np.array(self.coefficients))[0].reshape(-1, 2)

    def _formula(self, xy: Float[np.ndarray, "N 2"]) -> Float[np.ndarray, "N 2"]:
        k1, k2, p1, p2, k3 = (*self.coefficients, 0.0)[:5]
        x, y = xy.T
        r2 = x * x + y * y
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        a, b = (x * radial, y * radial) if self.model == "modified_brown_conrady" else (x, y)
        dx = 2.0 * p1 * a * b + p2 * (r2 + 2.0 * a * a)
        dy = 2.0 * p2 * a * b + p1 * (r2 + 2.0 * b * b)
        return np.column_stack([x * radial + dx, y * radial + dy])

    @staticmethod
    def _inverted(function, wanted: Float[np.ndarray, "N 2"]) -> Float[np.ndarray, "N 2"]:
        """Find xy with function(xy) = wanted by Newton's method, from xy = wanted; NaN where it does not come close."""
        xy, h = wanted.astype(np.float64), 1e-6
        for _ in range(STEPS):
            off = function(xy) - wanted
            if np.nanmax(np.abs(off), initial=0.0) < CLOSE:
                break
            along_x, along_y = ((function(xy + step) - function(xy - step)) / (2.0 * h) for step in h * np.eye(2))
            J = np.stack([along_x, along_y], axis=2)
            determinant = J[:, 0, 0] * J[:, 1, 1] - J[:, 0, 1] * J[:, 1, 0]
            with np.errstate(all="ignore"):
                xy = (
                    xy
                    - np.column_stack(
                        [
                            J[:, 1, 1] * off[:, 0] - J[:, 0, 1] * off[:, 1],
                            J[:, 0, 0] * off[:, 1] - J[:, 1, 0] * off[:, 0],
                        ]
                    )
                    / np.where(determinant > 0.0, determinant, np.nan)[:, None]
                )  # beyond, the lens folds the picture over
        with np.errstate(all="ignore"):
            return np.where((np.abs(function(xy) - wanted) < 1e-6).all(axis=1)[:, None], xy, np.nan)


def rectified(
    image: Shaped[np.ndarray, "H W *channels"],
    K: Real[np.ndarray, "3 3"],
    lens: Lens,
    smooth: bool = False,
    outside: int = 0,
) -> Shaped[np.ndarray, "H W *channels"]:
    """Undo a lens: the picture that a pinhole camera with the same K would have taken.

    smooth: mix neighbours, for colours; depth and labels take the nearest pixel. outside: what stands where the lens
    saw nothing. Topic 06.
    """
    maps = _maps(check_K("K", K).tobytes(), lens, image.shape[1::-1])
    return cv2.remap(image, *maps, cv2.INTER_LINEAR if smooth else cv2.INTER_NEAREST, borderValue=(outside,) * 3)


@lru_cache(maxsize=2)  # of a folder's pictures all have one camera
def _maps(K: bytes, lens: Lens, size: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """For each pixel of the straight picture, where in the lens's it stands: u and v."""
    K = np.frombuffer(K).reshape(3, 3)
    if lens.model == "brown_conrady":
        return cv2.initUndistortRectifyMap(K, np.array(lens.coefficients), None, K, size, cv2.CV_32FC1)
    v, u = np.indices(size[::-1]).reshape(2, -1)
    xy = lens.to_pixels((np.linalg.inv(K) @ np.stack([u, v, np.ones(u.size)]))[:2].T)
    uv = np.nan_to_num(xy @ K[:2, :2].T + K[:2, 2], nan=-1e6).astype(np.float32)
    return uv[:, 0].reshape(size[::-1]), uv[:, 1].reshape(size[::-1])
