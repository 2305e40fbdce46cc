"""The energy: a Potts model over the pixel grid, whose lowest labelling is the answer (topic 02).

    E(y) = sum over pixels p of psi_p(y_p)  +  sum over neighbours {p, q} of w_pq [y_p != y_q]
    w_pq = lam exp(-|I_p - I_q|^2 / (2 sigma_I^2) - |p - q|^2 / (2 sigma_p^2))

The unary term psi says what each pixel looks like on its own; the pairwise term makes neighbours agree, less so
across an edge of the image: the contrast-sensitive weights of Boykov and Jolly 2001 (doi:10.1109/ICCV.2001.937505)
with a term for the distance. Every solver of this package takes a `PottsCRF` and gives a `MapResult`.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import wraps

import numpy as np
from jaxtyping import Float, Integer, Num, UInt8

from labkit.crf.energy_kernels import energy_by_row, pair_exponents
from labkit.support.validation import (
    as_array,
    check_finite,
    check_labels,
    check_number,
    check_same_size,
    check_shape,
    require,
)

# Each unordered pair of neighbours counts once: a pixel owns the pairs with these neighbours, (down, right) of it.
OFFSETS = {4: ((0, 1), (1, 0)), 8: ((0, 1), (1, 0), (1, 1), (1, -1))}
MAX_CLASSES = 255
MAX_COST = 1e150  # of finite costs and weights: sums over any image stay finite
SCALES = (1e-100, 1e100)  # what a sigma may be: its square and its inverse are numbers, too


@dataclass(frozen=True, eq=False)
class PottsCRF:
    """A Potts model: what each class costs at each pixel, and what it costs neighbours to disagree (topic 02).

    unary: psi, (H, W, C), any unit; +inf forbids a class at a pixel. weights: w >= 0, (D, H, W) with D = 2 for 4
    neighbours and D = 4 for 8; weights[d, v, u] belongs to the pair of pixel (v, u) and the one OFFSETS[...][d] from
    it, and is 0 where that one is outside the image. Raises ValueError naming the argument that does not fit.

    >>> crf = PottsCRF(np.array([[[0.0, 1.0], [1.0, 0.0]]]), np.array([[[0.5, 0.0]], [[0.0, 0.0]]]))
    >>> crf.energy(np.array([[0, 1]])), crf.energy(np.array([[0, 0]]))
    (0.5, 1.0)
    """

    unary: Float[np.ndarray, "H W C"]
    weights: Float[np.ndarray, "D H W"]

    def __post_init__(self):
        unary = check_unary(self.unary)
        weights = check_finite("weights", check_shape("weights", self.weights, (None, *unary.shape[:2])))
        require("weights", len(weights) in (2, 4), "2 or 4 pairs per pixel (4 or 8 neighbours)", len(weights))
        why = "a negative one rewards disagreement, which is not submodular, so that no cut can represent it"
        require("weights", weights.min(initial=0.0) >= 0.0, "costs >= 0", lambda: f"{weights.min():.6g}; {why}")
        largest = weights.max(initial=0.0)
        require("weights", largest <= MAX_COST, f"costs of at most {MAX_COST:g}", f"{largest:.6g}")
        for d, offset in enumerate(OFFSETS[2 * len(weights)]):
            outside = np.ones(unary.shape[:2], bool)
            outside[pair_slices(offset)[0]] = False
            if weights[d][outside].any():
                raise ValueError(f"weights: expected 0 where a pair leaves the image, got others in weights[{d}]")
        self._put(unary, weights.astype(np.float64, copy=False))

    def _put(self, unary: Float[np.ndarray, "H W C"], weights: Float[np.ndarray, "D H W"]) -> None:
        object.__setattr__(self, "unary", unary)
        object.__setattr__(self, "weights", weights)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Height, width and number of classes."""
        return self.unary.shape

    @property
    def connectivity(self) -> int:
        """Neighbours of an inner pixel: 4 or 8."""
        return 2 * len(self.weights)

    @property
    def offsets(self) -> tuple[tuple[int, int], ...]:
        """Steps (down, right) from a pixel to the neighbours whose pairs it owns."""
        return OFFSETS[self.connectivity]

    @classmethod
    def from_image(
        cls,
        unary: Num[np.ndarray, "H W C"],
        image: Num[np.ndarray, "H W *channels"],
        lam: float,
        sigma_I: float,
        sigma_p: float = 1.0,
        connectivity: int = 4,
        extra: tuple = (),
    ) -> "PottsCRF":
        """Build the contrast-sensitive Potts model over an image (topic 02).

        image: (H, W) or (H, W, channels), any real dtype; sigma_I is in its own units (0 to 255 for uint8). lam >= 0,
        sigma_p in pixels (with 4 neighbours it only rescales lam, all pairs being one pixel apart). Floats in 0..1 want
        a sigma_I of their size: one above 2 is refused. extra: pairs
        (channels, sigma) such as a depth image and its scale in metres; each adds its own -|d|^2 / (2 sigma^2) to the
        exponent, and NaN there (no reading) adds nothing. Raises ValueError naming the argument that does not fit.

        >>> unary, image = np.zeros((2, 3, 2)), np.zeros((2, 3, 3), np.uint8)
        >>> crf = PottsCRF.from_image(unary, image, lam=2.0, sigma_I=10.0, sigma_p=1.0)
        >>> crf.weights.shape, int((crf.weights > 0).sum()), crf.weights.max().round(3)  # 2 * 2 + 1 * 3 pairs
        ((2, 2, 3), 7, np.float64(1.213))
        """
        for name, sigma in (("sigma_I", sigma_I), ("sigma_p", sigma_p), *(("extra", sigma) for _, sigma in extra)):
            check_number(name, sigma, *SCALES)
        check_number("lam", lam, 0.0, MAX_COST)
        require("connectivity", connectivity in OFFSETS, "4 or 8 neighbours", connectivity)
        unary = check_unary(unary)
        image = check_channels("image", check_finite("image", image), unary)
        check_units(image, "sigma_I", sigma_I)
        scaled = [check_channels("extra", channels, unary).astype(np.float64) / sigma for channels, sigma in extra]
        model = object.__new__(cls)  # what is built here needs no second check
        model._put(unary, contrast_weights(image, scaled, lam, sigma_I, sigma_p, connectivity))
        return model

    def check_labelling(self, name: str, y: Integer[np.ndarray, "H W"]) -> Integer[np.ndarray, "H W"]:
        """Return `y` if it labels every pixel of this model; raise a ValueError that calls it `name` if not."""
        return check_labels(name, check_shape(name, y, self.shape[:2]), self.shape[2], ignore=None)

    def energy(self, y: Integer[np.ndarray, "H W"]) -> float:
        """Return E(y) in float64, for labels of any integer dtype; +inf if a forbidden class is used.

        Raises ValueError if y has another size than the image or a label outside 0 .. C - 1.
        """
        return self._energy(self.check_labelling("y", y))

    def _energy(self, y: Integer[np.ndarray, "H W"]) -> float:
        return float(energy_by_row(self.unary, self.weights, np.array(self.offsets), y).sum())


