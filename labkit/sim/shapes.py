"""Triangle meshes of the things in a scene: parts built here, URDFs of pybullet_data read from their files.

A mesh serves three readers: PyBullet (as an OBJ file whose groups become convex pieces), the scene sampler (how low and
how wide does the object reach?), and tests (does a rendered point lie on the surface?). Metres.
"""

import hashlib
import importlib.util
import os
import re
import secrets
import tempfile
import threading
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache, lru_cache
from pathlib import Path

import numpy as np
import trimesh
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from labkit.sim.spec import ObjectSpec, Part
from labkit.support.files import write_atomically
from labkit.support.validation import require

ROUND = 32  # facets around a cylinder
LENGTHS = {"box": 3, "cylinder": 2, "sphere": 1}


def data_path() -> Path:
    """The folder of pybullet_data's models, found without importing PyBullet."""
    return Path(importlib.util.find_spec("pybullet_data").origin).parent


def urdf_path(urdf: str) -> Path:
    """The file of a URDF of pybullet_data. Raises ValueError if there is none."""
    path = data_path() / urdf
    require("urdf", path.is_file(), "a file of pybullet_data such as 'duck_vhacd.urdf'", repr(urdf))
    return path


@lru_cache(maxsize=1024)
def part_mesh(part: Part) -> trimesh.Trimesh:
    """Build the surface of a convex part; a cylinder has 32 facets, a sphere 16 x 32.

    Raises ValueError if `part.kind` is unknown or `part.size` has the wrong length.

    >>> part_mesh(Part("box", (0.02, 0.04, 0.06))).extents
    array([0.02, 0.04, 0.06])
    """
    points = Rotation.from_quat(part.orientation).apply(_points_of(part)) + np.asarray(part.position)
    return trimesh.convex.convex_hull(points, qhull_options="Qt")


