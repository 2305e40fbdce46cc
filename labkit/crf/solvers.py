"""One entrance to all solvers, and the refinement of a network's probabilities."""

import numpy as np
from jaxtyping import Float, Num

from labkit.crf.cuts import expansion, trws_expansion
from labkit.crf.energy import MapResult, PottsCRF, unary_from_probabilities
from labkit.crf.exact import brute_force, min_cut, unary
from labkit.crf.mean_field import mean_field
from labkit.crf.messages import icm, trws
from labkit.crf.persistency import persistency
from labkit.support.validation import check_depth, require

METHODS = {
    "brute_force": brute_force,
    "unary": unary,
    "min_cut": min_cut,
    "icm": icm,
    "mean_field": mean_field,
    "expansion": expansion,
    "trws": trws,
    "trws+expansion": trws_expansion,
    "persistency": persistency,
}


def solve(crf: PottsCRF, method: str = "trws+expansion", **options) -> MapResult:
    """Look for the labelling of least energy; `options` go to the method's function (topic 02).

    method: a name of METHODS. "brute_force" (tiny grids) and "min_cut" (two classes) are exact; "trws",
    "trws+expansion" and "persistency" prove how far they can be from the optimum. Raises ValueError for another name.

    >>> psi = np.array([[[0.0, 2.0, 2.0], [1.0, 2.0, 0.8], [0.0, 2.0, 2.0]]])
    >>> crf = PottsCRF.from_image(psi, np.zeros((1, 3, 3), np.uint8), lam=0.5, sigma_I=10.0)
    >>> solve(crf).labels, solve(crf, "unary").labels
    (array([[0, 0, 0]], dtype=uint8), array([[0, 2, 0]], dtype=uint8))
    """
    require("method", method in METHODS, f"one of {', '.join(METHODS)}", repr(method))
    return METHODS[method](crf, **options)


def refine(
    probabilities: Float[np.ndarray, "H W C"],
    image: Num[np.ndarray, "H W *channels"],
    depth: Float[np.ndarray, "H W"] | None = None,
    *,
    lam: float = 8.0,
    sigma_I: float = 30.0,
    sigma_p: float = 1.0,
    sigma_depth: float = 0.03,
    connectivity: int = 8,
    floor: float = 1e-4,
    method: str = "persistency",
) -> MapResult:
    """Refine a network's class probabilities with the image: labels that are smooth except across edges (topic 02).

    image: RGB, uint8; sigma_I in its units. depth: metres, 0 or NaN where there is no reading; with it the labels may
    also break at jumps of about sigma_depth metres, where objects end. Probabilities are clipped at `floor`. The
    defaults are the best for the shipped UNet on scenes that no evaluation uses (BENCHMARKS.md). Raises
    ValueError naming the argument that does not fit.

    >>> p = np.full((3, 3, 2), (0.9, 0.1))
    >>> p[1, 1] = (0.4, 0.6)
    >>> refine(p, np.zeros((3, 3, 3), np.uint8)).labels[1, 1]
    np.uint8(0)
    """
    extra = ()
    if depth is not None:
        depth = check_depth("depth", depth)
        extra = ((np.where(depth > 0.0, depth, np.nan), sigma_depth),)
    psi = unary_from_probabilities(probabilities, floor)
    return solve(PottsCRF.from_image(psi, image, lam, sigma_I, sigma_p, connectivity, extra), method)
