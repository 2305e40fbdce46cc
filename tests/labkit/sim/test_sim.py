"""The world against geometry that it does not know: planes, meshes, and other worlds."""

import dataclasses
import os
import subprocess
import sys

import numpy as np
import pytest
from trimesh.proximity import closest_point_naive

from data_gen import sample_scene
from data_gen.statistics import silhouette
from labkit.geometry import back_project_to_base, project
from labkit.labels import BACKGROUND, OBSTACLE, SURFACE, TARGET
from labkit.sim import shapes, textures
from labkit.sim.shapes import object_mesh, part_mesh
from labkit.sim.spec import Camera, ObjectSpec, Part, SceneSpec, Table, Texture
from labkit.sim.world import World


def thing(name="block", class_id=TARGET, **changes):
    good = {"position": (0.5, 0.0, 0.022), "parts": (Part("box", (0.04, 0.05, 0.04)),)}
    return ObjectSpec(name=name, family=name, class_id=class_id, **{**good, **changes})


def scene(*objects, camera=None, **rest):
    camera = camera or Camera.looking_at((0.5, 0.0, 0.0), 0.7, 0.5, 0.8)
    return SceneSpec(objects=tuple(objects), camera=camera, **{"robot": False, **rest})


def points_of(frame, mask):
    return back_project_to_base(frame.depth, frame.K, frame.T_base_cam)[mask].astype(float)


EGL = pytest.mark.debian("libegl1", "libgl1-mesa-dri")


def test_a_stereo_camera_reads_what_both_eyes_see_to_a_part_of_a_pixel_of_disparity():
    exact = Camera.looking_at((0.5, 0.0, 0.0), 0.7, 0.5, 0.8)
    with World(scene(thing(), camera=exact)) as world:
        stereo = dataclasses.replace(exact, sensor="stereo")
        truth, seen, again = (world.render(camera=camera) for camera in (exact, stereo, stereo))
    assert seen.rgb.tobytes() == truth.rgb.tobytes() and seen.labels.tobytes() == truth.labels.tobytes()
    assert seen.depth.tobytes() == again.depth.tobytes()
    read = seen.depth > 0
    assert 0.9 < read[truth.depth > 0].mean() < 1.0 and not read[truth.depth == 0].any()
    off = seen.K[0, 0] * 0.05 * (1 / seen.depth[read] - 1 / truth.depth[read])
    assert 0.02 < off.std() < 0.12 and np.abs(off).max() < 0.5  # pixels
    with pytest.raises(ValueError, match=r"^sensor: expected .*stereo.*, got 'sonar'$"):
        dataclasses.replace(exact, sensor="sonar")


@pytest.mark.parametrize("size", [(320, 240), (640, 480), (201, 161)])
@pytest.mark.parametrize(("seed", "renderer"), [(0, "tiny"), (1, "tiny"), pytest.param(0, "egl", marks=EGL)])
def test_a_rendered_plane_is_a_plane(size, seed, renderer, capfd):
    """Intrinsics are right to 0.05 mm: a tilted table, with any roll, stays flat and at its height."""
    rng = np.random.default_rng(seed)
    camera = Camera.looking_at(
        (0.5, 0.0, 0.0),
        rng.uniform(0.5, 0.8),
        rng.uniform(-3, 3),
        rng.uniform(0.6, 1.2),
        rng.uniform(-3, 3),
        fov_y=0.6,
        renderer=renderer,
    )
    with World(scene(camera=camera, table=Table(size=(1.0, 1.4, 0.05), z=0.013))) as world:
        frame = world.render(size)
        shifted = dataclasses.replace(frame, K=frame.K + np.array([[0, 0, -0.5], [0, 0, 0.5], [0, 0, 0]]))
    mask = frame.labels == SURFACE
    assert mask.mean() > 0.5
    error = np.abs(points_of(frame, mask)[:, 2] - 0.013)
    assert error.max() < (5e-5 if renderer == "tiny" else 3e-4)
    assert np.abs(points_of(shifted, mask)[:, 2] - 0.013).max() > 5e-4, "half a pixel off would not do"
    assert capfd.readouterr().out == "", "OpenGL greets every process"


