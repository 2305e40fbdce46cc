"""09_other_stacks.labels_of_buffer: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labcourse.kinds import array, count
from labgrader.question import Question, holds, wrong


def labels_of_buffer(buffer, C, H, W, block, step):
    """Read labels (H, W) from the bytes of 16-bit scores: classes in blocks, rows of `step` bytes."""
    blocks = -(-C // block)
    pixels = buffer.reshape(blocks, H, step)[:, :, : 2 * block * W]
    scores = np.ascontiguousarray(pixels).view("<f2").reshape(blocks, H, W, block)
    return scores.transpose(0, 3, 1, 2).reshape(-1, H, W)[:C].argmax(axis=0)


def written(scores, block, step, rng):
    """The bytes of scores (C, H, W), entry by entry; what fills up blocks and rows is NaN, large numbers or small."""
    C, H, W = scores.shape
    buffer = rng.choice(np.array([0x00, 0x3C, 0x7B, 0x7E], np.uint8), -(-C // block) * H * step)
    for c, v, u in np.ndindex(C, H, W):
        at = (c // block * H + v) * step + 2 * (u * block + c % block)
        buffer[at : at + 2] = scores[c, v, u, None].astype("<f2").view(np.uint8)
    return buffer


def _buffer(rng):
    """Draw an engine's buffer: planes, blocks of which the last is not full, or all classes of a pixel in one block."""
    C, H, W = int(rng.integers(5, 8)), int(rng.integers(3, 5)), int(rng.integers(6, 9))
    block = int(rng.choice([1, 2, 3, 4, 4, 8]))
    step = 2 * (block * W + int(rng.integers(0, 5)))
    scores = rng.permutation(C * H * W).reshape(C, H, W) / 8  # no two are equal in 16 bits
    scores -= 0.1 * scores.size  # most are negative, so that at some pixels all are
    return written(scores, block, step, rng), C, H, W, block, step


def _any_floats(rng, C=None, H=None, W=None, block=None, step=None):
    """Draw an engine's buffer of any finite scores, up to 65504 and down to -65504, and of any layout."""
    C, H, W = C or int(rng.integers(1, 8)), H or int(rng.integers(1, 5)), W or int(rng.integers(1, 6))
    block = block or int(rng.integers(1, 9))
    step = step or 2 * (block * W + int(rng.integers(0, 5)))
    finite = np.arange(2**16, dtype=np.uint16).view(np.float16)
    finite = finite[np.isfinite(finite) & (finite != 0.0)]
    scores = np.stack([rng.choice(finite, C, replace=False) for _ in range(H * W)], axis=1).reshape(C, H, W)
    return written(scores, block, step, rng), C, H, W, block, step


def _by_hand(rows, C, W, block):
    """The arguments of a case whose rows of numbers, all that lies between two steps, are given."""
    rows = np.array(rows, "<f2")
    return rows.view(np.uint8).ravel(), C, len(rows) // -(-C // block), W, block, 2 * rows.shape[1]


_EDGES = (
    {"C": 255, "H": 1, "W": 2, "block": 64},
    {"C": 2, "H": 1000, "W": 1, "block": 1, "step": 4},
    {"C": 2, "H": 1, "W": 1000, "block": 2},
    {"C": 5, "H": 2, "W": 3, "block": 4, "step": 10_000},
)

QUESTION = Question(
    reference=labels_of_buffer,
    kinds={
        "buffer": array("n", 0, 255, dtype="uint8", lengths={"n": (2, None)}),
        "C": count(1, 255, says="1 to 255"),
        "H": count(1, 1000, says="1 to 1000"),
        "W": count(1, 1000, says="1 to 1000"),
        "block": count(1, 64, says="1 to 64"),
        "step": count(2, 10_000, says=("an even number", "at most 10000")),
    },
    inputs=(_buffer, _any_floats),
    by_hand=(
        _by_hand([[3, 1, 2, 5]], C=2, W=2, block=2),  # pixel after pixel
        _by_hand([[3, 2], [1, 5]], C=2, W=2, block=1),  # plane after plane
        _by_hand([[3, 1, 2, 5, 9, 9], [1, 7, 6, 4, 9, 9]], C=2, W=2, block=2),  # rows are filled up
        _by_hand([[3, 1, 2, 5], [4, 9, 0, 9]], C=3, W=2, block=2),  # the last block is filled up
        _by_hand([[-3, -1, -2, -0.5, 2047, 2048, 0, 0]], C=2, W=3, block=2),  # 2047 and 2048 are neighbours in 16 bits
        _by_hand([[3, 1, 2, 5, 9, 9]], C=2, W=2, block=2),
        _by_hand([[-65504, -65472, -1, 1, 65504, 65472]], C=2, W=3, block=2),  # as low and as high as 16 bits go
        _by_hand([[-7]], C=1, W=1, block=1),  # one pixel, and one class
        *(_any_floats(np.random.default_rng(1), **edge) for edge in _EDGES),
    ),
    edges=7,
    random_cases=12,
    points=3,
)


