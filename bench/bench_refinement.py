"""What the CRF adds to the shipped networks' labels on unseen scenes, with parameters chosen on other scenes.

For each network the best of a few settings is chosen by target IoU on 40 `test` scenes (seeds from 500000), and then
scored on 200 others (seeds from 900000), together with the defaults of `labkit.crf.refine`. IoU is pooled over scenes;
boundary IoU looks at the pixels within 2 of a mask's edge and is the target's. "no CRF" is the argmax of the network.
"""

import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import product

import numpy as np

from data_gen import render, sample_scene
from labcli.evaluation import BOUNDARY_WIDTH
from labkit.crf import refine
from labkit.labels import CLASSES, TARGET
from labkit.learning.engines import open_engine
from labkit.learning.network import load_model, weights_path
from labkit.metrics import boundary_counts, confusion_matrix, iou, mean_iou
from labkit.pipeline import most_probable

TUNING, SCENES = range(500_000, 500_040), range(900_000, 900_200)
SETTINGS = [
    {"lam": lam, "sigma_I": sigma_I, "sigma_depth": sigma_depth}
    for lam, sigma_I, sigma_depth in product((0.5, 2.0, 4.0, 8.0, 16.0), (15.0, 30.0, 60.0), (0.01, 0.03))
]


@dataclass
class Score:
    """Counts of one way of labelling, pooled over scenes."""

    counts: np.ndarray = field(default_factory=lambda: np.zeros((len(CLASSES),) * 2, np.int64))
    both: np.ndarray = field(default_factory=lambda: np.zeros(len(CLASSES), np.int64))
    either: np.ndarray = field(default_factory=lambda: np.zeros(len(CLASSES), np.int64))
    seconds: list[float] = field(default_factory=list)

    def add(self, y: np.ndarray, labels: np.ndarray, seconds: float) -> None:
        """Count one scene."""
        self.counts += confusion_matrix(y, labels, len(CLASSES))
        both, either = boundary_counts(y, labels, len(CLASSES), BOUNDARY_WIDTH)
        self.both, self.either = self.both + both, self.either + either
        self.seconds.append(seconds)

    @property
    def target_iou(self) -> float:
        """IoU of the target class."""
        return float(iou(self.counts)[TARGET])

    def cells(self) -> str:
        """Cells of the table's row."""
        edge = self.both[TARGET] / self.either[TARGET]
        scores = f"{mean_iou(self.counts):.4f} | {self.target_iou:.4f} | {edge:.4f}"
        return f"{scores} | {1000 * np.median(self.seconds):.0f} |"


def score(model, seeds: Iterable[int], ways: dict[str, dict | None], method: str) -> dict[str, Score]:
    """Score ways of labelling the same predictions; a way is options of `refine`, or None for no CRF."""
    scores = {name: Score() for name in ways}
    for seed in seeds:
        frame = render(sample_scene(seed, "test"))
        probabilities = open_engine(model)(frame.rgb, flip_tta=True)
        for name, options in ways.items():
            start = time.process_time()
            if options is None:
                labels = most_probable(probabilities)
            else:
                labels = refine(probabilities, frame.rgb, frame.depth, method=method, **options).labels
            scores[name].add(frame.labels, labels, time.process_time() - start)
    return scores


def main() -> str:
    """Choose, score, and return the table."""
    rows = ["| network | labels | mean IoU | target IoU | target boundary IoU | CPU ms |", "|---|---|---|---|---|---|"]
    for network in ("unet", "smallsegnet"):
        model = load_model(weights_path(network))
        tuned = score(model, TUNING, {str(n): options for n, options in enumerate(SETTINGS)}, "expansion")
        best = SETTINGS[int(max(tuned, key=lambda name: tuned[name].target_iou))]
        chosen = "CRF, " + ", ".join(f"{name} {value:g}" for name, value in best.items())
        ways = {"no CRF": None, "CRF, defaults": {}, chosen: best}
        for name, result in score(model, SCENES, ways, "persistency").items():
            rows.append(f"| {network} | {name} | {result.cells()}")
    return "\n".join(rows)


if __name__ == "__main__":
    print(main())
