"""Right answers to the questions of 02_crf, written in other ways than the references."""

import numpy as np
import torch

from labkit.course.topics.t02_crf import PAIRS

STEPS = ((0, 1), (1, 0), (1, 1), (1, -1))


def energy__loops(y, psi, weights):
    """Pixel by pixel; each asks the neighbours whose pairs it owns."""
    total = 0.0
    for v, u in np.ndindex(*y.shape):
        total += psi[v, u, y[v, u]]
        for d, (down, right) in enumerate(STEPS):
            if v + down < y.shape[0] and 0 <= u + right < y.shape[1] and y[v, u] != y[v + down, u + right]:
                total += weights[d, v, u]
    return total


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


def icm_costs__loop(y, psi, weights, v, u):
    """Every pixel asked whether it is a neighbour, in single precision."""
    costs = psi[v, u].astype(np.float32)
    for b, a in np.ndindex(*y.shape):
        step = (b - v, a - u)
        w = weights[PAIRS.index(step), v, u] if step in PAIRS else 0.0
        step = (v - b, u - a)
        w = weights[PAIRS.index(step), b, a] if step in PAIRS else w
        for c in range(len(costs)):
            costs[c] += w if c != y[b, a] else 0.0
    return costs


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


def pair_weights__loops(image, lam, sigma_I, sigma_p):
    """Pair by pair."""
    H, W, channels = image.shape
    w = np.zeros((4, H, W))
    for d, v, u in np.ndindex(4, H, W):
        b, a = v + PAIRS[d][0], u + PAIRS[d][1]
        if b < H and 0 <= a < W:
            squared = sum((float(image[v, u, k]) - float(image[b, a, k])) ** 2 for k in range(channels))
            distance = np.hypot(b - v, a - u)
            w[d, v, u] = lam * np.exp(-squared / (2 * sigma_I**2)) * np.exp(-(distance**2) / (2 * sigma_p**2))
    return w


def row_labels__enumerated(psi, w):
    """All C^n labellings of the row."""
    n, C = psi.shape
    y = np.indices((C,) * n, dtype=np.int8).reshape(n, -1)
    costs = psi[np.arange(n)[:, None], y].sum(axis=0) + (w[:, None] * (y[1:] != y[:-1])).sum(axis=0)
    return y[:, costs.argmin()]


def row_labels__by_min_marginals(psi, w):
    """Both walks, from the left and from the right: what each class at each pixel costs at least."""

    def forward(psi, w):
        best = [psi[0]]
        for u in range(1, len(psi)):
            best.append(psi[u] + np.minimum(best[-1], best[-1].min() + w[u - 1]))
        return np.array(best)

    return (forward(psi, w) + forward(psi[::-1], w[::-1])[::-1] - psi).argmin(axis=1)


def terminal_capacities__by_difference(psi):
    """Only the difference of a pixel's two costs matters to a cut."""
    difference = psi[..., 1] - psi[..., 0]
    return np.maximum(difference, 0), np.maximum(-difference, 0), np.minimum(psi[..., 0], psi[..., 1]).sum()


def terminal_capacities__loops(psi):
    """Pixel by pixel, in single precision."""
    H, W, _ = psi.shape
    source, sink, constant = np.zeros((H, W), np.float32), np.zeros((H, W), np.float32), 0.0
    for v in range(H):
        for u in range(W):
            low = min(psi[v, u])
            source[v, u], sink[v, u] = psi[v, u, 1] - low, psi[v, u, 0] - low
            constant += low
    return source, sink, constant


def unary_from_probabilities__torch(p, floor):
    """Clamp, then take the logarithm, in torch."""
    return -torch.log(torch.clamp(torch.as_tensor(p), min=floor)).numpy()


def unary_from_probabilities__float32(p, floor):
    """In single precision, and with the cost cut off instead of the probability."""
    return np.minimum(-np.log(np.maximum(p.astype(np.float32), 1e-30)), np.float32(-np.log(floor)))
