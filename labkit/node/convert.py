"""Messages to arrays and back: encodings, padded rows, either byte order, units, clouds and poses.

Debian's cv_bridge crashes beside NumPy 2, and reads padding as pixels, so this is the kit's own. Whatever does not fit
raises a ValueError that names the message's field; the node logs it and goes on.
"""

import re
import struct
import sys

import cv2
import numpy as np
from jaxtyping import Float, Float32, Shaped, UInt8
from scipy.spatial.transform import Rotation

from labkit.frame import RGBDFrame
from labkit.node.messages import Buffer, CameraInfo, CompressedImage, Header, Image, PointCloud2, PointField, Pose
from labkit.support.images import image_size
from labkit.support.validation import check_K, check_shape, check_T, require

# Encoding: type of a number, numbers a pixel.
ENCODINGS = {
    "rgb8": ("u1", 3),
    "bgr8": ("u1", 3),
    "rgba8": ("u1", 4),
    "bgra8": ("u1", 4),
    "mono8": ("u1", 1),
    "16UC1": ("u2", 1),
    "mono16": ("u2", 1),
    "32FC1": ("f4", 1),
}
COLOUR = {
    "bgr8": cv2.COLOR_BGR2RGB,
    "rgba8": cv2.COLOR_RGBA2RGB,
    "bgra8": cv2.COLOR_BGRA2RGB,
    "mono8": cv2.COLOR_GRAY2RGB,
}
DEPTH = ("16UC1", "mono16", "32FC1")
FIELD_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
XYZ = tuple(PointField(name, 4 * i) for i, name in enumerate("xyz"))
QUANTISED = struct.Struct("<iff")  # what stands before the PNG of a compressedDepth: a number without use, A and B


def layout(encoding: str) -> tuple[str, int]:
    """Say what a pixel of an encoding holds: the type of its numbers, and how many; raises ValueError if unknown.

    Besides the cameras' encodings there is 32FC with a number of channels, in which class probabilities travel.

    >>> layout("bgra8"), layout("32FC4")
    (('u1', 4), ('f4', 4))
    """
    channels = re.fullmatch(r"32FC([1-9]\d?)", encoding) if isinstance(encoding, str) else None
    if channels:
        return "f4", int(channels[1])
    require("encoding", encoding in ENCODINGS, f"one of {', '.join(ENCODINGS)}", repr(encoding))
    return ENCODINGS[encoding]


def check_image(message: Image, encodings=None) -> Image:
    """Return an image message whose bytes are all there; raises ValueError naming the field that does not fit.

    encodings: those that the reader can use, default all. Takes no time that grows with the image.
    """
    require("message", isinstance(message, Image), "an Image", type(message).__name__)
    if encodings is not None and message.encoding not in encodings:
        raise ValueError(f"encoding: expected one of {', '.join(encodings)}, got {message.encoding!r}")
    kind, channels = layout(message.encoding)
    _check_counts(message, ("height", "width", "step"))
    row = message.width * channels * np.dtype(kind).itemsize
    require("step", message.step >= row, f"at least {row} bytes for {message.width} pixels", message.step)
    _check_data(message, message.step * (message.height - 1) + row)
    return message


def _check_counts(message, names) -> None:
    for name in names:
        value = getattr(message, name)
        if not isinstance(value, int) or value < 1:
            raise ValueError(f"{name}: expected a number above 0, got {value!r}")


def _check_data(message, needed: int) -> None:
    require("data", isinstance(message.data, Buffer), "bytes", type(message.data).__name__)
    require("data", len(message.data) >= needed, f"{needed} bytes", f"{len(message.data)}: the message is truncated")


def decode_image(message: Image) -> Shaped[np.ndarray, "H W *channels"]:
    """Read an image message: (H, W), or (H, W, C) for more channels, in the encoding's own order and units.

    The result looks into the message's bytes where it can (read-only), and is a copy where rows or byte order ask for
    one. Raises ValueError naming the field that does not fit.

    >>> padded = Image(Header(), 2, 1, "16UC1", 1, 4, bytes([1, 0, 9, 9, 0, 2, 9, 9]))  # big-endian, 2 bytes of padding
    >>> decode_image(padded).tolist()
    [[256], [2]]
    """
    check_image(message)
    kind, channels = layout(message.encoding)
    number = np.dtype(kind)
    wire = number.newbyteorder(">" if message.is_bigendian else "<")
    strides = (message.step, channels * number.itemsize, number.itemsize)
    pixels = np.ndarray((message.height, message.width, channels), wire, message.data, strides=strides)
    pixels = np.ascontiguousarray(pixels, number)
    return pixels[..., 0] if channels == 1 else pixels


def encode_image(array: Shaped[np.ndarray, "H W *channels"], encoding: str, header: Header) -> Image:
    """Write an array as an image message, in this machine's byte order and without padding.

    Raises ValueError if the array's type or channels are not the encoding's.
    """
    kind, channels = layout(encoding)
    expected = (None, None) if channels == 1 else (None, None, channels)
    array = check_shape("array", array, expected)
    require("array", array.dtype == np.dtype(kind), f"{np.dtype(kind).name} for {encoding}", array.dtype)
    height, width = array.shape[:2]
    step = width * channels * array.dtype.itemsize
    return Image(header, height, width, encoding, int(sys.byteorder == "big"), step, array.tobytes())


