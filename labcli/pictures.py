"""The pictures of one shot as cameras, phones and programs save them: read as one frame, or refused with the cause.

Sizes are compared before a pixel is read. docs/cameras.md lists what is read. Topics 01 and 06.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float, Float32, Integer, Shaped

from labcli.arrays import open_array
from labcli.cameras import Intrinsics, rectify
from labkit.frame import RGBDFrame, read_image
from labkit.geometry.depth_units import metres_per_unit, resize_depth, resized_K
from labkit.support.images import image_size, turned, turned_size
from labkit.support.validation import require

WIDEST = 640  # pixels of a phone's colours: its depth has 256
MIDDLE = 0.2  # of half a picture's side: where the principal point of a camera may lie
MOST_THINGS = 1000  # with numbers of their own in one mask


@dataclass(frozen=True)
class Reading:
    """What a user says of the files: metres per unit of depth, that depth is of the same view, which of the cameras."""

    depth_scale: float | None = None
    aligned: bool = False
    camera_name: str | None = None


NOTHING_SAID = Reading()


@dataclass(frozen=True, eq=False)
class Shot:
    """A frame in the camera's own frame (T_base_cam is the identity), its lens undone, and what is to be said of it.

    camera: of the frame, which may be smaller than the file's picture; file_size: width and height of that, as it is
    shown: turned if its camera is that of turned pictures (`labkit calibrate`).
    """

    frame: RGBDFrame
    camera: Intrinsics
    file_size: tuple[int, int]
    said: tuple[str, ...] = ()

    def labels_like(
        self, image: Integer[np.ndarray, "H W"], outside: int = 0, path="the mask"
    ) -> Integer[np.ndarray, "h w"]:
        """Labels or numbers of things that were made for the colour file, at the frame's pixels.

        They may be of the picture as it is shown, or on its side as the file holds it. outside: what stands where the
        lens saw nothing. path: the file that they are of. Raises ValueError for another size.
        """
        (w, h), orientation = self.file_size, self.camera.orientation
        if image.shape != (h, w) and turned_size(image.shape, orientation) == (h, w):
            image = turned(image, orientation)
        if image.shape != (h, w):
            got = f"{image.shape[1]} x {image.shape[0]}"
            raise ValueError(f"mask: expected the colour picture's size, {w} x {h}, in {path}, got {got}")
        if image.shape[::-1] != self.frame.size:
            image = cv2.resize(image, self.frame.size, interpolation=cv2.INTER_NEAREST_EXACT)
        return rectify(image, self.camera, outside=outside)

    def pixel(self, u: float, v: float, name: str = "at") -> tuple[float, float]:
        """Where a pixel of the colour file lies in the frame; raises ValueError for one outside of it."""
        (w, h), (W, H) = self.file_size, self.frame.size
        require(
            name, -0.5 <= u < w - 0.5 and -0.5 <= v < h - 0.5, f"a pixel (u, v) of the picture of {w} x {h}", (u, v)
        )
        place = np.array([(u + 0.5) * W / w - 0.5, (v + 0.5) * H / h - 0.5])
        if self.camera.lens is not None:
            K = self.camera.K
            xy = np.linalg.solve(K[:2, :2], place - K[:2, 2])
            place = K[:2, :2] @ self.camera.lens.to_rays(xy[None])[0] + K[:2, 2]
        return tuple(np.clip(place, 0.0, np.array([W, H]) - 1.0).tolist())


def read_shot(color, depth, camera: Intrinsics, reading: Reading = NOTHING_SAID) -> Shot:
    """Read a colour picture and its depth picture as one frame.

    Depth of another size is of the same view only if the camera's file or the user says so: then colour is made at most
    640 pixels wide, and depth brought to its size. A file of depth's name in a folder confidence beside depth's tells
    which readings an app trusts least. Raises ValueError with the likely cause if the files are swapped, their sizes
    differ, or depth cannot be metres.
    """
    camera, file_size, said_of_turn = _as_shown(image_size("color", Path(color).read_bytes(), str(color)), camera)
    raw = open_array("depth", depth)
    turns = _depth_turns(raw.size, file_size, camera.orientation)
    size = _common_size(file_size, turned_size(raw.size, turns), camera, reading)
    camera = _camera_of_size(camera, file_size, size, reading)
    rgb = turned(read_image("color", color, np.uint8, colour=True), camera.orientation)
    if rgb.shape[1::-1] != size:
        rgb = cv2.resize(rgb, size, interpolation=cv2.INTER_AREA)
    numbers = _one_channel(raw.read(), depth)
    unit, said = metres_per_unit(numbers, reading.depth_scale, camera.depth_scale)
    with np.errstate(over="ignore", invalid="ignore"):
        metres = numbers.astype(np.float32) * np.float32(unit)
    metres[~np.isfinite(metres)] = 0.0
    trusted, untrusted = _confidence(Path(depth), metres)
    metres = resize_depth(turned(trusted, turns), size)
    pictures = rectify(rgb, camera, smooth=True), rectify(metres, camera)
    told = [*camera.said, said_of_turn, said, untrusted]
    if size != file_size:
        told.append(f"color: {file_size[0]} x {file_size[1]} is made {size[0]} x {size[1]}, depth and K with it")
    if camera.lens is not None:
        told.append("the lens's distortion is undone first: what is written is of the rectified picture")
    return Shot(RGBDFrame(*pictures, camera.K, np.eye(4)), camera, file_size, tuple(filter(None, told)))


def read_frame(color, depth, camera: Intrinsics, depth_scale: float | None = None) -> RGBDFrame:
    """The frame of `read_shot`, for whoever needs nothing else; depth_scale: metres per unit of the depth file."""
    return read_shot(color, depth, camera, Reading(depth_scale)).frame


def _as_shown(sensor: tuple[int, int], camera: Intrinsics) -> tuple[Intrinsics, tuple[int, int], str]:
    """The camera, the size of a colour file as its pictures are turned, and what is said of it.

    `labkit calibrate` turns what the sensor saw as a phone was held; a file that was turned already stays.
    """
    size = turned_size(sensor, camera.orientation)
    if camera.size and one_ratio(camera.size, sensor) and not one_ratio(camera.size, size):
        camera, size = replace(camera, orientation=1), sensor
    turns = "color: turned upright as the camera's file says, exif_orientation"
    return camera, size, f"{turns} {camera.orientation}" if camera.orientation != 1 else ""


def _depth_turns(size: tuple[int, int], shown: tuple[int, int], orientation: int) -> int:
    """How depth is to be turned: as its colours, unless its sides are those of the turned colours already."""
    on_its_side = one_ratio(turned_size(size, orientation), shown)
    return orientation if on_its_side or not one_ratio(size, shown) else 1


def _common_size(color: tuple[int, int], depth: tuple[int, int], camera: Intrinsics, reading: Reading):
    """The size that the frame gets."""
    if color == depth:
        return color
    sizes = f"{color[0]} x {color[1]} and {depth[0]} x {depth[1]}"
    if not one_ratio(color, depth):
        raise ValueError(f"depth: expected the size of the colour picture, got {sizes}; align depth to colour first")
    if not (camera.same_view or reading.aligned):
        raise ValueError(
            f"depth: expected the size of the colour picture, got {sizes}; align depth to colour first, or say "
            "--aligned if both are of one view, as of a phone"
        )
    return (WIDEST, round(color[1] * WIDEST / color[0])) if color[0] > WIDEST else color


def one_ratio(one: tuple[int, int], other: tuple[int, int]) -> bool:
    """Whether one size is the other enlarged, up to a pixel of the smaller."""
    (w, h), (W, H) = sorted((one, other))
    return abs(w * H - h * W) <= max(W, H)


def _camera_of_size(camera: Intrinsics, file_size, size, reading: Reading) -> Intrinsics:
    """The camera of the frame: of the file's picture, or of one of the same view in another size."""
    of_file = camera.size in (None, file_size)
    if not of_file and not ((camera.same_view or reading.aligned) and one_ratio(camera.size, file_size)):
        raise ValueError(
            f"intrinsics: expected a calibration of pictures of {file_size[0]} x {file_size[1]}, got one of "
            f"{camera.size[0]} x {camera.size[1]}"
        )
    K = resized_K(camera.K, camera.size or file_size, size)
    _check_order(K, size)
    return replace(camera, K=K, size=size)


