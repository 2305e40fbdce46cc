"""Schematic of topic 01: one label image as names, as planes and as counts."""

from matplotlib.patches import Rectangle
from style import COLD, HOT, INK, LEAF, SOFT, arrow, schematic, word

LABELS = ((0, 0, 0, 0), (1, 2, 2, 1), (1, 1, 3, 255))
FILL = {0: "#d4d4d4", 1: "#cfe6f6", 2: "#f7cdb0", 3: "#c3e6dc", 255: "#ffffff"}


def grid(axes, left: float, top: float, cell: float, values, fills) -> None:
    """Draw a small image as squares with a number in each."""
    for v, row in enumerate(values):
        for u, value in enumerate(row):
            x, y = left + u * cell, top - (v + 1) * cell
            axes.add_patch(Rectangle((x, y), cell, cell, facecolor=fills(v, u), edgecolor=INK, linewidth=1.0, zorder=3))
            word(axes, (x + cell / 2, y + cell / 2), str(value), size=9)


@schematic("01_labels", width=17, height=6.2)
def labels(axes) -> None:
    """Labels y, the four planes of Y, and what adding them up gives."""
    grid(axes, 0.4, 4.9, 0.95, LABELS, lambda v, u: FILL[LABELS[v][u]])
    word(axes, (2.3, 5.4), "$y$: one name per pixel")
    word(axes, (2.3, 0.9), "255: nobody judged it", colour=SOFT)
    arrow(axes, (4.5, 3.5), (6.3, 3.5), "one-hot", shift=(0, 0.35))
    arrow(axes, (6.3, 2.9), (4.5, 2.9), "argmax", shift=(0, -0.4))
    names = (("background", INK), ("surface", COLD), ("target", HOT), ("obstacle", LEAF))
    for c in (3, 2, 1, 0):
        left, top = 6.8 + 2.5 * c, 5.3
        plane = [[int(value == c) for value in row] for row in LABELS]
        grid(axes, left, top - 0.7, 0.55, plane, lambda v, u, c=c: FILL[c] if LABELS[v][u] == c else "#ffffff")
        word(axes, (left + 1.1, top - 0.35), names[c][0], size=9, colour=names[c][1])
        arrow(axes, (left + 1.1, 2.9), (left + 1.1, 2.2))
        word(axes, (left + 1.1, 1.8), str(sum(map(sum, plane))), colour=names[c][1])
    word(axes, (11.5, 5.6), "$Y$: one plane per class, 0 or 1")
    word(axes, (5.4, 1.65), "pixels per class:", ha="center")
    word(axes, (6.8, 0.9), "planes may be added and averaged, names may not", ha="left", colour=SOFT)
