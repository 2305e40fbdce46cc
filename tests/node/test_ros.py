"""The text's run_ros_node: what becomes of its arguments. The middleware is left out; test_ros1.py has it."""

import pytest

from labkit.network import ARCHITECTURES, save_model, weights_path
from labkit.node import ros


@pytest.fixture
def asked(monkeypatch):
    """What `run` would have been asked to do, without any ROS."""
    asked = []
    monkeypatch.setattr(ros, "ros", lambda module: None)
    monkeypatch.setattr(ros, "run", lambda pipeline, **options: asked.append((pipeline, options)))
    return asked


def test_every_argument_is_used(asked):
    ros.run_ros_node(weights_path("smallsegnet"), 4, 1, table_z=0.1, base_frame="panda_link0")
    ((pipeline, options),) = asked
    assert pipeline.target_class == 1 and pipeline.table_z == 0.1 and pipeline.model.num_classes == 4
    assert options == {"base_frame": "panda_link0"}


def test_any_number_of_classes_and_any_of_them_as_target(asked, tmp_path):
    save_model(ARCHITECTURES["smallsegnet"](6), tmp_path / "six.pt")
    ros.run_ros_node(tmp_path / "six.pt", 6, 5)
    assert asked[0][0].target_class == 5


@pytest.mark.bad_input
def test_wrong_arguments_are_named(asked):
    with pytest.raises(ValueError, match=r"^num_classes:"):
        ros.run_ros_node(weights_path("smallsegnet"), 3, 1)
    with pytest.raises(ValueError, match=r"^target_class:"):
        ros.run_ros_node(weights_path("smallsegnet"), 4, 4)
    with pytest.raises(FileNotFoundError):
        ros.run_ros_node("nowhere.pt", 4, 1)
    assert not asked
