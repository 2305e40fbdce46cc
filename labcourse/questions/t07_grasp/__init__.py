"""The questions of lab 07: where the jaws close, what they touch and push, and whether the hand has room."""

import numpy as np

from labcourse.kinds import number

# What comes as an argument in several of the questions.
PLACES = {"least": -10.0, "most": 10.0}  # metres, of a point's coordinates
WITHIN = "within 10 m"
MOST_OF_ONE = 10_000  # points of one object
LENGTH = number(0.0, 1.0, says="0 to 1")
ANY_ORDER = ("reversed along N", "unique along N")  # of points
LAST_ROW = "* at ?3, ?]"  # of a pose: 0 0 0 1


def cloud(rng):
    """Draw a cloud of few points somewhere on a table: long, less wide, in some cases high, turned by any yaw."""
    count = int(rng.integers(7, 40))
    long, wide, high = rng.uniform(0.05, 0.07), rng.uniform(0.015, 0.03), rng.choice([0.008, 0.04, 0.1])
    yaw, lean = rng.uniform(0.0, np.pi), rng.uniform(-0.3, 0.3)
    x, y, z = rng.uniform(-1.0, 1.0, (count, 3)).T * np.array([[long], [wide], [high]])
    z = z + lean * x
    x, y = x * np.cos(yaw) - y * np.sin(yaw), x * np.sin(yaw) + y * np.cos(yaw)
    return np.stack([x, y, z], axis=1) + rng.uniform([0.4, -0.3, 0.05], [0.6, 0.3, 0.2])


def axes_of_yaw(T):
    """What a mistake has for a hand's axes y and x, seen from above: those of its yaw, as if it did not lean."""
    yaw = np.arctan2(T[1, 1], T[0, 1])
    return np.array([np.cos(yaw), np.sin(yaw)]), np.array([-np.sin(yaw), np.cos(yaw)])


def transform(R, origin):
    """The 4 x 4 matrix of a rotation and an origin."""
    T = np.eye(4)
    T[:3] = np.column_stack([R, origin])
    return T


def across(rng, axis):
    """Draw an origin 7 m or more from the base's along an axis; minus it is twice as far away. Both are within 10 m."""
    return axis * rng.uniform(7.0, 9.5) / np.abs(axis).max()


def quarter_turns(rng):
    """Draw one of the 24 rotations that map axes to axes: of 0, 1 and -1, so that a point on a border stays there."""
    R = np.eye(3)[rng.permutation(3)] * rng.choice([-1.0, 1.0], 3)
    return R * np.linalg.det(R) + 0.0  # no -0.0


# Closes along the base's x, over (2, 1), half a metre high.
FACING_X = np.array([[0.0, 1.0, 0.0, 2.0], [1.0, 0.0, 0.0, 1.0], [0.0, 0.0, -1.0, 0.5], [0.0, 0.0, 0.0, 1.0]])
# Comes from below and from one side; no axis is level. On paper: thirds. Then two with other signs everywhere: it has
# made half a turn about its z, and about its y.
FROM_BELOW = transform(np.array([[2.0, -1.0, 2.0], [2.0, 2.0, -1.0], [-1.0, 2.0, 2.0]]) / 3.0, [-0.5, 0.25, -1.0])
TURNED = transform(FROM_BELOW[:3, :3] * (-1.0, -1.0, 1.0), [0.5, -0.25, 1.0])
TURNED_OVER = transform(FROM_BELOW[:3, :3] * (-1.0, 1.0, -1.0), [0.5, -0.25, 1.0])
