"""What a camera is, and where: K and lens from photographs of a sheet, its pose, a camera on an arm (topic 06).

Photographs of a flat sheet from several sides tell K: each gives a homography, which is two equations about K (Zhang
2000). OpenCV solves and refines them; here stands what it must not be trusted with, sets that cannot tell. Where the
camera is on an arm, or looks at one, is the equation A X = X B (Park and Martin 1994), solved here on a page.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from labkit.geometry.projection import invert_transform
from labkit.geometry.sheet import Corners
from labkit.support.validation import check_K, check_T, require

LEAST_VIEWS = 6
SPREAD = 0.02  # standard error of a focal length, or of the principal point over it, that still serves
MISFIT = 3.0, 0.6  # a view is off if its error is so many times the median one, and so many thousandths of the width
TURN = np.radians(5.0)  # turns of an arm that are smaller tell nothing
ONE_AXIS = 0.1  # second singular value of the turns' axes over the first, below which they are one axis


@dataclass(frozen=True, eq=False)
class Calibration:
    """A camera that was calibrated.

    K: (3, 3). distortion: OpenCV's k1, k2, p1, p2, k3. size: width and height of the photographs. rms: of the distances
    between corners as found and as predicted, pixels. K_std: standard errors of fx, fy, cx, cy, pixels. T_cam_sheet:
    the sheet's pose in each view that was used; residuals: of each, (N, 2) pixels, found - predicted. used: the views'
    places in what was given; dropped: of those that do not fit the others.
    """

    K: Float[np.ndarray, "3 3"]
    distortion: tuple[float, ...]
    size: tuple[int, int]
    rms: float
    K_std: tuple[float, float, float, float]
    T_cam_sheet: tuple[Float[np.ndarray, "4 4"], ...]
    residuals: tuple[Float[np.ndarray, "_ 2"], ...]
    used: tuple[int, ...]
    dropped: tuple[int, ...] = ()


def calibrate(views: Sequence[Corners], size: tuple[int, int]) -> Calibration:
    """Find K and the lens from a sheet's corners in at least six photographs of `size` (width, height).

    A view that does not fit the others (zoomed, focused anew, of a bent sheet) is dropped; where a third do not fit, or
    where the views cannot tell the focal length, a ValueError says what to photograph. A zoom shows only where the
    sheet is tilted or near: elsewhere its pose makes up for it, and it harms K as little. Topic 06, calibration.
    """
    used, dropped = list(range(len(views))), []
    while True:
        require("photographs", len(used) >= LEAST_VIEWS, f"at least {LEAST_VIEWS} that show the sheet", len(used))
        found = _calibrated([views[i] for i in used], size)
        error = np.array([np.sqrt((r**2).sum(axis=1).mean()) for r in found.residuals])
        times, share = MISFIT
        off = error > max(times * np.median(error), 1e-3 * share * max(size))
        if not off.any():
            break
        dropped.append(used.pop(int(error.argmax())))
        require(
            "photographs",
            3 * len(dropped) <= len(views),
            "one camera with one zoom and one focus, and a flat sheet",
            f"{len(dropped)} of {len(views)} that do not fit the others",
        )
    _check_spread(found, [views[i] for i in used])
    return Calibration(**{**vars(found), "used": tuple(used), "dropped": tuple(sorted(dropped))})


def _calibrated(views: Sequence[Corners], size: tuple[int, int]) -> Calibration:
    points = [view.points.astype(np.float32) for view in views]
    pixels = [view.pixels.astype(np.float32).reshape(-1, 1, 2) for view in views]
    rms, K, lens, turns, shifts, std, *_ = cv2.calibrateCameraExtended(points, pixels, tuple(size), None, None)
    poses = tuple(_transform(turn, shift) for turn, shift in zip(turns, shifts, strict=True))
    left = tuple(
        view.pixels - cv2.projectPoints(view.points, turn, shift, K, lens)[0].reshape(-1, 2)
        for view, turn, shift in zip(views, turns, shifts, strict=True)
    )
    std = tuple(map(float, np.ravel(std)[:4]))
    return Calibration(K, tuple(map(float, lens.ravel()[:5])), tuple(size), float(rms), std, poses, left, ())


def _check_spread(found: Calibration, views: Sequence[Corners]) -> None:
    """Raise unless the views tell the focal length and the principal point, with what is missing among them."""
    worst = max(found.K_std[:2]) / found.K[0, 0], max(found.K_std[2:]) / found.K[0, 0]
    normals = np.array([T[:3, 2] for T in found.T_cam_sheet])
    leaning = np.degrees(np.arccos(np.clip(np.abs(normals[:, 2]), 0.0, 1.0)))
    apart = np.degrees(np.arccos(np.clip((normals @ normals.T).min(), -1.0, 1.0)))
    pixels = np.concatenate([view.pixels for view in views])
    covered = np.ptp(pixels, axis=0) / found.size
    if apart < 20.0:
        advice = f"tilt the sheet, or walk around it: all views are within {apart:.0f} degrees of each other"
    elif leaning.max() < 20.0:
        advice = f"look at the sheet from the side, too: all views are within {leaning.max():.0f} degrees of head-on"
    elif covered.min() < 0.5:
        advice = f"bring the sheet to the picture's edges, too: so far it covers {covered.min():.0%} of one side"
    else:
        advice = "take more, from nearer and from more sides"
    fits = max(worst) <= SPREAD and apart >= 20.0 and covered.min() >= 0.5
    got = f"a focal length known to {100.0 * worst[0]:.1f} % and a middle to {100.0 * worst[1]:.1f} % of it; {advice}"
    require("photographs", fits, "views that tell what the camera is", got)


def sheet_pose(
    view: Corners, K: Float[np.ndarray, "3 3"], distortion: Sequence[float] = ()
) -> tuple[Float[np.ndarray, "4 4"], Float[np.ndarray, "N 2"]]:
    """Find where the sheet is in one photograph: T_cam_sheet, and its corners' residuals in pixels, found - predicted.

    The inverse, T_sheet_cam, is the camera's pose in the base frame that is printed on the sheet. Topic 06.
    """
    K, lens = check_K("K", K), np.array(distortion, np.float64)
    require("view", len(view.points) >= 4, "at least four corners", len(view.points))
    _, turns, shifts, _ = cv2.solvePnPGeneric(view.points, view.pixels, K, lens, flags=cv2.SOLVEPNP_IPPE)
    best = None
    for turn, shift in zip(turns, shifts, strict=True):  # a plane has two poses that look nearly alike
        turn, shift = cv2.solvePnPRefineLM(view.points, view.pixels, K, lens, turn.copy(), shift.copy())
        left = view.pixels - cv2.projectPoints(view.points, turn, shift, K, lens)[0].reshape(-1, 2)
        if best is None or (left**2).sum() < (best[1] ** 2).sum():
            best = _transform(turn, shift), left
    return best


def hand_eye(
    T_base_hand: Sequence[Float[np.ndarray, "4 4"]], T_cam_sheet: Sequence[Float[np.ndarray, "4 4"]]
) -> tuple[Float[np.ndarray, "4 4"], Float[np.ndarray, "N 2"]]:
    """Find a camera on a hand, T_hand_cam, from the arm's poses and those of a sheet that lies still.

    T_base_hand X T_cam_sheet is where the sheet lies, the same for all poses; so of two poses A X = X B, where A is the
    hand's motion and B the sheet's as the camera sees it. Rotations: X turns the axis of each B into that of its A, a
    least-squares turn (Kabsch). Then (R_A - I) t = R_X t_B - t_A for all pairs at once.

    For a camera that stands, and a sheet on the hand, give the inverse of each T_base_hand: X is T_base_cam. Returns X,
    and for each pose how far its sheet lies from the mean one: metres, radians. Raises ValueError for fewer than three
    poses, or poses that are all turned about one axis, along which X could lie anywhere. Topic 06, calibration.
    """
    arm = [check_T(f"T_base_hand[{i}]", T) for i, T in enumerate(T_base_hand)]
    eye = [check_T(f"T_cam_sheet[{i}]", T) for i, T in enumerate(T_cam_sheet)]
    require("T_cam_sheet", len(eye) == len(arm), f"as many as T_base_hand, {len(arm)}", len(eye))
    require("T_base_hand", len(arm) >= 3, "at least three poses", len(arm))
    pairs = [(i, j) for i in range(len(arm)) for j in range(i)]
    A = np.array([invert_transform(arm[j]) @ arm[i] for i, j in pairs])
    B = np.array([eye[j] @ invert_transform(eye[i]) for i, j in pairs])
    a, b = Rotation.from_matrix(A[:, :3, :3]).as_rotvec(), Rotation.from_matrix(B[:, :3, :3]).as_rotvec()
    turned = np.linalg.norm(a, axis=1)
    # Near a half turn the axis may point either way; near none it points anywhere.
    tells = (turned > TURN) & (turned < np.pi - TURN)
    spread = np.linalg.svd(a[tells] / turned[tells, None], compute_uv=False) if tells.any() else np.zeros(3)
    require(
        "T_base_hand",
        len(spread) > 1 and spread[1] > ONE_AXIS * spread[0],
        "poses that are turned about at least two axes",
        "turns about one axis alone" if tells.any() else "poses that are hardly turned",
    )
    U, _, Vt = np.linalg.svd(a[tells].T @ b[tells])
    R = U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt
    M = np.concatenate(A[tells, :3, :3] - np.eye(3))
    t = np.linalg.lstsq(M, (B[tells, :3, 3] @ R.T - A[tells, :3, 3]).ravel(), rcond=None)[0]
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = R, t
    return X, _scatter([T_arm @ X @ T_eye for T_arm, T_eye in zip(arm, eye, strict=True)])


def _scatter(poses: Sequence[Float[np.ndarray, "4 4"]]) -> Float[np.ndarray, "N 2"]:
    """How far poses that should be one lie from their mean: metres, radians."""
    poses = np.array(poses)
    turns = Rotation.from_matrix(poses[:, :3, :3])
    away = np.linalg.norm(poses[:, :3, 3] - poses[:, :3, 3].mean(axis=0), axis=1)
    return np.column_stack([away, (turns.mean().inv() * turns).magnitude()])


def _transform(turn: Float[np.ndarray, "..."], shift: Float[np.ndarray, "..."]) -> Float[np.ndarray, "4 4"]:
    """OpenCV's rotation vector and translation as a pose."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Rotation.from_rotvec(np.ravel(turn)).as_matrix(), np.ravel(shift)
    return T
