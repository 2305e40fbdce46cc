"""Patches, stripes and labels of other colours on things in a picture: real things have them."""

import colorsys
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from labkit.frame import RGBDFrame
from labkit.labels import unknown_number
from labkit.support.validation import require

SHARE = 0.65  # of things that get paint
MOST = 4  # shapes on a thing
BANDS = 0.5  # of painted things in training, that get bands


def painted(frame: RGBDFrame, rng: np.random.Generator, share: float = SHARE, bands: float = 0.0) -> RGBDFrame:
    """Paint a share of the things of a frame with `instances` in colours of their own; all else stays.

    Each gets one to four shapes: half planes, turned rectangles, stripes and ellipses, of which its own pixels are
    painted. The paint has the thing's shading: a pixel keeps its brightness relative to the thing's brightest. bands:
    share of the painted ones that get bands across their length first, as caps, labels and grips are. Raises ValueError
    for a frame without instances.

    >>> rgb, depth = np.full((8, 8, 3), 90, np.uint8), np.ones((8, 8), np.float32)
    >>> frame = RGBDFrame(rgb, depth, np.diag([9.0, 9.0, 1.0]), np.eye(4), instances=np.eye(8, dtype=np.uint8))
    >>> changed = (painted(frame, np.random.default_rng(0), share=1.0).rgb != rgb).any(axis=2)
    >>> bool(changed.any()), bool(changed[frame.instances == 0].any())
    (True, False)
    """
    require("frame", frame.instances is not None, "one with instances", "one without")
    rgb = frame.rgb.copy()
    on_things = (frame.instances > 0) & (frame.instances != unknown_number(frame.instances))
    for number in np.unique(frame.instances[on_things]):
        if rng.random() >= share:
            continue
        v, u = np.nonzero(frame.instances == number)
        box = np.s_[v.min() : v.max() + 1, u.min() : u.max() + 1]
        mask = frame.instances[box] == number
        shade = frame.rgb[box].max(axis=2) / max(1.0, np.percentile(frame.rgb[box][mask].max(axis=1), 95))
        across = _bands(mask, rng) if bands and rng.random() < bands else []
        for band in [*across, *[None] * rng.integers(0 if across else 1, MOST + 1)]:
            colour = 255.0 * np.array(colorsys.hsv_to_rgb(rng.uniform(), rng.uniform() ** 0.7, rng.uniform(0.1, 1.0)))
            part = mask & _shape(mask.shape, rng) if band is None else band
            rgb[box][part] = np.clip(shade[part, None] * colour, 0.0, 255.0).astype(np.uint8)
    return replace(frame, rgb=rgb)


def _bands(mask: Bool[np.ndarray, "h w"], rng: np.random.Generator) -> list[Bool[np.ndarray, "h w"]]:
    """One to three bands of a thing's pixels, square to its longest direction in the picture."""
    v, u = np.nonzero(mask)
    if len(v) < 3:
        return []
    place = np.stack([u - u.mean(), v - v.mean()])
    along = np.linalg.eigh(place @ place.T)[1][:, -1] @ place
    along = (along - along.min()) / max(np.ptp(along), 1.0)
    bands = []
    for _ in range(rng.integers(1, 4)):
        first, last = np.sort(rng.uniform(-0.3, 1.3, 2))
        band = np.zeros_like(mask)
        band[v, u] = (along > first) & (along < last)
        bands.append(band)
    return bands


def _shape(size: tuple[int, int], rng: np.random.Generator) -> Bool[np.ndarray, "h w"]:
    """A half plane, a rectangle, stripes or an ellipse, somewhere in a picture of (h, w)."""
    angle, middle, reach = rng.uniform(0.0, np.pi), rng.uniform(0.0, 1.0, 2) * size, max(size)
    along, across = _coordinates(size, angle, middle)
    long, wide = reach * rng.uniform(0.1, 0.5), reach * rng.uniform(0.05, 0.35)
    kind = rng.integers(4)
    if kind == 0:
        return along > 0.0
    if kind == 1:
        return (np.abs(along) < long) & (np.abs(across) < wide)
    if kind == 2:
        period = rng.uniform(0.08, 0.5) * reach
        return (along / period % 1.0 < rng.uniform(0.2, 0.6)) & (np.abs(across) < reach * rng.uniform(0.1, 1.0))
    return (along / long) ** 2 + (across / wide) ** 2 < 1.0


def _coordinates(
    size: tuple[int, int], angle: float, middle
) -> tuple[Float[np.ndarray, "h w"], Float[np.ndarray, "h w"]]:
    """Each pixel's place along and across a direction through `middle` (row, column)."""
    v, u = np.mgrid[: size[0], : size[1]]
    dv, du = v - middle[0], u - middle[1]
    return np.cos(angle) * du + np.sin(angle) * dv, np.cos(angle) * dv - np.sin(angle) * du
