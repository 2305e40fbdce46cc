"""01_labels.labels_from_colours: the question, and wrong answers with the hints that they earn."""

from functools import partial

import numpy as np

from labcourse.kinds import LONG, MOST_CLASSES, array, image
from labgrader.question import Question, holds, wrong


def labels_from_colours(rgb, palette):
    """Turn a coloured label picture back into labels; a colour that no class has becomes 255."""
    same = (rgb[:, :, None, :] == palette).all(axis=-1)
    return np.where(same.any(axis=-1), same.argmax(axis=-1), 255)


# What leaves the number of a colour in base 255 as it is, and what its grey value, 0.299 R + 0.587 G + 0.114 B,
# whichever channel has which weight.
_ALIKE = np.array([[-255, 1, 0], [-255, 0, 1], [1, -255, 0], [0, -255, 1], [1, 0, -255], [0, 1, -255]])
_ALIKE_IN_GREY = np.array([[11, 1, -34], [1, 11, -34], [11, -34, 1], [1, -34, 11], [-34, 11, 1], [-34, 1, 11]])


def _picture(rng):
    """Draw a palette whose colours share channels and brightness, and a picture with colours that nearly are of it."""
    a, b, c = (int(value) for value in rng.choice(np.arange(40, 240, 10), 3, replace=False))
    palette = np.array([[a, b, c], [c, a, b], [b, c, a], [a, c, b], [c, b, a]], np.uint8)
    known = np.array([[255, 0, a], [b, 255, 0], [0, c, 255]], np.uint8)
    y = rng.integers(0, 5, (int(rng.integers(4, 7)), int(rng.integers(8, 11))))
    rgb = palette[y].astype(int)
    between = rng.random(y.shape) < 0.25
    between[0, 0] = True
    rgb[between] = (3 * rgb[between] + palette[(y[between] + 1) % 5]) // 4
    rgb[1, 0] += rng.permutation([1, -1, 0])  # as bright as a known colour
    rgb[1, 1] += rng.permutation([16, 0, 0])  # its square is 0 in a byte
    rgb[2, :6] = known[[0, 0, 1, 1, 2, 2]] + _ALIKE  # the same number in base 255
    rgb[3, :6] = palette[rng.integers(0, 5, 6)] + _ALIKE_IN_GREY  # as grey
    return rgb.astype(np.uint8), np.concatenate([palette, known])


def _many_colours(rng, shape):
    """Draw as many colours as a palette may have, and a picture of a shape; its last pixel has the last colour."""
    palette = np.unique(rng.integers(0, 256, (2 * MOST_CLASSES, 3)), axis=0)
    palette = rng.permutation(palette)[:MOST_CLASSES].astype(np.uint8)
    unknown = rng.integers(0, 256, (*shape, 3))
    rgb = np.where(rng.random((*shape, 1)) < 0.2, unknown, palette[rng.integers(0, MOST_CLASSES, shape)])
    rgb[-1, -1] = palette[-1]
    return rgb.astype(np.uint8), palette


_PALETTE = np.array([[0, 0, 0], [0, 0, 255], [255, 0, 0], [0, 255, 0]], np.uint8)
# Two known colours; then such as have a known one's number in a wrong base (255, 16, 10, 257, 100 ...).
_NEARLY = np.array(
    [
        [[0, 0, 0], [0, 255, 0], [0, 1, 0], [0, 15, 15], [20, 53, 20]],
        [[0, 0, 254], [254, 255, 1], [254, 255, 255], [0, 254, 128], [0, 2, 55]],
    ],
    np.uint8,
)


# As grey 11 * 0.299 + 0.587 is 34 * 0.114; the last one is known.
_AS_GREY = np.array([[[11, 1, 0], [1, 11, 0], [11, 0, 1], [1, 0, 11], [0, 11, 1], [0, 1, 11], [0, 34, 0]]], np.uint8)


QUESTION = Question(
    reference=labels_from_colours,
    kinds={"rgb": image(), "palette": array("C 3", 0, 255, dtype="uint8", says=("1 to 255", "all different"))},
    inputs=(_picture, *(partial(_many_colours, shape=s) for s in ((1, LONG), (LONG, 1), (5, 5)))),
    by_hand=(
        (np.array([[[15, 0, 7], [0, 9, 0]]], np.uint8), np.array([[0, 9, 0], [1, 1, 1]], np.uint8)),  # equally bright
        (np.array([[[0, 0, 255], [255, 0, 0], [128, 0, 128]]], np.uint8), _PALETTE),
        (_NEARLY, _PALETTE),
        (np.array([[[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 255, 0]]], np.uint8), _PALETTE),  # 1 * 255 is 255 * 1
        (_AS_GREY, np.array([[0, 0, 34], [0, 34, 0], [34, 0, 0]], np.uint8)),
        (np.array([[[0, 0, 255], [255, 0, 0], [128, 0, 128]]], np.uint8), _PALETTE[:3]),
        (np.array([[[9, 0, 7]], [[9, 1, 7]]], np.uint8), np.array([[9, 0, 7]], np.uint8)),  # one class
        (np.array([[[1, 2, 3], [2, 3, 1]]], np.uint8), np.array([[2, 3, 1], [3, 1, 2], [1, 2, 3]], np.uint8)),
    ),
    edges=3,
    points=3,
)


