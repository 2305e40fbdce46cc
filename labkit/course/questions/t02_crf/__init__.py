"""Questions of topic 02: costs, weights, the energy, ICM's step, the arcs of a cut, a lower bound (section 2).

All models are Potts on 4 neighbours: psi (H, W, C) is what each class costs, w_right (H, W - 1) joins the pixels (v, u)
and (v, u + 1), w_down (H - 1, W) the pixels (v, u) and (v + 1, u).
"""

import numpy as np


def model(rng, H=4, W=6, C=3):
    """Draw psi, some of it negative, w_right and w_down."""
    return rng.normal(1.0, 2.0, (H, W, C)), rng.uniform(0.1, 2.0, (H, W - 1)), rng.uniform(0.1, 2.0, (H - 1, W))


def labelled_model(rng):
    """Draw labels among which neighbours often agree, and a model."""
    return np.minimum(rng.integers(0, 4, (4, 6)), 2).astype(np.uint8), *model(rng)
