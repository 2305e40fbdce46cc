"""Things that another one cuts in two in the picture: does the network find them as one piece?

    python -m bench.parted SCENES FIRST_SEED

Scenes of `any`, `clutter` and `messy` in turn, rendered with exact depth. A thing is parted if its second largest piece
has 150 pixels and an eighth of its area; found as one piece if an instance overlaps it with an IoU of 0.75.
"""

import sys
from collections import Counter

import cv2
import numpy as np

import data_gen
from labkit.learning.engines import open_engine
from labkit.learning.things import segment_instances
from labkit.network import load_model, weights_path

CONFIGS = ("any", "clutter", "messy")
LEAST = 300  # pixels of a thing that is looked at


def judged(true: np.ndarray, found: np.ndarray):
    """Yield for each thing of a picture whether it is parted, found as one piece, and has one number on both parts."""
    for number in np.setdiff1d(true, (0, 255)):
        mask = true == number
        if mask.sum() < LEAST:
            continue
        _, pieces, facts, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
        largest = 1 + np.argsort(-facts[1:, cv2.CC_STAT_AREA])[:2]
        areas = facts[largest, cv2.CC_STAT_AREA]
        parted = len(areas) > 1 and areas[1] >= max(150, 0.12 * mask.sum())
        best = most(found[mask])
        same = found == best
        whole = best > 0 and (same & mask).sum() >= 0.75 * (same | mask).sum()
        numbers = [
            most(found[pieces == piece]) if (found[pieces == piece] > 0).mean() > 0.3 else 0 for piece in largest
        ]
        yield parted, whole, parted and numbers[0] == numbers[1] > 0


def most(numbers: np.ndarray) -> int:
    """The instance with most of these pixels; 0 if none has any."""
    counts = np.bincount(numbers, minlength=2)
    return int(counts[1:].argmax() + 1) if counts[1:].any() else 0


def counted(engine, scenes: int, first: int) -> Counter:
    """For whole and parted things how many there were, were found as one piece, and have one number on both parts."""
    counts = Counter()
    for seed in range(first, first + scenes):
        frame = data_gen.render(data_gen.sample_scene(seed, CONFIGS[(seed - first) % 3]), (640, 480))
        for parted, whole, same in judged(frame.instances, segment_instances(engine, frame, classes=False).instances):
            kind = "parted" if parted else "whole"
            counts += Counter({(kind, "all"): 1, (kind, "one piece"): int(whole), (kind, "one number"): int(same)})
    return counts


def main(scenes: int, first: int) -> None:
    """Print the counts."""
    counts = counted(open_engine(load_model(weights_path("unet_rgbd"))), scenes, first)
    for kind in ("whole", "parted"):
        print(kind, *(f"{what}: {counts[kind, what]}" for what in ("all", "one piece", "one number")))


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
