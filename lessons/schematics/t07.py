"""The schematic of topic 07: the hand from the side and from above, with its axes, its measures and the contacts."""

from matplotlib.patches import Circle, Ellipse, Rectangle
from style import COLD, HOT, INK, LEAF, SMALL, SOFT, TINTS, arrow, line, schematic, word


@schematic("07_hand", width=16.5, height=8.2)
def hand(axes) -> None:
    """From the side: palm, fingers, tips, table and contacts; from above: what the jaws push and what slips."""
    from_the_side(axes)
    from_above(axes)


def block(axes, corner, width, height, colour=INK, **options) -> None:
    """A part of the hand, or of the thing."""
    look = {"facecolor": TINTS[colour], "edgecolor": INK, "linewidth": 1.3, "zorder": 3}
    axes.add_patch(Rectangle(corner, width, height, **(look | options)))


def from_the_side(axes) -> None:
    """The plane of closing axis and approach."""
    word(axes, (4.3, 7.8), "from the side")
    line(axes, (0.4, 0.9), (8.2, 0.9), width=2.0)
    word(axes, (0.5, 0.55), "table", size=SMALL, ha="left")
    block(axes, (1.3, 5.4), 6.0, 1.3)
    word(axes, (4.3, 6.05), "palm")
    for left in (1.9, 5.8):
        block(axes, (left, 1.4), 0.9, 4.0)
    axes.add_patch(Circle((4.3, 2.4), 1.5, facecolor=TINTS[HOT], edgecolor=INK, linewidth=1.3, zorder=2))
    word(axes, (4.3, 3.3), "thing", size=SMALL)
    for x in (2.8, 5.8):
        axes.add_patch(Circle((x, 2.4), 0.14, facecolor=HOT, edgecolor=INK, zorder=6))
    axes.add_patch(Circle((7.05, 2.4), 0.14, facecolor=HOT, edgecolor=INK, zorder=6))
    word(axes, (7.3, 2.4), "contact", size=SMALL, colour=HOT, ha="left")
    arrow(axes, (4.3, 2.4), (4.3, 0.98), colour=COLD, width=2.0)
    word(axes, (4.62, 1.3), "z", colour=COLD)
    arrow(axes, (4.3, 2.4), (5.5, 2.4), colour=LEAF, width=2.0)
    word(axes, (5.2, 2.7), "y", colour=LEAF)
    arrow(axes, (2.8, 4.4), (5.8, 4.4))
    arrow(axes, (5.8, 4.4), (2.8, 4.4))
    word(axes, (4.3, 4.72), "opening ≤ 80 mm", size=SMALL)
    for start, end in (((0.9, 1.4), (0.9, 5.4)), ((0.9, 5.4), (0.9, 1.4))):
        arrow(axes, start, end)
    word(axes, (0.55, 3.4), "palm above tips: 46 mm", size=SMALL, rotation=90)
    line(axes, (0.75, 1.4), (8.2, 1.4), colour=SOFT, dashed=True)
    word(axes, (7.5, 1.18), "4 mm of air", size=SMALL, colour=SOFT)


def from_above(axes) -> None:
    """The table's plane: the origin, the closing axis y and the pads' axis x, and the thing's true middle."""
    word(axes, (12.6, 7.8), "from above")
    axes.add_patch(Ellipse((13.2, 3.9), 2.3, 4.6, facecolor=TINTS[HOT], edgecolor=INK, linewidth=1.3, zorder=1))
    for left in (10.2, 14.4):
        block(axes, (left, 4.1), 0.8, 1.5)
    word(axes, (9.7, 4.85), "pad", size=SMALL)
    word(axes, (15.65, 4.85), "pad", size=SMALL)
    arrow(axes, (12.7, 4.85), (14.3, 4.85), colour=LEAF, width=2.0)
    word(axes, (14.0, 5.2), "y", colour=LEAF)
    arrow(axes, (12.7, 4.85), (12.7, 6.9), colour=HOT, width=2.0)
    word(axes, (13.0, 6.8), "x", colour=HOT)
    axes.add_patch(Circle((12.7, 4.85), 0.13, facecolor=INK, zorder=6))
    word(axes, (12.05, 5.15), "origin", size=SMALL)
    word(axes, (13.2, 3.5), r"$\times$", size=18)
    word(axes, (13.2, 2.95), "true middle", size=SMALL)
    line(axes, (12.7, 4.85), (12.7, 3.5), dashed=True, colour=INK, width=2.0)
    line(axes, (12.7, 3.5), (13.1, 3.5), dashed=True, colour=LEAF, width=2.0)
    word(axes, (10.3, 3.35), "along x: this slips", size=SMALL)
    arrow(axes, (11.5, 3.65), (12.6, 4.1))
    word(axes, (10.6, 2.1), "along y: the jaws\npush this away", size=SMALL, colour=LEAF)
    arrow(axes, (11.7, 2.5), (12.8, 3.38), colour=LEAF)
    word(axes, (12.6, 0.75), "columns of $T_{base,grasp}$: x, y, z and the origin", size=SMALL)
