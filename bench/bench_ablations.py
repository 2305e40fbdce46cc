"""What each part of the training buys: things in photographs and in simulated clutter, with one part left out.

Each row is one short training: 300 steps of four windows for the branch of `unet_rgbd` that tells things apart, from
fresh weights, seed 3, on the scenes that `make train` makes (700 each of `any`, `clutter` and `messy`, 300 of `bin`).
No paint: things keep the one texture that they are made with. No noise: depth and calibration are exact, and depth is
nowhere bent or missing. One size: nothing is made larger or smaller. No heaps: the scenes of `any` alone, whose things
stand apart. The photographs are those of `make bench ARGS=photographs`, each looked at in one size; clutter is 16
scenes that none was trained on. The shipped weights had more steps.
"""

import sys
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

import data_gen
from bench.bench_photographs import PHOTOGRAPHS, on_the_board, with_outlines
from bench.measure import table
from labcli.evaluate_folder import TrueThings, judge
from labkit.frame import RGBDFrame
from labkit.instance_metrics import pool, score_instances
from labkit.learning.network import load_model, weights_path, with_things
from labkit.learning.things import segment_instances
from labtrain import augment_depth
from labtrain.training import THINGS_RECIPE, train

SCENES = {"any": 700, "clutter": 700, "bin": 300, "messy": 700}
UNSEEN = range(800_000, 800_016)
STEPS = 300


def as_it_is(first, *rest, **how):
    """In the place of a part of the augmentation: leave what it would change."""
    return first


LEFT_OUT: dict[str, tuple[str, ...]] = {  # the parts of the augmentation that a training goes without
    "all": (),
    "no paint": ("painted",),
    "no noise": ("random_sensor", "random_calibration", "hidden_things", "random_bend", "random_depth_loss"),
    "one size": ("random_size",),
    "no heaps": (),
}


def main(scenes: str = "data", photographs: str = str(PHOTOGRAPHS)) -> str:
    """Train and score each; returns the table. scenes: a folder with a data set of each config, made where it lacks."""
    data = {config: data_gen.generate(Path(scenes) / config, range(count), config) for config, count in SCENES.items()}
    clutter = [data_gen.render(data_gen.sample_scene(seed, "clutter")) for seed in UNSEEN]
    lines = []
    for name, parts in LEFT_OUT.items():
        chosen = [frames for config, frames in data.items() if name != "no heaps" or config == "any"]
        with TemporaryDirectory() as out, ExitStack() as without:
            for part in parts:
                without.enter_context(patch.object(augment_depth, part, as_it_is))
            model = with_things(classes_alone())
            config = replace(THINGS_RECIPE, steps=STEPS, seed=3)
            train(data_gen.Joined(chosen), None, config, out, model=model)
            network = load_model(Path(out) / "unet_rgbd.pt")
        lines.append([name, *scores(partial(segment_instances, network, sizes=()), clutter, Path(photographs))])
    return table("training | tables: as one piece | foreground IoU | overhead, on the board | bin | clutter", lines)


def classes_alone():
    """The shipped network without its branch."""
    model = load_model(weights_path("unet_rgbd"))
    model.branch = None
    return model


def scores(find: Callable, clutter: list[RGBDFrame], photographs: Path) -> list[str]:
    """One row: the photographs if they are there, and the share of the clutter's things that are found as one piece."""
    row = ["", "", "", ""]
    if photographs.is_dir():
        with TemporaryDirectory() as scratch:
            tables = judge(with_outlines(photographs / "tabletop", Path(scratch)), find)
        overhead, bins = (judge(TrueThings(photographs / name), find) for name in ("overhead", "bin"))
        t = pool([one.scores for one in tables])
        places = [t, pool([on_the_board(one) for one in overhead]), pool([one.scores for one in bins])]
        row = [f"{t.over_half} of {t.true}", *(f"{place.foreground_iou:.2f}" for place in places)]
    s = pool([score_instances(frame.instances, find(frame).instances) for frame in clutter])
    return [*row, f"{100.0 * s.over_half / s.true:.0f} % of {s.true}"]


if __name__ == "__main__":
    print(main(*sys.argv[1:]))
