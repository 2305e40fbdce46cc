"""Explorers of topic 09: a wipe between two stacks' masks, an HSV range by hand, and one memory read in two ways."""

from collections.abc import Mapping

import cv2
import ipywidgets
import numpy as np
from jaxtyping import Bool, Float, Integer, UInt8
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from labcourse.explorers.explorer import Explorer, show
from labcourse.stacks.threshold import HSVRange, hsv_mask
from labkit.labels import CLASSES, PALETTE, overlay
from labkit.metrics import confusion_matrix, iou


def wipe(
    rgb: UInt8[np.ndarray, "H W 3"],
    masks: Mapping[str, Integer[np.ndarray, "H W"]],
    truth: Integer[np.ndarray, "H W"],
) -> Explorer:
    """Wipe between two stacks' labels of one frame. Controls: where the edge is, and which stack lies on each side.

    masks: name -> labels; the first two are shown at first. The title gives each side's IoU of the target.
    """
    names = list(masks)
    painted = {name: overlay(rgb, labels, 0.65) for name, labels in masks.items()}
    scores = {name: iou(confusion_matrix(truth, labels, len(CLASSES)))[2] for name, labels in masks.items()}
    width = rgb.shape[1]

    def draw(figure: Figure, at: int, left: str, right: str) -> None:
        axes = figure.subplots()
        title = f"{left} {scores[left]:.2f}   |   {scores[right]:.2f} {right}     (IoU of the target)"
        show(axes, np.concatenate([painted[left][:, :at], painted[right][:, at:]], axis=1), title)
        axes.axvline(at - 0.5, color="white", lw=1.5)

    controls = {
        "at": ipywidgets.IntSlider(width // 2, min=0, max=width, description="edge"),
        "left": ipywidgets.Dropdown(options=names, value=names[0], description="left"),
        "right": ipywidgets.Dropdown(options=names, value=names[1], description="right"),
    }
    return Explorer(draw, controls, size=(5.6, 4.4))


def colour_range(rgb: UInt8[np.ndarray, "H W 3"], table: Bool[np.ndarray, "H W"]) -> Explorer:
    """Look for a table by its colour. Controls: range of hues, least saturation, range of values; the title scores it.

    The picture shows the pixels in the range as they are and the others dark; below, how often each hue occurs on the
    table and elsewhere. A range whose first hue is above its last goes round through red: the sliders are two.
    """
    hue = cv2.cvtColor(rgb, cv2.COLOR_RGB2HSV)[..., 0]
    counts = [np.bincount(hue[where], minlength=180) for where in (table, ~table)]
    wheel = cv2.cvtColor(
        np.stack([np.arange(180), np.full(180, 200), np.full(180, 230)], axis=1).astype(np.uint8)[None],
        cv2.COLOR_HSV2RGB,
    )

    def draw(figure: Figure, first: int, last: int, saturation: int, value: tuple[int, int]) -> None:
        inside = hsv_mask(rgb, HSVRange((first, saturation, value[0]), (last, 255, value[1])))
        both = np.count_nonzero(inside & table) / max(np.count_nonzero(inside | table), 1)
        picture, hues = figure.subplots(1, 2, width_ratios=[1.2, 1])
        show(picture, np.where(inside[..., None], rgb, rgb // 5), f"IoU with the table: {both:.3f}")
        hues.imshow(wheel, extent=(-0.5, 179.5, -0.12, -0.02), aspect="auto")
        for count, colour, name in zip(counts, ("tab:blue", "0.5"), ("table", "elsewhere"), strict=True):
            hues.plot(np.sqrt(count / max(c.max() for c in counts)), color=colour, label=name, lw=1.2)
        spans = [(first, last)] if first <= last else [(first, 179), (0, last)]
        for low, high in spans:
            hues.axvspan(low - 0.5, high + 0.5, color="gold", alpha=0.4, lw=0)
        hues.set(xlabel="hue", ylabel="pixels (root)", xlim=(-0.5, 179.5), ylim=(-0.12, 1.05), yticks=[])
        hues.legend(fontsize=8)

    controls = {
        "first": ipywidgets.IntSlider(150, min=0, max=179, description="first hue"),
        "last": ipywidgets.IntSlider(179, min=0, max=179, description="last hue"),
        "saturation": ipywidgets.IntSlider(50, min=0, max=255, description="saturation ≥"),
        "value": ipywidgets.IntRangeSlider(value=(190, 255), min=0, max=255, description="value"),
    }
    return Explorer(draw, controls, size=(8.5, 3.1))


def addresses(C: int, H: int, W: int, v: int, u: int, layout: str) -> Integer[np.ndarray, " C"]:
    """Places in memory of a pixel's classes 0 to C - 1: in "NCHW" a whole image apart, in "NHWC" side by side.

    >>> addresses(3, 2, 4, 1, 0, "NCHW").tolist(), addresses(3, 2, 4, 1, 0, "NHWC").tolist()
    ([4, 12, 20], [12, 13, 14])
    """
    pixel, classes = v * W + u, np.arange(C)
    return classes * H * W + pixel if layout == "NCHW" else pixel * C + classes


def engine_buffer(scores: Float[np.ndarray, "C H W"], block: int, align: int) -> tuple[UInt8[np.ndarray, " n"], int]:
    """Write scores as an engine may: 16-bit floats, classes in blocks, rows from multiples of `align` bytes on.

    block: how many classes of a pixel stand side by side. Returns the bytes, and how many lie from row to row. What
    fills up the last block and each row is larger than any score.
    """
    C, H, W = scores.shape
    blocks, step = -(-C // block), -(-2 * block * W // align) * align
    numbers = np.full((blocks, H, step // 2), np.finfo("<f2").max, "<f2")
    for c, plane in enumerate(scores):
        numbers[c // block, :, c % block : block * W : block] = plane
    return numbers.view(np.uint8).ravel(), step


def memory(scores: Float[np.ndarray, "C H W"]) -> Explorer:
    """Read one pixel's classes from the memory of an NCHW blob. Controls: the pixel, and the layout that is believed.

    scores: small, so that every number can be printed. The cells that are read have a thick frame; what they really are
    stands in each cell's colour, the class, and above it.
    """
    C, H, W = scores.shape
    data = scores.ravel()

    def draw(figure: Figure, v: int, u: int, layout: str) -> None:
        axes = figure.subplots()
        read = addresses(C, H, W, v, u, layout)
        for place, number in enumerate(data):
            c, row = place // (H * W), place // W
            x, y = place % (H * W), -c
            axes.add_patch(Rectangle((x, y), 1, 1, fc=PALETTE[c] / 255, ec="white", alpha=0.75))
            axes.text(x + 0.5, y + 0.42, f"{number:.0f}", ha="center", va="center", color="white", fontsize=9)
            axes.text(x + 0.06, y + 0.76, f"{row % H}, {place % W}", fontsize=7, color="white")
        for place in read:
            axes.add_patch(Rectangle((place % (H * W), -(place // (H * W))), 1, 1, fill=False, ec="black", lw=3))
        values = ", ".join(f"{data[place]:.0f}" for place in read)
        axes.set_title(f"pixel ({v}, {u}) read as {layout}: {values}: label {int(data[read].argmax())}")
        axes.set(xlim=(-0.1, H * W + 0.1), ylim=(1 - C - 0.1, 1.1))
        axes.set_yticks([0.5 - c for c in range(C)], [f"class {c}" for c in range(C)])
        axes.set_xticks([])
        for side in axes.spines.values():
            side.set_visible(False)

    controls = {
        "v": ipywidgets.IntSlider(0, min=0, max=H - 1, description="row v"),
        "u": ipywidgets.IntSlider(1, min=0, max=W - 1, description="column u"),
        "layout": ipywidgets.ToggleButtons(options=["NCHW", "NHWC"], value="NHWC", description="read as"),
    }
    return Explorer(draw, controls, size=(8.5, 2.2))
