"""Right answers to the questions of 02_crf, written in other ways than the references."""

import numpy as np
import torch

# ---------- unary_from_probabilities


def unary_torch(p, floor):
    """Clamp, then take the logarithm, in torch."""
    return -torch.log(torch.clamp(torch.as_tensor(p), min=floor)).numpy()


def unary_loops(p, floor):
    """Probability by probability."""
    psi = np.zeros(p.shape)
    for index in np.ndindex(*p.shape):
        psi[index] = -np.log(p[index] if p[index] > floor else floor)
    return psi


def unary_float32(p, floor):
    """In single precision, and with the cost cut off instead of the probability."""
    return np.minimum(-np.log(np.maximum(p.astype(np.float32), 1e-30)), np.float32(-np.log(floor)))


# ---------- right_weights


def weights_loops(image, lam, sigma_I, sigma_p):
    """Pair by pair."""
    H, W, channels = image.shape
    w = np.zeros((H, W - 1))
    for v in range(H):
        for u in range(W - 1):
            squared = sum((float(image[v, u, k]) - float(image[v, u + 1, k])) ** 2 for k in range(channels))
            w[v, u] = lam * np.exp(-squared / (2 * sigma_I**2)) * np.exp(-1 / (2 * sigma_p**2))
    return w


def weights_einsum(image, lam, sigma_I, sigma_p):
    """With the colours divided by sigma_I first."""
    scaled = image.astype(float) / sigma_I
    d = scaled[:, 1:] - scaled[:, :-1]
    return lam * np.exp(-0.5 * (np.einsum("ijk,ijk->ij", d, d) + sigma_p**-2))


def weights_torch(image, lam, sigma_I, sigma_p):
    """In single precision."""
    x = torch.from_numpy(image.astype(np.float32))
    squared = (x[:, 1:] - x[:, :-1]).pow(2).sum(dim=2)
    return (lam * torch.exp(-squared / (2 * sigma_I**2) - 1 / (2 * sigma_p**2))).numpy()


# ---------- energy


def energy_loops(y, psi, w_right, w_down):
    """Pixel by pixel; each asks the neighbours to its right and below."""
    H, W = y.shape
    total = 0.0
    for v in range(H):
        for u in range(W):
            total += psi[v, u, y[v, u]]
            if u < W - 1 and y[v, u] != y[v, u + 1]:
                total += w_right[v, u]
            if v < H - 1 and y[v, u] != y[v + 1, u]:
                total += w_down[v, u]
    return total


def energy_einsum(y, psi, w_right, w_down):
    """With one-hot labels: the product of two of them is 1 where they agree."""
    Y = np.eye(psi.shape[2])[y]
    agree_right = np.einsum("ijc,ijc->ij", Y[:, 1:], Y[:, :-1])
    agree_down = np.einsum("ijc,ijc->ij", Y[1:], Y[:-1])
    return (Y * psi).sum() + (w_right * (1 - agree_right)).sum() + (w_down * (1 - agree_down)).sum()


def energy_torch(y, psi, w_right, w_down):
    """In torch."""
    y, psi = torch.as_tensor(y.astype(np.int64)), torch.as_tensor(psi)
    total = psi.gather(2, y[..., None]).sum()
    total += torch.as_tensor(w_right)[y[:, 1:] != y[:, :-1]].sum()
    return float(total + torch.as_tensor(w_down)[y[1:] != y[:-1]].sum())


def energy_float32(y, psi, w_right, w_down):
    """In single precision."""
    unary = np.take_along_axis(psi.astype(np.float32), y[..., None].astype(int), axis=2).sum()
    right = (w_right.astype(np.float32) * (np.diff(y.astype(int), axis=1) != 0)).sum()
    return unary + right + (w_down.astype(np.float32) * (np.diff(y.astype(int), axis=0) != 0)).sum()


# ---------- icm_costs


def icm_by_energies(y, psi, w_right, w_down, v, u):
    """The whole energy with each class at the pixel, less what does not touch the pixel."""
    costs = []
    for c in range(psi.shape[2]):
        changed = y.copy()
        changed[v, u] = c
        costs.append(energy_loops(changed, psi, w_right, w_down))
    alone_r, alone_d = w_right.copy(), w_down.copy()
    alone_r[v, max(u - 1, 0) : u + 1] = 0.0
    alone_d[max(v - 1, 0) : v + 1, u] = 0.0
    rest = energy_loops(y, psi, alone_r, alone_d) - psi[v, u, y[v, u]]
    return np.array(costs) - rest


