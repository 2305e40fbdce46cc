"""03_gradient.group: the question, and wrong answers with the hints that they earn."""

from functools import partial

import numpy as np

from labcourse.kinds import array, count
from labcourse.questions.t03_gradient import grouped, pointing, random_places
from labgrader.question import Question, holds, wrong


def group(foreground, votes, cell, least):
    """Number the things that pixels vote for: take the highest peak with its voters out, and look again."""
    shape, numbers = -(-np.array(foreground.shape) // cell), np.zeros(foreground.shape, int)
    v, u = np.nonzero(foreground > 0.5)
    at = np.floor((np.stack([v, u]) + votes[v, u, ::-1].T) / cell).astype(int)  # (2, N), row and column of a cell
    left = ((at >= 0) & (at < shape[:, None])).all(axis=0)
    for number in range(1, len(v) + 2):
        n = np.zeros(shape + 2)
        np.add.at(n, tuple(at[:, left] + 1), 1)
        n = n[:-2] + 2 * n[1:-1] + n[2:]
        n = n[:, :-2] + 2 * n[:, 1:-1] + n[:, 2:]
        near = left & (np.abs(at.T - np.unravel_index(n.argmax(), shape)) <= 1).all(axis=1)
        if near.sum() < least:
            return numbers
        numbers[v[near], u[near]] = number
        left &= ~near


# Two things of 2 x 3 pixels that touch, cells of 2; each one's votes fall into several cells.
_LEFT = {(0, 0): (1, 1), (0, 1): (1, 1), (0, 2): (2, 1), (1, 0): (1, 1), (1, 1): (1, 1), (1, 2): (2, 1)}
_RIGHT = {(0, 3): (4, 3), (0, 4): (5, 3), (0, 5): (4, 2), (1, 3): (5, 2), (1, 4): (4, 3), (1, 5): (5, 3)}
_TWO = pointing((4, 6), _LEFT | _RIGHT)
# Votes that leave the picture at each side, and into cells that are cut by its lower and right border.
_BEYOND = {(0, 0): (-0.5, 0), (0, 1): (0, -0.5), (0, 2): (6.5, 1), (0, 3): (1, 6.5), (1, 1): (-2, -3)}
_OUT = pointing((5, 5), _BEYOND | {(4, 4): (4, 4), (4, 3): (4.5, 4.5), (3, 4): (4.5, 4)})
# Eight votes in one cell, and eight in a row of four: one wins before it is smoothed, one after it.
_SPREAD = pointing((12, 12), {(0, u): (2, 2) for u in range(6)} | {(11, u): (6 + u % 4, 9 + u // 4) for u in range(8)})
# Four votes in one cell make the highest peak, and are too few: six in and round another cell are not looked for.
_ROUND = ((6, 8), (8, 8), (6, 10), (8, 10), (7, 9), (7, 9))
_FEW = pointing((12, 12), {(0, u): (2, 2) for u in range(4)} | {(11, u): place for u, place in enumerate(_ROUND)})

_CROSS = ((-1, -1), (-1, 1), (1, -1), (1, 1), (0, 0), (0, 0))

_SIDES = dict.fromkeys("HW", (1, 400))


def _row_or_column(rng, shape):
    """Draw a long row or column whose pixels vote for places near them, and large cells."""
    votes = np.where(rng.random((*shape, 1)) < 0.1, rng.choice([-1e6, 1e6], (*shape, 1)), rng.normal(size=(*shape, 2)))
    votes[..., shape.index(1) ^ 1 == 0] = 0.0
    foreground = rng.random(shape)
    foreground[-1, -1] = 0.9
    return foreground, votes, int(rng.integers(1, 101)), int(rng.integers(1, 20))


def _peaks(rng, few):
    """Draw two things with equal peaks; few: a third peak is the highest, and has fewer pixels than `least`."""
    rows, columns = (np.sort(rng.choice([2, 6, 10], 2, replace=False)) for _ in range(2))
    places = [(u + i, v + j) for v, u in zip(rows, columns[::-1], strict=True) for i, j in _CROSS]
    places += [(14, 14)] * (4 if few else 0)
    pixels = rng.permutation(list(np.ndindex(17, 17)))[: len(places)].tolist()
    return *pointing((17, 17), dict(zip(map(tuple, pixels), places, strict=True))), 1, 5


def _places_from_a_network(rng):
    """Draw as `random_places` does, in the numbers of a network."""
    foreground, votes, *sizes = random_places(rng)
    return foreground.astype(np.float32), votes.astype(np.float32), *sizes


QUESTION = Question(
    reference=group,
    kinds={
        # Whatever is no more than half is alike; so is whatever leads out of the largest picture.
        "foreground": array(
            "H W",
            0.0,
            1.0,
            dtype="float64 float32",
            lengths=_SIDES,
            says=("0..1", "1 to 400"),
            free=("whole", "0 to NaN", "nine tenths*", "a thousandth*"),
        ),
        "votes": array(
            "H W 2",
            -1e6,
            1e6,
            dtype="float64 float32",
            lengths=_SIDES,
            says="-1e6 to 1e6",
            free=("16 bits", "float16's range", "half of the largest", "nine tenths*"),
        ),
        "cell": count(1, 100, says="1 to 100"),
        "least": count(1, 1000, says="1 to 1000"),
    },
    inputs=(
        random_places,
        random_places,
        _places_from_a_network,
        partial(_row_or_column, shape=(1, 400)),
        partial(_row_or_column, shape=(400, 1)),
        partial(_peaks, few=False),
        partial(_peaks, few=True),
    ),
    by_hand=(
        (*_TWO, 2, 2),
        (*_OUT, 2, 2),
        (*_SPREAD, 1, 4),
        (*_FEW, 1, 5),
        (np.array([[0.5, 0.51], [0.4, 0.9]]), np.zeros((2, 2, 2)), 1, 1),
        (np.zeros((2, 3)), np.ones((2, 3, 2)), 2, 1),  # nobody votes
        (np.ones((50, 50)), np.zeros((50, 50, 2)), 1, 1),  # 289 things, each of nine pixels or fewer
        (np.ones((31, 31)), pointing((31, 31), dict.fromkeys(np.ndindex(31, 31), (15, 15)))[1], 3, 1000),
        (np.ones((1, 400)), np.zeros((1, 400, 2)), 100, 1),
        (np.array([[0.5001]]), np.zeros((1, 1, 2)), 1, 1),
        (np.array([[0.9]]), np.zeros((1, 1, 2)), 1, 255),
        (np.array([[0.9]]), np.array([[[0.0, 0.5]]]), 1, 1),
        (np.array([[0.9]]), np.array([[[-0.0004, 0.0]]]), 1, 1),
        (*pointing((1, 301), {(0, 300): (-0.01, 0), (0, 299): (0.5, 0)}), 1, 1),
        (np.array([[0.9]]), np.array([[[0.0, -0.0004]]]), 1, 1),
    ),
    edges=9,
    random_cases=14,
    points=4,
    forbidden=("scipy", "torch", "cv2", "skimage", "sklearn"),
)


@holds("a pixel whose foreground is 0.5 or less has the number 0")
def none_without_foreground(foreground, votes, cell, least, numbers):
    return not np.any(np.asarray(numbers)[foreground <= 0.5])


@holds("each thing has at least `least` pixels")
def none_is_too_small(foreground, votes, cell, least, numbers):
    return (np.bincount(np.asarray(numbers).ravel())[1:] >= least).all()


# ---------------------------------------------------------------------------------------------------- wrong answers


@wrong("You count arrows, not the places they point to: where does an arrow (du, dv) at the pixel (u, v) end?")
def arrows_without_their_pixels(foreground, votes, cell, least):
    return grouped(foreground, votes, cell, least, place=lambda u, v, d: d)


@wrong("The arrow leads from the pixel to the middle: is it added or subtracted?")
def arrows_turned_round(foreground, votes, cell, least):
    return grouped(foreground, votes, cell, least, place=lambda u, v, d: np.stack([u, v], axis=1) - d)


@wrong("votes[..., 0] is du, along the columns. Which of the two numbers moves a pixel to another row?")
def rows_and_columns_exchanged(foreground, votes, cell, least):
    return grouped(foreground, votes, cell, least, place=lambda u, v, d: np.stack([u, v], axis=1) + d[:, ::-1])


@wrong("Pixels that are not on a thing have arrows, too, which mean nothing: who may vote?")
def every_pixel_votes(foreground, votes, cell, least):
    return grouped(np.ones(foreground.shape), votes, cell, least)


@wrong("A pixel votes if its foreground is above 0.5. What about exactly 0.5?")
def a_half_votes(foreground, votes, cell, least):
    return grouped(np.where(foreground == 0.5, 1.0, foreground), votes, cell, least)


@wrong("Cell 0 holds the places from 0 up to cell, cell 1 those from cell on: what does rounding to the nearest do?")
def rounded(foreground, votes, cell, least):
    return grouped(foreground, votes, cell, least, whole=np.round)


@wrong("The place -0.5 lies before cell 0. In which cell is it after astype(int), which drops the fraction?")
def truncated(foreground, votes, cell, least):
    return grouped(foreground, votes, cell, least, whole=np.trunc)


@wrong("A vote outside the picture's cells counts nowhere. You move it into a cell at the border.")
def moved_to_the_border(foreground, votes, cell, least):
    return grouped(foreground, votes, cell, least, outside="clip")


@wrong("Cell -1 is before the first one. As an index, it is the last one: keep such votes out.")
def cell_minus_1_is_the_last(foreground, votes, cell, least):
    return grouped(foreground, votes, cell, least, outside="wrap")


@wrong("A picture of 5 rows has 3 cells of 2 rows: how many do you make?")
def cut_cells_left_out(foreground, votes, cell, least):
    return grouped(foreground, votes, cell, least, sizes=lambda shape: np.maximum(np.array(shape) // cell, 1))


@wrong("Several votes may fall into one cell. counts[row, column] += 1 counts an index that repeats once.")
def repeated_votes_count_once(foreground, votes, cell, least):
    return grouped(foreground, votes, cell, least, count=lambda n: np.minimum(n, 1))


@wrong("The peak is the highest cell of the smoothed counts. You take that of the raw counts.")
def not_smoothed(foreground, votes, cell, least):
    return grouped(foreground, votes, cell, least, kernel=(0, 1, 0))


@wrong("Your nine cells count alike. In the sum the middle one counts 4, its four neighbours 2, the corners 1.")
def smoothed_with_equal_weights(foreground, votes, cell, least):
    return grouped(foreground, votes, cell, least, kernel=(1, 1, 1))


@wrong("np.roll puts the last row of cells beside the first. What lies beyond the border?")
def smoothed_round_the_border(foreground, votes, cell, least):
    return grouped(foreground, votes, cell, least, border="wrap")


@wrong("Beyond the border there is no vote. What does your smoothing find there?")
def smoothed_with_repeated_borders(foreground, votes, cell, least):
    return grouped(foreground, votes, cell, least, border="edge")


@wrong("A thing's pixels are those whose votes lie in the peak's cell or in one of the eight around it.")
def the_peaks_own_cell_alone(foreground, votes, cell, least):
    return grouped(foreground, votes, cell, least, reach=0)


@wrong("Eight cells touch the peak's cell, and four of them only at its corners: which do you leave out?")
def corners_left_out(foreground, votes, cell, least):
    return grouped(foreground, votes, cell, least, corners=False)


@wrong("Where the highest peak is too small a thing, the search is over. You skip it, and look on.")
def goes_on_after_a_small_thing(foreground, votes, cell, least):
    return grouped(foreground, votes, cell, least, goes_on=True)


@wrong("Your things extend two cells from the peak: which cells touch it?")
def two_cells_around(foreground, votes, cell, least):
    return grouped(foreground, votes, cell, least, reach=2)


@wrong("A thing with exactly `least` pixels counts.")
def more_than_least(foreground, votes, cell, least):
    return grouped(foreground, votes, cell, least + 1)


@wrong("`least` is a number of pixels, of the nine cells together. You compare it with a smoothed count.")
def least_of_the_smoothed_count(foreground, votes, cell, least):
    return grouped(foreground, votes, cell, least, enough="smoothed")


@wrong("`least` is a number of pixels, of the nine cells together. You compare it with the peak's cell alone.")
def least_of_the_peaks_cell(foreground, votes, cell, least):
    return grouped(foreground, votes, cell, least, enough="cell")


@wrong("You stop after one thing. Take its votes out, smooth what is left, and look again.")
def one_thing_alone(foreground, votes, cell, least):
    return np.minimum(grouped(foreground, votes, cell, least), 2) % 2


@wrong(
    "Take a thing's votes out before you look for the next peak: what is left there, and is it high enough?",
    cleared=(0, 1),
)
def from_one_smoothing(foreground, votes, cell, least, cleared):
    return grouped(foreground, votes, cell, least, again=False, cleared=cleared)


@wrong("Things are numbered in the order in which they are found. You number them by size.")
def numbered_by_size(foreground, votes, cell, least):
    numbers = grouped(foreground, votes, cell, least)
    sizes = np.bincount(numbers.ravel())
    order = np.argsort(-sizes[1:], kind="stable")
    new = np.zeros(len(sizes), int)
    new[1 + order] = np.arange(1, len(sizes))
    return new[numbers]


@wrong("The first thing has the number 1, since 0 is no thing.")
def numbered_from_0(foreground, votes, cell, least):
    return np.maximum(grouped(foreground, votes, cell, least) - 1, 0)


@wrong("Of two peaks that are equally high, the first one in reading order counts. np.argmax finds it.")
def the_last_of_equal_peaks(foreground, votes, cell, least):
    return grouped(foreground, votes, cell, least, last=True)


@wrong("You number connected regions. Two things that touch are one region: which pixels vote for one place?")
def regions_that_touch(foreground, votes, cell, least):
    return (foreground > 0.5).astype(int)


@wrong("Of two cells with equal counts the first in reading order counts, row by row: in which order do you look?")
def column_by_column(foreground, votes, cell, least):
    return group(foreground.T, votes.transpose(1, 0, 2)[..., ::-1], cell, least).T
