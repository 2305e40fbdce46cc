"""Answers to topic 05's questions: wrong ones as students give them, and right ones written in other ways."""

import numpy as np

# ------------------------------------------------------------------------------------------- class weights


def weights_not_scaled(counts, power):
    present = counts > 0
    w = np.ones(len(counts))
    w[present] = counts[present] ** -power
    return w


def weights_summing_to_one(counts, power):
    w = weights_not_scaled(counts, power)
    w[counts > 0] /= w[counts > 0].sum()
    return w


def weights_of_mean_one_over_classes(counts, power):
    w = weights_not_scaled(counts, power)
    w[counts > 0] /= w[counts > 0].mean()
    return w


def weights_of_frequency(counts, power):
    return weights_loops(counts, -power)


def weights_always_inverse(counts, power):
    return weights_loops(counts, 1.0)


def weights_of_absent_classes(counts, power):
    w = np.maximum(counts, 1) ** -power
    return w * counts.sum() / (counts @ w)


def weights_with_infinity(counts, power):
    w = counts.astype(float) ** -power
    return w * counts.sum() / np.nansum(counts * w)


def weights_zero_for_absent(counts, power):
    return np.where(counts > 0, weights_loops(counts, power), 0.0)


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


# -------------------------------------------------------------------------------- the weighted gradient


def parts(z, y):
    """Probabilities, one-hot labels and whether a pixel counts, with an axis for the classes."""
    p = np.exp(z - np.logaddexp.reduce(z, axis=-1, keepdims=True))
    return p, (y[..., None] == np.arange(z.shape[-1])).astype(float), (y != 255)[..., None]


def pixel_weights(y, w):
    """The weight of each pixel's true class, 0 where it is ignored."""
    return np.where(y == 255, 0.0, w[np.where(y == 255, 0, y)])[..., None]


def grad_of_plain_loss(z, y, w):
    p, Y, counted = parts(z, y)
    return (p - Y) * counted


def grad_weighted_by_column(z, y, w):
    p, Y, counted = parts(z, y)
    return w * (p - Y) * counted


def grad_weights_in_the_one_hot(z, y, w):
    p, Y, counted = parts(z, y)
    return (p - w * Y) * counted


def grad_weights_in_the_softmax(z, y, w):
    p, Y, counted = parts(z, y)
    q = w * p
    return (q / q.sum(axis=-1, keepdims=True) - Y) * counted


def grad_over_sum_of_weights(z, y, w):
    return weighted_grad_one_hot(z, y, w) / max(pixel_weights(y, w).sum(), 1e-9)


def grad_of_mean(z, y, w):
    return weighted_grad_one_hot(z, y, w) / max(np.count_nonzero(y != 255), 1)


def grad_of_ignored_too(z, y, w):
    p, Y, _ = parts(z, y)
    return w[np.where(y == 255, 0, y)][..., None] * (p - Y)


def grad_divided_by_weights(z, y, w):
    return weighted_grad_one_hot(z, y, 1.0 / w)


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


def weighted_grad_torch(z, y, w):
    import torch

    logits, labels = torch.from_numpy(z).requires_grad_(), torch.from_numpy(y.astype(np.int64)).reshape(-1)
    torch.nn.functional.cross_entropy(
        logits.reshape(-1, z.shape[-1]), labels, weight=torch.from_numpy(w), ignore_index=255, reduction="sum"
    ).backward()
    return logits.grad.numpy()


def weighted_grad_float32(z, y, w):
    return weighted_grad_one_hot(z.astype(np.float32), y, w.astype(np.float32))


# ----------------------------------------------------------------------------------------- the two means


def losses_and_weights(z, y, w):
    """Loss and weight of each counted pixel."""
    counted = y != 255
    z, y = z[counted], y[counted]
    log_p = z - np.logaddexp.reduce(z, axis=-1, keepdims=True)
    return -log_p[np.arange(len(y)), y], w[y]


def means_swapped(z, y, w):
    return two_means_weighted(z, y, w)[::-1]


def means_the_same(z, y, w):
    loss, weight = losses_and_weights(z, y, w)
    return float((loss * weight).mean()), float((loss * weight).mean())


