"""Right answers to the questions of 07_grasp, written in other ways than the references."""

import numpy as np

from labcourse.questions.t07_grasp.grasp_pose import pose, unit


def closing_yaw__across_the_long_axis(Sigma, now):
    x, y = np.linalg.eigh(Sigma[:2, :2])[1][:, -1]
    across = np.arctan2(y, x) - np.pi / 2
    return min((across + k * np.pi for k in range(-400, 401)), key=lambda yaw: abs(yaw - now))


def closing_yaw__torch(Sigma, now):
    import torch

    _, axes = torch.linalg.eigh(torch.as_tensor(Sigma[:2, :2]))
    return now + torch.atan(torch.tan(torch.atan2(axes[1, 0], axes[0, 0]) - now))


def grasp_pose__crossed(position, approach, closing):
    x = unit(np.cross(closing, approach))
    return pose(x, np.cross(unit(approach), x), unit(approach), position)


def grasp_pose__other_way_round(position, approach, closing):
    return grasp_pose__crossed(position, approach, -closing)


def slip_across__torch(T_base_grasp, middle):
    import torch

    T = torch.from_numpy(T_base_grasp)
    x, y, _ = torch.linalg.solve(T[:3, :3], torch.from_numpy(np.asarray(middle)) - T[:3, 3])
    return 1000.0 * y.abs(), 1000.0 * x.abs()
