"""06_back_projection.undistort: the question, and wrong answers with the hints that they earn."""

from functools import partial

import numpy as np

from labcourse.kinds import LONG, array, intrinsics
from labcourse.questions.t06_back_projection import K_SMALL, K_of, camera
from labgrader.question import Question, Untold, holds, wrong


def undistort(pixels, K, k):
    """Find where the pixels would be without the lens, whose distortion is (x, y) -> (1 + k1 r^2 + k2 r^4) (x, y)."""
    f, c = np.diagonal(K)[:2], K[:2, 2]
    seen = (pixels - c) / f
    ideal = seen
    for _ in range(60):
        r2 = (ideal**2).sum(axis=1, keepdims=True)
        ideal = seen / (1.0 + k[0] * r2 + k[1] * r2**2)
    return c + f * ideal


def distort(pixels, K, k):
    """What the lens does to the pixels of a camera without distortion."""
    f, c = np.diagonal(K)[:2], K[:2, 2]
    x = (pixels - c) / f
    r2 = (x**2).sum(axis=1, keepdims=True)
    return c + f * x * (1.0 + k[0] * r2 + k[1] * r2**2)


def _seen_pixels(rng, many=9):
    """Draw a camera of few or many pixels, a lens that bends in or out, and pixels up to 42 degrees off its axis."""
    K = camera(rng, 120, 160)
    k = np.array([rng.choice([-0.3, 0.4, rng.uniform(-0.3, 0.4)]), rng.choice([0.0, 0.1, rng.uniform(0.0, 0.1)])])
    K[:2] *= rng.choice([1.0, 15.0])
    angle, r = rng.uniform(0.0, 2.0 * np.pi, many), rng.uniform(0.2, 0.9, many)
    r[:2] = 0.9
    ideal = K[:2, 2] + np.diagonal(K)[:2] * np.stack([r * np.cos(angle), r * np.sin(angle)], axis=1)
    return distort(ideal, K, k), K, k


K_LARGE = K_of(200.0, 400.0, 100.0, 0.0)  # the small camera with a hundred times as many pixels

QUESTION = Question(
    reference=undistort,
    kinds={
        "pixels": array("N 2", -5000.0, 6000.0, says="-5000 to 6000"),
        "K": intrinsics(free=("*at ?2, *", "a thousandth*")),  # the row 0 0 1, and a skew of a thousandth
        "k": array(
            "2",
            says=("k1 from -0.3 to 0.4", "k2 from 0 to 0.1"),
            form=lambda rng, _: rng.uniform((-0.3, 0.0), (0.4, 0.1)),
        ),
    },
    inputs=(_seen_pixels, partial(_seen_pixels, many=LONG)),
    by_hand=(
        (np.array([[2.1, 0.0]]), K_SMALL, np.array([0.4, 0.0])),
        # 0.5 (1 + 0.4 / 4 + 0.05 / 16) = 0.5515625; another root, a complex one, has a smaller real part
        (np.array([[2.103125, 0.0], [1.0, 0.0]]), K_SMALL, np.array([0.4, 0.05])),
        # 0.9 (1 - 0.3 * 0.81) = 0.6813 and 0.7 (1 - 0.3 * 0.49) = 0.5971; k2 is 0, guesses come near slowly, and beyond
        # 46 degrees this lens folds, so that each pixel has a second root
        (np.array([[236.26, 0.0], [100.0, 238.84]]), K_LARGE, np.array([-0.3, 0.0])),
        (np.array([[2.0, 1.0]]), K_SMALL, np.array([0.0, 0.0])),
        # 0.9 (1 + 0.4 * 0.81 + 0.1 * 0.6561) = 1.250649
        (
            np.array([[-4502.596, 3000.0], [500.0, 5501.298]]),
            K_of(4000.0, 2000.0, 500.0, 3000.0),
            np.array([0.4, 0.1]),
        ),
        # 0.5 (1 - 0.3 / 4 + 0.1 / 16) = 0.465625
        (np.array([[193.125, 0.0], [100.0, 186.25]]), K_LARGE, np.array([-0.3, 0.1])),
        # 0.9 (1 - 0.3 * 0.81) = 0.6813 again and 0.85 (1 - 0.3 * 0.7225) = 0.6657625; with f = 4000 a thousandth of a
        # pixel is 2.5e-7 of the ray, and half a thousandth of u becomes two by the lens
        (
            np.array([[3043.90046, 700.0], [1000.0, 3363.05]]),
            K_of(3000.0, 4000.0, 1000.00046, 700.0),
            np.array([-0.3, 0.0]),
        ),
    ),
    edges=1,
    random_cases=12,
    rtol=0.0,
    atol=1e-3,  # a thousandth of a pixel, as the lab promises
    points=4,
    forbidden=("cv2", "scipy"),
)


@holds("the principal point stays where it is")
def principal_point_stays(pixels, K, k, straight):
    return np.allclose(straight[np.all(pixels == K[:2, 2], axis=1)], K[:2, 2], atol=1e-3)


@holds("put into the lens, your pixels come out as those that were seen")
def distorted_again_they_are_what_was_seen(pixels, K, k, straight):
    return np.allclose(distort(straight, K, k), pixels, atol=1e-3)


# ---------------------------------------------------------------------------------------------------- wrong answers


