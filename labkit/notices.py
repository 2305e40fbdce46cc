"""What may be right but looks wrong: sentences with numbers, the same for every door (topics 06 and 08).

What cannot be right is refused (`labkit.support.validation`). A calibration that does not fit its picture, a pose that
does not fit the table, or a picture unlike the training's can be meant so; then the result stands, and this is said.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, Integer, UInt8

from labkit.frame import RGBDFrame
from labkit.geometry import Plane, back_project_to_base, find_tables, fit_plane
from labkit.geometry.depth_units import FACTORS
from labkit.geometry.tables import THICK, height_of, table_at
from labkit.labels import CLASSES, SURFACE, TARGET


def notices(frame: RGBDFrame, perception=None, distortion=()) -> tuple[str, ...]:
    """Say what looks wrong about a frame, and about what was perceived in it (a `labkit.pipeline.Perception`).

    distortion: the lens's coefficients, if a calibration states them. Each sentence holds its numbers; nothing is said
    of what is as it should be.

    >>> K = np.array([[9.0, 0.0, 20.0], [0.0, 9.0, 3.0], [0.0, 0.0, 1.0]])
    >>> frame = RGBDFrame(np.zeros((6, 8, 3), np.uint8), np.zeros((6, 8), np.float32), K, np.eye(4))
    >>> for sentence in notices(frame):
    ...     print(sentence)
    the principal point (20.0, 3.0) lies outside the picture of 8 x 6: is the calibration another picture's?
    there is no depth: the picture is taken as it is, and nothing can be placed in space
    """
    said = [_principal_point(frame.K, frame.size)]
    if np.any(distortion):
        said += [f"the lens's distortion, {', '.join(f'{k:.3g}' for k in distortion)}, is not undone: rectify first"]
    if (frame.depth > 0.0).any():
        said += [*_table(frame, perception), _shifted(frame.rgb, frame.depth)]
    else:
        said += ["there is no depth: the picture is taken as it is, and nothing can be placed in space"]
    if perception is not None or frame.labels is not None:
        said += [_blind(frame, perception)]
    if perception is not None:
        said += _targets(perception)
    return tuple(sentence for sentence in said if sentence)


OFF = 0.2  # of half the picture's width or height: where the principal point of a calibrated camera may lie


def _principal_point(K: Float[np.ndarray, "3 3"], size: tuple[int, int]) -> str:
    (cx, cy), (w, h) = K[:2, 2], size
    where = f"the principal point ({cx:.1f}, {cy:.1f}) lies"
    if not (0.0 <= cx <= w - 1 and 0.0 <= cy <= h - 1):
        return f"{where} outside the picture of {w} x {h}: is the calibration another picture's?"
    if abs(2.0 * cx / w - 1.0) > OFF or abs(2.0 * cy / h - 1.0) > OFF:
        return (
            f"{where} far from the middle of the picture of {w} x {h}: is the calibration one of "
            f"{round(2.0 * cx)} x {round(2.0 * cy)}?"
        )
    return ""


# ------------------------------------------------------------------------------------------------- the table

NEAR = 0.25  # metres over or under the table's stated height, where the table is looked for
FLAT = 0.3  # share of the points near the table's height that lie on it, at least


@dataclass(frozen=True, eq=False)
class NearTable:
    """What depth shows near the table's stated height, and the table in it.

    P: the points near its stated height, (N, 3); plane: the likeliest table, or the largest plane among them. table_z:
    the stated height. rise: how far the plane lies over that; distance: its median depth; metres. labels: those of the
    plane's pixels, if known.
    """

    P: Float[np.ndarray, "N 3"]
    plane: Plane
    table_z: float
    rise: float
    distance: float
    labels: UInt8[np.ndarray, "_"] | None


def _table(frame: RGBDFrame, perception) -> list[str]:
    """Compare the likeliest table with the pose, table_z and the labels."""
    camera, table_z = frame.T_base_cam[:3, 3], frame.table_z or 0.0
    if camera[2] - table_z < LOW:
        return [_camera_too_low(frame, camera[2] - table_z)]
    step = max(1, round(np.sqrt(frame.depth.size / 10_000)))
    thinned = np.s_[::step, ::step]
    if perception is None:
        points = back_project_to_base(frame.depth, frame.K, frame.T_base_cam)
    else:
        points = perception.points
    tables = perception.tables if perception is not None and perception.tables else ()
    tables = tables or find_tables(points[thinned], camera, up=(0.0, 0.0, 1.0))
    chosen = table_at(tables, table_z) or next(iter(tables), None)
    points = points[thinned].reshape(-1, 3)
    near = np.abs(points[:, 2] - table_z) < NEAR  # NaN is not near
    P = points[near]
    if len(P) < 100:
        return [_nothing_near(points, camera, table_z, share=len(P) / len(points))]
    if chosen is not None and abs(height_of(chosen) - table_z) > NEAR - RISE:  # cut by the bounds of what is near
        return [_off_the_pose(chosen.plane.normal, height_of(chosen) - table_z, table_z)]
    if chosen is not None:
        inliers = np.abs(P @ chosen.plane.normal + chosen.plane.offset) < THICK
        plane = Plane(chosen.plane.normal, chosen.plane.offset, inliers, chosen.plane.residual)
    else:
        try:
            plane = fit_plane(P, tries=100, viewer=(0.0, 0.0, 1e3))
        except ValueError:  # points on a line
            return ["no plane fits the depth near the table's height"]
        share = plane.inliers.mean()
        if share < FLAT:
            said = f"only {share:.0%} of the points near the table's height lie on one plane"
            return [f"{said}: is it noise, or no table?"]
    rise = float(P[plane.inliers, 2].mean()) - table_z
    distance = float(np.median(frame.depth[thinned].reshape(-1)[near][plane.inliers]))
    labels = None if perception is None else perception.labels[thinned].reshape(-1)[near][plane.inliers]
    table = NearTable(P, plane, table_z, rise, distance, labels)
    wrong = [_off_the_pose(plane.normal, rise, table_z), _too_near_or_far(table)]
    wrong += [_not_the_likeliest(chosen, tables)]
    if any(wrong) or perception is None or perception.probabilities is None:
        return wrong
    return [_unlike_training(frame, table)] if perception.probabilities.shape[2] == len(CLASSES) else []


LOW = 0.05  # metres over the table: a camera that is lower sees no table


def _camera_too_low(frame: RGBDFrame, height: float) -> str:
    if np.array_equal(frame.T_base_cam, np.eye(4)):
        return "T_base_cam is the identity, as if the camera were the base: no pose is known, and no table"
    return (
        f"the camera stands {height:.2f} m over the table by T_base_cam and table_z: is it T_cam_base, or another "
        "table's height?"
    )


def _not_the_likeliest(chosen, tables) -> str:
    """The plane at the stated height may be another than the one that things stand on."""
    if chosen is None or chosen is tables[0] or tables[0].things < 4.0 * chosen.things:
        return ""
    rise = height_of(tables[0]) - height_of(chosen)
    return f"things stand on another plane, {rise:+.2f} m from the one at the table's height: is it the table?"


def _nothing_near(points: Float[np.ndarray, "N 3"], camera: Float[np.ndarray, "3"], table_z: float, share) -> str:
    """Say how little is near the table's height, and by which usual factor depth is wrong if most then lies there."""
    said = f"only {share:.0%} of the picture has depth within {NEAR} m of the table's height"
    z = points[np.isfinite(points[:, 2]), 2]
    for factor in FACTORS:
        if len(z) and np.mean(np.abs(camera[2] + factor * (z - camera[2]) - table_z) < RISE) > 0.5:
            return f"{said}; of depth times {factor:g} most lies on the table: is depth_scale wrong?"
    return said