@pytest.mark.parametrize(
    "shown",
    [
        thing(),
        thing(
            parts=(Part("cylinder", (0.02, 0.06)), Part("sphere", (0.025,), (0.0, 0.0, 0.03))),
            position=(0.5, 0.0, 0.032),
        ),
        thing(parts=(), urdf="objects/mug.urdf", scale=0.7, position=(0.5, 0.0, 0.001)),
        thing(parts=(), urdf="duck_vhacd.urdf", scale=0.8, orientation=(0.707, 0.0, 0.0, 0.707)),
        thing(parts=(), urdf="random_urdfs/007/007.urdf", scale=0.9, position=(0.5, 0.0, 0.05)),
        thing(parts=(), urdf="lego/lego.urdf", position=(0.5, 0.0, 0.02)),
    ],
    ids=["box", "parts", "mug", "duck", "random", "lego"],
)
def test_rendered_points_lie_on_the_visual_mesh_at_its_true_pose(shown):
    with World(scene(shown)) as world:
        frame = world.render((320, 240))
        T_base_object = world.pose(shown.name)
    points = points_of(frame, frame.labels == TARGET)[::3]
    assert len(points) > 50
    in_object_frame = (points - T_base_object[:3, 3]) @ T_base_object[:3, :3]
    assert closest_point_naive(object_mesh(shown), in_object_frame)[1].max() < 1e-3


def test_a_pose_is_of_the_mesh_not_of_the_centre_of_mass():
    uneven = thing(parts=(Part("box", (0.02, 0.02, 0.02)), Part("box", (0.06, 0.06, 0.02), (0.0, 0.0, -0.02))))
    lifted = dataclasses.replace(uneven, position=(0.5, 0.1, 0.3), orientation=(0.0, 0.0, 0.6, 0.8))
    with World(scene(lifted), settle_seconds=0.0) as world:
        T = world.pose("block")
    assert np.allclose(T[:3, 3], (0.5, 0.1, 0.3), atol=1e-9)
    assert np.allclose(T[:3, 0], (0.8**2 - 0.6**2, 2 * 0.6 * 0.8, 0.0))


def test_labels_and_instances_say_what_is_seen():
    spec = scene(thing("a"), thing("b", OBSTACLE, position=(0.5, 0.15, 0.022)), robot=True)
    wide = dataclasses.replace(spec.camera, fov_y=1.4)
    with World(spec) as world:
        frame = world.render((320, 240), wide)
        middle = {name: world.centre(name) for name in "ab"}
    assert set(np.unique(frame.labels)) == {BACKGROUND, SURFACE, TARGET, OBSTACLE}
    T_cam_base = np.linalg.inv(frame.T_base_cam)
    for number, (name, label) in enumerate([("a", TARGET), ("b", OBSTACLE)], start=1):
        u, v = project((T_cam_base[:3, :3] @ middle[name] + T_cam_base[:3, 3])[None], frame.K)
        pixel = round(float(v[0])), round(float(u[0]))
        assert (frame.labels[pixel], frame.instances[pixel]) == (label, number)
    u, v = project((T_cam_base[:3, :3] @ (0.0, 0.0, 0.1) + T_cam_base[:3, 3])[None], frame.K)
    assert frame.labels[round(float(v[0])), round(float(u[0]))] == BACKGROUND, "the robot is background"


def test_a_silhouette_is_what_an_object_would_cover_alone():
    behind = thing("behind", position=(0.46, -0.02, 0.022))
    before = thing("before", OBSTACLE, position=(0.52, 0.01, 0.042), parts=(Part("box", (0.03, 0.08, 0.08)),))
    with World(scene(behind, before)) as world:
        seen = world.render().instances == 1
        whole = silhouette(world, "behind")
        again = world.render().instances == 1
    with World(scene(behind)) as alone:
        expected = alone.render().instances == 1
    assert seen.sum() < whole.sum() and np.array_equal(seen, again)
    assert np.mean(whole != expected) < 1e-3


def test_worlds_do_not_disturb_one_another():
    spec = sample_scene(3, "test")
    with World(spec) as world:
        alone = [world.render().rgb.tobytes(), [pose.tobytes() for pose in world.poses().values()]]
        world.step(50)
        later = [pose.tobytes() for pose in world.poses().values()]
    with World(spec) as first, World(sample_scene(4, "test")) as second:
        second.step(100)
        assert first.render().rgb.tobytes() == alone[0]
        assert [pose.tobytes() for pose in first.poses().values()] == alone[1]
        second.render()
        first.step(25)
        second.close()
        first.step(25)
        assert [pose.tobytes() for pose in first.poses().values()] == later


def test_objects_stand_at_rest_on_the_table_or_on_one_another():
    spec = sample_scene(5, "hard")
    assert repr(spec) == f"SceneSpec(hard, seed 5: {', '.join(thing.name for thing in spec.objects)})"
    piled = scene(thing("low", position=(0.5, 0.0, 0.0201)), thing("high", position=(0.51, 0.0, 0.062)))
    with World(piled) as world:
        assert world.pose("high")[2, 3] == pytest.approx(0.06, abs=0.004)
    spec = sample_scene(11, "test")
    with World(spec) as world:
        before = world.poses()
        world.step(120)
        after = world.poses()
    for name in before:
        assert np.linalg.norm(after[name][:3, 3] - before[name][:3, 3]) < 2e-3
        assert before[name][2, 3] > spec.table.z - 0.01


