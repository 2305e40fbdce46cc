"""Scenes and datasets: reproducible, as described, and safe against kills, damage and full disks."""

import errno
import hashlib
import json
import os
import runpy
import shutil
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from at_night import others_at_night

import data_gen
from data_gen import clutter, dataset
from data_gen.families import FAMILIES
from data_gen.scenes import CONFIGS
from data_gen.statistics import statistics
from data_gen.wide import WIDE
from labkit.geometry import back_project_to_base
from labkit.geometry.sensor import DepthSensor
from labkit.labels import OBSTACLE, TARGET
from labkit.pipeline import Pipeline
from labkit.sim.shapes import object_mesh
from labkit.sim.spec import Camera, SceneSpec, Table
from labkit.sim.world import World
from labkit.support.files import write_atomically
from labtrain.executors import executor_for

SIZE = (80, 60)
OVERHEAD = Camera.looking_at((0.55, 0.0, 0.0), 0.9, 0.3, 1.5)


@cache
def drawn(config: str) -> list[SceneSpec]:
    """The first sixty scenes of a config, drawn once."""
    return [data_gen.sample_scene(seed, config) for seed in range(60)]


def digest(folder: Path) -> dict[str, str]:
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    out = tmp_path_factory.mktemp("data") / "undisturbed"
    data_gen.generate(out, range(6), "test", SIZE, progress=False)
    return out


# Scenes -------------------------------------------------------------------------------------------------------------


def test_same_seed_same_scene_and_other_seed_or_config_another():
    scene = data_gen.sample_scene(4, "test")
    assert data_gen.sample_scene(4, "test") == scene
    assert data_gen.sample_scene(5, "test") != scene
    assert data_gen.sample_scene(4, "train").objects != scene.objects


def test_no_family_is_both_target_and_obstacle_and_colours_do_not_tell():
    colours = {TARGET: [], OBSTACLE: []}
    roles = {}
    for spec in (*drawn("test"), *(data_gen.sample_scene(seed, "test") for seed in range(60, 100))):
        for thing in spec.objects:
            colours[thing.class_id].append(thing.colour)
            roles.setdefault(thing.family, set()).add(thing.class_id)
    assert all(len(role) == 1 for role in roles.values()) and set(roles) == set(FAMILIES)
    means = {role: np.mean(values, axis=0) for role, values in colours.items()}
    assert np.abs(means[TARGET] - means[OBSTACLE]).max() < 0.06


@pytest.mark.parametrize("config", others_at_night(["train", "wide", "any"]))
def test_training_shows_nothing_that_hard_asks_about(config):
    scenes = {c: drawn(c) for c in (config, "hard")}
    things = {c: [thing for spec in scenes[c] for thing in spec.objects] for c in scenes}
    assert not set.intersection(*({s.table.texture.kind for s in scenes[c]} for c in scenes))
    assert not set.intersection(*({t.urdf for t in things[c] if t.family == "blob"} for c in scenes))
    # A duck is one model: hard ones have sizes that training ducks never have.
    ours, theirs = ([t.scale for t in things[c] if t.family == "duck"] for c in scenes)
    assert all(not min(ours) <= scale <= max(ours) for scale in theirs)
    ours, theirs = ([np.arcsin(-s.camera.T_base_cam[2][2]) for s in scenes[c]] for c in scenes)
    if config == "train":
        assert all(not min(ours) <= height <= max(ours) for height in theirs)
    elif config == "wide":
        (low_from, low_to), (high_from, _) = CONFIGS["hard"].elevations
        assert all(height < high_from and not low_from < height < low_to for height in ours)


@pytest.mark.parametrize("ours_is", others_at_night(["wide", "any"]))
def test_wide_has_none_of_hards_shapes(ours_is):
    """Shapes are told apart by the edges of their boxes, or by their parts."""
    things = {"wide": ours_is, "hard": "hard"}
    things = {c: [t for spec in drawn(k) for t in spec.objects] for c, k in things.items()}

    def sizes(config, family):
        """Edge lengths in the object's frame, sorted."""
        meshes = [object_mesh(thing) for thing in things[config] if thing.family == family]
        return np.array([np.sort(np.ptp(mesh.vertices, axis=0)) for mesh in meshes])

    assert sizes("wide", "block")[:, 0].min() > sizes("hard", "block")[:, 0].max()  # hard: slabs and sticks
    assert sizes("wide", "ball").max() < sizes("hard", "ball").min()
    for families, told_by in (
        (("lego",), lambda parts: tuple(len({p.position[axis] for p in parts[1:]}) for axis in (0, 1))),  # studs
        (("ring", "bowl"), lambda parts: tuple(len(p.size) for p in parts)),  # hulls
        (("dumbbell",), lambda parts: tuple(p.kind for p in parts)),
    ):
        ours, theirs = ({told_by(t.parts) for t in things[c] if t.family in families and t.parts} for c in things)
        assert ours and not ours & theirs, families
    assert {t.family for t in things["wide"]} == set(FAMILIES) == set(WIDE)