def means_over_all_pixels(z, y, w):
    loss, weight = losses_and_weights(z, y, w)
    return float((loss * weight).sum() / y.size), float((loss * weight).sum() / weight.sum())


def means_over_weights_of_classes(z, y, w):
    loss, weight = losses_and_weights(z, y, w)
    return float((loss * weight).mean()), float((loss * weight).sum() / w.sum())


def means_not_weighted(z, y, w):
    loss, weight = losses_and_weights(z, y, w)
    return float(loss.mean()), float(loss.sum() / weight.sum())


def means_are_sums(z, y, w):
    loss, weight = losses_and_weights(z, y, w)
    return float((loss * weight).sum()), float((loss * weight).sum() / weight.sum())


def means_of_ignored_too(z, y, w):
    return two_means_weighted(z, np.where(y == 255, 0, y), w)


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


def two_means_torch(z, y, w):
    import torch

    logits, labels = torch.from_numpy(z).reshape(-1, z.shape[-1]), torch.from_numpy(y.astype(np.int64)).reshape(-1)
    options = {"weight": torch.from_numpy(w), "ignore_index": 255}
    total = torch.nn.functional.cross_entropy(logits, labels, reduction="sum", **options)
    mean = torch.nn.functional.cross_entropy(logits, labels, **options)
    return (total / (labels != 255).sum()).item(), mean.item()


def two_means_float32(z, y, w):
    return two_means_weighted(z.astype(np.float32), y, w.astype(np.float32))


# ------------------------------------------------------------------------------------- where training ends


def optimum_without_weights(p, w):
    return p.copy()


def optimum_not_normalised(p, w):
    return w * p


def optimum_divided(p, w):
    return weighted_optimum_einsum(p, 1.0 / w)


def optimum_over_pixels(p, w):
    q = w * p
    return q / q.sum(axis=0, keepdims=True)


def optimum_of_normalised_weights(p, w):
    return p * w / w.sum()


def optimum_of_square_roots(p, w):
    return weighted_optimum_einsum(p, np.sqrt(w))


def optimum_by_softmax(p, w):
    e = np.exp(w * p)
    return e / e.sum(axis=-1, keepdims=True)


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


# ----------------------------------------------------------------------------------------- the boundary


def boundary_midpoint(means, sigma, counts, w):
    return float(means[0] + means[1]) / 2


def boundary_of_heights(means, sigma, counts, w):
    odds = counts[0] * w[0] / (counts[1] * w[1])
    return float((means[0] + means[1]) / 2 - sigma**2 / (means[1] - means[0]) * np.log(odds))


def boundary_without_weights(means, sigma, counts, w):
    return boundary_of_logs(means, sigma, counts, np.ones(2))


def boundary_without_counts(means, sigma, counts, w):
    return boundary_of_logs(means, sigma, np.ones(2), w)


def boundary_sigma(means, sigma, counts, w):
    return boundary_of_logs(means, np.sqrt(sigma), counts, w)


def boundary_distance(means, sigma, counts, w):
    step = np.log(counts[0] * w[0] / (counts[1] * w[1]))
    return float((means[0] + means[1]) / 2 + sigma**2 / abs(means[1] - means[0]) * step)


def boundary_ratio(means, sigma, counts, w):
    odds = counts[0] * w[0] / (counts[1] * w[1])
    return float((means[0] + means[1]) / 2 + sigma**2 / (means[1] - means[0]) * odds)


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


# ------------------------------------------------------------------------------------ undoing the weights


def undo_twice(z, w, share):
    return z + share * np.log(w)


def undo_subtracting_weights(z, w, share):
    return z - share * w


def undo_dividing(z, w, share):
    return z / w**share


def undo_wholly(z, w, share):
    return z - np.log(w)


def undo_share_inside(z, w, share):
    return z - np.log(share * w + 1.0 - share)


def undo_as_probabilities(z, w, share):
    p = np.exp(z - np.logaddexp.reduce(z, axis=-1, keepdims=True)) / w**share
    return p / p.sum(axis=-1, keepdims=True)


def undo_over_pixels(z, w, share):
    return z - share * np.log(np.resize(w, z.shape[:-1]))[..., None]


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
