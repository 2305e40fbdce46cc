"""07_grasp.grasp_height: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labcourse.kinds import array, number
from labcourse.questions.t07_grasp import ANY_ORDER, LENGTH, MOST_OF_ONE, PLACES, WITHIN, cloud
from labgrader.question import Question, holds, wrong


def grasp_height(P, table_z, palm, tips, clearance):
    """Put the grasp as low as table and palm let it, and no lower than what was seen of the object."""
    lowest_tips = max(P[:, 2].max() - palm, P[:, 2].min(), table_z + clearance)
    return lowest_tips + tips


def _heights(rng):
    """Draw a cloud of which each of the three bounds is sometimes the one that counts, above the base or below."""
    P, kind = cloud(rng) + rng.uniform(-1.0, 1.0, 3), rng.integers(4)
    low, high = P[:, 2].min(), np.ptp(P[:, 2])
    if kind == 3:  # tall, and most of it seems to be below the table
        table_z, palm = low + 0.7 * high, 0.6 * high
    else:
        table_z = low - rng.uniform(0.01, 0.03) if kind else low + 0.002
        palm = high * (0.6 if kind == 1 else 1.5)
    return P, float(table_z), float(palm), float(rng.uniform(0.005, 0.1)), float(rng.uniform(0.003, 0.008))


def _upright(low, high):
    return np.array([[0.5, 0.1, low], [0.5, 0.1, high], [0.52, 0.1, 0.75 * low + 0.25 * high]])


FREE = ("* at 3?0]", "* at 3?1]", "* at the first", "sorted along N", *ANY_ORDER)  # x and y do not count

# Of all these points the last is the highest.
_MANY = np.vstack([_upright(-1.0, -0.5), np.full((MOST_OF_ONE - 4, 3), -0.75), [[0.5, 0.1, -0.4375]]])

QUESTION = Question(
    reference=grasp_height,
    kinds={
        "P": array("N 3", **PLACES, lengths={"N": (1, MOST_OF_ONE)}, says=("N from 1 to 10,000", WITHIN), free=FREE),
        "table_z": number(**PLACES, says=WITHIN),
        "palm": LENGTH,
        "tips": LENGTH,
        "clearance": LENGTH,
    },
    inputs=_heights,
    by_hand=(
        (_upright(0.1875, 0.75), 0.125, 0.25, 0.0625, 0.03125),  # tall, its foot hidden: the palm stops at its top
        (_upright(0.125, 0.1875), 0.125, 0.25, 0.0625, 0.03125),  # a flat one: the tips stay off the table
        (_upright(0.375, 0.5), 0.125, 0.25, 0.0625, 0.03125),  # only its upper part was seen
        (_upright(-0.5, -0.25), -0.5, 0.5, 0.0625, 0.03125),  # a table below the robot's base
        (_upright(0.125, 0.1875)[:2], 0.125, 0.25, 0.0625, 0.03125),
        (np.array([[-0.5, -0.75, 9.25]]), 9.5, 0.25, 0.0625, 0.03125),  # one point, behind the robot
        (_upright(-0.0625, 0.125), 0.0, 0.5, 0.0, 0.0),  # a table at 0, and no air above it
        (_upright(0.0, 0.25), -0.125, 0.0, 0.125, 0.0625),  # a hand without fingers
        (_upright(0.0625, 0.75), 0.625, 0.25, 0.0625, 0.03125),  # tall, and most of it seems to be below the table
        (_upright(5.0, 9.75), 5.0, 1.0, 0.0625, 0.03125),  # the largest numbers
        (_upright(-9.875, -9.75), -9.875, 0.25, 1.0, 1.0),
        (_upright(-0.1234, 0.3456), -0.2345, 0.1737, 0.12345, 0.0123456),  # few digits do not hold these
        (_upright(-0.1234, 0.0456), -0.1268, 0.5, 0.12345, 0.0123456),
        (_MANY, -1.0, 0.25, 0.125, 0.0),
    ),
    edges=10,
    random_cases=20,
    rtol=1e-5,
)


@holds("the palm stays above the top of the object")
def palm_is_above(P, table_z, palm, tips, clearance, z):
    return z - tips + palm >= P[:, 2].max() - 1e-5


# ---------------------------------------------------------------------------------------------------- wrong answers


@wrong("The centroid knows neither the table nor the palm: how low may the tips go, and what stops them?")
def height_of_centroid(P, table_z, palm, tips, clearance):
    return P[:, 2].mean()


BY_CONDITION = "You choose one bound by a condition. The tips may go below none of the three: which of them counts?"


@wrong(BY_CONDITION)
def palm_where_the_top_is_far_above_the_table(P, table_z, palm, tips, clearance):
    low, top = P[:, 2].min(), P[:, 2].max()
    return (top - palm if top > table_z + palm else max(low, table_z + clearance)) + tips


@wrong(BY_CONDITION)
def palm_where_the_thing_is_tall(P, table_z, palm, tips, clearance):
    low, top = P[:, 2].min(), P[:, 2].max()
    return (top - palm if top - low > palm else max(low, table_z + clearance)) + tips


@wrong("A bottle is taller than the fingers are long: what does its top meet?")
def palm_forgotten(P, table_z, palm, tips, clearance):
    return max(P[:, 2].min(), table_z + clearance) + tips


@wrong("Only the upper part was seen, and you reach below it: what is there is unknown.")
def unseen_depth(P, table_z, palm, tips, clearance):
    return max(P[:, 2].max() - palm, table_z + clearance) + tips


@wrong(
    "You let the palm's bound cap the height. What does the palm meet if the tips go below that bound?",
    last=("table", "palm"),
)
def palm_as_an_upper_limit(P, table_z, palm, tips, clearance, last):
    low, cap, table = P[:, 2].min(), P[:, 2].max() - palm, table_z + clearance
    return (max(min(low, cap), table) if last == "table" else min(max(low, table), cap)) + tips


@wrong("All three bounds are heights of the tips, but you add tips only to the table's.")
def origin_from_the_table_alone(P, table_z, palm, tips, clearance):
    return max(P[:, 2].max() - palm, P[:, 2].min(), table_z + clearance + tips)


@wrong("The object's top is a height in the base frame. You use the object's own height.")
def tallness_for_the_top(P, table_z, palm, tips, clearance):
    return max(np.ptp(P[:, 2]) - palm, P[:, 2].min(), table_z + clearance) + tips


@wrong("clearance is the gap between the tips and the table: to which of the three bounds does it belong?")
def clearance_below_the_palm_too(P, table_z, palm, tips, clearance):
    return max(P[:, 2].max() - palm + clearance, P[:, 2].min(), table_z + clearance) + tips


@wrong("clearance is measured from the table: at which height is the table?")
def table_at_zero(P, table_z, palm, tips, clearance):
    return max(P[:, 2].max() - palm, P[:, 2].min(), clearance) + tips


@wrong("A table may be lower than the robot's base: what is at height 0?")
def never_below_the_base(P, table_z, palm, tips, clearance):
    return max(0.0, P[:, 2].max() - palm, P[:, 2].min(), table_z + clearance) + tips


@wrong("All three bounds are heights of the tips: to which of them do you not add tips?")
def origin_without_the_palms_bound(P, table_z, palm, tips, clearance):
    return max(P[:, 2].max() - palm, P[:, 2].min() + tips, table_z + clearance + tips)


@wrong("P has x and y as well: which of them may hold the largest number?")
def extremes_of_all_coordinates(P, table_z, palm, tips, clearance):
    return max(P.max() - palm, P.min(), table_z + clearance) + tips


@wrong("You leave out points at the table's height or below it. What was seen there belongs to the object, too.")
def points_above_the_table_alone(P, table_z, palm, tips, clearance):
    z = P[P[:, 2] > table_z, 2]
    return (max(z.max() - palm, z.min(), table_z + clearance) if len(z) else table_z + clearance) + tips


@wrong("A percentile leaves out the highest points: what does the palm meet?")
def percentiles_for_the_ends(P, table_z, palm, tips, clearance):
    low, high = np.percentile(P[:, 2], (2, 98))
    return max(high - palm, low, table_z + clearance) + tips
