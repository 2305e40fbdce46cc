"""Questions of topic 09: blobs, labels and their size (section 7 of the text); t09_regions has those on colours."""

import numpy as np

from labkit.course.questions import answers_09 as answers
from labkit.course.questions.question import Misconception, Property, Question
from labkit.course.questions.t09_regions import CHOOSE_REGION, HSV_MASK, MEASURE_PIECES

# ------------------------------------------------------------------------------------------------------ make_blob


def make_blob(bgr):
    """Turn an OpenCV image, uint8 (H, W, 3) in BGR, into a network's input: RGB in 0..1, float32 (1, 3, H, W)."""
    rgb = bgr[:, :, ::-1]
    return (rgb.transpose(2, 0, 1)[None] / 255.0).astype(np.float32)


def _image(rng):
    H, W = int(rng.integers(4, 9)), int(rng.integers(10, 15))
    return (rng.integers(0, 256, (H, W, 3)).astype(np.uint8),)


MAKE_BLOB = Question(
    name="09_other_stacks.make_blob",
    reference=make_blob,
    inputs=_image,
    by_hand=(
        (np.array([[[255, 0, 51]]], np.uint8),),
        (np.array([[[0, 0, 255], [255, 0, 0]], [[10, 20, 30], [40, 50, 60]], [[1, 2, 3], [4, 5, 6]]], np.uint8),),
    ),
    rtol=1e-6,
    atol=1e-7,
    points=2,
    properties=(
        Property("values lie in 0..1", lambda arguments, blob: bool(np.min(blob) >= 0.0 and np.max(blob) <= 1.0)),
    ),
    misconceptions=(
        Misconception("still BGR", answers.blob_still_bgr, "Put in one pure red pixel: which plane lights up?"),
        Misconception(
            "not scaled", answers.blob_in_bytes, "The network was trained on 0..1: what is the largest value of yours?"
        ),
        Misconception(
            "reshaped instead of transposed",
            answers.blob_reshaped,
            "The shape is right and the pixels are not: reshape keeps the order in memory, which axis should move?",
        ),
        Misconception(
            "rows and columns mixed",
            answers.blob_rows_for_columns,
            "Make an image with one bright row: is it a row in your planes?",
        ),
        Misconception(
            "mirrored", answers.blob_mirrored, "Which axis did you turn round, the channels' or the columns'?"
        ),
        Misconception(
            "scaled to -1..1",
            answers.blob_from_minus_one,
            "Black must become 0 here; not every network wants -1.",
        ),
        Misconception("divided by 256", answers.blob_of_256, "White must become exactly 1: what is white's byte?"),
    ),
    alternatives=(answers.blob_loops, answers.blob_stacked, answers.blob_torch, answers.blob_einsum),
    forbidden=("cv2",),
)


# ------------------------------------------------------------------------------------------------ labels_from_blob


def labels_from_blob(scores):
    """Label each pixel with its best class, the first of equals: scores (1, C, H, W) -> (H, W)."""
    return scores[0].argmax(axis=0)


def _scores(rng):
    C, H, W = (int(rng.integers(low, low + 3)) for low in (3, 5, 8))
    z = rng.normal(size=(1, C, H, W))
    return (np.round(z, 0 if rng.random() < 0.5 else 3).astype(np.float32) - np.float32(rng.integers(0, 3)),)


