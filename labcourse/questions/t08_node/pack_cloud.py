"""08_node.pack_cloud: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labcourse.kinds import array
from labgrader.question import Question, holds, wrong


def pack_cloud(P):
    """Lay the points that are no holes out in bytes: little-endian float32 x, y, z and four bytes of nothing each."""
    there = np.isfinite(P).all(axis=1)
    cloud = np.pad(P[there], ((0, 0), (0, 1)))
    return np.frombuffer(cloud.astype("<f4").tobytes(), np.uint8)


def _holed_cloud(rng):
    """Points of either sign, of millimetres or of kilometres; holes by one coordinate or by all, and the origin."""
    P = rng.normal(0.0, rng.choice([0.01, 1.0, 1000.0]), (int(rng.integers(8, 14)), 3))
    P[rng.choice(len(P), 3, replace=False)] = np.nan
    P[-3:] = rng.normal(0.0, 1.0, (3, 3))
    P[-3, rng.integers(2)] = np.nan
    P[-2, rng.integers(3)] = rng.choice([np.inf, -np.inf])
    P[-1] = 0.0  # a point
    return (P,)


QUESTION = Question(
    reference=pack_cloud,
    kinds={
        "P": array(
            "N 3",
            -1e6,
            1e6,
            also=(np.nan, np.inf, -np.inf),
            lengths={"N": (0, None)},
            says=("N may be 0", "NaN or infinite", "up to a million"),
        ),
    },
    inputs=_holed_cloud,
    by_hand=(
        (np.array([[1.0, 2.0, 3.0], [np.nan, np.nan, np.nan], [0.5, -0.25, 8.0]]),),
        (np.array([[0.1, 0.2, np.nan], [1.5, -1.0, 0.75], [0.3, 2.5, 1.0]]),),
        (np.array([[np.nan, 0.0, 0.0], [0.6, -0.4, 0.2]]),),
        (np.array([[0.1, 0.2, np.inf], [0.4, -0.2, 0.3], [0.0, 0.0, 0.0]]),),
        (np.array([[1.0, 2.0, 3.0], [np.nan, 0.0, 0.0]]),),
        (np.array([[-np.inf, 1e6, 0.125], [-1e6, 3e5, -7e5]]),),
        (np.full((2, 3), np.nan),),  # nothing was seen
        (np.zeros((0, 3)),),
        (np.arange(-450.0, 450.0).reshape(300, 3),),  # as many as no byte counts, and no hole
    ),
    edges=5,
)


@holds("16 bytes for each point with three finite coordinates")
def as_many_points(P, data):
    return np.size(data) == 16 * np.count_nonzero(np.isfinite(P).all(axis=1))


# ---------------------------------------------------------------------------------------------------- wrong answers


def finite(P):
    return P[np.isfinite(P).all(axis=1)]


def packed(P, kind="<f4", padding=4):
    """Rows of x, y, z in a number type, each with padding behind it."""
    rows = np.ascontiguousarray(P, kind).view(np.uint8).reshape(len(P), 3 * np.dtype(kind).itemsize)
    return np.hstack([rows, np.zeros((len(P), padding), np.uint8)])


@wrong("is_dense says that no point is NaN. Which line of yours makes sure of that?")
def holes_kept(P):
    return packed(P).ravel()


@wrong("Points with NaN have become (0, 0, 0), a position in the robot's base. They should be left out.")
def holes_as_origin(P):
    return packed(np.where(np.isfinite(P).all(axis=1, keepdims=True), P, 0.0)).ravel()


@wrong("astype(np.uint8) turns each number into one byte, its whole part. A float32 has four: how do you get at them?")
def numbers_cast_to_bytes(P):
    return np.pad(finite(P), ((0, 0), (0, 1))).astype(np.uint8).ravel()


@wrong("Your points take 32 bytes each: float32 has 4 bytes per number. How many does float64 have?")
def double_precision(P):
    return packed(finite(P), "<f8", padding=8).ravel()


@wrong("point_step is 16 and three numbers take 12: what fills the rest?")
def no_padding(P):
    return packed(finite(P), padding=0).ravel()


@wrong("The bytes of one point are together: x, y, z, then the next point.")
def axis_after_axis(P):
    cloud = finite(P)
    numbers = np.column_stack([cloud, np.zeros(len(cloud))])
    return np.frombuffer(numbers.T.astype("<f4").tobytes(), np.uint8)


@wrong("The bytes of one point are together: x, y, z, then the next point.")
def axis_after_axis_and_zeros_with_signs(P):
    x, y, z = finite(P).T
    return np.frombuffer(np.array([x, y, z, 0.0 * x], "<f4").tobytes(), np.uint8)


@wrong("Each point has its own four bytes of 0: what is in your bytes 12 to 15?")
def padding_after_the_last_point(P):
    return np.append(packed(finite(P), padding=0), np.zeros(4 * len(finite(P)), np.uint8))


@wrong("The field x has offset 0: a point begins with its x.")
def padding_first(P):
    return np.roll(packed(finite(P)), 4, axis=1).ravel()


@wrong("P is in metres, and so is the message: what do you multiply by?")
def millimetres(P):
    return packed(1000.0 * finite(P)).ravel()


@wrong("All three coordinates must be finite. How many of them do you test?")
def only_z_asked(P):
    return packed(P[np.isfinite(P[:, 2])]).ravel()


@wrong("You leave out NaN. Which other value is not finite?")
def infinite_ones_kept(P):
    return packed(P[~np.isnan(P).any(axis=1)]).ravel()


@wrong("(0, 0, 0) is a point of the base frame like any other: what marks a point as a hole?")
def origin_for_a_hole(P):
    return packed(finite(P)[(finite(P) != 0.0).any(axis=1)]).ravel()
