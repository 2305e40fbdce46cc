"""Random scenes: a table with targets among obstacles, seen by a camera that stands somewhere before the robot."""

import colorsys
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from data_gen import clutter
from data_gen.cameras import Ranges, check_camera
from data_gen.families import FAMILIES, quaternion
from data_gen.wide import WIDE
from labkit.labels import OBSTACLE, TARGET
from labkit.sim.shapes import object_mesh
from labkit.sim.spec import Camera, Light, ObjectSpec, SceneSpec, Table, Texture
from labkit.sim.world import intrinsics
from labkit.support.validation import require

DROP_HEIGHT = 0.002  # objects start this far above the table
TARGET_AREA = ((0.40, 0.62), (-0.20, 0.20))  # x and y of target centres: well within the arm's reach
OBSTACLE_AREA = ((0.34, 0.72), (-0.36, 0.36))


@dataclass(frozen=True)
class SceneConfig:
    """What scenes of one kind have in common; `stream` keeps equal seeds of two configs from giving equal scenes.

    Ranges are (low, high): distance in metres, elevation in radians above the table (several ranges are drawn from with
    equal chance), roll about the line of sight up to so many radians. hard: object proportions and models that training
    never sees. wide: every other object is of `data_gen.wide`'s proportions. fov_y: of the camera, radians. renderer,
    sensor: as in `labkit.sim.spec.Camera`. crowd: so many things of any class, dropped as they fall
    (`data_gen.clutter`), in place of targets among obstacles. bins: the share of scenes whose things lie in a bin.
    sizes: factor of things that are not of a household's size. painted: things have patches and stripes of other
    colours. messy: what holds and surrounds a crowd is of more kinds: bins are moulded and often black, furniture
    stands about the table, the arm hangs lower, and neighbours often have like colours.
    """

    stream: int
    hard: bool = False
    wide: bool = False
    surfaces: tuple[str, ...] = ("plain", "wood", "clouds", "speckle", "stripes")
    elevations: tuple[tuple[float, float], ...] = ((0.38, 0.95),)
    distance: tuple[float, float] = (0.6, 1.15)
    roll: float = 0.15
    targets: tuple[int, int] = (1, 3)
    obstacles: tuple[int, int] = (3, 8)
    fov_y: tuple[float, float] = (0.55, 0.85)
    renderer: str = "tiny"
    sensor: str = "exact"
    crowd: tuple[int, int] | None = None
    bins: float = 0.0
    sizes: tuple[float, float] = (1.0, 1.0)
    painted: bool = False
    messy: bool = False


CROWDED = {
    "roll": 3.1,
    "fov_y": (0.55, 0.95),
    "sizes": (1.0, 1.8),
    "painted": True,
}
CONFIGS = {
    "train": SceneConfig(stream=0),
    "test": SceneConfig(stream=1),
    "hard": SceneConfig(
        stream=2,
        hard=True,
        surfaces=("checker", "dots", "bricks"),
        elevations=((0.32, 0.38), (0.95, 1.20)),
    ),
    "wide": SceneConfig(
        stream=3,
        wide=True,
        elevations=((0.25, 0.32), (0.38, 0.95), (0.38, 0.95)),  # but for the views of hard
        distance=(0.5, 1.3),
        roll=0.35,
        obstacles=(3, 9),
    ),
    "any": SceneConfig(
        stream=5,
        wide=True,
        elevations=((0.25, 0.38), (0.38, 0.95), (0.95, 1.25), (1.25, 1.56)),  # hard's and other's views among them
        distance=(0.45, 1.3),
        roll=3.1,
        fov_y=(0.55, 0.95),
        obstacles=(3, 9),
    ),
    "other": SceneConfig(
        stream=4,
        elevations=((1.20, 1.50),),
        distance=(0.45, 0.75),
        roll=3.1,
        fov_y=(0.95, 1.25),
        renderer="egl",
        sensor="stereo",
    ),
    "clutter": SceneConfig(
        stream=6, crowd=(1, 20), elevations=((0.3, 0.7), (0.7, 1.1), (1.1, 1.56)), distance=(0.5, 1.4), **CROWDED
    ),
    "bin": SceneConfig(
        stream=7, crowd=(2, 20), bins=1.0, elevations=((0.6, 1.0), (1.0, 1.56)), distance=(0.5, 1.1), **CROWDED
    ),
    "messy": SceneConfig(
        stream=8,
        crowd=(1, 20),
        bins=0.5,
        elevations=((0.3, 0.7), (0.7, 1.1), (1.1, 1.56)),
        distance=(0.5, 1.4),
        messy=True,
        **CROWDED,
    ),
}

