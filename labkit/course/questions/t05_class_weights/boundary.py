"""05_class_weights.boundary: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.questions.question import Question, wrong
from labkit.course.questions.t05_class_weights import draw_weights


def boundary(means, sigma, counts, w):
    """Find the feature value at which two Gaussian classes of one width are decided alike, weights included."""
    odds = counts[0] * w[0] / (counts[1] * w[1])
    return float((means[0] + means[1]) / 2 + sigma**2 / (means[1] - means[0]) * np.log(odds))


def draw_gaussians(rng):
    """Means, the one standard deviation, pixels of each class, weights."""
    means = np.array([rng.normal(), rng.normal() + 3.0])
    counts = np.array([rng.integers(5000, 9000), rng.integers(20, 200)])
    return means[:: rng.choice([1, -1])], float(rng.uniform(0.5, 2.0)), counts, draw_weights(rng, 2)


QUESTION = Question(
    name="05_class_weights.boundary",
    reference=boundary,
    inputs=draw_gaussians,
    by_hand=(
        (np.array([0.0, 2.0]), 1.0, np.array([98, 2]), np.array([1.0, 49.0])),
        (np.array([0.0, 2.0]), 0.5, np.array([98, 2]), np.array([1.0, 1.0])),
        (np.array([3.0, -1.0]), 2.0, np.array([10, 30]), np.array([4.0, 0.5])),
    ),
    forbidden=("scipy",),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


@wrong(QUESTION, "The middle is right only if both classes count alike.")
def boundary_midpoint(means, sigma, counts, w):
    return float(means[0] + means[1]) / 2


@wrong(QUESTION, "The heavier a class, the farther from its own mean does the boundary lie.")
def boundary_of_heights(means, sigma, counts, w):
    odds = counts[0] * w[0] / (counts[1] * w[1])
    return float((means[0] + means[1]) / 2 - sigma**2 / (means[1] - means[0]) * np.log(odds))


@wrong(QUESTION, "The exponent of a Gaussian has sigma squared in it.")
def boundary_sigma(means, sigma, counts, w):
    return boundary(means, np.sqrt(sigma), counts, w)


@wrong(QUESTION, "Class 1 may lie on the left: exchange the means, and the picture is mirrored.")
def boundary_distance(means, sigma, counts, w):
    step = np.log(counts[0] * w[0] / (counts[1] * w[1]))
    return float((means[0] + means[1]) / 2 + sigma**2 / abs(means[1] - means[0]) * step)


@wrong(QUESTION, "Take the logarithm of both sides before you solve for x.")
def boundary_ratio(means, sigma, counts, w):
    odds = counts[0] * w[0] / (counts[1] * w[1])
    return float((means[0] + means[1]) / 2 + sigma**2 / (means[1] - means[0]) * odds)
