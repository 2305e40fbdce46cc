"""Answers to topic 07's questions about the cloud: wrong ones as students give them, right ones in other ways."""

import numpy as np

# ------------------------------------------------------------------------------------------ centroid and covariance


def covariance_of_a_sample(P):
    return P.mean(axis=0), np.cov(P, rowvar=False)


def covariance_of_columns_as_samples(P):
    return P.mean(axis=0), np.cov(P, bias=True)


def not_centred(P):
    return P.mean(axis=0), P.T @ P / len(P)


def not_divided(P):
    centred = P - P.mean(axis=0)
    return P.mean(axis=0), centred.T @ centred


def spreads_alone(P):
    return P.mean(axis=0), np.diag(P.var(axis=0))


def median_for_mean(P):
    centred = P - np.median(P, axis=0)
    return np.median(P, axis=0), centred.T @ centred / len(P)


def one_mean_for_all(P):
    centred = P - P.mean()
    return np.full(3, P.mean()), centred.T @ centred / len(P)


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


# -------------------------------------------------------------------------------------------------- the closing yaw


def yaw_of(axis):
    return np.arctan2(axis[1], axis[0])


def along_the_long_side(Sigma):
    return yaw_of(np.linalg.eigh(Sigma[:2, :2])[1][:, 1])


def axes_as_rows(Sigma):
    return yaw_of(np.linalg.eigh(Sigma)[1][0])


def order_of_eig(Sigma):
    return yaw_of(np.linalg.eig(Sigma[:2, :2])[1][:, 0])


def least_of_three(Sigma):
    return yaw_of(np.linalg.eigh(Sigma)[1][:, 0])


def middle_of_three(Sigma):
    return yaw_of(np.linalg.eigh(Sigma)[1][:, 1])


def yaw_with_x_and_y_swapped(Sigma):
    x, y = np.linalg.eigh(Sigma[:2, :2])[1][:, 0]
    return np.arctan2(x, y)


def yaw_in_degrees(Sigma):
    return np.degrees(closing_yaw_formula(Sigma))


def double_angle_not_halved(Sigma):
    return np.arctan2(2.0 * Sigma[0, 1], Sigma[0, 0] - Sigma[1, 1]) + np.pi / 2


def variances_as_a_direction(Sigma):
    return np.arctan2(Sigma[1, 1], Sigma[0, 0]) + np.pi / 2


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


# ----------------------------------------------------------------------------------------------- width across the jaws


def extent(values):
    return values.max() - values.min()


def width_along(P, yaw):
    return extent(P[:, 1] * np.cos(yaw) - P[:, 0] * np.sin(yaw))


def width_turned_the_other_way(P, yaw):
    return extent(P[:, 0] * np.cos(yaw) - P[:, 1] * np.sin(yaw))


def width_in_degrees(P, yaw):
    return extent(P[:, 0] * np.cos(np.radians(yaw)) + P[:, 1] * np.sin(np.radians(yaw)))


def width_without_turning(P, yaw):
    return max(extent(P[:, 0]), extent(P[:, 1]))


def width_by_sigma(P, yaw):
    return 4.0 * (P[:, 0] * np.cos(yaw) + P[:, 1] * np.sin(yaw)).std()


def twice_the_furthest(P, yaw):
    across = P[:, 0] * np.cos(yaw) + P[:, 1] * np.sin(yaw)
    return 2.0 * np.abs(across - across.mean()).max()


def furthest_coordinate(P, yaw):
    return (P[:, 0] * np.cos(yaw) + P[:, 1] * np.sin(yaw)).max()


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
