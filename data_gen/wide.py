"""Wider shapes of every family, for training: proportions and details that neither `train` nor `hard` has.

A network that has seen one kind of bottle learns that bottle. Each recipe here draws from ranges around those of
`families`, and keeps clear of the ranges that `hard` draws from, so that `hard` still asks about shapes never seen.
"""

from collections.abc import Callable

import numpy as np
from scipy.spatial.transform import Rotation

from data_gen.families import ON_SIDE, UPRIGHT, Body, box, frustum, quaternion, studs, wedge_ring
from labkit.sim.spec import Part

ON_ITS_HEAD = (np.pi, 0.0, 0.0)


def flared_ring(bottom: float, top: float, wall: float, height: float, sides: int) -> tuple[Part, ...]:
    """A ring whose outer radius goes from `bottom` to `top`: the wall of a cup."""
    return wedge_ring([(0.0, bottom - wall, bottom), (height, top - wall, top)], sides)


def mug(rng: np.random.Generator) -> Body:
    """A cup that widens or narrows, with a round handle of five pieces."""
    bottom, height = rng.uniform(0.022, 0.032), rng.uniform(0.045, 0.09)
    top = bottom * rng.choice([rng.uniform(0.75, 0.93), rng.uniform(1.07, 1.35)])
    reach, side = rng.uniform(0.014, 0.024), rng.uniform(0.006, 0.009)
    radius = 0.5 * (bottom + top)
    angles = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 6)
    x, z = radius - 0.004 + reach * np.cos(angles), height / 2 + 0.35 * height * np.sin(angles)
    handle = []
    for i in range(5):
        dx, dz = x[i + 1] - x[i], z[i + 1] - z[i]
        turn = Rotation.from_euler("y", np.arctan2(-dz, dx)).as_quat()
        size = (float(np.hypot(dx, dz)) + 0.5 * side, side, side)
        handle.append(Part("box", size, (float(x[i] + dx / 2), 0.0, float(z[i] + dz / 2)), tuple(turn.tolist())))
    wall = 0.004
    base = frustum(bottom - wall / 2, bottom - wall / 2, wall, 14)
    tilt = UPRIGHT if rng.random() < 0.7 else ON_SIDE
    return Body(tilt, parts=(*flared_ring(bottom, top, wall, height, 14), base, *handle))


def duck(rng: np.random.Generator) -> Body:
    """The duck at any size between those that `hard` keeps for itself."""
    return Body((np.pi / 2, 0.0, 0.0), urdf="duck_vhacd.urdf", scale=float(rng.uniform(0.69, 0.89)))


def lego(rng: np.random.Generator) -> Body:
    """A brick of 2 x 2, 3 x 3, 2 x 1 or 5 x 2 studs, flat or of full height."""
    pitch = rng.uniform(0.014, 0.022)
    nx, ny = [(2, 2), (3, 3), (2, 1), (5, 2)][rng.integers(4)]
    height = pitch * (1.2 if rng.random() < 0.7 else 0.7)
    parts = (box(nx * pitch, ny * pitch, height), *studs(pitch, nx, ny, height / 2 + 0.11 * pitch))
    return Body(UPRIGHT, parts=parts)


def block(rng: np.random.Generator) -> Body:
    """A cuboid from cube to board to beam; no edge is as thin as a slab's or a stick's of `hard`."""
    size = np.sort(rng.uniform((0.023, 0.025, 0.035), (0.045, 0.065, 0.11)))
    if rng.random() < 0.5:  # lying on its largest side, as things that fell over do
        size = size[::-1] if rng.random() < 0.5 else size[[1, 2, 0]]
    else:
        size = rng.permutation(size)
    return Body(UPRIGHT, parts=(box(*(float(s) for s in size)),))


def tee(rng: np.random.Generator) -> Body:
    """A T whose stem is off centre, a cross, or an H; never with a stem at the bar's end."""
    beam, height = rng.uniform(0.016, 0.028), rng.uniform(0.018, 0.04)
    bar, stem = rng.uniform(0.055, 0.09), rng.uniform(0.025, 0.055)
    offset = rng.uniform(-0.5, 0.5) * (bar - beam) / 2
    kind = rng.integers(3)
    parts = [box(bar, beam, height), box(beam, stem, height, (offset, (stem + beam) / 2, 0.0))]
    if kind == 1:
        parts.append(box(beam, stem, height, (offset, -(stem + beam) / 2, 0.0)))
    if kind == 2:
        parts.append(box(bar, beam, height, (0.0, stem + beam, 0.0)))
    return Body(UPRIGHT, parts=tuple(parts))


def ring(rng: np.random.Generator) -> Body:
    """A ring of eight or more sides, thin or thick, low or high."""
    outer = rng.uniform(0.024, 0.048)
    inner = outer * rng.uniform(0.4, 0.75)
    height, sides = rng.uniform(0.014, 0.045), int(rng.integers(8, 19))
    return Body(UPRIGHT, parts=wedge_ring([(0.0, inner, outer), (height, inner, outer)], sides))


