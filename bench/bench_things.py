"""Simulated heaps: does the network find each thing as one piece, and is it as sure as it is right?

20 scenes each of `clutter` and `bin` that nothing was trained on (seeds from 810,000), 320 x 240. As one piece: a
thing's IoU with something found is over 0.5. Below, all that was found in both, sorted by its certainty
(`labkit.learning.things`): a point of the curve is the share of those found things that are one piece of a true one.
`python -m bench.bench_things docs/things.png` draws it.
"""

import sys
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Integer
from matplotlib import pyplot as plt

import data_gen
from bench.measure import table
from labkit.instance_metrics import pool, score_instances
from labkit.learning.network import load_model, weights_path
from labkit.learning.things import segment_instances
from labkit.metrics import reliability_counts

SEEDS, CONFIGS = range(810_000, 810_020), ("clutter", "bin")


def main(picture: str = "", weights: str = "unet_rgbd") -> str:
    """Score both kinds of scenes; returns the tables. picture: where to draw the reliability curve, if anywhere."""
    network = load_model(weights_path(weights))
    rows, counts = [], np.zeros((10, 3))
    for config in CONFIGS:
        frames = [data_gen.render(data_gen.sample_scene(seed, config)) for seed in SEEDS]
        seen = [segment_instances(network, frame) for frame in frames]
        s = pool([score_instances(f.instances, t.instances) for f, t in zip(frames, seen, strict=True)])
        share = f"{s.over_half} of {s.true} ({100.0 * s.over_half / s.true:.0f} %)"
        rows.append([config, share, s.found, f"{s.foreground_iou:.2f}"])
        for frame, things in zip(frames, seen, strict=True):
            counts += reliability_counts(np.array(things.certainty), one_piece(frame.instances, things.instances))
    points = [(p / n, right / n, int(n)) for n, p, right in counts if n]
    if picture:
        draw(points).savefig(Path(picture), dpi=150, bbox_inches="tight")
    curve = [[f"{said:.2f}", f"{right:.2f}", things] for said, right, things in points]
    return "\n\n".join(
        [
            table("scenes | things as one piece | found | foreground IoU", rows),
            table("certainty, mean | of these one piece | found things", curve),
        ]
    )


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
