"""A table as somebody photographs it who has a phone and the printed sheet: several pictures of one scene (topic 06).

What a phone does to a picture is here: a lens, exposure and white balance that change from picture to picture, shading,
shine, motion blur, noise, JPEG, and a hand that rolls. What it does not have: focus that breathes, rolling shutter.
"""

from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from data_gen.scenes import sample_scene
from labkit.frame import RGBDFrame
from labkit.sim.spec import Camera, SceneSpec, Texture
from labkit.sim.world import World, intrinsics

SIZE = (1280, 960)
FOV_Y = 0.88  # radians: f = 1.06 of the larger half side, as most phones' main camera
WIDER = 1.12  # the scene is drawn with so much larger a field, and the lens then bends it
AZIMUTHS = (0.0, 12.0, -12.0, 24.0, -24.0, 6.0, -6.0)  # degrees around the things, as one walks
NEAR, FAR = 0.42, 0.68  # metres from the things
LOW, HIGH = np.radians(38.0), np.radians(78.0)  # elevations
PUSH = 0.06  # metres
WHITE = (0.93, 0.93, 0.92)


@dataclass(frozen=True, eq=False)
class Shots:
    """Photographs of a scene, the camera that took them, and the truth about the first.

    pictures: RGB, `SIZE`. K, distortion: the phone's. T_base_cam: true poses, in the robot's base frame. T_base_sheet:
    of the printed sheet. frame: what an exact depth camera with half the first picture's pixels, and no lens, sees.
    spec: the scene, without a robot.
    """

    pictures: list[UInt8[np.ndarray, "H W 3"]]
    K: Float[np.ndarray, "3 3"]
    distortion: tuple[float, ...]
    T_base_cam: list[Float[np.ndarray, "4 4"]]
    T_base_sheet: Float[np.ndarray, "4 4"]
    frame: RGBDFrame
    spec: SceneSpec


def with_sheet(spec: SceneSpec, rng: np.random.Generator) -> SceneSpec:
    """Lay the sheet where things hide least of it, near their middle; a third of the tables and a fifth of the things
    are plain and white, as kitchens have them."""
    things = np.array([thing.position[:2] for thing in spec.objects])
    middle = things.mean(axis=0)
    best, place = np.inf, None
    for _ in range(300):
        yaw = rng.uniform(-np.pi, np.pi)
        corner = middle + rng.uniform(-0.3, 0.3, 2)
        x, y = np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]]) @ (things - corner).T
        centre = corner + np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]) @ (0.09, 0.12)
        inside = (np.abs(centre - spec.table.centre) < np.array(spec.table.size[:2]) / 2.0 - 0.15).all()
        away = np.hypot(*np.maximum(np.abs([x - 0.09, y - 0.12]) - np.array([[0.09], [0.12]]), 0.0))
        hidden = np.maximum(0.06 - away, 0.0).sum() + 0.1 * np.linalg.norm(centre - middle)
        if inside and hidden < best:
            best, place = hidden, (*map(float, corner), float(yaw))
    table = spec.table
    if rng.random() < 1.0 / 3.0:
        table = replace(table, texture=Texture("plain", WHITE if rng.random() < 0.5 else table.texture.colour_a))
    objects = tuple(replace(thing, colour=WHITE) if rng.random() < 0.2 else thing for thing in spec.objects)
    return replace(spec, objects=objects, table=table, sheet=place, robot=False)