RISE, LEAN = 0.010, 3.0  # metres and degrees that the table may lie off what pose and table_z say


def _off_the_pose(normal: Float[np.ndarray, "3"], rise: float, table_z: float) -> str:
    lean = np.degrees(np.arccos(np.clip(normal[2], -1.0, 1.0)))
    if lean <= LEAN and abs(rise) <= RISE:
        return ""
    likely = "T_base_cam is likely wrong" if lean > LEAN else f"table_z is likely {table_z + rise:.3f} m"
    return (
        f"the table that depth shows lies {1000.0 * rise:+.0f} mm off table_z = {table_z:.3f} m and leans "
        f"by {lean:.1f} degrees: {likely}"
    )


NEAREST, FAR = 0.2, 1.6  # metres from which, and up to which, depth cameras see small things


def _too_near_or_far(table: NearTable) -> str:
    if NEAREST < table.distance < FAR:
        return ""
    return (
        f"the table is {table.distance:.2f} m away: is depth in another unit (depth_scale), or the plane not the table?"
    )


USUAL = {  # from least to most, of 200 scenes of the kinds train, any, test and hard
    "millimetres of the table per pixel": (1.1, 5.5),
    "millimetres of noise on the table's depth": (0.0, 4.0),
    "mean of the colours": (39, 190),
    "mean saturation": (27, 232),
}


