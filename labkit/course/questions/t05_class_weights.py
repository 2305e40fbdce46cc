"""Questions of topic 05: weights and their gradient, the two means, where training ends, and how to undo it.

Sections 3 and 6 and problem 5 of the text.
"""

import numpy as np

from labkit.course.questions import answers_05 as answers
from labkit.course.questions.question import Misconception, Property, Question


def draw_weights(rng, C):
    """Weights of C classes, from about 0.1 to 20, no two alike."""
    return np.exp(rng.uniform(-2.0, 3.0, C))


# ------------------------------------------------------------------------------------------- class weights


def class_weights(counts, power):
    """Weigh classes by counts ** -power, with mean weight 1 over all pixels; a class without pixels gets 1."""
    present = counts > 0
    w = np.ones(len(counts))
    w[present] = counts[present] ** -power
    w[present] *= counts.sum() / (counts @ w)
    return w


def draw_counts(rng):
    """Pixels of four to six classes, one of them absent, and a power."""
    counts = (10.0 ** rng.uniform(1.0, 5.0, rng.integers(4, 7))).astype(np.int64)
    counts[rng.integers(len(counts))] = 0
    return counts, float(rng.uniform(0.2, 1.2))


CLASS_WEIGHTS = Question(
    name="05_class_weights.class_weights",
    reference=class_weights,
    inputs=draw_counts,
    by_hand=(
        (np.array([900, 100, 0]), 1.0),
        (np.array([900, 100, 25]), 0.5),
        (np.array([1, 7, 0]), 0.5),
        (np.array([3, 40]), 0.0),
    ),
    properties=(
        Property(
            "the mean weight over all pixels is 1",
            lambda arguments, w: bool(np.isclose(arguments[0] @ w, arguments[0].sum(), rtol=1e-3)),
        ),
    ),
    misconceptions=(
        Misconception(
            "not scaled", answers.weights_not_scaled, "What is the mean weight over the pixels? It should be 1."
        ),
        Misconception(
            "sum of 1",
            answers.weights_summing_to_one,
            "Not the weights are to sum to one: their mean over pixels is 1.",
        ),
        Misconception(
            "mean over classes",
            answers.weights_of_mean_one_over_classes,
            "A frequent class has more pixels: take the mean over pixels, not over classes.",
        ),
        Misconception(
            "heavier the more pixels",
            answers.weights_of_frequency,
            "Which class should weigh more, the rare or the frequent?",
        ),
        Misconception(
            "power ignored", answers.weights_always_inverse, "For power 0 all weights are 1: does yours use the power?"
        ),
        Misconception(
            "absent class weighed",
            answers.weights_of_absent_classes,
            "A class without pixels gets 1, whatever the power.",
        ),
        Misconception(
            "division by zero",
            answers.weights_with_infinity,
            "What becomes of 0 to a negative power? Leave such classes out.",
        ),
        Misconception(
            "absent class at 0",
            answers.weights_zero_for_absent,
            "A weight must be above 0: a class without pixels gets 1, the mean.",
        ),
    ),
    alternatives=(answers.weights_loops, answers.weights_einsum, answers.weights_torch, answers.weights_float32),
    forbidden=("sklearn",),
)


# -------------------------------------------------------------------------------- the weighted gradient


def weighted_grad(z, y, w):
    """Differentiate the weighted, summed cross-entropy by each logit; 0 where the label is 255."""
    e = np.exp(z - z.max(axis=-1, keepdims=True))
    p = e / e.sum(axis=-1, keepdims=True)
    Y = y[..., None] == np.arange(len(w))
    return (Y @ w)[..., None] * (p - Y)


def draw_pixels(rng):
    """Logits (H, W, C), labels (H, W), some of them ignored, and weights."""
    H, W, C = int(rng.integers(2, 4)), int(rng.integers(4, 6)), int(rng.integers(6, 8))
    y = rng.integers(0, C, (H, W)).astype(np.uint8)
    y[rng.random(y.shape) < 0.2] = 255
    y[0, 0], y[1, 1], y[1, 2] = 255, C - 1, 0
    return 2.0 * rng.normal(size=(H, W, C)), y, draw_weights(rng, C)


