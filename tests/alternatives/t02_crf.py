"""Right answers to the questions of 02_crf, written in other ways than the references."""

import numpy as np
import torch


def unary_from_probabilities__torch(p, floor):
    """Clamp, then take the logarithm, in torch."""
    return -torch.log(torch.clamp(torch.as_tensor(p), min=floor)).numpy()


def unary_from_probabilities__float32(p, floor):
    """In single precision, and with the cost cut off instead of the probability."""
    return np.minimum(-np.log(np.maximum(p.astype(np.float32), 1e-30)), np.float32(-np.log(floor)))


STEPS = ((0, 1), (1, 0), (1, 1), (1, -1))


def pair_weights__torch(image, lam, sigma_I, sigma_p):
    """In single precision."""
    x = torch.from_numpy(image.astype(np.float32))
    w = torch.zeros(4, *image.shape[:2])
    for d, (p, q) in enumerate(
        (
            (np.s_[:, :-1], np.s_[:, 1:]),
            (np.s_[:-1], np.s_[1:]),
            (np.s_[:-1, :-1], np.s_[1:, 1:]),
            (np.s_[:-1, 1:], np.s_[1:, :-1]),
        )
    ):
        squared = (x[p] - x[q]).pow(2).sum(dim=2)
        w[d][p] = lam * torch.exp(-squared / (2 * sigma_I**2) - (1 + (d > 1)) / (2 * sigma_p**2))
    return w.numpy()


def energy__loops(y, psi, weights):
    """Pixel by pixel; each asks the neighbours whose pairs it owns."""
    total = 0.0
    for v, u in np.ndindex(*y.shape):
        total += psi[v, u, y[v, u]]
        for d, (down, right) in enumerate(STEPS):
            if v + down < y.shape[0] and 0 <= u + right < y.shape[1] and y[v, u] != y[v + down, u + right]:
                total += weights[d, v, u]
    return total


def energy__torch(y, psi, weights):
    """In torch, with slices."""
    y, psi, w = torch.as_tensor(y.astype(np.int64)), torch.as_tensor(psi), torch.as_tensor(weights)
    total = psi.gather(2, y[..., None]).sum()
    total += w[0, :, :-1][y[:, 1:] != y[:, :-1]].sum() + w[1, :-1][y[1:] != y[:-1]].sum()
    total += w[2, :-1, :-1][y[1:, 1:] != y[:-1, :-1]].sum() + w[3, :-1, 1:][y[1:, :-1] != y[:-1, 1:]].sum()
    return float(total)


def energy__float32(y, psi, weights):
    """In single precision."""
    unary = np.take_along_axis(psi.astype(np.float32), y[..., None].astype(int), axis=2).sum()
    labels = np.pad(y.astype(int), ((0, 1), (1, 1)), constant_values=-1)
    H, W = y.shape
    near = np.stack([labels[down : H + down, 1 + right : W + 1 + right] for down, right in STEPS])
    return unary + (weights.astype(np.float32) * (near != y)).sum()


def icm_costs__by_energies(y, psi, weights, v, u):
    """The whole energy with each class at the pixel, less what does not touch the pixel."""
    costs, rest = [], weights.copy()
    rest[:, v, u] = 0.0
    for d, (down, right) in enumerate(STEPS):
        if v >= down and 0 <= u - right < y.shape[1]:
            rest[d, v - down, u - right] = 0.0
    for c in range(psi.shape[2]):
        changed = y.copy()
        changed[v, u] = c
        costs.append(energy__loops(changed, psi, weights))
    return np.array(costs) - (energy__loops(y, psi, rest) - psi[v, u, y[v, u]])


def terminal_capacities__torch(psi):
    """In torch."""
    psi = torch.as_tensor(psi)
    lowest = psi.amin(dim=2, keepdim=True)
    excess = psi - lowest
    return excess[..., 1].numpy(), excess[..., 0].numpy(), float(lowest.sum())


def row_labels__enumerated(psi, w):
    """All C^n labellings of the row."""
    n, C = psi.shape
    y = np.indices((C,) * n, dtype=np.int8).reshape(n, -1)
    costs = psi[np.arange(n)[:, None], y].sum(axis=0) + (w[:, None] * (y[1:] != y[:-1])).sum(axis=0)
    return y[:, costs.argmin()]
