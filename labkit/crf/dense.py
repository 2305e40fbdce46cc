"""The dense CRF: every pixel is every other's neighbour (Kraehenbuehl and Koltun 2011, arXiv:1210.5644).

    w_pq = w_appearance exp(-|p - q|^2 / (2 theta_alpha^2) - |I_p - I_q|^2 / (2 theta_beta^2))
         + w_smoothness exp(-|p - q|^2 / (2 theta_gamma^2))

The Potts model of topic 02 with all pairs as neighbours. N^2 pairs are too many for a cut, but in mean field the
message to a pixel is a weighted mean of all q's, which is one Gaussian filter in the space of positions and colours.
"""

from itertools import combinations

import numpy as np
from jaxtyping import Float, Int, Num
from scipy.sparse import csr_array

from labkit.crf.energy import check_channels, check_units
from labkit.support.validation import MAX_ITERATIONS, check_finite, check_number, check_shape, check_whole, require

MAX_COST = 1e30  # of unary and weights: with it all sums stay within float32
MAX_STEPS = 2**16  # scales that an image may span: float32 leaves the lattice's coordinates four bits behind the point
MAX_CHANNELS = 16  # a pixel has (channels + 3)^2 coordinates


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
    permutohedral lattice: of 40x60 pixels about 1 % get another label than by exact mean field where classes come in
    regions, and of a picture and costs of pure noise 5 % after one iteration and 15 % after ten. Raises ValueError
    naming the argument that does not fit, such as a scale of which the image spans more than 2^16.

    >>> unary = np.zeros((4, 4, 2)) + (0.0, 1.0)
    >>> unary[1, 1] = (1.0, 0.0)  # one pixel stands out
    >>> dense_crf(unary, np.zeros((4, 4, 3), np.uint8)).argmax(axis=2)[1, 1]
    np.int64(0)
    """
    unary = check_finite("unary", check_shape("unary", unary, (None, None, None)))
    require("unary", 0 not in unary.shape, "at least one pixel and class", f"shape {unary.shape}")
    largest = float(np.abs(unary, dtype=np.float64).max())
    require("unary", largest <= MAX_COST, f"costs of at most {MAX_COST:g}", f"one of size {largest:g}")
    check_whole("iterations", iterations, 0, MAX_ITERATIONS)
    for name, weight in (("w_appearance", w_appearance), ("w_smoothness", w_smoothness)):
        check_number(name, weight, 0.0, MAX_COST)
    H, W, C = unary.shape
    colours = check_channels("image", check_finite("image", image), unary)
    require("image", colours.shape[2] <= MAX_CHANNELS, f"at most {MAX_CHANNELS} channels", colours.shape[2])
    span = float(np.abs(colours, dtype=np.float64).max(initial=0.0))
    spans = (("theta_alpha", theta_alpha, max(H, W)), ("theta_beta", theta_beta, span))
    for name, scale, values in (*spans, ("theta_gamma", theta_gamma, max(H, W))):
        check_number(name, scale, max(values / MAX_STEPS, 1e-30), 1e30)
    check_units(colours, "theta_beta", theta_beta)
    colours = colours.astype(np.float32)
    v, u = np.indices((H, W), np.float32)
    appearance = np.dstack([u / theta_alpha, v / theta_alpha, colours / theta_beta])
    smoothness = np.dstack([u / theta_gamma, v / theta_gamma])
    kernels = [(w_appearance, GaussianFilter("theta_alpha and theta_beta", appearance))]
    kernels.append((w_smoothness, GaussianFilter("theta_gamma", smoothness)))
    minus_unary = -unary.reshape(H * W, C).astype(np.float32)
    q = softmax(minus_unary)
    for _ in range(iterations):
        q = softmax(minus_unary + sum(weight * gaussian.filtered(q) for weight, gaussian in kernels))
    return q.reshape(H, W, C)


def softmax(z: Float[np.ndarray, "N C"]) -> Float[np.ndarray, "N C"]:
    """The softmax of each row; with classes first, sums and maxima run along memory, ten times as fast.

    >>> softmax(np.array([[0.0, np.log(3.0)]])).round(2)
    array([[0.25, 0.75]])
    """
    p = np.ascontiguousarray(z.T)
    p -= p.max(axis=0)
    np.exp(p, out=p)
    p /= p.sum(axis=0)
    return np.ascontiguousarray(p.T)


class GaussianFilter:
    """exp(-|f_p - f_q|^2 / 2) between all pixels, symmetrically normalised: K_pq / sqrt(sum_q K_pq sum_p K_pq).

    On the permutohedral lattice (Adams, Baek and Davis 2010): each pixel gives its values to the d + 1 corners of the
    simplex around its features (splat), corners exchange with their neighbours along d + 1 directions (blur), and each
    pixel collects from its corners again (slice). The work is linear in the number of pixels and in d^2.
    """

    def __init__(self, name: str, features: Float[np.ndarray, "H W d"]):
        """features: each channel divided by its deviation; a ValueError with `name` for a range too large to index."""
        d = features.shape[2]
        elevated = elevation(d).astype(np.float32) @ features.reshape(-1, d).astype(np.float32).T
        multiple, rank, weights = simplices(elevated)
        # A corner is one integer, key = coordinates . stride: a step along a direction adds a constant to it.
        size = np.ptp((d + 1) * multiple - rank, axis=1).astype(np.int64) + d + 2 * (d + 1)
        if np.prod(size[:d].astype(np.float64)) > 2.0**62:
            raise ValueError(f"{name}: expected larger scales; {d} features span up to {size.max()} lattice steps")
        stride = np.append(np.cumprod([1, *size[: d - 1]]), 0)  # the last coordinate has no place in keys
        # From corner to corner all coordinates rise by 1, and one of them, the last in rank first, falls by d + 1.
        falls = by_rank(rank, np.broadcast_to((d + 1) * stride[:, None], rank.shape))
        keys = np.empty((rank.shape[1], d + 1), np.int64)
        keys[:, 0] = ((d + 1) * stride) @ (multiple - multiple.min(axis=1, keepdims=True))
        for r in range(d):
            keys[:, r + 1] = keys[:, r] + (stride.sum() - falls[d - r])
        found, corner = np.unique(keys, return_inverse=True)
        first = np.arange(0, corner.size + 1, d + 1, dtype=np.int32)
        self.splat = csr_array((weights.T.ravel(), corner.ravel().astype(np.int32), first), (len(keys), len(found)))
        # A step along direction j adds d + 1 to coordinate j and takes 1 from all.
        self.blurs = [blur_along(step, found) for step in ((d + 1) * stride - stride.sum()).tolist()]
        ones = np.ones((len(keys), 1), np.float32)
        scale = 1.0 / np.sqrt(self.filtered(ones) + np.float32(1e-20))
        self.splat.data *= np.repeat(scale, d + 1)

    def filtered(self, values: Float[np.ndarray, "N C"]) -> Float[np.ndarray, "N C"]:
        """Filter values, float32, one row a pixel."""
        at_corners = self.splat.T @ values
        for blur in self.blurs:
            at_corners = blur @ at_corners
        return self.splat @ at_corners


def simplices(elevated: Float[np.ndarray, "d1 N"]):
    """Find the simplex around each point of the plane sum(x) = 0: its base, ranks, and barycentric weights.

    The base is (d + 1) * multiple. Corner r lies r above it in the coordinates of rank up to d - r and r - (d + 1) in
    the others; its weight is weights[r]. Each is (d + 1, N); coordinates come first, so that work runs along memory.
    """
    d1 = len(elevated)
    # The nearest point whose coordinates are all multiples of d + 1; steps of d + 1 make them sum to 0 again, first
    # where the point lies furthest above (rank 0) or below its multiple.
    multiple = np.floor(elevated / np.float32(d1) + np.float32(0.5)).astype(np.int32)
    over = elevated - d1 * multiple
    rank = np.zeros(elevated.shape, np.int8)
    for j, k in combinations(range(d1), 2):
        later = over[k] > over[j]
        rank[j] += later
        rank[k] += ~later
    rank += multiple.sum(axis=0).astype(np.int8)
    wraps = rank // np.int8(d1)
    multiple, rank = multiple - wraps, rank - np.int8(d1) * wraps
    above = (elevated - d1 * multiple).astype(np.float32) / np.float32(d1)
    # From the furthest above to the least: a weight is the difference of two neighbours.
    descending, weights = by_rank(rank, above), np.empty_like(above)
    weights[1:] = (descending[:-1] - descending[1:])[::-1]
    weights[0] = 1.0 - descending[0] + descending[-1]
    return multiple, rank, weights


def by_rank(rank: Int[np.ndarray, "d1 N"], values: Num[np.ndarray, "d1 N"]) -> Num[np.ndarray, "d1 N"]:
    """Put each column in the order of its ranks.

    >>> by_rank(np.array([[1], [2], [0]]), np.array([[10], [20], [30]])).T
    array([[30, 10, 20]])
    """
    ordered = np.empty(rank.shape, values.dtype)
    ordered[rank, np.arange(rank.shape[1])] = values
    return ordered


def blur_along(step: int, found: Int[np.ndarray, "M"]) -> csr_array:
    """Return the matrix that adds to each corner half of its two neighbours, of keys `step` more and less."""
    M = len(found)
    place = np.minimum(np.searchsorted(found, found + step), M - 1)
    one = np.flatnonzero(found[place] == found + step)
    columns = np.full((M, 3), -1, np.int32)
    columns[place[one], 0], columns[:, 1], columns[one, 2] = one, np.arange(M), place[one]
    there = columns >= 0
    halves = np.broadcast_to(np.float32([0.5, 1.0, 0.5]), (M, 3))
    first = np.append(0, there.sum(axis=1).cumsum()).astype(np.int32)
    return csr_array((halves[there], columns[there], first), (M, M))


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
