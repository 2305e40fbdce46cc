"""Questions of topic 02: costs, weights, the energy, ICM's step, the arcs of a cut, a row's best labels.

All models are Potts on 8 neighbours: psi (H, W, C) is what each class costs, weights (4, H, W) the pairs, as in
`PottsCRF`: weights[d, v, u] joins the pixel (v, u) and the one PAIRS[d] (down, right) of it, and is 0 where that one is
outside the image.
"""

from functools import partial

import numpy as np

from labcourse.kinds import LONG, MOST_CLASSES, array, labels

PAIRS = ((0, 1), (1, 0), (1, 1), (1, -1))


def inside_alone(rng, weights):
    """Weights, 0 where a pair leaves the image."""
    weights = weights.copy()
    weights[0, :, -1] = weights[1, -1] = weights[2, -1] = weights[2, :, -1] = weights[3, -1] = weights[3, :, 0] = 0.0
    return weights


LABELS = labels("H W", unjudged=False)
COSTS = array("H W C", -1e6, 1e6, says="-1e6 to 1e6")
WEIGHTS = array("4 H W", 0.0, 1e6, form=inside_alone, says=("0 to 1e6", "0 where a pair leaves the image"))


def model(rng, H=4, W=6, C=3, size=1.0):
    """Draw psi, some of it negative, and weights; size: that of a common cost."""
    weights = inside_alone(rng, rng.uniform(0.1, 2.0, (4, H, W)))
    return np.clip(size * rng.normal(1.0, 2.0, (H, W, C)), -1e6, 1e6), np.minimum(size * weights, 1e6)


def labelled_model(rng, H=4, W=6, C=3, size=1.0):
    """Draw labels among which neighbours often agree, the last class at both ends of the image, and a model."""
    y = np.minimum(rng.integers(0, C + 1, (H, W)), C - 1)
    y[0, 0] = y[-1, -1] = C - 1
    if C == MOST_CLASSES:  # else hardly any pixel has one of the last
        y[1] = C - 1
    return y.astype(np.uint8), *model(rng, H, W, C, size)


# Images of one row, of one column, of as many classes as there may be, and of large and small costs.
LABELLED_MODELS = (
    labelled_model,
    partial(labelled_model, H=1, W=LONG, C=1),
    partial(labelled_model, H=LONG, W=1, C=2),
    partial(labelled_model, H=3, W=3, C=MOST_CLASSES, size=6e5),
    partial(labelled_model, H=3, W=3, size=1e-3),
)


def disagreeing(y, pairs=PAIRS):
    """Whether each pixel's label differs from the label of the neighbour of each of its pairs, (D, H, W).

    Where a pair leaves the image it is anything: its weight is 0.
    """
    return np.stack([y != np.roll(y, (-down, -right), (0, 1)) for down, right in pairs])


def unary_part(y, psi):
    """What the pixels cost on their own."""
    return np.take_along_axis(psi, y[..., None].astype(int), axis=2).sum()
