"""08_node.quaternion: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labcourse.kinds import rotations
from labgrader.question import Question, holds, wrong


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
    R = np.eye(3) + np.sin(angle) * S + (1.0 - np.cos(angle)) * S @ S
    return np.clip(R, -1.0, 1.0)  # rounding may lead out by a hair


def _one_of_two(q):
    """q and -q are one rotation: make the largest component positive."""
    q = np.asarray(q, float)
    return q * np.sign(q[np.abs(q).argmax()])


def _rotation(rng):
    """Draw a rotation of any angle, mostly a large one, half a turn, one round an axis of the base, or hardly any."""
    kind, axis, flat = rng.random(), rng.normal(size=3), np.arange(3) != rng.integers(3)
    if kind < 0.45:
        return (_turn(axis, rng.uniform(*((0.3, 2.2) if kind < 0.15 else (2.2, 3.1)))),)
    if kind < 0.6:
        return (_turn(axis, np.pi),)
    if kind < 0.68:
        return (_turn(axis * flat, np.pi),)
    if kind < 0.78:
        return (np.diag(np.where(flat, -1.0, 1.0)),)
    if kind < 0.85:
        return (_turn(~flat, rng.uniform(0.3, 3.1)),)
    return (_turn(axis, rng.choice([0.0, 1e-8])),)


QUESTION = Question(
    reference=quaternion,
    kinds={"R": rotations(says=("rotation", "any angle"))},
    inputs=_rotation,
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
    random_cases=80,
    atol=1e-5,
    points=3,
    canonical=_one_of_two,
    forbidden=("scipy",),
)


@holds("a rotation's quaternion has length 1")
def length_is_1(R, q):
    return abs(np.linalg.norm(q) - 1.0) < 1e-3


# ---------------------------------------------------------------------------------------------------- wrong answers


@wrong("You divide by w, and after half a turn w is 0. A hand that points down has made half a turn.")
def from_trace(R, least=-np.inf):
    """The formula that divides by w: fine only for turns well below half a turn. least: what 4 w^2 is at least."""
    w = 0.5 * np.sqrt(max(1.0 + np.trace(R), least))
    return np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], 4.0 * w * w]) / (4.0 * w)


def products(R):
    """4 q q^T, of which each row is q times a number."""
    sums, (a, b, c) = R + R.T, (R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1])
    four = np.pad(sums, (0, 1))
    four[:3, 3] = four[3, :3] = a, b, c
    np.fill_diagonal(four, 1.0 + 2.0 * np.append(np.diagonal(R), np.trace(R)) - np.trace(R))
    return four


def row_of(R, which):
    row = products(R)[which]
    return row / np.linalg.norm(row)


@wrong("The numbers are right but in another order: which place does w have in (x, y, z, w)?")
def w_first(R):
    return np.roll(quaternion(R), 1)


@wrong("Half a turn about y or z has both w = 0 and x = 0: your row is zeros then. Which square is the largest?")
def x_where_w_is_small(R):
    q = quaternion(R)
    row = q * q[3 if np.trace(R) > 0.0 else 0]
    return row / np.linalg.norm(row)


@wrong("The axis and the angle describe the rotation, too, but what is the length?")
def rotation_vector(R):
    q = quaternion(R)
    q = -q if q[3] < 0.0 else q
    angle = 2.0 * np.arccos(min(q[3], 1.0))
    axis = q[:3] / max(np.linalg.norm(q[:3]), 1e-12)
    return np.array([*axis, angle])


@wrong("Half a turn should have w = 0: is it the angle or its half that goes into sine and cosine?")
def whole_angle(R):
    x, y, z, angle = rotation_vector(R)
    return np.array([*(np.sin(angle) * np.array([x, y, z])), np.cos(angle)])


@wrong("The identity has x = y = z = 0, and your row is zeros then: is w one of the four that you choose from?")
def largest_of_x_y_z(R):
    q = quaternion(R)
    row = q * q[np.diagonal(R).argmax()]
    return row / np.linalg.norm(row)


@wrong("After half a turn w and R - R.T are 0, and all four of yours are about 0: which square is the largest then?")
def floor_under_w(R):
    return from_trace(R, least=1e-12)


@wrong("Half a turn is not the identity, although R - R.T is 0 for both: what does R + R.T say about the axis?")
def axis_of_half_turns_lost(R):
    still = np.allclose(R, R.T)
    return np.array([0.0, 0.0, 0.0, 1.0]) if still else quaternion(R)


@wrong("Each entry of your row is q times one number. Which number makes its length 1?")
def row_not_of_length_1(R):
    return products(R)[np.diagonal(products(R)).argmax()]


@wrong("Your row is x x, x y, x z and x w: what is left of it for a turn about z, where x is 0?")
def always_the_row_of_x(R):
    return row_of(R, 0)


@wrong("Your row is x w, y w, z w and w w: what is left of it after half a turn, where w is 0?")
def always_the_row_of_w(R):
    return row_of(R, 3)


@wrong("Your row is q times one component, the one with the smallest square. How small can that be?")
def row_of_the_smallest(R):
    return row_of(R, np.diagonal(products(R)).argmin())


@wrong("After half a turn R - R.T is 0 and has no signs: which entries say whether x and y have the same sign?")
def signs_of_the_differences(R):
    q = np.sqrt(np.maximum(np.diagonal(products(R)), 0.0)) / 2.0
    return np.copysign(q, np.append([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]], 1.0))


@wrong("An eigenvector's sign is arbitrary: which entries of R tell a turn about n from one about -n?")
def axis_of_any_sign(R):
    values, vectors = np.linalg.eig(R)
    n = np.real(vectors[:, np.argmin(np.abs(values - 1.0))])
    angle = np.arccos(np.clip((np.trace(R) - 1.0) / 2.0, -1.0, 1.0))
    return np.append(n * np.sin(angle / 2.0), np.cos(angle / 2.0))


@wrong(
    "After half a turn 1 + trace is 0, and you put your smallest number in its place: is w the largest of the four?",
    least=(1e-12, 1e-14, 1e-16),
)
def unit_with_a_floor_under_w(R, least):
    q = from_trace(R, least)
    return q / np.linalg.norm(q)
