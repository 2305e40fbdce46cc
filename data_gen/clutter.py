"""Crowded scenes: things dropped in a heap, side by side, or into a bin (configs clutter, bin, messy).

Config messy is both, in bins that are moulded rather than made of boards, and amid furniture.

Nothing is kept apart here: things touch, lean and lie on and in each other, as they fall. Tables are small, large or
beside a shelf, and the arm stands anywhere above them: what the camera sees of these is no thing.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from data_gen.families import FAMILIES, Body, quaternion
from data_gen.household import HOUSEHOLD
from data_gen.wide import WIDE
from labkit.sim.kinematics import HOME, link_frames
from labkit.sim.shapes import object_mesh
from labkit.sim.spec import Furniture, ObjectSpec, Table, Texture

APART = 0.004  # metres between bounding boxes where things start: they fall into contact
BIN_FLOOR = 0.006  # metres
CLEAR = 0.3  # metres that the hand stays over the table where nothing else is asked for


class Area(NamedTuple):
    """A rectangle of the table, turned by yaw, where things start: middle, half its lengths, and z of its ground."""

    x: float
    y: float
    half_x: float
    half_y: float
    yaw: float
    z: float

    def at(self, a: float, b: float) -> np.ndarray:
        """The place (x, y) at shares a and b, -1 to 1, of its half lengths."""
        c, s = np.cos(self.yaw), np.sin(self.yaw)
        return np.array([self.x, self.y]) + np.array([[c, -s], [s, c]]) @ (a * self.half_x, b * self.half_y)


def table(rng: np.random.Generator, texture: Texture) -> Table:
    """A table of any size, so that its end is in view as often as not."""
    size = float(rng.uniform(0.42, 0.8)), float(rng.uniform(0.55, 1.4)), float(rng.uniform(0.02, 0.08))
    centre = 0.55, float(rng.uniform(-0.08, 0.08))
    return Table(centre=centre, size=size, z=float(rng.uniform(-0.04, 0.04)), texture=texture)


def heap_area(rng: np.random.Generator, stand: Table, count: int) -> Area:
    """Where `count` things start: crowded, or all over the table."""
    room = np.array(stand.size[:2]) / 2.0 - 0.06
    if rng.random() < 0.5:
        half = np.minimum(room, np.sqrt((count + 3) / 20.0) * rng.uniform((0.08, 0.1), (0.22, 0.3)))
    else:
        half = room * rng.uniform(0.5, 1.0, 2)
    x, y = np.array(stand.centre) + rng.uniform(-1.0, 1.0, 2) * (room - half)
    return Area(float(x), float(y), *map(float, half), 0.0, stand.z)


def bin_area(rng: np.random.Generator, stand: Table, half_x: float, half_y: float, yaw: float) -> Area:
    """Where the floor of a bin of that size lies on the table."""
    spare = np.maximum(np.array(stand.size[:2]) / 2.0 - (half_x, half_y), 0.0)
    x, y = np.array(stand.centre) + 0.6 * rng.uniform(-1.0, 1.0, 2) * spare
    return Area(float(x), float(y), half_x, half_y, yaw, stand.z + BIN_FLOOR)


def with_floor(area: Area, stand: Table, texture: Texture, sides) -> tuple[Area, tuple[Furniture, ...]]:
    """Where things start in a bin whose floor is `area`, and its sides with the floor."""
    size, centre = (2 * area.half_x, 2 * area.half_y, BIN_FLOOR), (area.x, area.y, stand.z + BIN_FLOOR / 2)
    floor = Furniture(size, centre, texture, area.yaw, True)
    return area._replace(half_x=0.75 * area.half_x, half_y=0.75 * area.half_y), (*sides, floor)


def bin_around(rng: np.random.Generator, stand: Table, colour) -> tuple[Area, tuple[Furniture, ...]]:
    """A bin of four walls and a floor on the table, and the area inside it."""
    half_x, half_y = (float(side) / 2 for side in rng.uniform((0.26, 0.32), (0.4, 0.5)))
    height, wall, yaw = rng.uniform(0.05, 0.15), rng.uniform(0.003, 0.012), float(rng.uniform(-0.3, 0.3))
    area = bin_area(rng, stand, half_x, half_y, yaw)
    texture = Texture(colour_a=colour)
    middle = stand.z + height / 2
    walls = [((wall, 2 * half_y + 2 * wall, height), (side, 0.0)) for side in (-1.0, 1.0)]
    walls += [((2 * half_x, wall, height), (0.0, side)) for side in (-1.0, 1.0)]
    pieces = [
        Furniture(tuple(map(float, size)), (*area.at(a, b).tolist(), middle), texture, yaw) for size, (a, b) in walls
    ]
    return with_floor(area, stand, texture, pieces)


def moulded_bin(rng: np.random.Generator, stand: Table, colour) -> tuple[Area, tuple[Furniture, ...]]:
    """A bin as it is moulded, whose floor bends up into leaning walls with a rim; and the area inside it.

    A side is a strip of boards, each steeper than the one before.
    """
    half_x, half_y = (float(side) / 2 for side in rng.uniform((0.2, 0.26), (0.4, 0.5)))
    yaw, lean = float(rng.uniform(-0.3, 0.3)), rng.uniform(1.0, 1.5)
    bend, wall, rim = rng.uniform(0.005, 0.09), rng.uniform(0.03, 0.15), rng.choice([0.0, rng.uniform(0.01, 0.04)])
    area = bin_area(rng, stand, half_x, half_y, yaw)
    texture, thick, pieces = Texture(colour_a=colour), 0.004, []
    slopes = [(bend / 4, angle) for angle in lean * np.array([0.1, 0.3, 0.55, 0.8])]
    for turn, ahead, aside in (
        (0.0, half_x, half_y),
        (0.5, half_y, half_x),
        (1.0, half_x, half_y),
        (1.5, half_y, half_x),
    ):
        heading, out, rise = yaw + np.pi * turn, 0.0, area.z - thick / 2
        for length, slope in [*slopes, (wall, lean), (rim, 0.0)]:
            if length == 0.0:
                continue
            step = length * np.array([np.cos(slope), np.sin(slope)])
            reach, z = ahead + out + step[0] / 2, rise + step[1] / 2
            centre = area.x + reach * np.cos(heading), area.y + reach * np.sin(heading), z
            size = length + thick / 2, 2 * (aside + out + step[0]), thick
            pieces.append(
                Furniture(tuple(map(float, size)), tuple(map(float, centre)), texture, heading, False, -slope)
            )
            out, rise = out + step[0], rise + step[1]
    return with_floor(area, stand, texture, pieces)


def bystanders(rng: np.random.Generator, stand: Table, azimuth: float, texture) -> list[Furniture]:
    """Up to five boxes on the far side of the table and beside it, such as chairs, screens and cupboards.

    azimuth: of the camera; texture: function without arguments.
    """
    pieces = []
    for _ in range(rng.integers(6) if rng.random() < 0.6 else 0):
        heading, turn = azimuth + np.pi + rng.uniform(-1.9, 1.9), float(rng.uniform(-np.pi, np.pi))
        wide, deep = rng.uniform((0.1, 0.03), (0.7, 0.5))
        top, bottom = stand.z + rng.uniform(-0.4, 0.6), stand.z - 0.69
        if rng.random() < 0.4:  # a screen, a seat: something that stands on a leg
            bottom = top - rng.uniform(0.05, 0.4)
        ray = np.array([np.cos(heading), np.sin(heading)])
        edge = (np.array(stand.size[:2]) / 2 / np.maximum(np.abs(ray), 1e-6)).min()
        x, y = stand.centre + ray * (edge + 0.02 + np.hypot(wide, deep) / 2 + rng.exponential(0.2))
        if np.hypot(x, y) < 0.25 + np.hypot(wide, deep) / 2:  # the robot stands there
            continue
        size, centre = (wide, deep, top - bottom), (x, y, (top + bottom) / 2)
        pieces.append(Furniture(tuple(map(float, size)), tuple(map(float, centre)), texture(), turn))
    return pieces


def second_plane(rng: np.random.Generator, stand: Table, texture: Texture) -> tuple[Furniture, ...]:
    """Nothing, a floor close below the table, or a shelf beside it, lower or higher."""
    kind = rng.random()
    if kind < 0.45:
        return ()
    if kind < 0.65:
        top = stand.z - stand.size[2] - rng.uniform(0.05, 0.5)
        return (Furniture((5.0, 5.0, 0.02), (0.0, 0.0, float(top - 0.01)), texture),)
    wide, side = float(rng.uniform(0.2, 0.6)), float(rng.choice([-1.0, 1.0]))
    top = stand.z + rng.choice([rng.uniform(-0.4, -0.05), rng.uniform(0.05, 0.3)])
    y = stand.centre[1] + side * (stand.size[1] / 2 + rng.uniform(0.0, 0.1) + wide / 2)
    return (
        Furniture((float(rng.uniform(0.4, 0.9)), wide, 0.03), (stand.centre[0], float(y), float(top - 0.015)), texture),
    )


def arm(rng: np.random.Generator, stand: Table, clear: float = CLEAR) -> tuple[float, ...] | None:
    """Joints that hold the hand `clear` metres over the table, so that the arm is in the picture; None: home."""
    if rng.random() < 0.6:
        return None
    while True:
        q = np.array(HOME)
        q[:7] = rng.uniform((-0.9, -0.8, -0.3, -2.6, -0.3, 1.2, -1.0), (0.9, 0.5, 0.3, -1.2, 0.3, 2.6, 2.5))
        hand = link_frames(q[:7])[8, :3, 3]
        if hand[2] - 0.12 > stand.z + clear and hand[0] > 0.3:
            return tuple(q.tolist())


def things(
    rng: np.random.Generator, stand: Table, area: Area, count: int, sizes: tuple[float, float], colour
) -> tuple[ObjectSpec, ...]:
    """So many things above an area, each where it touches no other: beside the last one, or above what is there.

    One whose frame would start beside the table is left out. sizes: range of the factor of things that are of no
    household's size. colour: function without arguments.
    """
    placed, boxes = [], []
    for number in range(count):
        family, body = _body(rng, sizes)
        thing, low, high = _turned(rng, family, body, f"{family}_{number}", colour())
        x, y = area.at(*rng.uniform(-1.0, 1.0, 2))
        if boxes and rng.random() < 0.35:  # side by side
            beside, axis, side = boxes[-1], rng.integers(2), rng.choice([-1.0, 1.0])
            middle = (beside[0][:2] + beside[1][:2]) / 2
            reach = (beside[1][axis] - beside[0][axis] + high[axis] - low[axis]) / 2 + 0.001
            near = middle + side * reach * np.eye(2)[axis]
            inside = np.abs(near - (area.x, area.y)) < (area.half_x, area.half_y)
            x, y = near if inside.all() else (x, y)
        shift = np.array([x, y, 0.0]) - (low + high) / 2 * (1.0, 1.0, 0.0)
        if not (
            np.abs(shift[:2] - stand.centre) <= np.array(stand.size[:2]) / 2
        ).all():  # NaN, of one random_urdf, is not
            continue
        low, high = low + shift, high + shift
        below = [top[2] for bottom, top in boxes if (bottom[:2] < high[:2]).all() and (low[:2] < top[:2]).all()]
        rise = max([area.z, *below]) + APART - low[2]
        lift = np.array([0.0, 0.0, rise])
        boxes.append((low + lift, high + lift))
        placed.append(replace(thing, position=(float(shift[0]), float(shift[1]), float(rise))))
    return tuple(placed)


def _body(rng: np.random.Generator, sizes: tuple[float, float]) -> tuple[str, Body]:
    """A family and a thing of it: of a household's size, or one of `wide`'s or `train`'s that is larger or smaller."""
    if rng.random() < 0.45:
        family, recipe = HOUSEHOLD[rng.integers(len(HOUSEHOLD))]
        return family, recipe(rng)
    family = list(FAMILIES)[rng.integers(len(FAMILIES))]
    body = WIDE[family](rng) if rng.random() < 0.5 else FAMILIES[family].recipe(rng, False)
    return family, replace(body, scale=float(body.scale * np.exp(rng.uniform(*np.log(sizes)))))


def _turned(rng: np.random.Generator, family: str, body: Body, name: str, colour):
    """The thing at the origin, turned at random, and the corners of its bounding box."""
    turned = Rotation.from_euler("z", rng.uniform(-np.pi, np.pi)) * Rotation.from_quat(quaternion(*body.tilt))
    thing = ObjectSpec(
        name=name,
        family=family,
        class_id=FAMILIES[family].class_id,
        position=(0.0, 0.0, 0.0),
        orientation=tuple(turned.as_quat().tolist()),
        urdf=body.urdf,
        scale=float(body.scale),
        parts=body.parts,
        colour=colour,
        mass=float(rng.uniform(0.05, 0.3)),
        friction=float(rng.uniform(0.6, 1.0)),
    )
    vertices = turned.apply(object_mesh(thing).vertices)
    return thing, vertices.min(axis=0), vertices.max(axis=0)