MOST_TRIES = 10_000  # to find a camera that sees all targets


def sample_scene(seed: int, config: str = "train", camera: Ranges | None = None) -> SceneSpec:
    """Draw a scene; the same seed, config and camera give the same scene.

    config: "train", "test" (the same distribution, other scenes), "hard" (shapes, textures and viewpoints that are not
    in train), "wide" (more proportions, viewpoints and clutter than train, none of them hard's: training data), "any"
    (wide's objects from every elevation up to 89 degrees, at any roll: training data as well), "other" (test's objects
    as another camera sees them: from overhead, wide-angled, drawn by another renderer, with depth of a stereo pair),
    "clutter" (1 to 20 things from a marker to a jug, in heaps or loosely, on tables that end in view, beside shelves,
    with the arm in the picture: training data), "bin" (such things in a bin) or "messy" (both, before more kinds of
    bins and furniture: training data). camera: ranges in place of the config's own, metres and degrees, as
    `data_gen.cameras.check_camera` says: the things of the scene stay. Raises ValueError for a negative seed, an
    unknown config, or a camera that makes no sense or sees no target.

    >>> spec = sample_scene(7, "test")
    >>> spec == sample_scene(7, "test"), spec.class_counts()["target"] in (1, 2, 3)
    (True, True)
    """
    require("config", config in CONFIGS, f"one of {sorted(CONFIGS)}", repr(config))
    require("seed", isinstance(seed, (int, np.integer)) and seed >= 0, "an integer of at least 0", repr(seed))
    kind = _with_camera(CONFIGS[config], camera)
    rng = np.random.default_rng([kind.stream, int(seed)])
    if kind.crowd:
        return _crowded(rng, kind, int(seed), config)
    table = _table(rng, kind)
    azimuth = float(rng.uniform(-1.75, 1.75))
    objects = _objects(rng, kind, table, azimuth)
    return SceneSpec(
        objects=objects,
        camera=_camera(rng, kind, azimuth, np.array([o.position for o in objects if o.class_id == TARGET])),
        table=table,
        light=_light(rng),
        floor=_texture(rng, kind),
        walls=_texture(rng, kind),
        seed=int(seed),
        config=config,
    )


def _with_camera(kind: SceneConfig, camera: Ranges | None) -> SceneConfig:
    """A config with the ranges of a camera in place of its own."""
    ranges = check_camera(camera)
    radians = {key: tuple(float(end) for end in np.radians(ends)) for key, ends in ranges.items() if key != "distance"}
    changed = {"distance": tuple(ranges["distance"])} if "distance" in ranges else {}
    changed |= {"elevations": (radians["elevation"],)} if "elevation" in radians else {}
    changed |= {"roll": radians["roll"][1]} if "roll" in radians else {}
    changed |= {"fov_y": radians["fov_y"]} if "fov_y" in radians else {}
    return replace(kind, **changed) if changed else kind


def _crowded(rng: np.random.Generator, kind: SceneConfig, seed: int, config: str) -> SceneSpec:
    """Draw a scene of things as they fall, on a table or in a bin."""
    if kind.messy:
        return _messy(rng, kind, seed, config)
    table = clutter.table(rng, _texture(rng, kind))
    count = int(rng.integers(kind.crowd[0], kind.crowd[1] + 1))
    furniture = clutter.second_plane(rng, table, _texture(rng, kind))
    if rng.random() < kind.bins:
        area, walls = clutter.bin_around(rng, table, _colour(rng))
        furniture = (*walls, *furniture)
    else:
        area = clutter.heap_area(rng, table, count)
    objects = clutter.things(rng, table, area, count, kind.sizes, lambda: _object_colour(rng, table))
    return SceneSpec(
        objects=objects,
        camera=_camera(rng, kind, float(rng.uniform(-1.75, 1.75)), np.array([[area.x, area.y, area.z + 0.03]])),
        table=table,
        light=_light(rng),
        floor=_texture(rng, kind),
        walls=_texture(rng, kind),
        furniture=furniture,
        joints=clutter.arm(rng, table),
        seed=seed,
        config=config,
    )


