"""Training step of the text's network, its plain float32 loop beside labkit's; training from disk.

SmallSegNet on batches of 8 images of 320x240. The text's loop is float32, NCHW, `CrossEntropyLoss` and Adam on tensors
that are ready. labkit's step starts from bytes, and is channels_last, with bfloat16 where the processor multiplies
it in hardware. Both start from the same weights and see the same batches; "loss off by" is the largest relative
difference of their losses over all steps. To reach: 4 times where bfloat16 is native, 2.3 times in float32.

UNetRGBD's steps, augmentation included, with images in memory and in a file of which no page is in memory: each is read
from the disk, as in an epoch of a dataset that is larger than the memory. To reach: 0.9 of the speed.
"""

import tempfile
from pathlib import Path

import numpy as np
import torch
from torch import nn

from labkit.frame import RGBDFrame
from labkit.learning.network import SmallSegNet
from labkit.learning.training import RECIPES, ImagesInMemory, TrainConfig, Trainer, bf16_is_native
from tests.bench.measure import in_turns, table

SIZE = (240, 320)
ROUNDS = 8
CONFIG = TrainConfig(
    model="smallsegnet", steps=100_000, lr=1e-3, weight_decay=0.0, warmup=0.0, weights="none", augment=False
)


def scenes(count: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Noisy images of discs on a table."""
    rng = np.random.default_rng(0)
    v, u = np.mgrid[: SIZE[0], : SIZE[1]]
    pairs = []
    for _ in range(count):
        y = np.where(v > 60, 1, 0).astype(np.uint8)
        for label in (2, 3, 3, 3, 3):
            row, column, radius = rng.integers((70, 10, 8), (230, 310, 16))
            y[(v - row) ** 2 + (u - column) ** 2 < radius**2] = label
        rgb = rng.integers(0, 200, (4, 3))[y] + rng.integers(0, 55, (*SIZE, 3))
        pairs.append((rgb.astype(np.uint8), y))
    return pairs


class PlainLoop:
    """The training loop that the text describes."""

    def __init__(self, weights: dict):
        self.model = SmallSegNet()
        self.model.load_state_dict(weights)
        self.loss = nn.CrossEntropyLoss()
        self.optimiser = torch.optim.Adam(self.model.parameters(), lr=CONFIG.lr)

    def step(self, x: torch.Tensor, y: torch.Tensor) -> float:
        self.optimiser.zero_grad()
        loss = self.loss(self.model(x), y)
        loss.backward()
        self.optimiser.step()
        return loss.item()


def measure_steps() -> list[tuple]:
    """Rows of the training step: one step of each loop in turn, on the same batch."""
    data = ImagesInMemory(scenes(16), progress=False)
    device = torch.device("cpu")
    trainers = {"labkit, float32": Trainer(data, CONFIG, device)}
    trainers["labkit, float32"].bf16 = False
    if bf16_is_native(device):
        trainers["labkit, bfloat16"] = Trainer(data, CONFIG, device)
    plain = PlainLoop(trainers["labkit, float32"].model.state_dict())
    batches = [trainers["labkit, float32"].batch_of_step(step) for step in range(ROUNDS + 1)]
    ready = iter([(x.contiguous(), y.long()) for (x,), y in batches])
    steps = {"the text's loop": lambda: plain.step(*next(ready))}
    steps |= {name: trainer.step for name, trainer in trainers.items()}
    losses = {name: [] for name in steps}

    def noted(name):
        return lambda: losses[name].append(steps[name]())

    times = in_turns({name: noted(name) for name in steps}, ROUNDS)
    expected, first = np.array(losses["the text's loop"]), times["the text's loop"]
    return [
        (
            name,
            f"{np.median(ms):.1f}",
            f"{np.median(first / ms):.1f}",
            f"{np.abs(losses[name] / expected - 1).max():.1e}",
        )
        for name, ms in times.items()
    ]


def measure_disk(steps: int = 60) -> list[tuple]:
    """Rows of training from memory and from disk: step by step in turn, on the same images."""
    depth, K = np.full(SIZE, 0.8, np.float32), np.array([[290.0, 0.0, 160.0], [0.0, 290.0, 119.0], [0.0, 0.0, 1.0]])
    T_base_cam = np.diag([1.0, -1.0, -1.0, 1.0]) + np.pad([[0.8]], ((2, 1), (3, 0)))
    pairs = scenes(16)
    frames = [RGBDFrame(rgb, depth, K, T_base_cam, y, table_z=0.0) for rgb, y in pairs] * (steps // 2 + 1)
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
    """Measure, and return the tables."""
    loops = table("training step | ms | times as fast | loss off by", measure_steps())
    disk = table("images in | steps per second | of memory's speed | MB read per step", measure_disk())
    return f"{loops}\n\n{disk}"
