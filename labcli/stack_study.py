"""The stacks side by side: every way to a mask on the same frames, by its IoU, its time, and the lifts that follow.

`labkit compare` runs it: one trial per scene and method. Lesson 09 reads the table.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import UInt8

from labcli.evaluation import lift_anew
from labcli.trials import SIZE, Study
from labcourse.stacks import regions
from labcourse.stacks.threshold import HSVRange, fit_hsv, hsv_mask, things_on_table
from labkit.frame import RGBDFrame
from labkit.labels import CLASSES, SURFACE, TARGET
from labkit.learning.engines import open_engine, segment_like_cpp
from labkit.metrics import confusion_matrix, wilson_interval
from labkit.pipeline import Pipeline, segment_rgb_image

TRAINING_SEEDS = range(630_000, 630_024)  # what the classical methods are fitted to, and the small FCN is trained on
STEPS = 1000  # of the small FCN's training
K = 6  # regions of k-means
LEAST = 30  # pixels of a region that may be a target

Method = Callable[[RGBDFrame], np.ndarray]


@dataclass(frozen=True)
class Row:
    """One trial: the scene, the method, pixels in its and the true mask and in either of them, milliseconds, the lift.

    lifted: 1 if the arm lifted a target. reason: "lifted", or why not.
    """

    seed: int
    method: str
    target_both: int
    target_either: int
    surface_both: int
    surface_either: int
    milliseconds: float
    lifted: int
    reason: str


# ---------------------------------------------------------------------------------------------- the methods


def threshold_labels(rgb: UInt8[np.ndarray, "H W 3"], table: HSVRange) -> UInt8[np.ndarray, "H W"]:
    """Labels by the table's colour: what has it is surface, and what stands on it is taken for a target."""
    surface = hsv_mask(rgb, table)
    return np.where(things_on_table(surface), TARGET, np.where(surface, SURFACE, 0)).astype(np.uint8)