def divided_again(pixels, K, factor, rounds=100, radius=1.0):
    """The seen pixels, divided again and again by a lens's factor of the radius that they had in the last round.

    radius: what x and y are multiplied by for it. Raises Untold where a hundred rounds come to no end.
    """
    f, c = np.diagonal(K)[:2], K[:2, 2]
    seen = ideal = before = (pixels - c) / f
    for _ in range(rounds):
        before, ideal = ideal, seen / factor(np.linalg.norm(radius * ideal, axis=1, keepdims=True))
    if rounds == 100 and not np.allclose(f * before, f * ideal, rtol=0.0, atol=1e-6):
        raise Untold
    return c + f * ideal


def lens(k):
    """The factor of a radius."""
    return lambda r: 1.0 + k[0] * r**2 + k[1] * r**4


@wrong("You distorted the pixels a second time: the lens did it once, and you should undo it.")
def bent_again(pixels, K, k):
    return distort(pixels, K, k)


@wrong(
    "Put your answer into the lens: does the given pixel come out? r is the ideal point's radius, not the seen one's."
)
def radius_as_seen(pixels, K, k):
    return divided_again(pixels, K, lambda r: 1.0 + k[0] * r**2 + k[1] * r**4, rounds=1)


@wrong(
    "Each round divides the last guess again, so the factors pile up. Which numbers should be divided?",
    rounds=(10, 20, 50, 100),
)
def guess_divided_again(pixels, K, k, rounds):
    f, c = np.diagonal(K)[:2], K[:2, 2]
    guess = (pixels - c) / f
    for _ in range(rounds):
        r2 = (guess**2).sum(axis=1, keepdims=True)
        guess = guess / (1.0 + k[0] * r2 + k[1] * r2**2)
    return c + f * guess


@wrong("r is a radius without a unit, at depth 1: where do you go from pixels to x and y, and back?")
def normalised(pixels, K, k):
    return (undistort(pixels, K, k) - K[:2, 2]) / np.diagonal(K)[:2]


@wrong("x is divided by fx and y by fy: by what do you divide each of them before you square it?")
def one_focal_length_for_the_radius(pixels, K, k):
    f = np.sqrt(K[0, 0] * K[1, 1])
    return divided_again(pixels, K_of(f, f, *K[:2, 2]), lens(k))


@wrong("r is a radius without a unit, at depth 1: are your x and y still pixels where you square them?")
def radius_in_pixels(pixels, K, k):
    return divided_again(pixels, K, lens(k), radius=np.diagonal(K)[:2])


@wrong("The lens has two terms: r to the fourth bends, too, by k2. Where do you use it?")
def without_k2(pixels, K, k):
    return divided_again(pixels, K, lens((k[0], 0.0)))


@wrong("k1 multiplies r squared, and k2 r to the fourth.")
def powers_too_low(pixels, K, k):
    return divided_again(pixels, K, lambda r: 1.0 + k[0] * r + k[1] * r**2)


@wrong("Each pixel has its own r: add its x squared and its y squared, not those of all pixels.")
def one_radius_for_all(pixels, K, k):
    return divided_again(pixels, K, lambda r: 1.0 + k[0] * (r**2).sum() + k[1] * (r**2).sum() ** 2)


@wrong("Minus signs in the factor undo the lens only roughly: guess r, divide what is seen, and repeat.")
def signs_exchanged(pixels, K, k):
    return distort(pixels, K, -k)


@wrong("k2 multiplies r to the fourth: square r squared once more.")
def k2_beside_r_squared(pixels, K, k):
    return undistort(pixels, K, np.array([k[0] + k[1], 0.0]))


@wrong("Rows have their own focal length: v = fy y_d + cy, and fy is the middle entry of K.")
def one_focal_length(pixels, K, k):
    return divided_again(pixels, K_of(K[0, 0], K[0, 0], K[0, 2], K[1, 2]), lens(k))


@wrong("Columns have their own focal length: u = fx x_d + cx, and fx is the first entry of K.")
def focal_length_of_the_rows(pixels, K, k):
    return divided_again(pixels, K_of(K[1, 1], K[1, 1], K[0, 2], K[1, 2]), lens(k))


@wrong("A series is right only for small r: put your pixels into the lens, do the given ones come out?")
def by_a_series(pixels, K, k):
    series = (-k[0], 3.0 * k[0] ** 2 - k[1])
    return distort(pixels, K, series)


@wrong("By how many pixels would one more round change your answer? A thousandth counts.", rounds=(2, 3, 5, 10))
def too_few(pixels, K, k, rounds):
    return divided_again(pixels, K, lambda r: 1.0 + k[0] * r**2 + k[1] * r**4, rounds)


@wrong("Newton's step divides by the slope of the function that should become 0. What is the derivative of k1 r^3?")
def newton_with_a_wrong_slope(pixels, K, k):
    f, c = np.diagonal(K)[:2], K[:2, 2]
    x = (pixels - c) / f
    seen = r = np.linalg.norm(x, axis=1, keepdims=True)
    for _ in range(5):
        r = r - (r + k[0] * r**3 + k[1] * r**5 - seen) / (1.0 + 2.0 * k[0] * r + 4.0 * k[1] * r**3)
    return c + f * x * np.where(seen > 0.0, r / np.where(seen > 0.0, seen, 1.0), 1.0)


@wrong("k2 multiplies r to the fourth: which power of r do you use?")
def k2_beside_r_cubed(pixels, K, k):
    return divided_again(pixels, K, lambda r: 1.0 + k[0] * r**2 + k[1] * r**3)
