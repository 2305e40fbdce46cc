"""Answers to topic 06's questions: wrong ones as students give them, and right ones written in other ways."""

import numpy as np

# ------------------------------------------------------------------------------------------ K by hand


def focal_length(fov, pixels):
    return pixels / (2.0 * np.tan(fov / 2.0))


def K_of(fx, fy, cx, cy):
    return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])


def with_centre(fov_y, width, height, cx, cy):
    f = focal_length(fov_y, height)
    return K_of(f, f, cx, cy)


def horizontal_field_of_view(fov_y, width, height):
    f = focal_length(fov_y, width)
    return K_of(f, f, width / 2.0, height / 2.0 - 1.0)


def two_focal_lengths(fov_y, width, height):
    return K_of(focal_length(fov_y, width), focal_length(fov_y, height), width / 2.0, height / 2.0 - 1.0)


def whole_angle(fov_y, width, height):
    f = height / (2.0 * np.tan(fov_y))
    return K_of(f, f, width / 2.0, height / 2.0 - 1.0)


def intrinsics_product(fov_y, width, height):
    f = 0.5 * height / np.tan(0.5 * fov_y)
    centre = np.eye(3)
    centre[:2, 2] = 0.5 * width, 0.5 * height - 1.0
    return centre @ np.diag([f, f, 1.0])


def intrinsics_float32(fov_y, width, height):
    K = np.eye(3, dtype=np.float32)
    K[0, 0] = K[1, 1] = np.float32(height) / (2 * np.sin(fov_y / 2) / np.cos(fov_y / 2))
    K[0, 2], K[1, 2] = width / 2, (height - 2) / 2
    return K


def intrinsics_torch(fov_y, width, height):
    import torch

    f = height / (2.0 * torch.tan(torch.tensor(fov_y / 2.0)))
    return torch.diag(torch.stack([f, f, torch.tensor(1.0)])) + torch.tensor(
        [[0.0, 0.0, width / 2.0], [0.0, 0.0, height / 2.0 - 1.0], [0.0, 0.0, 0.0]]
    )


# ------------------------------------------------------------------------------------------ back-projection


def rays(shape, K, offset=0.0):
    """Give q(u, v) for every pixel of an image; offset is added to both pixel coordinates."""
    v, u = np.mgrid[: shape[0], : shape[1]] + offset
    return np.dstack([(u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1], np.ones(shape)])


def holes(depth):
    return np.where(depth > 0.0, depth, np.nan)[..., None]


def u_is_the_row(depth, K):
    u, v = np.mgrid[: depth.shape[0], : depth.shape[1]]
    q = np.dstack([(u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1], np.ones(depth.shape)])
    return holes(depth) * q


def length_of_the_ray(depth, K):
    q = rays(depth.shape, K)
    return holes(depth) * q / np.linalg.norm(q, axis=-1, keepdims=True)


def centres_at_halves(depth, K):
    return holes(depth) * rays(depth.shape, K, 0.5)


def holes_at_the_camera(depth, K):
    return np.nan_to_num(holes(depth)) * rays(depth.shape, K)


def K_not_inverted(depth, K):
    v, u = np.mgrid[: depth.shape[0], : depth.shape[1]]
    return holes(depth) * (np.dstack([u, v, np.ones(depth.shape)]) @ K.T)


def one_focal_length(depth, K):
    return back_project_closed_form(depth, K_of(K[0, 0], K[0, 0], K[0, 2], K[1, 2]))


def opengl_axes(depth, K):
    return back_project_closed_form(depth, K) * (1.0, -1.0, -1.0)


def reshaped(depth, K):
    return np.moveaxis(back_project_closed_form(depth, K), -1, 0).reshape(*depth.shape, 3)


def back_project_closed_form(depth, K):
    return holes(depth) * rays(depth.shape, K)


