"""08_node.pose_at: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labcourse.kinds import array, count
from labcourse.questions.t08_node import ascending_stamps
from labgrader.question import Question, wrong


def pose_at(stamps, positions, quaternions, t):
    """Where a frame stood at a time between its stamped poses; NaN outside of what is known."""
    if t < stamps[0] or t > stamps[-1]:
        return np.full(3, np.nan), np.full(4, np.nan)
    i = max(np.searchsorted(stamps, t), 1)
    share = (t - stamps[i - 1]) / (stamps[i] - stamps[i - 1])
    a, b = quaternions[i - 1], quaternions[i]
    if a @ b < 0:
        b = -b
    angle = max(np.arccos(min(a @ b, 1.0)), 1e-6)
    q = np.sin((1 - share) * angle) * a + np.sin(share * angle) * b
    return (1 - share) * positions[i - 1] + share * positions[i], q / np.linalg.norm(q)


def turned(axis, angle):
    """The unit quaternion (x, y, z, w) of a turn by an angle about an axis."""
    axis = np.asarray(axis, float)
    return np.array([*(np.sin(angle / 2) * axis / np.linalg.norm(axis)), np.cos(angle / 2)])


def unit_rows(rng, rows):
    """Any turns, as unit quaternions, in place of rows (N, 4)."""
    quaternions = rng.normal(size=np.shape(rows))
    return quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)


def _stream(rng):
    """Two poses or more at uneven times of this century, each turned far from the last, with either sign.

    In some streams they are nanoseconds apart. In some the turns beside t are equal, and of length 1 but for rounding;
    some times are before or after all, some the first or the last one's.
    """
    N = int(rng.integers(2, 8))
    stamps = 1_700_000_000_000_000_000 + np.cumsum(rng.integers(20, 80, N)) * rng.choice([1, 1_000_000])
    quaternions = unit_rows(rng, np.zeros((N, 4)))
    i = int(rng.integers(N - 1))
    t = stamps[i] + int(rng.uniform(0.1, 0.4) * (stamps[i + 1] - stamps[i]))
    kind = rng.random()
    if kind < 0.24:
        quaternions[i : i + 2] = quaternions[i] * (1 + 4e-16), quaternions[i] * rng.choice([-1, 1]) * (1 + 4e-16)
    elif kind < 0.46:
        t = rng.choice([stamps[0] - rng.integers(1, 10**8), stamps[-1] + rng.integers(1, 10**8)])
    elif kind < 0.68:
        t = rng.choice(stamps[[0, -1]])
    return stamps, rng.uniform(-1.0, 1.0, (N, 3)) * rng.choice([1.0, 100.0]), quaternions, int(t)


def one_of_two(output):
    """A place, and the one of q and -q whose largest component is positive."""
    p, q = (np.asarray(part, float) for part in output)
    return p, q * np.sign(q[np.abs(q).argmax()])


AT_LEAST_2 = {"N": (2, None)}
_STAMPS = np.array([40, 80, 120, 240])
_PLACES = np.array([[0.5, 0.0, 0.4], [0.6, 0.2, 0.4], [0.6, 0.2, 0.8], [0.2, 0.0, -0.8]])
_TURNS = np.array([turned((0, 0, 1), a) for a in (0.0, 1.6, 1.6, 3.0)])
_TURNS[3] = -_TURNS[3]  # the same rotation
_TURNS[1:3] *= 1 + 4e-16  # equal, of length 1 but for rounding; the dot product is above 1
_FURTHER = np.array([turned((0, 0, 1), np.radians(a)) for a in (0.0, 170.0, 190.0, 300.0)])
_QUARTER = np.array([[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.5**0.5, 0.5**0.5]])
_FULL_CIRCLE = np.array([turned((1, 2, 3), 0.02 * k) for k in range(300)])
_HARDLY = np.array([turned((0, 0, 1), 0.006 * k) for k in range(4)])


QUESTION = Question(
    reference=pose_at,
    kinds={
        "stamps": ascending_stamps("N", says="N at least 2", least=2),
        "positions": array("N 3", -100.0, 100.0, lengths=AT_LEAST_2, says="within 100 m"),
        "quaternions": array("N 4", -1.0, 1.0, lengths=AT_LEAST_2, form=unit_rows, says=("unit", "of either sign")),
        "t": count(0, says=("nanoseconds", "0 or more")),
    },
    inputs=_stream,
    by_hand=(
        (_STAMPS, _PLACES, _TURNS, 50),  # a quarter of the first way, and of its turn
        (_STAMPS, _PLACES, _TURNS, 80),  # one that was published
        (_STAMPS, _PLACES, _TURNS, 100),  # no turn
        (_STAMPS, _PLACES, _TURNS, 150),  # the last quaternion has the other sign
        (_STAMPS, _PLACES, _TURNS, 40),
        (_STAMPS, _PLACES, _TURNS, 240),
        (_STAMPS, _PLACES, _TURNS, 241),
        (_STAMPS, _PLACES, _TURNS, 39),
        (_STAMPS, _PLACES, _FURTHER, 90),  # from 170 to 190 degrees: as far from the first
        (_STAMPS, _PLACES, _HARDLY, 150),  # a small turn, but not none
        (np.array([0, 40]), np.array([[0.0, 0.0, 0.0], [0.8, 0.0, 0.0]]), _QUARTER, 10),
        (_STAMPS - 40, _PLACES, _TURNS, 0),
        (_STAMPS + 1_700_000_000_000_000_000, _PLACES, _TURNS, 1_700_000_000_000_000_050),  # one float64 holds both
        (_STAMPS[:3], 125.0 * _PLACES[:3], -_FULL_CIRCLE[100::70], 60),
        (
            40 * np.arange(300),
            0.3 * np.arange(900.0).reshape(300, 3) % 100.0,
            _FULL_CIRCLE,
            11_930,
        ),  # no byte counts it
    ),
    edges=3,
    random_cases=56,
    atol=1e-5,
    points=4,
    canonical=one_of_two,
    forbidden=("scipy",),
    outputs=("position", "rotation"),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def neighbours(stamps, t, side="left"):
    """The number of the pose before a time, and the share of the way to the next; "right": at a stamp, that one's."""
    i = int(np.clip(np.searchsorted(stamps, t, side) - 1, 0, len(stamps) - 2))
    return i, (t - stamps[i]) / (stamps[i + 1] - stamps[i])


