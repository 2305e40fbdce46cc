"""Right answers to the questions of 06_back_projection, written in other ways than the references."""

import numpy as np

from labkit.course.questions.t06_back_projection import columns
from labkit.course.questions.t06_back_projection.back_project import holes, rays

# ---------- intrinsics


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


# ---------- back_project


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


# ---------- transform_points


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


# ---------- back_projection_jacobian


def jacobian_closed_form(u, v, d, K):
    return np.stack(columns(u, v, d, K), axis=1)


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


# ---------- height_noise


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


ALTERNATIVES = {
    "intrinsics": (intrinsics_product, intrinsics_float32, intrinsics_torch),
    "back_project": (back_project_closed_form, back_project_loops, back_project_einsum, back_project_torch),
    "transform_points": (transform_homogeneous, transform_einsum, transform_loops, transform_torch),
    "back_projection_jacobian": (jacobian_closed_form, jacobian_differences, jacobian_torch, jacobian_float32),
    "height_noise": (height_noise_covariance, height_noise_loops, height_noise_einsum, height_noise_torch),
}
