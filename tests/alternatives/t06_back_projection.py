"""Right answers to the questions of 06_back_projection, written in other ways than the references."""

import numpy as np


def cropped_intrinsics__torch(K, left, top, scale):
    import torch

    K = torch.from_numpy(K)
    corner = torch.tensor([left - 0.5, top - 0.5], dtype=torch.float64)
    new = torch.eye(3, dtype=torch.float64)
    new[:2, :2], new[:2, 2] = scale * K[:2, :2], scale * (K[:2, 2] - corner) - 0.5
    return new


def undistort__halving(pixels, K, k):
    f, c = np.diag(K)[:2], K[:2, 2]
    x = (pixels - c) / f
    low, high = np.zeros(len(x)), np.ones(len(x))
    for _ in range(60):
        middle = (low + high) / 2
        s2 = (middle[:, None] * x * 1.5) ** 2 @ np.ones(2)
        too_far = middle * 1.5 * (1 + k[0] * s2 + k[1] * s2**2) > 1
        low, high = np.where(too_far, low, middle), np.where(too_far, middle, high)
    return c + f * x * 1.5 * high[:, None]


def pose_from_homography__nearest_rotation(H, K):
    B = np.linalg.inv(K) @ H
    if B[2, 2] < 0:
        B = -B
    B = 2 * B / (np.linalg.norm(B[:, 0]) + np.linalg.norm(B[:, 1]))
    U, _, Vt = np.linalg.svd(np.column_stack([B[:, 0], B[:, 1], np.cross(B[:, 0], B[:, 1])]))
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = U @ Vt, B[:, 2]
    return np.linalg.inv(T)


def pose_from_homography__the_camera_is_above(H, K):
    a = [np.linalg.inv(K) @ H[:, i] for i in range(3)]
    s = (np.sqrt(a[0] @ a[0]) + np.sqrt(a[1] @ a[1])) / 2
    M = np.array(a[:2]).T / s
    w, V = np.linalg.eigh(M.T @ M)
    r = M @ V @ np.diag(w**-0.5) @ V.T  # the polar decomposition's factor
    z = np.cross(r[:, 0], r[:, 1])
    R, t = np.array([r[:, 0], r[:, 1], z]), a[2] / s
    if -z @ t < 0:
        R, t = R * [[-1], [-1], [1]], -t
    return [[*row, -row @ t] for row in R] + [[0.0, 0.0, 0.0, 1.0]]
