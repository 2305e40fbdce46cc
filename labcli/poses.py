"""Where a camera stands, as people write it down: seven numbers, a matrix, a file; and which of the two ways it maps.

Topic 06.
"""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from labcli.arrays import read_npy
from labcli.documents import flat_numbers, number_of, numbers_of, parsed, text_of
from labkit.frame import RGBDFrame
from labkit.geometry import back_project, find_tables, invert_transform, nearest_rotation
from labkit.node.convert import rigid
from labkit.support.validation import check_T, require

ROUNDED = 2e-3  # largest entry of abs(R R^T - I) that three decimals leave
LEVEL = np.cos(np.radians(10.0))  # of a table's normal in the base frame
FROM_OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])  # camera: x right, y up, z backwards
Z_UP = np.array([[1.0, 0, 0, 0], [0, 0, -1.0, 0], [0, 1.0, 0, 0], [0, 0, 0, 1.0]])  # ARKit's world has y up
OPENGL = "camera_pose: the file's camera has OpenGL's axes (y up, z backwards); they are turned to x right, y down"
EXPECTED = '"x y z qx qy qz qw", a matrix of 4x4 or 3x4, or a file of one (text, NPY, JSON)'
ASK = "write T_base_cam=FILE if it maps the camera's coordinates to the base's, T_cam_base=FILE if the other way"


@dataclass(frozen=True, eq=False)
class Pose:
    """A rigid transform that says where a camera stands; way: "T_base_cam", "T_cam_base", or "" if nobody says."""

    T: Float[np.ndarray, "4 4"]
    way: str = ""
    said: tuple[str, ...] = ()

    def in_base(self, frame: RGBDFrame | None = None) -> tuple[Float[np.ndarray, "4 4"], tuple[str, ...]]:
        """T_base_cam, and what is to be said; where nobody says which way T maps, what a frame's depth tells.

        Of T and its inverse only one may put the table that depth shows level, and below the camera; if both do or
        none, ValueError asks.
        """
        if self.way:
            return (self.T if self.way == "T_base_cam" else invert_transform(self.T)), self.said
        tables = () if frame is None else find_tables(back_project(frame.depth, frame.K))
        if not tables:
            raise ValueError(f"camera_pose: expected to know which way the matrix maps, and no table tells; {ASK}")
        ways = {"T_base_cam": self.T, "T_cam_base": invert_transform(self.T)}
        rises = {way: float(T[2, :3] @ tables[0].plane.normal) for way, T in ways.items()}
        fitting = [way for way, rise in rises.items() if rise > LEVEL]
        if len(fitting) != 1:
            leans = " and ".join(f"{np.degrees(np.arccos(np.clip(rise, -1, 1))):.0f}" for rise in rises.values())
            which = "both ways" if fitting else "neither way"
            raise ValueError(
                f"camera_pose: expected a matrix that puts the table level and below the camera one way alone, got one "
                f"that does {which} (it leans by {leans} degrees as T_base_cam and as T_cam_base); {ASK}"
            )
        said = f"camera_pose: the matrix is taken for {fitting[0]}, which puts the table below the camera"
        return ways[fitting[0]], (said, *self.said)


def read_pose(text: str, picture=None) -> Pose:
    """Read where a camera stands in the base frame: "x y z qx qy qz qw", a matrix, or a file of one.

    A matrix is 4x4 or 3x4, as text, NPY or JSON, with T_base_cam= or T_cam_base= before it if the user knows which.
    picture: whose pose it is, where a file has several (transforms.json). A rotation that is off by rounding, up to
    2e-3, becomes the nearest one, which is said. Raises ValueError for anything else.

    >>> read_pose("0.5 0 0.8 1 0 0 0").T[:3, 3].tolist()
    [0.5, 0.0, 0.8]
    """
    named = re.match(r"\s*(T_base_cam|T_cam_base)\s*=", text)
    way, text = (named[1], text[named.end() :].strip()) if named else ("", text)
    if len(numbers := numbers_of(text)) in (7, 12, 16):
        return _pose(numbers, way)
    path = Path(text)
    if len(text) > 4000 or not path.is_file():
        raise ValueError(f"camera_pose: expected {EXPECTED}, got {text[:200]!r}")
    if path.suffix == ".npy":
        return _pose(read_npy("camera_pose", path.read_bytes(), path).ravel()[:17].tolist(), way)
    content = text_of("camera_pose", path)
    if len(numbers := numbers_of(content)) in (7, 12, 16):
        return _pose(numbers, way)
    facts = parsed("camera_pose", content)
    pose = _of_facts(facts, way, None if picture is None else Path(picture).stem)
    if pose is None:
        raise ValueError(f"camera_pose: expected {EXPECTED}, got none in {path}")
    return pose


