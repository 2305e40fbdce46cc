"""Questions of topic 03: softmax, cross-entropy, its gradient, the check by differences, and the receptive field.

Sections 3 and 6 and problem 1 of the text.
"""

import numpy as np

from labkit.course.questions import answers_03 as answers
from labkit.course.questions.question import Misconception, Property, Question


def random_logits(rng: np.random.Generator) -> np.ndarray:
    """Draw logits (H, W, C) of three unequal lengths, up to a few units apart."""
    shape = (int(rng.integers(2, 4)), int(rng.integers(4, 6)), int(rng.integers(6, 8)))
    return 2.0 * rng.normal(size=shape) + rng.normal()


def random_pixels(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Draw logits (H, W, C) and labels (H, W), at least one of them ignored."""
    z = random_logits(rng)
    y = rng.integers(0, z.shape[-1], z.shape[:-1]).astype(np.uint8)
    y[rng.random(y.shape) < 0.2] = 255
    y[0, 0], y[1, 1] = 255, z.shape[-1] - 1
    return z, y


TOY = np.array([2.0, 1.0, -1.0])
SURE = np.array([[0.0, 1000.0, 3.0], [-1000.0, -1001.0, -1005.0]])  # exp overflows, or rounds everything to 0


def softmax(z):
    """Turn logits (..., C) into probabilities over the last axis, for logits of any size."""
    e = np.exp(z - z.max(axis=-1, keepdims=True))
    return e / e.sum(axis=-1, keepdims=True)


def log_sum_exp(z):
    """Give log(sum(exp(z))) over the last axis, for logits of any size."""
    largest = z.max(axis=-1)
    return largest + np.log(np.exp(z - largest[..., None]).sum(axis=-1))


def cross_entropy(z, y):
    """Sum -log p(y) over the pixels; those labelled 255 add nothing."""
    counted = y != 255
    z, y = z[counted].T, y[counted]  # (C, N): a row a class
    log_p = z - np.logaddexp.reduce(z)
    return -float(log_p[y, np.arange(len(y))].sum())


def cross_entropy_grad(z, y):
    """Differentiate the summed cross-entropy by each logit; 0 where the label is 255."""
    e = np.exp(z - z.max(axis=-1, keepdims=True))
    p = e / e.sum(axis=-1, keepdims=True)
    Y = y[..., None] == np.arange(z.shape[-1])
    return np.where(y[..., None] == 255, 0.0, p - Y)


def numerical_grad(z, y, h):
    """Estimate the gradient of one pixel's cross-entropy by central differences of step h."""

    def loss(logits):
        return np.logaddexp.reduce(logits) - logits[y]

    return np.array([(loss(z + step) - loss(z - step)) / (2 * h) for step in h * np.eye(len(z))])


def receptive_field(kernels, strides):
    """Count the inputs, along one axis, that an output of these layers depends on."""
    size, jump = 1, 1
    for kernel, stride in np.transpose([kernels, strides]).tolist():
        size += (kernel - 1) * jump
        jump *= stride
    return size


def draw_pixel(rng: np.random.Generator) -> tuple[np.ndarray, int, float]:
    """Draw one pixel's logits (C,), its label, and a step so large that differences are not yet the derivative."""
    C = int(rng.integers(4, 7))
    return 1.5 * rng.normal(size=C), int(rng.integers(C)), float(rng.uniform(0.3, 1.2))


def draw_layers(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Draw kernels and strides of four to six layers, the first with a stride of its own."""
    n = int(rng.integers(4, 7))
    kernels, strides = rng.integers(2, 8, n), rng.integers(1, 4, n)
    strides[:2] = 3, 2
    return kernels, strides


TRUE_CLASSES = np.array([0, 255], np.uint8)

QUESTIONS = (
    Question(
        name="03_gradient.softmax",
        reference=softmax,
        inputs=lambda rng: (random_logits(rng),),
        by_hand=((TOY,), (SURE,)),
        properties=(
            Property(
                "the probabilities of a pixel, over the last axis, sum to 1",
                lambda arguments, p: bool(np.allclose(p.sum(axis=-1), 1.0, atol=1e-4)),
            ),
        ),
        misconceptions=(
            Misconception(
                "wrong axis", answers.softmax_over_pixels, "Which numbers must sum to one: those of one pixel."
            ),
            Misconception(
                "no axis",
                answers.softmax_over_everything,
                "Each pixel has probabilities of its own: sum over one axis.",
            ),
            Misconception(
                "overflow",
                answers.softmax_that_overflows,
                "What is np.exp(1000)? What may you take off every logit of a pixel?",
            ),
            Misconception(
                "one maximum for the image",
                answers.softmax_of_global_maximum,
                "Take each pixel's own largest logit: beside the image's, a dark pixel's exponentials all round to 0.",
            ),
            Misconception(
                "clipped logits",
                answers.softmax_clipped,
                "Clipping changes the answer, a shift does not: softmax sees differences.",
            ),
            Misconception(
                "sigmoid", answers.sigmoid_of_each, "Classes exclude each other: do your probabilities sum to one?"
            ),
            Misconception(
                "no exponential", answers.logits_divided_by_their_sum, "Logits may be negative, probabilities may not."
            ),
        ),
        alternatives=(answers.softmax_loops, answers.softmax_einsum, answers.softmax_torch, answers.softmax_float32),
        forbidden=("scipy",),
    ),
    Question(
        name="03_gradient.log_sum_exp",
        reference=log_sum_exp,
        inputs=lambda rng: (random_logits(rng),),
        by_hand=((TOY,), (SURE,), (np.array([[7.0]]),)),
        properties=(
            Property(
                "it is at least the largest logit, and at most log C more",
                lambda arguments, out: bool(
                    (
                        np.abs(out - arguments[0].max(axis=-1) - 0.5 * np.log(arguments[0].shape[-1]))
                        <= 0.5 * np.log(arguments[0].shape[-1]) + 1e-3
                    ).all()
                ),
            ),
        ),
        misconceptions=(
            Misconception(
                "overflow", answers.log_sum_exp_that_overflows, "np.exp(1000) is inf: take the largest logit out first."
            ),
            Misconception(
                "maximum not put back",
                answers.log_sum_exp_without_the_largest,
                "What you take off inside the logarithm has to come back outside it.",
            ),
            Misconception(
                "epsilon",
                answers.log_sum_exp_with_epsilon,
                "An epsilon changes the answer where all is small; a shift is exact.",
            ),
            Misconception(
                "wrong axis", answers.log_sum_exp_over_pixels, "One number a pixel: the classes, the last axis, go."
            ),
            Misconception(
                "maximum only", answers.largest_logit, "The largest logit is where it starts; the others add to it."
            ),
            Misconception("mean", answers.log_mean_exp, "A sum, not a mean: you are off by log C."),
            Misconception(
                "one maximum for the image",
                answers.log_sum_exp_of_global_maximum,
                "Each pixel needs its own maximum, or the exponentials of a dark pixel all round to 0.",
            ),
        ),
        alternatives=(
            answers.log_sum_exp_pairwise,
            answers.log_sum_exp_loops,
            answers.log_sum_exp_torch,
            answers.log_sum_exp_float32,
        ),
        forbidden=("scipy",),
    ),
    Question(
        name="03_gradient.cross_entropy",
        reference=cross_entropy,
        inputs=random_pixels,
        by_hand=(
            (TOY[None], np.array([1], np.uint8)),
            (SURE, np.array([0, 2], np.uint8)),
            (SURE, TRUE_CLASSES),
            (SURE, np.array([255, 255], np.uint8)),
        ),
        properties=(Property("a loss is never negative", lambda arguments, out: bool(out >= -1e-6)),),
        misconceptions=(
            Misconception(
                "mean", answers.cross_entropy_mean, "The text sums over the pixels: yours is smaller by their number."
            ),
            Misconception(
                "sign", answers.cross_entropy_sign, "A logarithm of a probability is below 0; a loss is above."
            ),
            Misconception(
                "epsilon",
                answers.cross_entropy_epsilon,
                "log(p + epsilon) can never exceed 16 or so, however wrong the pixel: write log p without p.",
            ),
            Misconception(
                "softmax twice",
                answers.cross_entropy_softmax_twice,
                "What range enters the loss? Logits are normalised once, inside it.",
            ),
            Misconception(
                "no softmax", answers.cross_entropy_without_softmax, "The other classes' logits have to count as well."
            ),
            Misconception(
                "ignored pixels", answers.cross_entropy_counts_ignored, "255 is no class: such a pixel adds nothing."
            ),
            Misconception(
                "1 - p", answers.cross_entropy_of_probabilities, "The loss is minus the logarithm, not one minus p."
            ),
            Misconception(
                "all classes", answers.cross_entropy_of_all_classes, "Only the true class's log-probability is summed."
            ),
        ),
        alternatives=(
            answers.cross_entropy_loops,
            answers.cross_entropy_one_hot,
            answers.cross_entropy_torch,
            answers.cross_entropy_float32,
        ),
        forbidden=("scipy",),
    ),
    Question(
        name="03_gradient.cross_entropy_grad",
        reference=cross_entropy_grad,
        inputs=random_pixels,
        by_hand=(
            (TOY[None], np.array([1], np.uint8)),
            (TOY[None], np.array([0], np.uint8)),
            (SURE, TRUE_CLASSES),
        ),
        points=3,
        properties=(
            Property(
                "the gradient of each pixel sums to 0",
                lambda arguments, grad: bool(np.allclose(grad.sum(axis=-1), 0.0, atol=1e-4)),
            ),
        ),
        misconceptions=(
            Misconception(
                "no one-hot",
                answers.grad_without_one_hot,
                "Each pixel's gradient sums to zero; what does yours sum to?",
            ),
            Misconception(
                "sign",
                answers.grad_sign,
                "Descent goes against the gradient: must the true logit's derivative be negative?",
            ),
            Misconception(
                "mean", answers.grad_mean, "Ratio to the numerical gradient of the summed loss: the number of pixels?"
            ),
            Misconception(
                "ignored pixels", answers.grad_counts_ignored, "A pixel that adds no loss has no gradient: look at 255."
            ),
            Misconception("wrong axis", answers.grad_over_pixels, "Normalise over the classes, the last axis."),
            Misconception(
                "true class only",
                answers.grad_true_class_only,
                "The other logits raise the loss too: there are two cases, and c != y is not zero.",
            ),
            Misconception("no softmax", answers.grad_of_logits, "Compare probabilities with the one-hot, not logits."),
            Misconception(
                "squared error",
                answers.grad_of_squared_error,
                "That is the slope of half the squared error; with the logarithm, the p in front cancels.",
            ),
        ),
        alternatives=(answers.grad_loops, answers.grad_in_place, answers.grad_torch, answers.grad_float32),
        forbidden=("scipy",),
    ),
    Question(
        name="03_gradient.numerical_grad",
        reference=numerical_grad,
        inputs=draw_pixel,
        by_hand=((TOY, 1, 0.5), (TOY, 0, 1.0)),
        atol=1e-5,
        properties=(Property("one number a logit", lambda arguments, out: np.shape(out) == np.shape(arguments[0])),),
        misconceptions=(
            Misconception(
                "forward difference", answers.forward_difference, "Step to both sides: the error falls as h squared."
            ),
            Misconception("backward difference", answers.backward_difference, "Step to both sides, not only down."),
            Misconception(
                "divided by h", answers.difference_over_h, "How far apart are the two points that you compare?"
            ),
            Misconception(
                "not divided", answers.difference_not_divided, "A difference becomes a slope when it is divided."
            ),
            Misconception(
                "formula",
                answers.formula_instead_of_differences,
                "A check must not use what it checks: only values of the loss, at two points h away.",
            ),
            Misconception(
                "all logits at once",
                answers.all_logits_at_once,
                "Move one logit at a time; all together change nothing.",
            ),
            Misconception(
                "step not undone", answers.step_never_taken_back, "Put the logit back before you move the next one."
            ),
        ),
        alternatives=(
            answers.numerical_grad_in_place,
            answers.numerical_grad_at_once,
            answers.numerical_grad_torch,
            answers.numerical_grad_float32,
        ),
        forbidden=("scipy",),
    ),
    Question(
        name="03_gradient.receptive_field",
        reference=receptive_field,
        inputs=draw_layers,
        by_hand=(
            (np.array([3]), np.array([1])),
            (np.array([3, 2, 3, 2, 3]), np.array([1, 2, 1, 2, 1])),
            (np.array([7, 1, 5]), np.array([2, 3, 1])),
        ),
        misconceptions=(
            Misconception(
                "strides forgotten", answers.field_without_strides, "After a stride of 2, one step is two pixels."
            ),
            Misconception(
                "sum of kernels",
                answers.field_sum_of_kernels,
                "Two 3x3 layers see 5 pixels, not 6: neighbours overlap.",
            ),
            Misconception("product", answers.field_product, "Two 3x3 layers see 5 pixels, not 9: neighbours overlap."),
            Misconception(
                "stride too early",
                answers.field_stride_too_early,
                "A layer's own stride widens the steps of those after it.",
            ),
            Misconception(
                "last stride only",
                answers.field_last_stride_only,
                "Strides multiply: after two of them a step is four pixels.",
            ),
            Misconception(
                "radius", answers.field_radius, "The whole width is asked for, the pixel itself and both sides."
            ),
            Misconception(
                "whole kernels", answers.field_whole_kernels, "A kernel of 1 sees no more than was seen before."
            ),
        ),
        alternatives=(answers.field_backwards, answers.field_products, answers.field_by_counting),
    ),
)
