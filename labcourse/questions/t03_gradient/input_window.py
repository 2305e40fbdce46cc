"""03_gradient.input_window: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labgrader.question import Question, wrong


def input_window(kernels, strides, paddings, u):
    """Say which input pixels an output pixel depends on along one axis: from the output's layer back to the image."""
    first = last = int(u)
    for kernel, stride, padding in np.transpose([kernels, strides, paddings])[::-1].tolist():
        first = first * stride - padding
        last = last * stride - padding + kernel - 1
    return first, last


def draw_layers(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """Draw kernels, strides and paddings of four to six layers, and an output pixel, the first one in most draws."""
    n = int(rng.integers(4, 7))
    kernels, strides, paddings = rng.integers(2, 8, n), rng.integers(1, 4, n), rng.integers(0, 4, n)
    strides[:2], paddings[:2] = (3, 2), (1, 3)
    return kernels, strides, paddings, int(rng.integers(3, 30)) * int(rng.random() < 0.4)


QUESTION = Question(
    reference=input_window,
    inputs=draw_layers,
    by_hand=(
        (np.array([3]), np.array([1]), np.array([1]), 10),
        (np.array([2]), np.array([2]), np.array([0]), 10),
        (np.array([3, 2, 3, 2, 3]), np.array([1, 2, 1, 2, 1]), np.array([1, 0, 1, 0, 1]), 8),
        (np.array([7, 1, 5]), np.array([2, 3, 1]), np.array([3, 0, 0]), 4),
        (np.array([3, 5]), np.array([1, 2]), np.array([1, 2]), 0),  # it begins outside the image
    ),
    random_cases=8,
    points=3,
    forbidden=("scipy", "torch"),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


@wrong("You start at the output: which layer do you pass first on the way back to the image?")
def from_the_image_on(kernels, strides, paddings, u):
    """The layers in the order in which the image passes them."""
    return input_window(kernels[::-1], strides[::-1], paddings[::-1], u)


@wrong("A layer with padding starts reading outside the image: by how much does that move its window?")
def without_padding(kernels, strides, paddings, u):
    """Padding forgotten."""
    return input_window(kernels, strides, np.zeros_like(paddings), u)


@wrong("Output u of a layer starts to read at stride times u: what does a stride do to a position?")
def without_strides(kernels, strides, paddings, u):
    """Strides forgotten."""
    return input_window(kernels, np.ones_like(strides), paddings, u)


@wrong("A kernel of width 3 that starts at pixel 4 reads 4, 5 and 6: which is the last?")
def one_too_far(kernels, strides, paddings, u):
    """The window ends behind its last pixel."""
    return input_window(np.asarray(kernels) + 1, strides, paddings, u)


@wrong("Padding adds pixels in front of the first one: is the window of output 0 moved to the left or the right?")
def padding_added(kernels, strides, paddings, u):
    """Padding moves the window to the wrong side."""
    return input_window(kernels, strides, -np.asarray(paddings), u)


@wrong("The padding is counted in pixels of the layer's input: does the stride multiply it?")
def padding_before_the_stride(kernels, strides, paddings, u):
    """s (u - p) in the place of s u - p."""
    return input_window(kernels, strides, strides * paddings, u)


@wrong("Each layer makes the window wider: trace the last pixel back on its own.")
def window_of_the_first_layer(kernels, strides, paddings, u):
    """Only the first pixel is walked back; the first layer's width is added."""
    first = input_window(kernels, strides, paddings, u)[0]
    return first, first + int(kernels[0]) - 1


@wrong("A window may begin outside the image, at a negative pixel. Leave it so.")
def kept_inside_the_image(kernels, strides, paddings, u):
    """No pixel before 0."""
    first, last = input_window(kernels, strides, paddings, u)
    return max(first, 0), last


@wrong("That window has the right width, but its middle is not at u times the strides: trace both of its ends back.")
def centred(kernels, strides, paddings, u):
    """A window of the right width around the output's place in the image."""
    first, last = input_window(kernels, strides, paddings, u)
    middle = u * int(np.prod(strides))
    return middle - (last - first + 1) // 2, middle + (last - first + 1) // 2


@wrong("You go on from an input pixel to the outputs that read it. Which input pixels does output u read?")
def outputs_of_a_pixel(kernels, strides, paddings, u):
    first = last = int(u)
    for kernel, stride, padding in np.transpose([kernels, strides, paddings]).tolist():
        first, last = (first + padding - kernel + 1) // stride, (last + padding) // stride
    return first, last


@wrong("A layer may have more or less padding than half its kernel: which argument says how much?")
def padded_by_half_a_kernel(kernels, strides, paddings, u):
    half = kernels // 2
    return input_window(2 * half + 1, strides, half, u)


@wrong("Is your second number the place of the last pixel, or how many there are?")
def first_and_width(kernels, strides, paddings, u):
    first, last = input_window(kernels, strides, paddings, u)
    return first, last - first + 1


@wrong("That window has the right width, but its middle is not at u times the strides: trace both of its ends back.")
def centred_on_its_first_half(kernels, strides, paddings, u):
    first, last = input_window(kernels, strides, paddings, u)
    begin = u * int(np.prod(strides)) - (last - first + 1) // 2
    return begin, begin + last - first


@wrong("A layer's padding counts pixels of its own input: how many pixels of the image is one of them?")
def paddings_counted_in_image_pixels(kernels, strides, paddings, u):
    first, last = input_window(kernels, strides, np.zeros_like(paddings), u)
    return first - int(np.sum(paddings)), last - int(np.sum(paddings))