@dataclass(frozen=True, eq=False)
class MapResult:
    """What a solver found, and how far from the optimum it can be at most.

    labels: uint8 (H, W). energy: E(labels). lower_bound: proven, no labelling has less energy (-inf from a method that
    proves nothing). gap: (energy - lower_bound) / |energy|. iterations: sweeps or moves. seconds: wall time.
    """

    labels: UInt8[np.ndarray, "H W"]
    energy: float
    lower_bound: float = -np.inf
    iterations: int = 0
    seconds: float = 0.0

    @property
    def gap(self) -> float:
        """How far above the optimum the energy can be, relative to it: 0 is proven optimal, inf is no proof."""
        excess = self.energy - self.lower_bound
        return excess / abs(self.energy) if self.energy and excess else excess


def timed(method: Callable[..., MapResult]) -> Callable[..., MapResult]:
    """A method whose results say how many seconds they took."""

    @wraps(method)
    def run(*args, **options) -> MapResult:
        start = time.perf_counter()
        result = method(*args, **options)
        return replace(result, seconds=time.perf_counter() - start)

    return run


def unary_from_probabilities(
    probabilities: Float[np.ndarray, "H W C"], floor: float = 1e-6
) -> Float[np.ndarray, "H W C"]:
    """Turn class probabilities into costs, -log p, with p clipped at `floor` so that no class is ruled out (topic 02).

    Raises ValueError unless each pixel's probabilities lie in 0..1 and sum to 1 (within 1e-3).

    >>> unary_from_probabilities(np.array([[[1.0, 0.0]]]), floor=1e-2).round(3) + 0.0
    array([[[0.   , 4.605]]])
    """
    p = check_finite("probabilities", check_shape("probabilities", probabilities, (None, None, None)))
    check_number("floor", floor, 0.0, 1.0)
    require("floor", 0.0 < floor < 1.0, "a probability between 0 and 1", floor)
    sums = np.einsum("vuc->vu", p) if p.size else np.ones(1)
    if p.size and (p.min() < 0.0 or p.max() > 1.0 + 1e-3 or np.abs(sums - 1.0).max() > 1e-3):
        raise ValueError(
            f"probabilities: expected 0..1 summing to 1 at each pixel, got {p.min():.4g} to {p.max():.4g} "
            f"with sums from {sums.min():.4g}; are they logits?"
        )
    psi = np.clip(p, floor, 1.0, dtype=np.float64)
    return np.negative(np.log(psi, out=psi), out=psi)


