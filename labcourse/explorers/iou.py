"""Explorers of topic 04: a mask that slides off its object, and the cells of a confusion matrix as pixels."""

from functools import lru_cache

import ipywidgets
import numpy as np
from jaxtyping import Bool, Int64, Integer, UInt8
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from labcourse.explorers.explorer import Explorer, show
from labkit.labels import CLASSES
from labkit.metrics import confusion_matrix, iou, pixel_accuracy

# Colours that the classes do not have, and that colour-blind readers tell apart.
OUTCOMES = {"right (TP)": (225, 225, 225), "too much (FP)": (204, 121, 167), "missed (FN)": (0, 114, 178)}
LIT = np.array([240, 228, 66], np.uint8)
SIDE = 64  # pixels of the toy image


def error_image(
    y_true: Integer[np.ndarray, "H W"],
    y_pred: Integer[np.ndarray, "H W"],
    c: int,
    rgb: UInt8[np.ndarray, "H W 3"] | None = None,
) -> UInt8[np.ndarray, "H W 3"]:
    """Paint what became of class c: right, too much, missed, in the colours of OUTCOMES; the rest is dark.

    rgb: the picture that shines through where neither image has the class. Pixels with y_true 255 stay dark.

    >>> error_image(np.array([[1, 1, 0]]), np.array([[1, 0, 1]]), 1)[0, 1].tolist()
    [0, 114, 178]
    """
    image = np.full((*y_true.shape, 3), 40, np.uint8) if rgb is None else (rgb * 0.35).astype(np.uint8)
    true, predicted = y_true == c, (y_pred == c) & (y_true != 255)
    for pixels, colour in zip((true & predicted, predicted & ~true, true & ~predicted), OUTCOMES.values(), strict=True):
        image[pixels] = colour
    return image


def outcome_legend(axes: Axes, **options) -> None:
    """Add the colours of `error_image` as a legend; `options` go to Axes.legend."""
    patches = [Patch(color=np.array(colour) / 255, label=name) for name, colour in OUTCOMES.items()]
    axes.legend(handles=patches, **({"loc": "upper right", "fontsize": 8} | options))


def draw_matrix(axes: Axes, n: Int64[np.ndarray, "C C"], names: tuple[str, ...] = CLASSES) -> None:
    """Draw a confusion matrix: counts in the cells, dark where there are many (on a logarithmic scale)."""
    axes.imshow(np.log1p(n), cmap="Greys", vmin=0.0, vmax=1.6 * np.log1p(n.max()))
    for i, row in enumerate(n):
        for j, count in enumerate(row):
            axes.text(j, i, f"{count:,}", ha="center", va="center", fontsize=9)
    axes.set_xticks(range(len(n)), names, rotation=25)
    axes.set_yticks(range(len(n)), names)
    axes.set(xlabel="predicted j", ylabel="true i")


def toy_object(radius: int) -> Bool[np.ndarray, "64 64"]:
    """Draw a mug from above, a disc with a handle, left of the middle of a 64 x 64 image.

    >>> toy_object(2).sum().tolist()
    14
    """
    v, u = np.mgrid[0:SIDE, 0:SIDE] - np.array([SIDE // 2, SIDE // 3])[:, None, None]
    handle = (np.abs(v) <= radius // 3) & (u < 0) & (u >= -radius - radius // 2)
    return (u**2 + v**2 <= radius**2) | handle


@lru_cache(maxsize=512)  # a moved slider asks again for all shifts
def slide_scores(radius: int, shift: int) -> tuple[float, float]:
    """Give pixel accuracy and the object's IoU for the toy object's mask, moved `shift` pixels to the right.

    >>> slide_scores(5, 0), slide_scores(5, 30)[1]
    ((1.0, 1.0), 0.0)
    """
    y_true, y_pred = _slid(radius, shift)
    n = confusion_matrix(y_true, y_pred, 2)
    return pixel_accuracy(n), float(iou(n)[1])


def _slid(radius: int, shift: int) -> tuple[np.ndarray, np.ndarray]:
    y_true = toy_object(radius).astype(np.uint8)
    return y_true, np.roll(y_true, shift, axis=1)


def sliding_mask() -> Explorer:
    """Slide a mask off its object: accuracy hardly falls, IoU does. Controls: shift and radius, in pixels."""

    def draw(figure: Figure, shift: int, radius: int) -> None:
        picture, curves = figure.subplots(1, 2, width_ratios=[1, 1.6])
        show(picture, error_image(*_slid(radius, shift), 1))
        outcome_legend(picture, fontsize=7)
        shifts = np.arange(25)
        scores = np.array([slide_scores(radius, int(s)) for s in shifts])
        for values, colour, name in zip(scores.T, ("0.55", "tab:red"), ("pixel accuracy", "IoU"), strict=True):
            curves.plot(shifts, values, color=colour, label=name)
            curves.plot(shift, values[shift], "o", color=colour)
        curves.set(xlabel="shift (pixels)", ylabel="score", ylim=(-0.03, 1.05))
        curves.legend(loc="center right")
        share = toy_object(radius).mean()
        curves.set_title(
            f"object {share:.1%} of the image: accuracy {scores[shift, 0]:.3f}, IoU {scores[shift, 1]:.3f}"
        )

    controls = {
        "shift": ipywidgets.IntSlider(4, min=0, max=24, description="shift"),
        "radius": ipywidgets.IntSlider(5, min=2, max=14, description="radius"),
    }
    return Explorer(draw, controls, size=(7.5, 2.9))


def confusion_cells(
    rgb: UInt8[np.ndarray, "H W 3"], y_true: Integer[np.ndarray, "H W"], y_pred: Integer[np.ndarray, "H W"]
) -> Explorer:
    """Pick a cell of the confusion matrix, and its pixels light up in the image. Controls: true and predicted class.

    It starts at the most frequent mistake.
    """
    n = confusion_matrix(y_true, y_pred, len(CLASSES))
    mistakes = n - np.diag(np.diagonal(n))
    first_true, first_predicted = np.unravel_index(mistakes.argmax(), n.shape)
    dark = (rgb * 0.4).astype(np.uint8)

    def draw(figure: Figure, true: str, predicted: str) -> None:
        i, j = CLASSES.index(true), CLASSES.index(predicted)
        matrix, picture = figure.subplots(1, 2, width_ratios=[1, 1.25])
        draw_matrix(matrix, n)
        matrix.add_patch(Rectangle((j - 0.5, i - 0.5), 1, 1, fill=False, edgecolor="tab:red", linewidth=3))
        lit = np.where(((y_true == i) & (y_pred == j))[..., None], LIT, dark)
        show(picture, lit, f"n[{i}, {j}] = {n[i, j]:,}: true {true}, predicted {predicted}")

    controls = {
        "true": ipywidgets.Dropdown(options=CLASSES, value=CLASSES[first_true], description="true"),
        "predicted": ipywidgets.Dropdown(options=CLASSES, value=CLASSES[first_predicted], description="predicted"),
    }
    return Explorer(draw, controls, size=(8.5, 3.3))