def back_project_loops(depth, K):
    P = np.full((*depth.shape, 3), np.nan)
    K_inv = np.linalg.inv(K)
    for v in range(depth.shape[0]):
        for u in range(depth.shape[1]):
            if depth[v, u] > 0.0:
                P[v, u] = depth[v, u] * K_inv @ np.array([u, v, 1.0])
    return P


def back_project_einsum(depth, K):
    H, W = depth.shape
    pixels = np.stack([*np.meshgrid(np.arange(W), np.arange(H)), np.ones((H, W))])
    P = np.einsum("hw,ij,jhw->hwi", np.nan_to_num(depth), np.linalg.inv(K), pixels)
    P[~(depth > 0.0)] = np.nan
    return P


def back_project_torch(depth, K):
    import torch

    depth, K = torch.as_tensor(depth, dtype=torch.float32), torch.as_tensor(K, dtype=torch.float32)
    v, u = torch.meshgrid(*(torch.arange(n, dtype=torch.float32) for n in depth.shape), indexing="ij")
    z = torch.where(depth > 0, depth, torch.nan)
    return torch.stack([z * (u - K[0, 2]) / K[0, 0], z * (v - K[1, 2]) / K[1, 1], z], dim=-1).numpy()


# ------------------------------------------------------------------------------------------ rigid transforms


def rotation_transposed(T, P):
    return P @ T[:3, :3] + T[:3, 3]


def no_translation(T, P):
    return P @ T[:3, :3].T


def translated_first(T, P):
    return (P + T[:3, 3]) @ T[:3, :3].T


def inverse(T, P):
    return (P - T[:3, 3]) @ T[:3, :3]


def row_major(T, P):
    """Read T as if its rows were its columns: the rotation is turned round and the translation is lost."""
    return P @ T[:3, :3] + T[3, :3]


def translation_subtracted(T, P):
    return P @ T[:3, :3].T - T[:3, 3]


def transform_homogeneous(T, P):
    P_h = np.concatenate([P, np.ones_like(P[..., :1])], axis=-1)
    return (T @ P_h.reshape(-1, 4).T).T[:, :3].reshape(P.shape)


def transform_einsum(T, P):
    return np.einsum("ij,...j->...i", T[:3, :3], P) + T[:3, 3]


def transform_loops(T, P):
    out = np.empty_like(P)
    for place in np.ndindex(P.shape[:-1]):
        for i in range(3):
            out[place][i] = sum(T[i, j] * P[place][j] for j in range(3)) + T[i, 3]
    return out


def transform_torch(T, P):
    import torch

    T, P = torch.as_tensor(T), torch.as_tensor(P)
    return (P @ T[:3, :3].mT + T[:3, 3]).float()


# ------------------------------------------------------------------------------------------ the Jacobian


def columns(u, v, d, K):
    """Give dP/du, dP/dv and dP/dd."""
    fx, fy, cx, cy = K[0, 0], K[1, 1], K[0, 2], K[1, 2]
    q = np.array([(u - cx) / fx, (v - cy) / fy, 1.0])
    return np.array([d / fx, 0.0, 0.0]), np.array([0.0, d / fy, 0.0]), q


def jacobian_closed_form(u, v, d, K):
    return np.stack(columns(u, v, d, K), axis=1)


def depth_first(u, v, d, K):
    du, dv, dd = columns(u, v, d, K)
    return np.stack([dd, du, dv], axis=1)


def without_depth(u, v, d, K):
    return np.stack([*columns(u, v, 1.0, K)[:2], columns(u, v, d, K)[2]], axis=1)


def depth_times_ray(u, v, d, K):
    du, dv, dd = columns(u, v, d, K)
    return np.stack([du, dv, d * dd], axis=1)


def unit_ray(u, v, d, K):
    du, dv, dd = columns(u, v, d, K)
    return np.stack([du, dv, dd / np.linalg.norm(dd)], axis=1)


def times_K(u, v, d, K):
    return np.column_stack([d * K[:, 0], d * K[:, 1], K @ (u, v, 1.0)])