def check_unary(unary: Num[np.ndarray, "H W C"]) -> Float[np.ndarray, "H W C"]:
    """Return a unary term as float64; raise a ValueError unless each pixel has at least one class of finite cost."""
    unary = check_shape("unary", unary, (None, None, None))
    require("unary", unary.dtype.kind in "fiu", "real costs", f"dtype {unary.dtype}")
    if 0 in unary.shape or not 2 <= unary.shape[2] <= MAX_CLASSES:
        raise ValueError(f"unary: expected at least one pixel and 2 to {MAX_CLASSES} classes, got {unary.shape}")
    low, high = float(unary.min()), float(unary.max())
    if not low > -np.inf:  # NaN is not, either
        raise ValueError("unary: expected costs that are finite or +inf (forbidden), got NaN or -inf")
    finite = high if high < np.inf else float(unary.max(where=unary < np.inf, initial=low if low < np.inf else 0.0))
    largest = max(-low, finite)
    require("unary", largest <= MAX_COST, f"costs of at most {MAX_COST:g} in size, or +inf", f"{largest:.6g}")
    if high == np.inf and np.isinf(unary.min(axis=2)).any():
        raise ValueError("unary: expected at least one allowed class per pixel, got a pixel with only +inf")
    return unary.astype(np.float64, copy=False)


def check_channels(name: str, image: Num[np.ndarray, "H W *channels"], unary: np.ndarray) -> Num[np.ndarray, "H W k"]:
    """Return an image or a single channel as (H, W, k); raise a ValueError unless it has the unary term's size."""
    image = as_array(name, image)
    if image.ndim not in (2, 3) or image.dtype.kind not in "fiub":
        raise ValueError(f"{name}: expected real numbers (H, W) or (H, W, k), got {image.dtype} {image.shape}")
    check_same_size("unary", unary, name, image)
    return image.reshape(*image.shape[:2], -1)


SMALL_SCALE = 2.0  # of differences between colours in 0..1: with more, no edge weighs anything


def check_units(image: Num[np.ndarray, "H W k"], name: str, scale: float) -> None:
    """Raise a ValueError if an image of floats in 0..1 stands beside a scale of colours in 0..255.

    >>> check_units(np.full((1, 1, 1), 0.5), "sigma_I", 30.0)
    Traceback (most recent call last):
    ...
    ValueError: image: expected 0..255 beside sigma_I = 30, got floats up to 0.5; multiply it, or divide sigma_I, by 255
    """
    if image.dtype.kind == "f" and scale > SMALL_SCALE and 0.0 < image.max(initial=0.0) <= 1.0:
        raise ValueError(
            f"image: expected 0..255 beside {name} = {scale:g}, got floats up to {image.max():.3g}; "
            f"multiply it, or divide {name}, by 255"
        )


def contrast_weights(
    image: Num[np.ndarray, "H W k"], scaled: list, lam: float, sigma_I: float, sigma_p: float, connectivity: int
) -> Float[np.ndarray, "D H W"]:
    """Return w of the module's formula for all pairs; `scaled` holds further channels, each divided by its sigma."""
    H, W = image.shape[:2]
    image = image if image.dtype == np.uint8 else image.astype(np.float64, copy=False)
    extra = np.concatenate(scaled, axis=2) if scaled else np.empty((H, W, 0))
    offsets = np.array(OFFSETS[connectivity])
    weights = np.empty((len(offsets), H, W))
    pair_exponents(image, 1.0 / sigma_I, extra, offsets, -0.5 * (offsets**2).sum(axis=1) / sigma_p**2, weights)
    np.exp(weights, out=weights)
    return np.multiply(weights, lam, out=weights)


def pair_slices(offset: tuple[int, int]) -> tuple[tuple[slice, slice], tuple[slice, slice]]:
    """Return the slices of an image that hold the first and the second pixels of all pairs one `offset` apart.

    >>> p, q = pair_slices((1, -1))
    >>> np.arange(6).reshape(2, 3)[p], np.arange(6).reshape(2, 3)[q]
    (array([[1, 2]]), array([[3, 4]]))
    """
    ahead = {-1: slice(None, -1), 0: slice(None), 1: slice(1, None)}
    return tuple(ahead[-step] for step in offset), tuple(ahead[step] for step in offset)