def _check_order(K: Float[np.ndarray, "3 3"], size: tuple[int, int]) -> None:
    """Refuse fx, cx, fy, cy for fx, fy, cx, cy: the principal point is then outside, and would be in the middle."""
    fx, cx, fy, cy = K[0, 0], K[1, 1], K[0, 2], K[1, 2]
    if _central(cx, cy, size) and not _central(K[0, 2], K[1, 2], size) and abs(fx - fy) < 0.2 * fx:
        numbers = " ".join(f"{x:g}" for x in (fx, fy, cx, cy))
        raise ValueError(
            f'intrinsics: expected the order fx fy cx cy, got what fits as fx cx fy cy: is it "{numbers}"?'
        )


def _central(cx: float, cy: float, size: tuple[int, int]) -> bool:
    return all(abs(2.0 * c / n - 1.0) < MIDDLE for c, n in zip((cx, cy), size, strict=True))


def _one_channel(image: Shaped[np.ndarray, "H W *channels"], path) -> Shaped[np.ndarray, "H W"]:
    if image.dtype == np.uint8:
        raise ValueError(
            f"depth: expected uint16 or floats, got 8 bits in {path}: it is a picture of depth, in which distances are "
            "shades or colours; save what the camera measures, as 16-bit PNG, TIFF or NPY"
        )
    got = f"{image.dtype} with shape {image.shape}; are colour and depth swapped?"
    require("depth", image.ndim == 2, f"one channel in {path}", got)
    return image