def photograph(seed: int, config: str = "any", count: int = 7, moved: int | None = None) -> Shots:
    """Take `count` photographs of a scene of data_gen, the sheet on its table; the same seed gives the same bytes.

    moved: the number of a photograph for which somebody pushed the thing nearest to the middle aside, and back after.
    """
    rng = np.random.default_rng([11, int(seed)])
    spec = with_sheet(sample_scene(seed, config), rng)
    lens = (float(rng.uniform(-0.05, 0.1)), float(rng.uniform(-0.1, 0.05)), 0.0, 0.0, 0.0)
    K = intrinsics(FOV_Y, *SIZE)
    at = np.array([*np.mean([thing.position[:2] for thing in spec.objects], axis=0), spec.table.z + 0.03])
    x, y, yaw = spec.sheet
    at[:2] = 0.6 * at[:2] + 0.4 * (np.array([x, y]) + 0.15 * np.array([np.cos(yaw + 0.93), np.sin(yaw + 0.93)]))
    around, elevation, distance = rng.uniform(-np.pi, np.pi), rng.uniform(LOW, HIGH), rng.uniform(NEAR, FAR)
    pictures, poses = [], []
    with World(spec) as world:
        for azimuth in AZIMUTHS[:count]:
            camera = Camera.looking_at(
                at + rng.uniform(-0.03, 0.03, 3),
                distance=float(np.clip(distance + rng.uniform(-0.06, 0.06), NEAR, FAR)),
                azimuth=around + np.radians(azimuth + rng.uniform(-2.0, 2.0)),
                elevation=float(np.clip(elevation + rng.uniform(-0.12, 0.12), LOW, HIGH)),
                roll=rng.uniform(-0.2, 0.2),
                fov_y=FOV_Y,
            )
            wide = replace(camera, fov_y=float(2.0 * np.arctan(WIDER * np.tan(FOV_Y / 2.0))))
            with pushed(world, at) if len(poses) == moved else nullcontext():
                drawn = world.render(SIZE, wide)
            pictures.append(as_a_phone(bent(drawn, K, lens), rng))
            poses.append(drawn.T_base_cam)
            if len(poses) == 1:
                frame = world.render((SIZE[0] // 2, SIZE[1] // 2), camera)
    T_base_sheet = np.eye(4)
    T_base_sheet[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    T_base_sheet[:3, 3] = x, y, spec.table.z
    return Shots(pictures, K, lens, poses, T_base_sheet, frame, spec)


@contextmanager
def pushed(world: World, at: Float[np.ndarray, "3"]):
    """While this lasts, the thing nearest to `at` is `PUSH` metres from where it stands."""
    body = world.bodies[min(world.bodies, key=lambda name: np.linalg.norm(world.centre(name)[:2] - at[:2]))]
    place, turn = world.client.getBasePositionAndOrientation(body)
    world.client.resetBasePositionAndOrientation(body, (place[0] + PUSH, place[1], place[2]), turn)
    yield
    world.client.resetBasePositionAndOrientation(body, place, turn)


def bent(drawn: RGBDFrame, K: Float[np.ndarray, "3 3"], lens) -> UInt8[np.ndarray, "H W 3"]:
    """The picture that a camera of K and `lens` takes of what a wider pinhole drew."""
    height, width = drawn.rgb.shape[:2]
    pixels = np.stack(np.meshgrid(np.arange(width, dtype=float), np.arange(height, dtype=float)), axis=-1)
    rays = cv2.undistortPoints(pixels.reshape(-1, 1, 2), K, np.array(lens)).reshape(height, width, 2)
    places = rays * np.diag(drawn.K)[:2] + drawn.K[:2, 2]
    return cv2.remap(drawn.rgb, places.astype(np.float32), None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)


def as_a_phone(rgb: UInt8[np.ndarray, "H W 3"], rng: np.random.Generator) -> UInt8[np.ndarray, "H W 3"]:
    """Expose, shade, blur, add noise and pack a picture as a phone held in a hand does."""
    height, width = rgb.shape[:2]
    light = rgb.astype(np.float32) * rng.normal(1.0, 0.1) * rng.normal(1.0, 0.02, 3)
    v, u = np.mgrid[-1.0 : 1.0 : height * 1j, -1.0 : 1.0 : width * 1j]
    shade = 1.0 + rng.uniform(-0.1, 0.1) * u + rng.uniform(-0.1, 0.1) * v - 0.1 * (u**2 + v**2)
    light *= shade[..., None].astype(np.float32)
    path, angle = rng.uniform(0.0, 2.5), rng.uniform(0.0, np.pi)  # pixels that the hand moves while it is open
    steps = np.linspace(-0.5, 0.5, 9) * path
    kernel = np.zeros((7, 7), np.float32)
    for step in steps:
        kernel[round(3 + step * np.sin(angle)), round(3 + step * np.cos(angle))] += 1.0 / len(steps)
    light = cv2.GaussianBlur(cv2.filter2D(light, -1, kernel), (0, 0), rng.uniform(0.5, 0.9))
    light += rng.normal(0.0, rng.uniform(1.5, 4.0), light.shape).astype(np.float32)
    picture = np.clip(light, 0.0, 255.0).astype(np.uint8)
    packed = cv2.imencode(".jpg", picture[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(82, 96))])[1]
    return np.ascontiguousarray(cv2.imdecode(packed, cv2.IMREAD_COLOR)[..., ::-1])
