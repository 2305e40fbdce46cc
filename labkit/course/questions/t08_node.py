"""Questions of topic 08: what a segmentation node does to messages (sections 5 and 6 of the text)."""

import numpy as np

from labkit.course.questions import answers_08 as answers
from labkit.course.questions.question import Misconception, Property, Question

# ------------------------------------------------------------------------------------------ depth from bytes


def decode_depth(data, height, width, step, is_bigendian):
    """Read metres from the bytes of a 16UC1 image message; NaN where the sensor saw nothing."""
    rows = data.reshape(height, step)[:, : 2 * width].reshape(height, width, 2).astype(float)
    first, second = rows[..., 0], rows[..., 1]
    millimetres = 256 * first + second if is_bigendian else first + 256 * second
    return np.where(millimetres > 0, millimetres / 1000, np.nan)


def _depth_message(rng, padding=None, is_bigendian=None):
    """An image of up to 65 m with holes, in either byte order, with padding that is no number of pixels."""
    height, width = int(rng.integers(2, 6)), int(rng.integers(6, 10))
    padding = int(rng.choice([0, 3, 4, 7])) if padding is None else padding
    is_bigendian = int(rng.integers(2)) if is_bigendian is None else is_bigendian
    numbers = rng.integers(1, 65536, (height, width))
    numbers[rng.random((height, width)) < 0.2] = 0
    rows = numbers.astype(">u2" if is_bigendian else "<u2").view(np.uint8).reshape(height, 2 * width)
    filler = rng.integers(1, 256, (height, padding), dtype=np.uint8)
    return np.hstack([rows, filler]).ravel(), height, width, 2 * width + padding, is_bigendian


DECODE_DEPTH = Question(
    name="08_node.decode_depth",
    reference=decode_depth,
    inputs=_depth_message,
    by_hand=(
        (np.array([1, 2, 0, 0], np.uint8), 1, 2, 4, 0),
        (np.array([1, 2, 0, 0], np.uint8), 1, 2, 4, 1),
        (np.array([0, 1, 9, 9, 232, 3, 9, 9], np.uint8), 2, 1, 4, 0),
        (np.array([3, 232, 0, 1, 7, 255, 254, 0, 0, 7], np.uint8), 2, 2, 5, 1),
    ),
    random_cases=6,
    points=3,
    properties=(
        Property(
            "one number for each of height x width pixels",
            lambda arguments, depth: np.shape(depth) == arguments[1:3],
        ),
        Property(
            "no distance is 0, and none is more than 65.535 m",
            lambda arguments, depth: bool(np.all(np.isnan(depth) | ((depth > 0.0) & (depth < 65.536)))),
        ),
    ),
    misconceptions=(
        Misconception(
            "padding read as pixels",
            answers.padding_as_pixels,
            "From the second row on the image slides sideways: at which byte does row r begin?",
        ),
        Misconception(
            "byte order ignored",
            answers.always_little,
            "Half of the messages come out as noise. What does is_bigendian say about the first of two bytes?",
        ),
        Misconception(
            "byte orders exchanged",
            answers.order_swapped,
            "Do one pixel by hand: bytes 1, 2, little-endian. Which of the two counts 256ths?",
        ),
        Misconception(
            "millimetres", answers.still_millimetres, "A table 800 m away? 16UC1 counts millimetres, the kit metres."
        ),
        Misconception(
            "no reading is 0 m",
            answers.zero_is_a_distance,
            "A 0 says that the sensor saw nothing there. As a distance it would be inside the lens.",
        ),
        Misconception(
            "signed numbers",
            answers.signed_numbers,
            "What is far away has become negative, or a hole. What does the U in 16UC1 stand for?",
        ),
        Misconception(
            "one byte of two",
            answers.low_byte_only,
            "Nothing is further than 25.5 cm: a pixel has two bytes. Did arithmetic in uint8 overflow?",
        ),
    ),
    alternatives=(answers.depth_loops, answers.depth_struct, answers.depth_strided, answers.depth_torch),
    forbidden=("cv_bridge",),
)


# ------------------------------------------------------------------------------------------ pairs of stamps


def pair_stamps(a, b, slop):
    """For each stamp of a the number of the nearest stamp of b, or -1 if none lies within slop."""
    found = np.full(len(a), -1)
    for i, stamp in enumerate(a):
        apart = np.abs(b - stamp)
        if len(b) > 0 and apart.min() <= slop:
            found[i] = apart.argmin()
    return found