def _points_of(part: Part) -> Float[np.ndarray, "V 3"]:
    """Points whose convex hull is the part, in its own frame."""
    size = np.asarray(part.size, dtype=np.float64)
    if part.kind == "hull":
        if size.size < 12 or size.size % 3:
            raise ValueError(f"part.size: expected at least four points x, y, z in a row, got {size.size} numbers")
        return size.reshape(-1, 3)
    require("part.kind", part.kind in LENGTHS, f"one of {sorted([*LENGTHS, 'hull'])}", repr(part.kind))
    if size.shape != (LENGTHS[part.kind],) or not size.min() > 0.0:
        raise ValueError(f"part.size: expected {LENGTHS[part.kind]} lengths above 0 for a {part.kind}, got {part.size}")
    if part.kind == "box":
        return np.array(np.meshgrid(*[(-0.5, 0.5)] * 3)).reshape(3, -1).T * size
    angle = 2.0 * np.pi * np.arange(ROUND) / ROUND
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    if part.kind == "cylinder":
        radius, height = size
        return np.vstack([np.column_stack([radius * circle, np.full(ROUND, z)]) for z in (-height / 2, height / 2)])
    polar = np.pi * np.arange(1, ROUND // 2) / (ROUND // 2)
    rings = [np.column_stack([np.sin(t) * circle, np.full(ROUND, np.cos(t))]) for t in polar]
    return size[0] * np.vstack([[[0.0, 0.0, 1.0]], *rings, [[0.0, 0.0, -1.0]]])


def read_mesh(path: Path) -> trimesh.Trimesh:
    """Read a mesh file as it is, its vertices neither merged nor sorted."""
    return trimesh.load_mesh(path, process=False, skip_materials=True)


@lru_cache(maxsize=256)
def _urdf_mesh(urdf: str) -> trimesh.Trimesh:
    """The visual meshes of a one-link URDF of pybullet_data, in the link's frame, before any scaling of the whole."""
    path = urdf_path(urdf)
    meshes = []
    text = re.sub(rb"^\s*<\?xml.*?\?>", b"", path.read_bytes())  # version="0.0", say some, which newer parsers refuse
    for visual in ElementTree.fromstring(text).iter("visual"):
        named, origin = visual.find("geometry/mesh"), visual.find("origin")
        mesh = read_mesh(path.parent / named.get("filename"))
        vertices = mesh.vertices * np.array([float(s) for s in named.get("scale", "1 1 1").split()])
        if origin is not None:
            rpy, xyz = ([float(s) for s in origin.get(name, "0 0 0").split()] for name in ("rpy", "xyz"))
            vertices = Rotation.from_euler("xyz", rpy).apply(vertices) + np.array(xyz)
        meshes.append(trimesh.Trimesh(vertices, mesh.faces, process=False))
    if not meshes:
        raise ValueError(f"urdf: expected a visual mesh in {urdf}, found none")
    return trimesh.util.concatenate(meshes)


def object_mesh(thing: ObjectSpec) -> trimesh.Trimesh:
    """The visual surface of an object in its own frame, as the renderer draws it."""
    parts = [_urdf_mesh(thing.urdf)] if thing.urdf is not None else [part_mesh(part) for part in thing.parts]
    mesh = trimesh.util.concatenate(parts) if len(parts) > 1 else parts[0]
    return trimesh.Trimesh(mesh.vertices * thing.scale, mesh.faces, process=False)


def parts_as_obj(parts: tuple[Part, ...], scale: float = 1.0) -> bytes:
    """Write parts as an OBJ file, one group for each: PyBullet draws it all and collides with each group's hull."""
    lines, count = [], 0
    for number, part in enumerate(parts):
        mesh = part_mesh(part)
        corners = (mesh.vertices * scale)[mesh.faces]
        normals = _shading_normals(mesh, smooth=part.kind in ("cylinder", "sphere"))
        lines.append(f"o part{number}")
        lines += [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in corners.reshape(-1, 3)]
        lines += [f"vn {x:.4f} {y:.4f} {z:.4f}" for x, y, z in normals.reshape(-1, 3)]
        for face in range(len(mesh.faces)):
            a, b, c = (count + 3 * face + i + 1 for i in range(3))
            lines.append(f"f {a}//{a} {b}//{b} {c}//{c}")
        count += 3 * len(mesh.faces)
    return "\n".join([*lines, ""]).encode()


def _shading_normals(mesh: trimesh.Trimesh, smooth: bool) -> Float[np.ndarray, "F 3 3"]:
    """A normal for each corner of each triangle: the facet's own, or the mean over nearly parallel ones.

    trimesh weighs by angles instead of areas: other normals, and every rendered cylinder and ball would change.
    """
    faces = np.asarray(mesh.faces)
    a, b, c = np.asarray(mesh.vertices)[faces].transpose(1, 0, 2)
    area = np.cross(b - a, c - a)
    flat = area / np.linalg.norm(area, axis=1, keepdims=True)
    if not smooth:
        return np.repeat(flat[:, None], 3, axis=1)
    nearly_parallel = flat @ flat.T > 0.77
    meets = (faces[None] == np.arange(len(mesh.vertices))[:, None, None]).any(axis=2)  # vertex, facet
    normals = np.stack([(meets[faces[:, i]] & nearly_parallel).astype(float) @ area for i in range(3)], axis=1)
    return normals / np.linalg.norm(normals, axis=2, keepdims=True)


_one_at_a_time = threading.Lock()


@cache
def _folder_of(process: int) -> Path:
    """Where a process keeps such a file: always the same place, which nobody else can foresee."""
    return Path(tempfile.gettempdir()) / f"labkit-{process}-{secrets.token_hex(8)}"


@contextmanager
def as_file(content: bytes, suffix: str) -> Iterator[str]:
    """Keep bytes in a file while the block runs, and give its path: PyBullet takes meshes and textures from files only.

    PyBullet remembers files by their names, so a name is the hash of the content: never one name for two contents. The
    folder, which no other user may enter, is there as long as the file: a process that is killed leaves none behind.
    """
    folder = _folder_of(os.getpid())
    path = folder / (hashlib.sha256(content).hexdigest()[:24] + suffix)
    with _one_at_a_time:
        folder.mkdir(mode=0o700)
        try:
            write_atomically(path, content)
            yield str(path)
        finally:
            path.unlink(missing_ok=True)
            folder.rmdir()
