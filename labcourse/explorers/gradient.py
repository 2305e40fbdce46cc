"""Explorers of 03_gradient: three logits with their gradient, and the image as a small receptive field shows it."""

import ipywidgets
import numpy as np
from jaxtyping import Integer, UInt8
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from labcourse.explorers.explorer import Explorer, show
from labkit.labels import CLASSES
from labkit.losses import cross_entropy, cross_entropy_grad, softmax
from labkit.support.validation import check_labels, check_rgb, check_same_size

COLOURS = ("#0072b2", "#d55e00", "#009e73")  # of the formula, of what is measured, of the truth


def central_differences(z: np.ndarray, y: int, h: float) -> np.ndarray:
    """Estimate the gradient of one pixel's cross-entropy from its values at z_c + h and z_c - h."""
    label = np.asarray(y)
    steps = h * np.eye(len(z))
    return np.array([cross_entropy(z + s, label) - cross_entropy(z - s, label) for s in steps]) / (2 * h)


def draw_logits(figure: Figure, z0: float, z1: float, z2: float, y: int, h: float) -> None:
    """Draw p beside the one-hot y, and p - y beside the central differences of step h."""
    z = np.array([z0, z1, z2])
    p, grad, numerical = softmax(z), cross_entropy_grad(z, np.asarray(y)), central_differences(z, y, h)
    places = np.arange(3)
    left, right = figure.subplots(1, 2)
    left.bar(places - 0.2, p, 0.4, color=COLOURS[0], label="p = softmax(z)")
    left.bar(places + 0.2, places == y, 0.4, color=COLOURS[2], label="y, one-hot")
    left.set(ylim=(0, 1.2), title=f"loss = -log p[{y}] = {cross_entropy(z, np.asarray(y)):.3f}")
    right.bar(places - 0.2, grad, 0.4, color=COLOURS[0], label="p - y")
    right.bar(places + 0.2, numerical, 0.4, color=COLOURS[1], label=f"differences, h = {h:.0e}")
    right.axhline(0.0, color="0.4", linewidth=0.8)
    error = np.abs(grad - numerical).max()
    right.set(ylim=(-1.05, 1.4), title=f"they differ by {error:.0e}; p - y sums to {abs(round(grad.sum(), 12)):.0f}")
    for axes in (left, right):
        axes.set_xticks(places, [f"z = {value:.2f}" for value in z])
        axes.legend(fontsize=8, loc="upper center", ncols=2)


def logits(z: tuple[float, float, float] = (2.0, 1.0, -1.0), y: int = 1) -> Explorer:
    """Move three logits and see probabilities, the gradient p - y, and the gradient as differences measure it.

    z: where the sliders start; y: the true class, 0 to 2. The step h of the differences has a slider too. Topic 03.

    >>> explorer = logits()
    >>> explorer.controls["z1"].value = 5.0
    >>> explorer.values["y"], explorer.values["z1"]
    (1, 5.0)
    """
    sliders = {
        f"z{c}": ipywidgets.FloatSlider(value, min=-8.0, max=8.0, step=0.25, description=f"z[{c}]")
        for c, value in enumerate(z)
    }
    true_class = ipywidgets.ToggleButtons(options=[0, 1, 2], value=y, description="true y")
    steps = [(f"1e{exponent}", 10.0**exponent) for exponent in range(-16, 1)]
    step = ipywidgets.SelectionSlider(options=steps, value=steps[11][1], description="step h")
    stills = ({"z0": z[0], "z1": z[1], "z2": z[2]}, {"z0": 6.0, "z1": -6.0, "z2": -1.0})
    return Explorer(draw_logits, sliders | {"y": true_class, "h": step}, size=(8.5, 3.0), stills=stills)


def keyhole(
    rgb: UInt8[np.ndarray, "H W 3"], y: Integer[np.ndarray, "H W"], at: tuple[int, int], widths: tuple[int, ...]
) -> Explorer:
    """Look at an image as a network does that sees `width` pixels round each pixel, and ask for the pixel's class.

    rgb, y: the image and its true labels. at: (u, v), column and row, where it starts. widths: receptive fields, in
    pixels, to choose from. Raises ValueError if rgb and y differ in size or `at` is outside. Topic 03.
    """
    rgb, y = check_rgb("rgb", rgb), check_labels("y", y, len(CLASSES))
    check_same_size("rgb", rgb, "y", y)
    height, width_of_image = y.shape
    if not (0 <= at[0] < width_of_image and 0 <= at[1] < height):
        raise ValueError(f"at: expected (u, v) in an image of {width_of_image}x{height}, got {at}")

    def draw(figure: Figure, u: int, v: int, width: int, reveal: bool) -> None:
        patch, corner = seen(rgb, u, v, width)
        through, whole = figure.subplots(1, 2)
        show(through, patch, f"what {width} pixels show")
        through.plot(u - corner[0], v - corner[1], "+", color="white", markersize=14, markeredgewidth=3)
        through.plot(u - corner[0], v - corner[1], "+", color="black", markersize=12, markeredgewidth=1)
        whole.axis("off")
        if reveal:
            label = y[v, u]
            show(whole, rgb, f"true class: {CLASSES[label] if label < len(CLASSES) else 'ignore'}")
            whole.add_patch(Rectangle(np.subtract(corner, 0.5), *patch.shape[1::-1], fill=False, color="white"))
        else:
            whole.text(0.5, 0.5, "surface, target,\nobstacle, background?", ha="center", va="center", fontsize=13)

    controls = {
        "u": ipywidgets.IntSlider(at[0], min=0, max=width_of_image - 1, description="column u"),
        "v": ipywidgets.IntSlider(at[1], min=0, max=height - 1, description="row v"),
        "width": ipywidgets.SelectionSlider(options=list(widths), value=widths[0], description="sees"),
        "reveal": ipywidgets.Checkbox(False, description="show the image and the true class"),
    }
    stills = tuple({"width": width, "reveal": width == widths[-1]} for width in widths[::2] + widths[-1:])
    return Explorer(draw, controls, size=(7.0, 2.9), stills=stills)


def seen(rgb: np.ndarray, u: int, v: int, width: int) -> tuple[np.ndarray, tuple[int, int]]:
    """Cut out the window of `width` pixels round (u, v), as far as the image goes, and tell its corner (u, v)."""
    left, top = max(0, u - width // 2), max(0, v - width // 2)
    right, bottom = u - width // 2 + width, v - width // 2 + width
    return rgb[top:bottom, left:right], (left, top)