def _unlike_training(frame: RGBDFrame, table: NearTable) -> str:
    """Where little of the table is called surface: say which of the picture's facts the training's pictures lack."""
    surface = np.mean(table.labels == SURFACE)
    if surface >= 0.5:
        return ""
    saturation = cv2.cvtColor(frame.rgb, cv2.COLOR_RGB2HSV)[..., 1].mean()
    noise = 1000.0 * table.plane.residual
    facts = zip(USUAL, (1000.0 * table.distance / frame.K[0, 0], noise, frame.rgb.mean(), saturation), strict=True)
    outside = [
        f"{value:.1f} {what} (training's are {USUAL[what][0]} to {USUAL[what][1]})"
        for what, value in facts
        if not USUAL[what][0] <= value <= USUAL[what][1]
    ]
    why = ", ".join(outside) or "size of pixels, noise, brightness and saturation are as the training's"
    return f"this picture is unlike the training's: {surface:.0%} of the table's pixels are called surface; {why}"


# ------------------------------------------------------------------------------------------ depth and targets

SHIFT = 3  # pixels between colour and depth that go unnoticed
REACH = 20  # pixels within which a shift is looked for
JUMP = 0.12  # of the Sobel filter on the logarithm of depth: more is the edge of a thing
HOLE = 12  # pixels that a thing's shadow, where a camera reads no depth, is wide at most
PEAK, SURE = 4.0, 1.5  # a shift fits that much better: than usual ones, in standard deviations; than none, as a factor
SCALES = tuple(np.arange(0.84, 1.19, 0.02).round(2).tolist())  # of depth, to what it would be in the colour camera
SAME_SCALE = 0.03  # scales that are no further from 1 go unnoticed
BETTER, STRONG = 1.15, 0.12  # a scale fits that much better than none, and edges under jumps are that strong, of 1
SPREAD = 0.1  # of the width: how far jumps stray from their middle, at least


def _shifted(rgb: UInt8[np.ndarray, "H W 3"], depth: Float[np.ndarray, "H W"]) -> str:
    """Look for the shift at which jumps of depth lie on edges of colour that run the same way, and for a scale."""
    step = max(1, round(rgb.shape[1] / 640))
    fit = _fits(rgb, depth, step, REACH)
    if fit is None:
        return ""
    score = fit - np.median(fit)
    dy, dx = np.array(np.unravel_index(score.argmax(), score.shape)) - REACH
    here = score[REACH - 2 : REACH + 3, REACH - 2 : REACH + 3].max()
    if score.max() < SURE * here:
        return ""
    scaled = _scaled(rgb, depth, 2 * step, REACH)
    if scaled:
        return scaled
    if max(abs(dx), abs(dy)) == REACH or score.max() < PEAK * score.std():  # a slope, or noise, and no peak
        return ""
    if max(abs(dx), abs(dy)) * step <= SHIFT:
        return ""
    return f"depth lies ({-dx * step}, {-dy * step}) pixels off the colours: is it aligned to colour, of one moment?"


def _scaled(rgb: UInt8[np.ndarray, "H W 3"], depth: Float[np.ndarray, "H W"], step: int, reach: int) -> str:
    """Look for a scale about the picture's middle, as of a depth camera of another focal length, beside a shift.

    A scale tells only where jumps are spread over the picture: those of one thing can be laid on many edges.
    """
    fits = {scale: _fits(rgb, depth, step, reach, scale) for scale in SCALES}
    fits = {scale: fit for scale, fit in fits.items() if fit is not None}
    if 1.0 not in fits:
        return ""
    best = max(fits, key=lambda scale: fits[scale].max())
    if abs(best - 1.0) <= SAME_SCALE or fits[best].max() < max(BETTER * fits[1.0].max(), STRONG):
        return ""
    jumps = np.argwhere(_jumps(_far_filled(depth[::step, ::step]))[0])
    if jumps.std(axis=0).min() < SPREAD * rgb.shape[1] / step:
        return ""
    dy, dx = np.array(np.unravel_index(fits[best].argmax(), fits[best].shape)) - reach
    return (
        f"depth is {1.0 / best:.2f} times as large as the colours and lies ({-dx * step}, {-dy * step}) pixels off "
        "them: is it as the depth camera sees it, of another focal length, and not aligned to colour?"
    )


