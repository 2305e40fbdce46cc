"""`labkit node sim | bag | ros`: their words, its one line, and what it says about wrong ones."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

import data_gen
from labcli.commands.node import RosSettings, Settings, warm_up
from labkit.grasp import GraspPlan
from labkit.node.actors import Camera
from labkit.node.messages import DEFAULT_TOPICS, Image
from labkit.pipeline import Pipeline
from labros.bags import BagWriter


def test_sim_goes_from_camera_topic_to_lift_in_one_line():
    command = [sys.executable, "-m", "labcli.cli", "node", "sim", "--seed", "0"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    (line,) = done.stdout.splitlines()
    assert line.startswith("scene 0: frame answered") and "lifted lego_0" in line


def test_bag_says_what_became_of_the_frames(labkit, capsys, tmp_path):
    frame = data_gen.render(data_gen.sample_scene(620000, "test"), (64, 48))
    with BagWriter(tmp_path / "in.bag") as bag:
        Camera(bag).publish(frame, 1)
    out = tmp_path / "out"
    assert labkit("node", "bag", tmp_path / "in.bag", out, "--model", "smallsegnet") == 0
    assert f"wrote {out}: 1 frames answered, 0 lost, 0 unusable, 0 malformed messages" in capsys.readouterr().out
    assert (out / "metadata.yaml").is_file()
    assert labkit("node", "bag", tmp_path / "in.bag", out, "--model", "smallsegnet") == 2
    assert "it is there already" in capsys.readouterr().err


def test_a_bag_of_which_no_frame_was_answered_is_a_failure_that_names_its_cause(labkit, capsys, tmp_path):
    frame = data_gen.render(data_gen.sample_scene(620000, "test"), (64, 48))
    with BagWriter(tmp_path / "in.bag") as bag:
        Camera(bag, topics=replace(DEFAULT_TOPICS, depth="/elsewhere")).publish(frame, 1)
        bag.advertise(DEFAULT_TOPICS.depth, Image)
    assert labkit("node", "bag", tmp_path / "in.bag", tmp_path / "out", "--model", "smallsegnet") == 1
    said = "0 frames answered, 1 lost, 0 unusable, 0 malformed messages: frame lost: no /camera/depth/image_raw within"
    assert said in capsys.readouterr().out


def test_settings_of_things_the_hand_and_the_workspace_reach_the_pipeline():
    pipeline = Settings(anything=True, gripper="max_opening=0.03", workspace="0 1 -1 1 0 0.5").pipeline(0.2)
    assert pipeline.model is None and pipeline.find_objects is not None
    assert pipeline.gripper.max_opening == 0.03 and pipeline.targets.workspace.tolist() == [[0, 1], [-1, 1], [0, 0.5]]
    assert pipeline.table_z == 0.2


def test_warming_up_runs_the_network_the_planner_and_all_between():
    frames, clouds = [], []

    def network(rgb):
        frames.append(rgb.shape)
        return np.dstack([np.ones(rgb.shape[:2]), np.zeros((*rgb.shape[:2], 3))])

    def plan(targets, scene, table_z, camera_position):
        clouds.extend(targets)
        return GraspPlan(reason="of a test")

    warm_up(Pipeline(network, 0.1, grasp=plan))
    assert frames == [(480, 640, 3)] and [len(cloud) for cloud in clouds] == [40 * 60]


@pytest.mark.bad_input
@pytest.mark.parametrize(
    "wrong, said",
    [
        ({"table_z": "abc"}, "table_z: expected a number, got 'abc'"),
        ({"crf": 1}, "crf: expected true or false, got 1"),
        ({"qos_depth": 2.5}, "qos_depth: expected a whole number, got 2.5"),
        ({"camera_pose": 3}, "camera_pose: expected a text, got 3"),
    ],
)
def test_a_parameter_of_another_type_has_its_own_sentence(wrong, said):
    with pytest.raises(ValueError, match=f"^{said}$"):
        RosSettings(**wrong)
    assert RosSettings(table_z=1, crf=True, camera_pose=None).table_z == 1, "a whole number is a number"


@pytest.mark.bad_input
@pytest.mark.parametrize(
    "arguments, said",
    [
        (["--sim"], "node: expected sim, bag or ros first"),
        (["--bag", "a.bag", "--out", "b.bag"], "node: expected sim, bag or ros first"),
        (["sim", "--modle", "unet"], "--modle"),
        (["sim", "--on-demand"], "--on-demand"),
        (["sim", "--ros-args", "-r", "__ns:=/left"], "--ros-args"),
        (["ros", "--ros1", "--on-demand"], "expected --lifecycle and --on-demand without --ros1"),
        (["ros", "--modle", "unet"], "got --modle"),
        (["bag", "a.bag"], "OUT"),
        (["bag", "nowhere.bag", "a.bag", "--model", "smallsegnet"], "nowhere.bag"),
        (["bag", "a.bag", "b.bag", "--model", "smallsegnet", "--camera-pose", "1 2 3"], "camera_pose"),
        (["bag", "a.bag", "b.bag", "--model", "smallsegnet", "--topic", "rgp=/a"], "topic"),
        (["sim", "--engine", "abacus"], "engine"),
        (["sim", "--model", "smallsegnet", "--target", "9"], "target_class"),
    ],
)
def test_wrong_words_are_one_line_and_status_2(labkit, capsys, arguments, said):
    assert labkit("node", *arguments) == 2
    assert said in capsys.readouterr().err.splitlines()[-1]
