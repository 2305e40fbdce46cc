"""One canonical view of any camera's picture: upright, and with pixels of one size on the table (topic 06).

A network that learns from pictures of one camera, held in one way, knows no other. But how a camera is held, and how
much of the table its pixels cover, is told by T_base_cam, K and depth. So the picture is turned until base z points up
in it, and resampled; the network looks at that view, and its probabilities are brought back to the picture's pixels.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from jaxtyping import Float, Float32

from labkit.frame import RGBDFrame
from labkit.labels import unknown_number

PIXEL = 0.0025  # metres of the table that the view's median pixel covers
NEAR_TABLE = 0.25  # metres over or under the table: pixels in between tell the size of a pixel
STEEP = np.cos(np.radians(80.0))  # of a camera that looks down more steeply, "up" is too short an arrow in the picture
SCALES = (1.0 / 16.0, 4.0)  # how much smaller or larger than its picture a view may get
MOST_PIXELS = 800 * 600  # of a view; pictures that show more of the world get larger pixels


@dataclass(frozen=True, eq=False)
class CanonicalView:
    """A picture's canonical view, and the way back.

    frame: the view, a frame like any other, with the K and T_base_cam of the camera that would have seen it. size: of
    the picture, (width, height). turns: quarters that the picture was turned by first, counter-clockwise.
    to_turned: (2, 3); pixel (u, v) of the view shows the place to_turned (u, v, 1) of the turned picture.
    """

    frame: RGBDFrame
    size: tuple[int, int]
    turns: int
    to_turned: Float[np.ndarray, "2 3"]

    def back(self, image: Float32[np.ndarray, "h w C"], how: int = cv2.INTER_LINEAR) -> Float32[np.ndarray, "H W C"]:
        """Bring numbers of the view's pixels to the picture's own: bilinearly, or as OpenCV's flag `how` says."""
        size = self.size if self.turns % 2 == 0 else self.size[::-1]
        to_view = cv2.invertAffineTransform(self.to_turned)
        out = np.empty((*size[::-1], image.shape[2]), np.float32)
        for first in range(0, image.shape[2], 4):  # as many channels as OpenCV warps at a time
            part = np.ascontiguousarray(image[..., first : first + 4])
            out[..., first : first + 4] = warped(part, to_view, size, how).reshape(*size[::-1], -1)
        return rot90(out, -self.turns)


def canonical_view(frame: RGBDFrame, pixel: float = PIXEL) -> CanonicalView | None:
    """Turn a picture upright and resample it so that its median pixel covers `pixel` metres; None without any depth.

    Pixels near the table's height count for the median, all if there are none. Colour is interpolated; depth, and
    labels and instances if known, are the nearest pixel's. Beyond the picture there is no depth, colour repeats the
    border, and labels and instances are unknown. A camera that looks down by more than 80 degrees is turned by whole
    quarters, to where base z points up best. Quarter turns of one picture have the very same view. Topic 06.

    >>> looking_ahead = np.array([[ 0.0, 0.0, 1.0, 0.0],  # the picture's right is -y of the base, its lower edge -z
    ...                           [-1.0, 0.0, 0.0, 0.0],
    ...                           [0.0, -1.0, 0.0, 0.1],
    ...                           [ 0.0, 0.0, 0.0, 1.0]])
    >>> K = np.array([[200.0, 0.0, 31.5], [0.0, 200.0, 23.5], [0.0, 0.0, 1.0]])
    >>> frame = RGBDFrame(np.zeros((48, 64, 3), np.uint8), np.ones((48, 64), np.float32), K, looking_ahead)
    >>> canonical_view(frame).frame  # pixels of 5 mm become pixels of 2.5 mm
    RGBDFrame(128 x 96)
    """
    if not (frame.depth > 0.0).any():  # NaN > 0 is False
        return None
    turns, A, c, R = turned_upright(frame)
    height = frame.T_base_cam[2, 3] - (frame.table_z or 0.0)
    rgb, depth = rot90(frame.rgb, turns), rot90(frame.depth, turns)
    f, (H, W) = np.sqrt(A[0, 0] * A[1, 1]), depth.shape
    up = R[2, :2]
    roll = np.arctan2(up[0], -up[1]) if np.hypot(*up) > STEEP else 0.0
    turn = np.array([[np.cos(roll), -np.sin(roll)], [np.sin(roll), np.cos(roll)]])  # rays of the view to the picture's

    # The corners of the picture, as places in a view with the picture's own scale, say how large the view gets.
    corners = np.array([[u, v] for u in (-0.5, W - 0.5) for v in (-0.5, H - 0.5)])
    corners = f * (corners - c) @ np.linalg.inv(A).T @ turn
    low, high = corners.min(axis=0), corners.max(axis=0)
    scale = np.clip(table_pixel(depth, A, c, R[2], height) / pixel, *SCALES)
    scale = min(scale, np.sqrt(MOST_PIXELS / np.prod(high - low)))
    size = np.maximum(np.round(scale * (high - low)), 1.0)
    f_view, c_view = scale * f, (size - 1.0) / 2.0 - scale * (low + high) / 2.0
    to_picture = A @ turn / f_view
    M = np.column_stack([to_picture, c - to_picture @ c_view])

    T = frame.T_base_cam.copy()
    T[:3, :3] = np.column_stack([R[:, :2] @ turn, R[:, 2]])
    size = tuple(size.astype(int).tolist())
    known = (None if image is None else rot90(image, turns) for image in (frame.labels, frame.instances))
    rgb, depth, labels, instances = resampled(rgb, depth, *known, M, size, scale)
    K = np.array([[f_view, 0.0, c_view[0]], [0.0, f_view, c_view[1]], [0.0, 0.0, 1.0]])
    view = RGBDFrame(rgb, depth, K, T, labels, instances, table_z=frame.table_z)
    return CanonicalView(view, frame.size, turns, M)


