"""Messages to arrays and back: against recorded bytes, against cv_bridge, against the poses of a second library."""

import dataclasses
import json
import struct
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from scenes import png_that_claims
from scipy.spatial.transform import Rotation

from labkit.frame import RGBDFrame
from labkit.node import convert
from labkit.node.actors import Camera
from labkit.node.bus import Bus
from labkit.node.messages import CameraInfo, CompressedImage, Header, Image, PointCloud2, PointField, Pose

RECORDED = Path(__file__).parent / "recorded"
SYSTEM_PYTHON = "/usr/bin/python3"
COLOURS = ("rgb8", "bgr8", "rgba8", "bgra8", "mono8")
H = Header(5, "camera")


def message_of(recorded: dict) -> Image:
    fields = {name: recorded[name] for name in ("height", "width", "encoding", "is_bigendian", "step")}
    return Image(H, **fields, data=bytes.fromhex(recorded["data"]))


def read_by_the_kit(message: Image) -> np.ndarray:
    return convert.rgb_image(message) if message.encoding in COLOURS else convert.decode_image(message)


def padded(message: Image, filler: int) -> Image:
    """The same image with rows that end in bytes which mean nothing."""
    step = message.step
    rows = [message.data[r * step : (r + 1) * step] + b"\xee" * filler for r in range(message.height)]
    return dataclasses.replace(message, step=step + filler, data=b"".join(rows))


@pytest.mark.parametrize("recorded", json.loads((RECORDED / "images.json").read_text()))
def test_recorded_bytes_are_read_as_cv_bridge_read_them(recorded):
    message = message_of(recorded)
    for filler in (0, 3, 8):
        found = read_by_the_kit(padded(message, filler))
        assert np.array_equal(found, np.array(recorded["read"]).astype(found.dtype))


def random_message(rng) -> Image:
    """Any encoding, size and byte order that cv_bridge accepts."""
    encoding = str(rng.choice(list(convert.ENCODINGS)))
    kind, channels = convert.layout(encoding)
    height, width = (int(n) for n in rng.integers(1, [9, 12]))
    pixel = channels * np.dtype(kind).itemsize
    if encoding == "32FC1":
        data = rng.random(height * width).astype(np.float32).tobytes()
    else:
        data = rng.integers(0, 256, height * width * pixel, dtype=np.uint8).tobytes()
    order = int(rng.integers(2)) if np.dtype(kind).itemsize == 2 else 0
    return Image(H, height, width, encoding, order, width * pixel, data)


@pytest.mark.debian("python3-cv-bridge", "python3-sensor-msgs")
def test_a_hundred_random_messages_are_read_as_cv_bridge_reads_them():
    """In a process of the system's Python, whose NumPy cv_bridge was built for."""
    rng = np.random.default_rng(7)
    messages = [random_message(rng) for _ in range(100)]
    names = ("height", "width", "encoding", "is_bigendian", "step")
    asked = [{name: getattr(m, name) for name in names} | {"data": m.data.hex()} for m in messages]
    command = [SYSTEM_PYTHON, RECORDED / "record_images.py", "-"]
    done = subprocess.run(command, input=json.dumps(asked), capture_output=True, text=True, check=True)
    for message, answer in zip(messages, json.loads(done.stdout), strict=True):
        found = read_by_the_kit(padded(message, int(rng.integers(5))))
        assert np.array_equal(found, np.array(answer["read"]).astype(found.dtype)), message


@pytest.mark.parametrize("encoding", [*convert.ENCODINGS, "32FC4"])
def test_what_was_written_is_read(encoding):
    kind, channels = convert.layout(encoding)
    rng = np.random.default_rng(1)
    array = (200.0 * rng.random((4, 7, channels))).astype(kind)
    array = array[..., 0] if channels == 1 else array
    message = convert.encode_image(array, encoding, H)
    assert message.header == H and np.array_equal(convert.decode_image(message), array)
    assert message.is_bigendian == (sys.byteorder == "big")


def test_the_last_row_needs_no_padding():
    whole = Image(H, 2, 2, "mono8", 0, 5, bytes(range(10)))
    cut = dataclasses.replace(whole, data=whole.data[:7])
    assert convert.decode_image(cut).tolist() == [[0, 1], [5, 6]]


def test_odd_padding_may_leave_numbers_unaligned():
    values = np.array([[1.5, -2.0], [0.25, 9.0]], ">f4")
    data = b"".join(row.tobytes() + b"\xff" for row in values)
    message = Image(H, 2, 2, "32FC1", 1, 9, data)
    assert np.array_equal(convert.decode_image(message), values)


def test_depth_is_metres_with_no_infinity():
    units = convert.encode_image(np.array([[0, 512, 65535]], np.uint16), "16UC1", H)
    assert np.allclose(convert.depth_image(units), [[0.0, 0.512, 65.535]])
    assert np.allclose(convert.depth_image(units, scale=0.0002), [[0.0, 0.1024, 13.107]])
    metres = convert.encode_image(np.array([[0.5, np.inf, -np.inf, np.nan]], np.float32), "32FC1", H)
    found = convert.depth_image(metres)
    assert found[0, 0] == 0.5 and np.isnan(found[0, 1:]).all() and found.dtype == np.float32


