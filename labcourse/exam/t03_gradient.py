"""Paper questions on softmax, cross-entropy and their gradients (topic 03)."""

import numpy as np

from labcourse.exam.paper import Paper, again, blank, named, question, shown, table
from labcourse.questions.t03_gradient.input_window import input_window
from labcourse.questions.t03_gradient.max_pool_backward import max_pool_backward
from labcourse.questions.t03_gradient.softmax_backward import softmax_backward
from labkit.losses import cross_entropy, cross_entropy_grad, softmax


def logarithms(k) -> str:
    """Logits whose exponentials are whole numbers, as they stand on paper."""
    return ", ".join(f"ln {n}" for n in k)


@question(points=2, minutes=3)
def softmax_of_logs(rng):
    """Compute a softmax, and say what a constant does to it."""
    k, shift = rng.integers(1, 10, 3), int(rng.integers(3, 90))
    again(k.sum() not in (5, 8, 10, 16, 20) or len(set(k.tolist())) < 3)
    p = softmax(np.log(k) + shift)
    return Paper(
        {"k": k, "shift": shift},
        f"<p>Three classes have the logits z = ({logarithms(k)}). Compute softmax(z). What is it if {shift} is added "
        "to each of "
        "the three logits?</p>",
        {"softmax": p, "shifted": p},
        f"exp(ln k) = k, and the sum is {k.sum()}. A constant cancels.",
        {"divided by the largest": k / k.max()},
    )


@question(points=3, minutes=4)
def one_gradient(rng):
    """Compute the gradient of one pixel's cross-entropy by its logits."""
    k, y = rng.integers(1, 10, 4), int(rng.integers(0, 4))
    again(k.sum() not in (5, 8, 10, 16, 20))
    z = np.log(k)[None]
    g = cross_entropy_grad(z, np.array([y]))[0]
    return Paper(
        {"k": k},
        f"<p>A pixel has the logits z = ({logarithms(k)}) and the true class {named(y)} (the first one is class 0). "
        "Compute dL/dz of its cross-entropy. What do the four numbers sum to, and why?</p>",
        {"dL/dz": g, "sum": 0, "why": "softmax and one-hot both sum to 1"},
        "p − one-hot of y: softmax, and 1 less at the true class.",
        {"did not subtract the one-hot": softmax(z)[0], "has the sign turned round": -g},
    )


@question(points=3, minutes=4)
def summed_loss(rng):
    """Sum the loss over pixels of which one is ignored."""
    powers = rng.integers(1, 7, 4)
    hidden = int(rng.integers(0, 4))
    p = 0.5**powers
    z = np.log(np.stack([p, 1 - p], axis=-1))
    y = np.where(np.arange(4) == hidden, 255, 0)
    loss = cross_entropy(z, y) / np.log(2)
    return Paper(
        {"powers": powers},
        "<p>A network gives class 0 at four pixels the probabilities "
        f"{', '.join(f'1/{2**n}' for n in powers)}. Pixel {named(hidden)} of them is labelled 255, the others are "
        "labelled 0. "
        "How large is the cross-entropy, summed over the pixels that count, as a multiple of ln 2? And its mean?</p>",
        {"sum": loss, "mean": loss / 3},
        "−ln(1/2ⁿ) = n ln 2; pixels of 255 add nothing, and are not counted in the mean.",
        {"counted the ignored pixel": int(powers.sum()), "divided by four": {"mean": loss / 4}},
    )


@question(points=4, minutes=6)
def through_softmax(rng):
    """Carry a gradient back through a softmax."""
    tenths = rng.integers(1, 8, 3)
    g = rng.integers(-6, 7, 3)
    again(tenths.sum() != 10 or len(set(g.tolist())) < 3)
    p = tenths / 10
    back = softmax_backward(p, g.astype(float))
    return Paper(
        {"p": p, "g": g},
        f"<p>A softmax gave p = ({', '.join(f'{x:g}' for x in p)}), and the loss has dL/dp = "
        f"({', '.join(map(str, g)).replace('-', '−')}). Compute dL/dz.</p>",
        {"dL/dz": back},
        "p<sub>c</sub> (g<sub>c</sub> − Σ<sub>k</sub> p<sub>k</sub> g<sub>k</sub>); "
        f"the mean of g under p is {shown(p @ g)}. The three sum to 0.",
        {"left the mean out": p * g},
    )


@question(points=3, minutes=4)
def pooled(rng):
    """Carry a gradient back through a max pooling."""
    x, g = rng.permutation(30)[:8].reshape(2, 4), rng.integers(-9, 10, (1, 2))
    again((g == 0).any())
    back = max_pool_backward(x.astype(float), g.astype(float))
    return Paper(
        {"x": x, "g": g},
        f"<p>A max pooling of width and stride 2 sees x, and the gradient by its two outputs is ({g[0, 0]}, "
        f"{g[0, 1]}).</p>"
        f"{table(x)}<p>Fill in the gradient by x.</p>{blank(2, 4)}".replace("(-", "(−").replace(", -", ", −"),
        {"dL/dx": back},
        "Each gradient goes to the largest pixel of its block; the others had no part in the output.",
        {"shared it among the block": np.repeat(np.repeat(g / 4, 2, axis=0), 2, axis=1)},
    )


@question(points=3, minutes=5)
def window(rng):
    """Find which input pixels an output pixel depends on."""
    kernels = rng.choice([3, 5, 7, 9], 2)
    strides = rng.choice([1, 2, 3, 4], 2)
    u = int(rng.integers(3, 9))
    again(strides.max() == 1)
    paddings = kernels // 2
    first, last = input_window(kernels, strides, paddings, u)
    again(first < 0)
    inside = input_window(kernels[::-1], strides[::-1], paddings[::-1], u)
    layers = " and then ".join(
        f"a convolution of width {k}, stride {s} and padding {p}"
        for k, s, p in zip(kernels, strides, paddings, strict=True)
    )
    return Paper(
        {"u": u, "kernels": kernels, "strides": strides},
        f"<p>An image goes through {layers}. Along one axis, which input pixels does output pixel {u} depend on?</p>",
        {"first": first, "last": last},
        "From the output back: first · stride − padding, and last · stride − padding + width − 1, layer by layer.",
        {
            "went through the layers from the image's side": inside[0],
            "forgot the first layer's padding": first + paddings[0],
            "forgot both paddings": u * strides.prod(),
        },
    )