def test_calm_colours_change_no_depth_and_no_label():
    """Also of a scene with more things than colours, drawn smoothly; what each thing is does not choose its colour."""
    spec = max((spec for spec in drawn("test")), key=lambda spec: len(spec.objects))
    calm = data_gen.calm(spec)
    frame, quiet = data_gen.render(spec, SIZE), data_gen.render(calm, SIZE, smooth=True)
    for name in ("depth", "labels", "instances", "K", "T_base_cam"):
        assert np.array_equal(getattr(frame, name), getattr(quiet, name)), name
    assert not np.array_equal(frame.rgb, quiet.rgb)
    assert len({thing.colour for thing in calm.objects}) == 7 < len(calm.objects)
    colours = {family: {t.colour for s in drawn("test") for t in data_gen.calm(s).objects if t.family == family}
               for family in ("duck", "ball")}  # fmt: skip
    assert all(len(seen) >= 5 for seen in colours.values())


def test_every_target_can_be_held():
    """Each target is narrower than the open gripper somewhere: its least extent in the plane, or a rim's."""
    for spec in drawn("test"):
        for thing in spec.objects:
            if thing.class_id == TARGET and thing.family not in ("ring", "mug"):
                extents = np.sort(np.ptp(object_mesh(thing).vertices, axis=0))
                assert extents[0] < 0.065, thing.family
            assert 0.05 <= thing.mass <= 0.5 and thing.friction <= 1.0


@pytest.mark.nightly
def test_statistics_of_test_are_as_promised():
    s = statistics(range(900_000, 900_030), "test", (160, 120))
    assert sum(share >= 0.10 for share in s.families.values()) >= 5
    assert s.not_boxes >= 0.60
    assert s.obstacles >= 5.0
    assert s.occluded >= 0.25
    near, far = s.camera
    assert near >= 0.6 and far <= 1.2
    assert s.target_pixels <= 0.02


@pytest.mark.parametrize("config", others_at_night(["messy", "clutter", "bin"]))
def test_crowds_are_repeatable_and_what_holds_them_is_no_thing(config):
    """1 to 20 things of many sizes; walls, floors of bins and shelves have no instance, and only floors are surface."""
    specs = [data_gen.sample_scene(seed, config) for seed in range(12)]
    assert specs[3] == data_gen.sample_scene(3, config)
    counts = [len(spec.objects) for spec in specs]
    assert min(counts) >= 1 and max(counts) <= 20 and max(counts) > 10
    lengths = [np.ptp(object_mesh(thing).vertices, axis=0).max() for spec in specs for thing in spec.objects]
    assert min(lengths) < 0.05 and max(lengths) > 0.2
    assert any(spec.joints for spec in specs) and not all(spec.joints for spec in specs)
    walled = [sum(piece.surface for piece in spec.furniture) for spec in specs]
    assert set(walled) == {"clutter": {0}, "bin": {1}, "messy": {0, 1}}[config]
    with World(specs[3]) as world:
        frame = dataset.picture_of(world, SIZE)
    again = data_gen.render(specs[3], SIZE)
    assert all(np.array_equal(getattr(frame, name), getattr(again, name)) for name in ("rgb", "depth", "instances"))
    np.testing.assert_array_equal(frame.instances > 0, frame.labels >= TARGET)


def test_things_in_a_bin_lie_in_it_and_on_each_other():
    """Where they come to rest most lie between the walls, some of them higher than the bin's floor."""
    spec = data_gen.sample_scene(6, "bin")
    *walls, floor = spec.furniture[:5]
    with World(spec) as world:
        middles = np.array([world.centre(thing.name) for thing in spec.objects])
        bottoms = [world.client.getAABB(world.bodies[thing.name])[0][2] for thing in spec.objects]
    c, s = np.cos(floor.yaw), np.sin(floor.yaw)
    inside = np.abs((middles[:, :2] - floor.centre[:2]) @ [[c, -s], [s, c]]) < np.array(floor.size[:2]) / 2
    assert inside.all(axis=1).mean() > 0.6 and max(bottoms) > floor.centre[2] + 0.02
    assert all(wall.size[2] >= 0.05 for wall in walls)