def _streams(rng):
    """Two jittered streams of a second, in nanoseconds of this century; frames of each are lost."""
    start = 1_700_000_000_000_000_000 + int(rng.integers(0, 10**9))
    slop = int(rng.integers(12, 22)) * 1_000_000
    a, b = (start + 33_333_333 * np.arange(30) + rng.integers(-9_000_000, 26_000_000, 30) for _ in "ab")
    a = np.sort(a)[rng.random(30) < 0.8]
    b = np.sort(b)[rng.random(30) < 0.7]
    if len(b) > 3 and len(a) > 3:
        b[1] = a[2] + slop  # exactly at the bound counts
        b = np.sort(b)
    return a, b, slop


_NOW = 1_700_000_000_000_000_000
PAIR_STAMPS = Question(
    name="08_node.pair_stamps",
    reference=pair_stamps,
    inputs=_streams,
    by_hand=(
        (np.array([0, 33, 66]), np.array([2, 40, 90]), 10),
        (np.array([0, 33, 66]), np.array([30, 60, 100]), 6),
        (np.array([10]), np.array([2, 6, 13, 30]), 8),
        (np.array([10, 50]), np.array([6, 14, 60]), 10),
        (np.array([10, 20]), np.array([], int), 5),
        (np.array([_NOW, _NOW + 40]), np.array([_NOW - 70, _NOW - 3, _NOW + 41]), 3),
    ),
    random_cases=6,
    rtol=0.0,
    atol=0.0,
    points=3,
    properties=(
        Property("one answer for each stamp of a", lambda arguments, j: np.shape(j) == np.shape(arguments[0])),
        Property(
            "whatever is paired lies within slop",
            lambda arguments, j: all(
                k == -1 or abs(int(arguments[0][i]) - int(arguments[1][k])) <= arguments[2] for i, k in enumerate(j)
            ),
        ),
    ),
    misconceptions=(
        Misconception(
            "no bound", answers.no_bound, "A frame whose partner was lost must stay alone: what is slop for?"
        ),
        Misconception(
            "the bound left out",
            answers.strictly_within,
            "Stamps that are exactly slop apart still belong together.",
        ),
        Misconception(
            "only earlier ones",
            answers.never_later,
            "Depth may be stamped a little later than colour as well as a little earlier.",
        ),
        Misconception(
            "differences with a sign",
            answers.signed_difference,
            "The partner lies far in the future: -900 is smaller than 3, but is it nearer to 0?",
        ),
        Misconception(
            "the first that fits",
            answers.first_within,
            "Several stamps may lie within slop; take the nearest of them, not the first.",
        ),
        Misconception(
            "by number of arrival",
            answers.in_order_of_arrival,
            "One lost message shifts all pairs after it: compare stamps, not positions.",
        ),
        Misconception(
            "stamps in float32",
            answers.stamps_in_float32,
            "Nanoseconds since 1970 have 19 digits; float32 keeps 7. Subtract before you round anything.",
        ),
    ),
    alternatives=(answers.pairs_loops, answers.pairs_sorted, answers.pairs_torch),
)


# ------------------------------------------------------------------------------------------ error by lag


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
LAG_ERROR = Question(
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
    misconceptions=(
        Misconception(
            "metres", answers.lag_in_metres, "The arm's maker quotes millimetres, and so does this function."
        ),
        Misconception(
            "nearest sample",
            answers.nearest_sample,
            "Between two samples the object does not stand still: it is part of the way along.",
        ),
        Misconception(
            "mean speed times lag",
            answers.mean_speed_times_lag,
            "The object does not go at one speed: where was it then, and where is it now?",
        ),
        Misconception(
            "length of the way",
            answers.length_of_the_way,
            "The hand misses by the straight distance, however long the way round was.",
        ),
        Misconception("seen from above", answers.seen_from_above, "Things may be lifted meanwhile: does z take part?"),
        Misconception(
            "sum over the axes",
            answers.sum_of_axes,
            "3 cm along x and 4 cm along y are 5 cm, not 7.",
        ),
    ),
    alternatives=(answers.lag_loops, answers.lag_scipy, answers.lag_float32),
)


# ------------------------------------------------------------------------------------------ clouds as bytes