def straight_ahead(u, v, d, K):
    du, dv, _ = columns(u, v, d, K)
    return np.stack([du, dv, np.array([0.0, 0.0, 1.0])], axis=1)


def jacobian_differences(u, v, d, K):
    def P(x):
        return x[2] * np.linalg.solve(K, np.array([x[0], x[1], 1.0]))

    x = np.array([u, v, d], np.float64)
    steps = np.eye(3) * (0.5, 0.5, 1e-3)
    return np.stack([(P(x + h) - P(x - h)) / (2.0 * h.sum()) for h in steps], axis=1)


def jacobian_torch(u, v, d, K):
    import torch

    K_inv = torch.linalg.inv(torch.as_tensor(K, dtype=torch.float64))
    x = torch.tensor([u, v, d], dtype=torch.float64)
    return torch.autograd.functional.jacobian(lambda x: x[2] * K_inv @ torch.stack([x[0], x[1], x[0] * 0 + 1]), x)


def jacobian_float32(u, v, d, K):
    K_inv = np.linalg.inv(K.astype(np.float32))
    return np.concatenate([d * K_inv[:, :2], K_inv @ np.array([[u], [v], [1.0]], np.float32)], axis=1)


# ------------------------------------------------------------------------------------------ noise of the height


def shares(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth):
    """Give how far u, v and d each move the height, one standard deviation."""
    J = jacobian_closed_form(u, v, d, K)
    return T_base_cam[2, :3] @ J * np.array([sigma_pixel, sigma_pixel, sigma_depth])


def variance(*arguments):
    return np.sum(shares(*arguments) ** 2)


def stds_added(*arguments):
    return np.sum(np.abs(shares(*arguments)))


def signed_stds_added(*arguments):
    return np.abs(np.sum(shares(*arguments)))


def along_the_camera(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth):
    return shares(u, v, d, K, np.eye(4), sigma_pixel, sigma_depth)[2]


def column_of_the_rotation(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth):
    return np.linalg.norm(shares(u, v, d, K, T_base_cam.T, sigma_pixel, sigma_depth))


def depth_only(*arguments):
    return np.abs(shares(*arguments)[2])


def ray_straight_ahead(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth):
    J = straight_ahead(u, v, d, K)
    return np.linalg.norm(T_base_cam[2, :3] @ J * np.array([sigma_pixel, sigma_pixel, sigma_depth]))


def all_directions(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth):
    J = jacobian_closed_form(u, v, d, K)
    return np.linalg.norm(J * (sigma_pixel, sigma_pixel, sigma_depth))


def height_noise_covariance(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth):
    J = T_base_cam[:3, :3] @ jacobian_closed_form(u, v, d, K)
    Sigma = J @ np.diag([sigma_pixel**2, sigma_pixel**2, sigma_depth**2]) @ J.T
    return float(np.sqrt(Sigma[2, 2]))


def height_noise_loops(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth):
    total = 0.0
    for column, sigma in zip(columns(u, v, d, K), (sigma_pixel, sigma_pixel, sigma_depth), strict=True):
        total += (sum(T_base_cam[2, i] * column[i] for i in range(3)) * sigma) ** 2
    return total**0.5


def height_noise_einsum(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth):
    J = jacobian_closed_form(u, v, d, K)
    r, sigma = T_base_cam[2, :3], np.array([sigma_pixel, sigma_pixel, sigma_depth])
    return np.sqrt(np.einsum("i,ij,j,kj,k->", r, J, sigma**2, J, r))


def height_noise_torch(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth):
    import torch

    x = torch.tensor([u, v, d], dtype=torch.float64, requires_grad=True)
    K_inv, r = torch.linalg.inv(torch.as_tensor(K).double()), torch.as_tensor(T_base_cam[2, :3]).double()
    (r @ (x[2] * K_inv @ torch.stack([x[0], x[1], torch.ones_like(x[0])]))).backward()
    return (x.grad * torch.tensor([sigma_pixel, sigma_pixel, sigma_depth], dtype=torch.float64)).norm().item()
