"""Triangle meshes of the things in a scene: parts built here, URDFs of pybullet_data read from their files.

A mesh serves three readers: PyBullet (as an OBJ file whose groups become convex pieces), the scene sampler (how low and
how wide does the object reach?), and the tests (does a rendered point lie on the surface?).
"""

import hashlib
import importlib.util
import os
import tempfile
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from labkit.sim.spec import ObjectSpec, Part

ROUND = 32  # facets around a cylinder


@dataclass(frozen=True, eq=False)
class Mesh:
    """Vertices in metres in the object's frame, (V, 3), and triangles as rows of three vertex numbers, (F, 3)."""

    vertices: Float[np.ndarray, "V 3"]
    faces: Int[np.ndarray, "F 3"]


def data_path() -> Path:
    """The folder of pybullet_data's models, found without importing PyBullet."""
    return Path(importlib.util.find_spec("pybullet_data").origin).parent


def part_mesh(part: Part) -> Mesh:
    """Build the surface of a convex part; a cylinder has 32 facets, a sphere 16 x 32.

    Raises ValueError if `part.kind` is unknown or `part.size` has the wrong length.

    >>> part_mesh(Part("box", (0.02, 0.04, 0.06))).vertices.max(axis=0)
    array([0.01, 0.02, 0.03])
    """
    lengths = {"box": 3, "cylinder": 2, "sphere": 1, "hull": None}
    if part.kind not in lengths:
        raise ValueError(f"part.kind: expected one of {sorted(lengths)}, got {part.kind!r}")
    size = np.asarray(part.size, dtype=np.float64)
    if part.kind == "hull":
        if size.size < 12 or size.size % 3:
            raise ValueError(f"part.size: expected at least four points x, y, z in a row, got {size.size} numbers")
        points = size.reshape(-1, 3)
    elif size.shape != (lengths[part.kind],) or size.min() <= 0.0:
        raise ValueError(f"part.size: expected {lengths[part.kind]} lengths above 0 for a {part.kind}, got {part.size}")
    elif part.kind == "box":
        points = np.array(np.meshgrid(*[(-0.5, 0.5)] * 3)).reshape(3, -1).T * size
    else:
        angle = 2.0 * np.pi * np.arange(ROUND) / ROUND
        circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        if part.kind == "cylinder":
            radius, height = size
            points = np.vstack(
                [np.column_stack([radius * circle, np.full(ROUND, z)]) for z in (-height / 2, height / 2)]
            )
        else:
            polar = np.pi * np.arange(1, ROUND // 2) / (ROUND // 2)
            rings = [np.column_stack([np.sin(t) * circle, np.full(ROUND, np.cos(t))]) for t in polar]
            points = size[0] * np.vstack([[[0.0, 0.0, 1.0]], *rings, [[0.0, 0.0, -1.0]]])
    points = Rotation.from_quat(part.orientation).apply(points) + np.asarray(part.position)
    return _hull(points)


def _hull(points: Float[np.ndarray, "V 3"]) -> Mesh:
    """The convex hull of points, its triangles facing outwards."""
    hull = ConvexHull(points)
    vertices = points[hull.vertices]
    number = np.full(len(points), -1)
    number[hull.vertices] = np.arange(len(hull.vertices))
    faces = number[hull.simplices]
    a, b, c = vertices[faces].transpose(1, 0, 2)
    inward = np.einsum("fi,fi->f", np.cross(b - a, c - a), hull.equations[:, :3]) < 0.0
    faces[inward] = faces[inward][:, ::-1]
    return Mesh(vertices, faces)


@lru_cache(maxsize=256)
def _urdf_mesh(urdf: str) -> Mesh:
    """The visual meshes of a one-link URDF of pybullet_data, in the link's frame, before any scaling of the whole."""
    path = data_path() / urdf
    vertices, faces, count = [], [], 0
    for visual in ElementTree.parse(path).getroot().iter("visual"):
        mesh = visual.find("geometry/mesh")
        origin = visual.find("origin")
        mesh_vertices, mesh_faces = read_obj(path.parent / mesh.get("filename"))
        mesh_vertices = mesh_vertices * np.array([float(s) for s in mesh.get("scale", "1 1 1").split()])
        if origin is not None:
            rpy = [float(s) for s in origin.get("rpy", "0 0 0").split()]
            xyz = [float(s) for s in origin.get("xyz", "0 0 0").split()]
            mesh_vertices = Rotation.from_euler("xyz", rpy).apply(mesh_vertices) + np.array(xyz)
        vertices.append(mesh_vertices)
        faces.append(mesh_faces + count)
        count += len(mesh_vertices)
    if not vertices:
        raise ValueError(f"urdf: expected a visual mesh in {urdf}, found none")
    return Mesh(np.vstack(vertices), np.vstack(faces))


def read_obj(path: Path) -> tuple[Float[np.ndarray, "V 3"], Int[np.ndarray, "F 3"]]:
    """Read the vertices and the triangles of an OBJ file; a polygon is split into a fan."""
    vertices, faces = [], []
    for line in Path(path).read_text(errors="replace").splitlines():
        kind, *rest = line.split() or [""]
        if kind == "v":
            vertices.append([float(x) for x in rest[:3]])
        elif kind == "f":
            corner = [int(x.split("/")[0]) for x in rest]
            corner = [c - 1 if c > 0 else c + len(vertices) for c in corner]
            faces.extend([corner[0], corner[i], corner[i + 1]] for i in range(1, len(corner) - 1))
    return np.array(vertices, dtype=np.float64), np.array(faces, dtype=np.int64)


def object_mesh(thing: ObjectSpec) -> Mesh:
    """The visual surface of an object in its own frame, as the renderer draws it; metres."""
    if thing.urdf is not None:
        mesh = _urdf_mesh(thing.urdf)
        return Mesh(mesh.vertices * thing.scale, mesh.faces)
    meshes = [part_mesh(part) for part in thing.parts]
    starts = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes[:-1]])
    return Mesh(
        np.vstack([mesh.vertices for mesh in meshes]) * thing.scale,
        np.vstack([mesh.faces + start for mesh, start in zip(meshes, starts, strict=True)]),
    )


