"""What can stand on the table: families of targets and obstacles, each a recipe from random numbers to a Body.

A family is recognised by its shape alone: colours are drawn from one distribution for all. No family is both target
and obstacle. Each recipe takes a generator and `hard`, which asks for proportions, poses or models that training
never sees; its lengths are metres. Each family has a recipe of its name in `wide`, too.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from labkit.labels import OBSTACLE, TARGET
from labkit.sim.spec import Part

UPRIGHT = (0.0, 0.0, 0.0)
ON_SIDE = (np.pi / 2, 0.0, 0.0)


@dataclass(frozen=True)
class Body:
    """A recipe's result, what an ObjectSpec needs beside its place, colour, mass and friction.

    tilt: rotations about the fixed x, y and z axes, radians, before any turn about the vertical.
    """

    tilt: tuple[float, float, float]
    urdf: str | None = None
    scale: float = 1.0
    parts: tuple[Part, ...] = ()


def quaternion(*rpy: float) -> tuple[float, ...]:
    """A rotation about the fixed x, y and z axes as a quaternion x, y, z, w."""
    return tuple(Rotation.from_euler("xyz", rpy).as_quat().tolist())


def box(length, width, height, at=(0.0, 0.0, 0.0), turn=0.0) -> Part:
    return Part("box", (length, width, height), at, quaternion(0.0, 0.0, turn))


def hull(corners) -> Part:
    """The convex hull of points (x, y, z)."""
    return Part("hull", tuple(float(x) for corner in corners for x in corner))


def wedge_ring(levels: Sequence[tuple[float, float, float]], sides: int) -> tuple[Part, ...]:
    """A ring about z as convex pieces; levels: (height, inner, outer radius at the corners), the lower one first."""
    ends = [2.0 * np.pi * np.array([i, i + 1]) / sides for i in range(sides)]
    return tuple(
        hull([(r * np.cos(t), r * np.sin(t), z) for z, *radii in levels for r in radii for t in pair]) for pair in ends
    )


def frustum(bottom: float, top: float, height: float, sides: int, z: float = 0.0) -> Part:
    """A cone or pyramid about z, cut off where its radius is `top`."""
    angles = 2.0 * np.pi * np.arange(sides) / sides
    levels = (bottom, 0.0), (max(top, 1e-4), height)
    return hull([(r * np.cos(t), r * np.sin(t), z + h) for r, h in levels for t in angles])


def studs(pitch: float, nx: int, ny: int, z: float) -> list[Part]:
    """The studs of a brick, nx by ny of them, with their middles at height z."""
    size = (0.3 * pitch, 0.22 * pitch)
    places = [(pitch * (i - (nx - 1) / 2), pitch * (j - (ny - 1) / 2), z) for i in range(nx) for j in range(ny)]
    return [Part("cylinder", size, place) for place in places]


# Targets ------------------------------------------------------------------------------------------------------------


def mug(rng: np.random.Generator, hard: bool) -> Body:
    """pybullet_data's mug at some scale; hard: a straight or flared cup with an angular handle."""
    tilt = UPRIGHT if rng.random() < 0.8 else ON_SIDE
    if not hard:
        return Body(tilt, urdf="objects/mug.urdf", scale=rng.uniform(0.55, 0.75))
    radius, height = rng.uniform(0.024, 0.032), rng.uniform(0.06, 0.085)
    wall = 0.004
    handle = radius + rng.uniform(0.012, 0.02)
    grip = rng.uniform(0.45, 0.6) * height
    side = 0.007
    parts = (
        *wedge_ring([(0.0, radius - wall, radius), (height, radius - wall, radius)], 14),
        Part("cylinder", (radius - wall / 2, wall), (0.0, 0.0, wall / 2)),
        box(handle - radius + 0.004, side, side, ((handle + radius) / 2 - 0.003, 0.0, height / 2 + grip / 2)),
        box(handle - radius + 0.004, side, side, ((handle + radius) / 2 - 0.003, 0.0, height / 2 - grip / 2)),
        box(side, side, grip + side, (handle, 0.0, height / 2)),
    )
    return Body(tilt, parts=parts)


