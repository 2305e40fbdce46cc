"""Any camera: target IoU against the camera's roll and the picture's size, and the time of a frame at each size.

The same scenes each time. A rolled camera is scored on the disc that it sees whatever its roll. "As it is": the same
weights without the canonical view. `docs/any_camera.png` shows the scores.
"""

import time
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.spatial.transform import Rotation

from bench.measure import in_turns, table
from data_gen import sample_scene
from labkit.frame import RGBDFrame
from labkit.labels import IGNORE, TARGET
from labkit.learning.network import TorchEngine, load_model, weights_path
from labkit.metrics import confusion_matrix, iou
from labkit.pipeline import Pipeline
from labkit.sim.world import World

FIGURE = Path(__file__).parents[1] / "docs" / "any_camera.png"
SEEDS = range(900_000, 900_030)
ROLLS = (0, 20, 45, 90, 135, 180, 225, 270, 315)  # degrees
WIDTHS = (160, 320, 640, 1280, 2560)  # of 4:3 pictures
IN_VIEW, AS_IT_IS = "in the canonical view", "as it is"
MOST_AS_IT_IS = 640  # wider pictures take minutes without the view
ROUNDS = 5  # of timing


def main() -> str:
    """Score and time the shipped network; returns the tables."""
    network = load_model(weights_path("unet_rgbd"))
    seeing = TorchEngine(network)
    ways = {IN_VIEW: Pipeline(seeing), AS_IT_IS: Pipeline(TorchEngine(network, replace(seeing.takes, pixel=None)))}
    found = defaultdict(lambda: np.zeros((4, 4), np.int64))
    for seed in SEEDS:
        for key, frame in pictures(seed):
            for name, pipeline in ways.items():
                if name == IN_VIEW or frame.size[0] <= MOST_AS_IT_IS:
                    found[name, *key] += confusion_matrix(frame.labels, pipeline.perceive(frame)[0], 4)
    scores = {key: iou(n)[TARGET] for key, n in found.items()}
    draw(scores)
    tables = []
    for what, values in (("roll", ROLLS), ("width", WIDTHS)):
        rows = [
            (name, *(f"{scores.get((name, what, x), np.nan):.3f}".replace("nan", "") for x in values)) for name in ways
        ]
        tables.append(table(f"target IoU, {what} | " + " | ".join(map(str, values)), rows))
    return "\n\n".join([*tables, clock(ways[IN_VIEW])])


def pictures(seed: int) -> Iterable[tuple[tuple[str, int], RGBDFrame]]:
    """A scene's frames with their roll or width: rendered anew by a camera that is held so."""
    spec = sample_scene(seed, "test")
    with World(spec) as world:
        for roll in ROLLS:
            T = np.array(spec.camera.T_base_cam)
            T[:3, :3] = T[:3, :3] @ Rotation.from_euler("z", roll, degrees=True).as_matrix()
            frame = world.render(camera=replace(spec.camera, T_base_cam=T))
            v, u = np.mgrid[: frame.labels.shape[0], : frame.labels.shape[1]]
            disc = np.hypot(u - frame.K[0, 2], v - frame.K[1, 2]) < frame.labels.shape[0] / 2 - 2
            yield ("roll", roll), replace(frame, labels=np.where(disc, frame.labels, IGNORE).astype(np.uint8))
        for width in WIDTHS:
            yield ("width", width), world.render((width, width * 3 // 4))


def draw(scores: dict[tuple[str, str, int], float]) -> None:
    """Write the figure of the scores."""
    figure, axes = plt.subplots(1, 2, figsize=(8.6, 3.2), sharey=True)
    for axis, what in zip(axes, ("roll", "width"), strict=True):
        for name, marker in ((IN_VIEW, "o"), (AS_IT_IS, "s")):
            points = [(key[2], score) for key, score in scores.items() if key[:2] == (name, what)]
            axis.plot(*zip(*points, strict=True), f"-{marker}", label=name, ms=4)
    axes[0].set(
        xlabel="roll of the camera (degrees)", ylabel="IoU of the target", ylim=(0.0, 1.02), xticks=range(0, 316, 45)
    )
    axes[1].set(xlabel="width of the picture (pixels)", xscale="log")
    axes[1].set_xticks(WIDTHS, WIDTHS)
    axes[1].minorticks_off()
    axes[1].legend()
    figure.tight_layout()
    figure.savefig(FIGURE, dpi=100)


def clock(pipeline: Pipeline) -> str:
    """Milliseconds of a frame to grasps by size: of the processor and by the clock, the least of several rounds."""
    with World(sample_scene(SEEDS[0], "test")) as world:
        frames = {width: world.render((width, width * 3 // 4)) for width in WIDTHS}
    ways = {width: lambda frame=frame: pipeline.run(frame) for width, frame in frames.items()}
    rows = []
    for name, clock in (("processor", time.process_time), ("clock", time.perf_counter)):
        times = in_turns(ways, ROUNDS, clock)
        rows.append((name, *(f"{times[width].min():.0f}" for width in WIDTHS)))
    return table("ms per frame, width | " + " | ".join(map(str, WIDTHS)), rows)
