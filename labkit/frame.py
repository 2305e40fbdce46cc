"""One shot of a calibrated RGB-D camera, and the files that it is kept in."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float, Integer, UInt8

from labkit.labels import IGNORE
from labkit.support.images import image_size
from labkit.support.validation import (
    check_depth,
    check_height,
    check_K,
    check_labels,
    check_rgb,
    check_same_size,
    check_shape,
    check_T,
    require,
)


@dataclass(frozen=True, eq=False)
class RGBDFrame:
    """Registered colour and depth, with the calibration that turns pixels into points of the robot's base frame.

    rgb: uint8 (H, W, 3), RGB. depth: metres, float32 (H, W); 0 or NaN where there is no reading. K: intrinsics, (3, 3),
    pixel centres at integers. T_base_cam: (4, 4), maps camera coordinates (x right, y down, z forward) to base
    coordinates. labels: true classes, uint8 (H, W), if known; 255 is "ignore". instances: (H, W), 0 or the object's
    number, if known, and where nobody knows the greatest number of the type (`unknown_number`): uint8, 255; uint16,
    65535, for images of another type that have a number above 254. table_z: height of the table in the base frame,
    metres, if known. A frame stays as it was checked: its arrays are copies that cannot be written to. Raises
    ValueError naming the argument that does not fit. Topics 01 and 06.

    >>> rgb, depth = np.zeros((2, 3, 3), np.uint8), np.ones((2, 3), np.float32)
    >>> frame = RGBDFrame(rgb, depth, K=np.diag([9.0, 9.0, 1.0]), T_base_cam=np.eye(4))
    >>> frame.size
    (3, 2)
    >>> frame
    RGBDFrame(3 x 2)
    """

    rgb: UInt8[np.ndarray, "H W 3"]
    depth: Float[np.ndarray, "H W"]
    K: Float[np.ndarray, "3 3"]
    T_base_cam: Float[np.ndarray, "4 4"]
    labels: Integer[np.ndarray, "H W"] | None = None
    instances: Integer[np.ndarray, "H W"] | None = None
    table_z: float | None = None

    def __post_init__(self):
        def put(name, value):  # the dataclass is frozen: only here may it still take its checked values
            object.__setattr__(self, name, value)

        put("rgb", frozen(check_rgb("rgb", self.rgb), np.uint8))
        put("depth", frozen(check_depth("depth", self.depth), np.float32))
        check_same_size("rgb", self.rgb, "depth", self.depth)
        put("K", frozen(check_K("K", self.K), np.float64))
        put("T_base_cam", frozen(check_T("T_base_cam", self.T_base_cam), np.float64))
        for name, count in (("labels", IGNORE), ("instances", 65_536)):
            if getattr(self, name) is not None:
                image = check_shape(name, check_labels(name, getattr(self, name), count), (None, None))
                check_same_size("rgb", self.rgb, name, image)
                wide = name == "instances" and image.dtype != np.uint8 and image.max(initial=0) >= IGNORE
                put(name, frozen(image, np.uint16 if wide else np.uint8))
        if self.table_z is not None:
            put("table_z", check_height("table_z", self.table_z))

    def __repr__(self) -> str:
        known = [name for name in ("labels", "instances") if getattr(self, name) is not None]
        table = [] if self.table_z is None else [f"table_z={self.table_z:.4g}"]
        return f"RGBDFrame({', '.join([f'{self.size[0]} x {self.size[1]}', *known, *table])})"

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self.rgb.shape[1], self.rgb.shape[0]

    @classmethod
    def from_files(
        cls, rgb, depth, K, T_base_cam, labels=None, instances=None, depth_scale: float = 0.001, table_z=None
    ) -> "RGBDFrame":
        """Read a frame from image files: 8-bit RGB, 16-bit PNG depth; if given, 8-bit labels, 8- or 16-bit instances.

        depth_scale: metres for one unit of the depth file (0.001 for millimetres); 0 in the file is "no reading".
        Raises FileNotFoundError for a missing file, ValueError for one that is not such an image.
        """
        require("depth_scale", 0.0 < depth_scale < np.inf, "metres for one unit, above 0", depth_scale)
        raw_depth = read_image("depth", depth, np.uint16)
        return cls(
            rgb=read_image("rgb", rgb, np.uint8, colour=True),
            depth=raw_depth.astype(np.float32) * np.float32(depth_scale),
            K=K,
            T_base_cam=T_base_cam,
            labels=None if labels is None else read_image("labels", labels, np.uint8),
            instances=None if instances is None else read_image("instances", instances, (np.uint8, np.uint16)),
            table_z=table_z,
        )


def frozen(array: np.ndarray, dtype) -> np.ndarray:
    """An array of that type whose numbers nobody can change: itself if it is one, else a copy."""
    if array.flags.writeable or array.base is not None or array.dtype != dtype:
        array = array.astype(dtype)
        array.flags.writeable = False
    return array


def read_image(name: str, path, dtype, colour: bool = False) -> np.ndarray:
    """Read an image file as RGB (H, W, 3) if `colour`, else as one channel (H, W), without any conversion of values.

    `name` is the argument that the errors speak of. dtype: the file's, or a tuple of those that will do. Colours of 16
    bits are brought to 8 if they fill them. What a phone notes of how it was held turns nothing: depth would not turn
    with it. Raises FileNotFoundError, or ValueError if the file is damaged, holds another kind of image, or claims
    more pixels than any camera has.
    """
    image = decode_image_file(name, Path(path).read_bytes(), path, colour)
    dtypes = dtype if isinstance(dtype, tuple) else (dtype,)
    if colour and image.ndim == 3 and image.dtype == np.uint16 and np.uint8 in dtypes:
        image = _of_8_bits(name, image, path)
    channels, hint = (3, "; are colour and depth swapped?") if colour else (1, "")
    expected = f"{' or '.join(np.dtype(kind).name for kind in dtypes)} with {channels} channel(s) in {path}"
    fits = image.dtype in dtypes and (colour or image.ndim == 2)
    require(name, fits, expected, f"{image.dtype} with shape {image.shape}{hint}")
    if not colour:
        return image
    return cv2.cvtColor(image, cv2.COLOR_GRAY2RGB if image.ndim == 2 else cv2.COLOR_BGR2RGB)


def decode_image_file(name: str, data: bytes, path, colour: bool = False) -> np.ndarray:
    """Decode an image file's bytes as they are: (H, W), or in OpenCV's order BGR; `colour` leaves transparency out.

    The header is read first, so that nothing large is made of a small file. Raises ValueError as `read_image`.
    """
    image_size(name, data, str(path))
    how = cv2.IMREAD_ANYCOLOR | cv2.IMREAD_ANYDEPTH | cv2.IMREAD_IGNORE_ORIENTATION if colour else cv2.IMREAD_UNCHANGED
    try:
        image = cv2.imdecode(np.frombuffer(data, np.uint8), how)
    except cv2.error:
        image = None
    if image is None:
        raise ValueError(f"{name}: {path} is not an image that can be read (damaged or truncated?)")
    return image


def _of_8_bits(name: str, image: np.ndarray, path) -> np.ndarray:
    """Colours of 16 bits in 8, 65535 as 255; refused if they fill only the lower bits, as raw ones of 10 or 12 do."""
    most = int(image.max())
    raw = "bits of 10 or 12 in 16 are raw: save colours of 8 bits"
    require(name, most >= 0x2000, f"16-bit colours up to 65535 in {path}", f"none above {most}; {raw}")
    return ((image.astype(np.uint32) * 255 + 32767) // 65535).astype(np.uint8)
