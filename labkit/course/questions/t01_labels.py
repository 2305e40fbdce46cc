"""Questions of topic 01: labels from a renderer's mask, one-hot tensors, shares of the classes, resizing.

Section 1 of the text.
"""

import numpy as np

from labkit.course.questions import answers_01 as answers
from labkit.course.questions.question import Misconception, Property, Question

# ------------------------------------------------------------------------------------------ a renderer's mask


def labels_from_segmentation(segmentation, class_of_body):
    """Turn PyBullet's raw mask, body + ((link + 1) << 24) or -1 for nothing, into labels; nothing is class 0."""
    labels = np.zeros(segmentation.shape, np.uint8)
    seen = segmentation >= 0
    labels[seen] = class_of_body[segmentation[seen] & 0xFFFFFF]
    return labels


def _raw_mask(rng):
    """Draw bodies with links -1 to 11, and nothing in a fifth of the pixels; the first and last body have a class."""
    bodies = int(rng.integers(5, 9))
    class_of_body = rng.permutation(np.arange(bodies) % 4).astype(np.uint8)
    class_of_body[[0, -1]] = rng.integers(1, 4, 2)
    shape = (int(rng.integers(6, 9)), int(rng.integers(10, 14)))
    body, link = rng.integers(0, bodies, shape), rng.integers(-1, 12, shape)
    raw = body + ((link + 1) << 24)
    raw[rng.random(shape) < 0.2] = -1
    return raw.astype(np.int32), class_of_body


LABELS_FROM_SEGMENTATION = Question(
    name="01_labels.labels_from_segmentation",
    reference=labels_from_segmentation,
    inputs=_raw_mask,
    by_hand=(
        (np.array([[-1, 0, 1], [2, 1 + (1 << 24), 2 + (3 << 24)]], np.int32), np.array([1, 3, 2], np.uint8)),
        (np.array([[5 << 24, 3 + (12 << 24)]], np.int32), np.array([2, 0, 0, 1], np.uint8)),
    ),
    rtol=0.0,
    atol=0.0,
    points=2,
    properties=(
        Property(
            "where nothing is seen (-1), the label is 0",
            lambda arguments, labels: not np.any(labels[arguments[0] == -1]),
        ),
    ),
    misconceptions=(
        Misconception(
            "links forgotten",
            answers.base_links_only,
            "The robot has holes: values in the millions are body + ((link + 1) << 24). How do you get the body back?",
        ),
        Misconception(
            "nothing taken for the last body",
            answers.nothing_is_the_last_body,
            "Where nothing is seen stands -1, and in NumPy the index -1 means the last entry.",
        ),
        Misconception(
            "link taken for the body",
            answers.link_for_body,
            "You keep the upper bits, which are the link: which bits hold the body?",
        ),
        Misconception(
            "body number for class",
            answers.body_for_class,
            "These are body numbers: one more step leads to the class, and class_of_body knows it.",
        ),
        Misconception(
            "body numbers counted from 1",
            answers.one_body_further,
            "Bodies are counted from 0: which class has body 0 in your answer?",
        ),
        Misconception(
            "nothing is ignored",
            answers.nothing_is_ignored,
            "255 means that nobody judged a pixel; here the renderer is sure that nothing is there: background.",
        ),
    ),
    alternatives=(answers.labels_modulo, answers.labels_loops, answers.labels_by_body, answers.labels_torch),
    forbidden=("pybullet",),
)

# ------------------------------------------------------------------------------------------ one-hot and back


def one_hot(y, C):
    """Turn labels into a one-hot tensor, one more axis of length C; a pixel that is ignored (255) is all zeros."""
    return (y[..., None] == np.arange(C)).astype(np.uint8)


def _labels(rng, C):
    """Draw unequal classes, the last but one absent, and some ignored pixels."""
    shares = rng.dirichlet(np.full(C, 2.0))
    shares[C - 2] = 0.0
    y = rng.choice(C, size=(int(rng.integers(6, 9)), int(rng.integers(10, 14))), p=shares / shares.sum())
    y[rng.random(y.shape) < 0.15] = 255
    y[0, 0], y[1, 2] = C - 1, 255
    return y.astype(np.uint8)


