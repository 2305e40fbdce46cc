"""Does the planner's score say which grasps lift? Grasps of four ranks, of many targets, each tried once.

`labkit study --scores` runs it: true masks, one fresh world per lift. Lesson 07 reads the table.
"""

from dataclasses import dataclass, replace

from labcli import mask_study
from labcli.trials import Study
from labkit.grasp import GraspPlan

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


def of_frame(spec, frame) -> list[Row]:
    """Plan once for the best visible target of a scene, by its true mask, and try grasps of several ranks."""
    name, truth = mask_study.target_mask(spec, frame)
    perception = mask_study.see(frame, truth)
    rows = []
    for rank, grasp in enumerate(perception.plan.grasps, start=1):
        if rank in RANKS:
            lifted, reason = mask_study.try_lift(spec, replace(perception, plan=GraspPlan((grasp,))), name)
            rows.append(Row(spec.seed, rank, round(grasp.score, 4), int(lifted), reason))
    return rows or [Row(spec.seed, 0, 0.0, 0, perception.plan.reason)]


STUDY = Study(Row, of_frame, range(600_200, 600_234))
run, read = STUDY.run, STUDY.read
