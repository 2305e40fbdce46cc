"""04_iou.trimap_band: the question, and wrong answers with the hints that they earn."""

from functools import partial

import numpy as np

from labcourse.kinds import array, count
from labgrader.question import Question, wrong


def trimap_band(y, width):
    """Mark the pixels within `width` rows and columns of a pixel of another class; 255 is no class."""
    H, W = y.shape
    framed = np.pad(y, width, constant_values=255)
    band = np.zeros(y.shape, bool)
    for down in range(2 * width + 1):
        for right in range(2 * width + 1):
            near = framed[down : down + H, right : right + W]
            band |= (near != y) & (near != 255)
    return band & (y != 255)


def _labels(rng):
    """Draw classes with a slanted edge, one lone pixel, and between two of them a strip that nobody judged; H != W."""
    H, W = int(rng.integers(11, 14)), int(rng.integers(19, 24))
    v, u = np.mgrid[0:H, 0:W]
    y = np.where(0.5 * u + v < 0.25 * W + 0.3 * H, 2, 1).astype(np.uint8)
    y[u > W - 7] = 3
    y[:, W - int(rng.integers(6, 8))] = 255
    y[int(rng.integers(1, H - 1)), int(rng.integers(9, 12))] = 0
    y[y != 255] += np.uint8(rng.choice([0, 0, 4, 90, 251]))  # any number but 255 may be a class
    y = np.roll(y, int(rng.integers(-1, 2)), axis=1)
    y[0, 1:4] = y[1:4, 0] = 255  # two classes meet across a corner
    y[0, 0] = y[1, 1] + 1
    return y, int(rng.integers(1, 4))


def _long(rng, shape):
    """Draw a picture of two pixels across and many along, of any classes, each a few pixels long, and a wide band."""
    y = np.repeat(LABELS.draw(rng, H=1, W=20)[0], rng.integers(1, 60, 20))
    y = np.resize(y, shape)
    return y, int(rng.integers(9, MOST_WIDE + 1))


