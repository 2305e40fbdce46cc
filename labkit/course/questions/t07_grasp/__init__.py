"""The questions of lab 07: what a cloud says, where the jaws close, and (in t07_hand) where the hand goes."""

import numpy as np

RECTANGLE = np.array([[4.0, 1.0, 0.0], [4.0, 3.0, 0.0], [0.0, 1.0, 0.0], [0.0, 3.0, 0.0], [2.0, 2.0, 0.0]])


def cloud(rng):
    """Draw a cloud of few points somewhere on a table: long, less wide, in some cases high, turned by any yaw."""
    count = int(rng.integers(7, 40))
    long, wide, high = rng.uniform(0.05, 0.07), rng.uniform(0.015, 0.03), rng.choice([0.008, 0.04, 0.1])
    yaw, lean = rng.uniform(0.0, np.pi), rng.uniform(-0.3, 0.3)
    x, y, z = rng.uniform(-1.0, 1.0, (count, 3)).T * np.array([[long], [wide], [high]])
    z = z + lean * x
    x, y = x * np.cos(yaw) - y * np.sin(yaw), x * np.sin(yaw) + y * np.cos(yaw)
    return np.stack([x, y, z], axis=1) + rng.uniform([0.4, -0.3, 0.05], [0.6, 0.3, 0.2])
