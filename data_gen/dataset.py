"""Datasets on disk in the BOP benchmark's layout, written so that a killed run can be resumed.

    OUT/rgb/000000.png  depth/000000.png (16 bit)  labels/000000.png  instances/000000.png
    OUT/scene_camera.json   cam_K, cam_R_w2c, cam_t_w2c (millimetres), depth_scale (millimetres for one unit of depth),
                            table_z (the kit's own: height of the table in the world frame, millimetres)
    OUT/scene_gt.json       for each object cam_R_m2c, cam_t_m2c (millimetres), obj_id, and its name, family and class
    OUT/dataset.json        generator version, config, camera, seeds, size, classes, families, every image's SHA-256

World frame = robot base. Lengths are millimetres in BOP's files alone. `dataset.json` comes last: with it, a dataset
is complete.
"""

import hashlib
import json
import shutil
from collections.abc import Sequence
from concurrent.futures import Executor
from pathlib import Path

import cv2
import numpy as np
from tqdm.auto import tqdm

from data_gen.cameras import Ranges, check_camera
from data_gen.families import FAMILIES
from data_gen.scenes import CONFIGS, sample_scene
from labkit.frame import RGBDFrame
from labkit.geometry.depth_units import whole_units
from labkit.geometry.sensor import DepthSensor
from labkit.labels import CLASSES
from labkit.sim.spec import SceneSpec
from labkit.sim.world import World
from labkit.support.files import write_atomically
from labkit.support.validation import require
from labtrain.executors import as_they_come
from labtrain.paint import painted

VERSION = 1
DEPTH_UNIT_MM = 0.1  # one step of the 16-bit files: finer than any sensor, and 6.5 m still fit
KINDS = ("rgb", "depth", "labels", "instances")
FAMILY_NUMBER = {family: number for number, family in enumerate(FAMILIES, start=1)}


def render(spec: SceneSpec, size: tuple[int, int] = (320, 240), smooth: bool = False) -> RGBDFrame:
    """Load a scene, let it settle and take its picture; size is (width, height), smooth as in `World.render`."""
    with World(spec) as world:
        return picture_of(world, size, smooth)


def picture_of(world: World, size: tuple[int, int], smooth: bool = False) -> RGBDFrame:
    """Take a World's picture; the things of a config that paints them have patches of other colours."""
    frame, spec = world.render(size, smooth=smooth), world.spec
    if spec.config not in CONFIGS or not CONFIGS[spec.config].painted:
        return frame
    return painted(frame, np.random.default_rng([spec.seed, 4]))


def generate(
    out,
    seeds: Sequence[int],
    config: str = "train",
    size: tuple[int, int] = (320, 240),
    executor: Executor | None = None,
    sensor: DepthSensor | None = None,
    progress: bool = True,
    camera: Ranges | None = None,
) -> "Dataset":
    """Write one frame per seed to the folder `out` and return the dataset.

    executor: any concurrent.futures.Executor, None for this process. sensor: how depth is spoilt, None for exact depth.
    camera: as for `sample_scene`. Frames that an interrupted run left are kept, and the result is the same bytes.
    Raises ValueError if `out` holds another dataset, and OSError naming the file if it cannot be written.
    """
    out, seeds = Path(out), [int(seed) for seed in seeds]
    if not seeds:
        raise ValueError("seeds: expected at least one")
    request = _request(seeds, config, size, sensor, camera)
    unfinished = out / ".unfinished"
    if (out / "dataset.json").exists():
        _check_same(out, request, read_description(out))
        shutil.rmtree(unfinished, ignore_errors=True)
        return Dataset(out)
    if (unfinished / "request.json").exists():
        _check_same(out, request, json.loads((unfinished / "request.json").read_bytes()))
    elif out.exists() and any(path.name != ".unfinished" for path in out.iterdir()):
        raise ValueError(f"out: {out} holds other files; choose an empty folder")
    write_atomically(unfinished / "request.json", _json(request))

    missing = [i for i in range(len(seeds)) if not (unfinished / f"{i:06d}.json").exists()]
    bar = tqdm(total=len(seeds), initial=len(seeds) - len(missing), unit="scene", disable=not progress)
    jobs = ((str(out), i, seeds[i], config, tuple(size), sensor, camera) for i in missing)
    with bar:
        for _ in as_they_come(write_frame, jobs, executor):
            bar.update()
    _finish(out, request, [json.loads((unfinished / f"{i:06d}.json").read_bytes()) for i in range(len(seeds))])
    return Dataset(out)


