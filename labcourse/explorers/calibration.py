"""The explorer of topic 06, calibration: what photographs of a tilted sheet tell of K. They are simulated here."""

from collections.abc import Sequence

import cv2
import ipywidgets
import numpy as np
from jaxtyping import Float
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

from labcourse.explorers.explorer import Explorer
from labkit.geometry.projection import project, transform_points
from labkit.geometry.sheet import Corners, Sheet

SIZE = (640, 480)
K_TRUE = np.array([[520.0, 0.0, 325.0], [0.0, 520.0, 236.0], [0.0, 0.0, 1.0]])
BOARD = np.array([0.18, 0.24, 0.0])  # of the printed sheet, metres: its far corner, x and y
AWAY = 0.5  # metres at which an error of f is told in millimetres
REPEATS = 8
STOP = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 30, 1e-6)  # OpenCV's own takes twice as long for nothing
NO_LENS = cv2.CALIB_ZERO_TANGENT_DIST | cv2.CALIB_FIX_K1 | cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3


def sheet_poses(tilt: float, count: int, seed: int = 0) -> list[Float[np.ndarray, "4 4"]]:
    """Draw T_cam_sheet of `count` photographs in which the sheet leans by `tilt` radians from head-on.

    It leans to all sides in turn, is turned in its plane by up to half a radian, and its middle is 0.45 to 0.6 m away,
    within 10 cm of the optical axis.

    >>> [round(float(np.degrees(np.arccos(-T[2, 2])))) for T in sheet_poses(np.radians(20), 3)]
    [20, 20, 20]
    """
    rng, poses = np.random.default_rng(seed), []
    for k in range(count):
        side = 0.3 + 2.0 * np.pi * k / count
        lean = Rotation.from_rotvec(tilt * np.array([np.cos(side), np.sin(side), 0.0]))
        T = np.eye(4)
        T[:3, :3] = (lean * Rotation.from_euler("zx", [rng.uniform(-0.5, 0.5), np.pi])).as_matrix()
        T[:3, 3] = rng.uniform((-0.1, -0.04, 0.45), (0.1, 0.04, 0.6)) - T[:3, :3] @ (BOARD / 2.0)
        poses.append(T)
    return poses


def seen(T_cam_sheet: Float[np.ndarray, "4 4"], noise: float, rng: np.random.Generator, arch: float = 0.0) -> Corners:
    """The sheet's 35 corners as the camera of K_TRUE, without a lens, sees them, each coordinate off by `noise` pixels.

    arch: metres by which the paper's middle lies over its left and right side, as a sheet that was rolled; what is
    given back as places on the sheet is flat all the same.

    >>> corners = seen(sheet_poses(0.5, 1)[0], 0.3, np.random.default_rng(0))
    >>> corners.points.shape, corners.pixels.shape
    ((35, 3), (35, 2))
    """
    points = Sheet().points
    height = arch * (1.0 - (2.0 * points[:, :1] / BOARD[0] - 1.0) ** 2)
    pixels = np.column_stack(project(transform_points(T_cam_sheet, points + height * (0.0, 0.0, 1.0)), K_TRUE))
    return Corners(points, pixels + rng.normal(0.0, noise, pixels.shape), blur=2.0)


def fitted(views: Sequence[Corners]) -> tuple[Float[np.ndarray, "3 3"], float]:
    """Fit K without a lens to what was seen: K, and the RMS distance of corners in pixels.

    Unlike `labkit.geometry.calibration.calibrate` it takes any number of views, and refuses none that cannot tell K.
    """
    points = [view.points.astype(np.float32) for view in views]
    pixels = [view.pixels.astype(np.float32).reshape(-1, 1, 2) for view in views]
    rms, K, *_ = cv2.calibrateCamera(points, pixels, SIZE, None, None, flags=NO_LENS, criteria=STOP)
    return K, float(rms)


def tilt_the_sheet() -> Explorer:
    """Tilt the sheet in a few photographs, calibrate with eight draws of noise on the corners, and see f scatter.

    Controls: tilt of the sheet in degrees, how many photographs, the corners' noise in pixels.
    """

    def draw(figure: Figure, tilt: int, count: int, noise: float) -> None:
        poses, rng = sheet_poses(np.radians(tilt), count), np.random.default_rng(1)
        fits = [fitted([seen(T, noise, rng) for T in poses]) for _ in range(REPEATS)]
        f, rms = np.array([K[0, 0] for K, _ in fits]), np.mean([rms for _, rms in fits])
        picture, scatter = figure.subplots(1, 2)
        outline = BOARD * np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 0]])
        for T in poses:
            picture.plot(*project(transform_points(T, outline), K_TRUE), linewidth=1.2)
        picture.set(xlim=(0, SIZE[0]), ylim=(SIZE[1], 0), aspect="equal", xlabel="u (pixels)", ylabel="v (pixels)")
        picture.set_title(f"{count} photographs, RMS {rms:.2f} px")
        scatter.axhline(K_TRUE[0, 0], color="tab:green", linewidth=1.2, label="true f")
        scatter.plot(np.arange(REPEATS), np.clip(f, 402, 638), "o", color="tab:red", label="f of one calibration")
        scatter.set(ylim=(400, 640), xlabel="draw of the noise", ylabel="f (pixels)")
        scatter.legend(loc="upper right", fontsize=8)
        off = np.median(np.abs(f / K_TRUE[0, 0] - 1.0))
        scatter.set_title(f"median error {100 * off:.1f} %: {1000 * AWAY * off:.0f} mm at {AWAY} m")

    controls = {
        "tilt": ipywidgets.IntSlider(20, min=3, max=45, step=1, description="tilt (°)"),
        "count": ipywidgets.SelectionSlider(options=[3, 6, 12], value=6, description="photographs"),
        "noise": ipywidgets.FloatSlider(0.3, min=0.1, max=1.0, step=0.1, description="noise (px)"),
    }
    stills = ({"tilt": 3, "count": 6}, {"tilt": 10, "count": 6}, {"tilt": 40, "count": 6})
    return Explorer(draw, controls, size=(8.0, 3.3), stills=stills)