def icm_loop(y, psi, w_right, w_down, v, u):
    """Neighbour by neighbour, class by class, in single precision."""
    costs = psi[v, u].astype(np.float32)
    for b, a in ((v, u + 1), (v, u - 1), (v + 1, u), (v - 1, u)):
        if 0 <= b < y.shape[0] and 0 <= a < y.shape[1]:
            w = w_right[v, min(u, a)] if b == v else w_down[min(v, b), u]
            for c in range(len(costs)):
                costs[c] += w if c != y[b, a] else 0.0
    return costs


def icm_padded(y, psi, w_right, w_down, v, u):
    """With a ring of pixels around the image that cost nothing."""
    Y = np.pad(np.eye(psi.shape[2])[y], ((1, 1), (1, 1), (0, 0)))
    right, down = np.pad(w_right, ((0, 0), (1, 1))), np.pad(w_down, ((1, 1), (0, 0)))
    weights = np.array([right[v, u], right[v, u + 1], down[v, u], down[v + 1, u]])
    near = np.stack([Y[v + 1, u], Y[v + 1, u + 2], Y[v, u + 1], Y[v + 2, u + 1]])
    return torch.from_numpy(psi[v, u] + weights @ (1.0 - near)).numpy()


# ---------- terminal_capacities


def capacities_by_difference(psi):
    """Only the difference of a pixel's two costs matters to a cut."""
    difference = psi[..., 1] - psi[..., 0]
    return np.maximum(difference, 0), np.maximum(-difference, 0), np.minimum(psi[..., 0], psi[..., 1]).sum()


def capacities_loops(psi):
    """Pixel by pixel, in single precision."""
    H, W, _ = psi.shape
    source, sink, constant = np.zeros((H, W), np.float32), np.zeros((H, W), np.float32), 0.0
    for v in range(H):
        for u in range(W):
            low = min(psi[v, u])
            source[v, u], sink[v, u] = psi[v, u, 1] - low, psi[v, u, 0] - low
            constant += low
    return source, sink, constant


def capacities_torch(psi):
    """In torch."""
    psi = torch.as_tensor(psi)
    lowest = psi.amin(dim=2, keepdim=True)
    excess = psi - lowest
    return excess[..., 1].numpy(), excess[..., 0].numpy(), float(lowest.sum())


# ---------- row_bound


def bound_loops(psi, w_right):
    """Row by row, class by class."""
    H, W, C = psi.shape
    total = 0.0
    for v in range(H):
        best = list(psi[v, 0])
        for u in range(1, W):
            best = [
                psi[v, u, c] + min(best[k] + (w_right[v, u - 1] if k != c else 0.0) for k in range(C)) for c in range(C)
            ]
        total += min(best)
    return total


def bound_enumerated(psi, w_right):
    """All C^W labellings of each row."""
    H, W, C = psi.shape
    y = np.indices((C,) * W).reshape(W, -1)
    total = 0.0
    for v in range(H):
        costs = psi[v][np.arange(W)[:, None], y].sum(axis=0)
        total += (costs + (w_right[v][:, None] * (y[1:] != y[:-1])).sum(axis=0)).min()
    return total


def bound_torch(psi, w_right):
    """From right to left, in single precision."""
    psi, w = torch.as_tensor(psi, dtype=torch.float32), torch.as_tensor(w_right, dtype=torch.float32)
    best = psi[:, -1]
    for u in range(psi.shape[1] - 2, -1, -1):
        pair = w[:, u, None, None] * (1 - torch.eye(psi.shape[2]))
        best = psi[:, u] + (best[:, None, :] + pair).amin(dim=2)
    return float(best.amin(dim=1).sum())


ALTERNATIVES = {
    "unary_from_probabilities": (unary_torch, unary_loops, unary_float32),
    "right_weights": (weights_loops, weights_einsum, weights_torch),
    "energy": (energy_loops, energy_einsum, energy_torch, energy_float32),
    "icm_costs": (icm_by_energies, icm_loop, icm_padded),
    "terminal_capacities": (capacities_by_difference, capacities_loops, capacities_torch),
    "row_bound": (bound_loops, bound_enumerated, bound_torch),
}
