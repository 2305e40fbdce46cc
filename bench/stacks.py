"""Simulated stacks: things on things, and things inside others, three or four groups of them on a table.

A kind of its own beside `data_gen`'s, that nothing was trained on: there things lie on each other as they happen to
fall; here each thing has one below or around it, such as a tin on a tin, a box on a box, a fruit in a bowl.
"""

import numpy as np
from scipy.spatial.transform import Rotation

import data_gen
from data_gen import clutter
from data_gen.families import UPRIGHT, Body, quaternion
from data_gen.household import carton, fruit, large_bowl, tin
from data_gen.scenes import CONFIGS, _camera, _light, _object_colour, _texture
from labkit.labels import OBSTACLE
from labkit.sim.shapes import object_mesh
from labkit.sim.spec import ObjectSpec, SceneSpec

KIND = CONFIGS["clutter"]
PAIRS = (  # below, above, and whether the upper one starts inside
    (carton, carton, False),
    (tin, tin, False),
    (carton, tin, False),
    (tin, carton, False),
    (large_bowl, fruit, True),
    (large_bowl, tin, True),
    (large_bowl, carton, True),
)


def stacked(seed: int) -> SceneSpec:
    """Draw a scene of stacks; the same seed gives the same scene."""
    rng = np.random.default_rng([22, seed])
    table = clutter.table(rng, _texture(rng, KIND))
    middle = np.array(table.centre)
    places = middle + rng.uniform(0.09, 0.12) * np.array([(-1, -1), (-1, 1), (1, -1), (1, 1)])
    objects = []
    for group, (x, y) in enumerate(places[: rng.integers(3, 5)] + rng.uniform(-0.015, 0.015, 2)):
        below, above, inside = PAIRS[rng.integers(len(PAIRS))]
        top = table.z + 0.002
        for part, recipe in enumerate((below, above)):
            shrink = 1.0 if part == 0 else float(rng.uniform(0.5, 0.8))
            thing, low, high = _standing(rng, recipe(rng), f"{recipe.__name__}_{group}_{part}", shrink, table)
            if part == 1 and inside:
                top = table.z + 0.015
            objects.append(_at(thing, x, y, top - low))
            top += high - low + 0.003
    camera = _camera(rng, KIND, float(rng.uniform(-1.75, 1.75)), np.array([[*middle, table.z + 0.05]]))
    return SceneSpec(
        objects=tuple(objects),
        camera=camera,
        table=table,
        light=_light(rng),
        floor=_texture(rng, KIND),
        walls=_texture(rng, KIND),
        seed=seed,
        config="clutter",
        robot=False,
    )


def frame_of(seed: int, size: tuple[int, int] = (320, 240)):
    """The picture of a scene of stacks."""
    return data_gen.render(stacked(seed), size)


def _standing(rng, body: Body, name: str, shrink: float, table):
    """A thing that stands upright at the origin, turned about the vertical, with its lowest and highest z."""
    turned = Rotation.from_euler("z", rng.uniform(-np.pi, np.pi)) * Rotation.from_quat(quaternion(*UPRIGHT))
    thing = ObjectSpec(
        name=name,
        family=name.split("_", maxsplit=1)[0],
        class_id=OBSTACLE,
        position=(0.0, 0.0, 0.0),
        orientation=tuple(turned.as_quat().tolist()),
        urdf=body.urdf,
        scale=float(body.scale) * shrink,
        parts=body.parts,
        colour=_object_colour(rng, table),
        mass=0.1,
    )
    z = turned.apply(object_mesh(thing).vertices)[:, 2]
    return thing, float(z.min()), float(z.max())


def _at(thing: ObjectSpec, x: float, y: float, z: float) -> ObjectSpec:
    from dataclasses import replace

    return replace(thing, position=(float(x), float(y), float(z)))
