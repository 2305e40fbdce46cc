"""The Mathematica listing's network: three convolutions, no pooling; small enough to train in a lesson (topic 09)."""

from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Float, Integer, UInt8
from torch import nn
from torch.nn import functional as F

from labkit.labels import CLASSES, IGNORE
from labkit.losses import class_weights
from labkit.support.validation import check_labels, check_rgb, check_same_size


class SmallFCN(nn.Module):
    """Convolutions of 16, 32 and `num_classes` channels: 5,220 weights, and a pixel sees 5x5 pixels.

    Its output has logits for each pixel, (N, C, H, W), any H and W; the listing's decoder asks for one class per image.

    >>> SmallFCN()(torch.zeros(1, 3, 5, 7)).shape
    torch.Size([1, 4, 5, 7])
    """

    def __init__(self, num_classes: int = len(CLASSES)):
        super().__init__()
        self.num_classes = num_classes
        self.layers = nn.Sequential(
            nn.Conv2d(3, 16, 3, padding=1),
            nn.ReLU(),
            nn.Conv2d(16, 32, 3, padding=1),
            nn.ReLU(),
            nn.Conv2d(32, num_classes, 1),
        )

    def forward(self, x: Float[torch.Tensor, "N 3 H W"]) -> Float[torch.Tensor, "N C H W"]:
        """Map images in [0, 1] to logits of the same height and width."""
        return self.layers(x)


def train_small_fcn(
    images: Sequence[UInt8[np.ndarray, "H W 3"]],
    labels: Sequence[Integer[np.ndarray, "H W"]],
    steps: int = 300,
    seed: int = 0,
    crop: int = 96,
) -> tuple[SmallFCN, list[float]]:
    """Train the network on labelled images; returns it in eval mode, and the loss of every step.

    Each step takes a random crop of each of four images; the loss is cross-entropy with weights 1/sqrt(frequency).
    Raises ValueError for images and labels that do not fit one another.
    """
    if not images or len(images) != len(labels):
        raise ValueError(f"labels: expected one for each of the images, got {len(labels)} for {len(images)}")
    for rgb, y in zip(images, labels, strict=True):
        check_same_size("images", check_rgb("images", rgb), "labels", check_labels("labels", y, len(CLASSES)))
    counts = sum(np.bincount(y[y != IGNORE].ravel(), minlength=len(CLASSES)) for y in labels)
    weights = torch.from_numpy(class_weights(counts, "sqrt")).float()
    rng = np.random.default_rng(seed)
    torch.manual_seed(seed)
    model = SmallFCN()
    optimiser = torch.optim.Adam(model.parameters(), lr=3e-3)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, steps)
    losses = []
    for _ in range(steps):
        x, y = _crops(images, labels, rng, crop)
        loss = F.cross_entropy(model(x), y, weights, ignore_index=IGNORE)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        schedule.step()
        losses.append(float(loss.detach()))
    return model.eval(), losses


def _crops(images, labels, rng, crop: int) -> tuple[torch.Tensor, torch.Tensor]:
    """Four random crops of one size: (4, 3, h, w) in 0..1, and (4, h, w) labels."""
    x, y = [], []
    h, w = (min(crop, *(rgb.shape[axis] for rgb in images)) for axis in (0, 1))
    for i in rng.integers(len(images), size=4):
        top, left = (rng.integers(images[i].shape[axis] - side + 1) for axis, side in ((0, h), (1, w)))
        x.append(images[i][top : top + h, left : left + w].transpose(2, 0, 1) / np.float32(255))
        y.append(labels[i][top : top + h, left : left + w].astype(np.int64))
    return torch.from_numpy(np.stack(x)), torch.from_numpy(np.stack(y))
