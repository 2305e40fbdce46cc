"""06_back_projection.undistort: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.checker.question import Property, Question, wrong
from labkit.course.topics.t06_back_projection import K_SMALL, K_of, camera


def undistort(pixels, K, k):
    """Find where the pixels would be without the lens, whose distortion is (x, y) -> (1 + k1 r^2 + k2 r^4) (x, y)."""
    f, c = np.diagonal(K)[:2], K[:2, 2]
    seen = (pixels - c) / f
    ideal = seen
    for _ in range(30):
        r2 = (ideal**2).sum(axis=1, keepdims=True)
        ideal = seen / (1.0 + k[0] * r2 + k[1] * r2**2)
    return c + f * ideal


def distort(pixels, K, k):
    """What the lens does to the pixels of a camera without distortion."""
    f, c = np.diagonal(K)[:2], K[:2, 2]
    x = (pixels - c) / f
    r2 = (x**2).sum(axis=1, keepdims=True)
    return c + f * x * (1.0 + k[0] * r2 + k[1] * r2**2)


def _seen_pixels(rng):
    """Draw a camera, a lens that bends in or out, and pixels that it sees up to 35 degrees off its axis."""
    K, k = camera(rng, 120, 160), np.array([rng.choice([-0.25, 0.3]), rng.uniform(0.04, 0.1)])
    angle, r = rng.uniform(0.0, 2.0 * np.pi, 9), rng.uniform(0.2, 0.7, 9)
    ideal = K[:2, 2] + np.diagonal(K)[:2] * np.stack([r * np.cos(angle), r * np.sin(angle)], axis=1)
    return distort(ideal, K, k), K, k


K_LARGE = K_of(200.0, 400.0, 100.0, 0.0)  # the small camera with a hundred times as many pixels

QUESTION = Question(
    name="06_back_projection.undistort",
    reference=undistort,
    inputs=_seen_pixels,
    by_hand=(
        # 0.5 (1 + 0.4 / 4 + 0.05 / 16) = 0.5515625; another root, a complex one, has a smaller real part
        (np.array([[2.103125, 0.0], [1.0, 0.0]]), K_SMALL, np.array([0.4, 0.05])),
        # 0.5 (1 - 0.5 / 4 + 0.07 / 16) = 0.4396875 and 0.7 (1 - 0.5 * 0.49 + 0.07 * 0.2401) = 0.5402649; guesses come
        # near slowly here
        (np.array([[187.9375, 0.0], [100.0, 216.10596]]), K_LARGE, np.array([-0.5, 0.07])),
        (np.array([[3.0, 1.0]]), K_SMALL, np.array([0.0, 0.0])),
        # 0.5 (1 + 0.7 / 4 - 0.3 / 16) = 0.578125 and 0.7 (1 + 0.7 * 0.49 - 0.3 * 0.2401) = 0.889679; beyond 53 degrees
        # this lens folds, so each has a second, larger root
        (np.array([[215.625, 0.0], [277.9358, 0.0], [100.0, 231.25]]), K_LARGE, np.array([0.7, -0.3])),
        # 0.9 (1 - 0.25 * 0.81) = 0.71775 and 0.5 (1 - 0.25 / 4) = 0.46875; k2 is 0, and Newton's way needs care
        (np.array([[243.55, 0.0], [100.0, 187.5]]), K_LARGE, np.array([-0.25, 0.0])),
    ),
    rtol=1e-6,
    atol=1e-3,  # a thousandth of a pixel, as the lab promises
    points=4,
    properties=(
        Property(
            "the principal point stays where it is",
            lambda arguments, pixels: np.allclose(
                np.asarray(pixels)[np.all(arguments[0] == arguments[1][:2, 2], axis=1)], arguments[1][:2, 2], atol=1e-3
            ),
        ),
        Property(
            "put into the lens, your pixels come out as those that were seen",
            lambda arguments, pixels: np.allclose(distort(pixels, *arguments[1:]), arguments[0], atol=1e-3),
        ),
    ),
    forbidden=("cv2", "scipy"),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


@wrong(QUESTION, "You bent the pixels a second time: the lens did it once, and you are to take it back.")
def bent_again(pixels, K, k):
    return distort(pixels, K, k)


@wrong(
    QUESTION,
    "Put your answer into the lens: does the given pixel come out? r is the ideal point's radius, not the seen one's.",
)
def radius_as_seen(pixels, K, k):
    f, c = np.diagonal(K)[:2], K[:2, 2]
    seen = (pixels - c) / f
    r2 = (seen**2).sum(axis=1, keepdims=True)
    return c + f * seen / (1.0 + k[0] * r2 + k[1] * r2**2)


@wrong(QUESTION, "r is a radius without a unit, at depth 1: where do you go from pixels to x and y, and back?")
def normalised(pixels, K, k):
    return (undistort(pixels, K, k) - K[:2, 2]) / np.diagonal(K)[:2]


@wrong(QUESTION, "k1 stands beside r squared and k2 beside r to the fourth.")
def powers_too_low(pixels, K, k):
    f, c = np.diagonal(K)[:2], K[:2, 2]
    seen = ideal = (pixels - c) / f
    for _ in range(100):
        r = np.linalg.norm(ideal, axis=1, keepdims=True)
        ideal = seen / (1.0 + k[0] * r + k[1] * r**2)
    return c + f * ideal


@wrong(QUESTION, "Each pixel has its own r: add its x squared and its y squared, not those of all pixels.")
def one_radius_for_all(pixels, K, k):
    f, c = np.diagonal(K)[:2], K[:2, 2]
    seen = ideal = (pixels - c) / f
    for _ in range(30):
        r2 = (ideal**2).sum()
        ideal = seen / (1.0 + k[0] * r2 + k[1] * r2**2)
    return c + f * ideal


@wrong(QUESTION, "Minus signs in the factor undo the lens only roughly: guess r, divide what is seen, and repeat.")
def signs_exchanged(pixels, K, k):
    return distort(pixels, K, -k)


@wrong(QUESTION, "k2 stands beside r to the fourth: square r squared once more.")
def k2_beside_r_squared(pixels, K, k):
    return undistort(pixels, K, np.array([k[0] + k[1], 0.0]))


@wrong(QUESTION, "Rows have a focal length of their own: v = fy y_d + cy, and fy is the middle entry of K.")
def one_focal_length(pixels, K, k):
    return undistort(pixels, K_of(K[0, 0], K[0, 0], K[0, 2], K[1, 2]), k)
