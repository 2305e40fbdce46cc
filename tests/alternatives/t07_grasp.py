"""Right answers to the questions of 07_grasp, written in other ways than the references."""

import numpy as np

from labkit.course.questions.t07_grasp.grasp_pose import DOWN, pose, unit
from labkit.course.questions.t07_grasp.points_in_fingers import in_boxes, moved
from labkit.course.questions.t07_grasp.width_across import extent

# ---------- centroid_and_covariance


def centroid_loops(P):
    mu = [sum(float(p[k]) for p in P) / len(P) for k in range(3)]
    Sigma = np.zeros((3, 3))
    for p in P:
        for i in range(3):
            for j in range(3):
                Sigma[i, j] += (p[i] - mu[i]) * (p[j] - mu[j]) / len(P)
    return np.array(mu), Sigma


def centroid_einsum(P):
    mu = np.einsum("ni->i", P) / len(P)
    return mu, np.einsum("ni,nj->ij", P - mu, P - mu) / len(P)


def centroid_torch(P):
    import torch

    P = torch.as_tensor(P, dtype=torch.float64)
    return P.mean(0), torch.cov(P.T, correction=0)


def centroid_float32(P):
    mu = P.mean(axis=0, dtype=np.float32)
    centred = (P - mu).astype(np.float32)
    return mu, centred.T @ centred / np.float32(len(P))


def centroid_numpy_cov(P):
    return np.average(P, axis=0), np.cov(P.T, ddof=0)


# ---------- closing_yaw


def closing_yaw_formula(Sigma):
    long = 0.5 * np.arctan2(2.0 * Sigma[0, 1], Sigma[0, 0] - Sigma[1, 1])
    return (long + np.pi / 2) % np.pi


def closing_yaw_svd(Sigma):
    axes, _, _ = np.linalg.svd(Sigma[:2, :2])
    return float(np.arctan2(*axes[::-1, -1]))


def closing_yaw_across_the_long_axis(Sigma):
    x, y = np.linalg.eigh(Sigma[:2, :2])[1][:, -1]
    return np.arctan2(y, x) - np.pi / 2


def closing_yaw_loop(Sigma):
    low, high = 0.0, np.pi
    for _ in range(12):  # a fan of directions, ever finer round the one of least variance
        fan = np.linspace(low, high, 61)
        d = np.stack([np.cos(fan), np.sin(fan)])
        best = fan[np.einsum("in,ij,jn->n", d, Sigma[:2, :2], d).argmin()]
        low, high = best - (high - low) / 20, best + (high - low) / 20
    return best


def closing_yaw_torch(Sigma):
    import torch

    _, axes = torch.linalg.eigh(torch.as_tensor(Sigma[:2, :2]))
    return torch.atan2(axes[1, 0], axes[0, 0])


def closing_yaw_float32(Sigma):
    _, axes = np.linalg.eigh(Sigma[:2, :2].astype(np.float32))
    return np.arctan2(axes[1, 0], axes[0, 0])


# ---------- width_across


def width_loops(P, yaw):
    low, high = float("inf"), -float("inf")
    for x, y, _ in P:
        a = float(x) * np.cos(yaw) + float(y) * np.sin(yaw)
        low, high = min(low, a), max(high, a)
    return high - low


def width_einsum(P, yaw):
    return np.ptp(np.einsum("ni,i->n", P, [np.cos(yaw), np.sin(yaw), 0.0]))


def width_torch(P, yaw):
    import torch

    across = torch.as_tensor(P[:, :2]) @ torch.tensor([np.cos(yaw), np.sin(yaw)], dtype=torch.float64)
    return across.max() - across.min()


def width_float32(P, yaw):
    d = np.array([np.cos(yaw), np.sin(yaw)], np.float32)
    return extent((P[:, :2] - P[:, :2].mean(axis=0)).astype(np.float32) @ d)


# ---------- grasp_height


def height_with(P, table_z, palm, tips, clearance):
    return np.max([P[:, 2].max() - palm, P[:, 2].min(), table_z + clearance]) + tips


