"""The schematic of topic 04: two regions, and where their parts stand in the confusion matrix."""

from matplotlib.patches import Circle, Rectangle
from style import COLD, HOT, INK, LEAF, SOFT, TINTS, arrow, line, schematic, word


@schematic("04_counts", width=16, height=7)
def counts(axes) -> None:
    """Truth A and prediction B of one class in an image; beside it, its row and its column of the matrix."""
    axes.add_patch(Rectangle((0.4, 0.9), 7.2, 5.2, fill=False, edgecolor=INK, linewidth=1.3))
    truth, said = Circle((3.1, 3.4), 1.75, facecolor=TINTS[COLD]), Circle((4.9, 3.4), 1.75, facecolor=TINTS[HOT])
    for circle in (truth, said):
        axes.add_patch(circle)
    both = Circle((4.9, 3.4), 1.75, facecolor=TINTS[LEAF])
    axes.add_patch(both)
    both.set_clip_path(truth)
    for x, colour, dashes in ((3.1, COLD, "-"), (4.9, HOT, (0, (4, 2.5)))):
        axes.add_patch(Circle((x, 3.4), 1.75, fill=False, edgecolor=colour, linewidth=1.8, linestyle=dashes))
    word(axes, (2.2, 3.4), "FN")
    word(axes, (4.0, 3.4), "TP")
    word(axes, (5.8, 3.4), "FP")
    word(axes, (2.2, 5.6), "A: is c", colour=COLD)
    word(axes, (5.9, 5.6), "B: is called c", colour=HOT)
    word(axes, (2.1, 1.3), "neither: no vote", colour=SOFT)
    word(axes, (4.0, 0.4), "an image")
    left, top, side = 10.4, 5.5, 1.1
    kinds = {(1, 0): COLD, (1, 2): COLD, (1, 3): COLD, (0, 1): HOT, (2, 1): HOT, (3, 1): HOT, (1, 1): LEAF}
    for i in range(4):
        for j in range(4):
            colour = TINTS[kinds[i, j]] if (i, j) in kinds else "#ffffff"
            corner = (left + j * side, top - (i + 1) * side)
            axes.add_patch(Rectangle(corner, side, side, facecolor=colour, edgecolor=INK, linewidth=1.0))
            name = "TP" if (i, j) == (1, 1) else {COLD: "FN", HOT: "FP"}.get(kinds.get((i, j)), "")
            word(axes, (corner[0] + side / 2, corner[1] + side / 2), name)
    word(axes, (left - 0.3, top - 1.5 * side), "true c", ha="right", colour=COLD)
    word(axes, (left + 1.5 * side, top + 0.35), "called c", colour=HOT)
    word(axes, (left - 0.3, top - 0.3), "true i", ha="right", colour=SOFT)
    arrow(axes, (left - 0.8, top - 0.6), (left - 0.8, top - side - 0.2), colour=SOFT)
    word(axes, (left + 3.0 * side, top + 0.75), "called j", ha="left", colour=SOFT)
    arrow(axes, (left + 1.9 * side, top + 0.75), (left + 2.8 * side, top + 0.75), colour=SOFT)
    word(axes, (12.0, 0.4), r"IoU = $|A \cap B|\,/\,|A \cup B|$ = TP / (TP + FN + FP)", size=9.5)
    line(axes, (8.0, 0.4), (8.0, 6.4), colour=SOFT, dashed=True, width=0.8)
