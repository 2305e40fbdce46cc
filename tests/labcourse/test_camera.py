"""A course's own camera: every scene of a notebook has it, nothing else does, and nonsense is refused."""

import numpy as np
import pytest

import data_gen
from data_gen import scenes
from labcourse import camera
from tests import notebooks


@pytest.fixture(autouse=True)
def nothing_set(monkeypatch, tmp_path):
    monkeypatch.delenv(camera.NAMED, raising=False)
    monkeypatch.chdir(tmp_path)


def elevation(spec) -> float:
    """Of the line of sight, degrees below the horizon."""
    return float(np.degrees(np.arcsin(-spec.camera.T_base_cam[2][2])))


def test_the_setting_turns_the_camera_and_keeps_the_things(tmp_path, monkeypatch):
    others = data_gen.sample_scene(600_002, "test")
    (tmp_path / "pyproject.toml").write_text("[tool.labcourse]\ncamera = { elevation = [70, 71], fov_y = 50 }\n")
    inside = tmp_path / "lessons"
    inside.mkdir()
    monkeypatch.chdir(inside)
    ours = camera.sample_scene(600_002, "test")
    assert ours.objects == others.objects and 70 <= elevation(ours) <= 71 and not 60 < elevation(others) < 80
    assert ours.camera.fov_y == pytest.approx(np.radians(50))
    assert data_gen.sample_scene(600_002, "test") == others  # what no notebook draws stays as it is
    monkeypatch.setenv(camera.NAMED, "distance = 0.9")
    assert camera.setting(inside) == {"distance": 0.9}
    assert camera.sample_scene(600_002, "test") == data_gen.sample_scene(600_002, "test", {"distance": 0.9})


def test_without_a_setting_the_scenes_are_everybodys():
    assert camera.sample_scene(600_002, "test") == data_gen.sample_scene(600_002, "test")
    assert camera.sample_scene(600_002) == data_gen.sample_scene(600_002)


def test_every_scene_of_a_notebook_is_seen_by_the_courses_camera():
    template = notebooks.ROOT / "labcourse/templates/lab.ipynb"
    for path in (*notebooks.LESSONS, *notebooks.SOLUTIONS, template):
        drawn = [cell.source for cell in notebooks.code(path) if "sample_scene(" in cell.source]
        assert not any(".sample_scene" in source for source in drawn), f"{path.name} draws a scene past the camera"
        ours = any("from labcourse.camera import sample_scene" in cell.source for cell in notebooks.code(path))
        assert ours == bool(drawn), path.name


@pytest.mark.parametrize(
    "text, said",
    [
        ("height = 1", "camera: expected keys distance"),
        ("elevation = 100", "camera: elevation: expected a number from 5 to 89 degrees"),
        ("distance = [2, 1]", r"camera: distance: .* got \[2, 1\]"),
        ("distance = true", "camera: distance: .* got True"),
        ("distance: 2", "LABKIT_CAMERA: expected `distance"),
    ],
)
def test_what_makes_no_sense_is_refused(text, said, monkeypatch):
    monkeypatch.setenv(camera.NAMED, text)
    with pytest.raises(ValueError, match=said):
        camera.sample_scene(600_002, "test")


def test_a_camera_that_cannot_see_the_targets_is_refused_and_does_not_search_for_ever(monkeypatch):
    monkeypatch.setattr(scenes, "MOST_TRIES", 50)
    with pytest.raises(ValueError, match=r"camera: expected one that sees all targets, found none at 0\.2 to 0\.2 m"):
        data_gen.sample_scene(600_002, "test", {"distance": 0.2})
