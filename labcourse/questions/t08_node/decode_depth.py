"""08_node.decode_depth: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labcourse.kinds import Kind, array, count
from labgrader.question import Question, holds, wrong


def decode_depth(data, height, width, step, is_bigendian):
    """Read metres from the bytes of a 16UC1 image message; NaN where the sensor saw nothing."""
    rows = data.reshape(height, step)[:, : 2 * width].reshape(height, width, 2).astype(float)
    first, second = rows[..., 0], rows[..., 1]
    millimetres = 256 * first + second if is_bigendian else first + 256 * second
    return np.where(millimetres > 0, millimetres / 1000, np.nan)


def _depth_message(rng, padding=None, is_bigendian=None):
    """An image of up to 65 m with holes, in either byte order, with padding that may be no number of pixels."""
    height, width = int(rng.integers(1, 7)), int(rng.integers(1, 10))
    padding = int(rng.choice([0, 3, 4, 7, 2 * width + 1])) if padding is None else padding
    is_bigendian = int(rng.integers(2)) if is_bigendian is None else is_bigendian
    numbers = rng.integers(1, 65536, (height, width))
    numbers[rng.random((height, width)) < 0.2] = 0
    numbers[0, 0] = 65535
    rows = numbers.astype(">u2" if is_bigendian else "<u2").view(np.uint8).reshape(height, 2 * width)
    filler = rng.integers(1, 256, (height, padding), dtype=np.uint8)
    return np.hstack([rows, filler]).ravel(), height, width, 2 * width + padding, is_bigendian


def _counted(height, width, step):
    """Pixels 1, 2, 3 ..., each row of them filled up to so many bytes."""
    rows = np.full((height, step // 2), 9, "<u2")
    rows[:, :width] = 1 + np.arange(height * width).reshape(height, width)
    return rows.view(np.uint8).ravel(), height, width, step, 0


QUESTION = Question(
    reference=decode_depth,
    kinds={
        "data": array("n", 0, 255, dtype="uint8", lengths={"n": (2, None)}),
        "height": count(1, 4000, says="1 to 4000"),
        "width": count(1, 4000, says="1 to 4000"),
        "step": count(2, 10_000, says=("at least 2 * width", "at most 10000")),
        "is_bigendian": Kind(dtype="int", choices=(0, 1)),
    },
    inputs=_depth_message,
    by_hand=(
        (np.array([1, 2, 0, 0], np.uint8), 1, 2, 4, 0),
        (np.array([1, 2, 0, 0], np.uint8), 1, 2, 4, 1),
        (np.array([0, 1, 9, 9, 232, 3, 9, 9], np.uint8), 2, 1, 4, 0),
        (np.array([255, 255, 0, 0], np.uint8), 1, 2, 4, 0),  # the largest number is one
        (np.array([3, 232, 0, 1, 7, 255, 254, 0, 0, 7, 128, 0, 0, 128, 7], np.uint8), 3, 2, 5, 1),
        (np.array([0, 2], np.uint8), 1, 1, 2, 1),
        *(_counted(*shape) for shape in ((1, 4000, 10_000), (4000, 1, 8))),  # no count of these fits into a byte
    ),
    edges=4,
    random_cases=6,
    rtol=1e-5,
    points=3,
    forbidden=("cv_bridge",),
)


@holds("no distance is 0, and none is more than 65.535 m")
def in_range(data, height, width, step, is_bigendian, depth):
    return np.all(np.isnan(depth) | ((depth > 0.0) & (depth < 65.536)))


# ---------------------------------------------------------------------------------------------------- wrong answers


def units(data, height, width, step, order):
    """The numbers of a 16UC1 image in a byte order, the padding left out."""
    rows = np.frombuffer(bytes(data), np.uint8)[: height * step].reshape(height, step)
    return np.frombuffer(rows[:, : 2 * width].tobytes(), f"{order}u2").reshape(height, width)


def metres(numbers):
    return np.where(numbers > 0, numbers * 0.001, np.nan)


@wrong("A metre has 1000 millimetres: by what do you divide, or multiply?", factor=(0.01, 0.1, 1.0, 10.0))
def another_unit(data, height, width, step, is_bigendian, factor):
    return 1000 * factor * decode_depth(data, height, width, step, is_bigendian)


@wrong("From the second row on the image slides sideways: at which byte does row r begin?")
def padding_as_pixels(data, height, width, step, is_bigendian):
    pixels = data[: 2 * height * width]
    return metres(units(pixels, height, width, 2 * width, ">" if is_bigendian else "<"))


@wrong("A row takes step bytes, its pixels 2 * width of them: what do you do with the rest?")
def padding_as_pixels_of_all_bytes(data, height, width, step, is_bigendian):
    numbers = np.frombuffer(bytes(data), ">u2" if is_bigendian else "<u2")  # raises if their count is odd
    return metres(numbers[: height * width].reshape(height, width))


@wrong("65535 has become -1: the numbers are unsigned. Which type is that?")
def signed_distances(data, height, width, step, is_bigendian):
    numbers = units(data, height, width, step, ">" if is_bigendian else "<").astype(np.int16)
    return np.where(numbers == 0, np.nan, numbers / 1000)


@wrong("Distant points have become negative, or holes. What does the U in 16UC1 stand for?")
def signed_numbers(data, height, width, step, is_bigendian):
    return metres(units(data, height, width, step, ">" if is_bigendian else "<").astype(np.int16))


@wrong("Nothing is further than 25.5 cm: a pixel has two bytes. Did arithmetic in uint8 overflow?")
def low_byte_only(data, height, width, step, is_bigendian):
    numbers = units(data, height, width, step, ">" if is_bigendian else "<")
    return metres(numbers % 256)


@wrong("The two bytes of a pixel are side by side in the row, not half a row apart.")
def halves_of_a_row(data, height, width, step, is_bigendian):
    rows = data.reshape(height, step)[:, : 2 * width].reshape(height, 2, width)
    return decode_depth(rows.transpose(0, 2, 1).ravel(), height, width, 2 * width, is_bigendian)


@wrong("The padding is at a row's end: where do the row's pixels begin?")
def padding_in_front(data, height, width, step, is_bigendian):
    rows = data.reshape(height, step)[:, step - 2 * width :]
    return decode_depth(rows.ravel(), height, width, 2 * width, is_bigendian)


@wrong("65535 is a distance here, 65.535 m: which is the only number that means that nothing was seen?")
def largest_for_a_hole(data, height, width, step, is_bigendian):
    depth = decode_depth(data, height, width, step, is_bigendian)
    return np.where(depth > 65.534, np.nan, depth)


@wrong(
    "Big-endian numbers are read as little-endian here, whatever the flag says. "
    "If you call byteswap: single bytes have nothing to swap."
)
def bytes_swapped_one_by_one(data, height, width, step, is_bigendian):
    return decode_depth(data, height, width, step, False)
