"""Schematics of topic 03: the computation graph of the loss of one image, and the U-Net with its skips."""

from itertools import pairwise

from style import COLD, HOT, INK, LEAF, SOFT, arrow, box, schematic, word


@schematic("03_graph", width=17, height=5.4)
def graph(axes) -> None:
    """From the image to the loss, and the gradients on the way back."""
    names = ("image\n$x$", "features\n$f$", "logits\n$z = W f + b$", "softmax\n$p$", "loss\n$-\\log p_y$")
    places = [(1.6, 3.3), (4.7, 3.3), (8.2, 3.3), (11.8, 3.3), (15.2, 3.3)]
    widths = (1.9, 2.1, 2.9, 2.1, 2.3)
    for name, at, width in zip(names, places, widths, strict=True):
        box(
            axes, at, name, width=width, height=1.5, colour=HOT if "loss" in name else COLD if "logits" in name else INK
        )
    for (left, right), (a, b) in zip(pairwise(places), pairwise(widths), strict=True):
        arrow(axes, (left[0] + a / 2, 3.55), (right[0] - b / 2, 3.55))
    back = {"colour": HOT, "dashed": True}
    arrow(axes, (15.2, 2.5), (8.9, 2.5), bend=-0.22, **back)
    word(axes, (12.0, 1.3), r"$\partial \ell / \partial z = p - y$", colour=HOT)
    arrow(axes, (7.5, 2.5), (5.2, 2.5), bend=-0.35, **back)
    word(axes, (6.3, 1.55), r"$W^\top (p - y)$", colour=HOT)
    arrow(axes, (4.2, 2.5), (2.0, 2.5), bend=-0.35, **back)
    word(axes, (3.1, 1.55), "and so on", colour=HOT)
    arrow(axes, (8.2, 2.5), (8.2, 0.75), **back)
    word(axes, (8.2, 0.4), r"$\partial \ell / \partial W = (p - y)\, f^\top$", colour=HOT)
    word(axes, (15.2, 4.9), "labels $y$", colour=LEAF)
    arrow(axes, (15.2, 4.65), (15.2, 4.1), colour=LEAF)
    word(axes, (1.0, 4.9), "solid: values, forward", ha="left", colour=SOFT)
    word(axes, (6.2, 4.9), "dashed: gradients, backward", ha="left", colour=HOT)


@schematic("03_unet", width=17, height=7.6)
def unet(axes) -> None:
    """The kit's U-Net: four scales down, three up, skips between them, and what a block holds."""
    left, right, height = (2.0, 3.6, 5.2, 6.8), (5.2 + 3.4, 3.6 + 6.6, 2.0 + 9.8), (6.2, 4.6, 3.0, 1.4)
    scales, widths = ("1/2", "1/4", "1/8", "1/16"), (32, 64, 96, 96)
    for x, y, scale, width in zip(left, height, scales, widths, strict=True):
        box(axes, (x, y), f"{width} at {scale}", width=2.6, height=0.9, colour=COLD)
    for x, y, scale, width in zip(right, height[2::-1], scales[2::-1], widths[2::-1], strict=True):
        box(axes, (x, y), f"{width} at {scale}", width=2.6, height=0.9, colour=HOT)
    for i in range(3):
        arrow(axes, (left[i], height[i] - 0.45), (left[i + 1] - 0.4, height[i + 1] + 0.45))
    chain = [(left[3], height[3]), *zip(right, height[2::-1], strict=True)]
    for (a, b), (c, d) in pairwise(chain):
        arrow(axes, (a + 0.4, b + 0.45), (c, d - 0.45))
    for i, x in enumerate(right[::-1]):
        arrow(
            axes,
            (left[i] + 1.3, height[i]),
            (x - 1.3, height[i]),
            "skip: added" if i < 2 else "",
            colour=LEAF,
            dashed=True,
        )
    word(axes, (0.1, 7.3), "image", ha="left")
    arrow(axes, (1.2, 7.1), (1.9, 6.65))
    arrow(axes, (right[2] + 0.3, 6.65), (right[2] + 1.2, 7.1))
    word(axes, (right[2] + 1.4, 7.2), "logits", ha="left")
    word(axes, (9.2, 1.75), "channels, at a share of the image's sides", ha="left", colour=SOFT)
    word(axes, (9.2, 1.2), "down: stride 2; residuals from 1/4 on", ha="left", colour=COLD)
    word(axes, (9.2, 0.65), "up: 1x1, enlarged, skip added, 3x3", ha="left", colour=HOT)
