"""03_gradient.max_pool_backward: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labgrader.question import Question, holds, wrong


def max_pool_backward(x, g):
    """Carry a gradient back through a max pooling of width and stride 2: to the largest pixel of each block."""
    H, W = x.shape
    out = np.zeros((H, W))
    for i, j in np.ndindex(H // 2, W // 2):
        block = x[2 * i : 2 * i + 2, 2 * j : 2 * j + 2]
        v, u = divmod(int(block.argmax()), 2)
        out[2 * i + v, 2 * j + u] = g[i, j]
    return out


def draw(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Draw an image and a gradient of half its sides.

    The four pixels of a block differ, in one block all are negative, and other blocks may hold the same numbers; in
    some images all numbers are tiny.
    """
    b = np.array([rng.permutation(12)[:4] - 6.0 for _ in range(12)])
    b[rng.integers(12)] = rng.permutation(5)[:4] - 6.0
    return unblocked(b.reshape(3, 4, 4)) * rng.choice([1.0, 1e-9]), rng.normal(size=(3, 4))


QUESTION = Question(
    reference=max_pool_backward,
    inputs=draw,
    by_hand=(
        (np.array([[1.0, 7.0], [3.0, 2.0]]), np.array([[5.0]])),
        (np.array([[-4.0, -2.0, 4.0, -1.0], [-3.0, -1.0, 0.0, 6.0]]), np.array([[2.0, -3.0]])),
        (1e-9 * np.array([[0.0, 1.0], [2.0, 3.0], [9.0, 8.0], [6.0, 7.0]]), np.array([[1.0], [-1.0]])),  # no tolerance
        (np.array([[0.0, 5, 1, 2, 8, 3, 4, 6], [3, 1, 7, 0, 2, 6, 5, 9]]), np.array([[1.0, 2, 3, 4]])),  # wide
    ),
    random_cases=6,
    points=3,
    forbidden=("scipy", "torch"),
)


@holds("nothing is lost: the gradient has the same sum before and after")
def sum_is_kept(x, g, out):
    return np.isclose(out.sum(), g.sum(), atol=1e-6)


# ---------------------------------------------------------------------------------------------------- wrong answers


def blocks(x):
    """An image as blocks of 2 x 2, (H / 2, W / 2, 4)."""
    H, W = x.shape
    return x.reshape(H // 2, 2, W // 2, 2).swapaxes(1, 2).reshape(H // 2, W // 2, 4)


def unblocked(b):
    """Blocks of 2 x 2 as an image again."""
    h, w, _ = b.shape
    return b.reshape(h, w, 2, 2).swapaxes(1, 2).reshape(2 * h, 2 * w)


@wrong("Three of the four pixels of a block did not reach the output: can moving them change the loss?")
def to_all_four(x, g):
    """The whole gradient to each pixel of the block."""
    return g.repeat(2, axis=0).repeat(2, axis=1)


@wrong("That is the gradient of a mean. Which pixel of a block does its maximum depend on?")
def shared_among_four(x, g):
    """A quarter to each pixel."""
    return to_all_four(x, g) / 4.0


@wrong("The output of the pooling is x itself at one place: what is its derivative there?")
def times_the_maximum(x, g):
    """The gradient multiplied by the value that went through."""
    b = blocks(x)
    return unblocked((b == b.max(axis=2, keepdims=True)) * (g * b.max(axis=2))[..., None])


@wrong("A negative pixel can be the largest of its block: it passes the gradient, too.")
def clipped_like_a_relu(x, g):
    """Negative pixels get nothing, as behind a ReLU."""
    b = blocks(x)
    return unblocked((b == b.max(axis=2, keepdims=True)) * (b > 0) * g[..., None])


@wrong("All four pixels of a block may be negative: with which value does your search for the largest begin?")
def searched_from_zero(x, g):
    """The search begins at 0: no pixel of a negative block is larger, and the first one stays."""
    b = np.maximum(blocks(x), 0.0)
    return unblocked(np.eye(4)[b.argmax(axis=2)] * g[..., None])


@wrong("Compare a pixel with the other three of its block, not with the whole row of blocks or image.")
def largest_of_the_image(x, g):
    """Only the image's largest pixel passes anything."""
    return (x == x.max()) * to_all_four(x, g)


@wrong("np.tile repeats the whole image. np.repeat repeats each entry, so that it fills its own block.")
def tiled(x, g):
    """Maxima and gradients put beside pixels of other blocks."""
    return (x == np.tile(blocks(x).max(axis=2), (2, 2))) * np.tile(g, (2, 2))


@wrong("Blocks do not overlap: block (i, j) begins at row 2 i and column 2 j.")
def overlapping_blocks(x, g):
    """Blocks of stride 1."""
    out = np.zeros_like(x)
    for i, j in np.ndindex(g.shape):
        v, u = divmod(int(x[i : i + 2, j : j + 2].argmax()), 2)
        out[i + v, j + u] += g[i, j]
    return out


@wrong("The places are right, but g is tiled: np.repeat, not np.tile, gives each block its own gradient.")
def gradients_tiled(x, g):
    """Maxima beside their own blocks, gradients beside others."""
    return (x == to_all_four(x, blocks(x).max(axis=2))) * np.tile(g, (2, 2))


@wrong("That is the place of the largest pixel inside its block: where in the image does block (i, j) begin?")
def placed_without_the_block(x, g):
    """Everything in the image's first four pixels."""
    out = np.zeros_like(x)
    for i, j in np.ndindex(g.shape):
        out[divmod(int(x[2 * i : 2 * i + 2, 2 * j : 2 * j + 2].argmax()), 2)] = g[i, j]
    return out


@wrong("The largest value of one block may also occur in another that has a larger one: compare within the block.")
def among_all_maxima(x, g):
    """A pixel that equals the maximum of any block passes the gradient of its own."""
    return np.isin(x, blocks(x).max(axis=2)) * to_all_four(x, g)


@wrong("reshape cuts four pixels of one row out of the image: how do the rows of a block come together?")
def blocks_of_one_row(x, g):
    """Blocks of 1 x 4."""
    b = x.reshape(*g.shape, 4)
    return ((b == b.max(axis=2, keepdims=True)) * g[..., None]).reshape(x.shape)


@wrong("np.isclose treats any two numbers below 1e-8 as equal: which comparison has no tolerance?")
def nearly_the_largest(x, g):
    return np.isclose(x, to_all_four(x, blocks(x).max(axis=2))) * to_all_four(x, g)


@wrong("Of -4 and 1 the pooling keeps 1: do you compare values, or their distances from 0?")
def largest_by_size(x, g):
    b = np.abs(blocks(x))
    return unblocked((b == b.max(axis=2, keepdims=True)) * g[..., None])


@wrong("Blocks do not overlap: how many of your windows contain a pixel?")
def all_windows_of_stride_1(x, g):
    out = np.zeros_like(x)
    for i, j in np.ndindex(x.shape[0] - 1, x.shape[1] - 1):
        v, u = divmod(int(x[i : i + 2, j : j + 2].argmax()), 2)
        out[i + v, j + u] += g[i // 2, j // 2]
    return out


@wrong("argmax counts a block row by row: in which row and column of the block is place 1?")
def rows_and_columns_of_the_block_exchanged(x, g):
    return unblocked(np.eye(4)[[0, 2, 1, 3]][blocks(x).argmax(axis=2)] * g[..., None])
