"""From file to grasp in one command: one simulated scene, written as each camera, app and program writes it.

The simulator is the judge: it knows where the box stands. tests/labcli/test_pictures.py has the details of each kind.
"""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image
from scenes import box, scene
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

from labcli.cli import app
from labkit.geometry import invert_transform
from labkit.sim.world import World

PLACE, SIDES = (0.5, 0.08), (0.05, 0.05, 0.08)  # metres, of the box in the base frame


@pytest.fixture(scope="module")
def frame():
    with World(scene(box("a", *PLACE, SIDES))) as world:
        return world.render((640, 480))


def numbers(K):
    return dict(zip(("fx", "fy", "cx", "cy"), K[[0, 1, 0, 1], [0, 1, 2, 2]].tolist(), strict=True))


def text(matrix, separator=" "):
    return "\n".join(separator.join(map(str, row)) for row in np.asarray(matrix).tolist())


def halves(K):
    return {name: value + 0.5 * (name in ("cx", "cy")) for name, value in numbers(K).items()}


SIZE = {"width": 640, "height": 480}
CAMERAS = {  # the file's name and content, of a K for pictures of 640 x 480
    "librealsense": (
        "rs.json",
        lambda K: json.dumps(
            {"fx": K[0, 0], "fy": K[1, 1], "ppx": K[0, 2], "ppy": K[1, 2], "coeffs": [0] * 5, "model": "brown_conrady"}
        ),
    ),
    "ROS": (
        "info.yaml",
        lambda K: (
            f"height: 480\nwidth: 640\ndistortion_model: plumb_bob\nd: [0, 0, 0, 0, 0]\nk: {K.ravel().tolist()}\n---\n"
        ),
    ),
    "OpenCV": (
        "camera.yml",
        lambda K: (
            "%YAML:1.0\n---\ncameraMatrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
            f"   data: {K.ravel().tolist()}\n"
        ),
    ),
    "BOP": ("scene_camera.json", lambda K: json.dumps({"0": {"cam_K": K.ravel().tolist(), "depth_scale": 1.0}})),
    "Open3D": ("o3d.json", lambda K: json.dumps({"intrinsic_matrix": K.T.ravel().tolist(), **SIZE})),
    "Kalibr": (
        "camchain.yaml",
        lambda K: f"cam0:\n  camera_model: pinhole\n  intrinsics: {[*numbers(K).values()]}\n  resolution: [640, 480]\n",
    ),
    "COLMAP": ("cameras.txt", lambda K: f"1 PINHOLE 640 480 {' '.join(map(str, halves(K).values()))}\n"),
    "NeRF": (
        "transforms.json",
        lambda K: json.dumps(
            {"w": 640, "h": 480, "fl_x": K[0, 0], "fl_y": K[1, 1], "cx": K[0, 2] + 0.5, "cy": K[1, 2] + 0.5}
        ),
    ),
    "ORB-SLAM": ("slam.yaml", lambda K: "%YAML:1.0\n" + "\n".join(f"Camera.{k}: {v}" for k, v in numbers(K).items())),
    "labkit calibrate": ("camera.json", lambda K: json.dumps(numbers(K) | SIZE | {"exif_orientation": 1})),
    "a matrix": ("K.txt", text),
}
DEPTHS = {
    "millimetres": ("depth.png", lambda path, d: cv2.imwrite(path, np.rint(1000.0 * d).astype(np.uint16))),
    "TIFF": ("depth.tiff", lambda path, d: cv2.imwrite(path, d)),
    "PFM": ("depth.pfm", lambda path, d: cv2.imwrite(path, d)),
    "NPY": ("depth.npy", lambda path, d: np.save(path, np.where(d > 0.0, d, np.nan))),
    "NPZ": ("depth.npz", lambda path, d: np.savez(path, depth=d)),
    "EXR": ("depth.exr", lambda path, d: write_exr(path, d)),
}


def write_exr(path, depth):
    import OpenEXR

    facts = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(facts, {"Z": np.ascontiguousarray(depth)}).write(path)


def ros_pose(T):
    x, y, z, w = Rotation.from_matrix(T[:3, :3]).as_quat().tolist()
    position, orientation = dict(zip("xyz", T[:3, 3].tolist(), strict=True)), {"x": x, "y": y, "z": z, "w": w}
    return json.dumps({"pose": {"position": position, "orientation": orientation}})


POSES = {
    "numbers": lambda T: " ".join(map(str, [*T[:3, 3], *Rotation.from_matrix(T[:3, :3]).as_quat()])),
    "4x4": ("pose.txt", text),
    "3x4, the other way": ("other.txt", lambda T: text(invert_transform(T)[:3])),
    "ROS": ("pose.json", ros_pose),
}
PHONES = {
    "Stray Scanner": ("camera_matrix.csv", lambda K: text(K, ",")),
    "Record3D": ("metadata.json", lambda K: json.dumps({"K": K.T.ravel().tolist(), "w": 1920, "h": 1440})),
    "Polycam": (
        "1.json",
        lambda K: json.dumps(
            numbers(K)
            | {"width": 1920, "height": 1440}
            | {f"t_{i}{j}": float(i == j) for i in range(3) for j in range(4)}
        ),
    ),
}