def _labels_and_classes(rng):
    C = int(rng.choice([4, 5, 7]))
    return _labels(rng, C), C


ONE_HOT = Question(
    name="01_labels.one_hot",
    reference=one_hot,
    inputs=_labels_and_classes,
    by_hand=((np.array([[0, 2]], np.uint8), 3), (np.array([[1, 255], [0, 3], [2, 2]], np.uint8), 5)),
    rtol=0.0,
    atol=0.0,
    points=2,
    properties=(
        Property(
            "over the last axis it sums to 1, and to 0 where the pixel is ignored",
            lambda arguments, Y: np.array_equal(np.sum(Y, axis=-1), arguments[0] != 255),
        ),
    ),
    misconceptions=(
        Misconception("classes first", answers.classes_first, "The class comes last here: the shape is (H, W, C)."),
        Misconception(
            "ignored is background",
            answers.ignored_as_background,
            "A pixel that is ignored has no class, not even 0: what should its C entries be?",
        ),
        Misconception(
            "ignored is the last class",
            answers.ignored_as_last_class,
            "255 was pressed into the range of classes: what should the C entries of such a pixel be?",
        ),
        Misconception(
            "ignored is every class",
            answers.ignored_as_every_class,
            "A pixel that is ignored belongs to no class rather than to all: it must add nothing to any sum.",
        ),
        Misconception("classes counted from 1", answers.counted_from_one, "In which plane do you find class 0?"),
        Misconception(
            "only the classes that occur",
            answers.classes_that_occur,
            "A class that is not in this image has a plane too, of zeros: there are always C of them.",
        ),
    ),
    alternatives=(answers.one_hot_eye, answers.one_hot_loops, answers.one_hot_planes, answers.one_hot_torch),
    forbidden=("sklearn",),
)


def from_one_hot(Y):
    """Turn a one-hot tensor back into labels; all zeros become 255."""
    return np.where(Y.any(axis=-1), Y.argmax(axis=-1), 255)


FROM_ONE_HOT = Question(
    name="01_labels.from_one_hot",
    reference=from_one_hot,
    inputs=lambda rng: (one_hot(*_labels_and_classes(rng)),),
    by_hand=(
        (np.array([[[1, 0], [0, 1], [0, 0]]], np.uint8),),
        (np.array([[[0, 0, 1], [1, 0, 0]], [[0, 0, 0], [0, 1, 0]], [[0, 1, 0], [0, 0, 1]]], np.uint8),),
    ),
    rtol=0.0,
    atol=0.0,
    points=2,
    misconceptions=(
        Misconception(
            "ignored becomes 0",
            answers.ignored_as_class(0),
            "argmax of a row of zeros is 0: how do you tell such a pixel from background?",
        ),
        Misconception(
            "ignored becomes -1", answers.ignored_as_class(-1), "Pixels without a class are 255 here; -1 is no uint8."
        ),
        Misconception(
            "the wrong axis", answers.along_the_columns, "Over which axis of (H, W, C) is there exactly one 1?"
        ),
        Misconception("classes counted from 1", answers.numbered_from_one, "Which number has the first plane?"),
        Misconception("position of a 0", answers.first_zero, "You look for the smallest entry: where is the 1?"),
    ),
    alternatives=(
        answers.from_one_hot_sum,
        answers.from_one_hot_loops,
        answers.from_one_hot_einsum,
        answers.from_one_hot_torch,
    ),
)

# ------------------------------------------------------------------------------------------ shares


def class_shares(y, C):
    """Give the share of each class among the pixels that are not ignored (255)."""
    judged = y[y != 255]
    return np.bincount(judged, minlength=C) / judged.size


