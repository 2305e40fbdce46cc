"""A camera as the programs of this field write it down: a function per format, from what a file says to a camera.

Each takes a dict and gives the camera that it is of, or None if it is of another format. A lens that is no pinhole's is
refused by name, and so is what a file says of a lens that nobody could follow.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from labcli.documents import flat_numbers, number_of
from labkit.geometry.lens import COUNTS, Lens
from labkit.support.validation import require

OPENGL = (
    "intrinsics: the poses beside it have OpenGL's axes (y up, z backwards) and are not used; --camera-pose takes them"
)


@dataclass(frozen=True, eq=False)
class Intrinsics:
    """A camera's matrix K, (3, 3), and if the file says them a number for depth's unit, size and lens.

    depth_scale: as the file says it (`labkit.geometry.depth_units`). size: width and height of the pictures that it is
    the camera of. same_view: depth of another size is of the same view, as an app on a phone writes it. said: what is
    to be said of the file. orientation: EXIF's number that pictures were turned by before they had this K, as `labkit
    calibrate` writes it.
    """

    K: Float[np.ndarray, "3 3"]
    depth_scale: float | None = None
    size: tuple[int, int] | None = None
    lens: Lens | None = None
    same_view: bool = False
    said: tuple[str, ...] = ()
    orientation: int = 1

    @property
    def distortion(self) -> tuple[float, ...]:
        """The lens's coefficients, none if it does nothing."""
        return self.lens.coefficients if self.lens else ()


def matrix_of(numbers: Sequence[int | float] | None) -> Float[np.ndarray, "3 3"] | None:
    """K of fx, fy, cx, cy, or of a matrix row by row, 3x3, 3x4 or 4x4 with nothing else in it; None of others.

    >>> matrix_of([8, 0, 4, 0, 0, 9, 3, 0, 0, 0, 1, 0, 0, 0, 0, 1]).tolist()
    [[8.0, 0.0, 4.0], [0.0, 9.0, 3.0], [0.0, 0.0, 1.0]]
    """
    match len(numbers or ()):
        case 4:
            fx, fy, cx, cy = numbers
            return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
        case 9:
            return np.array(numbers, float).reshape(3, 3)
        case 12 | 16 as count:
            matrix = np.array(numbers, float).reshape(-1, 4)
            return matrix[:3, :3] if np.array_equal(matrix[:, 3], [0, 0, 0, 1][: count // 4]) else None
    return None


# ---------------------------------------------------------------------------------------- a function per format


def of_colmap(facts: dict) -> Intrinsics | None:
    """COLMAP's cameras.txt, a line of it: model, size and parameters; its pixel centres lie at halves."""
    if "colmap" not in facts:
        return None
    require_pinhole(facts["colmap"])
    names = COLMAP.get(facts["colmap"], "").split()
    require("intrinsics", names, f"a model of {', '.join(COLMAP)}", facts["colmap"])
    require("intrinsics", len(names) == len(facts["parameters"]), f"{len(names)} parameters", len(facts["parameters"]))
    by_name = dict(zip(names, facts["parameters"], strict=True))
    focal = {"fx": by_name["f"], "fy": by_name["f"]} if "f" in by_name else {}
    return _camera({**by_name, **focal, "width": facts["width"], "height": facts["height"]}, HALF_PIXEL)


COLMAP = {
    "SIMPLE_PINHOLE": "f cx cy",
    "PINHOLE": "fx fy cx cy",
    "SIMPLE_RADIAL": "f cx cy k1",
    "RADIAL": "f cx cy k1 k2",
    "OPENCV": "fx fy cx cy k1 k2 p1 p2",
    "FULL_OPENCV": "fx fy cx cy k1 k2 p1 p2 k3 k4 k5 k6",
}
HALF_PIXEL = 0.5  # what such files have more for the middle of the first pixel, which is 0 here


def of_nerf(facts: dict) -> Intrinsics | None:
    """NeRF's transforms.json: fl_x, fl_y, cx, cy, w, h and k1 ..., or the angle of view alone."""
    if "camera_angle_x" in facts and "fl_x" not in facts:
        size, angle = size_of(facts), number_of(facts["camera_angle_x"])
        require("intrinsics", size, "w and h beside camera_angle_x", "none: add them to the file")
        require("intrinsics", angle and 0.0 < angle < np.pi, "camera_angle_x in radians", facts["camera_angle_x"])
        f, (w, h) = 0.5 * size[0] / np.tan(0.5 * angle), size
        facts = facts | {"fl_x": f, "fl_y": f, "cx": 0.5 * w, "cy": 0.5 * h}
    if "fl_x" not in facts:
        return None
    names = {"fx": "fl_x", "fy": "fl_y" if "fl_y" in facts else "fl_x"}
    said = (OPENGL,) if "frames" in facts or "transform_matrix" in facts else ()
    return _camera(facts | {name: facts[other] for name, other in names.items()}, HALF_PIXEL, said=said)


def of_record3d(facts: dict) -> Intrinsics | None:
    """Record3D's metadata: K by columns, with the size w, h of its pictures."""
    numbers = flat_numbers(facts.get("K"))
    by_columns = numbers is not None and len(numbers) == 9 and numbers[2] == numbers[5] == 0.0 and any(numbers[6:8])
    if not (by_columns and {"w", "h"} <= facts.keys()):
        return None
    return _camera(facts | {"K": np.reshape(numbers, (3, 3)).T.tolist()}, same_view=True)


def of_polycam(facts: dict) -> Intrinsics | None:
    """Polycam's JSON of a keyframe: fx, fy, cx, cy, width, height and a pose t_00 to t_23."""
    if not {"fx", "t_00", "t_23"} <= facts.keys():
        return None
    return _camera(facts, same_view=True, said=(OPENGL,))


def of_open3d(facts: dict) -> Intrinsics | None:
    """Open3D's PinholeCameraIntrinsic: intrinsic_matrix, nine numbers by columns."""
    columns = facts.get("intrinsic_matrix")
    numbers = flat_numbers(columns)
    if numbers is None or len(numbers) != 9 or isinstance(columns[0], list):
        return None
    return _camera(facts | {"K": np.reshape(numbers, (3, 3)).T.tolist()})


def of_ros(facts: dict) -> Intrinsics | None:
    """A CameraInfo of ROS 2 or ROS 1, as `topic echo` prints it: k or K, d or D, width, height."""
    if ("binning_x" not in facts and "distortion_model" not in facts) or not {"k", "K"} & facts.keys():
        return None
    binned = [facts.get(f"binning_{axis}") for axis in "xy"]
    require("intrinsics", all(n in (None, 0, 1) for n in binned), "a camera that bins no pixels", f"binning {binned}")
    region = facts.get("roi") if isinstance(facts.get("roi"), dict) else {}
    offsets = [region.get(f"{axis}_offset", 0) for axis in "xy"]
    require("intrinsics", not any(offsets), "a camera of the whole picture", f"a region that begins at {offsets}")
    return _camera(facts | {"K": facts.get("k", facts.get("K"))})


def of_kalibr(facts: dict) -> Intrinsics | None:
    """A camera of Kalibr's camchain: intrinsics, resolution, distortion_coeffs, and what kinds these are."""
    if not {"camera_model", "intrinsics"} <= facts.keys():
        return None
    require_pinhole(facts["camera_model"])
    return _camera(facts | {"K": facts["intrinsics"]})


def of_orb_slam(facts: dict) -> Intrinsics | None:
    """The settings of ORB-SLAM: Camera.fx ..., DepthMapFactor."""
    own = {name.partition(".")[2]: facts[name] for name in facts if re.match(r"Camera1?\.", name)}
    return _camera(own | {"depth_scale": facts.get("DepthMapFactor")}) if "fx" in own else None


def of_matrix(facts: dict) -> Intrinsics | None:
    """A matrix under one of the usual names: OpenCV, BOP (cam_K), ROS's camera_info; as numbers, lists, or data."""
    named = [name for name in MATRICES if matrix_of(flat_numbers(facts.get(name))) is not None]
    return _camera(facts | {"K": facts[named[0]]}) if named else None


MATRICES = ("cam_K", "K", "camera_matrix", "cameraMatrix", "Camera_Matrix", "intrinsic_matrix", "intrinsics")
MATRICES += ("intrinsic", "M", "mtx")


def of_numbers(facts: dict) -> Intrinsics | None:
    """fx, fy and cx, cy, or librealsense's ppx, ppy."""
    centre = next((pair for pair in (("cx", "cy"), ("ppx", "ppy")) if {*pair} <= facts.keys()), None)
    if centre is None or not {"fx", "fy"} <= facts.keys():
        return None
    return _camera(facts | {"cx": facts[centre[0]], "cy": facts[centre[1]]})


READERS: dict[str, Callable[[dict], Intrinsics | None]] = {
    "COLMAP": of_colmap,
    "NeRF": of_nerf,
    "Record3D": of_record3d,
    "Polycam": of_polycam,
    "Open3D": of_open3d,
    "ROS": of_ros,
    "Kalibr": of_kalibr,
    "ORB-SLAM": of_orb_slam,
    "a matrix": of_matrix,
    "numbers": of_numbers,
}


def camera_of(facts: dict) -> Intrinsics | None:
    """The camera that a dict is of, None if it is of none; raises ValueError for one that cannot be followed."""
    return next((camera for read in READERS.values() if (camera := read(facts)) is not None), None)


# ---------------------------------------------------------------------------------------------- what they share


def _camera(facts: dict, offset: float = 0.0, same_view: bool = False, said: tuple[str, ...] = ()) -> Intrinsics:
    """The camera of facts whose K stands under "K", or as fx, fy, cx, cy."""
    K = matrix_of(flat_numbers(facts.get("K")))
    if K is None:
        numbers = [number_of(facts.get(name)) for name in ("fx", "fy", "cx", "cy")]
        K = None if None in numbers else matrix_of(numbers)
    require("intrinsics", K is not None, "a camera matrix of finite numbers", "others")
    K[:2, 2] -= offset
    scales = [facts[name] for name in DEPTH_SCALES if facts.get(name) is not None]
    scale = number_of(scales[0]) if scales else None
    require("intrinsics", not scales or scale, "depth_scale as a number", lambda: repr(scales[0])[:60])
    turned = facts.get("exif_orientation", 1)
    require("intrinsics", turned in range(1, 9), "exif_orientation from 1 to 8", lambda: repr(turned)[:60])
    return Intrinsics(K, scale, size_of(facts), lens_of(facts), same_view, said, int(turned))


DEPTH_SCALES = ("depth_scale", "depthScale", "png_depth_scale", "depth_factor", "DepthMapFactor")
SIDES = (("width", "height"), ("image_width", "image_height"), ("w", "h"))
SIZES = ("resolution", "image_size", "imageSize")


def size_of(facts: dict) -> tuple[int, int] | None:
    """Width and height of the pictures, if the facts say them."""
    pairs = [[facts[side] for side in sides] for sides in SIDES if {*sides} <= facts.keys()]
    pairs += [facts[name] for name in SIZES if isinstance(facts.get(name), list) and len(facts[name]) == 2]
    if not pairs:
        return None
    sides = [number_of(side) for side in pairs[0]]
    whole = all(side is not None and 1 <= side <= 100_000 and side == int(side) for side in sides)
    require("intrinsics", whole, "width and height in pixels", lambda: repr(pairs[0])[:60])
    return int(sides[0]), int(sides[1])


NO_PINHOLE = r"fisheye|equidistant|kannala|theta|fov|omni|double.?sphere|^ds$|^e?ucm|thin.?prism|spheric|equirect"
COEFFICIENTS = re.compile(r"^(d|coeffs|dist|dist_?coeff.*|.*distortion.*)$", re.IGNORECASE)
BY_NAME = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
MODELS = ("model", "distortion_model", "camera_model", "lens_model")


def lens_of(facts: dict) -> Lens | None:
    """The lens that the facts tell of, None if it does nothing; refused where it is no pinhole's, or unclear."""
    models = [facts[name] for name in MODELS if facts.get(name) not in (None, "")]
    for model in models:
        require("intrinsics", isinstance(model, str), "the lens's model as a text", lambda: repr(models[0])[:60])
        require_pinhole(model)
    if facts.get("is_fisheye"):
        require_pinhole("is_fisheye")
    stated = [facts[name] for name in facts if COEFFICIENTS.match(name) and isinstance(facts[name], list | dict)]
    lists = [flat_numbers(value) for value in stated if value not in ([], {})]
    named = facts | next((value for value in stated if isinstance(value, dict) and "k1" in value), {})
    if any(name in named for name in BY_NAME):
        given = [number_of(named.get(name, 0.0)) for name in BY_NAME]
        lists = [None if None in given else given[: 8 if any(given[5:]) else 5]]
        _check_named(named)
    require("intrinsics", None not in lists, "the lens's coefficients as finite numbers", "others")
    lists = [numbers for numbers in lists if any(numbers)]
    if not lists:
        return None
    require("intrinsics", len(lists) == 1, "the coefficients of one lens", f"{len(lists)} lists of them")
    way = next((way for way in ("inverse", "modified") for model in models if way in model.lower()), "")
    kind = f"{way}_brown_conrady" if way else "brown_conrady"
    if len(lists[0]) not in COUNTS[kind]:
        raise ValueError(
            f"intrinsics: expected a lens of {', '.join(map(str, COUNTS[kind]))} coefficients k1, k2, p1, p2, ... "
            f"({kind}), got {len(lists[0])}; rectify the pictures first"
        )
    return Lens(tuple(lists[0]), kind)


def _check_named(named: dict) -> None:
    """k4 without k5 and k6 is of a polynomial (nerfstudio), with them of a quotient (OpenCV)."""
    alone = number_of(named.get("k4", 0.0)) and not (named.get("k5") or named.get("k6"))
    require("intrinsics", not alone, "a lens of k1, k2, p1, p2, k3", "k4 of a longer polynomial; rectify first")


def require_pinhole(model) -> None:
    """Raise a ValueError for a lens whose pictures are no pinhole's, not even without coefficients."""
    if re.search(NO_PINHOLE, str(model), re.IGNORECASE):
        raise ValueError(
            f"intrinsics: expected a pinhole camera, got a fisheye or other wide lens ({str(model)[:40]}); rectify the "
            "pictures first, and give the K of the rectified ones"
        )
