"""08_node.lag_error: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.questions.question import Property, Question, wrong


def lag_error(stamps, positions, taken, used):
    """How far the object went between the image and the grasp, millimetres, straight between the samples."""
    there, here = (np.array([np.interp(when, stamps, axis) for axis in positions.T]) for when in (used, taken))
    return 1000 * np.linalg.norm(there - here)


def _track(rng):
    """A winding path, sampled unevenly; the image and the grasp lie anywhere in it."""
    stamps = np.cumsum(rng.uniform(0.05, 0.3, 12))
    positions = np.array([0.5, -0.1, 0.1]) + np.cumsum(rng.normal(0.0, 0.03, (12, 3)), axis=0)
    taken, used = np.sort(rng.uniform(stamps[0], stamps[-1], 2))
    return stamps, positions, float(taken), float(used)


_LINE = np.array([[0.5, -0.2, 0.02], [0.5, 0.0, 0.02], [0.5, 0.3, 0.02]])


_CORNER = np.array([[0.4, 0.0, 0.0], [0.4, 0.3, 0.0], [0.4, 0.3, 0.4], [0.5, 0.3, 0.4]])


QUESTION = Question(
    name="08_node.lag_error",
    reference=lag_error,
    inputs=_track,
    by_hand=(
        (np.array([0.0, 1.0, 2.0]), _LINE, 0.25, 0.75),
        (np.array([0.0, 1.0, 2.0]), _LINE, 0.5, 1.25),
        (np.array([0.0, 2.0, 4.0, 5.0]), _CORNER, 0.4, 3.0),
        (np.array([1.0, 2.0, 4.0, 5.0]), _CORNER, 0.2, 1.6),
        (np.array([1.0, 2.0, 4.0, 5.0]), _CORNER, 4.2, 7.0),
    ),
    random_cases=6,
    points=2,
    properties=(Property("a distance is not negative", lambda arguments, error: bool(error >= 0.0)),),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def place(stamps, positions, when):
    return np.array([np.interp(when, stamps, positions[:, axis]) for axis in range(3)])


@wrong(QUESTION, "Between two samples the object does not stand still: it is part of the way along.")
def nearest_sample(stamps, positions, taken, used):
    here, there = (positions[np.abs(stamps - when).argmin()] for when in (taken, used))
    return 1000.0 * np.linalg.norm(there - here)


@wrong(QUESTION, "The object does not go at one speed: where was it then, and where is it now?")
def mean_speed_times_lag(stamps, positions, taken, used):
    way = np.linalg.norm(positions[-1] - positions[0])
    return 1000.0 * way / (stamps[-1] - stamps[0]) * (used - taken)


@wrong(QUESTION, "The hand misses by the straight distance, however long the way round was.")
def length_of_the_way(stamps, positions, taken, used):
    between = stamps[(stamps > taken) & (stamps < used)]
    way = np.array([place(stamps, positions, when) for when in (taken, *between, used)])
    return 1000.0 * np.linalg.norm(np.diff(way, axis=0), axis=1).sum()


@wrong(QUESTION, "Things may be lifted meanwhile: does z take part?")
def seen_from_above(stamps, positions, taken, used):
    return 1000.0 * np.linalg.norm((place(stamps, positions, used) - place(stamps, positions, taken))[:2])


@wrong(QUESTION, "3 cm along x and 4 cm along y are 5 cm, not 7.")
def sum_of_axes(stamps, positions, taken, used):
    return 1000.0 * np.abs(place(stamps, positions, used) - place(stamps, positions, taken)).sum()