def test_a_moulded_bin_bends_up_into_walls_that_lean_outwards_without_a_gap():
    """Straight down, its sides rise without a step from the floor to the rim; nothing of it is below the floor."""
    stand = Table(centre=(0.55, 0.0), size=(0.7, 0.9, 0.05), z=0.0)
    for seed in range(4):
        area, (*boards, floor) = clutter.moulded_bin(np.random.default_rng(seed), stand, (0.1, 0.1, 0.1))
        slopes = [piece.pitch for piece in boards]
        assert min(slopes) < -0.9 and max(slopes) <= 0.0 and floor.pitch == 0.0 and floor.surface
        ahead = np.array([np.cos(floor.yaw), np.sin(floor.yaw)])
        side = [piece for piece in boards if piece.yaw == floor.yaw]
        ends = [np.cos(p.pitch) * (p.size[0] - 0.002) / 2 for p in side]
        middles = [(np.array(p.centre[:2]) - floor.centre[:2]) @ ahead for p in side]
        assert np.isclose(middles[0] - ends[0], floor.size[0] / 2, atol=1e-6)
        for (end, middle), (next_end, next_middle) in pairwise(zip(ends, middles, strict=True)):
            assert np.isclose(middle + end, next_middle - next_end, atol=1e-6)
        assert min(piece.centre[2] for piece in boards) > floor.centre[2]
        with World(
            SceneSpec(objects=(), camera=OVERHEAD, table=stand, furniture=(*boards, floor), robot=False)
        ) as world:
            frame = world.render(SIZE)
        height = back_project_to_base(frame.depth, frame.K, frame.T_base_cam)[..., 2]
        assert (frame.instances == 0).all() and np.nanmax(height) > area.z + 0.02


# Datasets -----------------------------------------------------------------------------------------------------------


def test_a_dataset_reads_back_as_the_frames_that_were_rendered(undisturbed):
    frames = data_gen.load(undisturbed)
    assert len(frames) == 6 and len(frames[1:3]) == 2
    assert repr(frames) == f"Dataset({undisturbed}, 6 frames of test, 80 x 60)"
    with pytest.raises(IndexError):
        frames[6]
    for index in (0, -1):
        spec = data_gen.sample_scene(range(6)[index], "test")
        with World(spec) as world:
            true, poses = world.render(SIZE), world.poses()
        frame = frames[index]
        assert np.array_equal(frame.rgb, true.rgb)
        assert np.array_equal(frame.labels, true.labels) and np.array_equal(frame.instances, true.instances)
        assert np.abs(frame.depth - true.depth).max() <= 5.1e-5, "half a unit of the 16-bit file"
        assert np.allclose(frame.K, true.K) and np.allclose(frame.T_base_cam, true.T_base_cam)
        for entry in frames.objects(index):  # BOP: model to camera, millimetres
            T = np.eye(4)
            T[:3, :3] = np.reshape(entry["cam_R_m2c"], (3, 3))
            T[:3, 3] = np.array(entry["cam_t_m2c"]) / 1000.0
            assert np.allclose(true.T_base_cam @ T, poses[entry["name"]], atol=1e-9)


def test_scene_camera_is_in_bops_convention(undisturbed):
    camera = json.loads((undisturbed / "scene_camera.json").read_text())["2"]
    spec = data_gen.sample_scene(2, "test")
    centre = np.array(spec.camera.T_base_cam)[:3, 3]
    R, t = np.reshape(camera["cam_R_w2c"], (3, 3)), np.array(camera["cam_t_w2c"])
    assert np.allclose(R @ (1000.0 * centre) + t, 0.0, atol=1e-6), "the camera's centre is its frame's origin"


def test_frames_carry_the_height_of_their_table_so_that_a_pipeline_needs_no_other(tmp_path):
    frames = data_gen.generate(tmp_path / "new", range(3), "test", (320, 240), progress=False)
    for frame, seed in zip(frames, range(3), strict=True):
        table = data_gen.sample_scene(seed, "test").table
        assert frame.table_z == pytest.approx(table.z, abs=1e-12) and abs(table.z) > 0.002
        assert Pipeline().locate(frame, frame.labels).plan.grasps
    file = tmp_path / "new" / "scene_camera.json"
    older = {
        i: {k: v for k, v in camera.items() if k != "table_z"} for i, camera in json.loads(file.read_text()).items()
    }
    file.write_text(json.dumps(older))
    frame = data_gen.load(tmp_path / "new")[1]
    assert frame.table_z is None and np.array_equal(frame.T_base_cam, frames[1].T_base_cam)


