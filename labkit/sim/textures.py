"""Procedural pictures for tables, floors and walls: arrays from a few numbers and a seed, no image files to ship."""

import numpy as np
from jaxtyping import Float, UInt8
from scipy.ndimage import gaussian_filter

from labkit.sim.spec import Texture
from labkit.support.validation import require

SIZE = 128


def paint(texture: Texture) -> UInt8[np.ndarray, "128 128 3"]:
    """Paint a texture as an RGB image, 128 x 128; the same texture gives the same bytes.

    Raises ValueError if `texture.kind` is not one of `KINDS`.

    >>> paint(Texture("plain", colour_a=(1.0, 0.0, 0.0)))[0, 0].tolist()
    [255, 0, 0]
    """
    require("texture.kind", texture.kind in KINDS, f"one of {sorted(KINDS)}", repr(texture.kind))
    v, u = np.mgrid[0:SIZE, 0:SIZE] / SIZE
    mix = KINDS[texture.kind](u, v, texture.scale, np.random.default_rng(texture.seed))[..., None]
    colour = (1.0 - mix) * np.asarray(texture.colour_a) + mix * np.asarray(texture.colour_b)
    return np.round(255.0 * np.clip(colour, 0.0, 1.0)).astype(np.uint8)


def _stripes(u, v, scale, angle) -> Float[np.ndarray, "H W"]:
    return 0.5 + 0.5 * np.sin(2.0 * np.pi * scale * (np.cos(angle) * u + np.sin(angle) * v))


def _wood(u, v, scale, rng) -> Float[np.ndarray, "H W"]:
    """Bent rings, stretched along one side as in a sawn board."""
    bend = gaussian_filter(rng.standard_normal(u.shape), (6.0, 30.0), mode="wrap")
    grain = gaussian_filter(rng.standard_normal(u.shape), (0.7, 12.0), mode="wrap")
    rings = 0.5 + 0.5 * np.sin(2.0 * np.pi * scale * (v + 0.35 * bend / bend.std() / scale))
    return np.clip(0.7 * rings + 0.3 * (0.5 + 0.25 * grain / grain.std()), 0.0, 1.0)


def _clouds(u, v, scale, rng) -> Float[np.ndarray, "H W"]:
    """Smooth noise in two octaves, as on stone or stained cloth."""
    mix = sum(
        weight * field / field.std()
        for weight, sigma in ((1.0, SIZE / scale), (0.5, SIZE / scale / 4.0))
        for field in [gaussian_filter(rng.standard_normal(u.shape), sigma, mode="wrap")]
    )
    return np.clip(0.5 + 0.3 * mix, 0.0, 1.0)


def _speckle(u, v, scale, rng) -> Float[np.ndarray, "H W"]:
    """Grains, as on terrazzo."""
    field = gaussian_filter(rng.standard_normal(u.shape), 1.2, mode="wrap")
    return (field > np.quantile(field, 0.8)).astype(float)


def _bricks(u, v, scale, rng) -> Float[np.ndarray, "H W"]:
    across = (u * scale / 2.0 + 0.5 * (np.floor(v * scale) % 2)) % 1.0
    return ((across < 0.05) | (v * scale % 1.0 < 0.1)).astype(float)


# From where in the picture (u, v in 0..1), how fine, and a generator: how much of the second colour.
KINDS = {
    "plain": lambda u, v, scale, rng: np.zeros_like(u),
    "checker": lambda u, v, scale, rng: (np.floor(u * scale) + np.floor(v * scale)) % 2,
    "stripes": lambda u, v, scale, rng: _stripes(u, v, scale, rng.uniform(0.0, np.pi)),
    "wood": _wood,
    "clouds": _clouds,
    "speckle": _speckle,
    "dots": lambda u, v, scale, rng: (u * scale % 1.0 - 0.5) ** 2 + (v * scale % 1.0 - 0.5) ** 2 < 0.09,
    "bricks": _bricks,
}
