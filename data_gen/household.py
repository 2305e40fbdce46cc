"""Things of a household's sizes, for training: from a marker to a jug and a box of cereals.

Each recipe makes a shape of one of `families`' kinds, so that its class is known; a family's name stands beside it.
Like `wide`, they keep clear of the shapes that `hard` keeps for itself.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from data_gen.families import ON_SIDE, UPRIGHT, Body, box, frustum, quaternion
from data_gen.wide import WIDE, flared_ring
from labkit.sim.spec import Part


def carton(rng: np.random.Generator) -> Body:
    """A box of cereals, sugar or tea, in any of its three poses."""
    size = rng.uniform((0.035, 0.08, 0.1), (0.09, 0.17, 0.28))
    if rng.random() < 0.3:
        size = rng.uniform(0.05, 0.14, 3)
    return Body(UPRIGHT, parts=(box(*(float(s) for s in rng.permutation(size))),))


def marker(rng: np.random.Generator) -> Body:
    """A pen, a marker or a candle with its cap, lying."""
    radius, length = rng.uniform(0.0055, 0.011), rng.uniform(0.1, 0.17)
    cap = Part("cylinder", (radius * rng.uniform(1.0, 1.25), 0.3 * length), (0.0, 0.0, 0.36 * length))
    return Body(ON_SIDE, parts=(Part("cylinder", (radius, length)), cap))


def tin(rng: np.random.Generator) -> Body:
    """A tin, a tube of crisps or a roll of tape."""
    radius = rng.uniform(0.03, 0.052)
    height = radius * rng.uniform(0.9, 5.0)
    return Body(UPRIGHT if rng.random() < 0.65 else ON_SIDE, parts=(Part("cylinder", (radius, height)),))


def jug(rng: np.random.Generator) -> Body:
    """A cup or a jug: a training cup at its real size or larger."""
    return replace(WIDE["mug"](rng), scale=float(rng.uniform(1.3, 2.6)))


def large_bottle(rng: np.random.Generator) -> Body:
    """A bottle of bleach, mustard or shampoo."""
    return replace(WIDE["bottle"](rng), scale=float(rng.uniform(1.4, 2.3)))


def large_bowl(rng: np.random.Generator) -> Body:
    """A bowl or a plate for one's dinner."""
    if rng.random() < 0.7:
        return replace(WIDE["bowl"](rng), scale=float(rng.uniform(1.2, 1.7)))
    foot, rim, height, sides = rng.uniform(0.05, 0.07), rng.uniform(0.085, 0.13), rng.uniform(0.015, 0.03), 18
    return Body(UPRIGHT, parts=(frustum(foot, foot, 0.005, sides), *flared_ring(foot, rim, 0.005, height, sides)))


def fruit(rng: np.random.Generator) -> Body:
    """A ball, from a golf ball to a grapefruit."""
    return Body(UPRIGHT, parts=(Part("sphere", (float(rng.uniform(0.02, 0.055)),)),))


def tool(rng: np.random.Generator) -> Body:
    """A grip and a head at an angle, as of a drill, a hammer or a brush, each a box or a cylinder, lying."""
    thick = rng.uniform(0.012, 0.045)
    grip, head = rng.uniform(0.07, 0.2), rng.uniform(0.04, 0.18)
    angle, place = rng.uniform(1.1, 2.0), rng.uniform(-0.5, 0.5) * head
    wide = thick * rng.uniform(0.8, 1.8)
    parts = [_bar(rng, grip, thick, (-grip / 2, 0.0, 0.0), 0.0)]
    parts.append(_bar(rng, head, wide, (-place * np.cos(angle), place * np.sin(angle), 0.0), angle))
    if rng.random() < 0.4:  # a battery at the end of the grip, a bristle
        foot = thick * rng.uniform(1.2, 2.2)
        parts.append(box(0.6 * foot, foot, thick, (-grip, 0.0, 0.0)))
    return Body(UPRIGHT, parts=tuple(parts))


def arc(rng: np.random.Generator) -> Body:
    """A banana, a clamp or a pair of glasses: a bent bar of four pieces, lying."""
    thick, radius, reach = rng.uniform(0.008, 0.02), rng.uniform(0.04, 0.1), rng.uniform(0.3, 0.6)
    parts = []
    for angle in reach * np.arange(-1.5, 2.0):
        at = radius * np.cos(angle), radius * np.sin(angle), 0.0
        parts.append(_bar(rng, 1.15 * radius * reach, thick, at, angle + np.pi / 2))
    return Body(UPRIGHT, parts=tuple(parts))


def cutlery(rng: np.random.Generator) -> Body:
    """A flat strip with a wider end, as a spoon, a spatula or a pair of scissors has it."""
    thick, wide, length = rng.uniform(0.003, 0.008), rng.uniform(0.01, 0.022), rng.uniform(0.1, 0.2)
    end = wide * rng.uniform(1.2, 3.0)
    return Body(UPRIGHT, parts=(box(length, wide, thick), box(0.3 * length, end, thick, (0.5 * length, 0.0, 0.0))))


def _bar(rng: np.random.Generator, length: float, thick: float, at, turn: float) -> Part:
    """A bar in the plane, of square or round section, along the direction `turn` (radians)."""
    if rng.random() < 0.5:
        return box(length, thick, thick, at, turn)
    return Part("cylinder", (thick / 2, length), at, quaternion(0.0, np.pi / 2, turn))


# Recipes with the family whose class they have.
HOUSEHOLD: tuple[tuple[str, Callable[[np.random.Generator], Body]], ...] = (
    ("block", carton),
    ("block", carton),
    ("can", marker),
    ("can", tin),
    ("mug", jug),
    ("bottle", large_bottle),
    ("bowl", large_bowl),
    ("ball", fruit),
    ("blob", tool),
    ("blob", tool),
    ("blob", arc),
    ("blob", cutlery),
)
