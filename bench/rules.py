"""Simulated pictures for the rules about tables: things at a bent table's edges, cut off, in a full bin; a robot's arm.

Each frame carries its true instances, so that what is lost is lost by the rules alone and not by a network.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from jaxtyping import Bool

import data_gen
from labkit.frame import RGBDFrame
from labkit.labels import BACKGROUND
from labkit.sim.spec import Camera, ObjectSpec, Part, SceneSpec, Table, Texture
from labkit.sim.world import World

SIZE = (640, 480)
NOISE = 0.0014  # metres of noise at one metre; it grows with the square


def bent(frame: RGBDFrame, seed: int, by: float = 0.08) -> RGBDFrame:
    """Depth as of a camera that is right in its middle: off by `by` (z r)^2, with noise that grows as z^2.

    r is 1 at 45 degrees from where the camera looks. Of a table a metre away its ends lie two centimetres off the plane
    of the rest.
    """
    z, (v, u) = frame.depth.astype(np.float64), np.indices(frame.depth.shape)
    r2 = ((u - frame.K[0, 2]) / frame.K[0, 0]) ** 2 + ((v - frame.K[1, 2]) / frame.K[1, 1]) ** 2
    error = by * r2 + NOISE * np.random.default_rng(seed).standard_normal(z.shape)
    return replace(frame, depth=np.where(z > 0.0, z + error * z**2, 0.0).astype(np.float32))


def at_the_edges(seed: int) -> SceneSpec:
    """Boxes and cans along all four edges of a table of 80 to 100 cm, and some in its middle; the camera is outside."""
    rng = np.random.default_rng([20, seed])
    size = float(rng.uniform(0.75, 0.9)), float(rng.uniform(0.8, 1.1)), 0.03
    table = Table(centre=(0.6, 0.0), size=size, texture=Texture("wood", seed=seed))
    along = [(a, b) for a in (-1, 0, 1) for b in (-1, 0, 1)]
    things = []
    for number, (a, b) in enumerate(along):
        half = rng.uniform(0.02, 0.04, 2)
        tall = float(rng.uniform(0.05, 0.16))
        x, y = (0.6, 0.0) + (a, b) * (np.array(size[:2]) / 2 - half - 0.004)
        part = Part("box", (2 * float(half[0]), 2 * float(half[1]), tall))
        colour = tuple(map(float, rng.uniform(0.1, 0.9, 3)))
        place = (float(x), float(y), tall / 2 + 0.002)
        things.append(ObjectSpec(f"box{number}", "block", 2, place, parts=(part,), colour=colour))
    middle = 0.6, 0.0, 0.0
    camera = Camera.looking_at(
        middle, float(rng.uniform(1.0, 1.3)), float(rng.uniform(-0.6, 0.6)), float(rng.uniform(0.45, 0.7)), fov_y=0.85
    )
    return SceneSpec(tuple(things), camera, table, robot=False, seed=seed)


def cut_off(seed: int) -> SceneSpec:
    """A tall carton that stands where the picture ends, and three low things in its middle."""
    rng = np.random.default_rng([21, seed])
    azimuth, distance, elevation = rng.uniform((-1.0, 0.7, 0.4), (1.0, 1.0, 0.8))
    camera = Camera.looking_at((0.55, 0.0, 0.03), float(distance), float(azimuth), float(elevation), fov_y=0.7)
    across = np.array(camera.T_base_cam)[:2, 0]  # the picture's columns
    half = distance * np.tan(0.35) * 4 / 3
    side = rng.choice([-1.0, 1.0])
    low = [("low", s * 0.12, rng.uniform(-0.08, 0.08), (0.05, 0.06, 0.05)) for s in (-1, 0, 1)]
    tall = [("carton", side * half * rng.uniform(0.8, 0.95), 0.0, (0.09, 0.17, rng.uniform(0.18, 0.28)))]
    things = []
    for number, (name, u, ahead, sides) in enumerate([*low, *tall]):
        x, y = np.array([0.55, 0.0]) + u * across + ahead * np.array([-across[1], across[0]])
        colour = tuple(map(float, rng.uniform(0.1, 0.9, 3)))
        place = (float(x), float(y), float(sides[2]) / 2 + 0.002)
        part = Part("box", tuple(map(float, sides)))
        things.append(ObjectSpec(f"{name}{number}", "block", 2, place, parts=(part,), colour=colour))
    table = Table(size=(1.2, 1.6, 0.05), texture=Texture("clouds", seed=seed))
    return SceneSpec(tuple(things), camera, table, robot=False, seed=seed)


def full_bin(seed: int) -> SceneSpec:
    """A bin of `data_gen` that fills the picture."""
    spec = data_gen.sample_scene(seed, "bin")
    T = np.array(spec.camera.T_base_cam)
    T[:3, 3] += 0.35 * np.linalg.norm(T[:3, 3] - (0.55, 0.0, 0.0)) * T[:3, 2]  # towards what it looks at
    return replace(spec, camera=replace(spec.camera, T_base_cam=T))


def frames(kind: str, seeds) -> Iterator[RGBDFrame]:
    """Pictures of a kind: "edges", "cut off", "bin", or "arm" whose arm is one more instance, the highest."""
    make = {"edges": at_the_edges, "cut off": cut_off, "bin": full_bin}
    for seed in seeds:
        if kind == "arm":
            yield from with_arm(data_gen.sample_scene(seed, "messy"))
            continue
        frame = data_gen.render(make[kind](seed), SIZE)
        yield bent(frame, seed)


def with_arm(spec: SceneSpec) -> Iterator[RGBDFrame]:
    """The picture with the arm as an instance, if the arm covers a hundredth of it."""
    with World(spec) as world:
        frame = world.render(SIZE)
        poses = world.poses()
        arm = arm_of(world, frame)
    if arm.mean() > 0.01 and poses:
        instances = np.where(arm, frame.instances.max() + 1, frame.instances).astype(np.uint8)
        yield bent(replace(frame, instances=instances), spec.seed)


def arm_of(world: World, frame: RGBDFrame) -> Bool[np.ndarray, "H W"]:
    """The arm's pixels: nearer than in the same picture without it."""
    world.client.resetBasePositionAndOrientation(world.robot, (0.0, 0.0, -50.0), (0.0, 0.0, 0.0, 1.0))
    without = world.render(SIZE)
    return (frame.labels == BACKGROUND) & (frame.depth < without.depth - 0.005)
