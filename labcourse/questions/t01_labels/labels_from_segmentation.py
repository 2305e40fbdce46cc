"""01_labels.labels_from_segmentation: the question, and wrong answers with the hints that they earn."""

from functools import partial

import numpy as np

from labcourse.kinds import LONG, array
from labgrader.question import Question, holds, wrong


def labels_from_segmentation(segmentation, class_of_part):
    """Turn PyBullet's raw mask, body + ((link + 1) << 24) or -1 for nothing, into labels; nothing is class 0."""
    labels = np.zeros(segmentation.shape, np.uint8)
    seen = segmentation >= 0
    labels[seen] = class_of_part[segmentation[seen] & 0xFFFFFF, segmentation[seen] >> 24]
    return labels


def _raw_mask(rng):
    """Draw bodies with links, and nothing in a fifth of the pixels; the first and last part have a class.

    Most tables are so long that 16 bits, or 17 to 19, do not hold the number of a body.
    """
    more = int(rng.choice([0, 1 << 16, 1 << 17, 1 << 19]))
    bodies, parts = int(rng.integers(5, 9)) + more, int(rng.integers(9, 13) if more < 1 << 17 else rng.integers(3, 5))
    class_of_part = rng.integers(0, 4, (bodies, parts), np.uint8)
    class_of_part[[0, -1]] = rng.integers(1, 4, (2, parts))
    shape = (int(rng.integers(6, 9)), int(rng.integers(10, 14)))
    body, part = rng.integers(0, bodies, shape), rng.integers(0, parts, shape)
    body[:, ::3] = bodies - rng.integers(1, 5, body[:, ::3].shape)
    part[::3] = 0
    raw = body + (part << 24)
    raw[rng.random(shape) < 0.2] = -1
    return raw.astype(np.int32), class_of_part


def _mask_of_many_links(rng, shape):
    """Draw a mask of a shape, of bodies with 127 links."""
    bodies = int(rng.integers(1, 3))
    class_of_part = rng.integers(1, 256, (bodies, 128)).astype(np.uint8)
    raw = rng.integers(0, bodies, shape) + (rng.integers(0, 128, shape) << 24)
    return np.where(rng.random(shape) < 0.2, -1, raw).astype(np.int32), class_of_part


QUESTION = Question(
    reference=labels_from_segmentation,
    kinds={
        "segmentation": array("H W", -1, dtype="int32", says="-1 where nothing is seen"),
        "class_of_part": array(
            "B L", 0, 255, dtype="uint8", lengths={"B": (1, 10**6), "L": (1, 128)}, says=("1,000,000", "128")
        ),
    },
    inputs=(_raw_mask, *(partial(_mask_of_many_links, shape=s) for s in ((1, LONG), (LONG, 1), (4, 4)))),
    by_hand=(
        (
            np.array([[-1, 0, 1], [2, 1 + (1 << 24), 1 + (2 << 24)]], np.int32),
            np.array([[1, 1, 1], [3, 3, 2], [2, 0, 0]], np.uint8),
        ),
        (
            np.array([[65537, 65538 + (2 << 24)]], np.int32),
            (np.arange(5, 196625) // 7 % 4).reshape(-1, 3).astype(np.uint8),
        ),
        # sixteen links are 10 in hexadecimal
        (np.array([[9 << 24, 16 << 24, 17 << 24]], np.int32), (np.arange(18)[None] // 3 % 4).astype(np.uint8)),
        (np.array([[1 << 24, 3 + (1 << 24)]], np.int32), np.array([[2, 1], [0, 1], [0, 1], [1, 255]], np.uint8)),
        (np.array([[-1]], np.int32), np.array([[2]], np.uint8)),
        (np.array([[-1, 0, 16777217]], np.int32), np.array([[1, 0], [3, 2]], np.uint8)),
        (
            np.array(
                [[(1 << 17) + 1, (1 << 18) + 2, (1 << 19) + 3, 999_999, 0]], np.int32
            ),  # 17 to 19 bits are too few
            (np.arange(3, 1_000_003) // 3 % 4).astype(np.uint8)[:, None],
        ),
    ),
    edges=3,
    random_cases=8,
    forbidden=("pybullet",),
)


@holds("where nothing is seen (-1), the label is 0")
def nothing_is_0(segmentation, class_of_part, labels):
    return not np.any(labels[segmentation == -1])


# ---------------------------------------------------------------------------------------------------- wrong answers


def body_part_seen(segmentation):
    """Body, column of the table, and whether something is seen; the first two are 0 where nothing is."""
    seen = segmentation >= 0
    return np.where(seen, segmentation & 0xFFFFFF, 0), np.where(seen, segmentation >> 24, 0), seen


def some_alone(segmentation, class_of_part, which):
    """The right labels of some parts, 0 elsewhere."""
    return labels_from_segmentation(np.where(np.isin(segmentation >> 24, which), segmentation, -1), class_of_part)


@wrong("The upper bits hold the link plus one, and so does the column: the base, link -1, is column 0.")
def one_column_off(segmentation, class_of_part):
    body, part, seen = body_part_seen(segmentation)
    return np.where(seen, class_of_part[body, part - 1], 0)


@wrong("Looking up a body, as in the lesson, gives a whole row of this table: which column is the pixel's link?")
def rows_of_classes(segmentation, class_of_part):
    body, _, seen = body_part_seen(segmentation)
    return np.where(seen[..., None], class_of_part[body], 0)


@wrong("Values in the millions are body + ((link + 1) << 24), and you skip them: which bits hold the body?")
def base_links_only(segmentation, class_of_part):
    """Compare the raw values with body numbers: whatever has link bits matches none."""
    return some_alone(segmentation, class_of_part, [0])


@wrong("Pixels where nothing is seen are -1, and in NumPy the index -1 means the last entry.", part=(0, -1))
def nothing_is_the_last_body(segmentation, class_of_part, part):
    body, column, seen = body_part_seen(segmentation)
    return class_of_part[np.where(seen, body, -1), np.where(seen, column, part)]


@wrong("You return the numbers of bodies: look up the class of the body's part in class_of_part.")
def body_for_class(segmentation, class_of_part):
    return body_part_seen(segmentation)[0]


@wrong("You return the numbers of bodies: look up the class of the body's part in class_of_part.")
def body_in_a_byte_for_class(segmentation, class_of_part):
    return body_for_class(segmentation, class_of_part).astype(np.uint8)


@wrong("The lower 24 bits of -1 are all ones, 16777215: look up only the pixels where something is seen.")
def nothing_looked_up(segmentation, class_of_part):
    """IndexError, wherever nothing is seen."""
    return class_of_part[segmentation & 0xFFFFFF, segmentation >> 24]


@wrong("The body has 24 bits, six hexadecimal digits: how many does your mask keep?")
def sixteen_bits(segmentation, class_of_part):
    body, part, seen = body_part_seen(segmentation)
    return np.where(seen, class_of_part[body & 0xFFFF, part], 0)


@wrong("Rows of the table are bodies, columns are parts: which bits hold the body, and which the link?")
def rows_and_columns_exchanged(segmentation, class_of_part):
    """IndexError, where a body's number is no column."""
    body, part, seen = body_part_seen(segmentation)
    return np.where(seen, class_of_part[part, body], 0)


@wrong("You find only the base and link 0, but a body may have many links. What do all of them have in common?")
def first_link_alone(segmentation, class_of_part):
    return some_alone(segmentation, class_of_part, [0, 1])
