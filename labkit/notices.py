"""What may be right but looks wrong: sentences with numbers, the same for every door (topics 06 and 08).

What cannot be right is refused (`labkit.support.validation`). A calibration that does not fit its picture, a pose that
does not fit the table, or a picture unlike the training's can be meant so; then the result stands, and this is said.
"""

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from labkit.frame import RGBDFrame
from labkit.geometry import back_project_to_base, fit_plane
from labkit.labels import CLASSES, SURFACE, TARGET
from labkit.stacks.objects import colour_regions, colour_shares

NEAR = 0.25  # metres over or under the table's stated height, where the table is looked for
RISE, LEAN = 0.010, 3.0  # metres and degrees that the table may lie off what pose and table_z say
UNITS = (0.001, 0.1, 0.25, 0.5, 2.0, 4.0, 10.0, 1000.0)  # by which depth is often wrong
FLAT = 0.3  # share of the points near the table's height that lie on it, at least
OFF = 0.2  # of half the picture's width or height: where the principal point of a calibrated camera may lie
NEAREST, FAR = 0.2, 1.6  # metres from which, and up to which, depth cameras see small things
TOP = 0.25  # metres: of a plane that is smaller, and over much else, nobody knows whether it is the table
LONG = 0.12  # metres: longer things are seldom one thing to grasp
PART = 0.15  # of a target's pixels: less is a label on it, or a shadow
SHIFT = 3  # pixels between colour and depth that go unnoticed
REACH = 16  # pixels within which a shift is looked for
USUAL = {  # from least to most, of 200 scenes of the kinds train, any, test and hard
    "millimetres of the table per pixel": (1.1, 5.5),
    "millimetres of noise on the table's depth": (0.0, 4.0),
    "mean of the colours": (39, 190),
    "mean saturation": (27, 232),
}


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


def _table(frame: RGBDFrame, perception) -> list[str]:
    """Compare the largest plane near the table's height with the pose, table_z and the labels."""
    step = max(1, round(np.sqrt(frame.depth.size / 10_000)))
    if perception is None:
        points = back_project_to_base(frame.depth, frame.K, frame.T_base_cam)[::step, ::step].reshape(-1, 3)
    else:
        points = perception.points[::step, ::step].reshape(-1, 3)
    table_z = frame.table_z or 0.0
    near = np.abs(points[:, 2] - table_z) < NEAR  # NaN is not near
    P = points[near]
    if len(P) < 100:
        said = f"only {len(P) / len(points):.0%} of the picture has depth within {NEAR} m of the table's height"
        return [said + _unit(points[np.isfinite(points[:, 2])], frame.T_base_cam[:3, 3], table_z)]
    try:
        plane = fit_plane(P, tries=100, viewer=(0.0, 0.0, 1e3))
    except ValueError:  # points on a line
        return ["no plane fits the depth near the table's height"]
    share, lean = plane.inliers.mean(), np.degrees(np.arccos(np.clip(plane.normal[2], -1.0, 1.0)))
    if share < FLAT:
        return [f"only {share:.0%} of the points near the table's height lie on one plane: is it noise, or no table?"]
    said = []
    rise = float(P[plane.inliers, 2].mean()) - table_z
    if lean > LEAN or abs(rise) > RISE:
        likely = "T_base_cam is likely wrong" if lean > LEAN else f"table_z is likely {table_z + rise:.3f} m"
        said.append(
            f"the table that depth shows lies {1000.0 * rise:+.0f} mm off table_z = {table_z:.3f} m and leans by "
            f"{lean:.1f} degrees: {likely}"
        )
    sides = np.sqrt(12.0 * np.linalg.eigvalsh(np.cov(P[plane.inliers, :2].T)))  # of a rectangle that spreads so
    under = np.mean(P[:, 2] < table_z + rise - 0.02)
    if sides[1] < TOP and under > 0.1:
        said.append(
            f"the plane taken for the table is {100.0 * sides[1]:.0f} x {100.0 * sides[0]:.0f} cm large, and "
            f"{under:.0%} of the points around lie under it: is it the top of a box?"
        )
    away = float(np.median(frame.depth[::step, ::step].reshape(-1)[near][plane.inliers]))
    if not NEAREST < away < FAR:
        said.append(
            f"the table is {away:.2f} m away: is depth in another unit (depth_scale), or the plane not the table?"
        )
    if not said and perception is not None and perception.probabilities is not None:
        labels = perception.labels[::step, ::step].reshape(-1)[near][plane.inliers]
        surface = np.mean(labels == SURFACE)
        if perception.probabilities.shape[2] == len(CLASSES) and surface < 0.5:
            said.append(
                f"this picture is unlike the training's: {surface:.0%} of the table's pixels are called surface; "
                + _unusual(frame.rgb, 1000.0 * away / frame.K[0, 0], 1000.0 * plane.residual)
            )
    return said