def write(folder: Path, frame, camera=CAMERAS["a matrix"], depth=DEPTHS["millimetres"], pose=None) -> list[str]:
    """The scene's files, and the command's words for them."""
    cv2.imwrite(str(folder / "0.png"), frame.rgb[..., ::-1])
    cv2.imwrite(str(folder / "mask.png"), np.where(frame.instances > 0, 255, 0).astype(np.uint8))
    (folder / camera[0]).write_text(camera[1](frame.K))
    depth[1](str(folder / depth[0]), frame.depth)
    words = [str(folder / "0.png"), str(folder / depth[0]), "--intrinsics", str(folder / camera[0])]
    if callable(pose):
        words += ["--camera-pose", pose(frame.T_base_cam)]
    elif pose is not None:
        (folder / pose[0]).write_text(pose[1](frame.T_base_cam))
        words += ["--camera-pose", str(folder / pose[0])]
    return words


def check(folder: Path, words: list[str], T_base_cam, posed: bool = False) -> None:
    """The best grasp closes on the box: there where the simulator put it, seen from the true camera."""
    words = ["perceive", *words, "--mask", str(folder / "mask.png"), "--out", str(folder / "out")]
    done = CliRunner().invoke(app, words)
    if done.exception is not None:
        raise done.exception
    assert "best grasp: target 1" in done.output
    best = json.loads((folder / "out" / "grasps.json").read_text())["grasps"][0]
    place = (T_base_cam @ np.array(best["T_cam_grasp"]))[:3, 3]
    assert np.linalg.norm(place[:2] - PLACE) < 0.025 and 0.0 < place[2] < SIDES[2] + 0.02
    assert not posed or np.allclose(np.array(best["T_base_grasp"])[:3, 3], place, atol=1e-4)


NIGHTLY = pytest.mark.nightly


@pytest.mark.parametrize("name", [pytest.param(name, marks=[NIGHTLY] * (name != "ROS")) for name in CAMERAS])
def test_a_camera_of_each_kind(name, frame, tmp_path):
    check(tmp_path, write(tmp_path, frame, camera=CAMERAS[name]), frame.T_base_cam)


@NIGHTLY
@pytest.mark.parametrize("name", DEPTHS)
def test_depth_of_each_kind(name, frame, tmp_path):
    check(tmp_path, write(tmp_path, frame, depth=DEPTHS[name]), frame.T_base_cam)


@NIGHTLY
@pytest.mark.parametrize("name", POSES)
def test_a_pose_of_each_kind(name, frame, tmp_path):
    check(tmp_path, write(tmp_path, frame, pose=POSES[name]), frame.T_base_cam, posed=True)


@NIGHTLY
@pytest.mark.parametrize("name", PHONES)
def test_a_phone_of_each_kind(name, frame, tmp_path):
    """Colour 1920 x 1440, depth 256 x 192, K of the colours."""
    words = write(tmp_path, frame)
    for picture in ("0.png", "mask.png"):
        image = cv2.imread(str(tmp_path / picture), cv2.IMREAD_UNCHANGED)
        cv2.imwrite(str(tmp_path / picture), cv2.resize(image, (1920, 1440), interpolation=cv2.INTER_NEAREST))
    small = cv2.resize(frame.depth, (256, 192), interpolation=cv2.INTER_NEAREST_EXACT)
    file, content = PHONES[name]
    if name == "Record3D":
        write_exr(str(tmp_path / "depth.exr"), small)
        words[1] = str(tmp_path / "depth.exr")
    else:
        DEPTHS["millimetres"][1](str(tmp_path / "depth.png"), small)
    K = frame.K.copy()
    K[:2, 2] += 0.5
    K[:2] *= 3.0
    K[:2, 2] -= 0.5
    (tmp_path / file).write_text(content(K))
    check(tmp_path, [*words[:3], str(tmp_path / file)], frame.T_base_cam)


def test_a_phone_that_was_held_upright(frame, tmp_path):
    """The sensor's picture with EXIF 6, and the camera that `labkit calibrate` finds of such photographs."""
    words, note, K = write(tmp_path, frame), Image.Exif(), frame.K
    note[0x0112] = 6
    Image.fromarray(frame.rgb).save(tmp_path / "0.jpg", exif=note, quality=95)
    facts = {"fx": K[1, 1], "fy": K[0, 0], "cx": 479.0 - K[1, 2], "cy": K[0, 2], "width": 480, "height": 640}
    (tmp_path / "camera.json").write_text(json.dumps(facts | {"exif_orientation": 6}))
    turn = np.eye(4)
    turn[:2, :2] = [[0.0, 1.0], [-1.0, 0.0]]  # from the camera held upright to the sensor's
    words = [str(tmp_path / "0.jpg"), words[1], "--intrinsics", str(tmp_path / "camera.json")]
    check(tmp_path, words, frame.T_base_cam @ turn)