def bottle(rng: np.random.Generator) -> Body:
    """A body of round or square section, with a shoulder or slightly tapered, and a neck; standing, lying or fallen."""
    radius, height = rng.uniform(0.016, 0.03), rng.uniform(0.04, 0.085)
    neck, reach = rng.uniform(0.3, 0.6) * radius, rng.uniform(0.018, 0.04)
    sides = int(rng.choice([4, 6, 8, 24, 24]))
    if rng.random() < 0.5:
        straight = rng.uniform(0.55, 0.85) * height
        body = (frustum(radius, radius, straight, sides), frustum(radius, neck, height - straight, sides, straight))
    else:
        body = (frustum(radius * rng.uniform(0.75, 1.05), radius * rng.uniform(0.75, 1.05), height, sides),)
    parts = (*body, Part("cylinder", (neck, reach), (0.0, 0.0, height + reach / 2)))
    return Body(UPRIGHT if rng.random() < 0.55 else ON_SIDE, parts=parts)


def dumbbell(rng: np.random.Generator) -> Body:
    """Two balls of two sizes or two double cones on a rod, long or short, thin or thick."""
    radius, reach = rng.uniform(0.012, 0.022), rng.uniform(0.05, 0.09)
    along = quaternion(0.0, np.pi / 2, 0.0)
    rod = Part("cylinder", (rng.uniform(0.3, 0.6) * radius, reach), (0.0, 0.0, 0.0), along)
    cones = rng.random() < 0.4
    ends = []
    for x in (-reach / 2, reach / 2):
        r = radius * rng.uniform(0.85, 1.15)
        if cones:
            corners = frustum(r, 0.4 * r, 0.8 * r, 12).size
            ends += [Part("hull", corners, (x, 0.0, 0.0), quaternion(0.0, a, 0.0)) for a in (np.pi / 2, -np.pi / 2)]
        else:
            ends.append(Part("sphere", (float(r),), (x, 0.0, 0.0)))
    return Body(UPRIGHT, parts=(rod, *ends))


def blob(rng: np.random.Generator) -> Body:
    """One of the random shapes that training may see, smaller or larger than there."""
    number = int(rng.integers(0, 800))
    tilt = tuple(float(a) for a in rng.uniform(-np.pi, np.pi, 3))
    return Body(tilt, urdf=f"random_urdfs/{number:03d}/{number:03d}.urdf", scale=rng.uniform(0.5, 1.2))


def ball(rng: np.random.Generator) -> Body:
    return Body(UPRIGHT, parts=(Part("sphere", (float(rng.uniform(0.014, 0.0375)),)),))


def cone(rng: np.random.Generator) -> Body:
    """A cone, pointed or slightly blunt, standing, on its side or on its head; `hard`'s are cut off halfway."""
    radius, height = rng.uniform(0.018, 0.045), rng.uniform(0.035, 0.12)
    tilt = (UPRIGHT, UPRIGHT, ON_SIDE)[rng.integers(3)]
    return Body(tilt, parts=(frustum(radius, rng.uniform(0.0, 0.35) * radius, height, 24),))


def pyramid(rng: np.random.Generator) -> Body:
    """Four to six sides, pointed or slightly blunt; `hard`'s have three."""
    radius, height = rng.uniform(0.025, 0.05), rng.uniform(0.025, 0.085)
    top = rng.choice([0.0, rng.uniform(0.1, 0.35)]) * radius
    return Body(UPRIGHT, parts=(frustum(radius, top, height, int(rng.integers(4, 7))),))


def can(rng: np.random.Generator) -> Body:
    """A cylinder, wide or slim, but neither `hard`'s disc nor its post."""
    radius = rng.uniform(0.018, 0.042)
    height = float(np.clip(radius * rng.uniform(0.8, 4.5), 0.025, 0.11))
    return Body(UPRIGHT if rng.random() < 0.6 else ON_SIDE, parts=(Part("cylinder", (float(radius), height)),))


def bowl(rng: np.random.Generator) -> Body:
    """A dish of six or more sides, steep or flat, upright or on its head; `hard`'s are square."""
    radius, height, wall = rng.uniform(0.035, 0.065), rng.uniform(0.02, 0.045), 0.005
    foot, sides = radius * rng.uniform(0.5, 0.85), int(rng.integers(6, 17))
    parts = (frustum(foot, foot, wall, sides), *flared_ring(foot, radius, wall, height, sides))
    return Body(UPRIGHT if rng.random() < 0.7 else ON_ITS_HEAD, parts=parts)


def teddy(rng: np.random.Generator) -> Body:
    """The bear, sitting or on either side; `hard`'s lie on their backs."""
    tilt = [(0.0, 0.0, 0.0), (0.0, np.pi / 2, 0.0), (0.0, -np.pi / 2, 0.0)][rng.integers(3)]
    return Body(tilt, urdf="teddy_vhacd.urdf", scale=float(rng.uniform(0.7, 1.2)))


WIDE: dict[str, Callable[[np.random.Generator], Body]] = {
    recipe.__name__: recipe
    for recipe in (mug, duck, lego, block, tee, ring, bottle, dumbbell, blob, ball, cone, pyramid, can, bowl, teddy)
}
