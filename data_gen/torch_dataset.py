"""A dataset as PyTorch wants it: pairs of image and labels."""

from collections.abc import Sequence

import numpy as np
from torch.utils.data import Dataset

from labkit.frame import RGBDFrame


class TorchFrames(Dataset):
    """Pairs (rgb uint8 (H, W, 3), labels uint8 (H, W)) of a sequence of frames, for a DataLoader or for training.

    Raises ValueError at a frame that has no labels.
    """

    def __init__(self, frames: Sequence[RGBDFrame]):
        self.frames = frames

    def __len__(self) -> int:
        return len(self.frames)

    def __getitem__(self, index: int) -> tuple[np.ndarray, np.ndarray]:
        frame = self.frames[index]
        if frame.labels is None:
            raise ValueError(f"frames: frame {index} has no labels to learn from")
        return frame.rgb, frame.labels
