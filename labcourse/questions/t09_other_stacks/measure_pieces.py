"""09_other_stacks.measure_pieces: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labgrader.question import Question, wrong


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
    if rng.random() < 0.4:  # no pixel is without a piece
        pieces[pieces == 0] = 1
    smallest = min(pieces.min(), 1)
    return ((np.unique(pieces, return_inverse=True)[1].reshape(H, W) + smallest).astype(np.int32),)


QUESTION = Question(
    reference=measure_pieces,
    inputs=_pieces,
    by_hand=(
        (np.array([[0, 1, 1, 1], [0, 0, 0, 1], [2, 0, 0, 0]], np.int32),),
        (np.array([[1, 1, 2, 2, 2]], np.int32),),
    ),
    random_cases=10,
    points=3,
    forbidden=("cv2", "scipy", "skimage"),
    outputs=("areas", "centroids", "boxes"),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def pieces_by_argwhere(pieces, first=1):
    for i in range(first, pieces.max() + 1):
        yield np.argwhere(pieces == i)


def measured(pieces, area=len, centroid=lambda vu: vu.mean(axis=0)[::-1], box=None, first=1):
    box = box or (lambda vu: (*vu.min(axis=0)[::-1], *vu.max(axis=0)[::-1]))
    found = [vu for vu in pieces_by_argwhere(pieces, first) if len(vu)]
    return (
        np.array([area(vu) for vu in found]),
        np.array([centroid(vu) for vu in found], float).reshape(-1, 2),
        np.array([box(vu) for vu in found]).reshape(-1, 4),
    )


@wrong("The last column and row of a box still belong to the piece here.")
def measured_with_open_boxes(pieces):
    return measured(pieces, box=lambda vu: (*vu.min(axis=0)[::-1], *(vu.max(axis=0)[::-1] + 1)))


@wrong('0 means "no piece". Which piece does your first row measure?')
def measured_with_the_background(pieces):
    return measured(pieces, first=0)


@wrong("The middle of an L-shaped piece is not that of its box.")
def measured_by_boxes(pieces):
    return measured(pieces, centroid=lambda vu: (vu.min(axis=0) + vu.max(axis=0))[::-1] / 2)


@wrong("Count the piece's own pixels: a box contains others, too.")
def measured_box_areas(pieces):
    return measured(pieces, area=lambda vu: np.prod(np.ptp(vu, axis=0) + 1))


@wrong("The box is (u0, v0, u1, v1): first and last, not first and how many.")
def measured_widths(pieces):
    return measured(pieces, box=lambda vu: (*vu.min(axis=0)[::-1], *(np.ptp(vu, axis=0)[::-1] + 1)))


def rearranged(pieces, order):
    return tuple(output[order] for output in measure_pieces(pieces))


@wrong("Row i belongs to piece i + 1: in which order are yours?")
def measured_by_size(pieces):
    return rearranged(pieces, np.argsort(-measure_pieces(pieces)[0], kind="stable"))


@wrong("You leave out the smallest number of the image: is it always 0?")
def measured_without_the_smallest_number(pieces):
    return rearranged(pieces, np.arange(pieces.max())[int(pieces.min() > 0) :])


@wrong("A centroid is a mean: what did you compute?")
def measured_by_medians(pieces):
    return measured(pieces, centroid=lambda vu: np.median(vu, axis=0)[::-1])


@wrong("np.nonzero goes row by row: is the pixel that it finds first also the leftmost?")
def measured_from_first_to_last(pieces):
    return measured(pieces, box=lambda vu: (*vu[0, ::-1], *vu[-1, ::-1]))


@wrong("A centroid is the mean over the pixels of the piece: how many are they? You divide by W and H.")
def measured_by_the_sides_of_the_image(pieces):
    H, W = pieces.shape
    return measured(pieces, centroid=lambda vu: vu.sum(axis=0)[::-1] / (W, H))


@wrong("A box is first column, first row, last column, last row: which comes first in yours?")
def measured_with_rows_first(pieces):
    return measured(pieces, box=lambda vu: (*vu.min(axis=0), *vu.max(axis=0)))