MOST_WIDE = 16
BEYOND_VGA = 700  # longer than a common image, which is 640 wide
LABELS = array("H W", 0, 254, also=(255,), dtype="uint8", says=("0 .. 254", "255 is no class"))
QUESTION = Question(
    reference=trimap_band,
    kinds={"y": LABELS, "width": count(1, MOST_WIDE, says="1 to 16")},
    inputs=(_labels, partial(_long, shape=(2, BEYOND_VGA)), _labels, partial(_long, shape=(BEYOND_VGA, 2))),
    by_hand=(
        (np.array([[1, 1, 1, 2, 2], [1, 1, 1, 1, 1]], np.uint8), 1),
        (np.full((4, 7), 3, np.uint8), 2),  # one class: no edge, at the image's border neither
        (np.array([[1, 1, 255, 2, 2, 2]], np.uint8), 1),  # one step from 1 nothing was judged
        (np.array([[1, 1, 255, 2, 2, 2]], np.uint8), 2),
        (np.array([[0, 0, 255, 255]], np.uint8), 2),  # beside class 0, too, nothing was judged
        (np.array([[1, 1, 2, 1, 1]], np.uint8), 2),  # a thin line is nearer than the window's border
        (np.array([[4, 4, 4, 9, 9, 254]], np.uint8), 1),  # nor is 3 the last class
        (np.array([[1, 1, 1], [1, 1, 1], [2, 1, 1]], np.uint8), 1),
        (np.diag([2, 0, 0, 0, 1]).astype(np.uint8), 1),
        (np.array([[7]], np.uint8), 1),
        (np.array([[1, 255], [255, 2]], np.uint8), 1),  # they meet across a corner
        (np.array([[255, 255, 255, 7]], np.uint8), 1),  # nor is 255 in the band where no class is near
        (np.array([[0, 128, 128, 128]], np.uint8), 1),  # alike but for the first of eight bits
        (np.repeat([[4, 4], [9, 4]], 30, axis=0).astype(np.uint8), MOST_WIDE),  # more places than a byte counts
        (np.repeat([4, 9], 16 * 16).reshape(32, 16).astype(np.uint8), MOST_WIDE),  # 256 of another class: 0 in a byte
    ),
    edges=6,
    random_cases=8,
    points=3,
    forbidden=("cv2", "scipy", "skimage"),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def square(width):
    """The steps (rows, columns) to all places of the window."""
    return [(v, u) for v in range(-width, width + 1) for u in range(-width, width + 1)]


def banded(y, width, steps, differs=np.not_equal):
    """The pixels from which one of some steps leads to another class; those of 255 are not left out."""
    H, W = y.shape
    framed = np.pad(y, width, constant_values=255)
    near = [framed[width + v : width + v + H, width + u : width + u + W] for v, u in steps]
    return np.any([differs(n, y) & (n != 255) for n in near], axis=0)


@wrong("Another class may be nearer than `width`, as a thin line is: which shifts do you try?")
def outermost_shifts_alone(y, width):
    return banded(y, width, [(v, u) for v in (-width, 0, width) for u in (-width, 0, width)]) & (y != 255)


@wrong("First along the rows, then along the columns: what if the pixel between the two steps is 255?")
def rows_then_columns(y, width):
    rows, columns = [(0, u) for u in range(-width, width + 1)], [(v, 0) for v in range(-width, width + 1)]
    down, across = (np.where(banded(y, width, steps) & (y != 255), 1, 255) for steps in (columns, rows))
    marked = lambda near, _: near == 1  # noqa: E731
    return (banded(down, width, rows, marked) | banded(across, width, columns, marked)) & (y != 255)


@wrong("0 is a class like any other. Which number is no class?")
def zero_is_no_class(y, width):
    return banded(y, width, square(width), lambda near, own: (near != own) & (near != 0)) & (y != 255) & (y != 0)


@wrong("A class may have any number from 0 to 254: over which of them does your loop go?", count=(2, 3, 4, 5, 10, 20))
def few_classes(y, width, count):
    return trimap_band(y, width) & (y < count)


@wrong("A class may have any number from 0 to 254: over which of them does your loop go?", count=(2, 3, 4, 5, 10, 20))
def few_classes_nearby(y, width, count):
    return trimap_band(np.where(y < count, y, 255).astype(np.uint8), width)


@wrong("An image of one class has no edge: beyond its border there is no class, not class 0.")
def border_is_an_edge(y, width):
    return trimap_band(np.pad(y, width), width)[width:-width, width:-width]


@wrong("255 is no class: an unjudged neighbour does not put a pixel into the band.")
def unjudged_is_a_class(y, width):
    return trimap_band(np.where(y == 255, 9, y), width) & (y != 255)


@wrong("A step down and a step to the right at once: is that pixel within one row and one column?")
def cross_window(y, width):
    return banded(y, width, [(v, u) for v, u in square(width) if v == 0 or u == 0]) & (y != 255)


@wrong("The window is a square: do you include the pixel `width` rows down and `width` columns to the right?")
def diamond_window(y, width):
    return banded(y, width, [(v, u) for v, u in square(width) if abs(v) + abs(u) <= width]) & (y != 255)


@wrong("Your window extends further up and left than down and right: which number does range leave out?")
def window_without_its_end(y, width):
    return banded(y, width, [(v, u) for v, u in square(width) if v < width and u < width]) & (y != 255)


@wrong("Your window extends only down and right: pixels above and to the left are neighbours, too.")
def down_and_right_alone(y, width):
    return banded(y, width, [(v, u) for v, u in square(width) if v >= 0 and u >= 0]) & (y != 255)


@wrong("Your band is one pixel too wide: the pixels beside an edge are already 1 away. How much further does it go?")
def grown_from_the_pixels_beside_the_edge(y, width):
    beside = np.where(trimap_band(y, 1), 1, 255)
    return banded(beside, width, square(width), lambda near, _: near == 1) & (y != 255)


@wrong("Pixels of the opposite border get in, as with np.roll: beyond its border an image has no pixels.")
def rolled_round(y, width):
    near = [np.roll(y, step, axis=(0, 1)) for step in square(width)]
    return (y != 255) & np.any([(n != y) & (n != 255) for n in near], axis=0)


@wrong("An edge has two sides: the pixels of the lower class belong to the band, too.")
def one_side(y, width):
    return banded(y, width, square(width), np.less) & (y != 255)


@wrong("An edge has two sides: must the number nearby be larger than the pixel's own, or just another?")
def other_side(y, width):
    return banded(y, width, square(width), np.greater) & (y != 255)


@wrong("A window of one class is in your band if it also has 255 or your padding in it: which labels are classes?")
def unjudged_and_frame_are_a_class(y, width):
    framed = np.pad(np.where(y == 255, 9, y), width, constant_values=9)
    return trimap_band(framed, width)[width:-width, width:-width] & (y != 255)


@wrong("Near the border v - width is negative, and a slice counts such a start from the end of the axis.")
def slices_from_negative_places(y, width):
    out = np.zeros(y.shape, bool)
    for v, u in np.argwhere(y != 255):
        near = y[v - width : v + width + 1, u - width : u + width + 1]
        out[v, u] = np.any((near != y[v, u]) & (near != 255))
    return out


@wrong("255 is no class: such a pixel is not in the band, and it puts no neighbour into the band.")
def unjudged_like_any_class(y, width):
    framed = np.pad(y, width, mode="edge")
    H, W = y.shape
    near = [framed[width + v : width + v + H, width + u : width + u + W] for v, u in square(width)]
    return np.any([n != y for n in near], axis=0)


@wrong(
    "With 255 between them, two classes can be near and not touch: from where does your band grow?",
    over=("every pixel", "pixels of a class"),
)
def grown_from_where_classes_touch(y, width, over):
    band = trimap_band(y, 1)
    for _ in range(width - 1):
        band = banded(np.where(band, 1, 255), 1, square(1), lambda near, _: near == 1)
        band &= (y != 255) | (over == "every pixel")
    return band & (y != 255)


@wrong("Labels go up to 254, and 8 bits with a sign end at 127: what becomes of the label 254?")
def labels_of_8_bits_with_a_sign(y, width):
    return trimap_band(np.where(y > 127, 255, y).astype(np.uint8), width)


@wrong("255 is no class: a pixel that nobody judged is in your band itself.")
def unjudged_in_the_band(y, width):
    return banded(y, width, square(width))


@wrong("One pixel of another class nearby is enough: you ask that all of them are of another.")
def all_of_the_window(y, width):
    H, W = y.shape
    framed = np.pad(y, width, constant_values=255)
    steps = [step for step in square(width) if step != (0, 0)]
    near = [framed[width + v : width + v + H, width + u : width + u + W] for v, u in steps]
    return np.all([(n != y) & (n != 255) for n in near], axis=0) & (y != 255)


@wrong("Beyond the border there is no class, not class 0; and a pixel of 255 is never in the band itself.")
def border_and_unjudged_in_the_band(y, width):
    H, W = y.shape
    framed = np.pad(y, width)
    near = [framed[width + v : width + v + H, width + u : width + u + W] for v, u in square(width)]
    return np.any([(n != y) & (n != 255) for n in near], axis=0)


@wrong("Near the border you leave all pixels out: a window that ends at the image's border still has its other pixels.")
def border_left_out(y, width):
    whole = np.zeros(y.shape, bool)
    whole[width : y.shape[0] - width, width : y.shape[1] - width] = True
    return trimap_band(y, width) & whole


@wrong("Your window reaches along one axis alone: edges lie across rows and across columns.", axis=(0, 1))
def along_one_axis(y, width, axis):
    return banded(y, width, [step for step in square(width) if step[1 - axis] == 0]) & (y != 255)