def duck(rng: np.random.Generator, hard: bool) -> Body:
    """pybullet_data's duck; its y axis points up. Hard: larger or smaller than ever trained on."""
    scale = rng.choice([rng.uniform(0.6, 0.68), rng.uniform(0.9, 0.98)]) if hard else rng.uniform(0.7, 0.88)
    return Body((np.pi / 2, 0.0, 0.0), urdf="duck_vhacd.urdf", scale=float(scale))


def lego(rng: np.random.Generator, hard: bool) -> Body:
    """pybullet_data's brick; hard: a brick of another count of studs."""
    if not hard:
        return Body(UPRIGHT, urdf="lego/lego.urdf", scale=rng.uniform(1.0, 1.5))
    pitch = rng.uniform(0.018, 0.022)
    nx, ny = [(3, 2), (4, 2), (3, 1), (4, 1)][rng.integers(4)]
    height = 1.2 * pitch
    return Body(UPRIGHT, parts=(box(nx * pitch, ny * pitch, height), *studs(pitch, nx, ny, 0.61 * height)))


def block(rng: np.random.Generator, hard: bool) -> Body:
    """A wooden block; hard: a slab or a stick."""
    if hard:
        size = [(0.09, 0.025, 0.016), (0.07, 0.055, 0.018), (0.1, 0.02, 0.02)][rng.integers(3)]
        size = tuple(float(s) for s in np.array(size) * rng.uniform(0.9, 1.1))
        return Body(UPRIGHT, parts=(box(*size),))
    size = np.sort(rng.uniform((0.025, 0.03, 0.035), (0.04, 0.05, 0.08)))
    return Body(UPRIGHT, parts=(box(*(float(s) for s in rng.permutation(size))),))


def tee(rng: np.random.Generator, hard: bool) -> Body:
    """A T of two beams lying flat; hard: an L or a Z of them."""
    beam, height = rng.uniform(0.02, 0.026), rng.uniform(0.022, 0.035)
    bar, stem = rng.uniform(0.06, 0.085), rng.uniform(0.035, 0.055)
    if not hard:
        offsets = [(0.0, 1.0)]
    else:
        edge = (bar - beam) / 2
        offsets = [[(edge, 1.0)], [(edge, 1.0), (-edge, -1.0)]][rng.integers(2)]
    stems = [box(beam, stem, height, (x, sign * (stem + beam) / 2, 0.0)) for x, sign in offsets]
    return Body(UPRIGHT, parts=(box(bar, beam, height), *stems))


def ring(rng: np.random.Generator, hard: bool) -> Body:
    """A thick ring lying flat; hard: a frame of four to six sides."""
    outer = rng.uniform(0.03, 0.042)
    inner = outer - rng.uniform(0.012, 0.018)
    sides = int(rng.integers(4, 7)) if hard else 18
    height = rng.uniform(0.02, 0.035)
    return Body(UPRIGHT, parts=wedge_ring([(0.0, inner, outer), (height, inner, outer)], sides))


def bottle(rng: np.random.Generator, hard: bool) -> Body:
    """A body with a slim neck, standing or lying; hard: a flask that narrows to its neck."""
    radius, height = rng.uniform(0.019, 0.027), rng.uniform(0.05, 0.075)
    neck, reach = rng.uniform(0.4, 0.5) * radius, rng.uniform(0.025, 0.035)
    body = (
        frustum(radius * 1.15, neck * 1.2, height, 24)
        if hard
        else Part("cylinder", (radius, height), (0.0, 0.0, height / 2))
    )
    parts = (body, Part("cylinder", (neck, reach), (0.0, 0.0, height + reach / 2)))
    return Body(UPRIGHT if rng.random() < 0.6 else ON_SIDE, parts=parts)


def dumbbell(rng: np.random.Generator, hard: bool) -> Body:
    """Two balls on a rod; hard: two discs or cubes on it."""
    radius, reach = rng.uniform(0.014, 0.02), rng.uniform(0.06, 0.08)
    rod = Part("cylinder", (0.45 * radius, reach), (0.0, 0.0, 0.0), quaternion(0.0, np.pi / 2, 0.0))
    cubes = rng.random() < 0.5
    ends = []
    for x in (-reach / 2, reach / 2):
        if not hard:
            ends.append(Part("sphere", (radius,), (x, 0.0, 0.0)))
        elif cubes:
            ends.append(box(1.5 * radius, 1.7 * radius, 1.7 * radius, (x, 0.0, 0.0)))
        else:
            ends.append(Part("cylinder", (1.1 * radius, 0.9 * radius), (x, 0.0, 0.0), quaternion(0.0, np.pi / 2, 0.0)))
    return Body(UPRIGHT, parts=(rod, *ends))