def _confidence(depth: Path, metres: Float32[np.ndarray, "H W"]) -> tuple[Float32[np.ndarray, "H W"], str]:
    """Depth without what an app trusts least: 0 in confidence/NAME.png (ARKit's low), and a sentence on it."""
    path = depth.parent.parent / "confidence" / f"{depth.stem}.png"
    if not path.is_file():
        return metres, ""
    confidence = read_image("confidence", path, np.uint8)
    require("confidence", confidence.shape == metres.shape, "the size of depth", confidence.shape[::-1])
    low = (confidence == 0) & (metres > 0.0)
    if np.all(confidence == 0):
        return metres, f"confidence: {path} is 0 everywhere, and left aside"
    return np.where(low, np.float32(0.0), metres), f"confidence: {low.mean():.0%} of depth is left out, as {path} says"


def pictures_in(folder: Path) -> tuple[list[Path], list[str]]:
    """The pictures of a folder color/, by name, without hidden files; and which of two with one name are left out."""
    found, said = {}, []
    for path in sorted(folder.glob("*"), key=lambda path: (path.suffix.lower() != ".png", path.name)):
        if not path.is_file() or path.name.startswith("."):
            continue
        if path.stem in found:
            said.append(f"{path} is left out: {found[path.stem].name} has the same name")
        found.setdefault(path.stem, path)
    return sorted(found.values()), said


def depth_beside(color: Path) -> Path:
    """The depth file of a picture of color/: depth/NAME.png, or of another ending."""
    folder = color.parent.parent / "depth"
    found = [path for end in DEPTH_ENDINGS if (path := folder / f"{color.stem}{end}").is_file()]
    return found[0] if found else folder / f"{color.stem}.png"


DEPTH_ENDINGS = (".png", ".tiff", ".tif", ".pfm", ".npy", ".npz", ".exr")


def pose_beside(color: Path) -> Path | None:
    """The file with a picture's camera pose, pose/NAME.txt beside color/NAME.png, None if there is none."""
    path = color.parent.parent / "pose" / f"{color.stem}.txt"
    return path if color.parent.name == "color" and path.is_file() else None


def camera_file(folder: Path) -> Path | None:
    """The file with the camera of a folder's pictures, None if there is none."""
    return next((path for name in CAMERA_FILES if (path := folder / name).is_file()), None)


CAMERA_FILES = ("camera.json", "camera.yaml", "camera.yml", "camera.txt", "camera_matrix.csv", "scene_camera.json")


def read_numbers(path) -> Integer[np.ndarray, "H W"]:
    """A mask of numbers of things, 8 or 16 bits; raises ValueError for one with more numbers than things."""
    mask = read_image("mask", path, (np.uint8, np.uint16))
    count = np.count_nonzero(np.bincount(mask.ravel()))
    most = f"at most {MOST_THINGS} numbers of things in {path}"
    require("mask", count <= MOST_THINGS, most, f"{count}; is it a depth picture?")
    return mask
