"""01_labels.class_shares: the question, and wrong answers with the hints that they earn."""

from functools import partial

import numpy as np

from labcourse.kinds import LONG, MOST_CLASSES, count, labels
from labcourse.questions.t01_labels import images_and_classes
from labgrader.question import Question, wrong


def class_shares(y, C):
    """Give the share of each class among the judged pixels (not 255) of those images that show the class."""
    n = (y[..., None] == np.arange(C)).sum(axis=(1, 2))  # (N, C)
    judged = n.sum(axis=1, keepdims=True)
    return n.sum(axis=0) / np.maximum((judged * (n > 0)).sum(axis=0), 1)


def _many_labels(rng):
    """Draw images with more pixels of a class than a byte counts; class 1 is missing in the first one."""
    y, C = images_and_classes(rng)
    y[0][y[0] == 1] = 0
    y[1, 3, :2] = 1
    return np.tile(y, (1, 5, 5)), C


def _all_classes(rng, shape):
    """Draw images of a shape with any of 255 classes, and pixels that are not judged, but not all of an image.

    The last class is at the last pixel alone.
    """
    y = LABELS.draw(rng, N=shape[0], H=shape[1], W=shape[2])
    unjudged = rng.random(shape) < 0.5
    unjudged[:, 0, 0] = False
    y = np.where(unjudged, 255, np.where(y >= MOST_CLASSES - 1, 0, y)).astype(np.uint8)
    y[-1, -1, -1] = MOST_CLASSES - 1
    return y, MOST_CLASSES


LABELS = labels("N H W", free=("reversed*", "sorted along [HW]"))

QUESTION = Question(
    reference=class_shares,
    kinds={"y": LABELS, "C": count(1, MOST_CLASSES, says="1 to 255")},
    inputs=(_many_labels, *(partial(_all_classes, shape=s) for s in ((LONG, 1, 2), (1, LONG, 2), (2, 1, LONG)))),
    by_hand=(
        (np.array([[[1, 1], [0, 3]]], np.uint8), 5),
        (np.array([[[1, 255, 255], [1, 1, 0]], [[0, 0, 0], [0, 255, 0]]], np.uint8), 3),
        (
            np.tile(np.array([[0, 1, 1, 1, 2, 255], [0, 0, 2, 0, 0, 2]], np.uint8)[:, None], (1, 300, 60)),
            3,
        ),  # more than 16 bits count
        (np.array([[[1, 255, 255], [1, 1, 0]], [[0, 0, 0], [0, 0, 0]]], np.uint8), 3),
        (np.array([[[0]]], np.uint8), 1),
    ),
    edges=2,
    random_cases=6,
    points=1,
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def counts(y, C):
    """Pixels of each class in each image, (N, C)."""
    return (y[..., None] == np.arange(C)).sum(axis=(1, 2))


def shares(n, pixels):
    """The shares of classes with counts n (N, C) in the images that show them, which have so many pixels (N,)."""
    return n.sum(axis=0) / np.maximum(((n > 0) * np.reshape(pixels, (-1, 1))).sum(axis=0), 1)


@wrong("That is the lesson's share, among the pixels of all images. Which images show the class at all?")
def of_all_images(y, C):
    return counts(y, C).sum(axis=0) / np.count_nonzero(y != 255)


@wrong("That is the lesson's share, of all pixels. Leave out unjudged pixels, and images without the class.")
def of_all_pixels(y, C):
    return counts(y, C).sum(axis=0) / y.size


@wrong("You return counts: of which pixels is each of them a share?")
def counts_alone(y, C):
    return counts(y, C).sum(axis=0)


@wrong("You divide by all pixels of the images that show a class: which of them were never judged?")
def unjudged_counted(y, C):
    return shares(counts(y, C), np.full(len(y), y[0].size))


@wrong("Add up pixels first and divide once: a mean of the images' shares gives pixels of some images more weight.")
def mean_over_the_images_that_show_it(y, C):
    n = counts(y, C)
    return (n / n.sum(axis=1, keepdims=True)).sum(axis=0) / np.maximum((n > 0).sum(axis=0), 1)


@wrong("A mean of the images' shares counts an image without the class as 0; its pixels should not count at all.")
def mean_over_all_images(y, C):
    n = counts(y, C)
    return (n / n.sum(axis=1, keepdims=True)).mean(axis=0)


@wrong("That is one row for each image. One share per class is asked for, over the images that show the class.")
def row_for_each_image(y, C):
    n = counts(y, C)
    return n / n.sum(axis=1, keepdims=True)


@wrong("That is the share of the images that show a class. Count its pixels in them.")
def share_of_the_images(y, C):
    return (counts(y, C) > 0).mean(axis=0)


@wrong("You count pixels of 255 as class 0: they were never judged, so they belong to no class.")
def unjudged_is_background(y, C):
    n = counts(np.where(y == 255, 0, y), C)
    return shares(n, n.sum(axis=1))


@wrong("Background (class 0) is a class like the others here.")
def without_background(y, C):
    n = counts(y, C)
    n[:, 0] = 0
    return shares(n, n.sum(axis=1))


@wrong("A class without pixels has a share as well, 0: the result has always C entries.")
def only_what_occurs(y, C):
    return class_shares(y, C)[counts(y, C).any(axis=0)]


@wrong("A class that no image shows has 0 pixels of 0: its share is 0 here, not NaN.")
def nothing_by_nothing(y, C):
    return np.where(counts(y, C).any(axis=0), class_shares(y, C), np.nan)


@wrong("A byte ends at 255. How many pixels of one class can an image have?")
def counted_in_bytes(y, C):
    n = counts(y, C).astype(np.uint8).astype(int)
    return shares(n, n.sum(axis=1))


@wrong("Clipping turns 255 into the largest class: unjudged pixels are then counted as that class.")
def unjudged_as_the_last_class(y, C):
    n = counts(np.minimum(y, C - 1), C)
    return shares(n, n.sum(axis=1))


@wrong("np.bincount counts 255 like any other number: leave out unjudged pixels before you count.")
def unjudged_as_a_class(y, C):
    n = counts(y, 256)
    return shares(n, n.sum(axis=1))


@wrong("That is the lesson's line. Here pixels of 255 are left out, and for each class the images without it.")
def line_of_the_lesson(y, C):
    return np.bincount(y.ravel(), minlength=C) / y.size


@wrong("Each class has its own number of judged pixels to divide by: over which axis does n count images?")
def sums_of_the_other_axis(y, C):
    n = counts(y, C)
    return n.sum(axis=0) / np.maximum((n.sum(axis=0) * (n > 0)).sum(axis=0), 1)


@wrong("One pixel of 255 leaves out that pixel, not its image: you lose all its other pixels.")
def images_with_255_left_out(y, C):
    whole = np.stack([image for image in y if 255 not in image] or [np.full_like(y[0], 255)])
    return class_shares(whole, C)


@wrong(
    "You take the median of the images' shares, so a large and a small image count alike. Add up pixels, then divide."
)
def median_over_images(y, C):
    n = counts(y, C)
    return np.nan_to_num(np.nanmedian(np.where(n > 0, n / n.sum(axis=1, keepdims=True), np.nan), axis=0))
