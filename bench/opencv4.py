"""OpenCV 4's hand-eye calibration, which the wheel of OpenCV 5 lacks, in an environment of its own."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np

ENVIRONMENT = Path(__file__).resolve().parents[1] / ".venv-opencv4"
PINNED = "opencv-python-headless==4.13.0.92"
METHODS = ("TSAI", "PARK", "HORAUD", "ANDREFF", "DANIILIDIS")
SCRIPT = """
import json, sys
import cv2, numpy as np

methods, hands, sheets = json.load(sys.stdin)
hands, sheets = np.array(hands), np.array(sheets)
found = {}
for name in methods:
    R, t = cv2.calibrateHandEye(
        hands[:, :3, :3], hands[:, :3, 3], sheets[:, :3, :3], sheets[:, :3, 3],
        method=getattr(cv2, "CALIB_HAND_EYE_" + name),
    )
    found[name] = np.vstack([np.column_stack([R, t]), [0, 0, 0, 1]]).tolist()
print(json.dumps(found))
"""


def hand_eye(T_base_hand: list[np.ndarray], T_cam_sheet: list[np.ndarray]) -> dict[str, np.ndarray]:
    """T_hand_cam by each of OpenCV's methods. The first call installs OpenCV 4 where it is missing."""
    if not (ENVIRONMENT / "installed").is_file():
        subprocess.run([sys.executable, "-m", "venv", "--clear", ENVIRONMENT], check=True)
        subprocess.run([ENVIRONMENT / "bin/python", "-m", "pip", "install", "--quiet", PINNED], check=True)
        (ENVIRONMENT / "installed").touch()
    poses = json.dumps([METHODS, np.array(T_base_hand).tolist(), np.array(T_cam_sheet).tolist()])
    run = [ENVIRONMENT / "bin/python", "-c", SCRIPT]
    found = subprocess.run(run, input=poses, capture_output=True, text=True, check=True).stdout
    return {name: np.array(T) for name, T in json.loads(found).items()}