@holds("a pixel is 255 where no class has exactly its colour")
def unknown_is_255(rgb, palette, y):
    return np.all(y[~(rgb[:, :, None] == palette).all(-1).any(-1)] == 255)


# ---------------------------------------------------------------------------------------------------- wrong answers


def matches(rgb, palette):
    """Which channels of which class's colour each pixel has, (H, W, C, 3)."""
    return rgb[:, :, None, :] == palette


def first_of(same, otherwise=255):
    """The first class that holds, (H, W, C) -> (H, W)."""
    return np.where(same.any(axis=-1), same.argmax(axis=-1), otherwise)


@wrong("A mixed colour has no class: the nearest colour may belong to a class that was never there.")
def nearest_colour(rgb, palette):
    """Whatever colour lies nearest."""
    distance = ((rgb[:, :, None, :].astype(float) - palette) ** 2).sum(axis=-1)
    return distance.argmin(axis=-1)


def last_of(same):
    """The last class that holds, as a loop over the classes leaves it."""
    return np.where(same.any(axis=-1), same.shape[-1] - 1 - same[..., ::-1].argmax(axis=-1), 255)


ALL_THREE = "Two colours are the same only if all three channels are equal: do you accept one equal channel?"
NOT_THE_SUM = "Different colours can be equally bright: compare the channels, not their sum."


@wrong(ALL_THREE)
def any_channel(rgb, palette):
    """One channel that fits is taken for all; the first such class counts."""
    return first_of(matches(rgb, palette).any(axis=-1))


@wrong(ALL_THREE)
def any_channel_of_the_last(rgb, palette):
    """The same, and the last such class counts."""
    return last_of(matches(rgb, palette).any(axis=-1))


@wrong(NOT_THE_SUM)
def by_brightness(rgb, palette):
    """The sum of the channels compared; the first such class counts."""
    return first_of(rgb.sum(axis=-1, dtype=int)[..., None] == palette.sum(axis=-1, dtype=int))


@wrong(NOT_THE_SUM)
def by_brightness_of_the_last(rgb, palette):
    """The same, and the last such class counts."""
    return last_of(rgb.sum(axis=-1, dtype=int)[..., None] == palette.sum(axis=-1, dtype=int))


@wrong("An unknown colour is 255, not 0: what do you start from, and what is argmax of a row of False?")
def unknown_becomes_0(rgb, palette):
    """Unknown colours become class 0."""
    return first_of(matches(rgb, palette).all(axis=-1), 0)


@wrong("Bytes wrap around: 16 * 16 is 256, which a byte stores as 0. Compare the channels themselves.")
def squares_of_bytes(rgb, palette):
    return last_of((((rgb[:, :, None].astype(int) - palette) ** 2) % 256 == 0).all(axis=-1))


@wrong("Each pass of your loop overwrites the one before: a pixel without this class's colour must keep its label.")
def last_class_alone(rgb, palette):
    return np.where((rgb == palette[-1]).all(axis=-1), len(palette) - 1, 255)


@wrong("Several classes may have the same red: which channels does your comparison leave out?")
def red_alone(rgb, palette):
    return last_of(matches(rgb, palette)[..., 0])


@wrong("Only the last channel tells in yours. If you shift or multiply bytes into one number: can a byte hold it?")
def packed_into_a_byte(rgb, palette):
    return last_of(matches(rgb, palette)[..., 2])


@wrong("np.isin asks whether a number occurs anywhere in the colour: is [0, 0, 255] the same as [255, 0, 0]?")
def channels_in_any_order(rgb, palette):
    return last_of((rgb[:, :, None, :, None] == palette[:, None, :]).any(axis=-1).all(axis=-1))


@wrong("Which channel comes first in an RGB image?")
def blue_first(rgb, palette):
    """The picture read as BGR."""
    return first_of(matches(rgb[..., ::-1], palette).all(axis=-1))


@wrong("argmax is 0 where class 0 fits, and also where no class fits: how do you tell the two apart?")
def class_0_becomes_unknown(rgb, palette):
    y = first_of(matches(rgb, palette).all(axis=-1), 0)
    return np.where(y == 0, 255, y)
