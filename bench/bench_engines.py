"""The U-Net's logits at 640x480 by each engine, from an RGB image, against plain PyTorch.

Plain PyTorch is the text's way: float32, one NCHW tensor of the image divided by 255, no other setting. All engines may
use all cores. Each round runs every engine once on the same image, so that a slow moment meets all of them.
"""

from functools import partial

import cv2
import numpy as np
import torch

from bench.measure import in_turns, table
from data_gen import render, sample_scene
from labkit.learning.engines import ENGINES, open_engine
from labkit.learning.network import load_model, weights_path

FRAMES, ROUNDS = 4, 10


def main() -> str:
    """Median milliseconds per image over rounds on several scenes."""
    model = load_model(weights_path("unet"))
    plain = load_model(weights_path("unet")).to(memory_format=torch.contiguous_format)

    def text(rgb):
        with torch.no_grad():
            return plain(torch.from_numpy(rgb.transpose(2, 0, 1).astype(np.float32) / 255.0)[None])[0].numpy()

    runs = {"plain PyTorch (NCHW)": text}
    runs |= {f'engine "{name}"': open_engine(model, name).logits for name in ENGINES}
    frames = [render(sample_scene(620_000 + i, "test"), (640, 480)).rgb for i in range(FRAMES)]
    apart = {name: max(float(np.abs(run(rgb) - text(rgb)).max()) for rgb in frames) for name, run in runs.items()}
    times = [in_turns({name: partial(run, rgb) for name, run in runs.items()}, ROUNDS) for rgb in frames]
    median = {name: np.median([ms[name] for ms in times]) for name in runs}
    first = median["plain PyTorch (NCHW)"]
    rows = ((name, f"{ms:.1f}", f"{first / ms:.2f}", f"{apart[name]:.0e}") for name, ms in median.items())
    said = f"OpenCV {cv2.__version__}, {torch.get_num_threads()} threads. The fastest is "
    said += f"{first / min(median.values()):.1f} times as fast as plain PyTorch; to reach: 2."
    return f"{table('run by | median ms | times as fast | logits within', rows)}\n\n{said}"