def file_for(content: bytes, suffix: str) -> str:
    """Keep bytes in a temporary file whose name is their hash, and return its path.

    PyBullet takes meshes and textures from files and caches them by name, so one name must never mean two contents.
    """
    folder = Path(tempfile.gettempdir()) / f"labkit-{os.getuid()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    path = folder / (hashlib.sha256(content).hexdigest()[:24] + suffix)
    if not path.exists():
        unfinished = path.with_name(f"{path.name}.{os.getpid()}.tmp")
        unfinished.write_bytes(content)
        unfinished.replace(path)
    return str(path)


def parts_file(parts: tuple[Part, ...], scale: float = 1.0) -> str:
    """Write parts as an OBJ file, one group a part: PyBullet draws it all and collides with each group's hull."""
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
    return file_for("\n".join([*lines, ""]).encode(), ".obj")


def _shading_normals(mesh: Mesh, smooth: bool) -> Float[np.ndarray, "F 3 3"]:
    """A normal for each corner of each triangle: the facet's own, or the mean over nearly parallel ones."""
    a, b, c = mesh.vertices[mesh.faces].transpose(1, 0, 2)
    area = np.cross(b - a, c - a)
    flat = area / np.linalg.norm(area, axis=1, keepdims=True)
    if not smooth:
        return np.repeat(flat[:, None], 3, axis=1)
    normals = np.empty((len(mesh.faces), 3, 3))
    for face, corners in enumerate(mesh.faces):
        for i, vertex in enumerate(corners):
            near = (mesh.faces == vertex).any(axis=1) & (flat @ flat[face] > 0.77)
            total = area[near].sum(axis=0)
            normals[face, i] = total / np.linalg.norm(total)
    return normals
