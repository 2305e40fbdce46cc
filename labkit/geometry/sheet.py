"""A printed sheet that photographs are measured by: its corners on paper, and in a picture (topic 06).

The sheet is a ChArUco board: a chessboard whose white squares hold markers, each with a number. So a corner is known
by its markers though things cover the rest. A chessboard of one's own has no numbers and must be seen whole.

The sheet lies in the base frame: origin at the board's lower left corner, x to the right, y up the page, z out of the
paper, metres. Pixel centres lie at integers.
"""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from labkit.support.validation import check_number, check_rgb, check_whole, require

SQUARE_MM, MARKER_MM = 30, 24  # a module of a marker is 4 mm, so that every edge lies at a whole millimetre
COLUMNS, ROWS = 6, 8  # squares: 180 x 240 mm fit on A4 and on letter
RULER_MM = 150  # the line on the sheet that its print is checked by
LEAST_CORNERS = 6
EDGE = 0.12  # share of a square's side: how far from an edge its blur is looked for; a marker begins after 0.1


@dataclass(frozen=True, eq=False)
class Corners:
    """Corners of a sheet in one photograph: on the sheet, (N, 3) metres, and in the picture, (N, 2) pixels u, v.

    blur: the width of the sheet's edges in pixels, from black to white; about 2 in a sharp picture.
    """

    points: Float[np.ndarray, "N 3"]
    pixels: Float[np.ndarray, "N 2"]
    blur: float


@dataclass(frozen=True)
class Sheet:
    """The kit's own sheet. scale: how much larger than meant it was printed, measured length / 150 mm.

    >>> Sheet().size_mm
    (180, 240)
    >>> Sheet().points[0].round(3).tolist()  # the first inner corner is the upper left one
    [0.03, 0.21, 0.0]
    """

    scale: float = 1.0

    def __post_init__(self):
        check_number("scale", self.scale, least=0.2, most=5.0)

    @property
    def size_mm(self) -> tuple[int, int]:
        """Width and height of the board as it is meant to be printed."""
        return COLUMNS * SQUARE_MM, ROWS * SQUARE_MM

    @cached_property
    def board(self) -> cv2.aruco.CharucoBoard:
        """OpenCV's description of the board."""
        markers = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
        return cv2.aruco.CharucoBoard((COLUMNS, ROWS), 1e-3 * SQUARE_MM, 1e-3 * MARKER_MM, markers)

    @cached_property
    def points(self) -> Float[np.ndarray, "N 3"]:
        """Inner corners by number, row by row from the upper left, in the base frame; OpenCV counts y downwards."""
        x, y, _ = self.board.getChessboardCorners().astype(np.float64).T
        return self.scale * np.column_stack([x, 1e-3 * self.size_mm[1] - y, np.zeros_like(x)])

    def find(self, image: UInt8[np.ndarray, "H W 3"]) -> Corners | None:
        """Find the corners in an RGB photograph; None with fewer than six, or where all lie on a line."""
        gray = cv2.cvtColor(check_rgb("image", image), cv2.COLOR_RGB2GRAY)
        pixels, numbers, *_ = cv2.aruco.CharucoDetector(self.board).detectBoard(gray)
        if numbers is None or len(numbers) < LEAST_CORNERS:
            return None
        numbers, pixels = numbers.ravel(), pixels.reshape(-1, 2).astype(np.float64)
        points = self.points[numbers]
        if np.linalg.matrix_rank(points[:, :2] - points[:, :2].mean(axis=0), tol=1e-6) < 2:
            return None
        return Corners(points, pixels, edge_width(gray, points, pixels, self.scale * 1e-3 * SQUARE_MM))


@dataclass(frozen=True)
class Chessboard:
    """A chessboard of one's own: inner corners across and down, as OpenCV counts them, and a square's side in metres.

    Its origin is a corner that OpenCV chooses, so its pose is known but for a half turn: it serves to find K.
    """

    columns: int
    rows: int
    square: float

    def __post_init__(self):
        check_whole("chessboard", self.columns, 3)
        check_whole("chessboard", self.rows, 3)
        check_number("square", self.square, least=1e-3, most=1.0)

    def find(self, image: UInt8[np.ndarray, "H W 3"]) -> Corners | None:
        """Find all inner corners in an RGB photograph; None if one is hidden.

        Raises ValueError where the photograph shows that squares were counted, which are one more each way.
        """
        gray = cv2.cvtColor(check_rgb("image", image), cv2.COLOR_RGB2GRAY)
        pixels = _chessboard(gray, (self.columns, self.rows))
        if pixels is None:
            fewer = (self.columns - 1, self.rows - 1)
            counted = min(fewer) >= 3 and _chessboard(gray, fewer) is not None
            require(
                "chessboard",
                not counted,
                "how many inner corners there are, where four squares meet",
                f"{self.columns}x{self.rows}, which counts squares: it is {fewer[0]}x{fewer[1]}",
            )
            return None
        v, u = np.mgrid[: self.rows, : self.columns]
        points = self.square * np.column_stack([u.ravel(), v.ravel()[::-1], np.zeros(u.size)])
        return Corners(points, pixels, edge_width(gray, points, pixels, self.square))


Target = Sheet | Chessboard


def _chessboard(gray: UInt8[np.ndarray, "H W"], size: tuple[int, int]) -> Float[np.ndarray, "N 2"] | None:
    found, pixels = cv2.findChessboardCorners(gray, size)
    if not found:
        return None
    grid = pixels.reshape(size[1], size[0], 2)
    apart = min(np.linalg.norm(np.diff(grid, axis=axis), axis=-1).min() for axis in (0, 1))
    half = int(np.clip(0.4 * apart, 2, 11))  # a window that holds no other corner, which would draw this one away
    stop = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 30, 1e-3)
    return cv2.cornerSubPix(gray, pixels, (half, half), (-1, -1), stop).reshape(-1, 2).astype(np.float64)


def edge_width(
    gray: UInt8[np.ndarray, "H W"], points: Float[np.ndarray, "N 3"], pixels: Float[np.ndarray, "N 2"], square: float
) -> float:
    """Measure how many pixels the edges between neighbouring corners take from black to white, in the median.

    An edge of contrast c that rises by at most g per pixel is c / g wide: 2.5 sigma under a blur of sigma pixels. It is
    looked for halfway between two corners that are one `square` apart, across their edge; NaN if there are no such two.
    """
    gaps = np.linalg.norm(points[:, None] - points[None], axis=-1)
    i, j = np.nonzero(np.triu(np.abs(gaps - square) < 0.1 * square))
    if not len(i):
        return float("nan")
    along = pixels[j] - pixels[i]
    length = np.linalg.norm(along, axis=1, keepdims=True)
    across = along[:, ::-1] * (-1.0, 1.0) / length
    steps = np.linspace(-1.0, 1.0, 33)
    reach = np.maximum(EDGE * length, 3.0)
    places = (pixels[i] + pixels[j])[:, None] / 2.0 + steps[None, :, None] * (reach * across)[:, None]
    profile = cv2.remap(gray, places.astype(np.float32), None, cv2.INTER_LINEAR).astype(np.float64)
    rise = np.abs(np.gradient(profile, axis=1)).max(axis=1) / (reach[:, 0] * (steps[1] - steps[0]))
    return float(np.median(np.ptp(profile, axis=1) / np.maximum(rise, 1e-9)))