def rgb_image(message: Image) -> UInt8[np.ndarray, "H W 3"]:
    """Read a colour or grey image message as RGB, whatever order its channels have.

    >>> rgb_image(Image(Header(), 1, 1, "bgr8", 0, 3, bytes([1, 2, 3]))).tolist()
    [[[3, 2, 1]]]
    """
    check_image(message, ("rgb8", *COLOUR))
    pixels = decode_image(message)
    return pixels.copy() if message.encoding == "rgb8" else cv2.cvtColor(pixels, COLOUR[message.encoding])


def depth_image(message: Image, scale: float = 0.001) -> Float32[np.ndarray, "H W"]:
    """Read a depth image message in metres; 0 or NaN where there is no reading.

    16UC1 and mono16 are multiplied by `scale`, metres a unit; 32FC1 holds metres, and its infinities (too near, too
    far) become NaN.

    >>> depth_image(Image(Header(), 1, 2, "16UC1", 0, 4, bytes([0, 2, 0, 0]))).round(3).tolist()
    [[0.5120000243186951, 0.0]]
    """
    pixels = decode_image(check_image(message, DEPTH))
    if pixels.dtype == np.uint16:
        return pixels * np.float32(scale)
    infinite = np.isinf(pixels)
    return np.where(infinite, np.float32(np.nan), pixels) if infinite.any() else pixels


def check_compressed(message: CompressedImage, depth: bool) -> CompressedImage:
    """Return a compressed image that `decompress` can read as colour, or as depth; raises ValueError naming the field.

    Takes no time that grows with the image, so that bytes which are damaged show in `decompress` alone.
    """
    require("message", isinstance(message, CompressedImage), "a CompressedImage", type(message).__name__)
    require("data", isinstance(message.data, Buffer), "bytes", type(message.data).__name__)
    before, _, how = message.format.partition(";")
    if depth:
        readable = before in DEPTH and "compressedDepth" in how and "rvl" not in how
        wanted = "16UC1 or 32FC1 as a PNG, such as '16UC1; compressedDepth png'"
    else:
        readable = "compressedDepth" not in how and not before.startswith("bayer")
        wanted = "a colour picture, such as 'rgb8; jpeg compressed bgr8'"
    require("format", readable, wanted, repr(message.format))
    return message


def decompress(message: CompressedImage, size: tuple[int, int]) -> Image:
    """Read a message of image_transport's topics "compressed" and "compressedDepth" as the image that it was.

    size: (height, width) that it must have, its CameraInfo's; no pixel of another is read. Colour becomes bgr8 or rgb8,
    depth what its format says. Float depth travels as whole numbers q with A / (q - B) metres, 0 for no reading. Raises
    ValueError for bytes that hold no such picture.
    """
    before, _, how = message.format.partition(";")
    depth = "compressedDepth" in how
    data = np.frombuffer(message.data, np.uint8)[QUANTISED.size if depth else 0 :]
    width, height = image_size("data", data.tobytes(), f"a picture of {message.format!r}")
    require("data", (height, width) == size, f"the size of info, {size}", (height, width))
    flags = cv2.IMREAD_UNCHANGED if depth else cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
    try:
        pixels = cv2.imdecode(data, flags)
    except cv2.error:  # nothing in it
        pixels = None
    if pixels is None or (depth and (pixels.dtype, pixels.ndim) != (np.uint16, 2)):
        raise ValueError(f"data: expected a whole picture of {message.format!r}, got {len(message.data)} bytes")
    if not depth:
        # A format that names what it was before, and not this order, has R and B exchanged in the file.
        return encode_image(pixels, "rgb8" if how and "compressed bgr" not in how else "bgr8", message.header)
    if before == "32FC1":
        _, A, B = QUANTISED.unpack_from(message.data)
        q = np.where(pixels == 0, np.float32(np.nan), pixels)
        pixels = np.float32(A) / (q - np.float32(B))
    return encode_image(pixels, before, message.header)


def camera_matrix(message: CameraInfo) -> Float[np.ndarray, "3 3"]:
    """Read K from a calibration message; raises ValueError for none, such as the zeros of an uncalibrated camera."""
    require("message", isinstance(message, CameraInfo), "a CameraInfo", type(message).__name__)
    _check_counts(message, ("height", "width"))
    return check_K("K", check_shape("K", message.K, (9,)).reshape(3, 3))


def to_frame(
    rgb: Image, depth: Image, info: CameraInfo, T_base_cam: Float[np.ndarray, "4 4"], depth_scale: float = 0.001
) -> RGBDFrame:
    """Put three messages that belong together into one frame.

    Raises ValueError if their sizes or frames differ: depth in another frame than colour's is not registered to it, and
    pixel (u, v) of one is not pixel (u, v) of the other.
    """
    size = (rgb.height, rgb.width)
    for name, other in (("depth", depth), ("info", info)):
        require(name, (other.height, other.width) == size, f"the size of rgb, {size}", (other.height, other.width))
        if other.header.frame_id != rgb.header.frame_id:
            raise ValueError(
                f"{name}: expected the frame of rgb, {rgb.header.frame_id!r}, got {other.header.frame_id!r}; "
                "depth must be registered to colour"
            )
    return RGBDFrame(rgb_image(rgb), depth_image(depth, depth_scale), camera_matrix(info), T_base_cam)


