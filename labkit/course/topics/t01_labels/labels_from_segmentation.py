"""01_labels.labels_from_segmentation: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.checker.question import Question, holds, wrong


def labels_from_segmentation(segmentation, class_of_body):
    """Turn PyBullet's raw mask, body + ((link + 1) << 24) or -1 for nothing, into labels; nothing is class 0."""
    labels = np.zeros(segmentation.shape, np.uint8)
    seen = segmentation >= 0
    labels[seen] = class_of_body[segmentation[seen] & 0xFFFFFF]
    return labels


def _raw_mask(rng):
    """Draw bodies with links -1 to 11, and nothing in a fifth of the pixels; the first and last body have a class.

    Most tables are so long that 16 bits do not hold the number of a body.
    """
    bodies = int(rng.integers(5, 9)) + 65536 * int(rng.random() < 0.8)
    class_of_body = rng.permutation(np.arange(bodies) % 4).astype(np.uint8)
    class_of_body[[0, -1]] = rng.integers(1, 4, 2)
    shape = (int(rng.integers(6, 9)), int(rng.integers(10, 14)))
    body, link = rng.integers(0, bodies, shape), rng.integers(-1, 12, shape)
    body[:, ::3] = bodies - rng.integers(1, 5, body[:, ::3].shape)
    raw = body + ((link + 1) << 24)
    raw[rng.random(shape) < 0.2] = -1
    return raw.astype(np.int32), class_of_body


QUESTION = Question(
    reference=labels_from_segmentation,
    inputs=_raw_mask,
    by_hand=(
        (np.array([[-1, 0, 1], [2, 1 + (1 << 24), 2 + (3 << 24)]], np.int32), np.array([1, 3, 2], np.uint8)),
        (np.array([[65537, 65538 + (127 << 24)]], np.int32), (np.arange(5, 65545) // 7 % 4).astype(np.uint8)),  # many
        (np.array([[5 << 24, 3 + (12 << 24)]], np.int32), np.array([2, 0, 0, 255], np.uint8)),  # a body not judged
    ),
    forbidden=("pybullet",),
)


@holds("where nothing is seen (-1), the label is 0")
def nothing_is_0(segmentation, class_of_body, labels):
    return not np.any(labels[segmentation == -1])


# ---------------------------------------------------------------------------------------------------- wrong answers


def numbers_and_seen(segmentation):
    return segmentation & 0xFFFFFF, segmentation >= 0


def links_alone(segmentation, class_of_body, links):
    """The right labels of some links, 0 elsewhere."""
    return labels_from_segmentation(np.where(np.isin((segmentation >> 24) - 1, links), segmentation, -1), class_of_body)


@wrong("Values in the millions are body + ((link + 1) << 24), and yours skips them: which bits hold the body?")
def base_links_only(segmentation, class_of_body):
    """Compare the raw values with body numbers: whatever has link bits matches none."""
    return links_alone(segmentation, class_of_body, [-1])


@wrong("Where nothing is seen stands -1, and in NumPy the index -1 means the last entry.")
def nothing_is_the_last_body(segmentation, class_of_body):
    body, seen = numbers_and_seen(segmentation)
    return class_of_body[np.where(seen, body, -1)]


@wrong("You keep the upper bits, which are the link: which bits hold the body?")
def link_for_body(segmentation, class_of_body):
    link = (segmentation >> 24) % len(class_of_body)
    return np.where(segmentation >= 0, class_of_body[link], 0)


@wrong("Yours returns the numbers of bodies: look up each body's class in class_of_body.")
def body_for_class(segmentation, class_of_body):
    body, seen = numbers_and_seen(segmentation)
    return np.where(seen, body, 0)


@wrong("The lower 24 bits of -1 are all ones, 16777215: look up only the pixels where something is seen.")
def nothing_looked_up(segmentation, class_of_body):
    """IndexError, wherever nothing is seen."""
    return class_of_body[segmentation & 0xFFFFFF]


@wrong("The body has 24 bits, six hexadecimal digits: how many does your mask keep?")
def sixteen_bits(segmentation, class_of_body):
    return np.where(segmentation >= 0, class_of_body[np.where(segmentation >= 0, segmentation & 0xFFFF, 0)], 0)


@wrong("The upper bits are the link plus one, not the body: which bits hold the body?")
def link_looked_up(segmentation, class_of_body):
    """IndexError, where a link's number is no body's."""
    return np.where(segmentation >= 0, class_of_body[np.maximum(segmentation >> 24, 0)], 0)


@wrong("You find the base and link 0 alone, and a body may have many links. What holds for all of them?")
def first_link_alone(segmentation, class_of_body):
    return links_alone(segmentation, class_of_body, [-1, 0])


@wrong("Yours returns the numbers of bodies: look up each body's class in class_of_body.")
def body_in_a_byte_for_class(segmentation, class_of_body):
    return body_for_class(segmentation, class_of_body).astype(np.uint8)