def _unit(points: Float[np.ndarray, "N 3"], camera: Float[np.ndarray, "3"], table_z: float) -> str:
    """Say by which usual factor depth is wrong, if most points then lie on the table."""
    for factor in UNITS:
        z = camera[2] + factor * (points[:, 2] - camera[2])
        if np.mean(np.abs(z - table_z) < RISE) > 0.5:
            return f"; of depth times {factor:g} most lies on the table: is depth_scale wrong?"
    return ""


def _unusual(rgb: UInt8[np.ndarray, "H W 3"], pixel: float, noise: float) -> str:
    """Say which of a picture's facts lie outside what the training's pictures have."""
    facts = {
        "millimetres of the table per pixel": pixel,
        "millimetres of noise on the table's depth": noise,
        "mean of the colours": rgb.mean(),
        "mean saturation": cv2.cvtColor(rgb, cv2.COLOR_RGB2HSV)[..., 1].mean(),
    }
    outside = [
        f"{value:.1f} {what} (training's are {USUAL[what][0]} to {USUAL[what][1]})"
        for what, value in facts.items()
        if not USUAL[what][0] <= value <= USUAL[what][1]
    ]
    return ", ".join(outside) or "size of pixels, noise, brightness and saturation are as the training's"


def _shifted(rgb: UInt8[np.ndarray, "H W 3"], depth: Float[np.ndarray, "H W"]) -> str:
    """Look for the shift at which jumps of depth lie on edges of colour best."""
    step = max(1, round(rgb.shape[1] / 640))
    smooth = cv2.GaussianBlur(rgb, (0, 0), float(step)).astype(np.float32)[::step, ::step]
    colour = np.sqrt(sum((cv2.Sobel(smooth, cv2.CV_32F, *way) ** 2).sum(axis=2) for way in ((1, 0), (0, 1))))
    colour = np.minimum(colour, np.percentile(colour, 97))
    d = np.ascontiguousarray(np.nan_to_num(depth[::step, ::step]))
    around = np.ones((3, 3), np.uint8)
    near, far = cv2.erode(np.where(d > 0.0, d, d.max()), around), cv2.dilate(d, around)
    jumps = (far > 1.03 * near).astype(np.float32)[REACH:-REACH, REACH:-REACH]
    if jumps.sum() < 100:
        return ""
    score = cv2.matchTemplate(colour, jumps, cv2.TM_CCORR)  # [REACH, REACH] is no shift
    score -= np.median(score)
    dy, dx = np.array(np.unravel_index(score.argmax(), score.shape)) - REACH
    if max(abs(dx), abs(dy)) == REACH or score.max() < 4.0 * score.std():  # a slope, or noise, and no peak
        return ""
    here = score[REACH - 2 : REACH + 3, REACH - 2 : REACH + 3].max()
    if max(abs(dx), abs(dy)) * step <= SHIFT or score.max() < 1.15 * here:
        return ""
    return f"depth lies ({-dx * step}, {-dy * step}) pixels off the colours: is it aligned to colour, of one moment?"


def _blind(frame: RGBDFrame, perception) -> str:
    labelled = frame.labels == TARGET if perception is None else perception.labels == perception.target_class
    blind, count = np.count_nonzero(labelled & ~(frame.depth > 0.0)), np.count_nonzero(labelled)
    return f"{blind} of {count} pixels labelled target have no depth" if blind > 0.5 * count else ""


def _targets(perception) -> list[str]:
    said, (w, h) = [], perception.frame.size
    rgb = colour_shares(perception.frame.rgb)
    ways = np.radians(np.arange(0.0, 180.0, 10.0))
    ways = np.stack([np.cos(ways), np.sin(ways)])
    for number, (pixels, cloud) in enumerate(zip(perception.pixels, perception.clouds, strict=True), start=1):
        v, u = np.divmod(pixels, w)
        if u.min() == 0 or v.min() == 0 or u.max() == w - 1 or v.max() == h - 1:
            said.append(f"target {number} touches the picture's border: a part of it is unseen")
        box = np.s_[v.min() : v.max() + 1, u.min() : u.max() + 1]
        mask = np.zeros(rgb[box].shape[:2], bool)
        mask[v - v.min(), u - u.min()] = True
        parts = [part for part in colour_regions(mask, rgb[box]) if part.sum() > PART * len(pixels)]
        length = np.ptp(np.percentile(cloud[:, :2] @ ways, [1, 99], axis=0), axis=0).max()
        if length > LONG:
            said.append(f"target {number} is {100.0 * length:.0f} cm long: is it two things that touch?")
        elif len(parts) > 1:
            said.append(f"target {number} falls into {len(parts)} regions of colour: is it two things that touch?")
    return said