def encode_cloud(P: Float[np.ndarray, "N 3"], header: Header, **more: Shaped[np.ndarray, "N"]) -> PointCloud2:
    """Write points, metres, as a message of x, y, z in float32; more: further numbers of each point, by name.

    >>> message = encode_cloud(np.array([[1.0, 2.0, 3.0]]), Header(0, "base_link"), score=np.array([0.5]))
    >>> message.width, message.point_step, decode_cloud(message).tolist(), decode_cloud(message, ["score"]).tolist()
    (1, 16, [[1.0, 2.0, 3.0]], [[0.5]])
    """
    P = check_shape("P", P, (None, 3))
    named = XYZ + tuple(PointField(name, 12 + 4 * i) for i, name in enumerate(more))
    points = np.empty((len(P), len(named)), "<f4")
    points[:, :3] = P
    for i, (name, column) in enumerate(more.items(), start=3):
        points[:, i] = check_shape(name, column, (len(P),))
    step = 4 * len(named)
    return PointCloud2(header, 1, len(points), named, False, step, step * len(points), points.tobytes())


def pack_rgb(rgb: UInt8[np.ndarray, "N 3"]) -> Float32[np.ndarray, "N"]:
    """Pack colours as the field "rgb" of clouds holds them: the bytes 0, R, G, B of a number, called a float32."""
    return (rgb.astype(np.uint32) @ np.array([1 << 16, 1 << 8, 1], np.uint32)).view(np.float32)


def decode_cloud(message: PointCloud2, names=("x", "y", "z")) -> Float32[np.ndarray, "N _"]:
    """Read numbers of every point of a cloud message, row by row, wherever in a point they stand: a column for a name.

    Raises ValueError if one of them is missing or bytes are.
    """
    require("message", isinstance(message, PointCloud2), "a PointCloud2", type(message).__name__)
    where = {field.name: field for field in message.fields}
    if missing := [name for name in names if name not in where]:
        raise ValueError(f"fields: expected {', '.join(names)}, got none for {', '.join(missing)}")
    order = ">" if message.is_bigendian else "<"
    chosen = [where[name] for name in names]
    if wrong := [field.datatype for field in chosen if field.datatype not in FIELD_TYPES]:
        raise ValueError(f"fields: expected datatypes 1 to 8, got {wrong}")
    point = {"names": list(names), "formats": [order + FIELD_TYPES[field.datatype] for field in chosen]}
    try:
        kind = np.dtype(point | {"offsets": [field.offset for field in chosen], "itemsize": message.point_step})
    except ValueError as error:
        raise ValueError(f"fields: expected all within point_step {message.point_step}: {error}") from error
    if message.height * message.width == 0:
        return np.zeros((0, len(names)), np.float32)
    _check_data(message, message.row_step * (message.height - 1) + message.point_step * message.width)
    strides = (message.row_step, message.point_step)
    points = np.ndarray((message.height, message.width), kind, message.data, strides=strides).ravel()
    return np.stack([points[name].astype(np.float32) for name in names], axis=1)


def encode_pose(T: Float[np.ndarray, "4 4"], header: Header) -> Pose:
    """Write a rigid transform as a pose: its origin, and its rotation as a quaternion (x, y, z, w) with w >= 0.

    >>> encode_pose(np.diag([1.0, -1.0, -1.0, 1.0]), Header()).orientation
    (1.0, 0.0, 0.0, 0.0)
    """
    T = check_T("T", T)
    quaternion = Rotation.from_matrix(T[:3, :3]).as_quat(canonical=True)
    return Pose(header, tuple(T[:3, 3].tolist()), tuple(quaternion.tolist()))


def decode_pose(message: Pose) -> Float[np.ndarray, "4 4"]:
    """Read a pose as a rigid transform; raises ValueError if its quaternion is not one of a rotation (length 1)."""
    return rigid(message.position, message.orientation)


def rigid(position, quaternion) -> Float[np.ndarray, "4 4"]:
    """Build a rigid transform from a position and a unit quaternion (x, y, z, w); raises ValueError for others.

    >>> rigid((1.0, 2.0, 3.0), (0.0, 0.0, 1.0, 0.0))[0].tolist()
    [-1.0, 0.0, 0.0, 1.0]
    """
    length = float(np.linalg.norm(check_shape("orientation", quaternion, (4,))))
    if not abs(length - 1.0) < 1e-3:  # NaN fails, too
        raise ValueError(f"orientation: expected a quaternion of length 1, got length {length:.4g}")
    T = np.eye(4)
    T[:3, :3] = Rotation.from_quat(quaternion).as_matrix()
    T[:3, 3] = check_shape("position", position, (3,))
    return T
