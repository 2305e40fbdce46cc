"""How good is the whole chain? Scores of the masks, and lifts by the simulated arm, over many scenes."""

import json
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, field
from functools import lru_cache, partial
from pathlib import Path

import numpy as np
from tqdm.auto import tqdm

from labcli.trials import in_order
from labkit.geometry.sensor import perturbed
from labkit.labels import CLASSES, TARGET
from labkit.metrics import (
    boundary_counts,
    confusion_matrix,
    iou,
    mean_iou,
    pixel_accuracy,
    reliability_counts,
    wilson_interval,
)
from labkit.pipeline import Perception, Pipeline, timed

BOUNDARY_WIDTH = 2  # pixels


@dataclass(frozen=True, eq=False)
class Trial:
    """One scene: counts n[i, j] and boundary counts of its mask, whether a target was lifted, else why not; times.

    certainty: the pipeline's for the target of its best grasp, 0 without a grasp. reliability: the reliability_counts
    of the probability of "target" over all pixels, None for labels that come without.
    """

    seed: int
    counts: np.ndarray
    boundary: tuple[np.ndarray, np.ndarray]
    lifted: bool
    reason: str
    family: str
    seconds: dict[str, float] = field(default_factory=dict)
    certainty: float = 0.0
    reliability: np.ndarray | None = None

    @property
    def target_iou(self) -> float:
        """IoU of the targets in this scene's mask; NaN if they are in neither."""
        return float(iou(self.counts)[TARGET])


def run_trial(
    spec,
    model=None,
    size: tuple[int, int] = (320, 240),
    crf: bool | None = None,
    perturb: bool = False,
    grasp: Callable | None = None,
) -> Trial:
    """Build a scene, look at it once, and let the arm try the best grasp that it can reach, once.

    spec: a SceneSpec. model: as in Pipeline, or the path of weights; None for true masks. crf: as in Pipeline. perturb:
    depth as a sensor measures it and a camera pose that is off (labkit.geometry.sensor.perturbed), the same for every
    model. grasp: a planner in place of the kit's, as in Pipeline. No reachable candidate is a
    failure, and so is lifting anything but a target. Only the score reads the simulator's truth. Raises ValueError for
    a CRF on true masks.
    """
    from labkit.sim.world import World  # PyBullet stays out of this module's import

    if crf and model is None:
        raise ValueError("crf: expected none with true masks, which there is nothing to refine in")
    with World(spec) as world:
        perception, seconds = look(world, model, size, crf, perturb, grasp)
        with timed(seconds, "lift"):
            result = lift(world, perception)
    frame = perception.frame
    families = {thing.name: thing.family for thing in spec.objects}
    return Trial(
        seed=spec.seed,
        counts=confusion_matrix(frame.labels, perception.labels, len(CLASSES)),
        boundary=boundary_counts(frame.labels, perception.labels, len(CLASSES), BOUNDARY_WIDTH),
        lifted=result.success,
        reason="" if result.success else result.reason,
        family=families.get(result.name, ""),
        seconds=seconds,
        certainty=perception.certainty[perception.plan.grasps[0].target] if perception.plan.grasps else 0.0,
        reliability=None
        if perception.probabilities is None
        else reliability_counts(np.clip(perception.probabilities[..., TARGET], 0.0, 1.0), frame.labels == TARGET),
    )


def look(
    world,
    model=None,
    size: tuple[int, int] = (320, 240),
    crf: bool | None = None,
    perturb: bool = False,
    grasp: Callable | None = None,
) -> tuple[Perception, dict[str, float]]:
    """What a trial perceives in a World before it lifts, its frame with the true labels; and the seconds by stage."""
    if isinstance(model, (str, Path)):
        model = _loaded(str(model), Path(model).stat().st_mtime_ns)
    pipeline, seconds = Pipeline(model, crf=crf, grasp=grasp), {}
    with timed(seconds, "render"):
        frame = world.render(size)
    if perturb:
        frame = perturbed(frame, np.random.default_rng([world.spec.seed, 2]))
    perception = pipeline.locate(frame, frame.labels) if model is None else pipeline.run(frame)
    return perception, seconds | perception.seconds


@lru_cache(maxsize=1)
def _loaded(path: str, changed: int):
    """Load weights once in each process; `changed`, when the file was written, makes retrained weights others."""
    from labkit.learning.network import load_model

    return load_model(path)


def lift(world, perception):
    """Let the arm of a World try the best grasp that it can reach, once; a LiftResult."""
    from labkit.sim.panda import LiftResult, Panda

    if not perception.plan.grasps:
        return LiftResult(False, perception.plan.reason)
    return Panda(world).lift(perception.plan.grasps, perception.scene)


def lift_anew(spec, perception):
    """Let the arm try in a world that is built for this one try; a LiftResult."""
    from labkit.sim.world import World

    with World(spec) as world:
        return lift(world, perception)


@dataclass(frozen=True)
class Report:
    """Scores pooled over trials; the fields are the keys of `labkit evaluate --json`.

    iou: by class name; mean_iou and boundary_iou are means over the classes present. boundary_iou looks at the pixels
    within 2 of a mask's edge. lift_interval: 95 %. failures: how many trials failed for each reason. seconds: medians.
    calibration: for each tenth of the target's probability the mean probability, how often it was a target, and the
    number of pixels. declining: if only trials of at least some certainty were tried: that certainty, the share of the
    trials that is left, and the share of these that lifted; ten steps. rows: for each trial its seed, the targets' IoU,
    the certainty, and why it failed, "" if it did not.
    """

    iou: dict[str, float]
    mean_iou: float
    boundary_iou: float
    boundary_iou_by_class: dict[str, float]
    pixel_accuracy: float
    lift_rate: float
    lift_interval: tuple[float, float]
    trials: int
    failures: dict[str, int]
    seconds: dict[str, float]
    calibration: list[tuple[float, float, int]]
    declining: list[tuple[float, float, float]]
    rows: list[tuple[int, float, float, str]]


