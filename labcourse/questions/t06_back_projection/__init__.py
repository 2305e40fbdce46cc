"""Questions of topic 06: K of a crop, a lens taken back, a pose from a homography, a plane, and the noise of a height.

RETIRED are those that the lab asks no more; labs that were released when it did are checked and graded all the same.
"""

import numpy as np

RETIRED = ("back_project",)  # but for its distances along the ray the first lesson prints it, line by line


def camera(rng, H, W):
    """Draw an intrinsic matrix with unequal focal lengths and a principal point off the middle; no skew."""
    fx, fy = rng.uniform(0.8, 1.1) * W, rng.uniform(1.2, 1.6) * W
    return np.array([[fx, 0.0, rng.uniform(0.4, 0.6) * W], [0.0, fy, rng.uniform(0.3, 0.5) * H], [0.0, 0.0, 1.0]])


def pose(rng):
    """Draw a general pose: a rotation about a slanted axis, and a translation of up to a metre."""
    Q, R = np.linalg.qr(rng.normal(size=(3, 3)))
    Q *= np.sign(np.diagonal(R))
    Q[:, 0] *= np.linalg.det(Q)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Q, rng.uniform(0.2, 1.0, 3) * rng.choice([-1.0, 1.0], 3)
    return T


def pixel(rng):
    H, W = 120, 160
    return float(rng.uniform(5, 50)), float(rng.uniform(70, 115)), float(rng.uniform(0.4, 1.6)), camera(rng, H, W)


K_SMALL = np.array([[2.0, 0.0, 1.0], [0.0, 4.0, 0.0], [0.0, 0.0, 1.0]])


def K_of(fx, fy, cx, cy):
    return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])


def columns(u, v, d, K):
    """Give dP/du, dP/dv and dP/dd."""
    fx, fy, cx, cy = K[0, 0], K[1, 1], K[0, 2], K[1, 2]
    q = np.array([(u - cx) / fx, (v - cy) / fy, 1.0])
    return np.array([d / fx, 0.0, 0.0]), np.array([0.0, d / fy, 0.0]), q


def straight_ahead(u, v, d, K):
    du, dv, _ = columns(u, v, d, K)
    return np.stack([du, dv, np.array([0.0, 0.0, 1.0])], axis=1)