def test_what_16_bits_cannot_hold_is_no_reading():
    """70 m in millimetres would come back as 4.464 m."""
    bus, seen = Bus(), []
    bus.subscribe("/camera/depth/image_raw", object, seen.append)
    depth = np.array([[0.8, 65.535, 70.0, np.nan, 0.0]], np.float32)
    frame = RGBDFrame(np.zeros((1, 5, 3), np.uint8), depth, np.diag([9.0, 9.0, 1.0]), np.eye(4))
    for encoding, far in (("16UC1", 0.0), ("32FC1", 70.0)):
        Camera(bus, depth=encoding).publish(frame)
        found = np.nan_to_num(convert.depth_image(seen[-1]))
        assert np.allclose(found, [[0.8, 65.535, far, 0.0, 0.0]], atol=1e-5)


def test_16_bit_depth_may_be_called_mono16():
    message = convert.encode_image(np.array([[0, 512]], np.uint16), "mono16", H)
    assert np.allclose(convert.depth_image(message), [[0.0, 0.512]])


@pytest.mark.parametrize(
    "format, in_file",
    [
        ("rgb8; jpeg compressed bgr8", "bgr"),
        ("bgr8; png compressed bgr8", "bgr"),
        ("jpeg", "bgr"),
        ("png", "bgr"),
        ("rgb8; jpeg compressed", "rgb"),
    ],
)
def test_compressed_colour_keeps_its_channels(format, in_file):
    """A red picture, as image_transport and others write it; older ones exchange R and B."""
    red = np.full((16, 24, 3), (250, 20, 30), np.uint8)
    file = cv2.imencode(".jpg" if "jpeg" in format else ".png", red[..., ::-1] if in_file == "bgr" else red)[1]
    message = convert.check_compressed(CompressedImage(H, format, file.tobytes()), depth=False)
    found = convert.rgb_image(convert.decompress(message, (16, 24))).astype(int)
    assert found.shape == red.shape and np.abs(found - red).max() <= 4


def test_compressed_depth_is_what_it_was():
    units = np.array([[0, 512, 65535]], np.uint16)
    file = bytes(12) + cv2.imencode(".png", units)[1].tobytes()
    message = convert.check_compressed(CompressedImage(H, "16UC1; compressedDepth", file), depth=True)
    image = convert.decompress(message, (1, 3))
    assert image.encoding == "16UC1" and np.array_equal(convert.decode_image(image), units) and image.header == H

    quantum, furthest = 100.0, 10.0  # image_transport's defaults
    A = quantum * (quantum + 1.0)
    B = 1.0 - A / furthest
    metres = np.array([[0.3, 1.0, 9.0]], np.float32)
    q = np.append(np.round(A / metres + B), [[0]], axis=1).astype(np.uint16)
    file = struct.pack("<iff", 0, A, B) + cv2.imencode(".png", q)[1].tobytes()
    found = convert.depth_image(convert.decompress(CompressedImage(H, "32FC1; compressedDepth png", file), (1, 4)))
    assert np.allclose(found[0, :3], metres, atol=0.005) and np.isnan(found[0, 3])


@pytest.mark.parametrize("format", ["rgb8; png compressed bgr8", "16UC1; compressedDepth png"])
@pytest.mark.parametrize("claimed", [(20000, 16000), (100_000, 100_000), (640, 481)])
def test_a_picture_of_another_size_than_its_calibration_is_refused_before_a_pixel_is_read(format, claimed, monkeypatch):
    monkeypatch.setattr(cv2, "imdecode", None)  # whoever calls it fails
    file = bytes(12) * ("Depth" in format) + png_that_claims(*claimed)
    with pytest.raises(
        ValueError, match=r"^data: expected (at most 64 million pixels|the size of info, \(480, 640\)), got"
    ):
        convert.decompress(CompressedImage(H, format, file), (480, 640))


def test_clouds_are_read_wherever_their_fields_stand():
    """A cloud as other drivers lay it out: organised, in doubles, big-endian, with other fields and padding."""
    rng = np.random.default_rng(2)
    P = rng.normal(size=(2, 3, 3))
    layout = {"names": ["y", "i", "z", "x"], "formats": [">f8", "u1", ">f8", ">f4"], "offsets": [1, 0, 9, 17]}
    kind = np.dtype(layout | {"itemsize": 24})
    table = np.zeros((2, 3), kind)
    for axis, name in enumerate("xyz"):
        table[name] = P[..., axis]
    data = b"".join(row.tobytes() + b"\0" * 5 for row in table)
    fields = tuple(PointField(n, o, t) for n, o, t in (("y", 1, 8), ("i", 0, 2), ("z", 9, 8), ("x", 17, 7)))
    message = PointCloud2(H, 2, 3, fields, True, 24, 77, data)
    assert np.allclose(convert.decode_cloud(message), P.reshape(-1, 3), atol=1e-6)
    empty = convert.encode_cloud(np.zeros((0, 3)), H)
    assert convert.decode_cloud(empty).shape == (0, 3)