def summarise(trials: Iterable[Trial]) -> Report:
    """Pool trials: one confusion matrix over all scenes, lifts with their 95 % Wilson interval, median seconds.

    Raises ValueError without any trial.
    """
    trials = list(trials)
    if not trials:
        raise ValueError("trials: expected at least one")
    n = sum(trial.counts for trial in trials)
    both = sum(trial.boundary[0] for trial in trials)
    either = sum(trial.boundary[1] for trial in trials)
    edges = {name: a / b for name, a, b in zip(CLASSES, both.tolist(), either.tolist(), strict=True) if b}
    lifts = sum(trial.lifted for trial in trials)
    stages = dict.fromkeys(stage for trial in trials for stage in trial.seconds)
    return Report(
        iou={name: float(value) for name, value in zip(CLASSES, iou(n), strict=True)},
        mean_iou=float(mean_iou(n)),
        boundary_iou=float(np.mean(list(edges.values()))),
        boundary_iou_by_class=edges,
        pixel_accuracy=float(pixel_accuracy(n)),
        lift_rate=lifts / len(trials),
        lift_interval=wilson_interval(lifts, len(trials)),
        trials=len(trials),
        failures=dict(Counter(trial.reason for trial in trials if not trial.lifted).most_common()),
        seconds={stage: float(np.median([trial.seconds[stage] for trial in trials])) for stage in stages},
        calibration=calibration([trial.reliability for trial in trials if trial.reliability is not None]),
        declining=declining(trials),
        rows=[(trial.seed, trial.target_iou, trial.certainty, trial.reason) for trial in trials],
    )


def calibration(counts: Sequence[np.ndarray]) -> list[tuple[float, float, int]]:
    """The points of a reliability diagram, each with its number of pixels, from counts of several trials."""
    rows = np.sum(counts, axis=0) if counts else np.zeros((0, 3))
    return [(float(p / pixels), float(true / pixels), int(pixels)) for pixels, p, true in rows if pixels]


def declining(trials: Sequence[Trial]) -> list[tuple[float, float, float]]:
    """What a robot gains that tries its surest scenes only: (least certainty, share tried, share of these lifted)."""
    surest = sorted(trials, key=lambda trial: -trial.certainty)
    lifts = np.cumsum([trial.lifted for trial in surest])
    steps = sorted({max(1, round(share * len(surest))) for share in np.arange(1, 11) / 10})
    return [(surest[n - 1].certainty, n / len(surest), float(lifts[n - 1] / n)) for n in steps]


def run_trials(
    specs,
    model=None,
    size: tuple[int, int] = (320, 240),
    crf: bool | None = None,
    perturb: bool = False,
    workers: int = 1,
    progress: bool = True,
    dask: str | None = None,
) -> list[Trial]:
    """Run a trial of each scene, in the order of `specs`, where `labtrain.executors.executor_for` says.

    The other options are those of `run_trial`. Away from this process give `model` as the path of its weights: each
    worker loads them once.
    """
    specs, trials, lifts = list(specs), [], 0
    results = in_order(partial(run_trial, model=model, size=size, crf=crf, perturb=perturb), specs, workers, dask)
    with tqdm(results, total=len(specs), unit="scene", disable=not progress) as bar:
        for trial in bar:
            trials.append(trial)
            lifts += trial.lifted
            bar.set_postfix_str(f"lifted {lifts}/{len(trials)}", refresh=False)
    return trials


def as_json(report: Report) -> str:
    """The report as JSON; null is the IoU of a class that no scene has, which JSON's numbers cannot say.

    A row for each trial says its seed, target_iou, certainty and reason, on a line of its own.

    >>> n = np.diag([3, 4, 5, 0])
    >>> report = summarise([Trial(1, n, (n.diagonal(), n.diagonal()), True, "", "mug")])
    >>> json.loads(as_json(report))["iou"]
    {'background': 1.0, 'surface': 1.0, 'target': 1.0, 'obstacle': None}
    """
    fields, names = asdict(report), ("seed", "target_iou", "certainty", "reason")
    fields["iou"] = {name: _or_null(value) for name, value in report.iou.items()}
    rows = [dict(zip(names, (seed, _or_null(score), *rest), strict=True)) for seed, score, *rest in fields.pop("rows")]
    text = json.dumps(fields, indent=1, allow_nan=False).removesuffix("\n}")
    lines = ",\n  ".join(json.dumps(row, allow_nan=False) for row in rows)
    return f'{text},\n "rows": [\n  {lines}\n ]\n}}\n'


def _or_null(value: float) -> float | None:
    return None if np.isnan(value) else value


def table(report: Report) -> str:
    """The report as text for a terminal."""
    low, high = report.lift_interval
    rows = [f"{'class':<12}{'IoU':>8}{'boundary IoU':>14}"]
    edges = report.boundary_iou_by_class
    rows += [f"{name:<12}{report.iou[name]:>8.3f}{edges.get(name, np.nan):>14.3f}" for name in CLASSES]
    rows += [
        f"{'mean':<12}{report.mean_iou:>8.3f}{report.boundary_iou:>14.3f}",
        "",
        f"pixel accuracy {report.pixel_accuracy:.4f}",
        f"lifted {report.lift_rate:.1%} of {report.trials} (95 % interval {low:.1%} to {high:.1%})",
    ]
    rows += [f"  {count:4d}  {reason}" for reason, count in report.failures.items()]
    rows += ["", "median seconds: " + ", ".join(f"{stage} {value:.4f}" for stage, value in report.seconds.items())]
    return "\n".join(rows)
