"""06_back_projection.cropped_intrinsics: the question, and wrong answers with the hints that they earn."""

from functools import partial

import numpy as np

from labcourse.kinds import count, intrinsics, number
from labgrader.question import Question, wrong


def cropped_intrinsics(K, left, top, scale):
    """K of an image that was cropped, and then resized; the centre of the first pixel is at u = v = 0 in both."""
    half = (scale - 1.0) / 2.0
    crop_and_resize = np.array([[scale, 0.0, half - scale * left], [0.0, scale, half - scale * top], [0.0, 0.0, 1.0]])
    return crop_and_resize @ K


def _crop(rng, large):
    """Draw a camera, where a window begins, and a scale that makes it larger, or else smaller."""
    left, top = rng.choice([rng.integers(5, 40, 2), rng.integers(1000, 4000, 2)])
    return intrinsics().draw(rng), int(left), int(top), float(10.0 ** (rng.uniform(0.1, 2.0) * (1 if large else -1)))


QUESTION = Question(
    reference=cropped_intrinsics,
    kinds={
        "K": intrinsics(),
        "left": count(0, 3999, says="0 to 3999"),
        "top": count(0, 3999, says="0 to 3999"),
        "scale": number(0.01, 100.0, says="0.01 to 100"),
    },
    inputs=(partial(_crop, large=False), partial(_crop, large=True)),
    by_hand=(
        (np.array([[200.0, 0.0, 160.0], [0.0, 300.0, 119.0], [0.0, 0.0, 1.0]]), 40, 20, 1.0),  # cropped alone
        # 20 x 16: 4.5, 3.5 is the middle
        (np.array([[200.0, 0.0, 9.5], [0.0, 300.0, 7.5], [0.0, 0.0, 1.0]]), 0, 0, 0.5),
        (np.array([[200.0, 0.0, 0.0], [0.0, 300.0, 0.0], [0.0, 0.0, 1.0]]), 0, 0, 2.0),  # the first pixel's centre
        # 0.01 (4400 - 3900 + 0.5) - 0.5 = 4.505, and 96 (100.5 - 100 + 0.5) - 0.5 = 95.5
        (np.array([[2000.0, 0.0, 4400.0], [0.0, 2000.0, 3900.5], [0.0, 0.0, 1.0]]), 3900, 3900, 0.01),
        (np.array([[50.0, 0.0, 100.5], [0.0, 60.0, 3900.5], [0.0, 0.0, 1.0]]), 100, 3900, 96.0),
    ),
    edges=2,
    rtol=1e-6,
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def with_centre(K, scale, cx, cy):
    return np.array([[scale * K[0, 0], 0.0, cx], [0.0, scale * K[1, 1], cy], [0.0, 0.0, 1.0]])


@wrong("Halve a row of two pixels: their centres are at 0 and 1, the new pixel covers both. Where is its centre?")
def centres_forgotten(K, left, top, scale):
    return with_centre(K, scale, scale * (K[0, 2] - left), scale * (K[1, 2] - top))


@wrong("The principal point is in pixels, too: with twice as many it lies twice as far from the corner.")
def focal_length_alone_scaled(K, left, top, scale):
    return with_centre(K, scale, K[0, 2] - left, K[1, 2] - top)


@wrong("First cropped, then resized: left and top count pixels of the image before it was resized.")
def resized_first(K, left, top, scale):
    return cropped_intrinsics(K, left / scale, top / scale, scale)


@wrong("What was at column `left` is at column 0 of the crop: do columns grow or shrink?")
def added(K, left, top, scale):
    return cropped_intrinsics(K, -left, -top, scale)


@wrong("left and top count old pixels, so subtract them first; and corners stay together, not centres.")
def resized_first_about_centres(K, left, top, scale):
    return with_centre(K, scale, scale * K[0, 2] - left, scale * K[1, 2] - top)


@wrong("Your half pixel has the wrong sign: the corner is at -1/2, so a centre u lies u + 1/2 after it.")
def half_pixel_with_the_other_sign(K, left, top, scale):
    half = (1.0 - scale) / 2.0
    return with_centre(K, scale, scale * (K[0, 2] - left) + half, scale * (K[1, 2] - top) + half)


@wrong("With scale 1 only the crop counts, and yours is half a pixel off: what do you add before the resize?")
def half_pixel_only_after_the_resize(K, left, top, scale):
    return with_centre(K, scale, scale * (K[0, 2] - left) - 0.5, scale * (K[1, 2] - top) - 0.5)


@wrong("You count from the corner of the first pixel, half a pixel before its centre. Where is 0 in the new image?")
def from_the_corner_to_the_end(K, left, top, scale):
    return with_centre(K, scale, scale * (K[0, 2] - left + 0.5), scale * (K[1, 2] - top + 0.5))


@wrong("A resize multiplies u and v: which rows of K make them, and which entry must stay 1?")
def whole_matrix_scaled(K, left, top, scale):
    new = cropped_intrinsics(K, left, top, scale)
    new[2, 2] = scale
    return new


@wrong("With twice as many pixels, how many pixels is the focal length?")
def focal_lengths_kept(K, left, top, scale):
    new = cropped_intrinsics(K, left, top, scale)
    new[[0, 1], [0, 1]] = K[0, 0], K[1, 1]
    return new


@wrong("fx and fy may differ: which entry of K is fy?")
def one_focal_length(K, left, top, scale):
    new = cropped_intrinsics(K, left, top, scale)
    new[1, 1] = new[0, 0]
    return new
