"""Scenes that tests share: a few boxes on a table, seen by a camera in front of it."""

from labkit.labels import TARGET
from labkit.sim.spec import Camera, ObjectSpec, Part, SceneSpec

CAMERA = Camera.looking_at((0.52, 0.0, 0.0), 0.7, 0.3, 0.8)


def box(name: str, x: float, y: float, sides=(0.04, 0.06, 0.04), class_id: int = TARGET) -> ObjectSpec:
    """A box on the table with its middle over (x, y)."""
    return ObjectSpec(name, "block", class_id, (x, y, sides[2] / 2 + 0.002), parts=(Part("box", sides),))


def scene(*things: ObjectSpec) -> SceneSpec:
    """These objects on a table at height 0."""
    return SceneSpec(things, CAMERA)