def _messy(rng: np.random.Generator, kind: SceneConfig, seed: int, config: str) -> SceneSpec:
    """Draw a scene of things as they fall, on a table or in a moulded bin, amid furniture."""
    table = clutter.table(rng, _texture(rng, kind))
    count, azimuth = int(rng.integers(kind.crowd[0], kind.crowd[1] + 1)), float(rng.uniform(-1.75, 1.75))
    furniture = [*clutter.second_plane(rng, table, _texture(rng, kind))]
    furniture += clutter.bystanders(rng, table, azimuth, lambda: _texture(rng, kind))
    if rng.random() < kind.bins:
        area, walls = clutter.moulded_bin(rng, table, _shade(rng) if rng.random() < 0.5 else _colour(rng))
        furniture += walls
    else:
        area = clutter.heap_area(rng, table, count)
    few = [_object_colour(rng, table) for _ in range(rng.integers(1, 4))]
    alike = rng.choice([0.0, 0.0, 0.7])
    objects = clutter.things(
        rng,
        table,
        area,
        count,
        kind.sizes,
        lambda: few[rng.integers(len(few))] if rng.random() < alike else _object_colour(rng, table),
    )
    return SceneSpec(
        objects=objects,
        camera=_camera(rng, kind, azimuth, np.array([[area.x, area.y, area.z + 0.03]])),
        table=table,
        light=_light(rng),
        floor=_texture(rng, kind),
        walls=_texture(rng, kind),
        furniture=tuple(furniture),
        joints=clutter.arm(rng, table, clear=float(rng.uniform(0.12, 0.3))),
        seed=seed,
        config=config,
    )


def _shade(rng: np.random.Generator) -> tuple[float, float, float]:
    """Black or a dark grey, hardly coloured."""
    return colorsys.hsv_to_rgb(rng.uniform(), rng.uniform(0.0, 0.3), rng.uniform(0.01, 0.25))


def _colour(rng: np.random.Generator) -> tuple[float, float, float]:
    """Any hue, from grey to saturated, not black: one distribution for all objects, so that colour tells nothing."""
    return colorsys.hsv_to_rgb(rng.uniform(), rng.uniform(0.0, 1.0) ** 0.7, rng.uniform(0.25, 1.0))


def _texture(rng: np.random.Generator, kind: SceneConfig) -> Texture:
    """Two shades of one colour, sometimes two colours."""
    a = _colour(rng)
    b = (
        _colour(rng)
        if rng.random() < 0.2
        else tuple(float(c) for c in np.clip(np.array(a) * rng.uniform(0.6, 0.95), 0, 1))
    )
    name = str(rng.choice(kind.surfaces))
    return Texture(name, a, b, float(rng.uniform(4.0, 14.0)), int(rng.integers(2**31)))


def _table(rng: np.random.Generator, kind: SceneConfig) -> Table:
    return Table(
        centre=(0.55, float(rng.uniform(-0.05, 0.05))),
        size=(float(rng.uniform(0.62, 0.78)), float(rng.uniform(0.95, 1.3)), float(rng.uniform(0.03, 0.08))),
        z=float(rng.uniform(-0.04, 0.04)),
        texture=_texture(rng, kind),
    )


def _light(rng: np.random.Generator) -> Light:
    azimuth, height = rng.uniform(-np.pi, np.pi), rng.uniform(0.6, 1.4)
    return Light(
        direction=(
            float(np.cos(azimuth) * np.cos(height)),
            float(np.sin(azimuth) * np.cos(height)),
            float(np.sin(height)),
        ),
        colour=tuple(float(c) for c in rng.uniform(0.85, 1.0, 3)),
        ambient=float(rng.uniform(0.4, 0.65)),
        diffuse=float(rng.uniform(0.3, 0.6)),
        specular=float(rng.uniform(0.0, 0.3)),
        shadow=bool(rng.random() < 0.85),
    )


def _camera(rng: np.random.Generator, kind: SceneConfig, azimuth: float, targets: Float[np.ndarray, "N 3"]) -> Camera:
    """A camera on the side of `azimuth` (radians from the base's x axis), drawn until it sees all of these places."""
    for _ in range(MOST_TRIES):
        low, high = kind.elevations[rng.integers(len(kind.elevations))]
        camera = Camera.looking_at(
            targets.mean(axis=0) + rng.uniform(-0.08, 0.08, 3) * (1.0, 1.0, 0.3),
            distance=rng.uniform(*kind.distance),
            azimuth=azimuth,
            elevation=rng.uniform(low, high),
            roll=rng.uniform(-kind.roll, kind.roll),
            fov_y=float(rng.uniform(*kind.fov_y)),
            renderer=kind.renderer,
            sensor=kind.sensor,
        )
        T_cam_base = np.linalg.inv(np.array(camera.T_base_cam))
        P_cam = targets @ T_cam_base[:3, :3].T + T_cam_base[:3, 3]
        K = intrinsics(camera.fov_y, 320, 240)
        pixels = P_cam @ K.T
        u, v = pixels[:, 0] / pixels[:, 2], pixels[:, 1] / pixels[:, 2]
        if (P_cam[:, 2] > 0.3).all() and (abs(u - 160) < 136).all() and (abs(v - 120) < 100).all():
            return camera
    low, high = kind.distance
    raise ValueError(f"camera: expected one that sees all targets, found none at {low:g} to {high:g} m: further away?")


