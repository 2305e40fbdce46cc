"""What would the arm touch? The arm as convex hulls, the world as what the camera saw: points and a table plane.

A convex hull is a list of half-spaces, so a point p is inside it, grown by a margin, when A p + b <= margin in every
row. That one test serves the scene's cloud and, with points sampled on the arm's own surface, self-collision.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
import trimesh
from jaxtyping import Bool, Float
from scipy.spatial import cKDTree

from labkit.sim.kinematics import HAND_TO_FINGERS, link_frames
from labkit.sim.shapes import data_path, read_mesh

ARM = (*(f"link{i}" for i in range(8)), "hand")
FINGERS = ("left finger", "right finger")
OUTER, INNER = ("link5", "link6", "link7", "hand", *FINGERS), ("link0", "link1", "link2")
# Pairs that neither joints nor limits keep apart. Links 5 and 7 never meet: it is only the hull of link 5, which
# fills the hollow of its elbow, that overlaps there.
SELF_PAIRS = (*((outer, inner) for outer in OUTER for inner in INNER), ("hand", "link5"))
ABOVE_TABLE = ("link3", "link4", *OUTER)
SELF_MARGIN = 0.005  # m


@dataclass(frozen=True, eq=False)
class Hull:
    """A convex piece of the arm in its link's frame: A p + b <= 0 inside, rows of A of length 1; metres.

    surface holds its corners and the centres of its facets; centre and radius bound it by a ball.
    """

    A: Float[np.ndarray, "F 3"]
    b: Float[np.ndarray, "F"]
    corners: Float[np.ndarray, "V 3"]
    surface: Float[np.ndarray, "S 3"]
    centre: Float[np.ndarray, "3"]
    radius: float

    def holds(self, points: Float[np.ndarray, "N 3"], margin: float) -> Bool[np.ndarray, "N"]:
        """Which points (in the link's frame) lie inside the hull grown by margin: only those in the ball can."""
        offset = points - self.centre
        inside = np.einsum("ni,ni->n", offset, offset) <= (self.radius + margin) ** 2
        inside[inside] = (points[inside] @ self.A.T + self.b).max(axis=1, initial=-np.inf) <= margin
        return inside


@dataclass(frozen=True)
class Margin:
    """How far the arm and the fingers keep from points, and all of it from the table; metres. Below 0: may graze."""

    arm: float = 0.015
    fingers: float = 0.015
    table: float = 0.01


@cache
def hulls() -> dict[str, Hull]:
    """The convex hulls of the arm's collision meshes, as PyBullet takes them too; the fingers in the hand's frame."""
    folder = data_path() / "franka_panda/meshes/collision"
    meshes = {name: read_mesh(folder / f"{name}.obj").vertices for name in ARM}
    finger = read_mesh(folder / "finger.obj").vertices + np.array([0.0, 0.0, HAND_TO_FINGERS])
    meshes["left finger"], meshes["right finger"] = finger, finger * np.array([-1.0, -1.0, 1.0])
    return {name: _hull(trimesh.convex.convex_hull(vertices)) for name, vertices in meshes.items()}


def _hull(mesh: trimesh.Trimesh) -> Hull:
    """The half-spaces of a convex mesh, one for each plane, and points on it."""
    offsets = -np.einsum("fi,fi->f", mesh.face_normals, mesh.triangles[:, 0])
    planes = np.unique(np.column_stack([mesh.face_normals, offsets]).round(4), axis=0)
    corners, centre = np.asarray(mesh.vertices), mesh.bounds.mean(axis=0)
    return Hull(
        A=planes[:, :3],
        b=planes[:, 3],
        corners=corners,
        surface=np.vstack([corners, mesh.triangles_center]),
        centre=centre,
        radius=float(np.linalg.norm(corners - centre, axis=1).max()),
    )


def hull_frames(path: Float[np.ndarray, "N 7"], finger: float) -> dict[str, Float[np.ndarray, "N 4 4"]]:
    """T_base_hull of every hull along a path of joint angles, with each finger `finger` metres from the middle."""
    frames = link_frames(path)
    named = {name: frames[:, i] for i, name in enumerate(ARM)}
    for name, side in zip(FINGERS, (1.0, -1.0), strict=True):
        T_hand_finger = np.eye(4)
        T_hand_finger[1, 3] = side * finger
        named[name] = named["hand"] @ T_hand_finger
    return named


def first_contact(
    path: Float[np.ndarray, "N 7"],
    finger: float,
    points: Float[np.ndarray, "M 3"],
    table_z: float,
    margin: Margin,
) -> str | None:
    """What the arm would touch along a path of joint angles, in words, or None if it stays clear.

    points: what is in the way, base frame, metres. table_z: height of the table, a plane. finger: how far each finger
    is from the middle, metres. The caller checks them.

    >>> first_contact(np.array([[0.0, 1.2, 0.0, -1.5, 0.0, 2.7, 0.8]]), 0.04, np.zeros((0, 3)), 0.0, Margin())
    'link5 would touch the table'
    """
    frames = hull_frames(path, finger)
    for name in ABOVE_TABLE:
        height = frames[name][:, 2, :3] @ hulls()[name].corners.T + frames[name][:, 2, 3:]
        if height.min() < table_z + margin.table:
            return f"{name} would touch the table"
    for outer, inner in SELF_PAIRS:
        if _meet(outer, inner, frames):
            return f"{outer} would touch {inner}"
    tree = cKDTree(points)
    for name in (*ARM[1:], *FINGERS):
        grown = margin.fingers if name in FINGERS else margin.arm
        if _touches(hulls()[name], frames[name], points, tree, grown):
            return f"{name} would touch something in the scene"
    return None


def _touches(hull: Hull, T_base_hull: Float[np.ndarray, "N 4 4"], points, tree: cKDTree, margin: float) -> bool:
    """Whether the grown hull holds a point in any of N poses: a search tree finds the points in its ball."""
    centres = T_base_hull[:, :3, :3] @ hull.centre + T_base_hull[:, :3, 3]
    for T, near in zip(T_base_hull, tree.query_ball_point(centres, hull.radius + margin), strict=True):
        if near and hull.holds((points[near] - T[:3, 3]) @ T[:3, :3], margin).any():
            return True
    return False


def _meet(outer: str, inner: str, frames) -> bool:
    """Whether two hulls of the arm come closer than SELF_MARGIN anywhere on the path."""
    a, b = hulls()[outer], hulls()[inner]
    T_inner_outer = np.linalg.inv(frames[inner]) @ frames[outer]
    centres = T_inner_outer[:, :3, :3] @ a.centre + T_inner_outer[:, :3, 3]
    close = np.linalg.norm(centres - b.centre, axis=1) < a.radius + b.radius + SELF_MARGIN
    close &= b.holds(centres, a.radius + SELF_MARGIN)
    T = T_inner_outer[close]
    surface = a.surface @ T[:, :3, :3].swapaxes(1, 2) + T[:, None, :3, 3]
    return bool(b.holds(surface.reshape(-1, 3), SELF_MARGIN).any())


def without_robot(
    points: Float[np.ndarray, "M 3"], q: Float[np.ndarray, "7"], finger: float, margin: float = 0.02
) -> Float[np.ndarray, "K 3"]:
    """Drop the points that lie on the arm itself, as it stands at q: the camera sees it too."""
    keep = np.ones(len(points), dtype=bool)
    for name, frame in hull_frames(q[None], finger).items():
        R, p = frame[0, :3, :3], frame[0, :3, 3]
        keep &= ~hulls()[name].holds((points - p) @ R, margin)
    return points[keep]


def thin(points: Float[np.ndarray, "M 3"], spacing: float = 0.005) -> Float[np.ndarray, "K 3"]:
    """Keep one point of each cube with edges of `spacing` metres: a planner needs no denser cloud.

    >>> thin(np.array([[0.001, 0.0, 0.0], [0.002, 0.0, 0.0], [0.009, 0.0, 0.0]])).shape
    (2, 3)
    """
    _, first = np.unique(np.floor(points / spacing).astype(np.int64), axis=0, return_index=True)
    return points[np.sort(first)]
