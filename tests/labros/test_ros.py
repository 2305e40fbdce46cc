"""The text's run_ros_node: what becomes of its arguments. test_ros1 and test_ros2 have the middleware."""

import pytest

from labkit.learning.network import ARCHITECTURES, save_model, weights_path
from labkit.node.bus import Bus
from labkit.node.messages import ROS_TOPICS
from labros import ros


@pytest.fixture
def asked(monkeypatch):
    """What `run` would have been asked to do, without any ROS."""
    asked = []
    monkeypatch.setattr(ros, "check_ros_installed", lambda version: None)
    monkeypatch.setattr(ros, "run", lambda build, **options: asked.append((build(Bus(), None), options)))
    return asked


def test_every_argument_is_used(asked):
    ros.run_ros_node(weights_path("smallsegnet"), 4, 1, table_z=0.1, base_frame="panda_link0")
    ((node, options),) = asked
    assert node.pipeline.target_class == 1 and node.pipeline.table_z == 0.1 and node.pipeline.model.num_classes == 4
    assert node.base_frame == "panda_link0" and node.topics == ROS_TOPICS and options == {"version": 2}


def test_any_number_of_classes_and_any_of_them_as_target(asked, tmp_path):
    save_model(ARCHITECTURES["smallsegnet"](6), tmp_path / "six.pt")
    ros.run_ros_node(tmp_path / "six.pt", 6, 5)
    assert asked[0][0].pipeline.target_class == 5


@pytest.mark.bad_input
def test_wrong_arguments_are_named(asked):
    with pytest.raises(ValueError, match=r"^num_classes:"):
        ros.run_ros_node(weights_path("smallsegnet"), 3, 1)
    with pytest.raises(ValueError, match=r"^target_class:"):
        ros.run_ros_node(weights_path("smallsegnet"), 4, 4)
    with pytest.raises(FileNotFoundError):
        ros.run_ros_node("nowhere.pt", 4, 1)
    assert not asked
