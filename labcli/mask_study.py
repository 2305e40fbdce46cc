"""What is a point of IoU worth? Masks spoilt on purpose, scored by IoU, and by whether the arm still lifts the object.

`labkit study` runs it: one trial per scene and way of spoiling its mask. Lesson 07 reads the table.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from labcli import degrade
from labcli.evaluation import lift_anew
from labcli.trials import Study
from labkit.frame import RGBDFrame
from labkit.labels import OBSTACLE, TARGET
from labkit.metrics import wilson_interval
from labkit.pipeline import Perception, Pipeline
from labkit.support.validation import require

# How a mask is spoilt: the strengths tried, weakest first, and a function of mask, strength and generator.
KINDS: dict[str, tuple[tuple[float, ...], Callable]] = {
    "true": ((0,), lambda mask, strength, rng: mask),
    "eroded": ((1, 2, 3, 5), lambda mask, pixels, rng: degrade.erode(mask, round(pixels))),
    "dilated": ((1, 2, 4, 8), lambda mask, pixels, rng: degrade.dilate(mask, round(pixels))),
    "shifted": ((2, 4, 8, 14), lambda mask, pixels, rng: _shifted(mask, pixels, rng.uniform(0, 2 * np.pi))),
    "holed": ((0.2, 0.4, 0.6, 0.8), degrade.holes),
    "part missing": (
        (0.2, 0.4, 0.6, 0.8),
        lambda mask, share, rng: degrade.cut(mask, share, rng.uniform(0, 2 * np.pi)),
    ),
}
ALL = tuple((kind, strength) for kind, (strengths, _) in KINDS.items() for strength in strengths)


@dataclass(frozen=True)
class Row:
    """One trial: the scene, how its mask was spoilt and how much, the mask's IoU, and what became of the lift.

    strength: pixels for eroded, dilated and shifted, else the share that is missing. lifted: 1 or 0. reason: "lifted",
    or why not.
    """

    seed: int
    kind: str
    strength: float
    iou: float
    lifted: int
    reason: str


def target_mask(spec, frame: RGBDFrame) -> tuple[str, Bool[np.ndarray, "H W"]]:
    """Choose the target of a scene that shows the most pixels: its name and its true mask."""
    numbers = [i for i, thing in enumerate(spec.objects, start=1) if thing.class_id == TARGET]
    number = max(numbers, key=lambda number: int((frame.instances == number).sum()))
    return spec.objects[number - 1].name, frame.instances == number


def spoil(mask: Bool[np.ndarray, "H W"], kind: str, strength: int | float, seed: int) -> Bool[np.ndarray, "H W"]:
    """Spoil a mask; the same scene is always spoilt in the same direction and places, so that more is really more.

    Raises ValueError for an unknown kind.
    """
    require("kind", kind in KINDS, f"one of {', '.join(KINDS)}", repr(kind))
    return KINDS[kind][1](mask, strength, np.random.default_rng([seed, list(KINDS).index(kind)]))


def mask_iou(a: Bool[np.ndarray, "H W"], b: Bool[np.ndarray, "H W"]) -> float:
    """IoU of two masks, of which one at least is not empty.

    >>> mask_iou(np.array([[True, True, False]]), np.array([[False, True, True]]))
    0.3333333333333333
    """
    return float((a & b).sum() / (a | b).sum())


def see(frame: RGBDFrame, mask: Bool[np.ndarray, "H W"]) -> Perception:
    """Run the pipeline on a frame in which `mask` is all that is labelled target; other targets are obstacles."""
    others = np.where(frame.labels == TARGET, OBSTACLE, frame.labels)
    labels = np.where(mask, TARGET, others).astype(np.uint8)
    return Pipeline().locate(frame, labels)


def of_frame(spec, frame: RGBDFrame, kinds: Iterable[tuple[str, int | float]] = ALL) -> list[Row]:
    """Try to lift the best visible target of a scene by each spoilt mask, each time in a fresh world.

    kinds: pairs (kind, strength). A lift is a success if it is this very target that comes up.
    """
    name, truth = target_mask(spec, frame)
    rows = []
    for kind, strength in kinds:
        mask = spoil(truth, kind, strength, spec.seed)
        lifted, reason = try_lift(spec, see(frame, mask), name)
        rows.append(Row(spec.seed, kind, float(strength), round(mask_iou(mask, truth), 4), int(lifted), reason))
    return rows


def try_lift(spec, perception: Perception, name: str) -> tuple[bool, str]:
    """Let the arm try in a fresh world: whether the object of that name came up, and "lifted" or why not."""
    result = lift_anew(spec, perception)
    if result.success and result.name != name:
        return False, "lifted another target"
    return result.success, result.reason


STUDY = Study(Row, of_frame, range(600_000, 600_060))
run, read = STUDY.run, STUDY.read


def lift_rate(rows: Sequence) -> tuple[float, float, float]:
    """The share of trials with `lifted` set, and its 95 % Wilson interval. Raises ValueError without any trial.

    >>> row = Row(600000, "true", 0.0, 1.0, 1, "lifted")
    >>> [round(x, 2) for x in lift_rate([row] * 20)]
    [1.0, 0.84, 1.0]
    """
    lifts = sum(row.lifted for row in rows)
    low, high = wilson_interval(lifts, len(rows))
    return lifts / len(rows), low, high


def by_iou(rows: Iterable[Row], edges: Sequence[float]) -> list[list[Row]]:
    """Sort trials into bins of IoU: bin k holds edges[k] <= IoU < edges[k + 1], the last one its upper edge too.

    >>> row = Row(600000, "true", 0.0, 1.0, 1, "lifted")
    >>> [len(members) for members in by_iou([row], [0.0, 0.5, 1.0])]
    [0, 1]
    """
    bins = [[] for _ in edges[1:]]
    for row in rows:
        if edges[0] <= row.iou <= edges[-1]:
            bins[min(int(np.searchsorted(edges, row.iou, side="right")) - 1, len(bins) - 1)].append(row)
    return bins


def _shifted(mask: Bool[np.ndarray, "H W"], pixels: int | float, direction: float) -> Bool[np.ndarray, "H W"]:
    return degrade.shift(mask, round(pixels * np.cos(direction)), round(pixels * np.sin(direction)))
