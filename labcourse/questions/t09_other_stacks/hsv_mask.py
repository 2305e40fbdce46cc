"""09_other_stacks.hsv_mask: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labcourse.kinds import LONG, array, image
from labgrader.question import Question, wrong


def hsv_mask(hsv, lower, upper):
    """Mark the pixels within the bounds, both included; a lower hue above the upper one goes round through red."""
    h, rest = hsv[..., 0], (hsv[..., 1:] >= lower[1:]) & (hsv[..., 1:] <= upper[1:])
    above, below = h >= lower[0], h <= upper[0]
    hue = above & below if lower[0] <= upper[0] else above | below
    return hue & rest.all(axis=-1)


def hue_up_to_179(rng, hsv):
    """Bytes (..., 3) whose first is one of 180 hues."""
    return np.concatenate([hsv[..., :1] % 180, hsv[..., 1:]], axis=-1)


def _colours_and_bounds(rng):
    """Draw colours, and bounds that some of them equal; the hue goes round in half of the draws."""
    hsv = np.stack([rng.integers(0, n, (7, 12)) for n in (180, 256, 256)], axis=-1).astype(np.uint8)
    ends = np.sort(rng.integers((0, 10, 10), (180, 246, 246), (2, 3)), axis=0)
    ends[1, 1:] = np.maximum(ends[1, 1:], ends[0, 1:] + 60).clip(max=255)
    lower, upper = ends
    if rng.random() < 0.5:
        lower[0], upper[0] = max(upper[0], lower[0] + 1), lower[0]
    if rng.random() < 0.3:  # one hue
        upper[0] = lower[0]
    if rng.random() < 0.25:  # no saturation
        lower[1], upper[1] = upper[1], lower[1]
    hsv[0, :3], hsv[1, :3] = lower, upper  # pixels on the bounds
    hsv[0, 1, 1:], hsv[1, 1, 1:] = upper[1:], lower[1:]
    return hsv, lower.astype(np.uint8), upper.astype(np.uint8)


def _pixels(*pixels):
    return np.array([pixels], np.uint8)


def _all_hues(shape):
    """A picture of one row or column: 180 hues, and any saturation and value."""
    k = np.arange(LONG)
    return np.stack([k % 180, (77 * k) % 256, k % 101], axis=1).astype(np.uint8).reshape(*shape, 3)


_LONG = ((1, LONG), (LONG, 1))


QUESTION = Question(
    reference=hsv_mask,
    kinds={
        "hsv": image(form=hue_up_to_179, says="hue 0..179, saturation and value 0..255"),
        "lower": array("3", 0, 255, dtype="uint8", form=hue_up_to_179, says="uint8"),
        "upper": array("3", 0, 255, dtype="uint8", form=hue_up_to_179, says="uint8"),
    },
    inputs=_colours_and_bounds,
    by_hand=(
        (
            _pixels((5, 50, 50), (20, 255, 255), (4, 90, 90), (12, 49, 90), (12, 90, 49), (21, 90, 90)),
            np.array([5, 50, 50], np.uint8),
            np.array([20, 255, 255], np.uint8),
        ),
        (
            _pixels(
                *((175, 90, 90), (3, 90, 90), (170, 60, 70), (10, 200, 210), (90, 90, 90), (175, 59, 90)),
                *((179, 90, 90), (0, 90, 90)),  # the last hue and the first
            ),
            np.array([170, 60, 70], np.uint8),
            np.array([10, 200, 210], np.uint8),
        ),
        (
            _pixels((30, 100, 100), (29, 100, 100), (31, 100, 100), (30, 101, 100), (30, 100, 99)),
            np.array([30, 100, 100], np.uint8),
            np.array([30, 100, 100], np.uint8),
        ),
        (
            _pixels((10, 250, 90), (10, 50, 90), (10, 150, 90)),  # only the hue goes round
            np.array([5, 200, 50], np.uint8),
            np.array([20, 100, 255], np.uint8),
        ),
        (
            _pixels((175, 90, 90), (3, 90, 90), (90, 90, 90)),
            np.array([170, 50, 50], np.uint8),
            np.array([10, 255, 255], np.uint8),
        ),
        (
            _pixels((10, 255, 255), (10, 240, 255), (10, 255, 100), (0, 255, 255)).reshape(2, 2, 3),
            np.array([5, 255, 0], np.uint8),
            np.array([20, 255, 255], np.uint8),
        ),
        (
            _pixels((0, 90, 0), (0, 90, 9), (90, 90, 0), (0, 255, 0)).reshape(2, 2, 3),
            np.array([0, 50, 0], np.uint8),
            np.array([0, 255, 0], np.uint8),
        ),
        *((_all_hues(shape), np.array([160, 0, 9], np.uint8), np.array([20, 255, 99], np.uint8)) for shape in _LONG),
    ),
    edges=5,
    random_cases=24,
    forbidden=("cv2",),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def between(hsv, lower, upper):
    return (hsv >= np.asarray(lower)) & (hsv <= np.asarray(upper))


def inside(hsv, lower, upper):
    """Which channels of which pixels are right, (H, W, 3)."""
    found = between(hsv, lower, upper)
    if lower[0] > upper[0]:
        found[..., 0] = (hsv[..., 0] >= lower[0]) | (hsv[..., 0] <= upper[0])
    return found


@wrong("Try red, from 170 to 10: can any hue be above one and below the other?")
def mask_without_going_round(hsv, lower, upper):
    return between(hsv, lower, upper).all(axis=-1)


@wrong("A pixel that equals a bound is inside, as in OpenCV.")
def mask_without_bounds(hsv, lower, upper):
    h, rest = hsv[..., 0], (hsv[..., 1:] > lower[1:]) & (hsv[..., 1:] < upper[1:])
    hue = (h > lower[0]) & (h < upper[0]) if lower[0] <= upper[0] else (h > lower[0]) | (h < upper[0])
    return hue & rest.all(axis=-1)


@wrong("Sorting the hues turns red into everything but red: which way round does the circle go?")
def mask_with_swapped_bounds(hsv, lower, upper):
    h, (low, high) = hsv[..., 0], sorted((lower[0], upper[0]))
    return (h >= low) & (h <= high) & between(hsv, lower, upper)[..., 1:].all(axis=-1)


@wrong("Grey pixels have a hue, too, which can be any number. Which bounds keep them out?")
def mask_of_hue(hsv, lower, upper):
    return inside(hsv, lower, upper)[..., 0]


@wrong("OpenCV's hue goes to 179: the bounds are in the same unit.")
def mask_in_degrees(hsv, lower, upper):
    doubled = hsv.astype(int) * (2, 1, 1)
    return hsv_mask(doubled, lower, upper)


@wrong("With a range from 5 to 20 you mark nearly every hue. When is `or` right?")
def mask_always_round(hsv, lower, upper):
    h = hsv[..., 0]
    return ((h >= lower[0]) | (h <= upper[0])) & between(hsv, lower, upper)[..., 1:].all(axis=-1)


@wrong("Only the hue wraps around: a saturation from 200 to 100 contains nothing.")
def all_three_go_round(hsv, lower, upper):
    above, below = hsv >= lower, hsv <= upper
    return np.where(lower > upper, above | below, above & below).all(axis=-1)


@wrong("Only the hue is a circle of 180 steps: saturation and value are bytes, from 0 to 255.")
def all_three_on_a_circle(hsv, lower, upper):
    low, high = lower.astype(int), upper.astype(int)
    return ((hsv.astype(int) - low) % 180 <= (high - low) % 180).all(axis=-1)


@wrong("Where the hue wraps around, your mask is one of hues alone: what has become of saturation and value?")
def hue_alone_where_it_goes_round(hsv, lower, upper):
    return inside(hsv, lower, upper)[..., 0] if lower[0] > upper[0] else hsv_mask(hsv, lower, upper)


@wrong("When the hue wraps around, saturation and value do not: `or` is for the hue alone.")
def all_three_go_with_the_hue(hsv, lower, upper):
    above, below = hsv >= lower, hsv <= upper
    return (above | below if lower[0] > upper[0] else above & below).all(axis=-1)


@wrong("Saturation and value have an upper bound, too.")
def mask_without_upper_bounds(hsv, lower, upper):
    return hsv_mask(hsv, lower, np.array([upper[0], 255, 255]))


@wrong("Sorting the hues turns red into everything but red: which way round does the circle go?")
def all_three_bounds_sorted(hsv, lower, upper):
    return between(hsv, np.minimum(lower, upper), np.maximum(lower, upper)).all(axis=-1)


@wrong("If both bounds are the same hue, only that hue is inside: do you use `>` or `>=`?")
def one_hue_goes_round(hsv, lower, upper):
    h, rest = hsv[..., 0], between(hsv, lower, upper)[..., 1:].all(axis=-1)
    above, below = h >= lower[0], h <= upper[0]
    return (above | below if lower[0] >= upper[0] else above & below) & rest


@wrong("Python reads & before |, as it reads * before +: which hues does your & belong to?")
def or_after_and(hsv, lower, upper):
    h, rest = hsv[..., 0], between(hsv, lower, upper)[..., 1:].all(axis=-1)
    above, below = h >= lower[0], h <= upper[0]
    return above | below & rest if lower[0] > upper[0] else above & below & rest


@wrong("There are three channels: for which of them do you test no bounds?")
def value_forgotten(hsv, lower, upper):
    return hsv_mask(hsv, np.array([*lower[:2], 0]), np.array([*upper[:2], 255]))


@wrong("A mask has a truth value per pixel, (H, W): which axis holds hue, saturation and value?")
def all_along_the_rows(hsv, lower, upper):
    return inside(hsv, lower, upper).all(axis=0)


@wrong("Where the hue wraps around, one that equals a bound is inside, too: do you leave the bounds out there?")
def not_between_the_bounds(hsv, lower, upper):
    h, rest = hsv[..., 0], between(hsv, lower, upper)[..., 1:].all(axis=-1)
    above, below = h >= lower[0], h <= upper[0]
    return (above & below if lower[0] <= upper[0] else ~((h >= upper[0]) & (h <= lower[0]))) & rest


@wrong(
    "170 to 10 is no range from 170 to 190 in your picture: a hue begins again at 0. Which hues are inside from 0 on?",
    kind=(int, np.uint8),
)
def upper_hue_beyond_the_circle(hsv, lower, upper, kind):
    h, rest = hsv[..., 0], between(hsv, lower, upper)[..., 1:].all(axis=-1)
    with np.errstate(over="ignore"):
        above = upper[0].astype(kind) + kind(180) if lower[0] > upper[0] else upper[0]
    return (h >= lower[0]) & (h <= above) & rest


@wrong("You move a bound by 180, from 170 to -10. A hue of 175 does not move: is it inside your bounds?")
def lower_hue_below_0(hsv, lower, upper):
    h, rest = hsv[..., 0], between(hsv, lower, upper)[..., 1:].all(axis=-1)
    low = int(lower[0]) - 180 * (lower[0] > upper[0])
    return (h >= low) & (h <= upper[0]) & rest


@wrong(
    "Turned by 90, the circle still has an end, at hue 90: and is 170 + 90 a byte? Which ranges go across that end?",
    kind=(int, np.uint8),
)
def circle_turned_by_half(hsv, lower, upper, kind):
    h, (low, high) = hsv[..., 0].astype(int), (kind(lower[0]), kind(upper[0]))
    if low > high:
        with np.errstate(over="ignore"):
            low, high = (low + kind(90)) % 180, (high + kind(90)) % 180
        h = (h + 90) % 180
    return (h >= low) & (h <= high) & between(hsv, lower, upper)[..., 1:].all(axis=-1)


@wrong("From 170 to 10 are 20 steps round the circle, not 160: how far is it from the middle to a bound there?")
def half_width_without_the_circle(hsv, lower, upper):
    low, high = int(lower[0]), int(upper[0])
    middle = ((low + high) / 2 + 90 * (low > high)) % 180
    off = np.abs(hsv[..., 0] - middle)
    near = np.minimum(off, 180 - off) <= abs(high - low) / 2
    return near & between(hsv, lower, upper)[..., 1:].all(axis=-1)


@wrong("A saturation or a value that equals its bound is inside, as in OpenCV: do you use < or <=?")
def strict_but_for_the_hue(hsv, lower, upper):
    hue = inside(hsv, lower, upper)[..., 0]
    return hue & ((hsv[..., 1:] > lower[1:]) & (hsv[..., 1:] < upper[1:])).all(axis=-1)
