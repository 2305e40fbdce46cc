"""09_other_stacks.make_blob: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labcourse.kinds import LONG, count, image
from labgrader.question import Question, wrong


def make_blob(bgr, multiple):
    """Turn an OpenCV image into a network's input whose sides are multiples: RGB in 0..1, float32 (1, 3, H', W')."""
    H, W, _ = bgr.shape
    blob = np.zeros((1, 3, -(-H // multiple) * multiple, -(-W // multiple) * multiple), np.float32)
    blob[0, :, :H, :W] = bgr[:, :, ::-1].transpose(2, 0, 1) / np.float32(255)
    return blob


def _image(rng):
    multiple = int(rng.integers(3, 6))
    H, W = int(rng.integers(4, 9)), int(rng.integers(10, 17))
    return rng.integers(0, 256, (H, W, 3)).astype(np.uint8), multiple


_SIX = np.array([[[0, 0, 255], [255, 0, 0]], [[10, 20, 30], [40, 50, 60]], [[1, 2, 3], [4, 5, 6]]], np.uint8)


QUESTION = Question(
    reference=make_blob,
    kinds={"bgr": image(says="uint8"), "multiple": count(1, 64, says="1 to 64")},
    inputs=_image,
    by_hand=(
        (np.array([[[255, 0, 51]]], np.uint8), 1),
        (_SIX, 1),
        (_SIX, 2),
        (np.array([[[255, 0, 51]]], np.uint8), 2),
        (_SIX[:2], 3),
        (_SIX // 255, 4),  # bytes of 0 and 1: what the largest is does not count
        *(((np.arange(3 * LONG) % 256).astype(np.uint8).reshape(*shape, 3), 64) for shape in ((LONG, 1), (1, LONG))),
    ),
    edges=2,
    random_cases=10,
    rtol=1e-6,
    atol=1e-7,
    points=3,
    same_dtype=True,
    forbidden=("cv2",),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def padded(bgr, multiple, mode="constant"):
    room = [(0, -n % multiple) for n in bgr.shape[:2]]
    return np.pad(bgr, (*room, (0, 0)), mode)


def scaled(x):
    return (x / np.float32(255)).astype(np.float32)


def planes(bgr):
    return bgr.transpose(2, 0, 1)[None]


def with_room(bgr, room):
    """The blob with room(n) pixels of 0 before and behind an axis of n."""
    return scaled(planes(np.pad(bgr, (*map(room, bgr.shape[:2]), (0, 0)))[..., ::-1]))


@wrong("Put in one pure red pixel: which plane lights up?")
def blob_still_bgr(bgr, multiple):
    return scaled(planes(padded(bgr, multiple)))


@wrong("The shape is right and the pixels are not: reshape keeps the order in memory, which axis should move?")
def blob_reshaped(bgr, multiple):
    image = padded(bgr, multiple)[..., ::-1]
    return scaled(image.reshape(1, 3, *image.shape[:2]))


@wrong("Which axis did you reverse, the channels or the columns?")
def blob_mirrored(bgr, multiple):
    return scaled(planes(padded(bgr[:, ::-1], multiple)))


@wrong("Black must become 0 here; not every network wants -1.")
def blob_from_minus_one(bgr, multiple):
    return 2 * scaled(planes(padded(bgr[..., ::-1], multiple))) - 1


@wrong("White must become exactly 1: what is white's byte?")
def blob_of_256(bgr, multiple):
    return (planes(padded(bgr[..., ::-1], multiple)) / 256.0).astype(np.float32)


@wrong("A side that is already a multiple remains as it is: what do you add to 8 for a multiple of 4?")
def room_for_one_more(bgr, multiple):
    return with_room(bgr, lambda n: (0, multiple - n % multiple))


@wrong("New rows go below and new columns on the right, so that pixel (0, 0) does not move.")
def room_all_round(bgr, multiple):
    return with_room(bgr, lambda n: (-n % multiple // 2, -n % multiple - -n % multiple // 2))


@wrong("New rows go below and new columns on the right, so that pixel (0, 0) does not move.")
def room_above_and_left(bgr, multiple):
    return with_room(bgr, lambda n: (-n % multiple, 0))


@wrong("You cut off rows or columns. The network should see the whole image.")
def cut_to_a_multiple(bgr, multiple):
    H, W = (n // multiple * multiple for n in bgr.shape[:2])
    return scaled(planes(bgr[:H, :W, ::-1]))


@wrong("The rows and columns that you add contain 0, not the last pixel again.")
def room_like_the_edge(bgr, multiple):
    return scaled(planes(padded(bgr, multiple, "edge")[..., ::-1]))


@wrong("Rows and columns may need different numbers of zeros: compute each by itself.")
def one_margin_for_both(bgr, multiple):
    margin = max(-bgr.shape[0] % multiple, -bgr.shape[1] % multiple)
    return with_room(bgr, lambda n: (0, margin))


@wrong("For a multiple of 4, 6 rows lack 2, and 6 % 4 is 2 as well. What do 5 rows lack?")
def room_of_the_remainder(bgr, multiple):
    return with_room(bgr, lambda n: (0, n % multiple))


@wrong("White is byte 255 in every image: what do you do to a dark image?")
def divided_by_the_largest(bgr, multiple):
    return (planes(padded(bgr[..., ::-1], multiple)) / max(1, bgr.max())).astype(np.float32)


@wrong("The shape is right and the pixels are not: reshape keeps the order in memory, which axis should move?")
def image_reshaped_before_it_is_padded(bgr, multiple):
    H, W, _ = bgr.shape
    blob = make_blob(bgr, multiple)
    blob[0, :, :H, :W] = scaled(bgr[..., ::-1].reshape(3, H, W))
    return blob


@wrong("bgr[::-1] reverses the first axis: is that the channels?")
def blob_upside_down(bgr, multiple):
    return scaled(planes(padded(bgr[::-1], multiple)))
