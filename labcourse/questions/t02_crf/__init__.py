"""Questions of topic 02: costs, weights, the energy, ICM's step, the arcs of a cut, a row's best labels.

All models are Potts on 8 neighbours: psi (H, W, C) is what each class costs, weights (4, H, W) the pairs, as in
`PottsCRF`: weights[d, v, u] joins the pixel (v, u) and the one PAIRS[d] (down, right) of it, and is 0 where that one is
outside the image.
"""

import numpy as np

PAIRS = ((0, 1), (1, 0), (1, 1), (1, -1))


def model(rng, H=4, W=6, C=3):
    """Draw psi, some of it negative, and weights."""
    weights = rng.uniform(0.1, 2.0, (4, H, W))
    weights[0, :, -1] = weights[1, -1] = weights[2, -1] = weights[2, :, -1] = weights[3, -1] = weights[3, :, 0] = 0.0
    return rng.normal(1.0, 2.0, (H, W, C)), weights


def labelled_model(rng, H=4, W=6):
    """Draw labels among which neighbours often agree, and a model."""
    return np.minimum(rng.integers(0, 4, (H, W)), 2).astype(np.uint8), *model(rng, H, W)


def disagreeing(y, pairs=PAIRS):
    """Whether each pixel's label differs from the label of the neighbour of each of its pairs, (D, H, W).

    Where a pair leaves the image it is anything: its weight is 0.
    """
    return np.stack([y != np.roll(y, (-down, -right), (0, 1)) for down, right in pairs])


def unary_part(y, psi):
    """What the pixels cost on their own."""
    return np.take_along_axis(psi, y[..., None].astype(int), axis=2).sum()