def outside(stamps, t):
    return (np.full(3, np.nan), np.full(4, np.nan)) if t < stamps[0] or t > stamps[-1] else None


def between(stamps, positions, quaternions, t, turn, side="left"):
    """The right place, and a turn of one's own, turn(a, b, share)."""
    i, share = neighbours(stamps, t, side)
    place = (1 - share) * positions[i] + share * positions[i + 1]
    return place, turn(quaternions[i], quaternions[i + 1], share)


def with_turn(stamps, positions, quaternions, t, turn, side="left"):
    return outside(stamps, t) or between(stamps, positions, quaternions, t, turn, side)


def nearer(a, b):
    return b if a @ b >= 0 else -b


def unit(q):
    return q / np.linalg.norm(q)


def slerp(a, b, share):
    angle = max(np.arccos(np.clip(a @ b, -1.0, 1.0)), 1e-6)
    return unit(np.sin((1 - share) * angle) * a + np.sin(share * angle) * b)


def arc(a, b, first, second, sine=np.sin, divided=True):
    """sine(first omega) a + sine(second omega) b; a, if both are one turn."""
    omega = np.arccos(np.clip(a @ b, -1.0, 1.0))
    if np.sin(omega) < 1e-12:
        return a
    return (sine(first * omega) * a + sine(second * omega) * b) / (sine(omega) if divided else 1.0)