def pack_cloud(P):
    """Lay the points that are no holes out in bytes: little-endian float32 x, y, z and four bytes of nothing each."""
    there = np.isfinite(P).all(axis=1)
    cloud = np.pad(P[there], ((0, 0), (0, 1)))
    return np.frombuffer(cloud.astype("<f4").tobytes(), np.uint8)


def _holed_cloud(rng):
    P = rng.normal(0.3, 0.4, (int(rng.integers(8, 14)), 3))
    P[rng.choice(len(P), 3, replace=False)] = np.nan
    P[rng.choice(len(P), 1), rng.integers(3)] = np.nan
    return (P,)


PACK_CLOUD = Question(
    name="08_node.pack_cloud",
    reference=pack_cloud,
    inputs=_holed_cloud,
    by_hand=(
        (np.array([[1.0, 2.0, 3.0], [np.nan, np.nan, np.nan], [0.5, -0.25, 8.0]]),),
        (np.array([[0.1, 0.2, np.nan], [1.5, -1.0, 0.75], [0.3, 2.5, 1.0]]),),
        (np.array([[np.nan, 0.0, 0.0], [0.6, -0.4, 0.2]]),),
        (np.array([[0.1, 0.2, np.inf], [0.4, -0.2, 0.3], [0.0, 0.1, 0.9]]),),
    ),
    rtol=0.0,
    atol=0.0,
    points=2,
    properties=(
        Property("16 bytes a point", lambda arguments, data: np.size(data) % 16 == 0),
        Property(
            "as many points as have three finite coordinates",
            lambda arguments, data: np.size(data) == 16 * np.count_nonzero(np.isfinite(arguments[0]).all(axis=1)),
        ),
    ),
    misconceptions=(
        Misconception(
            "holes sent along", answers.holes_kept, "is_dense promises that no point is NaN: who promised that here?"
        ),
        Misconception(
            "holes moved to the origin",
            answers.holes_as_origin,
            "A pixel without depth has become a point in the robot's foot.",
        ),
        Misconception(
            "float64",
            answers.double_precision,
            "datatype 7 is float32. How many bytes has a number of yours?",
        ),
        Misconception("big-endian", answers.big_endian, "The message says is_bigendian = 0: which byte comes first?"),
        Misconception(
            "no padding", answers.no_padding, "point_step is 16 and three numbers take 12: what fills the rest?"
        ),
        Misconception(
            "axis after axis",
            answers.axis_after_axis,
            "The bytes of one point stand together: x, y, z, then the next point.",
        ),
        Misconception(
            "padding in front", answers.padding_first, "The field x has offset 0: a point begins with its x."
        ),
    ),
    alternatives=(answers.pack_struct, answers.pack_structured, answers.pack_columns, answers.pack_torch),
)


# ------------------------------------------------------------------------------------------ quaternions


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


QUATERNION = Question(
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
    ),
    random_cases=6,
    rtol=1e-4,
    atol=1e-5,
    points=3,
    properties=(
        Property("a rotation's quaternion has length 1", lambda arguments, q: abs(np.linalg.norm(q) - 1.0) < 1e-3),
    ),
    canonical=_one_of_two,
    misconceptions=(
        Misconception(
            "w first", answers.scalar_first, "ROS writes x, y, z, w. Where does your 1 stand for the identity?"
        ),
        Misconception(
            "the inverse turn",
            answers.inverse_turn,
            "All turns go the other way round: try a quarter turn about z, where R[1, 0] is +1.",
        ),
        Misconception(
            "fails at half a turn",
            answers.from_trace,
            "Where the trace is -1, w is 0, and you divide by it. A hand that points down is half a turn.",
        ),
        Misconception(
            "axis and angle", answers.rotation_vector, "The axis and the angle say it, too, but what is the length?"
        ),
        Misconception(
            "the whole angle",
            answers.whole_angle,
            "Half a turn should have w = 0: is it the angle or its half that goes into sine and cosine?",
        ),
        Misconception("length 2", answers.doubled, "What is the length of a rotation's quaternion?"),
        Misconception(
            "signs lost",
            answers.only_magnitudes,
            "The diagonal of R gives the squares alone; the signs stand beside it.",
        ),
    ),
    alternatives=(
        answers.quaternion_scipy,
        answers.quaternion_eigen,
        answers.quaternion_cases,
        answers.quaternion_torch,
    ),
)

QUESTIONS = (DECODE_DEPTH, PAIR_STAMPS, LAG_ERROR, PACK_CLOUD, QUATERNION)
