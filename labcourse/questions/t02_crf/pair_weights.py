"""02_crf.pair_weights: the question, and wrong answers with the hints that they earn."""

from functools import partial

import numpy as np

from labcourse.kinds import LONG, number
from labcourse.kinds import image as colours
from labcourse.questions.t02_crf import PAIRS
from labgrader.question import Question, wrong


def pair_weights(image, lam, sigma_I, sigma_p):
    """Weigh each pixel's pairs with the neighbours to the right, below, below right and below left."""
    H, W = image.shape[:2]
    colours = image.astype(np.float64)
    weights = np.zeros((4, H, W))
    for d, (down, right) in enumerate(((0, 1), (1, 0), (1, 1), (1, -1))):
        left, width = max(-right, 0), W - abs(right)
        first = colours[: H - down, left : left + width]
        second = colours[down:, left + right : left + right + width]
        squared = ((first - second) ** 2).sum(axis=2)
        exponent = squared / (2.0 * sigma_I**2) + (down**2 + right**2) / (2.0 * sigma_p**2)
        weights[d, : H - down, left : left + width] = lam * np.exp(-exponent)
    return weights


def _image(rng, shape=(4, 6), lam=(0.5, 3.0), sigma_I=(70.0, 120.0), sigma_p=(0.8, 1.8)):
    """Draw colours so far apart that bytes wrap round, and a sigma_I that lets every pair count all the same."""
    picture = rng.integers(0, 256, (*shape, 3)).astype(np.uint8)
    return picture, *(float(rng.uniform(*ends)) for ends in (lam, sigma_I, sigma_p))


