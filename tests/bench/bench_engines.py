"""The U-Net's logits at 640x480 by each engine, from an RGB image, against plain PyTorch.

Plain PyTorch is the text's way: float32, one NCHW tensor of the image divided by 255, no other setting. All engines may
use all cores. Each round runs every engine once on the same image, so that a slow moment meets all of them.
"""

import time

import cv2
import numpy as np
import torch

from data_gen import render, sample_scene
from labkit.network import load_model, weights_path
from labkit.stacks.engines import ENGINES, open_engine

FRAMES, ROUNDS = 4, 10


def main() -> str:
    """Median milliseconds an image over rounds on several scenes, after one round that is not counted."""
    model = load_model(weights_path("unet"))
    plain = load_model(weights_path("unet")).to(memory_format=torch.contiguous_format)

    def text(rgb):
        with torch.no_grad():
            return plain(torch.from_numpy(rgb.transpose(2, 0, 1).astype(np.float32) / 255.0)[None])[0].numpy()

    runs = {"plain PyTorch (NCHW)": text}
    runs |= {f'engine "{name}"': open_engine(name, model).logits for name in ENGINES}
    frames = [render(sample_scene(620_000 + i, "test"), (640, 480)).rgb for i in range(FRAMES)]
    milliseconds = {name: [] for name in runs}
    apart = dict.fromkeys(runs, 0.0)
    for round_ in range(ROUNDS + 1):
        for rgb in frames:
            expected = None
            for name, run in runs.items():
                start = time.perf_counter()
                z = run(rgb)
                if round_:
                    milliseconds[name].append(1000.0 * (time.perf_counter() - start))
                expected = z if expected is None else expected
                apart[name] = max(apart[name], float(np.abs(z - expected).max()))
    first = np.median(milliseconds["plain PyTorch (NCHW)"])
    rows = [
        f"| {name} | {np.median(ms):.1f} | {first / np.median(ms):.2f} | {apart[name]:.0e} |"
        for name, ms in milliseconds.items()
    ]
    fastest = first / min(np.median(ms) for ms in milliseconds.values())
    return "\n".join(
        [
            "| run by | median ms | times as fast | logits within |",
            "|---|---|---|---|",
            *rows,
            "",
            f"OpenCV {cv2.__version__}, {torch.get_num_threads()} threads. "
            f"The fastest is {fastest:.1f} times as fast as plain PyTorch; to reach: 2.",
        ]
    )


if __name__ == "__main__":
    print(main())