# Obstacles ----------------------------------------------------------------------------------------------------------


def blob(rng: np.random.Generator, hard: bool) -> Body:
    """One of pybullet_data's thousand random shapes, in any pose; the last two hundred are kept for hard."""
    number = int(rng.integers(800, 1000) if hard else rng.integers(0, 800))
    tilt = tuple(float(a) for a in rng.uniform(-np.pi, np.pi, 3))
    return Body(tilt, urdf=f"random_urdfs/{number:03d}/{number:03d}.urdf", scale=rng.uniform(0.6, 1.0))


def ball(rng: np.random.Generator, hard: bool) -> Body:
    radius = rng.uniform(0.038, 0.045) if hard else rng.uniform(0.02, 0.036)
    return Body(UPRIGHT, parts=(Part("sphere", (radius,)),))


def cone(rng: np.random.Generator, hard: bool) -> Body:
    """A cone; hard: one cut off."""
    radius, height = rng.uniform(0.022, 0.038), rng.uniform(0.05, 0.1)
    return Body(UPRIGHT, parts=(frustum(radius, 0.5 * radius if hard else 0.0, height, 24),))


def pyramid(rng: np.random.Generator, hard: bool) -> Body:
    radius, height = rng.uniform(0.03, 0.045), rng.uniform(0.03, 0.07)
    return Body(UPRIGHT, parts=(frustum(radius, 0.0, height, 3 if hard else 4),))


def can(rng: np.random.Generator, hard: bool) -> Body:
    """A plain cylinder, standing or lying; hard: a flat disc or a slim post."""
    if hard:
        radius, height = [(0.05, 0.015), (0.014, 0.11)][rng.integers(2)]
        return Body(UPRIGHT, parts=(Part("cylinder", (radius, height)),))
    radius, height = rng.uniform(0.025, 0.035), rng.uniform(0.05, 0.1)
    return Body(UPRIGHT if rng.random() < 0.7 else ON_SIDE, parts=(Part("cylinder", (radius, height)),))


def bowl(rng: np.random.Generator, hard: bool) -> Body:
    """A wide, low dish with a flared wall; hard: a square one."""
    radius, height, wall = rng.uniform(0.05, 0.065), rng.uniform(0.025, 0.035), 0.005
    sides, foot = 4 if hard else 16, 0.7 * radius
    lean = 0.25 * radius
    wedges = wedge_ring([(0.0, foot - wall, foot), (height, foot - wall + lean, foot + lean)], sides)
    return Body(UPRIGHT, parts=(frustum(foot, foot, wall, sides), *wedges))


def teddy(rng: np.random.Generator, hard: bool) -> Body:
    """pybullet_data's bear, on its back or sitting."""
    tilt = (np.pi / 2, 0.0, 0.0) if hard else (0.0, 0.0, 0.0)
    return Body(tilt, urdf="teddy_vhacd.urdf", scale=rng.uniform(0.8, 1.1))


@dataclass(frozen=True)
class Family:
    """A family's recipe, its class, and how often it is drawn among those of its class."""

    recipe: Callable[[np.random.Generator, bool], Body]
    class_id: int
    weight: float


FAMILIES = {
    "mug": Family(mug, TARGET, 1.0),
    "duck": Family(duck, TARGET, 1.0),
    "lego": Family(lego, TARGET, 1.0),
    "block": Family(block, TARGET, 1.0),
    "tee": Family(tee, TARGET, 1.0),
    "ring": Family(ring, TARGET, 1.0),
    "bottle": Family(bottle, TARGET, 1.0),
    "dumbbell": Family(dumbbell, TARGET, 1.0),
    "blob": Family(blob, OBSTACLE, 4.0),
    "ball": Family(ball, OBSTACLE, 1.0),
    "cone": Family(cone, OBSTACLE, 1.0),
    "pyramid": Family(pyramid, OBSTACLE, 1.0),
    "can": Family(can, OBSTACLE, 1.0),
    "bowl": Family(bowl, OBSTACLE, 0.7),
    "teddy": Family(teddy, OBSTACLE, 0.7),
}
BOXES = ("lego", "block")
