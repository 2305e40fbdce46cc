"""Right answers to the questions of 07_grasp, written in other ways than the references."""

import numpy as np

from labkit.course.topics.t07_grasp.grasp_pose import pose, unit
from labkit.course.topics.t07_grasp.pad_slice import in_grasp, middle_and_width
from labkit.course.topics.t07_grasp.points_in_fingers import in_boxes


def closing_yaw__across_the_long_axis(Sigma):
    x, y = np.linalg.eigh(Sigma[:2, :2])[1][:, -1]
    return np.arctan2(y, x) - np.pi / 2


def closing_yaw__torch(Sigma):
    import torch

    _, axes = torch.linalg.eigh(torch.as_tensor(Sigma[:2, :2]))
    return torch.atan2(axes[1, 0], axes[0, 0])


def closing_yaw__float32(Sigma):
    _, axes = np.linalg.eigh(Sigma[:2, :2].astype(np.float32))
    return np.arctan2(axes[1, 0], axes[0, 0])


def closing_yaw__formula(Sigma):
    long = 0.5 * np.arctan2(2.0 * Sigma[0, 1], Sigma[0, 0] - Sigma[1, 1])
    return (long + np.pi / 2) % np.pi


def grasp_height__torch(P, table_z, palm, tips, clearance):
    import torch

    z = torch.as_tensor(P[:, 2])
    bounds = torch.stack([z.max() - palm, z.min(), torch.tensor(table_z + clearance, dtype=z.dtype)])
    return bounds.max() + tips


def grasp_height__float32(P, table_z, palm, tips, clearance):
    z = P[:, 2].astype(np.float32)
    return np.float32(max(z.max() - np.float32(palm), z.min(), np.float32(table_z + clearance)) + np.float32(tips))


def grasp_pose__crossed(position, approach, closing):
    x = unit(np.cross(closing, approach))
    return pose(x, np.cross(unit(approach), x), unit(approach), position)


def grasp_pose__other_way_round(position, approach, closing):
    return grasp_pose__crossed(position, approach, -closing)


def grasp_pose__torch(position, approach, closing):
    import torch

    z, y = (torch.from_numpy(np.ascontiguousarray(v)) for v in (approach, closing))
    z = z / z.norm()
    y = y - torch.dot(y, z) * z
    y = y / y.norm()
    T = torch.eye(4, dtype=torch.float64)
    T[:3, 0], T[:3, 1], T[:3, 2], T[:3, 3] = torch.linalg.cross(y, z), y, z, torch.as_tensor(position)
    return T


def grasp_pose__float32(position, approach, closing):
    return grasp_pose__crossed(position, approach, closing).astype(np.float32)


def pad_slice__float32(P, T_base_grasp, half):
    x, y, _ = in_grasp(P, T_base_grasp).astype(np.float32)
    return middle_and_width(y[np.abs(x) <= np.float32(half)])


def pad_slice__by_inverse(P, T_base_grasp, half):
    homogeneous = np.column_stack([P, np.ones(len(P))]) @ np.linalg.inv(T_base_grasp).T
    return middle_and_width(homogeneous[np.abs(homogeneous[:, 0]) <= half, 1])


def points_in_fingers__float32(P, T_base_grasp, *boxes):
    R, t = T_base_grasp[:3, :3].astype(np.float32), T_base_grasp[:3, 3]
    return in_boxes(*((P - t).astype(np.float32) @ R).T, *boxes)


def points_in_fingers__loops(P, T_base_grasp, width, half, thickness, tips):
    count = 0
    for p in P:
        x, y, z = (float(np.dot(T_base_grasp[:3, k], p - T_base_grasp[:3, 3])) for k in range(3))
        count += abs(x) <= half and width / 2 <= abs(y) <= width / 2 + thickness and z <= tips
    return count


def slip_across__torch(T_base_grasp, middle):
    import torch

    T = torch.from_numpy(T_base_grasp)
    x, y, _ = torch.linalg.solve(T[:3, :3], torch.from_numpy(np.asarray(middle)) - T[:3, 3])
    return 1000.0 * y.abs(), 1000.0 * x.abs()


def slip_across__by_products(T_base_grasp, middle):
    off = middle - T_base_grasp[:3, 3]
    return tuple(1000.0 * abs(sum(off[i] * T_base_grasp[i, k] for i in range(3))) for k in (1, 0))