STRAIGHT = "A quarter of the way along, your rotation is not a quarter: is the straight line between a and b the arc?"


@wrong(STRAIGHT, scaled=(unit, np.asarray))
def turn_by_the_chord(*given, scaled):
    return with_turn(*given, lambda a, b, share: scaled((1 - share) * a + share * nearer(a, b)))


@wrong(STRAIGHT)
def each_number_of_the_turn_on_its_own(*given):
    return with_turn(*given, lambda a, b, share: unit((1 - share) * a + share * b))


LONG = "A small rotation has become a large one the other way round: which of b and -b is nearer to a?"


@wrong(LONG)
def the_long_way_round(*given):
    return with_turn(*given, slerp)


@wrong(LONG, side=("left", "right"))
def the_long_way_by_the_arc(*given, side):
    return with_turn(*given, lambda a, b, share: arc(a, b, 1 - share, share), side)


@wrong("The pose nearest in time may be the one before t, or the one after it: which two are on either side of t?")
def nearest_stamp_for_the_next(stamps, positions, quaternions, t):
    i = int(np.clip(np.abs(stamps - t).argmin(), 1, len(stamps) - 1))
    share = (t - stamps[i - 1]) / (stamps[i] - stamps[i - 1])
    a, b = quaternions[i - 1], quaternions[i]
    place = (1 - share) * positions[i - 1] + share * positions[i]
    return outside(stamps, t) or (place, arc(a, nearer(a, b), 1 - share, share))


@wrong("The camera moved between the two poses: where was it when the image was taken?")
def the_last_one_before(stamps, positions, quaternions, t):
    i = max(int(np.searchsorted(stamps, t, side="right")) - 1, 0)
    return outside(stamps, t) or (positions[i], quaternions[i])


OUTSIDE = "Before the first pose and after the last, nobody knows where the camera is: what should a node say then?"


@wrong(OUTSIDE)
def held_at_the_ends(stamps, positions, quaternions, t):
    return pose_at(stamps, positions, quaternions, min(max(t, stamps[0]), stamps[-1]))


@wrong(OUTSIDE)
def gone_on_beyond_the_ends(*given):
    return between(*given, lambda a, b, share: slerp(a, nearer(a, b), share))


@wrong("Exactly at the first and at the last stamp the pose is known: does your comparison let these two through?")
def unknown_at_the_ends(stamps, positions, quaternions, t):
    known = stamps[0] < t < stamps[-1]
    return pose_at(stamps, positions, quaternions, t if known else stamps[-1] + 1)


@wrong("Outside the stamps both outputs keep their shapes: how many numbers does a position have, and a rotation?")
def one_nan_each(stamps, positions, quaternions, t):
    return pose_at(stamps, positions, quaternions, t) if stamps[0] <= t <= stamps[-1] else (np.nan, np.nan)


@wrong("Outside the stamps, too, you return a pair: three NaN, and four. All seven in one array are not a pair.")
def seven_nan_in_one(stamps, positions, quaternions, t):
    return pose_at(stamps, positions, quaternions, t) if stamps[0] <= t <= stamps[-1] else np.full(7, np.nan)


@wrong("At the pose before t the share is 0, at the next one 1: from which stamp to which does yours count?")
def share_of_the_whole_recording(stamps, positions, quaternions, t):
    i, share = neighbours(stamps, t)[0], (t - stamps[0]) / (stamps[-1] - stamps[0])
    a, b = quaternions[i], quaternions[i + 1]
    turn = slerp(a, nearer(a, b), share)
    return outside(stamps, t) or ((1 - share) * positions[i] + share * positions[i + 1], turn)


@wrong("A stamp has 19 digits and a float64 keeps 16: what do you do to stamps before you subtract?")
def stamps_in_seconds(stamps, positions, quaternions, t):
    with np.errstate(invalid="ignore"):
        return pose_at(stamps / 1e9, positions, quaternions, t / 1e9)


