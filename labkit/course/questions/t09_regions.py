"""Questions of topic 09 about colours and regions (sections 8 and 10 of the text)."""

import numpy as np

from labkit.course.questions import answers_09_regions as answers
from labkit.course.questions.question import Misconception, Property, Question

# -------------------------------------------------------------------------------------------------------- hsv_mask


def hsv_mask(hsv, lower, upper):
    """Mark the pixels within the bounds, both included; a lower hue above the upper one goes round through red."""
    h, rest = hsv[..., 0], (hsv[..., 1:] >= lower[1:]) & (hsv[..., 1:] <= upper[1:])
    above, below = h >= lower[0], h <= upper[0]
    hue = above & below if lower[0] <= upper[0] else above | below
    return hue & rest.all(axis=-1)


def _colours_and_bounds(rng):
    hsv = np.stack([rng.integers(0, n, (7, 12)) for n in (180, 256, 256)], axis=-1).astype(np.uint8)
    ends = np.sort(rng.integers((0, 10, 10), (180, 246, 246), (2, 3)), axis=0)
    ends[1, 1:] = np.maximum(ends[1, 1:], ends[0, 1:] + 60).clip(max=255)
    lower, upper = ends
    if rng.random() < 0.5:
        lower[0], upper[0] = max(upper[0], lower[0] + 1), lower[0]
    hsv[0, :3], hsv[1, :3] = lower, upper  # pixels on the bounds
    hsv[0, 1, 1:], hsv[1, 1, 1:] = upper[1:], lower[1:]
    return hsv, lower.astype(np.uint8), upper.astype(np.uint8)


def _pixels(*pixels):
    return np.array([pixels], np.uint8)


HSV_MASK = Question(
    name="09_other_stacks.hsv_mask",
    reference=hsv_mask,
    inputs=_colours_and_bounds,
    by_hand=(
        (
            _pixels((5, 50, 50), (20, 255, 255), (4, 90, 90), (12, 49, 90), (12, 90, 49), (21, 90, 90)),
            np.array([5, 50, 50], np.uint8),
            np.array([20, 255, 255], np.uint8),
        ),
        (
            _pixels((175, 90, 90), (3, 90, 90), (170, 60, 70), (10, 200, 210), (90, 90, 90), (175, 59, 90)),
            np.array([170, 60, 70], np.uint8),
            np.array([10, 200, 210], np.uint8),
        ),
        (
            _pixels((30, 100, 100), (29, 100, 100), (31, 100, 100), (30, 101, 100), (30, 100, 99)),
            np.array([30, 100, 100], np.uint8),
            np.array([30, 100, 100], np.uint8),
        ),
    ),
    random_cases=8,
    rtol=0.0,
    atol=0.0,
    points=2,
    misconceptions=(
        Misconception(
            "never round",
            answers.mask_without_going_round,
            "Try red, from 170 to 10: can any hue be above the one and below the other?",
        ),
        Misconception("any channel", answers.mask_of_any_channel, "A pixel is inside only if all three channels are."),
        Misconception(
            "bounds left out", answers.mask_without_bounds, "A pixel that equals a bound is inside, as in OpenCV."
        ),
        Misconception(
            "bounds sorted",
            answers.mask_with_swapped_bounds,
            "Sorting the hues turns red into everything but red: which way round does the circle go?",
        ),
        Misconception("hue alone", answers.mask_of_hue, "Grey pixels have a hue too, any one: what excludes them?"),
        Misconception(
            "hue in degrees", answers.mask_in_degrees, "OpenCV's hue goes to 179: the bounds are in the same unit."
        ),
        Misconception(
            "always round", answers.mask_always_round, "From 5 to 20 nearly every hue is in yours: when is it `or`?"
        ),
    ),
    alternatives=(answers.mask_loops, answers.mask_modulo, answers.mask_by_table, answers.mask_torch),
    forbidden=("cv2",),
)


# -------------------------------------------------------------------------------------------------- measure_pieces


def measure_pieces(pieces):
    """Measure pieces 1 to n: areas (n,), centroids u, v (n, 2), boxes u0, v0, u1, v1 (n, 4), ends included."""
    area, centroid, box = [], [], []
    for i in range(1, pieces.max() + 1):
        v, u = np.nonzero(pieces == i)
        area.append(u.size)
        centroid.append((u.mean(), v.mean()))
        box.append((u.min(), v.min(), u.max(), v.max()))
    return np.array(area), np.array(centroid), np.array(box)


def _pieces(rng):
    H, W, n = int(rng.integers(9, 12)), int(rng.integers(14, 19)), int(rng.integers(3, 6))
    pieces = rng.integers(0, n + 1, (H, W))
    pieces = np.where(rng.random((H, W)) < 0.7, 0, pieces)
    for i in range(1, n + 1):  # no number goes without a pixel; and pieces of very different sizes
        v, u = rng.integers(0, H - 3), rng.integers(0, W - 5)
        pieces[v : v + int(rng.integers(1, 4)), u : u + int(rng.integers(1, 6))] = i
    return (np.unique(pieces, return_inverse=True)[1].reshape(H, W).astype(np.int32),)