def test_an_executor_gives_the_same_bytes_and_a_finished_dataset_is_left_alone(undisturbed, tmp_path):
    with ThreadPoolExecutor(2) as executor:
        data_gen.generate(tmp_path / "pool", range(6), "test", SIZE, executor, progress=False)
    assert digest(tmp_path / "pool") == digest(undisturbed)
    before = {path: path.stat().st_mtime_ns for path in undisturbed.rglob("*.png")}
    data_gen.generate(undisturbed, range(6), "test", SIZE, progress=False)
    assert {path: path.stat().st_mtime_ns for path in undisturbed.rglob("*.png")} == before


def test_killed_in_the_middle_and_run_again_it_gives_the_same_bytes(undisturbed, tmp_path):
    """Those of `undisturbed`, which this process made."""
    out = tmp_path / "killed"
    command = [sys.executable, "-m", "data_gen", str(out), "--scenes", "6", "--config", "test", "--size", "80x60"]
    process = subprocess.Popen(command, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    deadline = time.monotonic() + 240.0
    while len(list(out.glob("rgb/0*.png"))) < 2 and time.monotonic() < deadline:
        time.sleep(0.005)
    process.kill()
    process.wait()
    assert not (out / "dataset.json").exists()
    with pytest.raises(FileNotFoundError, match="not finished"):
        data_gen.load(out)
    subprocess.run(command, check=True, capture_output=True)
    found = {name: value for name, value in digest(out).items() if not name.endswith(".tmp")}
    assert found == digest(undisturbed)


def test_verify_names_what_is_damaged_and_what_is_missing(tmp_path, monkeypatch, capsys):
    out = tmp_path / "data"
    data_gen.generate(out, range(2), "test", SIZE, progress=False)
    assert data_gen.verify(out) == []
    (out / "depth" / "000001.png").write_bytes(b"not a picture")
    (out / "rgb" / "000000.png").unlink()
    assert sorted(data_gen.verify(out)) == ["depth/000001.png: damaged", "rgb/000000.png: missing"]
    monkeypatch.setattr(sys, "argv", ["data_gen", str(out), "--verify"])
    with pytest.raises(SystemExit) as stop:
        runpy.run_module("data_gen", run_name="__main__")
    assert stop.value.code == 1 and "rgb/000000.png: missing" in capsys.readouterr().out


def test_depth_noise_is_off_unless_asked_for_and_spoils_depth_alone(tmp_path):
    data_gen.generate(tmp_path / "noisy", range(1), "test", SIZE, sensor=DepthSensor(), progress=False)
    noisy = data_gen.load(tmp_path / "noisy")[0]
    exact = data_gen.render(data_gen.sample_scene(0, "test"), SIZE)
    assert np.array_equal(noisy.rgb, exact.rgb)
    assert (noisy.depth == 0).sum() > (exact.depth == 0).sum()


def distances(folder: Path) -> list[float]:
    """From each frame's camera to the mean place of its targets, metres."""
    frames = data_gen.load(folder)
    targets = [[thing["cam_t_m2c"] for thing in frames.objects(i) if thing["class"] == "target"] for i in range(4)]
    return [float(np.linalg.norm(np.mean(places, axis=0))) / 1000.0 for places in targets]


@pytest.mark.parametrize("workers", others_at_night([1, 2]))
def test_a_camera_of_ones_own_holds_in_every_process_and_is_part_of_the_request(workers, tmp_path):
    """A far camera stands far away in each worker, too, and no later call takes its frames for those of another."""
    far, out, how = {"distance": (2.0, 2.1)}, tmp_path / "far", {"size": SIZE, "progress": False}
    with executor_for(workers) as executor:
        data_gen.generate(out, range(4), "test", executor=executor, camera=far, **how)
    assert all(1.8 < distance < 2.3 for distance in distances(out))
    before = digest(out)
    for camera in (None, {"distance": (2.0, 2.2)}, {**far, "roll": 5}):
        with pytest.raises(ValueError, match=r"^out: .*other camera"):
            data_gen.generate(out, range(4), "test", camera=camera, **how)
    data_gen.generate(out, range(4), "test", camera={"distance": [2, 2.1]}, **how)  # the same in other words
    assert digest(out) == before


def test_a_dataset_from_before_cameras_were_named_is_still_the_one_asked_for(undisturbed, tmp_path):
    old = json.loads((undisturbed / "dataset.json").read_text())
    assert old.pop("camera") is None
    shutil.copytree(undisturbed, tmp_path / "old")
    (tmp_path / "old/dataset.json").write_text(json.dumps(old))
    assert len(data_gen.generate(tmp_path / "old", range(6), "test", SIZE, progress=False)) == 6
    with pytest.raises(ValueError, match=r"^out: .*other camera"):
        data_gen.generate(tmp_path / "old", range(6), "test", SIZE, progress=False, camera={"distance": 1.0})


# Bad input ----------------------------------------------------------------------------------------------------------


@pytest.mark.bad_input
@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda out: data_gen.sample_scene(-1, "test"), "seed"),
        (lambda out: data_gen.sample_scene(0, "easy"), "config"),
        (lambda out: data_gen.generate(out, [], "test"), "seeds"),
        (lambda out: data_gen.generate(out, [0], "easy"), "config"),
        (lambda out: data_gen.generate(out, [0], "test", (0, 10)), "size"),
        (lambda out: data_gen.generate(out, [0], "test", camera={"distance": 0.1}), "camera: distance"),
    ],
)
def test_wrong_arguments_are_named_and_nothing_is_written(call, name, tmp_path):
    with pytest.raises(ValueError, match=rf"^{name}:"):
        call(tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.bad_input
def test_another_dataset_is_never_overwritten(undisturbed, tmp_path):
    before = digest(undisturbed)
    with pytest.raises(ValueError, match=r"^out: .*other seeds"):
        data_gen.generate(undisturbed, range(7), "test", SIZE, progress=False)
    assert digest(undisturbed) == before
    (tmp_path / "diary.txt").write_text("dear diary")
    with pytest.raises(ValueError, match=r"^out: .*other files"):
        data_gen.generate(tmp_path, range(1), "test", SIZE, progress=False)


@pytest.mark.bad_input
def test_datasets_that_cannot_be_read_are_named(undisturbed, tmp_path):
    with pytest.raises(FileNotFoundError, match=r"^path: .*no dataset"):
        data_gen.load(tmp_path)
    description = json.loads((undisturbed / "dataset.json").read_text())
    (tmp_path / "dataset.json").write_text(json.dumps({**description, "version": dataset.VERSION + 1}))
    with pytest.raises(ValueError, match=r"^path: .*newer .*update"):
        data_gen.load(tmp_path)
    (tmp_path / "dataset.json").write_text("{")
    with pytest.raises(ValueError, match=r"^path: .*damaged"):
        data_gen.load(tmp_path)


@pytest.mark.bad_input
def test_a_full_disk_is_said_and_leaves_no_half_file(tmp_path, monkeypatch):
    path = tmp_path / "frame.png"
    path.write_bytes(b"old")

    def full(self, data):
        with open(self, "wb") as file:
            file.write(data[:2])
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(OSError, match="could not write") as caught:
        write_atomically(path, b"new")
    assert caught.value.errno == errno.ENOSPC and caught.value.filename == str(path)
    assert path.read_bytes() == b"old" and [p.name for p in tmp_path.iterdir()] == ["frame.png"]


@pytest.mark.bad_input
def test_the_command_says_a_full_disk_in_one_line_and_goes_on_later(tmp_path):
    """The system itself refuses: no file of this process may grow beyond 2 kB."""
    out = tmp_path / "out"
    arguments = ["data_gen", str(out), "--scenes", "2", "--config", "test", "--size", "80x60"]
    code = (
        "import resource, runpy, signal, sys; signal.signal(signal.SIGXFSZ, signal.SIG_IGN);"
        f"import data_gen.dataset; data_gen.render(data_gen.sample_scene(0, 'test'), (80, 60)); sys.argv = {arguments};"
        "data_gen.render(data_gen.sample_scene(1, 'test'), (80, 60));"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000)); runpy.run_module('data_gen', run_name='__main__')"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert run.returncode == 1
    assert run.stderr.strip().splitlines()[-1].startswith("data_gen: ") and "could not write" in run.stderr
    assert not list(out.rglob("*.tmp"))
    data_gen.generate(out, range(2), "test", SIZE, progress=False)
    assert data_gen.verify(out) == []