QUESTION = Question(
    reference=pair_weights,
    kinds={
        "image": colours(free=("reversed along 3", "unique along 3")),  # channels count alike
        "lam": number(0.0, 1000.0, says="0 to 1000"),
        "sigma_I": number(0.5, 1000.0, says="0.5 to 1000"),
        "sigma_p": number(0.5, 100.0, says="0.5 to 100", free=("nine tenths*",)),
    },
    inputs=(
        _image,
        _image,
        partial(_image, shape=(1, LONG), lam=(960.0, 1000.0)),
        partial(_image, shape=(LONG, 1), sigma_I=(960.0, 1000.0)),
        partial(_image, shape=(3, 3), sigma_p=(96.0, 100.0)),
    ),
    random_cases=5,
    by_hand=(
        (np.array([[[120, 90, 60], [123, 94, 60]]], np.uint8), 2.0, 5.0, 1.0),
        (np.array([[[250, 5, 10], [245, 10, 10]], [[245, 10, 30], [240, 5, 20]]], np.uint8), 1.0, 10.0, 2.0),
        (np.full((3, 2, 3), 77, np.uint8), 1.5, 8.0, 0.5),
        (np.array([[[7, 7, 7], [8, 7, 7]]], np.uint8), 1.0, 0.5004, 0.5),
        (np.array([[[7, 7, 7], [8, 7, 7]]], np.uint8), 0.0, 5.0, 1.0),
    ),
    edges=2,
    points=3,
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def inside(shape):
    """1 where a pair stays in the image, 0 where it leaves it."""
    H, W = shape
    v, u = np.indices(shape)
    return np.stack([(v + down < H) & (u + right >= 0) & (u + right < W) for down, right in PAIRS]).astype(float)


def differences(image):
    """Colour differences of each pixel and the neighbour of each pair, (4, H, W, 3); around the border on the ring."""
    image = image.astype(float)
    return np.stack([image - np.roll(image, (-down, -right), (0, 1)) for down, right in PAIRS])


def gaussian(squared, lam, sigma_I, sigma_p, diagonal=2.0, ring=False):
    """The formula for given squared differences, out of which wrong answers are made."""
    distance = np.array([1.0, 1.0, diagonal, diagonal])[:, None, None]
    w = lam * np.exp(-squared / (2.0 * sigma_I**2) - distance / (2.0 * sigma_p**2))
    return w if ring else w * inside(w.shape[1:])


def squares(image):
    """Squared lengths of the colour differences."""
    return (differences(image) ** 2).sum(axis=3)


@wrong("Try np.uint8(5) - np.uint8(10): bytes have no negative numbers, so turn the image into floats first.")
def wrapped_bytes(image, lam, sigma_I, sigma_p):
    """Subtract and square bytes."""
    byte = differences(image).astype(int).astype(np.uint8)
    return gaussian((byte**2).sum(axis=3, dtype=float), lam, sigma_I, sigma_p)


@wrong("16 bits hold numbers up to 32,767, and 200 * 200 is more: turn the image into floats.")
def wrapped_words(image, lam, sigma_I, sigma_p):
    return gaussian((differences(image).astype(np.int16) ** 2).sum(axis=3, dtype=float), lam, sigma_I, sigma_p)


@wrong("lam multiplies the exponential and is not in its exponent: the weight of two like pixels at distance 0 is lam.")
def lam_in_the_exponent(image, lam, sigma_I, sigma_p):
    return gaussian(squares(image), 1.0, sigma_I, sigma_p, ring=True) ** lam * inside(image.shape[:2])


@wrong("np.uint8(5) - np.uint8(10) is 251 already: turn the image into floats before you subtract.")
def converted_late(image, lam, sigma_I, sigma_p):
    """Subtract bytes, and square floats."""
    return gaussian(((differences(image) % 256) ** 2).sum(axis=3), lam, sigma_I, sigma_p)


@wrong("How far apart are the centres of two pixels that touch at a corner? The exponent holds its square.")
def diagonals_as_near(image, lam, sigma_I, sigma_p):
    """All eight neighbours at distance 1."""
    return gaussian(squares(image), lam, sigma_I, sigma_p, diagonal=1.0)


@wrong("The exponent holds the squared distance: for a diagonal the square of the square root of 2.")
def distance_not_squared(image, lam, sigma_I, sigma_p):
    """The distance itself in the exponent."""
    return gaussian(squares(image), lam, sigma_I, sigma_p, diagonal=np.sqrt(2.0))


@wrong("Has the last column a right neighbour? A pair that leaves the image has weight 0.")
def closed_to_a_ring(image, lam, sigma_I, sigma_p):
    """np.roll without a thought for the border."""
    return gaussian(squares(image), lam, sigma_I, sigma_p, ring=True)


@wrong("weights[3] joins a pixel with the one below it to the left: in which column does such a pair begin?")
def kept_at_the_left_end(image, lam, sigma_I, sigma_p):
    """The fourth kind of pair stored one column to the left, at its lower pixel's column."""
    w = gaussian(squares(image), lam, sigma_I, sigma_p)
    return np.concatenate([w[:3], np.roll(w[3:], -1, axis=2)])


@wrong("Look at the denominators again: what multiplies sigma squared in a Gaussian?")
def without_the_2(image, lam, sigma_I, sigma_p):
    """A Gaussian without the 2 in its exponent."""
    return gaussian(squares(image), lam, sigma_I / np.sqrt(2.0), sigma_p / np.sqrt(2.0))


@wrong("The exponent must have no unit: squared grey levels divided by what?")
def sigma_not_squared(image, lam, sigma_I, sigma_p):
    """An exponent that has a unit."""
    return gaussian(squares(image), lam, np.sqrt(sigma_I), np.sqrt(sigma_p))


@wrong("The squared length of a vector is a sum over its components: is yours a mean?")
def mean_of_channels(image, lam, sigma_I, sigma_p):
    """A third of the squared length."""
    return gaussian(squares(image) / image.shape[2], lam, sigma_I, sigma_p)


@wrong("Red against green of the same brightness is an edge too: which comes first, the square or the sum?")
def brightness_only(image, lam, sigma_I, sigma_p):
    """Channels added before the difference is squared."""
    return gaussian(differences(image).sum(axis=3) ** 2, lam, sigma_I, sigma_p)


@wrong("Square the difference of each channel first, then add: 3 and 4 make 9 + 16 = 25, not 7 squared.")
def added_before_squared(image, lam, sigma_I, sigma_p):
    return gaussian(np.abs(differences(image)).sum(axis=3) ** 2, lam, sigma_I, sigma_p)


@wrong("What happened to sigma_p? Neighbours at a corner are farther apart than those at an edge.")
def without_distance(image, lam, sigma_I, sigma_p):
    """sigma_p forgotten."""
    return gaussian(squares(image), lam, sigma_I, np.inf)


@wrong("The squared distance of two pixels that touch at a corner is 2: is yours 4?")
def diagonals_by_steps(image, lam, sigma_I, sigma_p):
    """A step down and a step aside taken for a distance of 2."""
    return gaussian(squares(image), lam, sigma_I, sigma_p, diagonal=4.0)


@wrong("The exponent holds the squared colour difference: does yours hold the difference itself?")
def length_not_squared(image, lam, sigma_I, sigma_p):
    """The length of the colour difference in the exponent."""
    return gaussian(np.sqrt(squares(image)), lam, sigma_I, sigma_p)


@wrong("In column 0, u - 1 is -1, and in NumPy the index -1 is the last column: which pixels must you skip?")
def column_before_the_first(image, lam, sigma_I, sigma_p):
    """A loop that skips what is too large and forgets what is below 0."""
    kept = inside(image.shape[:2])
    kept[3, :-1, 0] = 1.0
    return gaussian(squares(image), lam, sigma_I, sigma_p, ring=True) * kept


@wrong(
    "One exponential contains both terms, and lam multiplies it: exp(a) + exp(b) is not exp(a + b).", share=(1.0, 0.5)
)
def two_exponentials_added(image, lam, sigma_I, sigma_p, share):
    near = gaussian(np.zeros_like(squares(image)), lam, sigma_I, sigma_p)
    return share * (gaussian(squares(image), lam, sigma_I, np.inf) + near)


@wrong("sigma_I is a difference of colours from 0 to 255: on which scale are yours?")
def colours_up_to_1(image, lam, sigma_I, sigma_p):
    return gaussian(squares(image) / 255.0**2, lam, sigma_I, sigma_p)


@wrong("Is your sum of squares still in bytes? They have no negative numbers: begin with floats.")
def negated_without_a_sign(image, lam, sigma_I, sigma_p):
    """The minus of the exponent before an unsigned sum: it becomes almost 2^64."""
    byte = differences(image).astype(int).astype(np.uint8)
    with np.errstate(over="ignore"):
        weights = gaussian(-(-(byte**2).sum(axis=3)).astype(float), lam, sigma_I, sigma_p, ring=True)
    return np.where(inside(image.shape[:2]), weights, 0.0)


@wrong("In a grey image, red and green of one brightness are alike: how many channels does your difference have?")
def grey_image(image, lam, sigma_I, sigma_p):
    return gaussian(differences(image).mean(axis=3) ** 2, lam, sigma_I, sigma_p)


@wrong("np.uint8(5) - np.uint8(10) is 251 already: turn the image into floats before you subtract.")
def converted_late_the_other_way_round(image, lam, sigma_I, sigma_p):
    """The pixel subtracted from its neighbour, in bytes."""
    return gaussian(((-differences(image) % 256) ** 2).sum(axis=3), lam, sigma_I, sigma_p)


@wrong("weights[3] is stored at the upper pixel of its pair: at which of the two do you store it?")
def kept_at_the_lower_pixel(image, lam, sigma_I, sigma_p):
    """The fourth kind of pair from each pixel to the one above it on the right."""
    w = gaussian(squares(image), lam, sigma_I, sigma_p)
    return np.concatenate([w[:3], np.roll(w[3:], (1, -1), axis=(1, 2))])


@wrong("Two times sigma squared: what is squared in your denominator?")
def the_2_squared_too(image, lam, sigma_I, sigma_p):
    return gaussian(squares(image), lam, sigma_I * np.sqrt(2.0), sigma_p * np.sqrt(2.0))


@wrong("Neighbours touch at corners, too: which of the four kinds of pairs are 0 everywhere in yours?")
def without_diagonals(image, lam, sigma_I, sigma_p):
    w = gaussian(squares(image), lam, sigma_I, sigma_p)
    w[2:] = 0.0
    return w


@wrong("Python reads a / 2 * b as (a / 2) * b: on which side of the fraction line is your sigma?")
def multiplied_by_sigma(image, lam, sigma_I, sigma_p):
    return gaussian(squares(image), lam, 1.0 / sigma_I, 1.0 / sigma_p)


@wrong("The last row has pairs to the right, the last column pairs down: one range for all four kinds is too short.")
def last_row_and_column_left_out(image, lam, sigma_I, sigma_p):
    weights = pair_weights(image, lam, sigma_I, sigma_p).copy()
    weights[:, -1], weights[:, :, -1] = 0.0, 0.0
    return weights


@wrong("Outside the image there is no neighbour: which pixel does a row or column that you clip lead to?")
def clipped_at_the_border(image, lam, sigma_I, sigma_p):
    """A neighbour beyond the border taken for the nearest pixel inside."""
    (H, W, _), colours = image.shape, image.astype(float)
    v, u = np.indices((H, W))
    near = [colours[np.clip(v + down, 0, H - 1), np.clip(u + right, 0, W - 1)] for down, right in PAIRS]
    return gaussian(((colours - near) ** 2).sum(axis=3), lam, sigma_I, sigma_p, ring=True)


@wrong(
    "One of the two terms is not as in the formula: each square is divided by 2 sigma^2, of its own sigma.",
    of=("colour / 2 sigma", "colour / sigma^2", "place / 2 sigma", "place / sigma^2"),
)
def another_divisor(image, lam, sigma_I, sigma_p, of):
    colour, halved = of.startswith("colour"), of.endswith("sigma^2")
    sigma = sigma_I if colour else sigma_p
    other = sigma / np.sqrt(2.0) if halved else np.sqrt(sigma)
    return gaussian(squares(image), lam, *((other, sigma_p) if colour else (sigma_I, other)))
