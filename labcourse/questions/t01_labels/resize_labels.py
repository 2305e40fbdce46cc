"""01_labels.resize_labels: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labcourse.kinds import array, count
from labgrader.question import Question, holds, wrong


def resize_labels(y, height, width):
    """Resize a label image without inventing labels: each new pixel copies the old one in which its centre falls."""
    H, W = y.shape
    rows = ((np.arange(height) + 0.5) * H / height).astype(int)
    columns = ((np.arange(width) + 0.5) * W / width).astype(int)
    return y[rows[:, None], columns]


# Sides, old and new, at which rounding tells. Halved, each new centre falls between two old pixels, and in floats
# (i + 0.5) / 11 * 22 is off; at the other two (i + 0.5) / (new / old) is. At the second kind (i + 0.5) * (old / new) is
# off, and so is a step of old / new that is added up, as np.arange does.
HALVED = ((22, 11), (26, 13), (14, 29), (18, 21))
NOT_HALVED = ((30, 13), (46, 43), (54, 49), (58, 55))


def labels_and_sizes(rng, most):
    """Draw labels up to `most`, some of them 255, and a size: a side of each kind, rows and columns in either order."""
    sides = HALVED[rng.integers(len(HALVED))], NOT_HALVED[rng.integers(len(NOT_HALVED))]
    (H, height), (W, width) = sides if rng.random() < 0.5 else sides[::-1]
    y = rng.integers(0, most + 1, (H, W))
    y[rng.random((H, W)) < 0.1] = 255
    return y, height, width


def _labels_and_size(rng):
    y, height, width = labels_and_sizes(rng, 3)
    return y.astype(np.uint8), height, width


def _long_side(rng):
    """Draw a row or a column of any bytes, and another length of some thousand."""
    old, new = (int(n) for n in rng.integers(3001, 6001, 2))
    y = rng.integers(0, 256, old).astype(np.uint8)
    return (y[:, None], new, 1) if rng.random() < 0.5 else (y[None], 1, new)


_ALL_DIFFERENT = np.random.default_rng(1).permutation(24).astype(np.uint8).reshape(4, 6)
_LONG = (np.arange(6000) % 251).astype(np.uint8)[:, None]  # in float32 3419.5 * 6000 / 4129 is off
_LARGE = (np.add.outer(np.arange(301), 2 * np.arange(307)) % 5).astype(np.uint8)  # not every index is a uint8


QUESTION = Question(
    reference=resize_labels,
    kinds={
        "y": array(
            "H W", 0, 255, dtype="uint8", lengths={"H": (1, 6000), "W": (1, 6000)}, says=("any values", "1 to 6000")
        ),
        "height": count(1, 6000, says="1 to 6000"),
        "width": count(1, 6000, says="1 to 6000"),
    },
    inputs=(_labels_and_size, _labels_and_size, _labels_and_size, _long_side),
    by_hand=(
        (np.array([[1, 3]], np.uint8), 1, 4),
        (np.arange(22, dtype=np.uint8)[:, None], 11, 1),  # in floats 7.5 / 11 * 22 is less than 15
        (np.arange(8, dtype=np.uint8)[None], 1, 49),  # in floats 24.5 * (8 / 49) is less than 4
        (np.array([[5], [9]], np.uint8), 11, 1),  # steps of 2 / 11, added up, are 1 too late
        (np.arange(14, dtype=np.uint8)[:, None], 9, 1),  # in floats 4.5 / (9 / 14) is not 7
        (_LONG, 4129, 1),
        (_ALL_DIFFERENT, 2, 3),  # a new centre falls between two old pixels
        (_LARGE, 5, 6),
        (np.array([[0, 1, 2], [3, 2, 1], [255, 0, 3]], np.uint8), 5, 2),
        (_LONG.T, 1, 6000),
        (np.array([[5], [9], [7]], np.uint8), 5999, 1),
    ),
    edges=2,
    random_cases=8,
    points=4,
    forbidden=("cv2", "PIL", "skimage"),
)


@holds("no label appears that was not there before")
def no_label_is_new(y, height, width, resized):
    return set(np.unique(resized).tolist()) <= set(np.unique(y).tolist())


# ---------------------------------------------------------------------------------------------------- wrong answers


def copied(y, size, index):
    """Copy labels by a rule (new index, new length, old length) -> old index, which rows and columns share."""
    rows, columns = (np.asarray(index(np.arange(n), n, old), int) for n, old in zip(size, y.shape, strict=True))
    return y[rows[:, None], columns]


@wrong("The mean of classes 1 and 3 is not class 2: labels are copied, not averaged.")
def bilinear(y, height, width):
    import cv2

    return np.round(cv2.resize(y.astype(np.float32), (width, height), interpolation=cv2.INTER_LINEAR)).astype(np.uint8)


@wrong("Yours is shifted by up to half a pixel: take the old pixel under the new pixel's centre, not its corner.")
def from_the_corner(y, height, width):
    return copied(y, (height, width), lambda i, n, old: i * old // n)


@wrong("You align the centres of the corner pixels. Here the edges of the images are aligned.")
def corner_to_corner(y, height, width):
    return copied(y, (height, width), lambda i, n, old: np.round(np.linspace(0, old - 1, n)))


@wrong("The half belongs to the new pixel: add it before you scale, (i + 0.5) * H / h, not afterwards.")
def half_added_afterwards(y, height, width):
    return copied(y, (height, width), lambda i, n, old: np.minimum(i * old / n + 0.5, old - 1))


@wrong("Do not subtract 0.5 before floor: here old pixel u reaches from u to u + 1, and its centre is u + 0.5.")
def half_subtracted(y, height, width):
    return copied(y, (height, width), lambda i, n, old: (i + 0.5) * old / n - 0.5)


@wrong("Rows are multiplied by H / height, old over new: is yours height / H?")
def scaled_by_new_over_old(y, height, width):
    return copied(y, (height, width), lambda i, n, old: (i + 0.5) * n / old)


@wrong("np.resize repeats the numbers row after row: is your image still the same scene?")
def refilled(y, height, width):
    return np.resize(y, (height, width))


@wrong("The whole scene should be in the new image, in another size.")
def padded_or_cropped(y, height, width):
    H, W = y.shape
    return np.pad(y, ((0, max(height - H, 0)), (0, max(width - W, 0))), mode="edge")[:height, :width]


@wrong("On the border between two old pixels, floor takes the later one: which one does np.round take?")
def rounded(y, height, width):
    return copied(y, (height, width), lambda i, n, old: np.round((i + 0.5) * old / n - 0.5))


@wrong("The pixel into which a centre falls is the whole part, floor: round may go on to the next one.")
def rounded_up(y, height, width):
    """IndexError, where the last centre is rounded to the number of pixels."""
    return copied(y, (height, width), lambda i, n, old: np.round((i + 0.5) * old / n))


@wrong("A new pixel copies the one old pixel under its centre: how many old pixels do you use?")
def voted(y, height, width):
    """The most frequent label of the old pixels that a new one covers."""

    def span(i, n, old):
        return slice(i * old // n, max((i + 1) * old // n, i * old // n + 1))

    out = np.zeros((height, width), np.uint8)
    for i, j in np.ndindex(height, width):
        block = y[span(i, height, y.shape[0]), span(j, width, y.shape[1])]
        out[i, j] = np.bincount(block.ravel()).argmax()
    return out


@wrong("Columns are counted along W and rows along H: you use H for both.")
def height_for_both(y, height, width):
    return copied(y, (height, width), lambda i, n, old: (i + 0.5) * len(y) / n)


@wrong("Columns have their own factor, W / width: you scale them by H / height, like rows.")
def columns_scaled_as_rows(y, height, width):
    return copied(y, (height, width), lambda i, n, old: np.minimum((i + 0.5) * len(y) / height, old - 1))


@wrong("The centre of new pixel i lies at (i + 0.5) * H / h, and floor gives the old pixel: which place do you round?")
def corner_rounded(y, height, width):
    return copied(y, (height, width), lambda i, n, old: np.round(i * old / n).clip(0, old - 1))


@wrong("The pixel into which a centre falls is the whole part, floor: round may go on to the next one.")
def rounded_up_and_clipped(y, height, width):
    return copied(y, (height, width), lambda i, n, old: np.round((i + 0.5) * old / n).clip(0, old - 1))


@wrong("In floats 7.5 / 11 * 22 is less than 15: in which order does the formula multiply and divide?")
def divided_before_multiplied(y, height, width):
    return copied(y, (height, width), lambda i, n, old: (i + 0.5) / n * old)


@wrong("In floats 24.5 * (8 / 49) is less than 4: in which order does the formula multiply and divide?")
def multiplied_by_the_quotient(y, height, width):
    return copied(y, (height, width), lambda i, n, old: (i + 0.5) * (old / n))


@wrong("A step of whole pixels is right only if the size is divided by a whole number. Where is each new centre?")
def every_step_th_pixel(y, height, width):
    a, b = max(y.shape[0] // height, 1), max(y.shape[1] // width, 1)
    return y[a // 2 :: a, b // 2 :: b][:height, :width]
