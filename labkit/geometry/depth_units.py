"""Raw depth as cameras, phones and files give it: which unit its numbers have, and how it gets a picture's size.

Topic 06.
"""

import cv2
import numpy as np
from jaxtyping import Float, Float32, Real, UInt16

from labkit.support.validation import check_depth, check_K, check_shape, require

POSSIBLE = (0.05, 20.0)  # metres: what a depth camera's median can be
LIKELY = (0.15, 4.0)  # metres: of a picture of things on a table
UNITS = (1.0, 0.01, 0.001, 0.0001)  # metres that files count in, the usual ones
FACTORS = (0.001, 0.1, 0.2, 0.25, 0.5, 2.0, 4.0, 5.0, 10.0, 1000.0)  # from one usual unit to another, of metres too
AWAY, LENGTHS = (0.2, 1.8), (0.015, 0.35)  # metres: from a camera to what a hand grasps, and how long that is
OPTION = "--depth-scale says how many metres a unit is"
MEANINGS = {  # what a camera's file may mean by a number, as metres per unit
    "metres per unit": lambda number: number,
    "millimetres per unit (BOP)": lambda number: 0.001 * number,
    "units per metre": lambda number: 1.0 / number,
}


def readings(raw: Real[np.ndarray, "H W"]) -> Real[np.ndarray, "_"]:
    """The numbers of a raw depth image that are readings: finite and not 0; raises ValueError for negative ones.

    >>> readings(np.array([[0.0, np.nan, np.inf, 0.8]])).tolist()
    [0.8]
    """
    raw = check_shape("depth", raw, (None, None))
    require("depth", raw.dtype.kind in "fiu", "real numbers", f"dtype {raw.dtype}")
    seen = raw[np.isfinite(raw) & (raw != 0)]
    least = seen.min(initial=0)
    require("depth", least >= 0, "numbers of 0 or more", f"a minimum of {least:.6g}; is it disparity, or z of OpenGL?")
    return seen


def metres_per_unit(
    raw: Real[np.ndarray, "H W"], given: float | None = None, stated: float | None = None
) -> tuple[float, str]:
    """Find how many metres a unit of a raw depth image is; also a sentence on what was taken, "" if nothing was.

    raw: integers or floats as a file holds them; 0, NaN and infinity are no reading. given: what the user says, metres
    per unit. stated: a number that a camera's file says, which may be metres per unit, millimetres per unit (BOP) or
    units per metre (1000, 5000): it is taken for the one that makes this picture's median depth possible, 0.05 to 20 m.
    With neither, floats are metres and integers millimetres, or floats millimetres, where the median depth is then
    likely: 0.05 to 4 m. Raises ValueError naming `depth_scale` if nothing fits or two readings do. Topic 06.

    >>> table = np.full((2, 2), 800, np.uint16)
    >>> metres_per_unit(table), metres_per_unit(table / 1000.0)
    ((0.001, ''), (1.0, ''))
    >>> metres_per_unit(6 * table, stated=5000.0)
    (0.0002, "depth_scale: the camera file's 5000 is taken for units per metre: 0.0002 m a unit")
    """
    seen = readings(raw)
    require("depth", seen.size, "readings", "only zeros, NaN and infinities")
    middle = float(np.median(seen))
    if given is not None:
        require("depth_scale", 0.0 < given < np.inf, "metres per unit of the depth file, above 0", given)
        if not _possible(given * middle):
            raise ValueError(f"depth_scale: {_depth_of(given, middle)}")
        return float(given), ""
    if stated is not None:
        return _as_stated(middle, stated)
    usual = (1.0, 0.001) if raw.dtype.kind == "f" else (0.001,)
    for unit in usual:
        if POSSIBLE[0] <= unit * middle <= LIKELY[1]:
            said = "depth_scale: floats are taken for millimetres" if unit != usual[0] else ""
            return unit, said
    raise ValueError(f"depth_scale: expected the unit of depth, since {_depth_of(usual[-1], middle)}; {OPTION}")


def _as_stated(middle: float, stated: float) -> tuple[float, str]:
    require("depth_scale", 0.0 < stated < np.inf, "a number above 0 in the camera's file", stated)
    units = {meaning: float(unit(stated)) for meaning, unit in MEANINGS.items()}
    fitting = {round(unit, 12): meaning for meaning, unit in units.items() if _possible(unit * middle)}
    if len(fitting) == 1:
        (meaning,) = fitting.values()
        unit = units[meaning]
        return unit, f"depth_scale: the camera file's {stated:g} is taken for {meaning}: {unit:g} m a unit"
    ways = " or ".join(f"{meaning} ({units[meaning] * middle:.3g} m in the median)" for meaning in fitting.values())
    got = f"{stated:g}, which may be {ways}" if ways else f"{stated:g}; {_depth_of(stated, middle)}"
    raise ValueError(f"depth_scale: expected the camera file's number to say one unit, got {got}; {OPTION}")


def _possible(metres: float) -> bool:
    return within(metres, POSSIBLE)


def _depth_of(unit: float, middle: float) -> str:
    """Say how far away a unit puts things, and which usual units put them where a table is."""
    said = f"with {unit:g} metres per unit the median depth is {unit * middle:.3g} m"
    fitting = [f"{other:g} makes it {other * middle:.2g} m" for other in fitting_units(middle) if other != unit]
    return f"{said}, the file's values being around {middle:.4g}; {' and '.join(fitting) or 'no usual unit fits'}"


