"""Calibration: real photographs of a chessboard, and a camera on a simulated arm's hand.

The fourteen photographs of a 9 x 6 chessboard in the PyPI package `mvtb-data` (MIT, 130 MB), beside OpenCV alone:
`findChessboardCorners` refined in a window that reaches 11 pixels each way, as in its example; the same without the
photograph that fits worst, one of whose corners that window moves by 8 pixels; and the corners of
`findChessboardCornersSB`, which finds twelve of the boards. The kit's window grows with the squares, and fits all
fourteen. Where the package is not installed that table is left out. Hand-eye: the Panda in PyBullet looks at the sheet
on a table from fifteen poses, the corners are detected in pictures of 640 x 480 with noise and blur, and
`labkit.geometry.calibration.hand_eye` finds the camera on the hand. Beside it, from the same poses, the five methods of
OpenCV 4's `calibrateHandEye`, in an environment of its own.
"""

import importlib.util
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from bench import opencv4
from bench.measure import table
from labkit.frame import read_image
from labkit.geometry import invert_transform
from labkit.geometry.calibration import Calibration, calibrate, hand_eye, sheet_pose
from labkit.geometry.sheet import Chessboard, Sheet
from labkit.sim.kinematics import forward_kinematics, inverse_kinematics
from labkit.sim.spec import Camera, SceneSpec, Table
from labkit.sim.world import World

POSES, SIZE = 15, (640, 480)
SHEET = (0.46, -0.12, 0.0)  # x, y, yaw
MIDDLE = np.array([SHEET[0] + 0.09, SHEET[1] + 0.12, 0.0])
RUNS = 3
BOARD = Chessboard(9, 6, 0.025)
T_HAND_CAM = np.eye(4)  # 7 cm in front of the hand's flange, and looking nearly where it points
T_HAND_CAM[:3, :3] = Rotation.from_euler("xyz", (6.0, -4.0, 88.0), degrees=True).as_matrix()
T_HAND_CAM[:3, 3] = 0.07, 0.01, -0.06


def main() -> str:
    """Calibrate both; returns the tables."""
    rows = []
    for seed in range(RUNS):
        T_base_hand, T_cam_sheet, corners = on_a_hand(seed)
        ways = {"the kit": hand_eye(T_base_hand, T_cam_sheet)[0]}
        ways |= {f"OpenCV 4, {name}": T for name, T in opencv4.hand_eye(T_base_hand, T_cam_sheet).items()}
        rows += [[seed, way, *(f"{x:.2f}" for x in errors(T)), f"{corners:.0f}"] for way, T in ways.items()]
    parts = [table("hand-eye, run | by | error, mm | error, degrees | corners in the median", rows)]
    if package := importlib.util.find_spec("mvtbdata"):
        folder = Path(package.submodule_search_locations[0]) / "images" / "calibration"
        header = "chessboard, by | photographs | RMS, pixels | of the worst photograph | f, pixels (standard error)"
        ways = {"the kit": fitted(chessboard(folder)), **opencv(folder)}
        parts.insert(0, table(header, [[way, *one.row] for way, one in ways.items()]))
    return "\n\n".join(parts)


@dataclass(frozen=True)
class Fitted:
    """How well corners fit a camera: photographs used, RMS of all and of the worst one, f and its standard error,
    pixels."""

    used: int
    rms: float
    worst: float
    f: float
    error: float

    @property
    def row(self) -> list:
        """A row of the table."""
        return [self.used, f"{self.rms:.3f}", f"{self.worst:.2f}", f"{self.f:.1f} ({self.error:.1f})"]


def photographs(folder: Path) -> list[np.ndarray]:
    """The photographs of the chessboard, RGB."""
    return [read_image("picture", path, np.uint8, colour=True) for path in sorted(folder.glob("left*.jpg"))]


def chessboard(folder: Path) -> Calibration:
    """Calibrate a folder's photographs of the chessboard of 9 x 6 inner corners, by the kit."""
    pictures = photographs(folder)
    views = [view for picture in pictures if (view := BOARD.find(picture)) is not None]
    return calibrate(views, pictures[0].shape[1::-1])