@wrong("The rotations are right. np.interp turns stamps into floats, with 16 of 19 digits: what do you subtract first?")
def places_by_floats(stamps, positions, quaternions, t):
    place = np.array([np.interp(t, stamps, column, np.nan, np.nan) for column in positions.T])
    unknown = np.isnan(place).any()
    return place, np.full(4, np.nan) if unknown else pose_at(stamps, positions, quaternions, t)[1]


@wrong("A float keeps 16 of a stamp's 19 digits, so that two stamps may become one: what can be subtracted first?")
def share_of_floats(stamps, positions, quaternions, t):
    if outside(stamps, t):
        return outside(stamps, t)
    i = neighbours(stamps, t)[0]
    before, after = float(stamps[i]), float(stamps[i + 1])
    share = (float(t) - before) / (after - before)  # raises if they have become one
    a, b = quaternions[i], quaternions[i + 1]
    return (1 - share) * positions[i] + share * positions[i + 1], arc(a, nearer(a, b), 1 - share, share)


@wrong("The positions are right. Your rotation is that of a published pose: which rotation lies between the two?")
def turn_of_the_one_before(*given):
    return with_turn(*given, lambda a, b, share: b if share >= 1 else a)


@wrong(
    "After a quarter of the time you are three quarters of the way: which pose has the share s, which 1 - s?",
    side=("left", "right"),  # at a stamp it goes on from the pose before, or from that one
)
def shares_exchanged(stamps, positions, quaternions, t, side):
    i, _ = neighbours(stamps, t, side)
    then = stamps[i] + stamps[i + 1] - t
    return outside(stamps, t) or pose_at(stamps, positions, quaternions, then)


@wrong("The angle is that of the shorter way, but the sum still has the other b: negate b, too.", smallest=(1e-6, 0.0))
def only_the_angle_made_shorter(*given, smallest):
    def turn(a, b, share):
        angle = max(np.arccos(min(abs(a @ b), 1.0)), smallest)
        if angle == 0.0:
            return a
        return (np.sin((1 - share) * angle) * a + np.sin(share * angle) * b) / np.sin(angle)

    return with_turn(*given, turn)


@wrong("There are poses between the first and the last: which two are on either side of t?")
def from_the_first_to_the_last(stamps, positions, quaternions, t):
    return pose_at(stamps[[0, -1]], positions[[0, -1]], quaternions[[0, -1]], t)


@wrong("Two rotations are equal and yours is NaN: from 0 / 0, or from arccos of a dot b, rounded to just above 1?")
def nan_between_equal_turns(stamps, positions, quaternions, t):
    i, _ = neighbours(stamps, t)
    p, q = pose_at(stamps, positions, quaternions, t)
    return p, q * (np.nan if abs(quaternions[i] @ quaternions[i + 1]) > 1.0 else 1.0)


@wrong("Omega is the angle between a and b, half the angle of the rotation: which of the two is in your sines?")
def angle_of_the_turn(*given):
    return with_turn(*given, lambda a, b, s: arc(a, nearer(a, b), 1 - s, s, sine=lambda omega: np.sin(2 * omega)))


@wrong("At s = 0 the rotation must be a: what is your factor of a then, and what should it be?", side=("left", "right"))
def not_divided_by_the_sine(*given, side):
    return with_turn(*given, lambda a, b, share: arc(a, nearer(a, b), 1 - share, share, divided=False), side)


@wrong(
    "The positions are right. At s = 0 the rotation must be a: to which of a and b do you give the factor 0?",
    side=("left", "right"),
)
def shares_of_the_turn_exchanged(*given, side):
    return with_turn(*given, lambda a, b, share: arc(a, nearer(a, b), share, 1 - share), side)


@wrong("Take the one of b and -b that is nearer to a. Does the sign of b's w tell which one that is?")
def sign_of_w(*given):
    return with_turn(*given, lambda a, b, share: arc(a, b if b[3] >= 0 else -b, 1 - share, share))