@holds("every label is one of the classes, 0 to C - 1")
def labels_are_classes(buffer, C, H, W, block, step, out):
    return np.all((out >= 0) & (out < C))


# ---------------------------------------------------------------------------------------------------- wrong answers


def places(C, H, W, block, step, at):
    """The byte of each score (C, H, W), by a function of class, row and column."""
    c, v, u = np.indices((C, H, W))
    return at(c, v, u)


def read(buffer, at, kind="<f2"):
    """The numbers that begin at some bytes; beyond the end the buffer begins again."""
    size = np.dtype(kind).itemsize
    return buffer[(at[..., None] + np.arange(size)) % len(buffer)].view(kind)[..., 0]


def right_places(C, H, W, block, step):
    return places(C, H, W, block, step, lambda c, v, u: (c // block * H + v) * step + 2 * (u * block + c % block))


def all_scores(buffer, C, H, W, block, step):
    """The scores of all classes, and of those that fill up the last block."""
    return read(buffer, right_places(-(-C // block) * block, H, W, block, step))


def best(buffer, C, H, W, block, step, at):
    """Labels by scores that are read at other places."""
    return read(buffer, places(C, H, W, block, step, at)).argmax(axis=0)


@wrong("The first row is right, the next ones slide sideways: at which byte does row v begin?")
def rows_without_their_filling(buffer, C, H, W, block, step):
    return best(buffer, C, H, W, block, step, lambda c, v, u: 2 * (((c // block * H + v) * W + u) * block + c % block))


@wrong("Each row is padded to step bytes. You expect padding only at the end of a whole block.")
def filling_after_all_rows(buffer, C, H, W, block, step):
    def at(c, v, u):
        return c // block * H * step + 2 * ((v * W + u) * block + c % block)

    return best(buffer, C, H, W, block, step, at)


@wrong("The padding is at a row's end: where does its first pixel begin?")
def filling_in_front(buffer, C, H, W, block, step):
    spare = step - 2 * block * W
    return read(buffer, right_places(C, H, W, block, step) + spare).argmax(axis=0)


@wrong("A block has H rows of `step` bytes. Where do you begin the next one?")
def blocks_without_the_rows_filling(buffer, C, H, W, block, step):
    def at(c, v, u):
        return 2 * (c // block * H * W * block + u * block + c % block) + v * step

    return best(buffer, C, H, W, block, step, at)


@wrong("Inside a block the scores of one pixel are side by side. You read a row of one class after that of another.")
def rows_of_classes_in_a_block(buffer, C, H, W, block, step):
    return best(buffer, C, H, W, block, step, lambda c, v, u: (c // block * H + v) * step + 2 * (c % block * W + u))


@wrong("A block is rows of pixels. You go down the columns: which of v and u moves you on by `step` bytes?")
def columns_first(buffer, C, H, W, block, step):
    return best(buffer, C, H, W, block, step, lambda c, v, u: (c // block * W + u) * step + 2 * (v * block + c % block))


@wrong("`step` counts bytes. A score has two of them: how many bytes are there between two pixels of a row?")
def places_in_a_row_as_bytes(buffer, C, H, W, block, step):
    return best(buffer, C, H, W, block, step, lambda c, v, u: (c // block * H + v) * step + u * block + c % block)


@wrong("A block is written with all its rows before the next one begins. You alternate between blocks row by row.")
def blocks_row_by_row(buffer, C, H, W, block, step):
    blocks = -(-C // block)
    return best(
        buffer, C, H, W, block, step, lambda c, v, u: (v * blocks + c // block) * step + 2 * (u * block + c % block)
    )


@wrong("You read plane after plane, as if each block held one class. What lies 2 bytes after a score of class 0?")
def as_planes(buffer, C, H, W, block, step):
    return best(buffer, C, H, W, block, step, lambda c, v, u: (c * H + v) * step + 2 * u)


@wrong("You read all C classes of a pixel side by side: only `block` of them are. Where is class `block`?")
def as_pixels(buffer, C, H, W, block, step):
    return best(buffer, C, H, W, block, step, lambda c, v, u: v * step + 2 * (u * C + c))


@wrong("A label is above C - 1: the last block holds more scores than there are classes. What are they?")
def filled_up_classes_too(buffer, C, H, W, block, step):
    return all_scores(buffer, C, H, W, block, step).argmax(axis=0)


@wrong("You keep the first C places of each block. Which classes are they, once the blocks are side by side?")
def cut_within_the_blocks(buffer, C, H, W, block, step):
    scores = all_scores(buffer, C, H, W, block, step).reshape(-1, block, H, W)
    return scores[:, :C].reshape(-1, H, W).argmax(axis=0)


@wrong("The numbers that pad the last block may be large: leave them out by position, not because they are NaN.")
def filled_up_classes_but_for_nan(buffer, C, H, W, block, step):
    scores = all_scores(buffer, C, H, W, block, step)
    return np.where(np.isnan(scores), -np.inf, scores).argmax(axis=0)


@wrong("With 5 classes in blocks of 4, your class 4 never wins: how many blocks are there?")
def full_blocks_alone(buffer, C, H, W, block, step):
    return read(buffer, right_places(max(C // block, 1) * block, H, W, block, step))[:C].argmax(axis=0)


@wrong("You compare only the classes of the first block: class `block` and all above it never win.")
def first_block_alone(buffer, C, H, W, block, step):
    return read(buffer, right_places(min(block, C), H, W, block, step)).argmax(axis=0)


@wrong("Your label counts within a block: which class is score 1 of block 2?")
def place_in_the_block(buffer, C, H, W, block, step):
    return labels_of_buffer(buffer, C, H, W, block, step) % block


@wrong("Your label is the number of a block: which of its classes is the best?")
def number_of_the_block(buffer, C, H, W, block, step):
    return labels_of_buffer(buffer, C, H, W, block, step) // block


def blocked(buffer, C, H, W, block, step):
    """All scores, the filling of blocks too, (blocks, H, W, block)."""
    every = all_scores(buffer, C, H, W, block, step)
    return every.reshape(-1, block, H, W).transpose(0, 2, 3, 1)


@wrong("You count the place within a block first and the block second: which class is score 1 of block 0?")
def blocks_counted_last(buffer, C, H, W, block, step):
    return blocked(buffer, C, H, W, block, step).transpose(3, 0, 1, 2).reshape(-1, H, W)[:C].argmax(axis=0)


@wrong("reshape takes the numbers in the order in which they are stored: which axes must be swapped before it?")
def reshaped_without_transposing(buffer, C, H, W, block, step):
    return blocked(buffer, C, H, W, block, step).reshape(-1, H, W)[:C].argmax(axis=0)


@wrong("reshape takes the numbers in the order in which they are stored: which axes must be swapped before it?")
def pixels_reshaped_without_transposing(buffer, C, H, W, block, step):
    return blocked(buffer, C, H, W, block, step).reshape(H, W, -1)[..., :C].argmax(axis=-1)


@wrong("The two bytes of 1.0 are 0 and 60: the lower one comes first. In which order do you read them?")
def bytes_exchanged(buffer, C, H, W, block, step):
    return read(buffer, right_places(C, H, W, block, step), ">f2").argmax(axis=0)


@wrong("You compare bytes. A score is two bytes, which are one float.", byte=(0, 1))
def single_bytes(buffer, C, H, W, block, step, byte):
    return buffer[right_places(C, H, W, block, step) + byte].argmax(axis=0)


@wrong("astype turns each byte into a number. Which NumPy function reads two bytes together as one number?")
def bytes_as_numbers(buffer, C, H, W, block, step):
    rows = buffer.astype(float).reshape(-1, H, step)[:, :, : 2 * block * W].reshape(-1, H, W, 2 * block)
    return rows.transpose(0, 3, 1, 2).reshape(-1, H, W)[:C].argmax(axis=0)


@wrong("astype turns each byte into a number. Which NumPy function reads two bytes together as one number?")
def bytes_as_scores(buffer, C, H, W, block, step):
    rows = buffer.reshape(-1, H, step)[:, :, : block * W].reshape(-1, H, W, block)
    return rows.transpose(0, 3, 1, 2).reshape(-1, H, W)[:C].argmax(axis=0)


@wrong("At a pixel whose scores are all negative, none is above 0: what do you begin with?")
def the_best_begins_at_0(buffer, C, H, W, block, step):
    scores = read(buffer, right_places(C, H, W, block, step))
    return np.where((scores > 0).any(axis=0), scores.argmax(axis=0), 0)


@wrong("Those are the highest scores. Which class has each of them?")
def scores_of_the_best(buffer, C, H, W, block, step):
    return read(buffer, right_places(C, H, W, block, step)).max(axis=0)


@wrong(
    "Two bytes, but of which type? You read them as integers: where do the negative scores go?",
    kind=("<i2", "<u2"),
)
def whole_numbers(buffer, C, H, W, block, step, kind):
    return read(buffer, right_places(C, H, W, block, step), kind).argmax(axis=0)
