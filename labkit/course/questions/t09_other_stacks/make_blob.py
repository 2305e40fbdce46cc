"""09_other_stacks.make_blob: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.questions.question import Property, Question, wrong


def make_blob(bgr):
    """Turn an OpenCV image, uint8 (H, W, 3) in BGR, into a network's input: RGB in 0..1, float32 (1, 3, H, W)."""
    rgb = bgr[:, :, ::-1]
    return (rgb.transpose(2, 0, 1)[None] / 255.0).astype(np.float32)


def _image(rng):
    H, W = int(rng.integers(4, 9)), int(rng.integers(10, 15))
    return (rng.integers(0, 256, (H, W, 3)).astype(np.uint8),)


QUESTION = Question(
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
    same_dtype=True,
    properties=(
        Property("values lie in 0..1", lambda arguments, blob: bool(np.min(blob) >= 0.0 and np.max(blob) <= 1.0)),
    ),
    forbidden=("cv2",),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def scaled(x):
    return (x / np.float32(255)).astype(np.float32)


@wrong(QUESTION, "Put in one pure red pixel: which plane lights up?")
def blob_still_bgr(bgr):
    return scaled(bgr.transpose(2, 0, 1)[None])


@wrong(
    QUESTION, "The shape is right and the pixels are not: reshape keeps the order in memory, which axis should move?"
)
def blob_reshaped(bgr):
    H, W, _ = bgr.shape
    return scaled(bgr[..., ::-1].reshape(1, 3, H, W))


@wrong(QUESTION, "Make an image with one bright row: is it a row in your planes?")
def blob_rows_for_columns(bgr):
    H, W, _ = bgr.shape
    return scaled(bgr[..., ::-1].T.reshape(1, 3, H, W))


@wrong(QUESTION, "Which axis did you turn round, the channels' or the columns'?")
def blob_mirrored(bgr):
    return scaled(bgr[:, ::-1].transpose(2, 0, 1)[None])


@wrong(QUESTION, "Black must become 0 here; not every network wants -1.")
def blob_from_minus_one(bgr):
    return 2 * scaled(bgr[..., ::-1].transpose(2, 0, 1)[None]) - 1


@wrong(QUESTION, "White must become exactly 1: what is white's byte?")
def blob_of_256(bgr):
    return (bgr[..., ::-1].transpose(2, 0, 1)[None] / 256.0).astype(np.float32)
