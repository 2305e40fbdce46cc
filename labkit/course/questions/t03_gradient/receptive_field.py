"""03_gradient.receptive_field: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.questions.question import Question, wrong


def receptive_field(kernels, strides):
    """Count the inputs, along one axis, that an output of these layers depends on."""
    size, jump = 1, 1
    for kernel, stride in np.transpose([kernels, strides]).tolist():
        size += (kernel - 1) * jump
        jump *= stride
    return size


def draw_layers(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Draw kernels and strides of four to six layers, the first with a stride of its own."""
    n = int(rng.integers(4, 7))
    kernels, strides = rng.integers(2, 8, n), rng.integers(1, 4, n)
    strides[:2] = 3, 2
    return kernels, strides


QUESTION = Question(
    name="03_gradient.receptive_field",
    reference=receptive_field,
    inputs=draw_layers,
    by_hand=(
        (np.array([3]), np.array([1])),
        (np.array([3, 2, 3, 2, 3]), np.array([1, 2, 1, 2, 1])),
        (np.array([7, 1, 5]), np.array([2, 3, 1])),
    ),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


@wrong(QUESTION, "A layer's own stride widens the steps of those after it.")
def field_stride_too_early(kernels, strides):
    size, jump = 1, 1
    for kernel, stride in zip(kernels, strides, strict=True):
        jump *= int(stride)
        size += (int(kernel) - 1) * jump
    return size


@wrong(QUESTION, "Strides multiply: after two of them a step is four pixels.")
def field_last_stride_only(kernels, strides):
    size = 1
    for i, kernel in enumerate(kernels):
        size += (int(kernel) - 1) * (int(strides[i - 1]) if i else 1)
    return size


@wrong(QUESTION, "The whole width is asked for, the pixel itself and both sides.")
def field_radius(kernels, strides):
    return (receptive_field(kernels, strides) - 1) // 2
