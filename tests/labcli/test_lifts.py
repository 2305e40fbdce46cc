"""Lifts by a planner of one's own, as lab 07's open task counts them."""

import numpy as np
import pytest

from labcli import lifts
from labkit.grasp import plan_grasps

SEED = lifts.FIRST_SEED + 1


def test_a_planner_lifts_and_its_trial_can_be_seen_again():
    assert lifts.lift_trial(plan_grasps, SEED) == (1, "")
    assert lifts.picture(plan_grasps, SEED).shape == (150, 200, 3)


@pytest.mark.nightly
def test_a_planner_that_raises_costs_its_scene_and_the_table_says_where():
    """Here in every second scene, and in other processes."""
    calls = []

    def my_plan(clouds, scene, table_z, camera_position):
        calls.append(len(clouds))
        return plan_grasps(clouds, scene, table_z, camera_position) if len(calls) % 2 == 0 else clouds[0] / np.eye(3, 4)

    def no_plan(clouds, scene, table_z, camera_position):
        return None

    line = my_plan.__code__.co_firstlineno + 2
    attempts = lifts.attempts(workers=2).score("raises", my_plan, of=4).score("forgets to return", no_plan, of=2)
    raised = f"raised ValueError in my_plan, line {line}: operands could not be broadcast"
    assert raised in repr(attempts)
    assert any(reason.startswith(raised) for reason in lifts.failures(attempts, 0))
    assert "2 raised AttributeError" in repr(attempts)
