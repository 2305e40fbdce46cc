"""Training step and inference of the text's network, its plain float32 loop beside labkit's.

SmallSegNet on batches of 8 images of 320x240. The text's loop is float32, NCHW, `CrossEntropyLoss` and Adam on tensors
that are ready. labkit's step starts from bytes, and is channels_last, with bfloat16 where the processor multiplies
it in hardware. Both start from the same weights and see the same batches; "loss off by" is the largest relative
difference of their losses over all steps. To reach: 4 times where bfloat16 is native, 2.3 times in float32.
"""

import statistics
import time

import numpy as np
import torch
from torch import nn

from labkit.network import SmallSegNet, UNet, predict_probabilities
from labkit.training import ImagesInMemory, TrainConfig, Trainer, bf16_is_native

SIZE = (240, 320)
ROUNDS = 9  # the first is a warm-up
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


def timed(function, *arguments) -> tuple[float, float]:
    """Return the seconds of a call and its result."""
    start = time.perf_counter()
    result = function(*arguments)
    return time.perf_counter() - start, result


def measure_steps() -> list[str]:
    """Rows of the training step: the loops take turns, one step each, so that noise hits all of them alike."""
    data = ImagesInMemory(scenes(16), progress=False)
    device = torch.device("cpu")
    trainers = {"labkit, float32": Trainer(data, CONFIG, device)}
    trainers["labkit, float32"].bf16 = False
    if bf16_is_native(device):
        trainers["labkit, bfloat16"] = Trainer(data, CONFIG, device)
    plain = PlainLoop(trainers["labkit, float32"].model.state_dict())
    seconds = {name: [] for name in ("the text's loop", *trainers)}
    losses = {name: [] for name in seconds}

    def note(name, measured):
        seconds[name].append(measured[0])
        losses[name].append(measured[1])

    for step in range(ROUNDS):
        x, y = trainers["labkit, float32"].batch_of_step(step)
        note("the text's loop", timed(plain.step, x.contiguous(), y.long()))
        for name, trainer in trainers.items():
            note(name, timed(trainer.step))
    return rows("training step", seconds, lambda name: f"{loss_difference(losses, name):.1e}")


def loss_difference(losses: dict, name: str) -> float:
    """Largest relative difference between a loop's losses and those of the text's."""
    expected = np.array(losses["the text's loop"])
    return float(np.abs(np.array(losses[name]) / expected - 1.0).max())


def rows(what: str, seconds: dict, last_column) -> list[str]:
    """Lines of the table: medians without the warm-up, and how many times as fast as the first, round by round."""
    first = next(iter(seconds.values()))[1:]
    lines = []
    for name, times in seconds.items():
        ratio = statistics.median(a / b for a, b in zip(first, times[1:], strict=True))
        median = 1e3 * statistics.median(times[1:])
        lines.append(f"| {what} | {name} | {median:.1f} | {ratio:.1f} | {last_column(name)} |")
    return lines


def text_inference(model: nn.Module, rgb: np.ndarray) -> np.ndarray:
    """Probabilities as the text computes them: float32 NCHW."""
    x = torch.from_numpy((rgb.astype(np.float32) / 255.0).transpose(2, 0, 1).copy())[None]
    with torch.no_grad():
        return model(x).softmax(dim=1)[0].permute(1, 2, 0).numpy()


def measure_inference() -> list[str]:
    """Rows of one image's probabilities, in float32 everywhere."""
    image = scenes(1)[0][0]
    torch.manual_seed(0)
    text, small = SmallSegNet().eval(), SmallSegNet().eval()
    small.load_state_dict(text.state_dict())
    small, unet = (model.to(memory_format=torch.channels_last) for model in (small, UNet().eval()))
    runs = {
        "the text's listing": lambda: text_inference(text, image),
        "labkit, SmallSegNet": lambda: predict_probabilities(small, image),
        "labkit, UNet": lambda: predict_probabilities(unet, image),
    }
    np.testing.assert_allclose(runs["labkit, SmallSegNet"](), runs["the text's listing"](), atol=1e-5)
    seconds = {name: [] for name in runs}
    for _ in range(5 * ROUNDS):
        for name, run in runs.items():
            seconds[name].append(timed(run)[0])
    return rows("one image", seconds, lambda name: "")


def main() -> str:
    """Measure, and return the table."""
    lines = ["| what | loop | ms | times as fast | loss off by |", "|---|---|---:|---:|---:|"]
    return "\n".join(lines + measure_steps() + measure_inference())


if __name__ == "__main__":
    print(main())
