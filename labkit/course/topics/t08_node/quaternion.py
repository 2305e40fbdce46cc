"""08_node.quaternion: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.checker.question import Property, Question, wrong


def quaternion(R):
    """The unit quaternion (x, y, z, w) of a rotation; of the two that there are, either."""
    x, y, z = np.diagonal(R)
    outer = np.array(
        [
            [1 + x - y - z, R[0, 1] + R[1, 0], R[0, 2] + R[2, 0], R[2, 1] - R[1, 2]],
            [R[0, 1] + R[1, 0], 1 - x + y - z, R[1, 2] + R[2, 1], R[0, 2] - R[2, 0]],
            [R[0, 2] + R[2, 0], R[1, 2] + R[2, 1], 1 - x - y + z, R[1, 0] - R[0, 1]],
            [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], 1 + x + y + z],
        ]
    )
    largest = outer[np.diagonal(outer).argmax()]
    return largest / np.linalg.norm(largest)


def _turn(axis, angle):
    """The rotation by an angle round an axis (Rodrigues)."""
    x, y, z = np.asarray(axis, float) / np.linalg.norm(axis)
    S = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * S + (1.0 - np.cos(angle)) * S @ S


def _one_of_two(q):
    """q and -q are one rotation: make the largest component positive."""
    q = np.asarray(q, float)
    return q * np.sign(q[np.abs(q).argmax()])


QUESTION = Question(
    name="08_node.quaternion",
    reference=quaternion,
    inputs=lambda rng: (_turn(rng.normal(size=3), rng.uniform(0.3, 3.1)),),
    by_hand=(
        (_turn((0.2, 1.0, -0.4), 0.6),),
        (_turn((1.0, 0.1, -0.2), np.pi),),
        (_turn((0.1, -1.0, 0.2), np.pi),),
        (_turn((0.2, -0.1, 1.0), np.pi),),
        (_turn((1.0, -0.3, 0.2), 2.6),),
        (_turn((-0.3, 1.0, 0.4), 2.8),),
        (_turn((-0.3, 0.2, 1.0), 2.7),),
        *((np.diag(half_turn),) for half_turn in ((1.0, -1.0, -1.0), (-1.0, 1.0, -1.0), (-1.0, -1.0, 1.0))),
        (np.eye(3),),
    ),
    random_cases=6,
    rtol=1e-4,
    atol=1e-5,
    points=3,
    properties=(
        Property("a rotation's quaternion has length 1", lambda arguments, q: abs(np.linalg.norm(q) - 1.0) < 1e-3),
    ),
    canonical=_one_of_two,
)

# ---------------------------------------------------------------------------------------------------- wrong answers


@wrong(QUESTION, "Where the trace is -1, w is 0, and you divide by it. A hand that points down is half a turn.")
def from_trace(R, least=-np.inf):
    """The formula that divides by w: fine only for turns well below half a turn. least: what 4 w^2 is at least."""
    w = 0.5 * np.sqrt(max(1.0 + np.trace(R), least))
    return np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], 4.0 * w * w]) / (4.0 * w)


def right_quaternion(R):
    from scipy.spatial.transform import Rotation

    return Rotation.from_matrix(R).as_quat()


@wrong(
    QUESTION,
    "Half a turn about y or z has w = 0 and x = 0, too: your row is zeros then. Which square is the largest?",
)
def x_where_w_is_small(R):
    q = right_quaternion(R)
    row = q * q[3 if np.trace(R) > 0.0 else 0]
    return row / np.linalg.norm(row)


@wrong(QUESTION, "The axis and the angle say it, too, but what is the length?")
def rotation_vector(R):
    q = right_quaternion(R)
    q = -q if q[3] < 0.0 else q
    angle = 2.0 * np.arccos(min(q[3], 1.0))
    axis = q[:3] / max(np.linalg.norm(q[:3]), 1e-12)
    return np.array([*axis, angle])


@wrong(QUESTION, "Half a turn should have w = 0: is it the angle or its half that goes into sine and cosine?")
def whole_angle(R):
    x, y, z, angle = rotation_vector(R)
    return np.array([*(np.sin(angle) * np.array([x, y, z])), np.cos(angle)])


@wrong(QUESTION, "No turn has x = y = z = 0, and your row is zeros then: is w one of the four that you choose from?")
def largest_of_x_y_z(R):
    q = right_quaternion(R)
    row = q * q[np.diagonal(R).argmax()]
    return row / np.linalg.norm(row)


@wrong(QUESTION, "Half a turn has w = 0. A floor under w makes all four about 0 there: which square is the largest?")
def floor_under_w(R):
    return from_trace(R, least=1e-12)


@wrong(QUESTION, "Half a turn is not no turn, although R - R.T is 0 for both: what does R + R.T say of the axis?")
def axis_of_half_turns_lost(R):
    still = np.allclose(R, R.T)
    return np.array([0.0, 0.0, 0.0, 1.0]) if still else right_quaternion(R)
