"""Simulated heaps: does the network find each thing as one piece, and is it as sure as it is right?

20 scenes each of `clutter`, `bin` and stacks (`bench/stacks.py`: tins and boxes on each other, things in bowls) that
nothing was trained on (seeds from 810,000; stacks from 0), 320 x 240. As one piece: a thing's IoU with something found
is over 0.5. A second click: each thing of the stacks that is found merged with another one is clicked in its middle,
and then the other one, too (`labkit.crf.clicks`); IoU with the clicked thing. Parted: things that another one cuts in
two in the picture, of 150 scenes of `any`, `clutter` and `messy`, 640 x 480, exact depth (`bench/parted.py`). Below,
all that was found in clutter and bins, sorted by its certainty (`labkit.learning.things`): a point of the curve is the
share of those found things that are one piece of a true one. `python -m bench.bench_things docs/things.png` draws it.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Bool, Float, Integer
from matplotlib import pyplot as plt

import data_gen
from bench import parted, stacks
from bench.measure import table
from labkit.crf.clicks import cut_between
from labkit.frame import RGBDFrame
from labkit.geometry import back_project
from labkit.instance_metrics import pool, score_instances
from labkit.labels import IGNORE
from labkit.learning.engines import open_engine
from labkit.learning.network import load_model, weights_path
from labkit.learning.things import segment_instances
from labkit.metrics import reliability_counts

SEEDS, CONFIGS, STACKS = range(810_000, 810_020), ("clutter", "bin"), range(20)
PARTED, FIRST_PARTED = 150, 830_000  # scenes


def main(picture: str = "", weights: str = "unet_rgbd") -> str:
    """Score both kinds of scenes; returns the tables. picture: where to draw the reliability curve, if anywhere."""
    network = load_model(weights_path(weights))
    rows, counts = [], np.zeros((10, 3))
    for config in CONFIGS:
        frames = [data_gen.render(data_gen.sample_scene(seed, config)) for seed in SEEDS]
        seen = [segment_instances(network, frame) for frame in frames]
        rows.append(found_row(config, frames, seen))
        for frame, things in zip(frames, seen, strict=True):
            counts += reliability_counts(np.array(things.certainty), one_piece(frame.instances, things.instances))
    frames = [stacks.frame_of(seed) for seed in STACKS]
    seen = [segment_instances(network, frame) for frame in frames]
    rows.append(found_row("stacks", frames, seen))
    clicked = np.array([pair for f, t in zip(frames, seen, strict=True) for pair in second_clicks(f, t.instances)])
    points = [(p / n, right / n, int(n)) for n, p, right in counts if n]
    if picture:
        draw(points).savefig(Path(picture), dpi=150, bbox_inches="tight")
    curve = [[f"{said:.2f}", f"{right:.2f}", things] for said, right, things in points]
    return "\n\n".join(
        [
            table("scenes | things as one piece | found | foreground IoU", rows),
            table("stacks: things found merged | IoU after one click | after the second | over 0.5", [means(clicked)]),
            table("things | as one piece (IoU over 0.75) | one number on both parts", parted_rows(network)),
            table("certainty, mean | of these one piece | found things", curve),
        ]
    )


def found_row(name: str, frames, seen) -> list:
    """A kind's row of the first table."""
    s = pool([score_instances(f.instances, t.instances) for f, t in zip(frames, seen, strict=True)])
    share = f"{s.over_half} of {s.true} ({100.0 * s.over_half / s.true:.0f} %)"
    return [name, share, s.found, f"{s.foreground_iou:.2f}"]


def second_clicks(frame: RGBDFrame, found: Integer[np.ndarray, "H W"]) -> Iterator[tuple[float, float]]:
    """For each thing of which less than half of what is found at its middle is: the IoU of that, and once it is parted.

    The second click is in the middle of the thing that has most of the rest.
    """
    points = back_project(frame.depth, frame.K)
    for number in np.setdiff1d(frame.instances, (0, IGNORE)):
        true = frame.instances == number
        u, v = middle(true)
        mask = (found == found[v, u]) & (found[v, u] > 0)
        others = np.bincount(frame.instances[mask & ~true & (frame.instances != IGNORE)], minlength=1)
        others[0] = 0
        if true.sum() < 60 or others.max() < 0.3 * max(mask.sum(), 1):
            continue  # nothing to speak of is merged with it
        other = middle(mask & (frame.instances == others.argmax()))
        part = cut_between(mask, frame.rgb, points, [(u, v)], [other])
        yield iou(mask, true), iou(part, true)


def middle(mask: Bool[np.ndarray, "H W"]) -> tuple[int, int]:
    """The pixel (u, v) of a mask that is furthest from what is not of it."""
    inner = cv2.distanceTransform(np.pad(mask, 1).astype(np.uint8), cv2.DIST_L2, 5)[1:-1, 1:-1]
    v, u = np.unravel_index(inner.argmax(), mask.shape)
    return int(u), int(v)


def iou(a: Bool[np.ndarray, "H W"], b: Bool[np.ndarray, "H W"]) -> float:
    """What two masks share, of what either has."""
    return float((a & b).sum() / max((a | b).sum(), 1))


def means(clicked: Float[np.ndarray, "n 2"]) -> list:
    """A row of means over the clicked things."""
    before, after = clicked.mean(axis=0)
    halves = ", then ".join(str(int(share)) for share in (clicked > 0.5).sum(axis=0))
    return [len(clicked), f"{before:.2f}", f"{after:.2f}", halves]


def parted_rows(network) -> list[list]:
    """Rows of things that are whole in the picture, and parted."""
    counts = parted.counted(open_engine(network), PARTED, FIRST_PARTED)
    return [
        [
            kind,
            f"{counts[kind, 'one piece']} of {counts[kind, 'all']}",
            counts[kind, "one number"] if kind == "parted" else "",
        ]
        for kind in ("whole", "parted")
    ]


def one_piece(true: Integer[np.ndarray, "H W"], found: Integer[np.ndarray, "H W"]) -> Bool[np.ndarray, "_"]:
    """For each found thing, number 1 first, whether its IoU with a true one is over 0.5."""
    iou = score_instances(found, true).iou  # with the roles exchanged: the best true thing for each found one
    return np.array(iou) > 0.5


def draw(points) -> plt.Figure:
    """The reliability curve, as lesson 07 draws the classes'."""
    said, right, _ = np.array(points).T
    figure, axes = plt.subplots(figsize=(4.3, 3.6))
    axes.plot([0, 1], [0, 1], color="0.6", linewidth=1, label="calibrated")
    axes.plot(said, right, marker="o", label="things in clutter and bins")
    axes.set(xlabel="certainty of a thing", ylabel="share that are one piece", aspect="equal")
    axes.legend(fontsize=8)
    return figure


if __name__ == "__main__":
    print(main(*sys.argv[1:]))
