"""The node: what it costs over Pipeline.run, and its memory over 10,000 frames, in process.

Overhead: from the arrival of a frame's last message to the last result published, against `Pipeline.run` on the same
frame, taken in turn. Resident memory is flat if the last tenth of the frames finds it within 2 % of the second tenth's.
"""

from functools import partial

import numpy as np

from bench.measure import in_turns, resident_mb, table
from data_gen import render, sample_scene
from labkit.learning.network import load_model, weights_path
from labkit.node.actors import Camera
from labkit.node.bus import Bus
from labkit.node.segmentation import SegmentationNode
from labkit.pipeline import Pipeline

SIZE = (640, 480)
REPEATS, FRAMES = 40, 10_000


def main() -> str:
    """Two tables: overhead, memory."""
    frame = render(sample_scene(700_000, "test"), SIZE)
    return "\n\n".join([in_process(frame), memory()])


def in_process(frame) -> str:
    """Milliseconds of Pipeline.run and of the node around it, alternately."""
    rows = []
    for name, options in (
        ("UNet, mirrored", {"mirror": True, "crf": False}),
        ("UNet, onnxruntime, once", {"engine": "onnxruntime", "crf": False}),
    ):
        pipeline = Pipeline(load_model(weights_path("unet")), **options)
        bus = Bus()
        node, camera = SegmentationNode(pipeline, bus), Camera(bus)
        numbers = iter(range(REPEATS + 1))

        def publish(camera=camera, numbers=numbers):
            camera.publish(frame, next(numbers))

        turns = {"alone": partial(pipeline.run, frame), "published": publish, "node": node.spin_once}
        times = in_turns(turns, REPEATS)
        a, b = np.median(times["alone"]), np.median(times["node"])
        rows.append((name, f"{a:.1f}", f"{b:.1f}", f"{100.0 * (b / a - 1.0):+.1f} %"))
    return table("640x480, in process | Pipeline.run, ms | node, ms | overhead (to reach: 10 %)", rows)


def memory() -> str:
    """Resident memory over many frames of several scenes, by tenths."""
    frames = [render(sample_scene(seed, "test"), (80, 60)) for seed in range(700_000, 700_010)]
    bus = Bus()
    node, camera = SegmentationNode(Pipeline(load_model(weights_path("smallsegnet")), flip_tta=False), bus), Camera(bus)
    resident = []
    for number in range(FRAMES):
        camera.publish(frames[number % len(frames)], 33_000_000 * number)
        node.spin_once()
        if number % 10 == 0:
            resident.append(resident_mb())
    tenth = len(resident) // 10
    second, last = np.mean(resident[tenth : 2 * tenth]), np.mean(resident[-tenth:])
    row = ("resident memory", f"{second:.1f}", f"{last:.1f}", f"{100.0 * (last / second - 1.0):+.2f} %")
    return table(f"{FRAMES:,} frames of 80x60 in process | second tenth, MB | last tenth, MB | change", [row])