def _request(seeds, config, size, sensor, camera) -> dict:
    """What makes a dataset the one that was asked for; what an older one does not name was None."""
    width, height = size
    require("config", config in CONFIGS, f"one of {sorted(CONFIGS)}", repr(config))
    require("size", min(width, height) >= 1, "width and height of at least 1", size)
    return {
        "version": VERSION,
        "config": config,
        "seeds": seeds,
        "size": [int(width), int(height)],
        "sensor": None if sensor is None else vars(sensor),
        "camera": check_camera(camera) or None,
        "classes": list(CLASSES),
        "families": FAMILY_NUMBER,
    }


def _check_same(out: Path, request: dict, found: dict) -> None:
    differs = [key for key in request if found.get(key) != request[key]]
    if differs:
        raise ValueError(
            f"out: {out} holds a dataset with other {', '.join(differs)}; choose another folder, or remove that one"
        )


def write_frame(out: str, index: int, seed: int, config: str, size, sensor: DepthSensor | None, camera=None) -> None:
    """Render one frame and write its images, then the note that says they are all there."""
    out = Path(out)
    spec = sample_scene(seed, config, camera)
    with World(spec) as world:
        frame = picture_of(world, size)
        poses = world.poses()
    if sensor is not None:
        frame = sensor.apply(frame, np.random.default_rng([seed, 1]))
    images = {
        "rgb": cv2.cvtColor(frame.rgb, cv2.COLOR_RGB2BGR),
        "depth": whole_units(frame.depth, 0.001 * DEPTH_UNIT_MM),
        "labels": frame.labels,
        "instances": frame.instances,
    }
    hashes = {}
    for kind in KINDS:
        data = cv2.imencode(".png", images[kind])[1].tobytes()
        write_atomically(out / kind / f"{index:06d}.png", data)
        hashes[kind] = hashlib.sha256(data).hexdigest()
    note = {"camera": _bop_camera(frame), "gt": _bop_poses(spec, frame, poses), "sha256": hashes}
    write_atomically(out / ".unfinished" / f"{index:06d}.json", _json(note))


def _bop_camera(frame: RGBDFrame) -> dict:
    T_cam_base = np.linalg.inv(frame.T_base_cam)
    return {
        "cam_K": frame.K.ravel().tolist(),
        "depth_scale": DEPTH_UNIT_MM,
        "cam_R_w2c": T_cam_base[:3, :3].ravel().tolist(),
        "cam_t_w2c": (1000.0 * T_cam_base[:3, 3]).tolist(),
        "table_z": 1000.0 * frame.table_z,
    }


def _bop_poses(spec: SceneSpec, frame: RGBDFrame, poses: dict) -> list[dict]:
    T_cam_base = np.linalg.inv(frame.T_base_cam)
    entries = []
    for number, thing in enumerate(spec.objects, start=1):
        T_cam_object = T_cam_base @ poses[thing.name]
        entries.append(
            {
                "cam_R_m2c": T_cam_object[:3, :3].ravel().tolist(),
                "cam_t_m2c": (1000.0 * T_cam_object[:3, 3]).tolist(),
                "obj_id": FAMILY_NUMBER[thing.family],
                "instance": number,
                "name": thing.name,
                "family": thing.family,
                "class": CLASSES[thing.class_id],
            }
        )
    return entries


def _finish(out: Path, request: dict, notes: list[dict]) -> None:
    write_atomically(out / "scene_camera.json", _json({str(i): note["camera"] for i, note in enumerate(notes)}))
    write_atomically(out / "scene_gt.json", _json({str(i): note["gt"] for i, note in enumerate(notes)}))
    files = {f"{kind}/{i:06d}.png": note["sha256"][kind] for i, note in enumerate(notes) for kind in KINDS}
    for name in ("scene_camera.json", "scene_gt.json"):
        files[name] = hashlib.sha256((out / name).read_bytes()).hexdigest()
    write_atomically(out / "dataset.json", _json({**request, "sha256": files}))
    shutil.rmtree(out / ".unfinished")


