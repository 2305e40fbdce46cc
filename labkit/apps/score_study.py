"""Does the planner's score say which grasps lift? Grasps of four ranks, of many targets, each tried once.

`labkit study --scores` runs it: true masks, one fresh world per lift. Lesson 07 reads the table.
"""

from dataclasses import dataclass, replace

from labkit.apps import mask_study, trials
from labkit.grasp import GraspPlan

FIRST_SEED, SCENES = 600_200, 34
RANKS = (1, 4, 7, 10)


@dataclass(frozen=True)
class Row:
    """One lift: the scene, the grasp's rank in its plan and its score, and what became of it.

    lifted: 1 or 0. reason: "lifted", or why not. A scene without a grasp has one row, of rank 0.
    """

    seed: int
    rank: int
    score: float
    lifted: int
    reason: str


def trials_of_scene(seed: int) -> list[Row]:
    """Plan once for the best visible target of a scene, by its true mask, and try grasps of several ranks."""
    from data_gen import render, sample_scene

    spec = sample_scene(seed, "test")
    frame = render(spec, trials.SIZE)
    name, truth = mask_study.target_mask(spec, frame)
    perception = mask_study.see(frame, truth)
    rows = []
    for rank, grasp in enumerate(perception.plan.grasps, start=1):
        if rank in RANKS:
            lifted, reason = mask_study.try_lift(spec, replace(perception, plan=GraspPlan((grasp,))), name)
            rows.append(Row(seed, rank, round(grasp.score, 4), int(lifted), reason))
    return rows or [Row(seed, 0, 0.0, 0, perception.plan.reason)]


def run(out, scenes: int = SCENES, workers: int = 1, progress=True, dask=None) -> list[Row]:
    """Run all lifts of so many scenes and write them to `out`, as `trials.make_table` does."""
    return trials.make_table(out, Row, trials_of_scene, range(FIRST_SEED, FIRST_SEED + scenes), workers, progress, dask)


def read(path) -> list[Row]:
    """Read a table. Raises ValueError if its columns are others."""
    return trials.read_rows(path, Row)
