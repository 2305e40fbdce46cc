"""The schematic of topic 08: the graph of topics around the node, and the same messages over time."""

from style import COLD, HOT, INK, LEAF, SMALL, SOFT, arrow, box, line, schematic, word


@schematic("08_graph", width=16.5, height=10.4)
def graph(axes) -> None:
    """Above, who publishes what to whom; below, when each message was of, and when its answer comes."""
    topics(axes)
    times(axes)


def topics(axes) -> None:
    """Nodes in boxes, topics on arrows, each with the frame that its data is in."""
    word(axes, (0.3, 10.05), "the graph: a box is a node, an arrow a topic", ha="left", colour=SOFT, size=SMALL)
    box(axes, (2.0, 8.6), "camera", colour=COLD)
    box(axes, (2.0, 6.2), "hand", colour=LEAF)
    box(axes, (9.0, 7.4), "segmentation\nnode", width=3.4, height=1.9)
    box(axes, (15.0, 7.4), "arm", width=2.0, colour=HOT)
    arrow(axes, (3.4, 8.9), (7.3, 8.15), "colour, depth, K", shift=(0.0, 0.32), colour=COLD)
    word(axes, (4.6, 7.85), "in camera_optical_frame", size=SMALL, colour=SOFT)
    arrow(axes, (3.4, 6.2), (7.3, 6.8), "transforms", shift=(0.0, 0.32), colour=LEAF)
    word(axes, (5.5, 5.95), "base_link → camera_link → camera_optical_frame", size=SMALL, colour=SOFT, ha="left")
    arrow(axes, (10.7, 7.8), (14.0, 7.8), "cloud, grasp", shift=(0.0, 0.32), colour=HOT)
    word(axes, (12.35, 7.4), "in base_link", size=SMALL, colour=SOFT)
    arrow(axes, (9.0, 8.35), (9.0, 9.7))
    word(axes, (9.2, 9.45), "mask, in camera_optical_frame", size=SMALL, colour=SOFT, ha="left")


def times(axes) -> None:
    """Rows of stamps along one axis of time."""
    line(axes, (0.4, 5.3), (16.1, 5.3), colour=SOFT, width=0.8)
    left, rows = 3.2, {"colour": (4.4, COLD), "depth": (3.5, COLD), "transforms": (2.6, LEAF), "answer": (1.7, HOT)}
    for name, (y, colour) in rows.items():
        word(axes, (left - 0.3, y), name, ha="right", colour=colour)
        line(axes, (left, y), (15.8, y), colour=SOFT, width=0.8)
    arrow(axes, (left, 0.75), (15.9, 0.75))
    word(axes, (15.4, 0.4), "time", size=SMALL)
    mark = {"ha": "center", "va": "center", "zorder": 6}
    for x in (4.2, 7.6, 11.0, 14.4):
        axes.text(x, 4.4, "●", color=COLD, size=13, **mark)
    for x in (4.5, 7.3, 14.7):
        axes.text(x, 3.5, "■", color=COLD, size=12, **mark)
    axes.text(11.3, 3.5, r"$\times$", color=INK, size=15, **mark)
    word(axes, (11.5, 3.82), "lost", size=SMALL, ha="left")
    for x in (3.7, 5.4, 7.1, 8.8, 10.5, 12.2, 13.9):
        axes.text(x, 2.6, "▲", color=LEAF, size=11, **mark)
    line(axes, (7.6, 4.4), (7.3, 3.5), width=2.0)
    line(axes, (7.6, 4.9), (7.6, 0.75), dashed=True, colour=INK)
    word(axes, (7.6, 0.4), "stamp: the image was taken", size=SMALL)
    word(axes, (7.75, 3.05), "between two poses: interpolate", size=SMALL, colour=LEAF, ha="left")
    axes.text(12.7, 1.7, "◆", color=HOT, size=13, **mark)
    arrow(axes, (7.6, 1.7), (12.5, 1.7), "age of the answer", shift=(0.0, 0.3), colour=HOT, width=2.0)
