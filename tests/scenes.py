"""What tests share: boxes on a table, seen by a camera in front of it; random poses, images, frames."""

import struct
import zlib

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from labkit.frame import RGBDFrame
from labkit.labels import TARGET
from labkit.sim.spec import Camera, ObjectSpec, Part, SceneSpec

CAMERA = Camera.looking_at((0.52, 0.0, 0.0), 0.7, 0.3, 0.8)


def box(name: str, x: float, y: float, sides=(0.04, 0.06, 0.04), class_id: int = TARGET) -> ObjectSpec:
    """A box on the table with its middle over (x, y)."""
    return ObjectSpec(name, "block", class_id, (x, y, sides[2] / 2 + 0.002), parts=(Part("box", sides),))


def scene(*things: ObjectSpec) -> SceneSpec:
    """These objects on a table at height 0."""
    return SceneSpec(things, CAMERA)


def pose(seed: int) -> np.ndarray:
    """A random rigid transform (4, 4)."""
    rng = np.random.default_rng(seed)
    return RigidTransform.from_components(rng.uniform(-1.0, 1.0, 3), Rotation.random(random_state=rng)).as_matrix()


def random_image(height: int, width: int) -> np.ndarray:
    """Colours without any order."""
    return np.random.default_rng(0).integers(0, 256, (height, width, 3), dtype=np.uint8)


def png_that_claims(width: int, height: int) -> bytes:
    """A PNG of some 70 bytes whose header states a size."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    parts = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(b"0")) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + parts


def random_frame(seed: int, shape: tuple[int, int] = (24, 32)) -> RGBDFrame:
    """Random colours and labels over a slope of depths, from a camera that looks at the base, tilted down."""
    rng = np.random.default_rng(seed)
    depth = np.linspace(0.7, 1.3, shape[0], dtype=np.float32)[:, None].repeat(shape[1], axis=1)
    rgb, y = rng.integers(0, 256, (*shape, 3)).astype(np.uint8), rng.integers(0, 4, shape).astype(np.uint8)
    T_base_cam = np.eye(4)
    T_base_cam[:3] = [[0.0, -0.6, -0.8, 1.0], [1.0, 0.0, 0.0, 0.2], [0.0, -0.8, 0.6, 0.8]]
    return RGBDFrame(rgb, depth, np.array([[30.0, 0.0, 16.0], [0.0, 33.0, 10.0], [0.0, 0.0, 1.0]]), T_base_cam, y)