def _json(value) -> bytes:
    return (json.dumps(value, indent=1) + "\n").encode()


def read_description(path) -> dict:
    """Read dataset.json. Raises FileNotFoundError without one, ValueError if it is damaged or of a newer version."""
    file = Path(path) / "dataset.json"
    if not file.exists():
        state = (
            "was not finished: run the same command again" if (Path(path) / ".unfinished").exists() else "is no dataset"
        )
        raise FileNotFoundError(f"path: {path} {state} ({file.name} is missing)")
    try:
        description = json.loads(file.read_bytes())
        version = description["version"]
    except (ValueError, KeyError, TypeError) as error:
        raise ValueError(f"path: {file} is damaged ({error})") from error
    if version > VERSION:
        raise ValueError(f"path: {path} has dataset version {version}, newer than this kit's {VERSION}: update labkit")
    return description


def verify(path) -> list[str]:
    """Name every file of a dataset that is missing or not as it was written, and why; an empty list is good news."""
    path = Path(path)
    problems = []
    for name, digest in read_description(path)["sha256"].items():
        file = path / name
        if not file.is_file():
            problems.append(f"{name}: missing")
        elif hashlib.sha256(file.read_bytes()).hexdigest() != digest:
            problems.append(f"{name}: damaged")
    return problems


class Dataset(Sequence):
    """A dataset on disk as a sequence of RGBDFrame, read when asked for; a slice gives a list.

    `description` is dataset.json. Raises FileNotFoundError or ValueError as `read_description` does.
    """

    def __init__(self, path):
        self.path = Path(path)
        self.description = read_description(path)
        self._cameras = json.loads((self.path / "scene_camera.json").read_bytes())

    def __repr__(self) -> str:
        width, height = self.description["size"]
        return f"Dataset({self.path}, {len(self)} frames of {self.description['config']}, {width} x {height})"

    def __len__(self) -> int:
        return len(self.description["seeds"])

    def __getitem__(self, index):
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        i = range(len(self))[index]
        camera = self._cameras[str(i)]
        T_cam_base = np.eye(4)
        T_cam_base[:3, :3] = np.reshape(camera["cam_R_w2c"], (3, 3))
        T_cam_base[:3, 3] = np.array(camera["cam_t_w2c"]) / 1000.0
        return RGBDFrame.from_files(
            **{kind: self.path / kind / f"{i:06d}.png" for kind in KINDS},
            K=np.reshape(camera["cam_K"], (3, 3)),
            T_base_cam=np.linalg.inv(T_cam_base),
            depth_scale=camera["depth_scale"] / 1000.0,
            table_z=camera["table_z"] / 1000.0 if "table_z" in camera else None,  # older datasets do not say
        )

    def objects(self, index: int) -> list[dict]:
        """The objects of a frame as scene_gt.json has them (poses in the camera frame, millimetres)."""
        if not hasattr(self, "_objects"):
            self._objects = json.loads((self.path / "scene_gt.json").read_bytes())
        return self._objects[str(range(len(self))[index])]


def load(path) -> Dataset:
    """Open a dataset: a sequence of RGBDFrame. Raises FileNotFoundError without one, ValueError if it is too new."""
    return Dataset(path)


class Joined(Sequence):
    """Several datasets as one sequence of frames, the first `each` of every one (all of them if None), read when asked.

    >>> Joined([[1, 2, 3], [4, 5]], each=2)[2:]
    [4, 5]
    """

    def __init__(self, datasets: Sequence[Sequence], each: int | None = None):
        self.places = [(dataset, i) for dataset in datasets for i in range(len(dataset))[:each]]

    def __len__(self) -> int:
        return len(self.places)

    def __getitem__(self, index):
        if isinstance(index, slice):
            return [dataset[i] for dataset, i in self.places[index]]
        dataset, i = self.places[index]
        return dataset[i]
