"""What depth is worth to the network, like for like: the same trainings with depth, and without.

UNetRGBD from scratch on the same 3,000 scenes of `train`, in the same order, with the same views, windows and changes
of colour, for 24 epochs, without class weights. "Colours alone": each geometry channel is 0.5 everywhere, in training
and afterwards; the frame is still seen in its canonical view. "Colours kept": so, too, but without the step of
augmentation that swaps colours or takes them away, which might hinder a network that has nothing else. Mean target IoU
over scenes with a target, seeds from 900000, looking once, without the CRF; gains are paired over scenes, with the 95 %
interval of their mean. Scenes and weights stay in `data/bench_depth`; a stopped run goes on from there.
"""

import os
from dataclasses import replace
from itertools import product
from pathlib import Path
from unittest.mock import patch

import numpy as np
import torch

from bench.measure import table
from data_gen import generate, load
from labcli.trials import in_order
from labkit.labels import CLASSES, TARGET
from labkit.learning.network import TorchEngine, UNetRGBD, load_model
from labkit.metrics import confusion_matrix, iou
from labtrain import augment_depth
from labtrain.executors import executor_for
from labtrain.training import RECIPES, fresh_model, train

FOLDER = Path("data/bench_depth")
SCENES = {"train": range(3000), "test": range(900_000, 900_300), "hard": range(900_000, 900_300)}
ARMS, TRAININGS = ("with depth", "colours alone", "colours kept"), (0, 1)


class ColoursAlone(UNetRGBD):
    """UNetRGBD that gets the same geometry for every picture: what a pixel without depth has."""

    def forward(self, image, geometry):
        return super().forward(image, torch.full_like(geometry, 0.5))


def trained(job: tuple[str, int]) -> dict[str, np.ndarray]:
    """Train one arm with one seed; each scene's target IoU of `test` and `hard`, NaN where there is no target."""
    arm, seed = job
    config = replace(RECIPES["unet_rgbd"], seed=seed, weights="none")
    model = UNetRGBD() if arm == "with depth" else ColoursAlone()
    model.load_state_dict(fresh_model(config).state_dict())
    out = FOLDER / f"{arm.replace(' ', '_')}_{seed}"
    kept = {"random_hue": lambda x, draws: x} if arm == "colours kept" else {}
    with patch.dict(vars(augment_depth), kept):
        train(load(FOLDER / "train"), None, config, out, progress=False, model=model)
    engine = TorchEngine(load_model(out / "unet_rgbd.pt", model=model))
    return {kind: np.array([target_iou(engine, frame) for frame in load(FOLDER / kind)]) for kind in ("test", "hard")}


def target_iou(engine: TorchEngine, frame) -> float:
    """The target's IoU in one frame; NaN if it has no target."""
    if not (frame.labels == TARGET).any():
        return np.nan
    return iou(confusion_matrix(frame.labels, engine(frame).argmax(axis=-1), len(CLASSES)))[TARGET]


def gain(more: np.ndarray, less: np.ndarray) -> str:
    """The mean of paired differences with its 95 % interval."""
    difference = more - less
    half = 1.96 * difference.std(ddof=1) / np.sqrt(len(difference))
    return f"{difference.mean():+.3f} ({difference.mean() - half:+.3f} to {difference.mean() + half:+.3f})"


def main() -> str:
    """Make the scenes, train the networks that are not trained yet, score all, and return the table."""
    jobs = list(product(ARMS, TRAININGS))
    workers = min(os.cpu_count() or 1, len(jobs))
    with executor_for(workers) as executor:
        for kind, seeds in SCENES.items():
            generate(FOLDER / kind, seeds, kind, executor=executor, progress=False)
    found = dict(zip(jobs, in_order(trained, jobs, workers), strict=True))  # each on one thread
    rows = []
    for kind, seed in product(("test", "hard"), TRAININGS):
        scores = [found[arm, seed][kind] for arm in ARMS]
        scores = [score[~np.isnan(scores[0])] for score in scores]
        means = [f"{score.mean():.3f}" for score in scores]
        rows.append((kind, seed, len(scores[0]), *means, *(gain(scores[0], less) for less in scores[1:])))
    header = "scenes | seed | with a target | " + " | ".join(ARMS) + " | gain over alone | gain over kept"
    return table(header, rows)


if __name__ == "__main__":
    print(main())
