"""Random changes of RGB-D training frames: another window and roll of the camera, a bad sensor, a bad calibration.

Each change keeps colour, depth and labels of one scene together, and the camera that would have seen it so: heights,
normals and sizes are computed after it, from what a robot would know. Topics 03_gradient and 06_back_projection.
"""

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
import torch
from jaxtyping import Bool, Float, UInt8
from scipy.spatial.transform import Rotation

from labkit.frame import RGBDFrame
from labkit.geometry.sensor import DepthSensor
from labkit.labels import IGNORE, OBSTACLE, TARGET, unknown_number
from labkit.learning.channels import geometry_channels, mirrored
from labkit.learning.view import resized, rolled_camera
from labtrain.augment import Draws, random_colour, random_hue, random_noise, random_sharpness
from labtrain.images import in_8_bits
from labtrain.paint import BANDS, painted

SIZES = 0.8, 1.7  # of a world, to that which was rendered, where things shall be told apart


def random_view(frame: RGBDFrame, size: tuple[int, int], rng: np.random.Generator) -> RGBDFrame:
    """The labelled frame of a camera that is zoomed, rolled about its axis and cut to a window of (h, w) pixels.

    Three windows in four lie round a place on an object: there is most to learn. What lies outside the old image is
    labelled 255 and has no depth.
    """
    h, w = size
    H, W = frame.depth.shape
    zoom = np.exp(rng.uniform(np.log(0.75), np.log(1.35)))
    roll = rng.uniform(-0.35, 0.35) if rng.random() < 0.5 else 0.0
    spare = np.maximum(0.0, np.array([W - w / zoom, H - h / zoom]) / 2.0)
    shift = spare * rng.uniform(-1.0, 1.0, 2)
    objects = np.flatnonzero((frame.labels == TARGET) | (frame.labels == OBSTACLE))
    if objects.size and rng.random() < 0.75:
        pixel = objects[rng.integers(objects.size)]
        shift = np.array([pixel % W, pixel // W]) - np.array([W - 1, H - 1]) / 2.0
        shift += rng.uniform(-0.3, 0.3, 2) * np.array([w, h]) / zoom
    # The place that the middle of the window shows, such that the window stays inside the image if it fits.
    middle = np.array([W - 1, H - 1]) / 2.0 + np.clip(shift, -spare, spare)
    K_new = frame.K * np.array([[zoom, zoom, 1.0], [zoom, zoom, 1.0], [1.0, 1.0, 1.0]])
    ray = Rotation.from_euler("z", -roll).apply(np.linalg.solve(frame.K, [*middle, 1.0]))
    K_new[:2, 2] = np.array([w - 1, h - 1]) / 2.0 - K_new[:2, :2] @ ray[:2]
    return rolled_camera(frame, roll, K_new, (w, h))


def random_sensor(depth: Float[np.ndarray, "H W"], rng: np.random.Generator) -> Float[np.ndarray, "H W"]:
    """Depth as some sensor measures it: one frame in five exact, one in thirty without any depth."""
    kind = rng.random()
    if kind < 0.2:
        return depth
    if kind > 0.97:
        return np.zeros_like(depth)
    h, w = depth.shape
    hidden = stereo_shadow(depth, rng) if rng.random() < 0.4 else np.zeros((h, w), bool)
    if rng.random() < 0.3:
        depth = flying_pixels(depth, rng)
    if rng.random() < 0.7:
        depth = depth + depth**2 * correlated_noise((h, w), rng)
    sensor = DepthSensor(
        noise=rng.uniform(0.0, 0.003),
        step=rng.choice([0.0, rng.uniform(0.0005, 0.005)]),
        edge_loss=rng.choice([0.0, rng.uniform(0.0, 0.9)]),
        loss=rng.choice([0.001, rng.uniform(0.0, 0.03)]),
    )
    depth = np.where(hidden, np.float32(0.0), sensor.measure(depth, rng))
    if rng.random() < 0.3:  # shiny or dark places give no reading
        for _ in range(rng.integers(1, 6)):
            middle = (int(rng.integers(w)), int(rng.integers(h)))
            axes = (int(rng.integers(2, 16)), int(rng.integers(2, 16)))
            cv2.ellipse(depth, middle, axes, float(rng.uniform(0.0, 180.0)), 0.0, 360.0, 0.0, -1)
    return depth


def correlated_noise(shape: tuple[int, int], rng: np.random.Generator) -> Float[np.ndarray, "H W"]:
    """Errors that neighbours have in common, in metres at a distance of 1 m: a sensor compares patches, not pixels.

    One to three fields of random knots, 2 to 24 pixels apart and interpolated between; their sum has a standard
    deviation of up to 4 mm, so that the worst twentieth errs by more than 8.
    """
    noise = np.zeros(shape, np.float32)
    for _ in range(rng.integers(1, 4)):
        apart = np.exp(rng.uniform(np.log(2.0), np.log(24.0)))
        field = smooth_field(shape, rng, apart, cv2.INTER_LINEAR)
        noise += np.float32(rng.uniform(0.2, 1.0)) * field
    return noise * np.float32(rng.uniform(0.0, 0.004)) / noise.std()


def stereo_shadow(depth: Float[np.ndarray, "H W"], rng: np.random.Generator) -> Bool[np.ndarray, "H W"]:
    """Which pixels the second eye of a stereo camera does not see, behind something nearer.

    Its disparity is 8 to 40 pixels at the median depth, and it may lie to any of the four sides of the first eye: the
    view may have been turned.
    """
    turns = int(rng.integers(4))
    d = np.rot90(depth, turns)
    known = d > 0.0
    if not known.any():
        return ~np.rot90(known, -turns)
    disparity = rng.uniform(8.0, 40.0) * np.median(d[known]) / np.where(known, d, np.inf)
    place = np.arange(d.shape[1]) - disparity
    nearest = np.minimum.accumulate(place[:, ::-1], axis=1)[:, ::-1]  # of this pixel and all on its right
    hidden = np.zeros(d.shape, bool)
    hidden[:, :-1] = place[:, :-1] >= nearest[:, 1:]
    return np.rot90(hidden, -turns)


def flying_pixels(depth: Float[np.ndarray, "H W"], rng: np.random.Generator) -> Float[np.ndarray, "H W"]:
    """Some pixels beside a jump of depth get a value between its two sides, as a sensor does that sees both."""
    far = cv2.dilate(depth, np.ones((3, 3), np.uint8))
    near = cv2.erode(np.where(depth > 0.0, depth, depth.max()), np.ones((3, 3), np.uint8))
    mixed = (depth > 0.0) & (far - near > 0.01) & (rng.random(depth.shape) < rng.uniform(0.1, 0.8))
    share = rng.random(depth.shape, np.float32)
    return np.where(mixed, near + share * (far - near), depth)


def random_calibration(frame: RGBDFrame, rng: np.random.Generator) -> RGBDFrame:
    """The frame with a pose and a table height that are off by about 1 cm, 1 degree and 5 mm; one in five exact."""
    if rng.random() < 0.2:
        return frame
    T = frame.T_base_cam.copy()
    T[:3, :3] = T[:3, :3] @ Rotation.from_rotvec(np.radians(0.55) * rng.standard_normal(3)).as_matrix()
    T[:3, 3] += 0.006 * rng.standard_normal(3)
    return replace(frame, T_base_cam=T, table_z=(frame.table_z or 0.0) + 0.005 * rng.standard_normal())


def random_size(frame: RGBDFrame, rng: np.random.Generator, low: float = 0.887, high: float = 1.127) -> RGBDFrame:
    """All lengths times one factor, the table at 0: objects of another size, seen from as many times as far."""
    return resized(frame, np.exp(rng.uniform(np.log(low), np.log(high))))


def hidden_things(frame: RGBDFrame, rng: np.random.Generator) -> RGBDFrame:
    """Take the depth, or most of it, from one thing in fifteen: black, shiny and clear things give no reading."""
    depth = frame.depth.copy()
    for number in np.unique(frame.instances):
        if 0 < number < unknown_number(frame.instances) and rng.random() < 1.0 / 15.0:
            lost = cv2.blur(rng.random(depth.shape, np.float32), (5, 5)) < rng.uniform(0.45, 0.75)
            depth[(frame.instances == number) & lost] = 0.0
    return replace(frame, depth=depth)


def random_exposure(frame: RGBDFrame, rng: np.random.Generator) -> RGBDFrame:
    """The picture at another exposure: too dark, too bright, or with other mid tones."""
    gamma, gain = np.exp(rng.uniform(np.log((0.6, 0.35)), np.log((2.2, 1.8))))
    tones = np.clip(255.0 * gain * (np.arange(256) / 255.0) ** gamma, 0.0, 255.0).astype(np.uint8)
    return replace(frame, rgb=cv2.LUT(frame.rgb, tones))


def random_bend(frame: RGBDFrame, rng: np.random.Generator) -> RGBDFrame:
    """Depth with an error of 1 to 15 mm that changes over a third of the picture or more: nothing is quite plane.

    Lenses err so, and bins and worn tables are so.
    """
    error = smooth_field(frame.depth.shape, rng, rng.uniform(0.3, 1.0) * max(frame.depth.shape))
    error *= np.float32(np.exp(rng.uniform(np.log(0.001), np.log(0.015))) / max(np.abs(error).max(), 1e-6))
    return replace(frame, depth=np.where(frame.depth > 0.0, frame.depth + error, np.float32(0.0)))


def random_depth_loss(frame: RGBDFrame, rng: np.random.Generator) -> RGBDFrame:
    """Up to a third of the picture without depth: in ragged patches, or where it is darkest; sometimes black there.

    A scanner that gives a colour with each point alone gives none, which is black, where it has no point.
    """
    field = smooth_field(frame.depth.shape, rng, np.exp(rng.uniform(np.log(6.0), np.log(120.0))))
    if rng.random() < 0.4:
        field = frame.rgb.max(axis=2) / np.float32(40.0) + np.float32(0.3) * field
    field += np.float32(rng.uniform(0.1, 0.7)) * rng.standard_normal(field.shape, np.float32)
    lost = field < np.quantile(field[::4, ::4], rng.uniform(0.02, 0.33))
    rgb = np.where(lost[..., None], np.uint8(0), frame.rgb) if rng.random() < 0.3 else frame.rgb
    return replace(frame, rgb=rgb, depth=np.where(lost, np.float32(0.0), frame.depth))


def smooth_field(
    shape: tuple[int, int], rng: np.random.Generator, apart: float, between: int = cv2.INTER_CUBIC
) -> Float[np.ndarray, "H W"]:
    """Numbers around 0, about 1 in size, interpolated as `between` says from random knots `apart` pixels apart."""
    knots = rng.standard_normal([int(side / apart) + 2 for side in shape]).astype(np.float32)
    return cv2.resize(knots, shape[::-1], interpolation=between)


def varied_things(frame: RGBDFrame, rng: np.random.Generator) -> RGBDFrame:
    """A frame with instances as it may be before the canonical view.

    Painted, and some each of another exposure, with bent or missing depth, and of another size.
    """
    frame = painted(frame, rng, bands=BANDS)
    for change, share in ((random_exposure, 0.4), (random_bend, 0.35), (random_depth_loss, 0.35)):
        frame = change(frame, rng) if rng.random() < share else frame
    return random_size(frame, rng, *SIZES) if rng.random() < 0.5 else frame


def augment_frames(
    frames: Sequence[RGBDFrame],
    size: tuple[int, int],
    generator: torch.Generator,
    first: int = 0,
    whole: int | None = None,
) -> tuple[
    Float[torch.Tensor, "N 3 h w"],
    Float[torch.Tensor, "N 7 h w"],
    UInt8[torch.Tensor, "N h w"],
    UInt8[torch.Tensor, "N h w"],
]:
    """Make a training batch of labelled frames: colours and geometry channels in 0..1, labels, and instances.

    One frame in four keeps its depth and calibration: a simulated camera is exact in both. Instances are 255 wherever
    nobody knows them.
    first, whole: as for `labtrain.augment.augment`.
    """
    seed = int(torch.randint(2**62, (), generator=generator))
    rgb, geometry, y, instances = [], [], [], []
    for i, frame in enumerate(frames, start=first):
        rng = np.random.default_rng([seed, i])
        seen, measured = random_view(frame, size, rng), rng.random() < 0.75
        seen = random_size(random_calibration(seen, rng) if measured else seen, rng)
        if measured and seen.instances is not None:
            seen = hidden_things(seen, rng)
        depth = random_sensor(seen.depth, rng) if measured else seen.depth
        of_things = np.full_like(seen.labels, IGNORE) if seen.instances is None else in_8_bits("frames", seen.instances)
        images = (
            seen.rgb,
            geometry_channels(depth, seen.K, seen.T_base_cam, 0.0),
            seen.labels[..., None],
            of_things[..., None],
        )
        if rng.random() < 0.5:
            images = [mirrored(image) for image in images]
        for batch, image in zip((rgb, geometry, y, instances), images, strict=True):
            batch.append(torch.tensor(image).permute(2, 0, 1))  # a copy: a frame cannot be written to
    draws = Draws(generator, whole or len(frames), first, len(frames))
    x = random_colour(torch.stack(rgb).float().div_(255.0), draws)
    x = random_hue(random_noise(random_sharpness(x, draws), draws), draws).clamp_(0.0, 1.0)
    return x, torch.stack(geometry), torch.stack(y)[:, 0], torch.stack(instances)[:, 0]
