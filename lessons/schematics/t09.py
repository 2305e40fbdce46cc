"""The schematic of topic 09: one network in three engines and the contract between them; one memory read two ways."""

from matplotlib.patches import Rectangle
from style import COLD, HOT, INK, LEAF, SMALL, SOFT, TINTS, arrow, box, schematic, word


@schematic("09_engines", width=16.5, height=9.0)
def engines(axes) -> None:
    """Above, from one file to logits that must agree; below, where the scores of pixel 1 lie in memory."""
    box(axes, (1.9, 7.3), "PyTorch\nnetwork", width=2.8, height=1.4, colour=LEAF)
    arrow(axes, (3.3, 7.3), (4.7, 7.3), "export", shift=(0.0, 0.35))
    box(axes, (6.1, 7.3), "ONNX file", width=2.8, height=1.1)
    for y, name in ((8.4, "OpenCV"), (7.3, "onnxruntime"), (6.2, "any other")):
        arrow(axes, (7.5, 7.3), (8.6, y))
        box(axes, (10.1, y), name, width=3.0, height=0.9, colour=COLD)
        arrow(axes, (11.6, y), (12.7, 7.3))
    box(axes, (14.4, 7.3), "logits within\na tolerance?", width=3.4, height=1.4, colour=HOT)
    arrow(axes, (1.9, 6.55), (14.4, 6.55), bend=0.22)
    word(axes, (8.15, 4.95), "the reference", size=SMALL, colour=SOFT)
    word(axes, (0.3, 4.1), "2 classes, 4 pixels; the scores of pixel 1 are framed", ha="left", size=SMALL, colour=SOFT)
    memory(axes, 3.1, "NCHW: plane after plane", [(c, p) for c in range(2) for p in range(4)])
    memory(axes, 1.2, "NHWC: pixel after pixel", [(c, p) for p in range(4) for c in range(2)])


def memory(axes, y: float, name: str, places) -> None:
    """A row of places, each with its class and pixel."""
    word(axes, (0.3, y), name, ha="left")
    for i, (c, p) in enumerate(places):
        look = {"facecolor": TINTS[HOT if c else COLD], "edgecolor": INK, "linewidth": 3.0 if p == 1 else 0.8}
        axes.add_patch(Rectangle((6.0 + 1.25 * i, y - 0.45), 1.15, 0.9, zorder=4 if p == 1 else 3, **look))
        word(axes, (6.58 + 1.25 * i, y + 0.12), f"class {c}", size=7.8)
        word(axes, (6.58 + 1.25 * i, y - 0.22), f"pixel {p}", size=7.5)
        word(axes, (6.58 + 1.25 * i, y - 0.75), str(i), size=SMALL, colour=SOFT)
    word(axes, (5.6, y - 0.75), "place", size=SMALL, colour=SOFT, ha="right")
