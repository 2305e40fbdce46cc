"""Right answers to the questions of 07_grasp, written in other ways than the references."""

import numpy as np

from labkit.course.topics.t07_grasp.grasp_pose import pose, unit
from labkit.course.topics.t07_grasp.pad_slice import in_grasp, middle_and_width
from labkit.course.topics.t07_grasp.points_in_fingers import in_boxes


def closing_yaw__across_the_long_axis(Sigma):
    x, y = np.linalg.eigh(Sigma[:2, :2])[1][:, -1]
    return np.arctan2(y, x) - np.pi / 2


def closing_yaw__svd(Sigma):
    axes, _, _ = np.linalg.svd(Sigma[:2, :2])
    return float(np.arctan2(*axes[::-1, -1]))


def closing_yaw__torch(Sigma):
    import torch

    _, axes = torch.linalg.eigh(torch.as_tensor(Sigma[:2, :2]))
    return torch.atan2(axes[1, 0], axes[0, 0])


def closing_yaw__float32(Sigma):
    _, axes = np.linalg.eigh(Sigma[:2, :2].astype(np.float32))
    return np.arctan2(axes[1, 0], axes[0, 0])


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


def slip_across__torch(T_base_grasp, middle):
    import torch

    T = torch.from_numpy(T_base_grasp)
    x, y, _ = torch.linalg.solve(T[:3, :3], torch.from_numpy(np.asarray(middle)) - T[:3, 3])
    return 1000.0 * y.abs(), 1000.0 * x.abs()


def points_in_fingers__einsum(P, T_base_grasp, *boxes):
    x, y, z = np.einsum("ik,ni->kn", T_base_grasp[:3, :3], P - T_base_grasp[:3, 3])
    return in_boxes(x, y, z, *boxes)


def points_in_fingers__float32(P, T_base_grasp, *boxes):
    R, t = T_base_grasp[:3, :3].astype(np.float32), T_base_grasp[:3, 3]
    return in_boxes(*((P - t).astype(np.float32) @ R).T, *boxes)
