"""A camera as its user knows it: a matrix K in a file of any usual kind, a lens to undo, a pose in words (topic 06)."""

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from labkit.node.convert import rigid
from labkit.support.validation import require

OPENCV = re.compile(r"^%YAML:1\.0|!!opencv-matrix", re.MULTILINE)  # what OpenCV writes and YAML does not know


def numbers_of(text: str) -> list[float]:
    """The numbers of a text that holds nothing else; none if it does.

    >>> numbers_of("[1, 2.5; 3]"), numbers_of("camera.json")
    ([1.0, 2.5, 3.0], [])
    """
    try:
        return [float(word) for word in re.split(r"[\s,;]+", text.strip(" \t\r\n[]"))]
    except ValueError:
        return []


def read_pose(text: str) -> Float[np.ndarray, "4 4"]:
    """Read a camera's pose in the base frame, "x y z qx qy qz qw"; raises ValueError for anything else.

    >>> read_pose("0.5 0 0.8 1 0 0 0")[:3, 3].tolist()
    [0.5, 0.0, 0.8]
    """
    numbers = numbers_of(text)
    require("camera_pose", len(numbers) == 7, "seven numbers, x y z qx qy qz qw", repr(text))
    return rigid(numbers[:3], numbers[3:])


@dataclass(frozen=True, eq=False)
class Intrinsics:
    """A camera's matrix K, (3, 3), and if the file says them its depth unit in metres, size and lens coefficients.

    size: width and height of the pictures that it is the camera of.
    """

    K: Float[np.ndarray, "3 3"]
    depth_scale: float | None = None
    size: tuple[int, int] | None = None
    distortion: tuple[float, ...] = ()


def read_intrinsics(text: str) -> Intrinsics:
    """Read a camera matrix: "fx fy cx cy" itself, or a file of one of the usual kinds.

    JSON of librealsense (fx, fy, ppx, ppy), of BOP (fx, fy, cx, cy, or cam_K of scene_camera.json, whose first camera
    counts; depth_scale in millimetres), of Open3D (intrinsic_matrix, column by column); the YAML of ROS or OpenCV
    (camera_matrix); or a text file of four or nine numbers. Raises ValueError if there is none of these,
    FileNotFoundError for a missing file. Topic 06.

    >>> read_intrinsics("600 601 320 240").K.tolist()
    [[600.0, 0.0, 320.0], [0.0, 601.0, 240.0], [0.0, 0.0, 1.0]]
    """
    numbers = numbers_of(text)
    if len(numbers) in (4, 9):
        return Intrinsics(_matrix(numbers))
    path = Path(text)
    if not path.is_file():
        raise FileNotFoundError(f'intrinsics: expected "fx fy cx cy" or a file, got {text!r}')
    content = path.read_text(encoding="utf-8", errors="replace")
    if len(numbers := numbers_of(content)) in (4, 9):
        return Intrinsics(_matrix(numbers))
    try:
        facts = _parsed(content)
        camera = _camera(facts)
    except (YAMLError, AttributeError, KeyError, TypeError, ValueError):
        raise ValueError(
            f"intrinsics: found no camera matrix in {path}; expected fx, fy, cx, cy (or ppx, ppy), cam_K, "
            "intrinsic_matrix, camera_matrix, or four or nine numbers"
        ) from None
    return replace(camera, distortion=_lens(camera.distortion, facts.get("model", facts.get("distortion_model", ""))))


def _parsed(content: str) -> dict:
    try:
        return json.loads(content)
    except json.JSONDecodeError:
        return YAML(typ="safe").load(OPENCV.sub("", content))


def _matrix(numbers: Sequence) -> Float[np.ndarray, "3 3"]:
    if len(numbers) == 9:
        return np.array(numbers, float).reshape(3, 3)
    fx, fy, cx, cy = map(float, numbers)
    return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])


def _camera(facts: dict) -> Intrinsics:
    """The camera that a file tells of; of several frames (BOP) the first one's."""
    match facts:
        case {"cam_K": K} | {"camera_matrix": {"data": K}}:
            K = _matrix(K)
        case {"intrinsic_matrix": columns}:
            K = _matrix(columns).T
        case {"fx": fx, "fy": fy, "cx": cx, "cy": cy} | {"fx": fx, "fy": fy, "ppx": cx, "ppy": cy}:
            K = _matrix((fx, fy, cx, cy))
        case _:
            first = min(facts, key=lambda name: (len(name), name))
            return _camera(facts[first])
    scale = facts.get("depth_scale")
    sides = [facts.get(name, facts.get(f"image_{name}")) for name in ("width", "height")]
    lens = facts.get("coeffs", facts.get("distortion_coefficients", {}).get("data", ()))
    return Intrinsics(
        K,
        depth_scale=None if scale is None else 0.001 * float(scale),  # BOP says it in millimetres
        size=None if None in sides else tuple(map(int, sides)),
        distortion=tuple(map(float, lens)),
    )


def _lens(coefficients: tuple[float, ...], model: str) -> tuple[float, ...]:
    """Coefficients that `rectify` can undo; of a lens that does nothing, none."""
    if not any(coefficients):
        return ()
    known = not re.search("inverse|equidistant|fisheye|kannala|theta", model, re.IGNORECASE)
    require(
        "intrinsics",
        known and len(coefficients) in (4, 5, 8, 12, 14),
        "a lens of 4, 5, 8, 12 or 14 coefficients k1, k2, p1, p2, ... (plumb_bob)",
        f"{len(coefficients)} of {model or 'no named model'}; rectify the pictures first",
    )
    return coefficients


def rectify(image: np.ndarray, camera: Intrinsics, smooth: bool = False, outside: int = 0) -> np.ndarray:
    """Undo the camera's lens: the picture, (H, W) or (H, W, 3), that a pinhole with the same K would have taken.

    smooth: mix neighbours, for colours; depth and labels take the nearest pixel. outside: what stands where the lens
    saw nothing. A picture of a lens without distortion is given back as it is. Topic 06.
    """
    if not camera.distortion:
        return image
    lens, size = np.array(camera.distortion), image.shape[1::-1]
    maps = cv2.initUndistortRectifyMap(camera.K, lens, None, camera.K, size, cv2.CV_32FC1)
    return cv2.remap(image, *maps, cv2.INTER_LINEAR if smooth else cv2.INTER_NEAREST, borderValue=(outside,) * 3)
