"""Questions of topic 03: cross-entropy, its gradient, the way back through layers, and votes for the middle of a thing.

RETIRED are those that the lab asks no more; labs that were released when it did are checked and graded all the same.
"""

from functools import partial

import numpy as np

from labcourse.kinds import LONG, MOST_CLASSES, array, labels

RETIRED = ("softmax", "max_pool_backward", "input_window")


def random_logits(rng: np.random.Generator) -> np.ndarray:
    """Draw logits (H, W, C) of three unequal lengths, a few units apart; one pixel's are near 1000, another's -1000.

    In most draws a class of pixel (1, 3), not the last one, is so sure that the others' probabilities round to 0.
    """
    shape = (int(rng.integers(2, 4)), int(rng.integers(4, 6)), int(rng.integers(6, 8)))
    z = 2.0 * rng.normal(size=shape) + rng.normal()
    z[0, 1] += 1000.0
    z[1, 2] -= 1000.0
    z[1, 3, rng.integers(shape[2] - 1)] += 800.0 * (rng.random() < 0.7)
    return z


def random_possible_classes(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Draw logits (H, W, C), and which classes can occur (C,), at least one and in most draws not all of them.

    The impossible ones have the largest logits of pixel (0, 2), by far.
    """
    z = random_logits(rng)
    possible = rng.random(z.shape[-1]) < 0.6
    possible[rng.integers(z.shape[-1])] = True
    z[0, 2, ~possible] += 2000.0
    return z, possible


def random_pixels(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Draw logits (H, W, C) and labels (H, W), at least one of them ignored; the surest pixel is wrong."""
    z = random_logits(rng)
    y = rng.integers(0, z.shape[-1], z.shape[:-1]).astype(np.uint8)
    y[rng.random(y.shape) < 0.2] = 255
    y[0, 0], y[1, 3] = 255, z.shape[-1] - 1
    y[0, 1], y[1, 2] = rng.integers(0, z.shape[-1], 2)
    return z, y


def random_smoothed_pixels(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, float]:
    """Draw logits and labels, and the share of each pixel that is spread over all classes."""
    return *random_pixels(rng), float(rng.uniform(0.05, 0.4))


def pixels_of(rng, shape, C, size=2.0, s=(0.05, 0.4)):
    """Draw logits of a size, labels of a shape, the last class among them, and a share from a range."""
    z = np.clip(size * rng.normal(size=(*shape, C)), -1e6, 1e6)
    y = np.where(rng.random(shape) < 0.2, 255, rng.integers(0, C, shape))
    y[(-1,) * len(shape)] = C - 1
    return z, y.astype(np.uint8), float(rng.uniform(*s))


LOGITS = array("... C", -1e6, 1e6, lengths={"C": (2, MOST_CLASSES)}, says=("-1e6 to 1e6", "C 2 to 255"))
SMOOTHED_PIXELS = {"z": LOGITS, "y": labels("..."), "s": array("", 0.0, 0.99, dtype="float", says="0 to 0.99")}
# A picture; a pixel, a long row, a batch; as many classes as there may be, with large logits; two classes.
SMOOTHED_DRAWS = (
    random_smoothed_pixels,
    partial(pixels_of, shape=(), C=4),
    partial(pixels_of, shape=(LONG,), C=3, s=(0.95, 0.99)),
    partial(pixels_of, shape=(3, 3, 4), C=3),
    partial(pixels_of, shape=(5,), C=MOST_CLASSES, size=4e5),
    partial(pixels_of, shape=(3,), C=2),
)


def targets(y, C, s):
    """How much of each pixel belongs to each class, (..., C): a share s is spread evenly over all of them."""
    return (1.0 - s) * (y[..., None] == np.arange(C)) + s / C


TOY = np.array([2.0, 1.0, -1.0])


SURE = np.array([[0.0, 3000.0, 3.0], [-1000.0, -1001.0, -1005.0]])  # exp overflows, or rounds everything to 0


EPSILONS = tuple(10.0**-digits for digits in (6, 7, 8, 9, 10, 12, 15, 16))  # what people add to probabilities


TRUE_CLASSES = np.array([0, 255], np.uint8)


def softmax_over_classes(z):
    e = np.exp(z - z.max(axis=-1, keepdims=True))
    return e / e.sum(axis=-1, keepdims=True)


def softmax_over_pixels(z):
    e = np.exp(z - z.max(axis=-2 if z.ndim > 1 else -1, keepdims=True))
    return e / e.sum(axis=-2 if z.ndim > 1 else -1, keepdims=True)


TOUCHING = np.array([[1, 1, 1, 7, 7, 0], [1, 0, 1, 7, 255, 0]], np.uint8)  # two things; the left one has a hole


def random_votes(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, float]:
    """Draw votes (H, W, 2), numbers of things (H, W) with gaps, and beta; some errors are below beta, some above.

    Things are pieces of columns that touch, of unequal sizes; pixels of 0 and of 255 lie among them, with votes of any
    size, and one thing is in two parts. Half of the pictures have no thing.
    """
    H, W = int(rng.integers(5, 8)), int(rng.integers(10, 14))
    numbers = np.sort(rng.choice(np.arange(1, 255), 3, replace=False))[[1, 0, 2]].astype(np.uint8)
    instances = numbers[np.array([0, 0, 1, 1, 1, 1, 0, 2, 2, 2, 2, 2, 2, 2])[:W]] * np.ones((H, 1), np.uint8)
    instances[0, rng.integers(W)] = instances[H - 1, 0] = 0
    instances[1:3, rng.integers(1, W)] = 255
    instances[-2:, -2:] = 0
    beta = float(rng.uniform(1.0, 3.0))
    votes = rng.normal(size=(H, W, 2)) * rng.choice([0.5, 2.0, 8.0], (H, W, 1)) * beta
    for k in numbers:
        v, u = np.nonzero(instances == k)
        votes[v, u] += [u.mean(), v.mean()] - np.stack([u, v], axis=1)
    return votes, instances if rng.random() < 0.5 else np.where(instances == 255, instances, 0), beta


def scored(votes, instances, beta, loss_and_slope, no_thing=(0, 255), middle=None, arrow=None, share=None):
    """Loss of votes and its gradient, with a step of one's own.

    loss_and_slope: of errors (N, 2) and beta. middle: of a thing's pixels (N, 2); arrow: the true one, of the middle
    and the pixels; share: what a pixel counts, of its thing's pixels and the number of things.
    """
    middle = middle or (lambda x: x.mean(axis=0))
    arrow = arrow or (lambda m, x: m - x)
    share = share or (lambda n, K: 1.0 / n / K)
    total, grad = 0.0, np.zeros(votes.shape)
    things = [k for k in np.unique(instances) if k not in no_thing]
    for k in things:
        v, u = np.nonzero(instances == k)
        x = np.stack([u, v], axis=1)
        loss, slope = loss_and_slope(votes[v, u] - arrow(middle(x), x), beta)
        part = share(len(u), len(things))
        total, grad[v, u] = total + part * loss.sum(), part * slope
    return float(total), grad


def pointing(shape, places):
    """Foreground and votes of a picture whose pixels (v, u) vote for the places (u, v) that are given."""
    foreground, votes = np.zeros(shape), np.zeros((*shape, 2))
    for (v, u), place in places.items():
        foreground[v, u] = 0.9
        votes[v, u] = np.subtract(place, (u, v))
    return foreground, votes


def random_places(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, int, int]:
    """Draw foreground, votes, cell and least: pixels vote for a few places, some near, some outside the picture.

    Some places are met closely and some loosely, so that a small thing may have the higher peak; two peaks, at the
    upper right, are equally high; and one thing has exactly `least` pixels.
    """
    H, cell = int(rng.integers(13, 17)), int(rng.integers(2, 4))
    left, W = int(rng.integers(16, 20)), 20 + 11 * cell
    foreground = np.where(rng.random((H, W)) < 0.8, rng.uniform(0.51, 1.0, (H, W)), rng.uniform(0.0, 0.49, (H, W)))
    foreground[rng.integers(H, size=3), rng.integers(W, size=3)] = 0.5
    middles = np.concatenate([rng.uniform(0, [left, H], (4, 2)), [[W - 0.5, H - 0.5], [0.5, 0.5], [-1.0, 5.0]]])
    of = rng.choice(len(middles), (H, W), p=[0.2, 0.2, 0.15, 0.1, 0.15, 0.1, 0.1])
    spread = rng.permutation([0.1, 0.3, 0.5, 0.7, 0.8, 0.9, 1.0])[of] * cell
    at = middles[of] + rng.normal(size=(H, W, 2)) * spread[..., None]
    beyond = np.array([400.0, 1e5, *(n * side for n in (256.0, 65536.0) for side in (1, cell))])  # bytes, words wrap
    far = rng.random((H, W)) < 0.1
    at[far] += rng.choice(beyond, (np.count_nonzero(far), 1))
    v, u = np.nonzero(foreground > 0.5)
    equal = rng.permutation(len(v))[: 2 * int(rng.integers(9, 14))].reshape(2, -1)
    for k, pixels in enumerate(equal):
        at[v[pixels], u[pixels]] = [W - (7.5 - 4 * k) * cell, 1.5 * cell]
    v, u = np.mgrid[:H, :W]
    votes = at - np.stack([u, v], axis=-1)
    sizes = np.bincount(grouped(foreground, votes, cell, 5).ravel())[1:]
    return foreground, votes, cell, int(sizes.min())


def grouped(foreground, votes, cell, least, **own):
    """Number the things that pixels vote for, with steps of one's own.

    place: of a pixel (u, v) and its vote. whole: makes a cell's number of a fraction. outside: "clip" or "wrap" a vote
    beyond the cells, else it is dropped. sizes: rows and columns of cells, of the picture's shape. count: changes the
    counts. kernel: the three weights of the smoothing. border: how it goes on beyond the cells ("constant" is with 0).
    reach: cells around a peak. enough: what `least` is compared with, "near", "smoothed" or "cell". again: smooth again
    without the votes of what was found; cleared: cells around a peak that are set to 0 if not. last: the last of equal
    peaks. corners: whether the cells at a peak's corners are near. goes_on: looks on where a thing is too small.
    """
    v, u = np.nonzero(foreground > 0.5)
    places = own.get("place", lambda u, v, d: np.stack([u, v], axis=1) + d)(u, v, votes[v, u])
    column, row = own.get("whole", np.floor)(places / cell).astype(int).T
    rows, columns = own.get("sizes", lambda shape: -(-np.array(shape) // cell))(foreground.shape)
    row, column = bounded(row, rows, own.get("outside")), bounded(column, columns, own.get("outside"))
    left = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
    numbers, smooth = np.zeros(foreground.shape, int), None
    for _ in range(len(v) + 1):
        counts = np.zeros((rows, columns))
        np.add.at(counts, (row[left], column[left]), 1)
        if smooth is None or own.get("again", True):
            smooth = smoothed(own.get("count", lambda n: n)(counts), own)
        at = smooth.size - 1 - smooth[::-1, ::-1].argmax() if own.get("last") else smooth.argmax()
        r, c = divmod(int(at), columns)
        reach = own.get("reach", 1)
        near = left & (np.abs(row - r) <= reach) & (np.abs(column - c) <= reach)
        near &= own.get("corners", True) | (row == r) | (column == c)
        enough = {"near": near.sum(), "smoothed": smooth[r, c], "cell": counts[r, c]}[own.get("enough", "near")]
        if not near.any() or (enough < least and not own.get("goes_on")):
            break
        left &= ~near
        if enough >= least:
            numbers[v[near], u[near]] = numbers.max() + 1
        cleared = own.get("cleared", 0)
        smooth[max(r - cleared, 0) : r + cleared + 1, max(c - cleared, 0) : c + cleared + 1] = 0
    return numbers


def bounded(number, size, outside):
    """Cells' numbers along one axis, those beyond `size` as `outside` says."""
    if outside == "clip":
        return np.clip(number, 0, size - 1)
    return np.where((outside == "wrap") & (number < 0) & (number >= -size), number + size, number)


def smoothed(counts, own):
    """Counts, each with its neighbours, weighted by the kernel along both axes."""
    a, b, c = own.get("kernel", (1, 2, 1))
    padded = np.pad(counts, 1, mode=own.get("border", "constant"))
    across = a * padded[:, :-2] + b * padded[:, 1:-1] + c * padded[:, 2:]
    return a * across[:-2] + b * across[1:-1] + c * across[2:]
