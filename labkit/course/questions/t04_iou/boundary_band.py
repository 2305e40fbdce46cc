"""04_iou.boundary_band: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.questions.question import Property, Question, wrong


def boundary_band(mask, width):
    """Mark the mask's pixels that have a pixel outside it, or the image's border, within `width` rows and columns."""
    H, W = mask.shape
    framed = np.pad(mask, width)
    inside = mask.copy()
    for down in range(2 * width + 1):
        for right in range(2 * width + 1):
            inside &= framed[down : down + H, right : right + W]
    return mask & ~inside


def _blob(rng):
    """Draw a mask of a rectangle that touches the border, a slanted half-plane cut out of it, and a hole."""
    H, W = int(rng.integers(15, 19)), int(rng.integers(20, 26))
    v, u = np.mgrid[0:H, 0:W]
    mask = (v < H - 2) & (u >= 3) & (0.5 * u + v < 0.5 * W + 0.55 * H)
    mask[rng.integers(2, 6), rng.integers(7, 12)] = False
    return np.roll(mask, rng.integers(0, 3), axis=1), int(rng.integers(1, 4))


def _square(size, low, high):
    mask = np.zeros(size, bool)
    mask[low:high, low:high] = True
    return mask


QUESTION = Question(
    name="04_iou.boundary_band",
    reference=boundary_band,
    inputs=_blob,
    by_hand=(
        (_square((5, 6), 1, 4), 1),  # a 3 x 3 square: all but its middle
        (_square((6, 7), 0, 4), 1),  # the same kind of square in the corner of the image
        (np.ones((5, 8), bool), 2),
        (np.zeros((3, 4), bool), 1),
    ),
    rtol=0.0,
    atol=0.0,
    points=3,
    properties=(
        Property(
            "every pixel of the band is a pixel of the mask",
            lambda arguments, band: not np.any(np.asarray(band, bool) & ~arguments[0]),
        ),
    ),
    forbidden=("cv2", "scipy", "skimage"),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def grown(mask, down, right):
    """Mark the pixels with a pixel of the mask within `down` rows and `right` columns."""
    H, W = mask.shape
    framed = np.pad(mask, ((down, down), (right, right)))
    shifts = [framed[v : v + H, u : u + W] for v in range(2 * down + 1) for u in range(2 * right + 1)]
    return np.logical_or.reduce(shifts)


@wrong(QUESTION, "Take a mask that fills the image: where it meets the image's border is an edge too.")
def border_is_no_edge(mask, width):
    return mask & grown(~mask, width, width)


def framed(mask, width):
    """The complement of the mask in an image that is `width` larger on each side, all of that outside the mask."""
    return np.pad(~mask, width, constant_values=True)


def cropped(image, width):
    return image[width : image.shape[0] - width, width : image.shape[1] - width]


def band_with_window(mask, down, right):
    reach = max(down, right)
    return mask & cropped(grown(framed(mask, reach), down, right), reach)


@wrong(QUESTION, "Your band lies around the mask: it should be the part of the mask that is near its edge.")
def outer_band(mask, width):
    return grown(mask, width, width) & ~mask


@wrong(QUESTION, "A pixel that is not in the mask is not in its band.")
def both_sides(mask, width):
    return outer_band(mask, width) | band_with_window(mask, width, width)


@wrong(QUESTION, "You return what is far from the edge; for a 3 x 3 square and width 1 all but the middle is band.")
def the_inside(mask, width):
    return mask & ~band_with_window(mask, width, width)


@wrong(QUESTION, "Look at a corner that is cut into the mask: a pixel diagonal to it is within one row and one column.")
def cross_window(mask, width):
    return band_with_window(mask, width, 0) | band_with_window(mask, 0, width)