def fitting_units(middle: float) -> list[float]:
    """The usual units, metres, of which `middle` make the depth of a table.

    >>> fitting_units(7800.0), fitting_units(2600.0)
    ([0.0001], [0.001, 0.0001])
    """
    return [unit for unit in UNITS if within(unit * middle, LIKELY)]


def other_unit(away: float, length: float) -> str:
    """Say that depth is in another unit, if things fit one and not this one; "" if they may be as they are.

    away: metres from the camera to the things; length: of one of them. Either alone may be unusual: a camera may stand
    three metres off, or a thing be half a metre long. Both, and both usual by one factor, is a wrong unit.

    >>> other_unit(1.7, 0.1), other_unit(3.4, 0.1), other_unit(0.7, 0.5)
    ('', '', '')
    >>> print(other_unit(3.4, 0.5)[:75])
    depth seems to be in another unit: things lie 3.4 m away and are 50 cm long
    """
    here = within(away, AWAY), within(length, LENGTHS)
    fitting = [f"{f:g}" for f in FACTORS if within(f * away, AWAY) and within(f * length, LENGTHS)]
    if any(here) or not fitting:
        return ""
    size = f"{100.0 * length:.0f} cm" if length >= 0.01 else f"{1000.0 * length:.2g} mm"
    factors = f"{', '.join(fitting[:-1])} or {fitting[-1]}" if fitting[1:] else fitting[0]
    return (
        f"depth seems to be in another unit: things lie {away:.2g} m away and are {size} long; "
        f"of depth times {factors} they fit a hand; {OPTION}"
    )


def within(value: float, ends: tuple[float, float]) -> bool:
    """Whether a value lies in a range."""
    return ends[0] <= value <= ends[1]


def whole_units(depth: Float[np.ndarray, "H W"], unit: float) -> UInt16[np.ndarray, "H W"]:
    """Depth, metres, in whole units of so many metres, as files and messages of 16 bits hold it.

    0 is no reading, and so is what 16 bits cannot hold: further than 65,535 units. Topic 06.

    >>> whole_units(np.array([[1.2344, np.nan, 65.535, 70.0]]), 0.001)
    array([[ 1234,     0, 65535,     0]], dtype=uint16)
    """
    units = np.rint(np.nan_to_num(depth) * (1.0 / unit))
    return np.where(units <= np.iinfo(np.uint16).max, units, 0).astype(np.uint16)


# ------------------------------------------------------------------------------------------------- another size


def resized_K(K: Real[np.ndarray, "3 3"], size: tuple[int, int], to: tuple[int, int]) -> Float[np.ndarray, "3 3"]:
    """K of a picture that was resized from `size` to another, both (width, height).

    Pixel centres lie at integers, so that a picture reaches from -0.5 to width - 0.5: these ends stay ends.

    >>> resized_K(np.array([[8.0, 0.0, 3.5], [0.0, 8.0, 1.5], [0.0, 0.0, 1.0]]), (8, 4), (4, 2)).tolist()
    [[4.0, 0.0, 1.5], [0.0, 4.0, 0.5], [0.0, 0.0, 1.0]]
    """
    scale = np.array([to[0] / size[0], to[1] / size[1]])
    resized = check_K("K", K).copy()
    resized[:2, :2] *= scale[:, None]
    resized[:2, 2] = (resized[:2, 2] + 0.5) * scale - 0.5
    return resized


SAME_SURFACE = 0.01  # of depth: neighbours that differ by more lie on two


def resize_depth(depth: Float[np.ndarray, "H W"], size: tuple[int, int]) -> Float32[np.ndarray, "h w"]:
    """Bring a depth image of the same view to another size (width, height), without mixing two surfaces.

    A pixel of the new image gets the weighted mean of those of the four readings around its place that lie within 1 %
    of the nearest one's depth; where the nearest is no reading, it has none. Of an enlarged image each pixel is then
    the median of 3 x 3: what was one pixel's noise is a speckle otherwise, and edges are stairs. Metres. Topic 06.

    >>> resize_depth(np.array([[1.0, 1.0, 2.0, 2.0]]), (8, 1)).tolist()
    [[1.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0]]
    """
    depth = np.nan_to_num(check_depth("depth", depth).astype(np.float32))
    (h, w), (W, H) = depth.shape, size
    if (w, h) == (W, H):
        return depth
    u, v = (np.arange(W) + 0.5) * w / W - 0.5, (np.arange(H) + 0.5) * h / H - 0.5
    at = np.ix_(*(np.clip(np.rint(x), 0, n - 1).astype(int) for x, n in ((v, h), (u, w))))
    nearest = depth[at]
    total, weights = np.zeros((H, W), np.float32), np.zeros((H, W), np.float32)
    for dv in (0, 1):
        for du in (0, 1):
            rows, columns = (np.floor(x).astype(int) + d for x, d in ((v, dv), (u, du)))
            weight = np.outer(1.0 - np.abs(v - rows), 1.0 - np.abs(u - columns)).astype(np.float32)
            near = depth[np.ix_(np.clip(rows, 0, h - 1), np.clip(columns, 0, w - 1))]
            weight *= np.abs(near - nearest) <= SAME_SURFACE * nearest
            total += weight * near
            weights += weight
    resized = np.where(nearest > 0.0, total / np.where(weights > 0.0, weights, 1.0), 0.0).astype(np.float32)
    return np.where(nearest > 0.0, cv2.medianBlur(resized, 3), np.float32(0.0)) if w < W else resized
