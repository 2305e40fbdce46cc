"""Depth in another unit gives no grasp, at any door, unless the user says that it is right."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest
from scenes import box
from typer.testing import CliRunner

from labcli.cli import app
from labcli.perceive import perceive
from labkit.geometry.depth_units import AWAY, FACTORS, LENGTHS, other_unit
from labkit.labels import TARGET, one_hot
from labkit.node.actors import Camera as CameraNode
from labkit.node.bus import Bus
from labkit.node.messages import Diagnostics, Topics
from labkit.node.segmentation import SegmentationNode
from labkit.pipeline import Pipeline
from labkit.sim.spec import Camera, SceneSpec
from labkit.sim.world import World

REASON = "depth seems to be in another unit"


def seen_from(distance: float):
    """Two boxes of 10 cm, seen from so far away."""
    things = box("left", 0.5, 0.1, (0.05, 0.06, 0.1)), box("right", 0.55, -0.09, (0.04, 0.05, 0.1))
    camera = Camera.looking_at((0.52, 0.0, 0.0), distance, 0.3, 0.8, fov_y=2.0 * np.arctan(0.3 / distance))
    with World(SceneSpec(things, camera)) as world:
        return world.render()


@pytest.fixture(scope="module")
def frame():
    return seen_from(0.7)


def planned(frame, **options):
    """What is planned with true labels and instances, the pose being unknown."""
    pipeline = Pipeline(workspace="table", **options)
    given = replace(frame, T_base_cam=np.eye(4), labels=None, instances=None)
    return perceive(given, pipeline, frame.labels, frame.instances).perception.plan


@pytest.mark.parametrize("factor", [0.1, 5.0])
def test_depth_in_another_unit_gives_no_grasp_unless_the_unit_is_known(frame, factor):
    """Times 5, the table is 3.4 m away and its things are half a metre long."""
    assert planned(frame).grasps
    wrong = replace(frame, depth=(factor * frame.depth).astype(np.float32))
    plan = planned(wrong)
    assert not plan.grasps and REASON in plan.reason and "--depth-scale" in plan.reason
    assert REASON not in planned(wrong, unit_known=True).reason


def test_a_camera_that_truly_stands_far_away_keeps_its_grasps():
    far = seen_from(1.7)
    assert np.median(far.depth[far.labels == TARGET]) > 1.6 and planned(far).grasps


def test_the_node_says_so_too(frame):
    bus, heard = Bus(), []
    bus.subscribe(Topics().diagnostics, Diagnostics, heard.append)
    wrong = replace(frame, depth=(5.0 * frame.depth).astype(np.float32))
    node = SegmentationNode(Pipeline(lambda rgb: one_hot(frame.labels, 4)), bus)
    CameraNode(bus).publish(wrong)
    assert node.spin_once() and any(REASON in str(message) for message in heard), heard


def test_what_the_user_says_counts(frame, tmp_path):
    """The command refuses inferred millimetres, and takes given ones."""
    wrong = np.round(5000.0 * frame.depth).astype(np.uint16)
    for name, image in {"color": frame.rgb[..., ::-1], "depth": wrong, "mask": frame.instances}.items():
        cv2.imwrite(str(tmp_path / f"{name}.png"), image)
    K = " ".join(map(str, (frame.K[0, 0], frame.K[1, 1], *frame.K[:2, 2])))
    files = [str(tmp_path / f"{name}.png") for name in ("color", "depth")]
    words = [*files, "--intrinsics", K, "--mask", str(tmp_path / "mask.png"), "--instances", "--out", str(tmp_path)]
    for given, refused in (([], True), (["--depth-scale", "0.001"], False)):
        done = CliRunner().invoke(app, ["perceive", *words, *given])
        assert done.exit_code == 0, done.output
        assert (REASON in json.loads((tmp_path / "grasps.json").read_text())["reason"]) == refused


@pytest.mark.parametrize("factor", FACTORS)
def test_what_is_usual_in_one_unit_is_refused_in_another_where_both_leave_what_is_usual(factor):
    for away in np.linspace(1.02 * AWAY[0], 0.98 * AWAY[1], 7).tolist():
        for length in np.linspace(1.02 * LENGTHS[0], 0.98 * LENGTHS[1], 7).tolist():
            outside = [not low <= factor * x <= high for x, (low, high) in ((away, AWAY), (length, LENGTHS))]
            assert bool(other_unit(factor * away, factor * length)) == all(outside)
            assert other_unit(away, factor * length) == other_unit(factor * away, length) == "", "one alone"