@pytest.mark.bad_input
@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: thing(mass=0.0), "mass"),
        (lambda: thing(scale=np.nan), "scale"),
        (lambda: thing(position=(0.5, np.nan, 0.022)), "position"),
        (lambda: thing(position=(0.5, 0.022)), "position"),
        (lambda: thing(orientation=(0.0, 0.0, 1.57)), "orientation"),
        (lambda: thing(orientation=(0.0, 0.0, 0.0, 0.0)), "orientation"),
        (lambda: scene(thing(position=(500.0, 0.0, 22.0))), "'block' over the table"),
        (lambda: scene(thing(position=(0.5, 0.9, 0.022))), "'block' over the table"),
        (lambda: World(scene(thing(position=(0.5, 0.0, 0.0)))), "'block' .* deep in the table"),
        (lambda: World(scene(thing(position=(0.5, 0.0, 0.5)))), "'block' .* above what is below it"),
        (lambda: World(scene(thing(parts=(), urdf="duck.urdf"))), "urdf: expected a file .*'duck.urdf'"),
        (lambda: Camera.looking_at((0.5, 0, 0), 0.9, 0.4, 0.8, fov_y=60), "fov_y: .*radians"),
        (lambda: Camera.looking_at((500.0, 0, 0), 900.0, 0.4, 0.8), "T_base_cam: .*millimetres"),
        (lambda: Camera.looking_at((0.5, 0, 0), 0.9, 0.4, 0.8, near=7.0), "near"),
        (lambda: thing(class_id=1), "class_id"),
        (lambda: thing(parts=()), "urdf"),
        (lambda: thing(urdf="duck_vhacd.urdf"), "parts"),
        (lambda: scene(thing(), thing()), "objects"),
        (lambda: part_mesh(Part("cube", (1.0, 1.0, 1.0))), "part.kind"),
        (lambda: part_mesh(Part("box", (1.0, 1.0))), "part.size"),
        (lambda: part_mesh(Part("box", (1.0, 1.0, 0.0))), "part.size"),
        (lambda: part_mesh(Part("hull", (0.0,) * 9)), "part.size"),
        (lambda: textures.paint(Texture("tartan")), "texture.kind"),
    ],
)
def test_wrong_scenes_are_named(call, says):
    with pytest.raises(ValueError, match=says):
        call()


@pytest.mark.bad_input
def test_wrong_requests_to_a_world_are_named():
    with World(scene(thing())) as world:
        with pytest.raises(ValueError, match=r"^size:"):
            world.render((0, 240))
        with pytest.raises(ValueError, match=r"^name:"):
            world.pose("nobody")
    world.close()
    with World(scene(thing())) as next_world:  # PyBullet gives it the number of the closed one
        for call in (world.render, world.step, lambda: world.pose("block")):
            with pytest.raises(ValueError, match="expected an open simulation"):
                call()
        assert next_world.pose("block").shape == (4, 4)


def test_what_pybullet_reads_from_files_is_private_and_gone_when_read(tmp_path):
    """Already while the process runs: one that is killed has no time to tidy up."""
    code = (
        "import os, stat, sys, tempfile; from data_gen import sample_scene; from labkit.sim.shapes import as_file\n"
        "from labkit.sim.world import World\n"
        "with as_file(b'solid', '.obj') as path:\n"
        "    print(oct(stat.S_IMODE(os.stat(os.path.dirname(path)).st_mode)), open(path).read())\n"
        "World(sample_scene(2, 'hard')).close()\n"
        "print(os.listdir(tempfile.gettempdir()))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], env={**os.environ, "TMPDIR": str(tmp_path)}, capture_output=True, text=True
    )
    assert done.stdout == "0o700 solid\n[]\n", done.stderr


def test_a_urdf_is_read_whatever_version_of_xml_it_declares(tmp_path, monkeypatch):
    """Some of pybullet_data declare 0.0, which Python 3.13's parser refuses on newer systems; no parser takes "x"."""
    original = shapes.urdf_path("duck_vhacd.urdf")
    body = original.read_text(encoding="utf-8").partition("?>")[2].replace('"duck', f'"{original.parent}/duck')
    (tmp_path / "duck.urdf").write_text('<?xml version="x" ?>' + body, encoding="utf-8")
    expected = shapes._urdf_mesh("duck_vhacd.urdf").vertices
    monkeypatch.setattr(shapes, "data_path", lambda: tmp_path)
    assert np.array_equal(shapes._urdf_mesh.__wrapped__("duck.urdf").vertices, expected)
