"""Calibration: real photographs of a chessboard, and a camera on a simulated arm's hand.

The fourteen photographs of a 9 x 6 chessboard in the PyPI package `mvtb-data` (MIT, 130 MB): OpenCV's example finds
RMS 0.406 pixels and f = 536.3 in them, with corners of one photograph that lie 1.2 pixels off. Where the package is not
installed that table is left out. Hand-eye: the Panda in PyBullet looks at
the sheet on a table from fifteen poses, the corners are detected in pictures of 640 x 480 with noise and blur, and
`labkit.geometry.calibration.hand_eye` finds the camera on the hand. Beside it, from the same poses, the five methods of
OpenCV 4's `calibrateHandEye`, in an environment of its own.
"""

import importlib.util
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from bench import opencv4
from bench.measure import table
from labkit.frame import read_image
from labkit.geometry import invert_transform
from labkit.geometry.calibration import calibrate, hand_eye, sheet_pose
from labkit.geometry.sheet import Chessboard, Sheet
from labkit.sim.kinematics import forward_kinematics, inverse_kinematics
from labkit.sim.spec import Camera, SceneSpec, Table
from labkit.sim.world import World

POSES, SIZE = 15, (640, 480)
SHEET = (0.46, -0.12, 0.0)  # x, y, yaw
MIDDLE = np.array([SHEET[0] + 0.09, SHEET[1] + 0.12, 0.0])
RUNS = 3
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
        found = chessboard(Path(package.submodule_search_locations[0]) / "images" / "calibration")
        f, error = found.K[0, 0], found.K_std[0]
        row = [len(found.used), f"{found.rms:.3f}", f"{f:.1f} (standard error {error:.1f})"]
        parts.insert(0, table("chessboard, photographs used | RMS, pixels | f", [row]))
    return "\n\n".join(parts)


def chessboard(folder: Path):
    """Calibrate a folder's photographs of the chessboard of 9 x 6 inner corners."""
    pictures = [read_image("picture", path, np.uint8, colour=True) for path in sorted(folder.glob("left*.jpg"))]
    views = [view for picture in pictures if (view := Chessboard(9, 6, 0.025).find(picture)) is not None]
    return calibrate(views, pictures[0].shape[1::-1])


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
