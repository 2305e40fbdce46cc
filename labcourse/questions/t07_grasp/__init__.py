"""The questions of lab 07: where the jaws close, what they touch and push, and whether the hand has room."""

import numpy as np


def cloud(rng):
    """Draw a cloud of few points somewhere on a table: long, less wide, in some cases high, turned by any yaw."""
    count = int(rng.integers(7, 40))
    long, wide, high = rng.uniform(0.05, 0.07), rng.uniform(0.015, 0.03), rng.choice([0.008, 0.04, 0.1])
    yaw, lean = rng.uniform(0.0, np.pi), rng.uniform(-0.3, 0.3)
    x, y, z = rng.uniform(-1.0, 1.0, (count, 3)).T * np.array([[long], [wide], [high]])
    z = z + lean * x
    x, y = x * np.cos(yaw) - y * np.sin(yaw), x * np.sin(yaw) + y * np.cos(yaw)
    return np.stack([x, y, z], axis=1) + rng.uniform([0.4, -0.3, 0.05], [0.6, 0.3, 0.2])


def leaning_grasp(rng):
    """Draw the frame of a grasp at any yaw that leans to one side, so that no axis is the base's."""
    yaw, lean = rng.uniform(0.2, 1.3), rng.uniform(0.3, 0.6)
    (c, s), (a, b) = (np.cos(yaw), np.sin(yaw)), (np.cos(lean), np.sin(lean))
    T = np.eye(4)
    T[:3, :3] = np.array([[-s, c, 0], [c, s, 0], [0, 0, -1]]) @ np.array([[1, 0, 0], [0, a, -b], [0, b, a]])
    T[:3, 3] = rng.uniform([0.4, -0.3, 0.02], [0.6, 0.3, 0.1])
    return T


# Closes along the base's x, over (2, 1), half a metre high.
FACING_X = np.array([[0.0, 1.0, 0.0, 2.0], [1.0, 0.0, 0.0, 1.0], [0.0, 0.0, -1.0, 0.5], [0.0, 0.0, 0.0, 1.0]])