TOY = np.array([[2.0, 1.0, -1.0]])
SURE = np.array([[0.0, 1000.0, 3.0], [-1000.0, -1001.0, -1005.0]])  # exp overflows, or rounds everything to 0

WEIGHTED_GRAD = Question(
    name="05_class_weights.weighted_grad",
    reference=weighted_grad,
    inputs=draw_pixels,
    by_hand=(
        (TOY, np.array([1], np.uint8), np.array([1.0, 10.0, 3.0])),
        (SURE, np.array([0, 255], np.uint8), np.array([2.0, 5.0, 0.5])),
        (SURE, np.array([2, 1], np.uint8), np.array([2.0, 5.0, 0.5])),
    ),
    points=3,
    properties=(
        Property(
            "the gradient of each pixel sums to 0",
            lambda arguments, grad: bool(np.allclose(grad.sum(axis=-1), 0.0, atol=1e-3)),
        ),
    ),
    misconceptions=(
        Misconception("no weights", answers.grad_of_plain_loss, "All weights 1 and all weights 10: does yours change?"),
        Misconception(
            "weight of the column",
            answers.grad_weighted_by_column,
            "One pixel has one weight, that of its true class, and it scales all of its entries alike.",
        ),
        Misconception(
            "weight on the one-hot",
            answers.grad_weights_in_the_one_hot,
            "The weight multiplies the whole loss of a pixel, so it multiplies p as well.",
        ),
        Misconception(
            "weight in the softmax",
            answers.grad_weights_in_the_softmax,
            "The probabilities do not know the weights; only the loss does.",
        ),
        Misconception(
            "divided by the sum of weights",
            answers.grad_over_sum_of_weights,
            "That is what PyTorch's mean does; here the loss is the text's sum.",
        ),
        Misconception(
            "mean", answers.grad_of_mean, "The loss is summed over the pixels: your gradient is N times too small."
        ),
        Misconception(
            "ignored pixels", answers.grad_of_ignored_too, "A pixel labelled 255 has no class, so it has no weight."
        ),
        Misconception(
            "divided by the weight", answers.grad_divided_by_weights, "A heavier pixel should pull more, not less."
        ),
    ),
    alternatives=(
        answers.weighted_grad_one_hot,
        answers.weighted_grad_loops,
        answers.weighted_grad_torch,
        answers.weighted_grad_float32,
    ),
    forbidden=("scipy",),
)


# ----------------------------------------------------------------------------------------- the two means


def two_means(z, y, w):
    """Divide the weighted loss by the number of counted pixels, and by the sum of their weights, as PyTorch does."""
    counted = y != 255
    z, y = z[counted].T, y[counted]  # (C, N): a row a class
    log_p = z - np.logaddexp.reduce(z)
    loss = -(w[y] @ log_p[y, np.arange(len(y))])
    return float(loss / len(y)), float(loss / w[y].sum())


TWO_MEANS = Question(
    name="05_class_weights.two_means",
    reference=two_means,
    inputs=draw_pixels,
    by_hand=(
        (TOY, np.array([1], np.uint8), np.array([1.0, 10.0, 3.0])),
        (SURE, np.array([0, 255], np.uint8), np.array([2.0, 5.0, 0.5])),
    ),
    misconceptions=(
        Misconception("swapped", answers.means_swapped, "The number of pixels first, then the sum of their weights."),
        Misconception(
            "the same twice",
            answers.means_the_same,
            "Let one pixel of weight 10 be the whole batch: its second mean is as if it had no weight.",
        ),
        Misconception(
            "ignored pixels in the number",
            answers.means_over_all_pixels,
            "A pixel that adds no loss is not one of those that you divide by.",
        ),
        Misconception(
            "sum over classes",
            answers.means_over_weights_of_classes,
            "The sum of weights runs over the pixels: a class with a thousand pixels counts a thousand times.",
        ),
        Misconception(
            "weights only below",
            answers.means_not_weighted,
            "Each pixel's loss is multiplied by its weight before the sum.",
        ),
        Misconception("first not divided", answers.means_are_sums, "The first is a mean too: by how many pixels?"),
        Misconception("255 taken for class 0", answers.means_of_ignored_too, "Leave out the pixels labelled 255."),
    ),
    alternatives=(
        answers.two_means_weighted,
        answers.two_means_loops,
        answers.two_means_torch,
        answers.two_means_float32,
    ),
    forbidden=("scipy",),
)


