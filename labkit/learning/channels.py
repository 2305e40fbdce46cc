"""What a network sees of a depth image: seven channels that say where a pixel is and how its surface lies."""

import cv2
import numpy as np
from jaxtyping import Float, Num

CHANNELS = ("height", "height, fine", "known", "right", "away", "up", "footprint")
HEIGHTS = (0.25, 0.05)  # metres above and below the table that the two height channels reach
FOOTPRINT = 0.003  # metres that a pixel covers where its channel is 0.5; 0 and 1 are an eighth and eight times of it
MIRRORED = CHANNELS.index("right")  # changes its sign in a mirror


def geometry_channels(
    depth: Float[np.ndarray, "H W"],
    K: Float[np.ndarray, "3 3"],
    T_base_cam: Float[np.ndarray, "4 4"],
    table_z: float = 0.0,
) -> Float[np.ndarray, "H W 7"]:
    """Turn depth into the channels of CHANNELS, float32 in 0..1; a pixel without depth is 0.5 in each.

    depth in metres, 0 or NaN where there is no reading; table_z: height of the table plane in the base frame, metres.
    Heights over the table (up to 0.25 m and, finer, 0.05 m above or below) do not depend on the viewpoint; the pixel's
    footprint depth / f does, and tells the true size of what pixels show. right, away and up are the surface normal's
    parts along the image's right, away from the camera (both horizontal), and up. Topic 06_back_projection.

    >>> looking_down = np.diag([1.0, -1.0, -1.0, 1.0])
    >>> looking_down[2, 3] = 1.0
    >>> g = geometry_channels(np.full((9, 9), 0.98), np.array([[99, 0, 4], [0, 99, 4], [0, 0, 1.0]]), looking_down)
    >>> [f"{name} {value:.2f}" for name, value in zip(CHANNELS, g[4, 4])]
    ['height 0.54', 'height, fine 0.70', 'known 1.00', 'right 0.50', 'away 0.50', 'up 1.00', 'footprint 0.79']
    """
    from labkit.support.geometry_kernels import Viewpoint, fill_channels  # numba takes its time to import

    depth = np.ascontiguousarray(depth, np.float32)
    R, t = T_base_cam[:3, :3], T_base_cam[:3, 3]
    # On a plane 1 / depth is linear in u and v: it is g . (u, v, 1), with g = K^-T n / distance. Least squares over
    # 5 x 5 pixels gives its slopes.
    q = inverse_depth(depth)
    ramp, flat = np.arange(-2.0, 3.0) / 10.0, np.full(5, 0.2)
    q_u = cv2.sepFilter2D(q, cv2.CV_32F, ramp, flat, borderType=cv2.BORDER_REPLICATE)
    q_v = cv2.sepFilter2D(q, cv2.CV_32F, flat, ramp, borderType=cv2.BORDER_REPLICATE)
    right = R[:, 0] * (1.0, 1.0, 0.0)
    right = right / np.linalg.norm(right) if np.linalg.norm(right) > 1e-6 else np.array([1.0, 0.0, 0.0])
    axes = np.array([right, np.cross((0.0, 0.0, 1.0), right), (0.0, 0.0, 1.0)])
    to_normal = -axes @ R @ K.T  # the normal that points towards the camera
    slant = R[2] @ np.linalg.inv(K)
    footprint = np.float32(np.sqrt(K[0, 0] * K[1, 1]) * FOOTPRINT)
    single = [np.asarray(x, np.float32) for x in (to_normal, slant)]
    reach = np.array(HEIGHTS, np.float32)
    channels = np.full((*depth.shape, len(CHANNELS)), np.float32(0.5))
    viewpoint = Viewpoint(*single, np.float32(t[2] - table_z), reach, footprint)
    fill_channels(depth, q, q_u, q_v, viewpoint, channels)
    return channels


def inverse_depth(depth: Float[np.ndarray, "H W"]) -> Float[np.ndarray, "H W"]:
    """Compute 1 / depth, float32; a pixel without depth gets the mean over the known of the 5 x 5 around it, else 0."""
    known = (depth > 0.0).astype(np.float32)
    q = np.divide(np.float32(1.0), depth, out=np.zeros_like(known), where=known > 0.0)
    whole = {"ddepth": cv2.CV_32F, "ksize": (5, 5), "normalize": False, "borderType": cv2.BORDER_CONSTANT}
    total, count = cv2.boxFilter(q, **whole), cv2.boxFilter(known, **whole)
    return np.where(known > 0.0, q, total / np.maximum(count, 1.0))


def mirrored(array: Num[np.ndarray, "*N H W D"]) -> Num[np.ndarray, "*N H W D"]:
    """An image, or the geometry channels, of the same scene seen in a mirror, left for right."""
    out = array[..., ::-1, :].copy()
    if out.shape[-1] == len(CHANNELS):
        out[..., MIRRORED] = 1.0 - out[..., MIRRORED]
    return out