LABELS_FROM_BLOB = Question(
    name="09_other_stacks.labels_from_blob",
    reference=labels_from_blob,
    inputs=_scores,
    by_hand=(
        (np.array([[[[1, 0, 0], [9, 9, 0]], [[0, 5, 0], [2, 3, 8]]]], np.float32),),
        (np.zeros((1, 3, 2, 4), np.float32),),
        (np.array([[[[-3.0, -1.0]], [[-2.0, -5.0]], [[-9.0, -1.0]]]], np.float32),),
    ),
    random_cases=6,
    rtol=0.0,
    atol=0.0,
    points=2,
    properties=(
        Property(
            "every label is one of the classes",
            lambda arguments, labels: bool(np.isin(labels, np.arange(arguments[0].shape[1])).all()),
        ),
    ),
    misconceptions=(
        Misconception(
            "read as NHWC",
            answers.labels_as_nhwc,
            "The text's C++ listing does this: how far apart in memory are two classes of one pixel?",
        ),
        Misconception(
            "rows and columns mixed",
            answers.labels_column_by_column,
            "Let class 1 win in one row only: do you get a row?",
        ),
        Misconception("last of equals", answers.last_of_equals, "Where all scores are equal, the first class wins."),
        Misconception("worst class", answers.worst_class, "Is a score good when it is large, or when it is small?"),
        Misconception("class 0 left out", answers.without_class_0, "Background is a class like any other."),
        Misconception("scores, not classes", answers.best_scores, "Not how good the best score is, but whose it is."),
        Misconception("classes from 1", answers.classes_from_1, "The first class has number 0 in the kit."),
        Misconception(
            "negative scores are background",
            answers.above_zero,
            "Logits have no zero: only the differences within a pixel count.",
        ),
    ),
    alternatives=(
        answers.labels_loops,
        answers.labels_in_memory,
        answers.labels_channels_last,
        answers.labels_torch,
    ),
)


# --------------------------------------------------------------------------------------------------------- enlarge


def enlarge(labels, size):
    """Resize labels (h, w) to size = (W, H) by the nearest pixel: new (v, u) shows old (v h // H, u w // W)."""
    W, H = size
    h, w = labels.shape
    rows, columns = np.arange(H) * h // H, np.arange(W) * w // W
    return labels[rows[:, None], columns]


def _labels_and_size(rng):
    labels = rng.integers(0, 4, (int(rng.integers(5, 8)), int(rng.integers(9, 12)))).astype(np.uint8)
    W, H = int(rng.integers(12, 30)), int(rng.integers(8, 19))
    return labels, (W, H)


ENLARGE = Question(
    name="09_other_stacks.enlarge",
    reference=enlarge,
    inputs=_labels_and_size,
    by_hand=(
        (np.array([[0, 2], [1, 3]], np.uint8), (6, 4)),
        (np.array([[0, 3, 0], [2, 0, 1]], np.uint8), (4, 5)),
        (np.array([[1, 2, 3, 0]], np.uint8), (2, 3)),
    ),
    random_cases=6,
    rtol=0.0,
    atol=0.0,
    points=2,
    properties=(
        Property(
            "no class appears that was not there",
            lambda arguments, out: bool(np.isin(out, arguments[0]).all()),
        ),
    ),
    misconceptions=(
        Misconception(
            "width and height swapped", answers.resize_swapped, "OpenCV's size is (width, height), a shape is not."
        ),
        Misconception(
            "bilinear", answers.resize_bilinear, "np.unique before and after: is the mean of class 0 and 2 a class 1?"
        ),
        Misconception(
            "rounded",
            answers.resize_rounded,
            "From 2 to 4 pixels, each old one should appear twice: which ones do yours show?",
        ),
        Misconception(
            "corner to corner",
            answers.resize_corner_to_corner,
            "You stretch between the outermost centres: does every old pixel get the same share of new ones?",
        ),
        Misconception(
            "repeated, not enlarged", answers.resize_tiled, "np.resize repeats the data in reading order: look at it."
        ),
        Misconception(
            "one factor for both sides",
            answers.resize_one_factor,
            "The blob may have other proportions than the image: a factor for each side.",
        ),
    ),
    alternatives=(answers.resize_loops, answers.resize_take, answers.resize_one_hot),
    forbidden=("cv2", "PIL"),
)


QUESTIONS = (MAKE_BLOB, LABELS_FROM_BLOB, ENLARGE, HSV_MASK, MEASURE_PIECES, CHOOSE_REGION)
