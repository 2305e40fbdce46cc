"""One style for the lessons' schematics: black ink on a white card, so that they read on a light and on a dark page.

A schematic is a function that draws on the Axes that it gets, and is marked with its file's name and its size:

    @schematic("02_cut", width=16, height=7)
    def cut(axes):
        node(axes, (2, 5), "s", "source")

Coordinates are centimetres of the page, from the lower left corner, and equal in both directions. What colour says is
said by a shape, a dash or a word as well. `python lessons/schematics` draws all of them anew.
"""

import io
from collections.abc import Callable
from dataclasses import dataclass

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyArrowPatch, FancyBboxPatch, Polygon

INK, SOFT, PAPER = "#1a1a1a", "#6e6e6e", "#ffffff"  # lines and words; what stands back; the card
HOT, COLD, LEAF = (
    "#c84600",
    "#1f6fa8",
    "#00705a",
)  # after the classes target, surface and obstacle, dark enough for words
TINTS = {HOT: "#f7cdb0", COLD: "#cfe6f6", LEAF: "#c3e6dc", INK: "#e6e6e6"}
CM = 1 / 2.54
SIZE, SMALL = 10.5, 9.0  # of words, in points
SETTINGS = {
    "svg.fonttype": "path",  # words are drawn: they look the same wherever the file is shown
    "svg.hashsalt": "labkit",  # the same bytes at each run
    "font.family": "DejaVu Sans",
    "mathtext.fontset": "dejavusans",
}


@dataclass(frozen=True)
class Schematic:
    """A drawing, its name and its size in centimetres."""

    name: str
    width: float
    height: float
    draw: Callable[[Axes], None]

    def figure(self) -> Figure:
        """Draw it on a figure of its own."""
        figure = Figure((self.width * CM, self.height * CM), facecolor=PAPER)
        axes = figure.add_axes((0, 0, 1, 1))
        axes.set(xlim=(0, self.width), ylim=(0, self.height), aspect="equal")
        axes.set_axis_off()
        self.draw(axes)
        return figure

    def svg(self) -> bytes:
        """The bytes of its SVG file."""
        file = io.BytesIO()
        with matplotlib.rc_context(SETTINGS):
            FigureCanvasSVG(self.figure()).print_svg(file, metadata={"Date": None, "Creator": None})
        return file.getvalue()


ALL: dict[str, Schematic] = {}


def schematic(name: str, width: float, height: float) -> Callable:
    """Mark a function as the schematic of this name; width and height in centimetres, 17 wide at most."""

    def add(draw: Callable[[Axes], None]) -> Callable[[Axes], None]:
        ALL[name] = Schematic(name, width, height, draw)
        return draw

    return add


def word(axes: Axes, at, text: str, *, size: float = SIZE, colour: str = INK, **options) -> None:
    """Write a word or a formula ($...$), centred at a place unless ha or va say otherwise."""
    axes.text(*at, text, size=size, color=colour, **({"ha": "center", "va": "center", "zorder": 5} | options))


def node(axes: Axes, at, text: str = "", *, colour: str = INK, radius: float = 0.55, square: bool = False) -> None:
    """Draw a node: a circle, or a square, with its name inside."""
    look = {"facecolor": TINTS[colour], "edgecolor": INK, "linewidth": 1.3, "zorder": 3}
    x, y = at
    if square:
        axes.add_patch(
            Polygon(
                [
                    (x - radius, y - radius),
                    (x + radius, y - radius),
                    (x + radius, y + radius),
                    (x - radius, y + radius),
                ],
                **look,
            )
        )
    else:
        axes.add_patch(Circle(at, radius, **look))
    word(axes, at, text)


def box(axes: Axes, at, text: str, *, width: float = 2.8, height: float = 1.1, colour: str = INK) -> None:
    """Draw a box with rounded corners around words: a step, a layer, a message."""
    corner = (at[0] - width / 2 + 0.15, at[1] - height / 2 + 0.15)
    rounded = FancyBboxPatch(
        corner,
        width - 0.3,
        height - 0.3,
        "round,pad=0.15",
        facecolor=TINTS[colour],
        edgecolor=INK,
        linewidth=1.3,
        zorder=3,
    )
    axes.add_patch(rounded)
    word(axes, at, text)


def line(axes: Axes, start, end, *, colour: str = INK, dashed: bool = False, width: float = 1.3) -> None:
    """Draw a straight line; a dashed one is cut, hidden or imagined."""
    axes.plot(
        *zip(start, end, strict=True),
        color=colour,
        linewidth=width,
        linestyle=(0, (4, 2.5)) if dashed else "-",
        zorder=1,
        solid_capstyle="round",
    )


def arrow(
    axes: Axes,
    start,
    end,
    text: str = "",
    *,
    colour: str = INK,
    dashed: bool = False,
    gap: float = 0.0,
    bend: float = 0.0,
    shift=(0.0, 0.0),
    width: float = 1.3,
) -> None:
    """Draw an arrow between two places, `gap` short of both, bent by `bend`, and its name at the middle + `shift`."""
    start, end = np.asarray(start, float), np.asarray(end, float)
    along = (end - start) / np.linalg.norm(end - start)
    points = start + gap * along, end - gap * along
    axes.add_patch(
        FancyArrowPatch(
            *map(tuple, points),
            arrowstyle="-|>",
            mutation_scale=11,
            shrinkA=0,
            shrinkB=0,
            color=colour,
            linewidth=width,
            linestyle=(0, (4, 2.5)) if dashed else "-",
            zorder=2,
            connectionstyle=f"arc3,rad={bend}",
        )
    )
    if text:
        across = np.array([along[1], -along[0]])  # where a bent arrow bulges
        middle = (start + end) / 2 + across * bend * np.linalg.norm(end - start) / 2 + shift
        word(axes, middle, text, size=SMALL, colour=colour, bbox={"facecolor": PAPER, "edgecolor": "none", "pad": 1.2})