def turned_upright(frame: RGBDFrame):
    """The quarter turns, counter-clockwise, after which base z points up in the picture as well as it can.

    Returns their number and the turned camera: it shows its ray (x, y, 1) at the pixel A (x, y) + c, and R maps the ray
    to the base frame. Where base z is a point, x of the base stands in for it.
    """
    R = frame.T_base_cam[:3, :3]
    up = R[2, :2] if np.hypot(*R[2, :2]) > 1e-3 else R[0, :2]
    if abs(up[1]) >= abs(up[0]):
        turns = 0 if up[1] < 0.0 else 2
    else:
        turns = 1 if up[0] > 0.0 else 3
    quarter = np.array([[0.0, -1.0], [1.0, 0.0]])  # rays of the turned camera to the old one's
    A, c = frame.K[:2, :2], np.round(frame.K[:2, 2] * 2.0**20) / 2.0**20  # a grid on which c turns without rounding
    for turn in range(turns):
        A, c = quarter.T @ A @ quarter, quarter.T @ c + (0.0, frame.size[turn % 2] - 1.0)
        R = np.column_stack([R[:, :2] @ quarter, R[:, 2]])
    return turns, A, c, R


def table_pixel(depth: Float[np.ndarray, "H W"], A, c, up, height: float) -> float:
    """Metres that the median pixel near the table covers: depth / f. The median is taken over some 50,000 pixels.

    up: the part along base z of each of the camera's axes, (3,). height: of the camera over the table, metres.
    """
    step = max(1, round(np.sqrt(depth.size / 50_000)))
    d = depth[step // 2 :: step, step // 2 :: step].astype(np.float64)
    v, u = (np.mgrid[: d.shape[0], : d.shape[1]] * step) + step // 2
    slope = up[:2] @ np.linalg.inv(A)
    z = height + d * (slope[0] * (u - c[0]) + slope[1] * (v - c[1]) + up[2])
    known = d > 0.0
    near = known & (np.abs(z) < NEAR_TABLE)
    chosen = d[near if near.any() else known]
    middle = np.median(chosen) if chosen.size else np.nanmedian(np.where(depth > 0.0, depth, np.nan))
    return float(middle / np.sqrt(A[0, 0] * A[1, 1]))


def resized(frame: RGBDFrame, factor: float) -> RGBDFrame:
    """The same picture of a world whose lengths are all `factor` times as large, with the table at height 0."""
    T = frame.T_base_cam.copy()
    T[:3, 3] = factor * (T[:3, 3] - (0.0, 0.0, frame.table_z or 0.0))
    return replace(frame, T_base_cam=T, depth=frame.depth * np.float32(factor), table_z=0.0)


def rolled_camera(frame: RGBDFrame, roll: float, K: Float[np.ndarray, "3 3"], size: tuple[int, int]) -> RGBDFrame:
    """What the camera would see if it were rolled about its axis (radians), with another K and (width, height) `size`.

    It stays where it is, so depth does not change: pixel x of the new picture shows what K R K_new^-1 x of the old one
    did. Depth, and labels and instances if known, are the nearest pixel's; beyond the old picture there is no depth,
    and labels and instances are unknown.
    """
    turn = np.array([[np.cos(roll), -np.sin(roll), 0.0], [np.sin(roll), np.cos(roll), 0.0], [0.0, 0.0, 1.0]])
    M = (frame.K @ turn @ np.linalg.inv(K))[:2]
    scale = 1.0 / np.sqrt(np.linalg.det(M[:, :2]))
    images = resampled(frame.rgb, frame.depth, frame.labels, frame.instances, M, size, scale)
    T = frame.T_base_cam.copy()
    T[:3, :3] = T[:3, :3] @ turn
    rgb, depth, labels, instances = images
    return RGBDFrame(rgb, depth, K, T, labels, instances, table_z=frame.table_z)


def resampled(rgb, depth, labels, instances, M, size: tuple[int, int], scale: float):
    """Colours, depth, labels and instances (or None) of another picture: `warped` as suits each.

    scale: the new picture's, to the old one's.
    """
    nearest = cv2.INTER_NEAREST, cv2.BORDER_CONSTANT
    return (
        warped(smoothed(rgb, scale), M, size, cv2.INTER_LINEAR),
        warped(depth, M, size, *nearest),
        *(None if x is None else warped(x, M, size, *nearest, unknown_number(x)) for x in (labels, instances)),
    )


def smoothed(rgb, scale: float):
    """A picture that may be sampled at `scale` of its size: each pixel the mean of as many as one will stand for."""
    side = 2 * int(0.5 / scale) + 1
    return rgb if side == 1 else cv2.blur(rgb, (side, side))


def warped(image, M, size: tuple[int, int], how: int, border: int = cv2.BORDER_REPLICATE, beyond: int = 0):
    """Resample an image: pixel x of the new one, of (width, height) `size`, shows the place M (x, 1) of the old one."""
    return cv2.warpAffine(image, M, size, None, how | cv2.WARP_INVERSE_MAP, border, beyond)


def rot90(image, turns: int):
    """An image turned counter-clockwise by so many quarters, as OpenCV wants it in memory."""
    return np.ascontiguousarray(np.rot90(image, turns))