def _objects(rng, kind: SceneConfig, table: Table, azimuth: float) -> tuple[ObjectSpec, ...]:
    """Targets first, then obstacles, many of them close to a target; started over when the table gets too full."""
    counts = {c: rng.integers(n[0], n[1] + 1) for c, n in ((TARGET, kind.targets), (OBSTACLE, kind.obstacles))}
    while True:
        families = [_family(rng, class_id) for class_id, n in counts.items() for _ in range(n)]
        objects, circles = [], []
        for number, family in enumerate(families):
            thing, circle = _place(rng, kind, table, azimuth, family, f"{family}_{number}", circles)
            if thing is None:
                break
            objects.append(thing)
            circles.append(circle)
        else:
            return tuple(objects)


def _family(rng: np.random.Generator, class_id: int) -> str:
    names = [name for name, family in FAMILIES.items() if family.class_id == class_id]
    weights = np.array([FAMILIES[name].weight for name in names])
    return names[rng.choice(len(names), p=weights / weights.sum())]


def _place(rng, kind: SceneConfig, table: Table, azimuth: float, family: str, name: str, circles):
    """Make one object and find room for it; (None, None) if there is none. A circle is (x, y, radius, class)."""
    class_id = FAMILIES[family].class_id
    wide = kind.wide and rng.random() < 0.5
    body = WIDE[family](rng) if wide else FAMILIES[family].recipe(rng, kind.hard)
    yaw = Rotation.from_euler("z", rng.uniform(-np.pi, np.pi))
    turned = yaw * Rotation.from_quat(quaternion(*body.tilt))
    thing = ObjectSpec(
        name=name,
        family=family,
        class_id=class_id,
        position=(0.0, 0.0, 0.0),
        orientation=tuple(turned.as_quat().tolist()),
        urdf=body.urdf,
        scale=float(body.scale),
        parts=body.parts,
        colour=_object_colour(rng, table),
        mass=float(rng.uniform(0.05, 0.3)),
        friction=float(rng.uniform(0.6, 1.0)),
    )
    vertices = turned.apply(object_mesh(thing).vertices)
    middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2.0
    radius = float(np.linalg.norm(vertices[:, :2] - middle[:2], axis=1).max())
    gap = 0.005 if class_id == OBSTACLE else 0.03
    near = [c for c in circles if c[3] == TARGET]
    beside = class_id == OBSTACLE and rng.random() < 0.75
    for attempt in range(40):
        if (
            beside and attempt < 20
        ):  # most of the clutter crowds the targets on the camera's side: some get hidden, some grasps blocked
            x, y, r, _ = near[rng.integers(len(near))]
            angle, reach = azimuth + rng.normal(0.0, 0.55), r + radius + rng.uniform(0.005, 0.02)
            x, y = x + reach * np.cos(angle), y + reach * np.sin(angle)
        else:
            x, y = (rng.uniform(*side) for side in (TARGET_AREA if class_id == TARGET else OBSTACLE_AREA))
        inside = all(low <= w <= high for w, (low, high) in zip((x, y), OBSTACLE_AREA, strict=True))
        if inside and all(np.hypot(x - a, y - b) > r + radius + gap for a, b, r, _ in circles):
            z = table.z + DROP_HEIGHT - vertices[:, 2].min()
            position = (float(x - middle[0]), float(y - middle[1]), float(z))
            return replace(thing, position=position), (x, y, radius, class_id)
    return None, None


def _object_colour(rng: np.random.Generator, table: Table) -> tuple[float, float, float]:
    """A colour that can be told from the table's two by eye."""
    surface = np.array([table.texture.colour_a, table.texture.colour_b])
    while True:
        colour = _colour(rng)
        if np.linalg.norm(surface - colour, axis=1).min() > 0.2:
            return colour