def height_loops(P, table_z, palm, tips, clearance):
    low, high = float("inf"), -float("inf")
    for _, _, z in P.tolist():
        low, high = min(low, z), max(high, z)
    bound = high - palm
    if low > bound:
        bound = low
    if table_z + clearance > bound:
        bound = table_z + clearance
    return bound + tips


def height_torch(P, table_z, palm, tips, clearance):
    import torch

    z = torch.as_tensor(P[:, 2])
    bounds = torch.stack([z.max() - palm, z.min(), torch.tensor(table_z + clearance, dtype=z.dtype)])
    return bounds.max() + tips


def height_float32(P, table_z, palm, tips, clearance):
    z = P[:, 2].astype(np.float32)
    return np.float32(max(z.max() - np.float32(palm), z.min(), np.float32(table_z + clearance)) + np.float32(tips))


# ---------- grasp_pose


def grasp_pose_cross(position, yaw):
    return pose(np.cross(unit(yaw), DOWN), unit(yaw), DOWN, position)


def grasp_pose_other_way_round(position, yaw):
    return grasp_pose_cross(position, yaw + np.pi)


def grasp_pose_product(position, yaw):
    c, s = np.cos(yaw - np.pi / 2), np.sin(yaw - np.pi / 2)
    T_base_turned, T_turned_grasp = np.eye(4), np.diag([-1.0, 1.0, -1.0, 1.0])
    T_base_turned[:2, :2], T_base_turned[:3, 3] = [[c, -s], [s, c]], position
    return T_base_turned @ T_turned_grasp


def grasp_pose_loops(position, yaw):
    T = [[0.0] * 4 for _ in range(4)]
    columns = (np.cross(unit(yaw), DOWN), unit(yaw), DOWN, position)
    for j, column in enumerate(columns):
        for i in range(3):
            T[i][j] = float(column[i])
    T[3][3] = 1.0
    return np.array(T)


def grasp_pose_torch(position, yaw):
    import torch

    y, z = torch.from_numpy(unit(yaw)), torch.from_numpy(DOWN)
    T = torch.eye(4, dtype=torch.float64)
    T[:3, 0], T[:3, 1], T[:3, 2], T[:3, 3] = torch.linalg.cross(y, z), y, z, torch.as_tensor(position)
    return T


def grasp_pose_float32(position, yaw):
    return grasp_pose_cross(position, yaw).astype(np.float32)


# ---------- points_in_fingers


def points_by_inverse(P, T_base_grasp, *boxes):
    return in_boxes(*moved(P, np.linalg.inv(T_base_grasp)), *boxes)


def points_loops(P, T_base_grasp, width, half, thickness, tips):
    count = 0
    for p in P:
        x, y, z = (float(np.dot(T_base_grasp[:3, k], p - T_base_grasp[:3, 3])) for k in range(3))
        count += abs(x) <= half and width / 2 <= abs(y) <= width / 2 + thickness and z <= tips
    return count


def points_einsum(P, T_base_grasp, *boxes):
    x, y, z = np.einsum("ik,ni->kn", T_base_grasp[:3, :3], P - T_base_grasp[:3, 3])
    return in_boxes(x, y, z, *boxes)


def points_float32(P, T_base_grasp, *boxes):
    R, t = T_base_grasp[:3, :3].astype(np.float32), T_base_grasp[:3, 3]
    return in_boxes(*((P - t).astype(np.float32) @ R).T, *boxes)


ALTERNATIVES = {
    "centroid_and_covariance": (centroid_loops, centroid_einsum, centroid_torch, centroid_float32, centroid_numpy_cov),
    "closing_yaw": (
        closing_yaw_formula,
        closing_yaw_svd,
        closing_yaw_across_the_long_axis,
        closing_yaw_loop,
        closing_yaw_torch,
        closing_yaw_float32,
    ),
    "width_across": (width_loops, width_einsum, width_torch, width_float32),
    "grasp_height": (height_with, height_loops, height_torch, height_float32),
    "grasp_pose": (
        grasp_pose_cross,
        grasp_pose_other_way_round,
        grasp_pose_product,
        grasp_pose_loops,
        grasp_pose_torch,
        grasp_pose_float32,
    ),
    "points_in_fingers": (points_by_inverse, points_loops, points_einsum, points_float32),
}
