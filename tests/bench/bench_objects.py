"""What stands on the table without a network: instances of `labkit.stacks.objects.on_the_table` against the true ones.

200 scenes of each kind, seeds from 900000, 320 x 240. A true object counts if at least 30 of its pixels are seen, all
that were found count; a pair with an IoU above 0.5 is a hit, and F is twice the hits over the objects of both. Below it
the same without one of the two cuts: how many things that touch only colours, or only necks, tell apart.
"""

from collections.abc import Iterable
from tempfile import TemporaryDirectory
from unittest.mock import patch

import numpy as np

from data_gen import generate
from labkit.frame import RGBDFrame
from labkit.stacks import objects
from tests.bench.measure import table

SEEDS, KINDS, SEEN = range(900_000, 900_200), ("test", "hard", "other"), 30
WAYS = {"both cuts": {}, "without steps of colour": {"STEP": np.inf}, "without necks": {"NECK": 0.0}}


def hits(found: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Hits, objects found, and true objects of one frame, (3,)."""
    masks = [[image == number for number in np.unique(image) if number] for image in (found, true)]
    masks[1] = [mask for mask in masks[1] if mask.sum() >= SEEN]
    pairs = [np.sum(f & t) / np.sum(f | t) for f in masks[0] for t in masks[1]]
    return np.array([np.sum(np.array(pairs) > 0.5), len(masks[0]), len(masks[1])])


def score(frames: Iterable[RGBDFrame]) -> dict[str, np.ndarray]:
    """The sums of `hits` over frames, for each way."""
    sums = {way: np.zeros(3, int) for way in WAYS}
    for frame in frames:
        for way, constants in WAYS.items():
            with patch.dict(vars(objects), constants):
                sums[way] += hits(objects.on_the_table(frame), frame.instances)
    return sums


def rows(kind: str, sums: dict[str, np.ndarray]) -> list[tuple]:
    """The table's rows of one kind of scenes."""
    return [(kind, way, t, f, h, f"{2.0 * h / (f + t):.3f}") for way, (h, f, t) in sums.items()]


def main() -> str:
    """Make the scenes, score, and return the table."""
    lines = []
    for kind in KINDS:
        with TemporaryDirectory() as folder:
            lines += rows(kind, score(generate(folder, SEEDS, kind)))
    return table("scenes | cuts | true objects | found | hits | F at IoU 0.5", lines)


if __name__ == "__main__":
    print(main())
