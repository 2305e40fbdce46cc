"""What a config's scenes are like, in numbers: for the model card, and for the tests that hold them to it."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from data_gen.families import BOXES
from data_gen.scenes import sample_scene
from labkit.labels import TARGET
from labkit.sim.world import World

HIDDEN = 0.05  # a target counts as partly occluded when other objects hide more than this share of its silhouette


@dataclass(frozen=True)
class Statistics:
    """Shares are of all targets; obstacles is the mean of a scene, target_pixels the share of the median image.

    families: share of each target family. not_boxes: share of targets that are no boxes. camera: the distances from the
    camera to the middle of the targets that 5 % and 95 % of the scenes stay below, metres.
    """

    scenes: int
    families: dict[str, float]
    not_boxes: float
    obstacles: float
    occluded: float
    camera: tuple[float, float]
    target_pixels: float


def statistics(seeds: Iterable[int], config: str, size=(320, 240)) -> Statistics:
    """Build and render the scenes of `seeds` and count."""
    families, obstacles, hidden, distances, pixels = Counter(), [], [], [], []
    for seed in seeds:
        spec = sample_scene(seed, config)
        targets = [thing for thing in spec.objects if thing.class_id == TARGET]
        families.update(thing.family for thing in targets)
        obstacles.append(len(spec.objects) - len(targets))
        with World(spec) as world:
            frame = world.render(size)
            for number, thing in enumerate(spec.objects, start=1):
                if thing.class_id == TARGET:
                    whole = np.count_nonzero(silhouette(world, thing.name, size))
                    seen = np.count_nonzero(frame.instances == number)
                    hidden.append(1.0 - seen / whole if whole else 1.0)
            middle = np.mean([world.centre(thing.name) for thing in targets], axis=0)
        distances.append(float(np.linalg.norm(frame.T_base_cam[:3, 3] - middle)))
        pixels.append(np.mean(frame.labels == TARGET))
    total = sum(families.values())
    return Statistics(
        scenes=len(pixels),
        families={name: count / total for name, count in families.most_common()},
        not_boxes=1.0 - sum(families[name] for name in BOXES) / total,
        obstacles=float(np.mean(obstacles)),
        occluded=float(np.mean(np.array(hidden) > HIDDEN)),
        camera=tuple(float(d) for d in np.quantile(distances, (0.05, 0.95))),
        target_pixels=float(np.median(pixels)),
    )


def silhouette(world: World, name: str, size: tuple[int, int] = (320, 240)) -> Bool[np.ndarray, "H W"]:
    """The pixels that an object would cover if no other object stood before it; the simulation stays as it is."""
    number = 1 + list(world.bodies).index(name)
    state = world.client.saveState()
    for other, body in world.bodies.items():
        if other != name:
            world.client.resetBasePositionAndOrientation(body, (0.0, 0.0, -100.0), (0.0, 0.0, 0.0, 1.0))
    mask = world.render(size).instances == number
    world.client.restoreState(state)
    world.client.removeState(state)
    return mask
