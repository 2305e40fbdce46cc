"""A table with a mirror or a glass on it, photographed from several sides: what a ray meets, it is asked again.

PyBullet draws neither. Here each pixel's ray is followed: paint answers, a mirror sends the ray back, glass sends a
part of it back (Fresnel, by Schlick's approximation) and lets the rest through, a ball of silver is a round mirror.
The room has a floor, walls and a ceiling with lamps, with a pattern or plain. Rays are not refracted: a pane shifts
what is behind it by a millimetre, a filled tumbler by far more.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import cv2
import numpy as np
from jaxtyping import Bool, Float

from data_gen.phone import AZIMUTHS, as_a_phone
from labkit.geometry.sweep import View
from labkit.sim.spec import Camera
from labkit.sim.world import intrinsics

SIZE = (640, 480)
FOV_Y = 0.88  # radians, as the simulated phone's
SILVER, GLASS = 0.92, 0.08  # shares of the light that come back head-on: of a mirror, and of both sides of a pane
BOUNCES = 4
KINDS = ("flat", "leaning", "tilted", "standing", "ball", "pane", "standing pane", "tumbler")


@dataclass(frozen=True, eq=False)
class Surface:
    """Something that rays meet. meet: from origins and directions (N, 3) to distances, inf where they pass by.

    paint: colours (N, 3) of points (N, 3), 0 to 255. normal: of points. back: share of light that comes back head-on,
    0 for paint; through: does the rest go on behind it?
    """

    meet: Callable
    normal: Callable
    paint: Callable | None = None
    back: float = 0.0
    through: bool = False


@dataclass(frozen=True, eq=False)
class Mirrored:
    """Views of a table, and the truth about the first: depth of what is nearest, of what is seen in or through it
    (the length of the ray's whole way, as a camera that knows no mirrors measures), where the mirror or glass is."""

    views: list[View]
    depth: Float[np.ndarray, "H W"]
    seen: Float[np.ndarray, "H W"]
    there: Bool[np.ndarray, "H W"]


def rectangle(middle, x, y, half, **looks) -> Surface:
    """A flat piece around `middle` (3,), whose sides point along unit vectors x and y, `half` its sides from there."""
    middle, x, y = (np.asarray(a, float) for a in (middle, x, y))
    n = np.cross(x, y)

    def meet(P, D):
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (middle - P) @ n / (D @ n)
            Q = P + t[:, None] * D - middle
            inside = (np.abs(Q @ x) <= half[0]) & (np.abs(Q @ y) <= half[1])
        return np.where(inside & (t > 1e-6), t, np.inf)

    if "picture" in looks:
        picture, scale = looks.pop("picture"), looks.pop("scale", 1000.0)
        looks["paint"] = lambda Q: painted(picture, scale * ((Q - middle) @ np.stack([x, y], axis=1)))
    return Surface(meet, lambda Q: np.broadcast_to(n, Q.shape), **looks)


def ball(middle, radius: float, **looks) -> Surface:
    """A sphere."""
    middle = np.asarray(middle, float)

    def meet(P, D):
        b, c = (D * (P - middle)).sum(axis=1), ((P - middle) ** 2).sum(axis=1) - radius**2
        a = (D * D).sum(axis=1)
        with np.errstate(invalid="ignore"):
            t = (-b - np.sqrt(b * b - a * c)) / a
        return np.where(t > 1e-6, t, np.inf)

    return Surface(meet, lambda Q: (Q - middle) / radius, **looks)


def tube(middle, radius: float, height: float, **looks) -> Surface:
    """The wall of an upright tube, open above; both its sides are met."""
    middle = np.asarray(middle, float)

    def meet(P, D):
        p, d = (P - middle)[:, :2], D[:, :2]
        a, b, c = (d * d).sum(axis=1), (p * d).sum(axis=1), (p * p).sum(axis=1) - radius**2
        found = np.full(len(P), np.inf)
        with np.errstate(invalid="ignore", divide="ignore"):
            for sign in (1.0, -1.0):
                t = (-b + sign * np.sqrt(b * b - a * c)) / a
                z = P[:, 2] + t * D[:, 2]
                found = np.where((t > 1e-6) & (z >= middle[2]) & (z <= middle[2] + height), t, found)
        return found

    return Surface(meet, lambda Q: (Q - middle) * (1.0 / radius, 1.0 / radius, 0.0), **looks)


def painted(picture, at: Float[np.ndarray, "N 2"]) -> Float[np.ndarray, "N 3"]:
    """Colours of a picture's pixels around its middle; it goes on as in a mirror."""
    h, w = picture.shape[:2]
    x = np.abs((at + np.array([1.5 * w, 1.5 * h])) % (2 * w, 2 * h) - (w, h)).astype(np.float32)
    rows = [x[i : i + 30_000].reshape(-1, 1, 2) for i in range(0, len(x), 30_000)]  # remap takes 32,767 rows
    seen = [cv2.remap(picture, row, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)[:, 0] for row in rows]
    return np.concatenate(seen) if seen else np.zeros((0, 3), np.float32)


def pattern(rng: np.random.Generator, colour, scatter: float, side: int = 800) -> np.ndarray:
    """A picture with spots of 4, 12 and 40 pixels around one colour."""
    rough = np.zeros((side, side, 3), np.float32)
    for sigma in (2.0, 6.0, 20.0):
        spots = cv2.GaussianBlur(rng.normal(0.0, 1.0, (side, side, 3)).astype(np.float32), (0, 0), sigma)
        rough += spots / spots.std()
    return np.clip(np.array(colour) + scatter * rough / rough.std(), 5.0, 250.0).astype(np.float32)


def follow(surfaces: list[Surface], P, D, bounces: int = BOUNCES):
    """Colours that come from where rays go, distances to what they meet first, lengths of their whole ways to paint,
    and the numbers of what they meet first; of a divided ray the whole way of its larger part."""
    near, which = np.full(len(P), np.inf), np.full(len(P), -1)
    for i, surface in enumerate(surfaces):
        t = surface.meet(P, D)
        which[t < near] = i
        near = np.minimum(near, t)
    colours, whole = np.zeros((len(P), 3)), near.copy()
    for i in np.unique(which[which >= 0]):
        surface, mine = surfaces[i], which == i
        Q, d = P[mine] + near[mine, None] * D[mine], D[mine]
        if surface.paint:
            colours[mine] = surface.paint(Q)
        elif bounces:
            n = surface.normal(Q)
            along = (d * n).sum(axis=1, keepdims=True)
            cosine = np.abs(along[:, 0]) / np.linalg.norm(d, axis=1)
            share = (surface.back + (1.0 - surface.back) * (1.0 - cosine) ** 5)[:, None]
            light, _, way, _ = follow(surfaces, Q, d - 2.0 * along * n, bounces - 1)
            if surface.through:
                behind, _, far, _ = follow(surfaces, Q, d, bounces - 1)
                colours[mine] = share * light + (1.0 - share) * behind
                whole[mine] += np.where(share[:, 0] > 0.5, way, far)
            else:
                colours[mine] = share * light
                whole[mine] += way
    return colours, near, whole, which


def room(rng: np.random.Generator, patterned: bool) -> list[Surface]:
    """Floor, four walls, a ceiling and two lamps, about a table at z = 0."""
    X, Y, Z = np.eye(3)
    up = float(rng.uniform(1.4, 1.9))

    def wall(middle, x, y, half, colour):
        picture = pattern(rng, colour, 35.0 if patterned else 0.0, 400)
        return rectangle(middle, x, y, half, picture=picture, scale=125.0)

    found = [wall(s * 2.0 * a, b, Z, (2.5, 3.0), (170, 165, 150)) for a, b in ((X, Y), (Y, X)) for s in (1.0, -1.0)]
    found += [wall((0.0, 0.0, z), X, Y, (3.0, 3.0), c) for z, c in ((up, (205, 205, 210)), (-0.75, (110, 100, 95)))]
    for x in (-0.5, 0.6):
        lamp = (x, rng.uniform(-0.8, 0.8), up - 0.05)
        found.append(rectangle(lamp, X, Y, (0.3, 0.08), paint=lambda Q: np.full(Q.shape, 900.0)))
    return found


def box(middle, half, yaw: float, picture) -> Surface:
    """A box that stands on the table, turned by `yaw`, its sides painted with one picture, darker than its top."""
    middle, half = np.asarray(middle, float), np.asarray(half, float)
    axes = np.array([[np.cos(yaw), np.sin(yaw), 0.0], [-np.sin(yaw), np.cos(yaw), 0.0], [0.0, 0.0, 1.0]])

    def meet(P, D):
        with np.errstate(divide="ignore", invalid="ignore"):
            ends = ((np.array([-half, half]))[:, None] - (P - middle) @ axes.T) / (D @ axes.T)
        first, last = ends.min(axis=0).max(axis=1), ends.max(axis=0).min(axis=1)
        return np.where((first < last) & (first > 1e-6), first, np.inf)

    def side(Q):
        return (np.abs((Q - middle) @ axes.T) / half).argmax(axis=1)

    def paint(Q):
        q, at = (Q - middle) @ axes.T, side(Q)
        across = np.where((at == 0)[:, None], q[:, 1:], np.where((at == 1)[:, None], q[:, ::2], q[:, :2]))
        return painted(picture, 1000.0 * across) * np.array([0.75, 0.88, 1.0])[at, None]

    return Surface(meet, lambda Q: axes[side(Q)], paint)


def things(rng: np.random.Generator) -> list[Surface]:
    """Four boxes and two balls with patterns, around the middle of the table."""
    found = []
    for k in range(6):
        angle, far = k * np.pi / 3.0 + rng.uniform(-0.2, 0.2), rng.uniform(0.17, 0.24)
        x, y = far * np.cos(angle), far * np.sin(angle)
        picture = pattern(rng, rng.uniform(40.0, 215.0, 3), rng.uniform(8.0, 30.0), 300)
        if k % 3 == 2:
            middle = np.array([x, y, rng.uniform(0.025, 0.045)])
            around = partial(on_a_ball, picture, middle)
            found.append(ball(middle, middle[2], paint=around))
        else:
            half = *rng.uniform(0.02, 0.045, 2), rng.uniform(0.015, 0.07)
            found.append(box((x, y, half[2]), half, rng.uniform(0.0, np.pi), picture))
    return found


def on_a_ball(picture, middle, Q):
    """Colours of points of a ball: a picture pulled over it."""
    return painted(picture, 1000.0 * (Q - middle)[:, :2] + 300.0 * (Q - middle)[:, 2:])


def mirror(kind: str, rng: np.random.Generator, facing: float) -> Surface:
    """A mirror or a glass in the middle of the table; those that stand or lean face the azimuth `facing`."""
    half = rng.uniform(0.08, 0.12), rng.uniform(0.07, 0.1)
    glass = {"back": GLASS, "through": True} if "pane" in kind or kind == "tumbler" else {"back": SILVER}
    facing += rng.uniform(-0.3, 0.3)
    if kind == "ball":
        r = rng.uniform(0.05, 0.07)
        return ball((0, 0, r), r, **glass)
    if kind == "tumbler":
        return tube((0, 0, 0), rng.uniform(0.03, 0.045), rng.uniform(0.09, 0.15), **glass)
    lean = {"flat": 0.0, "pane": 0.0, "tilted": rng.uniform(0.15, 0.5), "leaning": rng.uniform(1.0, 1.3)}.get(
        kind, np.pi / 2
    )
    x = np.array([-np.sin(facing), np.cos(facing), 0.0])
    up = np.array([-np.cos(lean) * np.cos(facing), -np.cos(lean) * np.sin(facing), np.sin(lean)])
    raised = 0.04 if kind == "pane" else 0.003
    return rectangle((0, 0, raised + half[1] * np.sin(lean)), x, up, half, **glass)


def photographed(kind: str, seed: int, patterned: bool = True, size=SIZE, count: int = 7) -> Mirrored:
    """Views of a table with six things around a mirror or glass of a kind of KINDS; the same seed gives the same."""
    rng = np.random.default_rng([13, int(seed)])
    around, distance, elevation = rng.uniform(-np.pi, np.pi), rng.uniform(0.48, 0.6), rng.uniform(0.75, 1.2)
    table = pattern(rng, rng.uniform(70.0, 190.0, 3), rng.uniform(6.0, 25.0))
    board = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0), (0.6, 0.6), picture=table)
    surfaces = [*room(rng, patterned), board, *things(rng), mirror(kind, rng, around)]
    K = intrinsics(FOV_Y, *size)
    pixels = np.stack([*np.meshgrid(np.arange(float(size[0])), np.arange(float(size[1]))), np.ones(size[::-1])], -1)
    rays = pixels.reshape(-1, 3) @ np.linalg.inv(K).T
    views, truth = [], None
    for azimuth in AZIMUTHS[:count]:
        at = np.array([0.0, 0.0, 0.03]) + rng.uniform(-0.03, 0.03, 3)
        turned = around + np.radians(azimuth + rng.uniform(-2.0, 2.0))
        tilt, roll = elevation + rng.uniform(-0.1, 0.1), rng.uniform(-0.2, 0.2)
        T = np.array(Camera.looking_at(at, distance + rng.uniform(-0.05, 0.05), turned, tilt, roll).T_base_cam)
        colours, *about = follow(surfaces, np.broadcast_to(T[:3, 3], rays.shape), rays @ T[:3, :3].T)
        if truth is None:
            near, whole, which = (a.reshape(size[::-1]) for a in about)
            truth = near, whole, which == len(surfaces) - 1
        drawn = np.clip(colours, 0.0, 255.0).reshape(*size[::-1], 3)
        large = cv2.resize(drawn.astype(np.float32), None, fx=2.0, fy=2.0, interpolation=cv2.INTER_CUBIC)
        taken = as_a_phone(np.clip(large, 0.0, 255.0).astype(np.uint8), rng)
        T[:3, 3] += rng.normal(0.0, 0.0004, 3)
        T[:3, :3] = T[:3, :3] @ cv2.Rodrigues(rng.normal(0.0, np.radians(0.04), 3))[0]
        views.append(View(cv2.resize(taken, tuple(size), interpolation=cv2.INTER_AREA), K, T))
    return Mirrored(views, *truth)
