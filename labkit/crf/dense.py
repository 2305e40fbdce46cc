"""The dense CRF: every pixel is every other's neighbour (Kraehenbuehl and Koltun 2011).

    w_pq = w_appearance exp(-|p - q|^2 / (2 theta_alpha^2) - |I_p - I_q|^2 / (2 theta_beta^2))
         + w_smoothness exp(-|p - q|^2 / (2 theta_gamma^2))

The Potts model of topic 02 with all pairs as neighbours. N^2 pairs are too many for a cut, but in mean field the
message to a pixel is a weighted mean of all q's, which is one Gaussian filter in the space of positions and colours.
"""

import numpy as np
from jaxtyping import Float, Num

from labkit.crf import lattice_kernels as lattice
from labkit.crf.energy import check_channels
from labkit.support.validation import check_finite, check_shape, require


def dense_crf(
    unary: Num[np.ndarray, "H W C"],
    image: Num[np.ndarray, "H W *channels"],
    *,
    theta_alpha: float = 60.0,
    theta_beta: float = 10.0,
    w_appearance: float = 10.0,
    theta_gamma: float = 3.0,
    w_smoothness: float = 3.0,
    iterations: int = 10,
) -> Float[np.ndarray, "H W C"]:
    """Return the mean-field probabilities (H, W, C), float32, of a dense CRF; argmax over the last axis labels.

    unary: finite costs. theta_alpha and theta_gamma in pixels, theta_beta in the image's units. The kernels are
    normalised symmetrically, so that the weights do not depend on the image's size; they are approximated on the
    permutohedral lattice. Raises ValueError naming the argument that does not fit.

    >>> unary = np.zeros((4, 4, 2)) + (0.0, 1.0)
    >>> unary[1, 1] = (1.0, 0.0)  # one pixel stands out
    >>> dense_crf(unary, np.zeros((4, 4, 3), np.uint8)).argmax(axis=2)[1, 1]
    np.int64(0)
    """
    unary = check_finite("unary", check_shape("unary", unary, (None, None, None)))
    require("unary", 0 not in unary.shape, "at least one pixel and class", f"shape {unary.shape}")
    numbers = {"theta_alpha": theta_alpha, "theta_beta": theta_beta, "theta_gamma": theta_gamma}
    numbers |= {"w_appearance": w_appearance, "w_smoothness": w_smoothness}
    for name, number in numbers.items():
        if not (0.0 <= number < np.inf) or (number == 0.0 and name.startswith("theta")):
            raise ValueError(f"{name}: expected a finite number {'above' if 'theta' in name else '>='} 0, got {number}")
    require("iterations", iterations >= 0, "at least 0", iterations)
    H, W, C = unary.shape
    colours = check_channels("image", check_finite("image", image), unary).astype(np.float32)
    v, u = np.indices((H, W), np.float32)
    appearance = np.dstack([u / theta_alpha, v / theta_alpha, colours / theta_beta])
    smoothness = np.dstack([u / theta_gamma, v / theta_gamma])
    kernels = [(w_appearance, GaussianFilter(appearance)), (w_smoothness, GaussianFilter(smoothness))]
    minus_unary = -unary.reshape(H * W, C).astype(np.float32)
    q = softmax_of_rows(minus_unary)
    for _ in range(iterations):
        z = minus_unary.copy()
        for weight, gaussian in kernels:
            gaussian.add_filtered(q, weight, z)
        q = softmax_of_rows(z)
    return q.reshape(H, W, C)


def softmax_of_rows(z: Float[np.ndarray, "N C"]) -> Float[np.ndarray, "N C"]:
    """Turn each row of float32 into probabilities: by columns, since NumPy is slow along rows so short."""
    top = z[:, 0]
    for c in range(1, z.shape[1]):
        top = np.maximum(top, z[:, c])
    p = np.exp(z - top[:, None])
    return p / (p @ np.ones(z.shape[1], np.float32))[:, None]


class GaussianFilter:
    """exp(-|f_p - f_q|^2 / 2) between all pixels, symmetrically normalised: K_pq / sqrt(sum_q K_pq sum_p K_pq)."""

    def __init__(self, features: Float[np.ndarray, "H W d"]):
        """features: each channel divided by its standard deviation; ValueError for a range too large to index."""
        d = features.shape[2]
        elevated = features.reshape(-1, d).astype(np.float32) @ elevation(d).T.astype(np.float32)
        margin = 3 * (d + 1)  # corners and their neighbours stay within it
        lowest = np.floor(elevated.min(axis=0)).astype(np.int64) - margin
        size = np.ceil(elevated.max(axis=0)).astype(np.int64) + margin - lowest
        if np.prod(size[:d].astype(np.float64)) > 2.0**62:
            raise ValueError(f"theta: expected larger scales; {d} features span up to {size.max()} lattice steps")
        stride = np.cumprod(np.concatenate([[1], size[: d - 1]]))
        keys, self.weights = lattice.corners_of_pixels(elevated, lowest, stride)
        found, corner = np.unique(keys, return_inverse=True)
        self.corner = 1 + corner.reshape(keys.shape).astype(np.int32)
        # A step along direction j adds d + 1 to coordinate j and takes 1 from all; the last one has no place in keys.
        steps = np.append((d + 1) * stride, 0) - stride.sum()
        self.near = lattice.neighbour_corners(found, steps)
        self.scale = np.ones(len(keys), np.float32)
        total = np.zeros((len(keys), 1), np.float32)
        self.add_filtered(np.ones_like(total), 1.0, total)
        self.scale = 1.0 / np.sqrt(total[:, 0] + np.float32(1e-20))

    def add_filtered(self, values: Float[np.ndarray, "N C"], weight: float, out: Float[np.ndarray, "N C"]) -> None:
        """out += weight * filtered values, both float32, one row a pixel."""
        scale = (np.sqrt(weight) * self.scale).astype(np.float32)
        lattice.lattice_filter(values, scale, self.corner, self.weights, self.near, out)


def elevation(d: int) -> Float[np.ndarray, "d1 d"]:
    """Return the map from d features to the plane sum(x) = 0 in d + 1 dimensions on which the lattice lies.

    Its columns are orthogonal; its scale makes splatting, blurring and slicing together a Gaussian of deviation 1.

    >>> (elevation(2).T @ elevation(2)).round(6)
    array([[6., 0.], [0., 6.]])
    """
    E = np.zeros((d + 1, d))
    for j in range(d):
        E[: j + 1, j] = 1.0
        E[j + 1, j] = -(j + 1.0)
        E[:, j] /= np.sqrt((j + 1.0) * (j + 2.0))
    return E * (d + 1) * np.sqrt(2.0 / 3.0)
