"""09_other_stacks.enlarge: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labcourse.kinds import LONG, array
from labcourse.questions.t01_labels.resize_labels import copied, labels_and_sizes
from labgrader.question import Question, holds, wrong


def enlarge(labels, size):
    """Resize labels (h, w) to size = (W, H): each new pixel shows the old one that its centre lies in."""
    W, H = size
    h, w = labels.shape
    rows, columns = (2 * np.arange(H) + 1) * h // (2 * H), (2 * np.arange(W) + 1) * w // (2 * W)
    return labels[rows[:, None], columns]


def _labels_and_size(rng):
    """Draw labels, of either sign in half of the draws, and a size at which rounding tells."""
    labels, H, W = labels_and_sizes(rng, 400)
    return labels * rng.choice([-1, 1]), (W, H)


QUESTION = Question(
    reference=enlarge,
    kinds={
        "labels": array("h w", -(2**31), 2**31 - 1, dtype="int64 uint8", says=("any values of 32 bits", "any size")),
        "size": array("2", 1, 10_000, dtype="int", says=("a tuple (W, H)", "1 to 10000")),
    },
    inputs=_labels_and_size,
    by_hand=(
        (np.array([[0, 2], [1, 3]], np.uint8), (6, 4)),
        (np.array([[0, 1, 2, 3]]), (2, 1)),
        (np.array([[0, 3, 0], [2, 0, 1]], np.uint8), (4, 5)),
        (np.array([[1, 2, 3, 0]], np.uint8), (2, 3)),
        (np.array([[0], [3]], np.uint8), (1, 49)),  # 24.5 * (2 / 49) is less than 1 in floating point
        (np.array([[0, 1, 2, 3]], np.uint8), (2, 1)),  # smaller: the centres of halves lie in 1 and 3
        (np.arange(22)[None], (11, 1)),  # 7.5 / 11 * 22 is less than 15 in floating point
        (np.array([[5], [9]]), (1, 11)),  # steps of 2 / 11, added up, are 1 too late
        (np.arange(14)[:, None], (1, 9)),  # in floats 4.5 / (9 / 14) is not 7
        (np.arange(100, dtype=np.uint8).reshape(10, 10), (20, 20)),  # and 19.5 * 10 * 2 is no byte
        (np.arange(6000)[:, None], (1, 4129)),  # in float32 3419.5 * 6000 / 4129 is off
        (np.array([[300, 2]]), (4, 1)),  # labels need not be bytes
        (np.array([[-(2**31), 2**31 - 1], [-1, 255], [0, 70_000]]), (3, 4)),
        (np.arange(5) + np.arange(LONG)[:, None] % 7, (1, 1)),
        ((np.arange(LONG) % 11)[None], (10_000, 1)),
        (np.array([[0, 1, 2], [1, 2, 0]], np.uint8), (1, 9000)),
    ),
    edges=6,
    random_cases=8,
    forbidden=("cv2", "PIL"),
)


@holds("no class appears that was not there")
def no_class_is_new(labels, size, out):
    return np.isin(out, labels).all()


# ---------------------------------------------------------------------------------------------------- wrong answers


@wrong("OpenCV's size is (width, height), a shape is not.")
def resize_swapped(labels, size):
    return enlarge(labels, size[::-1])


@wrong("From 4 pixels to 2: the first new one covers old 0 and 1, and where is its centre? Not at its corner.")
def resize_by_corners(labels, size):
    return copied(labels, size[::-1], lambda i, n, old: i * old // n)


@wrong("Print np.unique before and after: you average labels. Is the mean of classes 0 and 2 class 1?")
def resize_bilinear(labels, size):
    W, H = size
    h, w = labels.shape
    rows, columns = (np.arange(H) + 0.5) * h / H - 0.5, (np.arange(W) + 0.5) * w / W - 0.5
    wide = [np.interp(columns, np.arange(w), row) for row in labels]
    return np.stack([np.interp(rows, np.arange(h), column) for column in np.transpose(wide)], axis=1).round()


@wrong("From 2 to 4 pixels, each old one should appear twice: which ones do yours show?")
def resize_rounded(labels, size):
    return copied(labels, size[::-1], lambda i, n, old: np.minimum(np.round(i * old / n), old - 1))


@wrong("You interpolate between the outermost centres: does every old pixel get the same share of new ones?")
def resize_corner_to_corner(labels, size):
    return copied(labels, size[::-1], lambda i, n, old: np.linspace(0, old - 1, n).round())


@wrong("24.5 * (2 / 49) is not 1 in floating point: which whole numbers give the same quotient?")
def resize_by_floats(labels, size):
    return copied(labels, size[::-1], lambda i, n, old: (i + 0.5) * (old / n))


@wrong("np.resize repeats the data in reading order, and does not enlarge a picture. Look at what it gives.")
def resize_tiled(labels, size):
    W, H = size
    return np.resize(labels, (H, W))


@wrong("The blob may have other proportions than the image: a factor for each side.")
def resize_one_factor(labels, size):
    factor = max(size[0] // labels.shape[1], 1)
    return copied(labels, size[::-1], lambda i, n, old: np.minimum(i // factor, old - 1))


@wrong("A centre exactly between two old pixels belongs to the second; np.round and np.rint take the even one.")
def resize_half_to_even(labels, size):
    return copied(labels, size[::-1], lambda i, n, old: np.rint((i + 0.5) * old / n - 0.5))


@wrong("A centre at 0.7 lies in old pixel 0, which reaches from 0 to 1: which way do you round?")
def resize_rounded_centres(labels, size):
    return copied(labels, size[::-1], lambda i, n, old: np.rint((i + 0.5) * old / n).clip(0, old - 1))


@wrong("7.5 / 11 * 22 is not 15 in floating point: which whole numbers give the same quotient?")
def resize_by_shares(labels, size):
    return copied(labels, size[::-1], lambda i, n, old: (i + 0.5) / n * old)


@wrong("np.repeat repeats a whole number of times: how do 2 rows become 5?")
def resize_by_whole_factors(labels, size):
    W, H = size
    return labels.repeat(H // labels.shape[0], axis=0).repeat(W // labels.shape[1], axis=1)


@wrong("Rows have their own factor, h / H: you use that of the columns.")
def resize_rows_as_columns(labels, size):
    W, w = size[0], labels.shape[1]
    return copied(labels, size[::-1], lambda i, n, old: np.minimum((2 * i + 1) * w // (2 * W), old - 1))


@wrong("From 2 rows to 4, a new row takes half an old one: which of h and H multiplies, and which divides?")
def resize_by_the_factor_upside_down(labels, size):
    return copied(labels, size[::-1], lambda i, n, old: np.minimum((2 * i + 1) * n // (2 * old), old - 1))