# ------------------------------------------------------------------------------------- where training ends


def weighted_optimum(p, w):
    """Give the probabilities that minimise the expected weighted loss where the true ones are p."""
    return w * p / (p @ w)[..., None]


def draw_distributions(rng):
    """Probabilities (H, W, C) and weights."""
    shape = int(rng.integers(2, 4)), int(rng.integers(4, 6)), int(rng.integers(6, 8))
    p = rng.uniform(0.05, 1.0, shape)
    return p / p.sum(axis=-1, keepdims=True), draw_weights(rng, shape[-1])


WEIGHTED_OPTIMUM = Question(
    name="05_class_weights.weighted_optimum",
    reference=weighted_optimum,
    inputs=draw_distributions,
    by_hand=(
        (np.array([0.9, 0.1]), np.array([1.0, 9.0])),
        (np.array([[0.5, 0.3, 0.2], [0.7, 0.0, 0.3]]), np.array([1.0, 2.0, 5.0])),
    ),
    properties=(
        Property(
            "the probabilities of a pixel, over the last axis, sum to 1",
            lambda arguments, q: bool(np.allclose(q.sum(axis=-1), 1.0, atol=1e-4)),
        ),
    ),
    misconceptions=(
        Misconception(
            "weights do not matter", answers.optimum_without_weights, "Set the weighted gradient to zero: w is in it."
        ),
        Misconception(
            "not normalised", answers.optimum_not_normalised, "What must the probabilities of a pixel sum to?"
        ),
        Misconception(
            "divided", answers.optimum_divided, "A heavier class should end with more probability, not less."
        ),
        Misconception("wrong axis", answers.optimum_over_pixels, "Normalise over the classes, the last axis."),
        Misconception(
            "weights normalised instead",
            answers.optimum_of_normalised_weights,
            "Divide by what makes each pixel's own sum one; it differs from pixel to pixel.",
        ),
        Misconception(
            "square roots", answers.optimum_of_square_roots, "The weights enter as they are: solve for q again."
        ),
        Misconception(
            "softmax", answers.optimum_by_softmax, "These are probabilities already: no exponential is left."
        ),
    ),
    alternatives=(
        answers.weighted_optimum_einsum,
        answers.weighted_optimum_loops,
        answers.weighted_optimum_float32,
        answers.weighted_optimum_torch,
    ),
)


# ----------------------------------------------------------------------------------------- the boundary


def boundary(means, sigma, counts, w):
    """Find the feature value at which two Gaussian classes of one width are decided alike, weights included."""
    odds = counts[0] * w[0] / (counts[1] * w[1])
    return float((means[0] + means[1]) / 2 + sigma**2 / (means[1] - means[0]) * np.log(odds))


def draw_gaussians(rng):
    """Means, the one standard deviation, pixels of each class, weights."""
    means = np.array([rng.normal(), rng.normal() + 3.0])
    counts = np.array([rng.integers(5000, 9000), rng.integers(20, 200)])
    return means[:: rng.choice([1, -1])], float(rng.uniform(0.5, 2.0)), counts, draw_weights(rng, 2)


