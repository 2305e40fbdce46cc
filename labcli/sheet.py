"""The sheet as a page to print at true size: the board, a ruler to check the print with, the base frame's axes."""

import io

import matplotlib.figure
import numpy as np

from labkit.geometry.sheet import RULER_MM, Sheet
from labkit.support.validation import require

PAPERS = {"a4": (210.0, 297.0), "letter": (215.9, 279.4)}  # millimetres
DOTS = 10  # per millimetre, in the board's picture; every edge of it lies at a whole millimetre
AXES_MM = 40.0
ABOVE_RULER_MM = 14.0


def corner_mm(paper: str) -> tuple[float, float]:
    """Where the board's lower left corner, the base frame's origin, lies on the paper: millimetres from its lower left.

    >>> corner_mm("a4")
    (15.0, 39.5)
    """
    require("paper", paper in PAPERS, f"one of {', '.join(PAPERS)}", repr(paper))
    (width, height), (across, up) = PAPERS[paper], Sheet().size_mm
    return (width - across) / 2.0, (height - up) / 2.0 + 11.0


def sheet_pdf(paper: str = "a4") -> bytes:
    """The sheet on A4 or letter paper, as a PDF of one page. Raises ValueError for another paper."""
    left, bottom = corner_mm(paper)
    width, height = PAPERS[paper]
    across, up = Sheet().size_mm
    with matplotlib.rc_context({"pdf.fonttype": 42, "font.size": 7}):
        figure = matplotlib.figure.Figure(figsize=(width / 25.4, height / 25.4))
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        axes.set(xlim=(0.0, width), ylim=(0.0, height))
        axes.set_axis_off()
        board = Sheet().board.generateImage((across * DOTS, up * DOTS))
        place = (left, left + across, bottom, bottom + up)
        axes.imshow(board, cmap="gray", vmin=0, vmax=255, extent=place, interpolation="none", aspect="auto")
        _base_frame(axes, left, bottom)
        _ruler(axes, (width - RULER_MM) / 2.0, bottom - ABOVE_RULER_MM)
        file = io.BytesIO()
        figure.savefig(file, format="pdf", metadata={"Title": "labkit's sheet", "CreationDate": None})
    return file.getvalue()


def _base_frame(axes, left: float, bottom: float) -> None:
    """Two arrows along the board's edges from its lower left corner, where the base frame's origin is."""
    for name, (dx, dy) in (("x", (1.0, 0.0)), ("y", (0.0, 1.0))):
        start = np.array((left - 2.0 * dy, bottom - 2.0 * dx))
        end = start + np.multiply((dx, dy), AXES_MM)
        axes.annotate("", end, start, arrowprops={"arrowstyle": "-|>", "lw": 0.8, "color": "black"})
        axes.text(*(end + np.multiply((dx, dy), 2.0)), name, ha="center", va="center")
    text = "base frame: origin at the board's lower left corner; z points out of the paper"
    axes.text(left + AXES_MM + 6.0, bottom - 2.0, text, va="center")


def _ruler(axes, left: float, bottom: float) -> None:
    axes.plot((left, left + RULER_MM), (bottom, bottom), color="black", lw=0.4, solid_capstyle="butt")
    for x in range(RULER_MM + 1):
        tall = 4.0 if x % 10 == 0 else 2.6 if x % 5 == 0 else 1.6
        axes.plot((left + x, left + x), (bottom, bottom + tall), color="black", lw=0.25, solid_capstyle="butt")
        if x % 10 == 0:
            axes.text(left + x, bottom + 4.6, str(x), ha="center", va="bottom", size=5)
    text = f"Print at 100 %, not fitted to the page. If this line is not {RULER_MM} mm long, say --measured-mm LENGTH."
    axes.text(left, bottom - 3.0, text, va="center")
