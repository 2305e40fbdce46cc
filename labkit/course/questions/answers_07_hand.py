"""Answers to topic 07's questions about the hand: wrong ones as students give them, right ones in other ways."""

import numpy as np

# ------------------------------------------------------------------------------------------------- the grasp's height


def height_of_centroid(P, table_z, palm, tips, clearance):
    return P[:, 2].mean()


def height_of_tips(P, table_z, palm, tips, clearance):
    return height_with(P, table_z, palm, 0.0, clearance)


def tips_taken_off(P, table_z, palm, tips, clearance):
    return height_with(P, table_z, palm, -tips, clearance)


def table_at_zero(P, table_z, palm, tips, clearance):
    return height_with(P, 0.0, palm, tips, clearance)


def palm_forgotten(P, table_z, palm, tips, clearance):
    return max(P[:, 2].min(), table_z + clearance) + tips


def unseen_depth(P, table_z, palm, tips, clearance):
    return max(P[:, 2].max() - palm, table_z + clearance) + tips


def least_of_the_bounds(P, table_z, palm, tips, clearance):
    return min(P[:, 2].max() - palm, P[:, 2].min(), table_z + clearance) + tips


def clearance_forgotten(P, table_z, palm, tips, clearance):
    return height_with(P, table_z, palm, tips, 0.0)


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


# ---------------------------------------------------------------------------------------------------- the grasp frame


def pose(x, y, z, origin):
    T = np.eye(4)
    T[:3] = np.column_stack([x, y, z, origin])
    return T


def unit(yaw):
    return np.array([np.cos(yaw), np.sin(yaw), 0.0])


DOWN = np.array([0.0, 0.0, -1.0])


def left_handed_pose(position, yaw):
    return pose(np.cross(DOWN, unit(yaw)), unit(yaw), DOWN, position)


def approach_from_below(position, yaw):
    return pose(np.cross(unit(yaw), -DOWN), unit(yaw), -DOWN, position)


def closing_along_x(position, yaw):
    return pose(unit(yaw), np.cross(DOWN, unit(yaw)), DOWN, position)


def yaw_the_other_way(position, yaw):
    return grasp_pose_cross(position, -yaw)


def yaw_as_degrees(position, yaw):
    return grasp_pose_cross(position, np.radians(yaw))


def position_in_the_last_row(position, yaw):
    T = grasp_pose_cross(np.zeros(3), yaw)
    T[3, :3] = position
    return T


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


# ---------------------------------------------------------------------------------------- points where the fingers go


def in_boxes(x, y, z, width, half, thickness, tips):
    out = np.abs(y) - width / 2
    return int(np.count_nonzero((np.abs(x) <= half) & (out >= 0.0) & (out <= thickness) & (z <= tips)))


def moved(P, T):
    return (P @ T[:3, :3].T + T[:3, 3]).T


def transform_not_inverted(P, T_base_grasp, *boxes):
    return in_boxes(*moved(P, T_base_grasp), *boxes)


def translated_only(P, T_base_grasp, *boxes):
    return in_boxes(*(P - T_base_grasp[:3, 3]).T, *boxes)


def below_the_tips_too(P, T_base_grasp, width, half, thickness, tips):
    return points_by_inverse(P, T_base_grasp, width, half, thickness, np.inf)


def below_the_tips_alone(P, T_base_grasp, width, half, thickness, tips):
    x, y, z = moved(P, np.linalg.inv(T_base_grasp))
    return in_boxes(x, y, -z, width, half, thickness, -tips)


def one_finger(P, T_base_grasp, width, half, thickness, tips):
    x, y, z = moved(P, np.linalg.inv(T_base_grasp))
    return in_boxes(x, np.maximum(y, 0.0), z, width, half, thickness, tips)


def between_the_pads_too(P, T_base_grasp, width, half, thickness, tips):
    x, y, z = moved(P, np.linalg.inv(T_base_grasp))
    inside = (np.abs(x) <= half) & (np.abs(y) <= width / 2 + thickness) & (z <= tips)
    return int(inside.sum())


def pads_at_the_whole_width(P, T_base_grasp, width, half, thickness, tips):
    return points_by_inverse(P, T_base_grasp, 2.0 * width, half, thickness, tips)


def closing_axis_taken_for_x(P, T_base_grasp, width, half, thickness, tips):
    x, y, z = moved(P, np.linalg.inv(T_base_grasp))
    return in_boxes(y, x, z, width, half, thickness, tips)


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


def points_torch(P, T_base_grasp, width, half, thickness, tips):
    import torch

    T = torch.as_tensor(T_base_grasp)
    x, y, z = ((torch.as_tensor(P) - T[:3, 3]) @ T[:3, :3]).T
    out = y.abs() - width / 2
    return ((x.abs() <= half) & (out >= 0) & (out <= thickness) & (z <= tips)).sum()


def points_float32(P, T_base_grasp, *boxes):
    R, t = T_base_grasp[:3, :3].astype(np.float32), T_base_grasp[:3, 3]
    return in_boxes(*((P - t).astype(np.float32) @ R).T, *boxes)
