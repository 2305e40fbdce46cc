"""How many hard scenes does a planner of one's own lift? Lab 07's open task asks it again and again.

The depth is noisy and the camera's pose is off, the objects hide one another, and the masks are the true ones, so that
no failure is the mask's fault.
"""

import traceback
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

import labkit
from labcli.evaluation import lift, look, run_trial
from labcourse.attempts import Attempts
from labkit.metrics import wilson_interval

CONFIG, FIRST_SEED, SCENES = "hard", 600_300, 150
RAISED = "raised "


def attempts(workers: int = 2, keep: str | Path | None = None) -> Attempts:
    """Open a table of planners: `attempts.score(name, plan)` tries one on all scenes, `of=40` on the first 40.

    A planner takes the arguments of `labkit.grasp.plan_grasps`, and may be a function of a notebook. In a scene in
    which it raises, nothing is lifted, and the table says where it raised. workers, keep: as in `Attempts`.
    """
    seeds = range(FIRST_SEED, FIRST_SEED + SCENES)
    return Attempts(lift_trial, seeds, lambda results: np.mean([lifted for lifted, _ in results]), says, workers, keep)


def lift_trial(plan: Callable, seed: int) -> tuple[int, str]:
    """Look at one of the scenes once, plan, and lift: 1 or 0, and why not."""
    from data_gen import sample_scene

    try:
        trial = run_trial(sample_scene(seed, CONFIG), perturb=True, grasp=plan)
    except Exception as error:
        return 0, RAISED + _whereabouts(error)
    return int(trial.lifted), trial.reason


def says(results: Sequence[tuple[int, str]]) -> str:
    """Say in words how many were lifted, with the 95 % Wilson interval, and where a planner raised.

    >>> says([(1, ""), (1, ""), (0, "slipped"), (0, "raised ZeroDivisionError in my_plan, line 7: division by zero")])
    'lifted 2 of 4 (15% to 85%); 1 raised ZeroDivisionError in my_plan, line 7: division by zero'
    """
    lifts = sum(lifted for lifted, _ in results)
    low, high = wilson_interval(lifts, len(results))
    raised = Counter(reason for _, reason in results if reason.startswith(RAISED))
    words = [f"lifted {lifts} of {len(results)} ({low:.0%} to {high:.0%})"]
    return "; ".join([*words, *(f"{count} {reason}" for reason, count in raised.most_common(2))])


def failures(table: Attempts, row: int = -1) -> dict[str, list[int]]:
    """The seeds of the scenes that a row of the table did not lift, by reason, the most frequent reason first."""
    found: dict[str, list[int]] = {}
    for seed, (lifted, reason) in zip(table.cases, table.rows[row][1], strict=False):
        if not lifted:
            found.setdefault(reason, []).append(seed)
    return dict(sorted(found.items(), key=lambda item: -len(item[1])))


def picture(plan: Callable, seed: int) -> np.ndarray:
    """Try one of the scenes again, and take a picture when the arm has done: RGB, uint8 (150, 200, 3)."""
    from data_gen import sample_scene
    from labkit.sim.spec import Camera
    from labkit.sim.world import World

    spec = sample_scene(seed, CONFIG)
    with World(spec) as world:
        lift(world, look(world, perturb=True, grasp=plan)[0])
        camera = Camera.looking_at((0.5, 0.0, spec.table.z + 0.1), 1.2, 0.6, 0.45, fov_y=0.6)
        return world.render((200, 150), camera).rgb


def _whereabouts(error: Exception) -> str:
    """The error, and the last line outside the kit and the installed packages that it came through."""
    kit, place = str(Path(labkit.__file__).parent), ""
    for frame in traceback.extract_tb(error.__traceback__):
        if not frame.filename.startswith(kit) and "site-packages" not in frame.filename:
            place = f" in {frame.name}, line {frame.lineno}"
    return f"{type(error).__name__}{place}: {error}"
