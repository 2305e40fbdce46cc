"""Photographs of a flat sheet, drawn by ray casting: each pixel's ray, bent by the lens, meets the sheet's plane.

No rendering of the kit's, so that what finds cameras in photographs is tested against something else.
"""

from functools import cache

import cv2
import numpy as np
from PIL import Image
from scipy.spatial.transform import Rotation

from labkit.geometry.sheet import Sheet

SIZE = (640, 480)
K = np.array([[520.0, 0.0, 325.0], [0.0, 523.0, 236.0], [0.0, 0.0, 1.0]])
LENS = (0.08, -0.15, 0.001, -0.0005, 0.05)
MARGIN = 20  # millimetres of white paper around the board


@cache
def paper() -> np.ndarray:
    """The sheet, ten pixels per millimetre, softened so that a ray may take one pixel of it."""
    width, height = Sheet().size_mm
    board = Sheet().board.generateImage((10 * width, 10 * height))
    edge = 10 * MARGIN
    return cv2.GaussianBlur(cv2.copyMakeBorder(board, *[edge] * 4, cv2.BORDER_CONSTANT, value=255), (0, 0), 4)


@cache
def _rays(K: bytes, lens: tuple, size: tuple[int, int]) -> np.ndarray:
    u, v = np.meshgrid(np.arange(size[0], dtype=float), np.arange(size[1], dtype=float))
    pixels = np.stack([u, v], axis=-1).reshape(-1, 1, 2)
    rays = cv2.undistortPoints(pixels, np.frombuffer(K).reshape(3, 3), np.array(lens)).reshape(-1, 2)
    return np.column_stack([rays, np.ones(len(rays))])


def photograph(T_cam_sheet, rng, K=K, lens=LENS, size=SIZE, scale=1.0, blur=0.6, noise=4.0, paper=None):
    """An RGB photograph of the sheet (printed `scale` times as large), with blur and noise; grey around it."""
    paper = globals()["paper"]() if paper is None else paper
    T_sheet_cam = np.linalg.inv(T_cam_sheet)
    rays = _rays(np.ascontiguousarray(K).tobytes(), tuple(lens), tuple(size)) @ T_sheet_cam[:3, :3].T
    with np.errstate(divide="ignore", invalid="ignore"):
        far = -T_sheet_cam[2, 3] / rays[:, 2]
        P = (T_sheet_cam[:3, 3] + np.where(far > 0.0, far, np.nan)[:, None] * rays) * 1e3 / scale  # millimetres
    x = 10.0 * (P[:, 0] + MARGIN) - 0.5
    y = 10.0 * (Sheet().size_mm[1] - P[:, 1] + MARGIN) - 0.5
    maps = [np.nan_to_num(value, nan=-1e6).astype(np.float32).reshape(size[::-1]) for value in (x, y)]
    seen = cv2.remap(paper, *maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=120).astype(float)
    seen = cv2.GaussianBlur(seen, (0, 0), blur) + rng.normal(0.0, noise, seen.shape)
    return np.repeat(np.clip(seen, 0.0, 255.0).astype(np.uint8)[..., None], 3, axis=2)


def pose(tilt=(0.0, 0.0), turn=0.0, middle=(0.0, 0.0, 0.45)):
    """T_cam_sheet of a sheet whose middle is at `middle`, tilted about x and y and turned in its plane, degrees."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("xyz", (180.0 + tilt[0], tilt[1], turn), degrees=True).as_matrix()
    T[:3, 3] = np.array(middle) - T[:3, :3] @ (0.09, 0.12, 0.0)
    return T


def poses(rng, count=12, tilt=40.0):
    """Poses from many sides, the sheet mostly within the picture and often near its edges."""
    return [
        pose(
            tilt=rng.uniform(-tilt, tilt, 2),
            turn=rng.uniform(-180.0, 180.0),
            middle=(rng.uniform(-0.1, 0.1), rng.uniform(-0.07, 0.07), rng.uniform(0.3, 0.5)),
        )
        for _ in range(count)
    ]


def save(path, picture, orientation=1):
    """A JPEG as a phone writes it: the sensor's pixels, and how it was held."""
    exif = Image.Exif()
    exif[0x0112] = orientation
    Image.fromarray(picture).save(path, quality=95, exif=exif)
