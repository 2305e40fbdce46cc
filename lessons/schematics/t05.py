"""The schematic of topic 05: what training with weights does to probabilities, and the way back."""

from matplotlib.patches import Rectangle
from style import COLD, HOT, INK, SMALL, SOFT, TINTS, arrow, line, schematic, word


def bars(axes, left: float, bottom: float, values, name: str) -> None:
    """Two bars, surface and target, with their numbers."""
    for i, (value, colour, label) in enumerate(zip(values, (COLD, HOT), ("surface", "target"), strict=True)):
        x = left + 1.6 * i
        hatch = "" if i == 0 else "////"
        look = {"facecolor": TINTS[colour], "edgecolor": INK, "linewidth": 1.2, "hatch": hatch}
        axes.add_patch(Rectangle((x, bottom), 1.2, 2.6 * value, **look))
        word(axes, (x + 0.6, bottom + 2.6 * value + 0.3), f"{value:g}")
        word(axes, (x + 0.6, bottom - 0.3), label, size=SMALL, colour=colour)
    line(axes, (left - 0.2, bottom), (left + 3.0, bottom))
    word(axes, (left + 1.4, bottom - 0.85), name)


@schematic("05_shift", width=16, height=7.6)
def shift(axes) -> None:
    """Bars of p and of q*, the arrows between them, and the threshold on a line of probabilities."""
    bars(axes, 0.9, 4.1, (0.9, 0.1), "true probabilities p")
    bars(axes, 11.9, 4.1, (0.5, 0.5), "a weighted network says q*")
    arrow(axes, (4.6, 6.1), (11.2, 6.1))
    word(axes, (7.9, 6.55), r"train with weights $w$ = (1, 9):  $q^\star \propto w\,p$")
    arrow(axes, (11.2, 4.7), (4.6, 4.7), dashed=True)
    word(axes, (7.9, 5.1), r"the way back: logits $-\ \log w$")
    left, right, y = 2.0, 14.0, 1.2
    line(axes, (left, y), (right, y))
    for value, text in ((0.0, "0"), (1.0, "1"), (0.5, "1/2"), (0.1, "1/10")):
        x = left + (right - left) * value
        line(axes, (x, y - 0.15), (x, y + 0.15))
        word(axes, (x, y - 0.5), text)
    word(axes, (8.0, 0.25), "true probability of target", size=SMALL, colour=SOFT)
    arrow(axes, (left + 6.0, y + 0.55), (left + 1.2, y + 0.55), colour=HOT, width=1.8)
    word(axes, (left + 3.6, y + 0.95), '"target" is said from here on', size=SMALL, colour=HOT)
    word(axes, (left + 6.2, y + 0.55), "without weights", ha="left", size=SMALL, colour=SOFT)
    word(axes, (left + 1.0, y + 0.55), "with", ha="right", size=SMALL, colour=HOT)