def _fits(rgb, depth, step: int, reach: int, scale: float = 1.0) -> Float[np.ndarray, "R R"] | None:
    """How well jumps of depth, scaled, lie on edges of colour at each shift up to `reach`, [reach, reach] is none.

    Every `step`-th pixel counts. The mean over the jumps of the strength of colour's edge under each, less what is
    usual around it; None for a picture that is too small, or for less than a hundred jumps.
    """
    smooth = cv2.GaussianBlur(rgb, (0, 0), float(step)).astype(np.float32)[::step, ::step]
    if min(smooth.shape[:2]) <= 4 * reach:  # too small to tell a shift from anything else
        return None
    score, count, strongest = 0.0, 0, 1e-6
    filled = _far_filled(depth[::step, ::step])
    if scale != 1.0:
        middle = (np.array(filled.shape[::-1]) - 1.0) / 2.0
        to = np.column_stack([scale * np.eye(2), (1.0 - scale) * middle])
        filled = cv2.warpAffine(filled, to, filled.shape[::-1], flags=cv2.INTER_NEAREST)
    for way, jumps in zip(WAYS_OF_EDGES, _jumps(filled), strict=True):
        colour = np.sqrt((cv2.Sobel(smooth, cv2.CV_32F, *way) ** 2).sum(axis=2))
        most = float(np.percentile(colour, 97))
        strongest = max(strongest, most)
        colour = np.minimum(colour, most)
        colour -= cv2.blur(colour, (2 * reach + 1, 2 * reach + 1))  # edges, not textures
        jumps = jumps.astype(np.float32)[reach:-reach, reach:-reach]
        count += jumps.sum()
        score = score + cv2.matchTemplate(colour, jumps, cv2.TM_CCORR)
    return score / (count * strongest) if count >= 100 else None


WAYS_OF_EDGES = (1, 0), (0, 1)


def _far_filled(depth: Float[np.ndarray, "h w"]) -> Float[np.ndarray, "h w"]:
    """Depth with its holes filled: what is hidden is behind, as far as the farthest that is seen close by; else 0."""
    filled, around = np.ascontiguousarray(np.nan_to_num(depth), np.float32), np.ones((3, 3), np.uint8)
    for _ in range(HOLE):
        filled = np.where(filled > 0.0, filled, cv2.dilate(filled, around))
    return filled


def _jumps(filled: Float[np.ndarray, "h w"]) -> list[Bool[np.ndarray, "h w"]]:
    """Where depth jumps along the columns and along the rows, between two readings.

    Where depth ends, and nothing is known beyond, is no edge of a thing: filling has moved it outwards.
    """
    known = cv2.erode((filled > 0.0).astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    depth = np.log(np.where(filled > 0.0, filled, 1.0))
    return [known & (np.abs(cv2.Sobel(depth, cv2.CV_32F, *way)) > JUMP) for way in WAYS_OF_EDGES]


def _blind(frame: RGBDFrame, perception) -> str:
    labelled = frame.labels == TARGET if perception is None else perception.labels == perception.target_class
    blind, count = np.count_nonzero(labelled & ~(frame.depth > 0.0)), np.count_nonzero(labelled)
    return f"{blind} of {count} pixels labelled target have no depth" if blind > 0.5 * count else ""


LUMP = 0.35  # metres: nothing that a hand grasps is longer
WAYS = np.radians(np.arange(0.0, 180.0, 10.0))  # directions along which a target is measured


def _targets(perception) -> list[str]:
    said = [*perception.left_out]
    for number, (pixels, cloud) in enumerate(zip(perception.pixels, perception.clouds, strict=True), start=1):
        what = _cut_off(pixels, perception.frame.size), _lump(cloud)
        said += [f"target {number} {sentence}" for sentence in what if sentence]
    return said


def _cut_off(pixels: Integer[np.ndarray, "_"], size: tuple[int, int]) -> str:
    (w, h), (v, u) = size, np.divmod(pixels, size[0])
    inside = min(u.min(), v.min()) > 0 and u.max() < w - 1 and v.max() < h - 1
    return "" if inside else "touches the picture's border: a part of it is unseen"


def _lump(cloud: Float[np.ndarray, "N 3"]) -> str:
    along = cloud[:, :2] @ np.stack([np.cos(WAYS), np.sin(WAYS)])
    length = np.ptp(np.percentile(along, [1, 99], axis=0), axis=0).max()
    return f"is one lump of {100.0 * length:.0f} cm: things that were not told apart?" if length > LUMP else ""
