"""Right answers to the questions of 06_back_projection, written in other ways than the references."""

import numpy as np

from labkit.course.topics.t06_back_projection import columns


def back_project__einsum(depth, K):
    H, W = depth.shape
    pixels = np.stack([*np.meshgrid(np.arange(W), np.arange(H)), np.ones((H, W))])
    P = np.einsum("hw,ij,jhw->hwi", np.nan_to_num(depth), np.linalg.inv(K), pixels)
    P[~(depth > 0.0)] = np.nan
    return P


def back_project__torch(depth, K):
    import torch

    depth, K = torch.as_tensor(depth, dtype=torch.float32), torch.as_tensor(K, dtype=torch.float32)
    v, u = torch.meshgrid(*(torch.arange(n, dtype=torch.float32) for n in depth.shape), indexing="ij")
    z = torch.where(depth > 0, depth, torch.nan)
    return torch.stack([z * (u - K[0, 2]) / K[0, 0], z * (v - K[1, 2]) / K[1, 1], z], dim=-1).numpy()


def cropped_intrinsics__torch(K, left, top, scale):
    import torch

    K = torch.from_numpy(K)
    corner = torch.tensor([left - 0.5, top - 0.5], dtype=torch.float64)
    new = torch.eye(3, dtype=torch.float64)
    new[:2, :2], new[:2, 2] = scale * K[:2, :2], scale * (K[:2, 2] - corner) - 0.5
    return new


def cropped_intrinsics__by_steps(K, left, top, scale):
    def shift(right, down):
        return np.array([[1.0, 0.0, right], [0.0, 1.0, down], [0.0, 0.0, 1.0]])

    return shift(-0.5, -0.5) @ np.diag([scale, scale, 1.0]) @ shift(0.5 - left, 0.5 - top) @ K


def fit_plane__svd(P, sigma):
    centre = np.average(P, axis=0, weights=sigma**-2.0)
    n = np.linalg.svd((P - centre) / sigma[:, None], full_matrices=False)[2][2]
    n = n if n[2] > 0 else -n
    return n, float(n @ centre)


def fit_plane__torch(P, sigma):
    import torch

    P, w = torch.from_numpy(P), torch.from_numpy(sigma) ** -2
    centre = (w[:, None] * P).sum(0) / w.sum()
    Q = P - centre
    normal = torch.linalg.eigh(Q.T @ (w[:, None] * Q)).eigenvectors[:, 0]
    normal = normal if normal[2] > 0 else -normal
    return normal.numpy(), torch.dot(normal, centre).item()


def height_noise__torch(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth):
    import torch

    x = torch.tensor([u, v, d], dtype=torch.float64, requires_grad=True)
    K_inv, r = torch.linalg.inv(torch.as_tensor(K).double()), torch.as_tensor(T_base_cam[2, :3]).double()
    (r @ (x[2] * K_inv @ torch.stack([x[0], x[1], torch.ones_like(x[0])]))).backward()
    return (x.grad * torch.tensor([sigma_pixel, sigma_pixel, sigma_depth], dtype=torch.float64)).norm().item()


def height_noise__covariance(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth):
    J = T_base_cam[:3, :3] @ np.stack(columns(u, v, d, K), axis=1)
    Sigma = J @ np.diag([sigma_pixel**2, sigma_pixel**2, sigma_depth**2]) @ J.T
    return float(np.sqrt(Sigma[2, 2]))


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


def undistort__newton(pixels, K, k):
    f, c = np.array([K[0, 0], K[1, 1]]), np.array([K[0, 2], K[1, 2]])
    x = (pixels - c) / f
    seen = np.hypot(*x.T)
    r = seen.copy()
    for _ in range(20):
        r -= (r + k[0] * r**3 + k[1] * r**5 - seen) / (1 + 3 * k[0] * r**2 + 5 * k[1] * r**4)
    return c + f * x * np.where(seen > 0, r / np.where(seen > 0, seen, 1), 1)[:, None]