@pytest.mark.debian("python3-sensor-msgs")
def test_a_cloud_is_what_ros_reads():
    P = np.random.default_rng(3).normal(size=(5, 3)).astype(np.float32)
    message = convert.encode_cloud(P, H)
    code = (
        "import sys, json; from sensor_msgs import point_cloud2, msg\n"
        "m = json.load(sys.stdin)\n"
        "fields = [msg.PointField(*f) for f in m.pop('fields')]\n"
        "cloud = msg.PointCloud2(fields=fields, data=bytes.fromhex(m.pop('data')), **m)\n"
        "print(json.dumps(list(point_cloud2.read_points(cloud))))"
    )
    names = ("height", "width", "is_bigendian", "point_step", "row_step", "is_dense")
    asked = {name: getattr(message, name) for name in names} | {"data": message.data.hex()}
    asked["fields"] = [[f.name, f.offset, f.datatype, f.count] for f in message.fields]
    done = subprocess.run(
        [SYSTEM_PYTHON, "-c", code], input=json.dumps(asked), capture_output=True, text=True, check=True
    )
    assert np.allclose(json.loads(done.stdout), P)


def test_poses_there_and_back():
    for rotation in Rotation.random(50, rng=np.random.default_rng(4)):
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = rotation.as_matrix(), rotation.as_rotvec()
        message = convert.encode_pose(T, H)
        assert np.allclose(convert.decode_pose(message), T) and message.orientation[3] >= 0.0
        turned = Pose(H, message.position, tuple(-q for q in message.orientation))
        assert np.allclose(convert.decode_pose(turned), T), "q and -q are one rotation"


def image(**changes) -> Image:
    return dataclasses.replace(Image(H, 2, 3, "rgb8", 0, 9, bytes(18)), **changes)


@pytest.mark.bad_input
@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda: convert.decode_image("image"), "message"),
        (lambda: convert.decode_image(image(encoding="yuv422")), "encoding"),
        (lambda: convert.decode_image(image(height=0)), "height"),
        (lambda: convert.decode_image(image(width=2.0)), "width"),
        (lambda: convert.decode_image(image(step=8)), "step"),
        (lambda: convert.decode_image(image(data=bytes(17))), "data"),
        (lambda: convert.rgb_image(image(encoding="32FC1", step=12, data=bytes(24))), "encoding"),
        (lambda: convert.depth_image(image()), "encoding"),
        (lambda: convert.depth_image(image(encoding="mono8")), "encoding: expected one of 16UC1, mono16, 32FC1, got"),
        (lambda: convert.check_compressed(image(), depth=False), "message"),
        (lambda: convert.check_compressed(CompressedImage(H, "jpeg", b""), depth=True), "format"),
        (lambda: convert.check_compressed(CompressedImage(H, "16UC1; compressedDepth rvl", b""), depth=True), "format"),
        (lambda: convert.check_compressed(CompressedImage(H, "bayer_rggb8; jpeg", b""), depth=False), "format"),
        (lambda: convert.decompress(CompressedImage(H, "jpeg", b""), (2, 3)), "data"),
        (lambda: convert.decompress(CompressedImage(H, "jpeg", b"no picture"), (2, 3)), "data"),
        (lambda: convert.decompress(CompressedImage(H, "32FC1; compressedDepth", bytes(11)), (2, 3)), "data"),
        (lambda: convert.encode_cloud(np.zeros((2, 3)), H, score=np.zeros(3)), "score"),
        (lambda: convert.encode_image(np.zeros((2, 3)), "mono8", H), "array"),
        (lambda: convert.encode_image(np.zeros((2, 3), np.uint8), "rgb8", H), "array"),
        (lambda: convert.camera_matrix(image()), "message"),
        (lambda: convert.camera_matrix(CameraInfo(H, 2, 3, (0.0,) * 9)), "K"),
        (lambda: convert.camera_matrix(CameraInfo(H, 0, 3, (1.0, 0, 0, 0, 1, 0, 0, 0, 1))), "height"),
        (lambda: convert.decode_cloud(image()), "message"),
        (lambda: convert.decode_cloud(PointCloud2(H, 1, 1, convert.XYZ[:2], False, 12, 12, bytes(12))), "fields"),
        (lambda: convert.decode_cloud(PointCloud2(H, 1, 1, convert.XYZ, False, 8, 8, bytes(12))), "fields"),
        (lambda: convert.decode_cloud(PointCloud2(H, 1, 2, convert.XYZ, False, 12, 24, bytes(23))), "data"),
        (lambda: convert.decode_pose(Pose(H, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0))), "orientation"),
        (lambda: convert.decode_pose(Pose(H, (0.0, 0.0), (0.0, 0.0, 0.0, 1.0))), "position"),
    ],
)
def test_what_does_not_fit_is_named(call, name):
    with pytest.raises(ValueError, match=rf"^{name}"):
        call()