MEASURE_PIECES = Question(
    name="09_other_stacks.measure_pieces",
    reference=measure_pieces,
    inputs=_pieces,
    by_hand=(
        (np.array([[0, 1, 1, 1], [0, 0, 0, 1], [2, 0, 0, 0]], np.int32),),
        (np.array([[1, 1, 2, 2, 2]], np.int32),),
    ),
    points=3,
    properties=(
        Property(
            "the areas add up to the pixels that belong to a piece",
            lambda arguments, output: int(np.sum(output[0])) == int(np.count_nonzero(arguments[0])),
        ),
    ),
    misconceptions=(
        Misconception(
            "row before column",
            answers.measured_rows_first,
            "np.nonzero gives rows first: which of them is u?",
        ),
        Misconception(
            "boxes that end outside",
            answers.measured_with_open_boxes,
            "The last column and row of a box still belong to the piece here.",
        ),
        Misconception(
            "the background measured too", answers.measured_with_the_background, "0 is no piece: with which is row 0?"
        ),
        Misconception(
            "centre of the box",
            answers.measured_by_boxes,
            "The middle of an L-shaped piece is not that of its box.",
        ),
        Misconception(
            "area of the box", answers.measured_box_areas, "Count the piece's own pixels: a box holds others too."
        ),
        Misconception(
            "width and height instead of ends",
            answers.measured_widths,
            "The box is (u0, v0, u1, v1): first and last, not first and how many.",
        ),
    ),
    alternatives=(answers.measured_loops, answers.measured_bincount, answers.measured_einsum),
    forbidden=("cv2", "scipy", "skimage"),
)


# --------------------------------------------------------------------------------------------------- choose_region


def choose_region(features, mean, covariance, allowed):
    """Number, from 1, of the allowed piece with the least Mahalanobis distance to the mean; 0 if none is allowed."""
    off = features - mean
    squared = (off @ np.linalg.inv(covariance) * off).sum(axis=1)
    squared[~allowed] = np.inf
    return squared.argmin() + 1 if allowed.any() else 0


def _features(rng):
    n = int(rng.integers(5, 9))
    A = rng.normal(size=(3, 3)) * (3.0, 0.4, 1.0)
    covariance = A.T @ A + np.diag((0.3, 0.02, 0.1))
    mean = rng.normal(size=3) * (4.0, 1.0, 2.0)
    features = mean + rng.normal(size=(n, 3)) * (2.0, 1.0, 1.5)
    allowed = rng.random(n) < 0.7
    allowed[rng.integers(n)] = True
    return features, mean, covariance, allowed


_LINE = np.array([[2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.9, 1.9, 0.0]])
_TILTED = np.array([[1.0, 0.9, 0.0], [0.9, 1.0, 0.0], [0.0, 0.0, 1.0]])

CHOOSE_REGION = Question(
    name="09_other_stacks.choose_region",
    reference=choose_region,
    inputs=_features,
    by_hand=(
        (_LINE, np.zeros(3), np.eye(3), np.array([True, True, True])),
        (_LINE, np.zeros(3), np.diag([9.0, 0.1, 1.0]), np.array([True, True, True])),
        (_LINE, np.zeros(3), _TILTED, np.array([True, True, True])),
        (_LINE, np.zeros(3), np.eye(3), np.array([True, False, True])),
        (_LINE, np.zeros(3), np.eye(3), np.array([False, False, False])),
        (_LINE + 1.0, np.ones(3), np.eye(3), np.array([False, False, True])),
    ),
    random_cases=12,
    rtol=0.0,
    atol=0.0,
    points=3,
    properties=(
        Property(
            "the number is that of an allowed piece, or 0",
            lambda arguments, number: bool(number == 0 or arguments[3][int(number) - 1]),
        ),
    ),
    misconceptions=(
        Misconception(
            "Euclidean distance",
            answers.chosen_euclidean,
            "A difference of 1 in area and one of 1 in shape are not equally unusual: who knows how much each varies?",
        ),
        Misconception(
            "each feature for itself",
            answers.chosen_by_spread,
            "Your distance does not know that two features go together: what stands off the diagonal?",
        ),
        Misconception(
            "covariance not inverted",
            answers.chosen_without_inverse,
            "What varies much should count little: yours weighs it most.",
        ),
        Misconception("the unlikeliest", answers.chosen_unlikeliest, "A typical piece is near the mean, not far off."),
        Misconception("numbers from 0", answers.chosen_from_0, "Pieces count from 1; 0 says that there is none."),
        Misconception(
            "forbidden pieces too", answers.chosen_although_forbidden, "A piece at the image's edge may not be chosen."
        ),
        Misconception(
            "number among the allowed",
            answers.chosen_among_the_allowed,
            "After features[allowed] the rows have new numbers: which ones does the image of pieces know?",
        ),
        Misconception(
            "never none", answers.chosen_always, "If no piece is allowed, the answer is 0: what is argmin of all inf?"
        ),
    ),
    alternatives=(
        answers.chosen_loops,
        answers.chosen_einsum,
        answers.chosen_whitened,
        answers.chosen_torch,
    ),
    forbidden=("scipy", "sklearn"),
)