def _pose(numbers, way: str, said: tuple[str, ...] = ()) -> Pose:
    if len(numbers) == 7:
        return Pose(rigid(numbers[:3], numbers[3:]), way or "T_base_cam", said)
    require("camera_pose", len(numbers) in (12, 16), EXPECTED, f"{len(numbers)} numbers")
    T = np.vstack([np.reshape(numbers, (-1, 4))[:3], [0.0, 0.0, 0.0, 1.0]])
    if len(numbers) == 16:
        T[3] = numbers[12:]
    R = T[:3, :3]
    off = np.abs(R @ R.T - np.eye(3)).max()
    if 1e-6 < off <= ROUNDED and np.linalg.det(R) > 0.0:
        T[:3, :3] = nearest_rotation(R)
        if off > 1e-4:
            said += (
                f"camera_pose: R R^T is off the identity by {off:.2g}, as of rounding: the nearest rotation is taken",
            )
    return Pose(check_T("camera_pose", T), way, said)


def _of_facts(facts, way: str, picture: str | None) -> Pose | None:
    """The pose that a JSON or YAML file says."""
    if not isinstance(facts, dict):
        numbers = flat_numbers(facts)
        return _pose(numbers, way) if numbers else None
    for name in ("T_base_cam", "T_cam_base"):
        if name in facts:
            return _pose(_numbers(facts[name]), name)
    if isinstance(facts.get("frames"), list):  # NeRF's transforms.json
        frames = {Path(str(frame.get("file_path", ""))).stem: frame for frame in facts["frames"]}
        require("camera_pose", picture in frames, f"a frame of the picture {picture!r}", ", ".join(list(frames)[:8]))
        return _of_facts(frames[picture], way, None)
    if "transform_matrix" in facts:
        pose = _pose(_numbers(facts["transform_matrix"]), way)
        return Pose(pose.T @ FROM_OPENGL, "T_base_cam", (OPENGL, *pose.said))
    if "t_00" in facts:  # Polycam's
        pose = _pose([_number(facts.get(f"t_{row}{column}")) for row in range(3) for column in range(4)], way)
        return Pose(Z_UP @ pose.T @ FROM_OPENGL, "T_base_cam", (OPENGL, *pose.said))
    if "cam_R_w2c" in facts:  # BOP's, whose world the base frame is then; millimetres
        R, t = np.reshape(_numbers(facts["cam_R_w2c"]), (3, 3)), np.array(_numbers(facts.get("cam_t_w2c")))
        return _pose(np.column_stack([R, 0.001 * t]).ravel().tolist(), "T_cam_base")
    if facts and all(name.isdigit() for name in facts) and picture is not None:  # a frame each
        own = next((value for name, value in facts.items() if picture.isdigit() and int(name) == int(picture)), None)
        require("camera_pose", own is not None, f"a frame of the picture {picture!r}", ", ".join(list(facts)[:8]))
        return _of_facts(own, way, None)
    for place, turn in (("position", "orientation"), ("translation", "rotation")):
        if isinstance(facts.get(place), dict) and isinstance(facts.get(turn), dict):
            numbers = [_number(facts[place].get(axis)) for axis in "xyz"]
            numbers += [_number(facts[turn].get(axis)) for axis in "xyzw"]
            return _pose(numbers, way)
    inner = [value for value in facts.values() if isinstance(value, dict | list) and value]
    found = [pose for value in inner if (pose := _of_facts(value, way, picture)) is not None] if len(inner) < 20 else []
    return found[0] if len(found) == 1 else None


def _numbers(value) -> list[float]:
    numbers = flat_numbers(value)
    require("camera_pose", numbers, "a matrix of finite numbers", lambda: repr(value)[:60])
    return numbers


def _number(value) -> float:
    number = number_of(value)
    require("camera_pose", number is not None, "finite numbers", lambda: repr(value)[:60])
    return number