CLASS_SHARES = Question(
    name="01_labels.class_shares",
    reference=class_shares,
    inputs=_labels_and_classes,
    by_hand=((np.array([[1, 1], [0, 3]], np.uint8), 5), (np.array([[1, 255, 255], [1, 1, 0]], np.uint8), 3)),
    points=1,
    properties=(Property("the shares add up to 1", lambda arguments, shares: np.isclose(np.sum(shares), 1.0)),),
    misconceptions=(
        Misconception(
            "of all pixels", answers.of_all_pixels, "Your shares do not add up to 1: who of the pixels was not judged?"
        ),
        Misconception("counts", answers.counts, "These are numbers of pixels; a share lies between 0 and 1."),
        Misconception(
            "only the classes that occur",
            answers.only_what_occurs,
            "A class without pixels has a share as well, 0: the result has always C entries.",
        ),
        Misconception(
            "without background", answers.without_background, "Background (class 0) is a class like the others here."
        ),
        Misconception(
            "the rows' shares averaged",
            answers.mean_of_rows,
            "Some rows have fewer judged pixels than others: count over the whole image, divide once.",
        ),
        Misconception(
            "turned over",
            answers.inverse_shares,
            "That is one over the share (a weight, topic 05): rare is small here.",
        ),
    ),
    alternatives=(answers.shares_loops, answers.shares_one_hot, answers.shares_float32, answers.shares_torch),
)

# ------------------------------------------------------------------------------------------ resizing


def resize_labels(y, height, width):
    """Resize a label image without inventing labels: each new pixel copies the old one in which its centre falls."""
    H, W = y.shape
    rows = ((np.arange(height) + 0.5) * H / height).astype(int)
    columns = ((np.arange(width) + 0.5) * W / width).astype(int)
    return y[rows[:, None], columns]


def _labels_and_size(rng):
    """Draw labels, and a size that is larger in one direction and smaller in the other, or larger in both.

    The old sides are odd: then no new centre falls between two old pixels, where rounding would decide.
    """
    y = _labels(rng, 4)
    y = y[: y.shape[0] // 2 * 2 - 1, : y.shape[1] // 2 * 2 - 1]
    H, W = y.shape
    height, width = (int(rng.integers(3, H)), int(rng.integers(W + 3, 2 * W)))
    return (y, height, width) if rng.random() < 0.5 else (y, int(rng.integers(H + 2, 3 * H)), width)


RESIZE_LABELS = Question(
    name="01_labels.resize_labels",
    reference=resize_labels,
    inputs=_labels_and_size,
    by_hand=(
        (np.array([[1, 3]], np.uint8), 1, 4),
        (np.array([[0, 1, 2, 3, 1], [3, 255, 1, 0, 2], [0, 0, 2, 1, 3]], np.uint8), 2, 3),
        (np.array([[0, 1, 2], [3, 2, 1], [255, 0, 3]], np.uint8), 5, 2),
    ),
    rtol=0.0,
    atol=0.0,
    points=3,
    properties=(
        Property(
            "no label is there that was not there before",
            lambda arguments, y: set(np.unique(y).tolist()) <= set(np.unique(arguments[0]).tolist()),
        ),
    ),
    misconceptions=(
        Misconception(
            "bilinear",
            answers.bilinear,
            "np.unique before and after? The mean of classes 1 and 3 is no class 2: labels cannot be averaged.",
        ),
        Misconception(
            "from the corner",
            answers.from_the_corner,
            "All is shifted by up to half a pixel: take the old pixel under the new pixel's centre, not its corner.",
        ),
        Misconception(
            "corner to corner",
            answers.corner_to_corner,
            "You lay the first and last centres on each other; here the images' edges lie on each other.",
        ),
        Misconception(
            "height and width swapped", answers.sides_swapped, "The first axis of an image is its height: check both."
        ),
        Misconception(
            "refilled",
            answers.refilled,
            "np.resize repeats the numbers row after row: is your image still the same scene?",
        ),
        Misconception(
            "padded or cropped",
            answers.padded_or_cropped,
            "The whole scene should be in the new image, in another size.",
        ),
    ),
    alternatives=(answers.resize_integers, answers.resize_loops, answers.resize_take, answers.resize_torch),
    forbidden=("cv2", "PIL", "skimage"),
)

QUESTIONS = (LABELS_FROM_SEGMENTATION, ONE_HOT, FROM_ONE_HOT, CLASS_SHARES, RESIZE_LABELS)
