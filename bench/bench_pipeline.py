"""The pipeline from a frame to grasps: without a network on scenes with three targets, and with it at camera rate.

Old (0bcca9f) beside new in one run, CPU ms of one thread on a slower machine, scene 600,000 of `test`: `refine` of the
U-Net's probabilities 14 and 13 at 320x240, 107 and 110 at 640x480, 279 and 216 at 1280x720; a frame to grasps with the
U-Net and the CRF 81 and 82 at 320x240, 323 and 321 at 640x480; finding things for `--anything` 809 and 505 at 640x480.
"""

import numpy as np

from bench.measure import table
from data_gen import render, sample_scene
from labkit.labels import TARGET
from labkit.learning.network import load_model, weights_path
from labkit.pipeline import Pipeline

SCENES, REPEATS = 12, 15


def main() -> str:
    """Median milliseconds by stage over scenes with three targets, each run several times after a first one."""
    specs = (sample_scene(seed, "test") for seed in range(700_000, 701_000))
    three = [spec for spec in specs if sum(thing.class_id == TARGET for thing in spec.objects) == 3][:SCENES]
    stages: dict[str, list[float]] = {}
    candidates = []
    for spec in three:
        frame = render(spec)
        pipeline = Pipeline()
        pipeline.locate(frame, frame.labels)
        for _ in range(REPEATS):
            perception = pipeline.locate(frame, frame.labels)
            seconds = perception.seconds
            for stage, s in {**seconds, "all but the network": sum(seconds.values())}.items():
                stages.setdefault(stage, []).append(1000.0 * s)
            candidates.append(len(perception.plan.grasps))
    rows = ((name, f"{np.median(ms):.2f}", f"{np.quantile(ms, 0.9):.2f}") for name, ms in stages.items())
    said = f"{len(three)} scenes, true masks, a median of {np.median(candidates):.0f} ranked grasps. To reach: 5 ms."
    return f"{table('stage | median ms | 90 % of runs within', rows)}\n\n{said}\n\n{camera_rate()}"


def camera_rate() -> str:
    """Median milliseconds per frame with the default network and the default settings."""
    pipeline = Pipeline(load_model(weights_path("unet_rgbd")))
    rows = []
    for size, asked in (((320, 240), 60), ((640, 480), 200)):
        frames = [render(sample_scene(seed, "test"), size) for seed in range(700_000, 700_004)]
        stages: dict[str, list[float]] = {"network": [], "crf": [], "all": []}
        for repeat in range(REPEATS):
            for frame in frames:
                seconds = pipeline.run(frame).seconds
                if repeat:  # the first round warms up
                    for stage, s in (
                        ("network", seconds["network"]),
                        ("crf", seconds["crf"]),
                        ("all", sum(seconds.values())),
                    ):
                        stages[stage].append(1000.0 * s)
        rows.append(("{} x {}".format(*size), *(f"{np.median(ms):.1f}" for ms in stages.values()), asked))
    return table("frame to grasps, UNetRGBD | network ms | CRF ms | all ms | to reach", rows)
