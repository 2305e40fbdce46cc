"""Training from disk beside training from memory.

UNetRGBD's steps, augmentation included, with images in memory and in a file of which no page is in memory: each is read
from the disk, as in an epoch of a dataset that is larger than the memory. To reach: 0.9 of the speed.
"""

import tempfile
from pathlib import Path

import numpy as np
import torch

from labkit.frame import RGBDFrame
from labkit.learning.training import RECIPES, ImagesInMemory, Trainer
from tests.bench.measure import in_turns, table

SIZE = (240, 320)


def measure_disk(steps: int = 60) -> list[tuple]:
    """Rows of training from memory and from disk: step by step in turn, on the same images."""
    depth, K = np.full(SIZE, 0.8, np.float32), np.array([[290.0, 0.0, 160.0], [0.0, 290.0, 119.0], [0.0, 0.0, 1.0]])
    T_base_cam = np.diag([1.0, -1.0, -1.0, 1.0]) + np.pad([[0.8]], ((2, 1), (3, 0)))
    rng = np.random.default_rng(0)
    rgb, y = rng.integers(0, 256, (16, *SIZE, 3), np.uint8), rng.integers(0, 4, (16, *SIZE), np.uint8)
    frames = [RGBDFrame(rgb[i], depth, K, T_base_cam, y[i], table_z=0.0) for i in range(16)] * (steps // 2 + 1)
    with tempfile.TemporaryDirectory(dir=".") as folder:  # not in /tmp, which may be memory
        ways = {"memory": None, "disk": Path(folder) / "images"}
        data = {name: ImagesInMemory(frames, progress=False, depth=True, file=file) for name, file in ways.items()}
    data["disk"].map.flush()
    data["disk"].map.madvise(PAGE_OUT)
    read = bytes_read()
    trainers = {name: Trainer(images, RECIPES["unet_rgbd"], torch.device("cpu")) for name, images in data.items()}
    times = in_turns({name: trainer.step for name, trainer in trainers.items()}, steps)
    read = (bytes_read() - read) / 1e6 / (steps + 1)
    ratio = times["memory"].mean() / times["disk"].mean()
    rates = {name: f"{1000 / ms.mean():.1f}" for name, ms in times.items()}
    return [("memory", rates["memory"], "1.00", "0.0"), ("disk", rates["disk"], f"{ratio:.2f}", f"{read:.1f}")]


PAGE_OUT = 21  # madvise's MADV_PAGEOUT


def bytes_read() -> int:
    """Bytes that this process has had fetched from a disk."""
    return int(Path("/proc/self/io").read_text().split("\nread_bytes: ")[1].split()[0])


def main() -> str:
    """Measure, and return the table."""
    return table("images in | steps per second | of memory's speed | MB read per step", measure_disk())
