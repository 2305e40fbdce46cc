"""Right answers to the questions of 05_class_weights, written in other ways than the references."""

import numpy as np

from labkit.course.questions.t05_class_weights.two_means import losses_and_weights
from labkit.course.questions.t05_class_weights.weighted_grad import parts

# ---------- class_weights


def weights_loops(counts, power):
    raw = [float(n) ** -power if n else 0.0 for n in counts]
    scale = sum(map(float, counts)) / sum(n * r for n, r in zip(counts, raw, strict=True))
    return np.array([scale * r if n else 1.0 for n, r in zip(counts, raw, strict=True)])


def weights_einsum(counts, power):
    share = counts / counts.sum()
    raw = np.where(share > 0, np.power(np.where(share > 0, share, 1.0), -power), 0.0)
    return np.where(share > 0, raw / np.einsum("c,c->", share, raw), 1.0)


def weights_torch(counts, power):
    import torch

    n = torch.from_numpy(counts).double()
    raw = torch.where(n > 0, n.clamp(min=1.0) ** -power, torch.zeros_like(n))
    return torch.where(n > 0, raw * n.sum() / (n * raw).sum(), torch.ones_like(n)).numpy()


def weights_float32(counts, power):
    return weights_einsum(counts.astype(np.float32), np.float32(power))


# ---------- weighted_grad


def weighted_grad_one_hot(z, y, w):
    p, Y, _ = parts(z, y)
    return np.einsum("...k,k->...", Y, w)[..., None] * (p - Y)


def weighted_grad_loops(z, y, w):
    out = np.zeros(z.shape)
    for place in np.ndindex(y.shape):
        c = int(y[place])
        if c != 255:
            e = np.exp(z[place] - z[place].max())
            for k in range(z.shape[-1]):
                out[place][k] = w[c] * (e[k] / e.sum() - (k == c))
    return out


def weighted_grad_float32(z, y, w):
    return weighted_grad_one_hot(z.astype(np.float32), y, w.astype(np.float32))


# ---------- two_means


def two_means_weighted(z, y, w):
    loss, weight = losses_and_weights(z, y, w)
    return float(np.average(loss * weight)), float(np.average(loss, weights=weight))


def two_means_loops(z, y, w):
    total, pixels, weights = 0.0, 0, 0.0
    for place in np.ndindex(y.shape):
        if y[place] != 255:
            weight = w[y[place]]
            top = z[place].max()
            total += weight * (top + np.log(np.exp(z[place] - top).sum()) - z[place][y[place]])
            pixels, weights = pixels + 1, weights + weight
    return total / pixels, total / weights


def two_means_float32(z, y, w):
    return two_means_weighted(z.astype(np.float32), y, w.astype(np.float32))


# ---------- weighted_optimum


def weighted_optimum_einsum(p, w):
    return np.einsum("...c,c,...->...c", p, w, 1.0 / (p @ w))


def weighted_optimum_loops(p, w):
    out = np.empty(p.shape)
    for place in np.ndindex(p.shape[:-1]):
        total = sum(p[place][c] * w[c] for c in range(len(w)))
        for c in range(len(w)):
            out[place][c] = p[place][c] * w[c] / total
    return out


def weighted_optimum_torch(p, w):
    import torch

    return torch.softmax(torch.from_numpy(p).log() + torch.from_numpy(w).log(), dim=-1).numpy()


def weighted_optimum_float32(p, w):
    return weighted_optimum_einsum(p.astype(np.float32), w.astype(np.float32))


# ---------- boundary


def boundary_of_logs(means, sigma, counts, w):
    step = np.log(counts[0]) + np.log(w[0]) - np.log(counts[1]) - np.log(w[1])
    return float(0.5 * (means[0] + means[1]) + step * sigma * sigma / (means[1] - means[0]))


def boundary_by_halving(means, sigma, counts, w):
    def excess(x):  # how much better class 1 explains x, in logarithms; linear in x
        log_density = np.log(counts * w) - (x - means) ** 2 / (2 * sigma**2)
        return log_density[1] - log_density[0]

    low, high = -1e4, 1e4
    for _ in range(200):
        middle = 0.5 * (low + high)
        if (excess(middle) > 0) == (means[1] > means[0]):
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)


def boundary_of_two_values(means, sigma, counts, w):
    at = [np.diff(np.log(counts * w) - (x - means) ** 2 / (2 * sigma**2))[0] for x in (0.0, 1.0)]
    return float(at[0] / (at[0] - at[1]))


def boundary_torch(means, sigma, counts, w):
    import torch

    m, n = torch.from_numpy(means), torch.from_numpy(counts * w)
    return (m.mean() + sigma**2 / (m[1] - m[0]) * torch.log(n[0] / n[1])).item()


def boundary_float32(means, sigma, counts, w):
    return boundary_of_logs(means.astype(np.float32), np.float32(sigma), counts, w.astype(np.float32))


# ---------- undo_weights


def undo_loops(z, w, share):
    out = z.copy()
    for c in range(len(w)):
        out[..., c] -= share * np.log(w[c])
    return out


def undo_as_log_probabilities(z, w, share):
    p = np.exp(z - z.max(axis=-1, keepdims=True)) * w**-share
    return np.log(p) - np.log(p.sum(axis=-1, keepdims=True))


def undo_torch(z, w, share):
    import torch

    return torch.from_numpy(z).sub(torch.from_numpy(w).log(), alpha=share).numpy()


def undo_float32(z, w, share):
    return undo_loops(z.astype(np.float32), w.astype(np.float32), share)


ALTERNATIVES = {
    "class_weights": (weights_loops, weights_einsum, weights_torch, weights_float32),
    "weighted_grad": (weighted_grad_one_hot, weighted_grad_loops, weighted_grad_float32),
    "two_means": (two_means_weighted, two_means_loops, two_means_float32),
    "weighted_optimum": (
        weighted_optimum_einsum,
        weighted_optimum_loops,
        weighted_optimum_float32,
        weighted_optimum_torch,
    ),
    "boundary": (boundary_of_logs, boundary_by_halving, boundary_of_two_values, boundary_torch, boundary_float32),
    "undo_weights": (undo_loops, undo_as_log_probabilities, undo_torch, undo_float32),
}
