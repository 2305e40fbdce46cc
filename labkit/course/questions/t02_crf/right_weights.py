"""02_crf.right_weights: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.questions.question import Property, Question, wrong


def right_weights(image, lam, sigma_I, sigma_p):
    """Weigh each pixel's pair with its right neighbour by the colour difference, in the image's own units."""
    difference = np.diff(image.astype(np.float64), axis=1)
    squared = (difference**2).sum(axis=2)
    return lam * np.exp(-squared / (2.0 * sigma_I**2) - 1.0 / (2.0 * sigma_p**2))


def _image(rng):
    """Draw colours so far apart that bytes wrap round, and a sigma_I that lets every pair count all the same."""
    image = rng.integers(0, 256, (4, 6, 3)).astype(np.uint8)
    return image, float(rng.uniform(0.5, 3.0)), float(rng.uniform(70.0, 120.0)), float(rng.uniform(0.6, 1.8))


QUESTION = Question(
    name="02_crf.right_weights",
    reference=right_weights,
    inputs=_image,
    by_hand=(
        (np.array([[[120, 90, 60], [123, 94, 60]]], np.uint8), 2.0, 5.0, 1.0),
        (np.array([[[250, 5, 10], [245, 10, 10], [245, 10, 30]]], np.uint8), 1.0, 10.0, 2.0),
        (np.full((3, 2, 3), 77, np.uint8), 1.5, 8.0, 0.5),
    ),
    points=2,
    properties=(
        Property("no weight is negative", lambda given, w: bool(np.min(w) >= 0.0)),
        Property("no weight is above lam", lambda given, w: bool(np.max(w) <= given[1] + 1e-9)),
    ),
    forbidden=("labkit",),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def gaussian(squared, lam, sigma_I, sigma_p):
    """The formula for given squared differences, out of which wrong answers are made."""
    return lam * np.exp(-squared / (2.0 * sigma_I**2) - 1.0 / (2.0 * sigma_p**2))


def squares_right(image, axis=1):
    """Squared colour differences of neighbours."""
    return (np.diff(image.astype(np.float64), axis=axis) ** 2).sum(axis=2)


@wrong(QUESTION, "Try np.uint8(5) - np.uint8(10): bytes have no negative numbers, so turn the image into floats first.")
def wrapped_bytes(image, lam, sigma_I, sigma_p):
    """Subtract and square bytes."""
    return gaussian((np.diff(image, axis=1) ** 2).sum(axis=2, dtype=float), lam, sigma_I, sigma_p)


@wrong(QUESTION, "np.uint8(5) - np.uint8(10) is 251 already: turn the image into floats before you subtract.")
def converted_late(image, lam, sigma_I, sigma_p):
    """Subtract bytes, and square floats."""
    return gaussian((np.diff(image, axis=1).astype(float) ** 2).sum(axis=2), lam, sigma_I, sigma_p)


@wrong(QUESTION, "A grid H by W has H (W - 1) pairs that go to the right: which axis counts columns?")
def pairs_below(image, lam, sigma_I, sigma_p):
    """The pairs of the other direction."""
    return gaussian(squares_right(image, axis=0), lam, sigma_I, sigma_p)


@wrong(QUESTION, "Look at the denominators again: what stands before sigma squared in a Gaussian?")
def without_the_2(image, lam, sigma_I, sigma_p):
    """A Gaussian without the 2 in its exponent."""
    return lam * np.exp(-squares_right(image) / sigma_I**2 - 1.0 / sigma_p**2)


@wrong(QUESTION, "The exponent must have no unit: squared grey levels divided by what?")
def sigma_not_squared(image, lam, sigma_I, sigma_p):
    """An exponent that has a unit."""
    return lam * np.exp(-squares_right(image) / (2.0 * sigma_I) - 1.0 / (2.0 * sigma_p))


@wrong(QUESTION, "The squared length of a vector is a sum over its components: is yours a mean?")
def mean_of_channels(image, lam, sigma_I, sigma_p):
    """A third of the squared length."""
    return gaussian(squares_right(image) / image.shape[2], lam, sigma_I, sigma_p)


@wrong(QUESTION, "Red against green of the same brightness is an edge too: which comes first, the square or the sum?")
def brightness_only(image, lam, sigma_I, sigma_p):
    """Channels added before the difference is squared."""
    return gaussian(np.diff(image.sum(axis=2, dtype=float), axis=1) ** 2, lam, sigma_I, sigma_p)


@wrong(QUESTION, "What happened to sigma_p? These neighbours are one pixel apart.")
def without_distance(image, lam, sigma_I, sigma_p):
    """sigma_p forgotten."""
    return lam * np.exp(-squares_right(image) / (2.0 * sigma_I**2))