BOUNDARY = Question(
    name="05_class_weights.boundary",
    reference=boundary,
    inputs=draw_gaussians,
    by_hand=(
        (np.array([0.0, 2.0]), 1.0, np.array([98, 2]), np.array([1.0, 49.0])),
        (np.array([0.0, 2.0]), 0.5, np.array([98, 2]), np.array([1.0, 1.0])),
        (np.array([3.0, -1.0]), 2.0, np.array([10, 30]), np.array([4.0, 0.5])),
    ),
    misconceptions=(
        Misconception("midpoint", answers.boundary_midpoint, "The middle is right only if both classes count alike."),
        Misconception(
            "sign",
            answers.boundary_of_heights,
            "The heavier a class, the farther from its own mean does the boundary lie.",
        ),
        Misconception(
            "no weights", answers.boundary_without_weights, "Raise a weight: which way must the boundary move?"
        ),
        Misconception(
            "no counts",
            answers.boundary_without_counts,
            "With equal weights a rare class still needs stronger evidence.",
        ),
        Misconception(
            "sigma not squared", answers.boundary_sigma, "The exponent of a Gaussian has sigma squared in it."
        ),
        Misconception(
            "distance without sign",
            answers.boundary_distance,
            "Class 1 may lie on the left: exchange the means, and the picture is mirrored.",
        ),
        Misconception(
            "no logarithm", answers.boundary_ratio, "Take the logarithm of both sides before you solve for x."
        ),
    ),
    alternatives=(
        answers.boundary_of_logs,
        answers.boundary_by_halving,
        answers.boundary_of_two_values,
        answers.boundary_torch,
        answers.boundary_float32,
    ),
    forbidden=("scipy",),
)


# ------------------------------------------------------------------------------------ undoing the weights


def undo_weights(z, w, share):
    """Take a share of the weights, 1 for all of them, out of the logits of a network that was trained with them."""
    return z - share * np.log(w)


def shifted(z):
    """Logits of which each pixel's largest is 0: those that differ by a constant a pixel say the same."""
    return z - z.max(axis=-1, keepdims=True)


def draw_logits(rng):
    """Logits (H, W, C), weights, and a share."""
    shape = int(rng.integers(2, 4)), int(rng.integers(4, 6)), int(rng.integers(6, 8))
    return 2.0 * rng.normal(size=shape), draw_weights(rng, shape[-1]), float(rng.uniform(0.2, 0.9))


UNDO_WEIGHTS = Question(
    name="05_class_weights.undo_weights",
    reference=undo_weights,
    inputs=draw_logits,
    by_hand=(
        (np.array([0.0, 0.0]), np.array([1.0, 9.0]), 1.0),
        (np.array([[0.5, -2.0, 1.0]]), np.array([0.5, 4.0, 1.0]), 0.5),
    ),
    misconceptions=(
        Misconception(
            "weights put in again", answers.undo_twice, "Is the rare class more likely after your change, or less?"
        ),
        Misconception(
            "weights subtracted",
            answers.undo_subtracting_weights,
            "A factor of a probability is a summand of its logarithm: which?",
        ),
        Misconception(
            "logits divided",
            answers.undo_dividing,
            "Probabilities are divided by weights; what does that do to logits?",
        ),
        Misconception("share ignored", answers.undo_wholly, "With share 0 nothing may change."),
        Misconception(
            "share inside the logarithm",
            answers.undo_share_inside,
            "Half of the way is half of the logarithm, that is the square root of the weight.",
        ),
        Misconception("probabilities returned", answers.undo_as_probabilities, "Logits go in, and logits come out."),
        Misconception("wrong axis", answers.undo_over_pixels, "The weights belong to the last axis, the classes."),
    ),
    alternatives=(answers.undo_loops, answers.undo_as_log_probabilities, answers.undo_torch, answers.undo_float32),
    canonical=shifted,
)

QUESTIONS = (CLASS_WEIGHTS, WEIGHTED_GRAD, TWO_MEANS, WEIGHTED_OPTIMUM, BOUNDARY, UNDO_WEIGHTS)
