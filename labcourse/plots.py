"""The pictures that lessons and labs share: images side by side, the classes' colours, a cloud seen from two sides."""

from collections.abc import Mapping

import matplotlib.pyplot as plt
import numpy as np
from jaxtyping import Float, Integer, UInt8
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from labkit.labels import CLASSES, IGNORE, PALETTE


def style() -> None:
    """Set a notebook up: small pictures, and a font that is read beside text."""
    plt.rcParams.update(
        {
            "figure.dpi": 80,
            "savefig.dpi": 80,
            "figure.constrained_layout.use": True,
            "font.size": 10,
            "axes.titlesize": 10,
            "axes.spines.top": False,
            "axes.spines.right": False,
            "image.interpolation": "nearest",
        }
    )


def panels(images: Mapping[str, np.ndarray], columns: int = 3, width: float = 9.0, **options) -> Figure:
    """Show images side by side, each under its title; `options` go to imshow (cmap, vmin, vmax ...).

    images: title -> (H, W), or (H, W, 3) RGB uint8. width: of the figure, inches.

    >>> figure = panels({"zeros": np.zeros((3, 4)), "ones": np.ones((3, 4))})
    >>> [axes.get_title() for axes in figure.axes]
    ['zeros', 'ones']
    """
    columns = min(columns, len(images))
    rows = -(-len(images) // columns)
    height, breadth = next(iter(images.values())).shape[:2]
    size = (width, rows * (width / columns * height / breadth + 0.3))
    figure, axes = plt.subplots(rows, columns, figsize=size, squeeze=False)
    for axis in axes.flat:
        axis.axis("off")
    for axis, (title, image) in zip(axes.flat, images.items(), strict=False):
        axis.imshow(image, **options)
        axis.set_title(title)
    return figure


def numbered(numbers: Integer[np.ndarray, "H W"]) -> UInt8[np.ndarray, "H W 3"]:
    """Colour things by their numbers: 0, no thing, is dark, and 255, which nobody judged, is white.

    Twenty colours, which repeat.

    >>> numbered(np.array([[0, 1, 21, 255]]))[0, :, 0].tolist()
    [40, 31, 31, 255]
    """
    colours = np.rint(255.0 * np.array(plt.get_cmap("tab20").colors)).astype(np.uint8)
    picture = colours[(np.asarray(numbers) - 1) % len(colours)]
    picture[numbers == 0], picture[numbers == IGNORE] = 40, 255
    return picture


def class_legend(axes: Axes, **options) -> None:
    """Add the four classes and their colours as a legend; `options` go to Axes.legend."""
    patches = [Patch(color=colour / 255, label=name) for name, colour in zip(CLASSES, PALETTE, strict=True)]
    axes.legend(handles=patches, **({"loc": "upper right", "fontsize": 8, "framealpha": 0.9} | options))


def cloud(figure: Figure, clouds: Mapping[str, Float[np.ndarray, "_ 3"]], sizes: float = 2.0) -> tuple[Axes, Axes]:
    """Draw named clouds (metres, base frame) from above and from the side, to scale; returns the two axes."""
    above, side = figure.subplots(1, 2)
    for name, P in clouds.items():
        above.scatter(P[:, 0], P[:, 1], s=sizes, label=name, linewidths=0)
        side.scatter(P[:, 0], P[:, 2], s=sizes, linewidths=0)
    for axes, vertical in ((above, "y"), (side, "z")):
        axes.set_aspect("equal")
        axes.set(xlabel="x (m)", ylabel=f"{vertical} (m)")
    above.set_title("from above")
    side.set_title("from the side")
    above.legend(fontsize=8, markerscale=3)
    return above, side


def certainty(reports: Mapping[str, Mapping]) -> Figure:
    """Draw whether a network's certainty is worth its name: a reliability diagram, and what declining gains.

    reports: name -> a report of `labkit evaluate --json`, of which `calibration`, `declining` and `trials` are drawn.
    On the left, a point on the diagonal is a probability that comes true as often as it says, one below it less often;
    on the right, a curve that falls from left to right is of a robot that is surer where it succeeds. Topic 07.

    >>> report = {"calibration": [(0.1, 0.2, 50)], "declining": [(0.9, 0.5, 1.0), (0.4, 1.0, 0.8)], "trials": 10}
    >>> [axes.get_ylabel() for axes in certainty({"test": report}).axes]
    ['share that are targets', 'of these lifted (%)']
    """
    figure, (left, right) = plt.subplots(1, 2, figsize=(8.6, 3.6))
    left.plot([0, 1], [0, 1], color="0.6", linewidth=1, label="calibrated")
    for (name, report), (marker, dashes) in zip(reports.items(), (("o", "-"), ("s", "--"), ("^", ":")), strict=False):
        said, true, _ = np.array(report["calibration"]).T
        left.plot(said, true, marker=marker, linestyle=dashes, label=name)
        _, tried, lifts = np.array(report["declining"]).T
        label = f"{name}, {report['trials']} scenes"
        right.plot(100 * tried, 100 * lifts, marker=marker, linestyle=dashes, label=label)
    left.set(xlabel="the network's probability of target", ylabel="share that are targets", aspect="equal")
    right.set(xlabel="surest scenes tried (%)", ylabel="of these lifted (%)", xlim=(0, 103))
    left.legend(fontsize=8)
    right.legend(fontsize=8)
    return figure
