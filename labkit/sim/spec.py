"""A scene as plain data: what stands where, how it looks, and the camera that sees it (topic 07).

Nothing here knows PyBullet. A SceneSpec can be written by hand, drawn by `data_gen.sample_scene`, and loaded into a
`World`, which drops the objects from their `position` and lets them come to rest. What does not make sense is refused
at once, by a ValueError that names it. Metres, radians, base frame.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from labkit.labels import CLASSES, OBSTACLE, TARGET
from labkit.support.validation import check_finite, check_shape, check_T, require

Vector = tuple[float, ...]
PARTS = ("box", "cylinder", "sphere", "hull")


@dataclass(frozen=True)
class Texture:
    """A procedural picture: `kind` is a name in `labkit.sim.textures.KINDS`, colours are RGB in 0..1."""

    kind: str = "plain"
    colour_a: Vector = (0.6, 0.5, 0.4)
    colour_b: Vector = (0.5, 0.4, 0.3)
    scale: float = 8.0
    seed: int = 0


@dataclass(frozen=True)
class Part:
    """One convex piece of an object, in the object's frame.

    kind "box": size = three edge lengths; "cylinder": radius, height (its axis is z); "sphere": radius; "hull": the
    coordinates x, y, z of at least four points in a row, whose convex hull is the part. orientation: quaternion
    x, y, z, w.
    """

    kind: str
    size: Vector
    position: Vector = (0.0, 0.0, 0.0)
    orientation: Vector = (0.0, 0.0, 0.0, 1.0)

    def __post_init__(self):
        require("part.kind", self.kind in PARTS, f"one of {', '.join(PARTS)}", repr(self.kind))


@dataclass(frozen=True)
class ObjectSpec:
    """One thing on the table: either a URDF of pybullet_data or a few convex parts.

    name is unique in its scene; family says what it is; class_id is labels.TARGET or labels.OBSTACLE. scale multiplies
    the size. mass in kg. position and orientation (unit quaternion x, y, z, w) place the object's frame in the base
    frame before it settles.
    """

    name: str
    family: str
    class_id: int
    position: Vector
    orientation: Vector = (0.0, 0.0, 0.0, 1.0)
    urdf: str | None = None
    scale: float = 1.0
    parts: tuple[Part, ...] = ()
    colour: Vector = (0.8, 0.2, 0.2)
    mass: float = 0.1
    friction: float = 0.8

    def __post_init__(self):
        named = f"object {self.name!r}"
        require(named, (self.urdf is None) != (not self.parts), "either a urdf or parts", (self.urdf, self.parts))
        if self.class_id not in (TARGET, OBSTACLE):
            raise ValueError(f"class_id: expected {TARGET} (target) or {OBSTACLE} (obstacle), got {self.class_id!r}")
        check_finite("position", check_shape("position", self.position, (3,)))
        length = np.linalg.norm(check_finite("orientation", check_shape("orientation", self.orientation, (4,))))
        require("orientation", abs(length - 1.0) <= 0.01, "a unit quaternion x, y, z, w", f"one of length {length:.3g}")
        for name in ("mass", "scale"):
            require(name, 0.0 < getattr(self, name) < np.inf, "a number above 0", getattr(self, name))


@dataclass(frozen=True)
class Table:
    """A box whose top is the surface, at height `z` of the base frame; size: length in x, width in y, thickness."""

    centre: Vector = (0.55, 0.0)
    size: Vector = (0.7, 1.1, 0.05)
    z: float = 0.0
    texture: Texture = Texture()


@dataclass(frozen=True)
class Furniture:
    """A fixed box that is no thing to grasp: a bin's wall or floor, a shelf, a second table.

    size: lengths in x, y and z before it is turned about `centre`, by `pitch` about y (its side at +x sinks) and
    then by `yaw` about the vertical, radians. surface: whether its pixels are labelled surface, as the table's are, and
    not background.
    """

    size: Vector
    centre: Vector
    texture: Texture = Texture()
    yaw: float = 0.0
    surface: bool = False
    pitch: float = 0.0


@dataclass(frozen=True)
class Camera:
    """A pinhole camera: its pose in the base frame, (4, 4), kept row by row, and its vertical field of view.

    renderer: "tiny", PyBullet's own, or "egl", OpenGL without a window: other shading, softer shadows, another K.
    sensor: "exact" depth, or "stereo", as labkit.geometry.sensor.StereoSensor measures it.
    """

    T_base_cam: Sequence[Sequence[float]] | Float[np.ndarray, "4 4"]
    fov_y: float = 0.8
    near: float = 0.1
    far: float = 6.0
    renderer: str = "tiny"
    sensor: str = "exact"

    def __post_init__(self):
        require("renderer", self.renderer in ("tiny", "egl"), '"tiny" or "egl"', repr(self.renderer))
        require("sensor", self.sensor in ("exact", "stereo"), '"exact" or "stereo"', repr(self.sensor))
        T = check_T("T_base_cam", self.T_base_cam)
        object.__setattr__(self, "T_base_cam", tuple(map(tuple, T.tolist())))
        got = f"{self.fov_y}; np.radians makes them of degrees"
        require("fov_y", 0.0 < self.fov_y < np.pi, "radians between 0 and pi", got)
        if not 0.0 < self.near < self.far < np.inf:
            raise ValueError(f"near, far: expected 0 < near < far in metres, got {self.near} and {self.far}")

    @classmethod
    def looking_at(
        cls, target, distance: float, azimuth: float, elevation: float, roll: float = 0.0, **rest
    ) -> "Camera":
        """Place the camera on a sphere around `target`; radians, azimuth from the base's x axis, roll about the ray."""
        outward = np.array(
            [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
        )
        z = -outward
        x = np.cross(z, (0.0, 0.0, 1.0))
        x /= np.linalg.norm(x)
        y = np.cross(z, x)
        T = np.eye(4)
        T[:3, 0] = np.cos(roll) * x + np.sin(roll) * y
        T[:3, 1] = -np.sin(roll) * x + np.cos(roll) * y
        T[:3, 2] = z
        T[:3, 3] = np.asarray(target) + distance * outward
        return cls(T, **rest)


@dataclass(frozen=True)
class Light:
    """The lamp: where it shines from (base frame), its colour, and how much of it is ambient, diffuse and specular.

    distance: of the lamp from the base frame's origin, metres; it matters to shadows alone. From 4 m those of small
    things fall on the table; from 2 m a TinyRenderer mostly loses them.
    """

    direction: Vector = (0.5, 0.3, 1.0)
    colour: Vector = (1.0, 1.0, 1.0)
    ambient: float = 0.6
    diffuse: float = 0.5
    specular: float = 0.05
    shadow: bool = True
    distance: float = 2.0


@dataclass(frozen=True)
class SceneSpec:
    """Everything that a World needs. The robot's base link stands at the origin; floor and walls are background.

    sheet: x, y and yaw (metres, radians) of the printed sheet of `labkit.geometry.sheet`, if one lies on the table: its
    origin is the board's lower left corner. It is paper: things stand on the table through it.
    joints: the arm's, 7 angles (rad) and 2 fingers (m), where it stands; None is its home.
    """

    objects: tuple[ObjectSpec, ...]
    camera: Camera
    table: Table = Table()
    light: Light = Light()
    floor: Texture = Texture(kind="plain", colour_a=(0.4, 0.4, 0.42))
    walls: Texture = Texture(kind="plain", colour_a=(0.75, 0.74, 0.7))
    robot: bool = True
    furniture: tuple[Furniture, ...] = ()
    joints: Vector | None = None
    sheet: Vector | None = None
    seed: int = 0
    config: str = "by hand"

    def __post_init__(self):
        names = [thing.name for thing in self.objects]
        require("objects", len(set(names)) == len(names), "unique names", names)
        if self.joints is not None:
            check_finite("joints", check_shape("joints", self.joints, (9,)))
        if self.sheet is not None:
            check_finite("sheet", check_shape("sheet", self.sheet, (3,)))
        for thing in self.objects:
            off = np.abs(np.subtract(thing.position[:2], self.table.centre)) > np.array(self.table.size[:2]) / 2
            where = f"{self.table.size[:2]} m around {self.table.centre}"
            require("objects", not off.any(), f"{thing.name!r} over the table, {where}", f"position {thing.position}")

    def __repr__(self) -> str:
        return f"SceneSpec({self.config}, seed {self.seed}: {', '.join(thing.name for thing in self.objects)})"

    def class_counts(self) -> dict[str, int]:
        """How many objects there are of each class name."""
        return {CLASSES[c]: sum(thing.class_id == c for thing in self.objects) for c in (TARGET, OBSTACLE)}