def region_labels(rgb: UInt8[np.ndarray, "H W 3"], typical: regions.Typical) -> UInt8[np.ndarray, "H W"]:
    """Labels by k-means: the piece that fills most of the image's middle is surface; of those within its box, the one
    that looks most like a target is the target."""
    colours = cv2.medianBlur(regions.segment_kmeans(rgb, K), 5)  # single pixels are no regions
    pieces = regions.components(colours)
    m = regions.region_properties(pieces)
    height, width = pieces.shape
    middle = pieces[height // 4 : -height // 4, width // 4 : -width // 4]
    surface = int(np.bincount(middle.ravel()).argmax())
    box = m.box[surface - 1]
    within = (m.box[:, :2] >= box[:2]).all(axis=1) & (m.box[:, 2:] <= box[2:]).all(axis=1)
    within[surface - 1] = False
    chosen = regions.choose_region(m, typical, within & ~m.at_border & (m.area >= LEAST))
    return np.where((pieces == chosen) & (chosen > 0), TARGET, np.where(pieces == surface, SURFACE, 0)).astype(np.uint8)


def methods(frames: Sequence[RGBDFrame], unet) -> dict[str, Method]:
    """Make every method by its name: frame -> labels. `frames` are what the classical ones are fitted to.

    Only "HSV, this table" reads the true labels of the frame that it is to label: nearly the best that a range of
    colours could do.
    """
    from labcourse.stacks.small_fcn import train_small_fcn

    images, labels = [frame.rgb for frame in frames], [frame.labels for frame in frames]
    anywhere = fit_hsv(images, [y == SURFACE for y in labels])
    typical = regions.learn_typical(target_masks(frames))
    small, _ = train_small_fcn(images, labels, steps=STEPS)
    opencv, onnxruntime = open_engine(unet, "opencv"), open_engine(unet, "onnxruntime")

    def this_table(frame):
        return threshold_labels(frame.rgb, fit_hsv([frame.rgb], [frame.labels == SURFACE]))

    return {
        "U-Net, PyTorch": lambda frame: segment_rgb_image(unet, frame.rgb),
        "U-Net, onnxruntime": lambda frame: segment_rgb_image(onnxruntime, frame.rgb),
        "U-Net, OpenCV as in C++": lambda frame: segment_like_cpp(opencv, cv2.cvtColor(frame.rgb, cv2.COLOR_RGB2BGR)),
        "three-layer FCN": lambda frame: segment_rgb_image(small, frame.rgb),
        "HSV, other tables": lambda frame: threshold_labels(frame.rgb, anywhere),
        "HSV, this table": this_table,
        "k-means, one region": lambda frame: region_labels(frame.rgb, typical),
    }


def target_masks(frames: Sequence[RGBDFrame]) -> list[np.ndarray]:
    """The true mask of every target that is seen whole enough, one each."""
    masks = []
    for frame in frames:
        for number in np.unique(frame.instances[frame.labels == TARGET]):
            mask = (frame.instances == number) & (frame.labels == TARGET)
            if mask.sum() >= LEAST:
                masks.append(mask)
    return masks


# ------------------------------------------------------------------------------------------------ the trials


def of_frame(spec, frame: RGBDFrame, ways: dict[str, Method]) -> list[Row]:
    """Label a scene's frame by every method, and let the arm try by each of the masks, in a fresh world."""
    rows, tried = [], {}
    for name, way in ways.items():
        start = time.perf_counter()
        labels = way(frame)
        milliseconds = round(1000.0 * (time.perf_counter() - start), 2)
        if labels.tobytes() not in tried:  # equal labels make the same lift: the simulator is deterministic
            tried[labels.tobytes()] = lift_anew(spec, Pipeline().locate(frame, labels))
        result = tried[labels.tobytes()]
        n = confusion_matrix(frame.labels, labels, len(CLASSES))
        both, either = n.diagonal(), n.sum(axis=0) + n.sum(axis=1) - n.diagonal()
        rows.append(
            Row(
                seed=spec.seed,
                method=name,
                target_both=int(both[TARGET]),
                target_either=int(either[TARGET]),
                surface_both=int(both[SURFACE]),
                surface_either=int(either[SURFACE]),
                milliseconds=milliseconds,
                lifted=int(result.success),
                reason=result.reason,
            )
        )
    return rows


STUDY = Study(Row, of_frame, range(600_000, 600_040))
read = STUDY.read


def run(out, scenes: int | None = None, progress: bool = True) -> list[Row]:
    """Run every method on so many scenes, and write their rows to `out`, as `Study.run` does."""
    from data_gen import render, sample_scene
    from labkit.learning.network import load_model, weights_path

    training = [render(sample_scene(seed, "train"), SIZE) for seed in TRAINING_SEEDS]
    ways = methods(training, load_model(weights_path("unet")))
    return STUDY.run(out, scenes, progress=progress, ways=ways)


# ------------------------------------------------------------------------------------------------ the table


@dataclass(frozen=True)
class Summary:
    """A method over all its trials: IoU of pooled counts, median milliseconds, lifts and their 95 % interval."""

    method: str
    target_iou: float
    surface_iou: float
    milliseconds: float
    lifts: int
    trials: int
    interval: tuple[float, float]


def summarise(rows: Sequence[Row]) -> list[Summary]:
    """Pool the trials of each method, in the order in which they first come.

    >>> row = Row(1, "a", 10, 20, 90, 100, 5.0, 1, "lifted")
    >>> [summary] = summarise([row] * 4)
    >>> summary.target_iou, summary.surface_iou, summary.lifts
    (0.5, 0.9, 4)
    """
    summaries = []
    for name in dict.fromkeys(row.method for row in rows):
        own = [row for row in rows if row.method == name]
        lifts = sum(row.lifted for row in own)
        summaries.append(
            Summary(
                method=name,
                target_iou=sum(row.target_both for row in own) / sum(row.target_either for row in own),
                surface_iou=sum(row.surface_both for row in own) / sum(row.surface_either for row in own),
                milliseconds=float(np.median([row.milliseconds for row in own])),
                lifts=lifts,
                trials=len(own),
                interval=wilson_interval(lifts, len(own)),
            )
        )
    return summaries


def table(rows: Sequence[Row]) -> str:
    """The comparison as text: a line per method."""
    lines = [f"{'method':<25}{'target IoU':>11}{'table IoU':>11}{'ms':>8}{'lifted':>9}   95 % interval"]
    for s in summarise(rows):
        low, high = s.interval
        lines.append(
            f"{s.method:<25}{s.target_iou:>11.3f}{s.surface_iou:>11.3f}{s.milliseconds:>8.1f}"
            f"{f'{s.lifts}/{s.trials}':>9}   {low:.0%} to {high:.0%}"
        )
    return "\n".join(lines)