def fitted(found: Calibration) -> Fitted:
    """The kit's calibration in a row's numbers."""
    worst = max(float(np.sqrt((r**2).sum(axis=1).mean())) for r in found.residuals)
    return Fitted(len(found.used), found.rms, worst, float(found.K[0, 0]), found.K_std[0])


def opencv(folder: Path) -> dict[str, Fitted]:
    """Calibrate the same photographs by OpenCV alone, from corners that it finds in three ways."""
    size, stop = (BOARD.columns, BOARD.rows), (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 30, 1e-3)
    example, sectors = [], []
    for gray in (cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY) for picture in photographs(folder)):
        found, pixels = cv2.findChessboardCorners(gray, size)
        example += [cv2.cornerSubPix(gray, pixels, (11, 11), (-1, -1), stop)] if found else []
        found, pixels = cv2.findChessboardCornersSB(gray, size)
        sectors += [pixels] if found else []
    first, errors = by_opencv(example, gray.shape[::-1])
    fitting = [pixels for i, pixels in enumerate(example) if i != int(errors.argmax())]
    return {
        "OpenCV, as in its example": first,
        "OpenCV, without the worst photograph": by_opencv(fitting, gray.shape[::-1])[0],
        "OpenCV, `findChessboardCornersSB`": by_opencv(sectors, gray.shape[::-1])[0],
    }


def by_opencv(corners: list[np.ndarray], size: tuple[int, int]) -> tuple[Fitted, np.ndarray]:
    """OpenCV's calibration from corners, and each photograph's RMS."""
    v, u = np.mgrid[: BOARD.rows, : BOARD.columns]
    points = np.column_stack([u.ravel(), v.ravel(), np.zeros(u.size)]).astype(np.float32)
    rms, K, *_, std, _, each = cv2.calibrateCameraExtended([points] * len(corners), corners, size, None, None)
    return Fitted(len(corners), float(rms), float(each.max()), float(K[0, 0]), float(std[0, 0])), each.ravel()


def on_a_hand(seed: int) -> tuple[list[np.ndarray], list[np.ndarray], float]:
    """T_base_hand and T_cam_sheet of each pose, the second from corners, and how many of these were found."""
    rng = np.random.default_rng([50, seed])
    spec = SceneSpec((), Camera.looking_at(MIDDLE, 0.5, 0.0, 1.0), table=Table(), robot=True, sheet=SHEET)
    T_base_hand, T_cam_sheet, counts = [], [], []
    with World(spec, settle_seconds=0.0) as world:
        while len(T_base_hand) < POSES:
            camera = Camera.looking_at(
                MIDDLE + rng.uniform(-0.03, 0.03, 3),
                distance=rng.uniform(0.38, 0.5),
                azimuth=np.pi + rng.uniform(-0.9, 0.9),
                elevation=rng.uniform(0.95, 1.45),
                roll=rng.uniform(-0.5, 0.5),
            )
            q = inverse_kinematics(np.array(camera.T_base_cam) @ invert_transform(T_HAND_CAM))
            if q is None:
                continue
            for joint, angle in enumerate(q):
                world.client.resetJointState(world.robot, joint, angle)
            T = forward_kinematics(q)
            drawn = world.render(SIZE, replace(camera, T_base_cam=T @ T_HAND_CAM), smooth=True)
            light = cv2.GaussianBlur(drawn.rgb.astype(np.float32), (0, 0), 0.6) + rng.normal(0.0, 3.0, drawn.rgb.shape)
            corners = Sheet().find(np.clip(light, 0, 255).astype(np.uint8))
            if corners is not None:
                T_base_hand.append(T)
                T_cam_sheet.append(sheet_pose(corners, drawn.K)[0])
                counts.append(len(corners.points))
    return T_base_hand, T_cam_sheet, float(np.median(counts))


def errors(T_found: np.ndarray) -> tuple[float, float]:
    """Millimetres and degrees by which a camera on the hand is off."""
    off = invert_transform(T_HAND_CAM) @ T_found
    turn = np.degrees(np.linalg.norm(cv2.Rodrigues(off[:3, :3])[0]))
    return 1e3 * float(np.linalg.norm(off[:3, 3])), float(turn)


if __name__ == "__main__":
    print(main())
