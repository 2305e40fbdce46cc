"""Planning grasps on frames of 320x240: the kit's search, its loops not compiled, and the text's principal axis.

The planner's points come from rendered scenes with true masks. For its time it checks every yaw, place and height
against all that was seen; the principal axis looks at nothing but the target.
"""

import os
import subprocess
import sys
from functools import partial

import numpy as np

from data_gen import sample_scene
from labkit.grasp import plan_grasps, principal_axis_grasp
from labkit.labels import TARGET
from labkit.pipeline import Pipeline
from labkit.sim.world import World
from tests.bench.measure import in_turns, table

SCENES = 6
ROUNDS = 40


def problems(targets: int, scenes: int = SCENES) -> list[tuple]:
    """Arguments of `plan_grasps` from scenes in which the camera sees that many targets."""
    found, seed = [], 0
    while len(found) < scenes:
        spec = sample_scene(seed, "train")
        seed += 1
        if sum(thing.class_id == TARGET for thing in spec.objects) != targets:
            continue
        with World(spec) as world:
            frame = world.render((320, 240))
        perception = Pipeline().locate(frame, frame.labels)
        if len(perception.clouds) == targets:
            found.append((perception.clouds, perception.scene, spec.table.z, frame.T_base_cam[:3, 3]))
    return found


def milliseconds(function, problems: list[tuple]) -> float:
    """Median over rounds and problems."""
    ways = {number: partial(function, *problem) for number, problem in enumerate(problems)}
    return float(np.median(list(in_turns(ways, ROUNDS).values())))


def principal_axes(clouds, scene, table_z, camera_position):
    return [principal_axis_grasp(cloud, table_z) for cloud in clouds]


def interpreted() -> float:
    """Milliseconds of the same planner in a process in which numba compiles nothing, one target and one scene."""
    code = f"from {__name__} import *\n"
    code += "import time; problem = problems(1, 1); start = time.perf_counter(); plan_grasps(*problem[0])\n"
    code += "print('ms', 1e3 * (time.perf_counter() - start))"
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    run = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    return float(run.stdout.split()[-1])


def main() -> str:
    """Measure one and three targets, and return the table in Markdown."""
    rows = []
    for targets in (1, 3):
        given = problems(targets)
        kit, text = milliseconds(plan_grasps, given), milliseconds(principal_axes, given)
        found = f"{np.mean([len(plan_grasps(*problem).grasps) for problem in given]):.0f}"
        rows.append((targets, "`plan_grasps`", found, f"{kit:.2f}", ""))
        rows.append((targets, "the text's principal axis, unchecked", targets, f"{text:.2f}", f"{text / kit:.2f}"))
        if targets == 1:
            slow = interpreted()
            rows.append((1, "`plan_grasps`, its loops not compiled", found, f"{slow:.0f}", f"{slow / kit:.0f}"))
    return table("targets | method | grasps found | median ms | times the kit", rows)
