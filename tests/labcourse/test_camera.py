"""A course's own camera: in force where a notebook says `style()`, nowhere else, and refused if it makes no sense."""

import numpy as np
import pytest

import data_gen
from data_gen import scenes
from labcourse import camera


@pytest.fixture(autouse=True)
def nothing_held(monkeypatch):
    monkeypatch.setattr(scenes, "HELD", {})
    monkeypatch.delenv(camera.NAMED, raising=False)


def elevation(spec) -> float:
    """Of the line of sight, degrees below the horizon."""
    return float(np.degrees(np.arcsin(-spec.camera.T_base_cam[2][2])))


def test_the_setting_holds_for_scenes_drawn_after_it_and_keeps_their_things(tmp_path, monkeypatch):
    before = data_gen.sample_scene(600_002, "test")
    (tmp_path / "pyproject.toml").write_text("[tool.labcourse]\ncamera = { elevation = [70, 71], fov_y = 50 }\n")
    inside = tmp_path / "lessons"
    inside.mkdir()
    camera.hold(inside)
    held = data_gen.sample_scene(600_002, "test")
    assert held.objects == before.objects and 70 <= elevation(held) <= 71 and not 60 < elevation(before) < 80
    assert held.camera.fov_y == pytest.approx(np.radians(50))
    monkeypatch.setenv(camera.NAMED, "distance = 0.9")
    camera.hold(inside)
    assert scenes.HELD == {"distance": (0.9, 0.9)}


def test_without_a_setting_nothing_is_held(tmp_path):
    camera.hold(tmp_path)
    assert scenes.HELD == {}


@pytest.mark.parametrize(
    "text, said",
    [
        ("height = 1", "camera: expected keys distance"),
        ("elevation = 100", "camera: elevation: expected a number from 5 to 89 degrees"),
        ("distance = [2, 1]", r"camera: distance: .* got \[2, 1\]"),
        ("distance: 2", "LABKIT_CAMERA: expected `distance"),
    ],
)
def test_what_makes_no_sense_is_refused(text, said, monkeypatch, tmp_path):
    monkeypatch.setenv(camera.NAMED, text)
    with pytest.raises(ValueError, match=said):
        camera.hold(tmp_path)


def test_a_camera_that_cannot_see_the_targets_is_refused_and_does_not_search_for_ever(monkeypatch):
    monkeypatch.setattr(scenes, "MOST_TRIES", 50)
    monkeypatch.setattr(scenes, "HELD", {"distance": (0.2, 0.2)})
    with pytest.raises(ValueError, match="camera: expected one that sees all targets"):
        data_gen.sample_scene(600_002, "test")
