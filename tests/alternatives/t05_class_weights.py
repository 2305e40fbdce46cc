"""Right answers to the questions of 05_class_weights, written in other ways than the references."""

import numpy as np

from labkit.course.topics.t05_class_weights.adjusted_grad import parts
from labkit.course.topics.t05_class_weights.two_means import losses_and_weights


def adjusted_grad__float32(z, y, shares, tau):
    p, Y, counted = parts((z + tau * np.log(shares)).astype(np.float32), y)
    return np.float32(p - Y) * counted


def adjusted_grad__of_products(z, y, shares, tau):
    p, Y, counted = parts(z, y)
    q = p * shares**tau
    return np.where(counted, q / q.sum(axis=-1, keepdims=True) - Y, 0.0)


def adjusted_grad__loops(z, y, shares, tau):
    out = np.zeros(z.shape)
    for place in np.ndindex(y.shape):
        if y[place] != 255:
            a = [z[place][k] + tau * np.log(shares[k]) for k in range(len(shares))]
            total = sum(np.exp(x - max(a)) for x in a)
            for k in range(len(shares)):
                out[place][k] = np.exp(a[k] - max(a)) / total - (k == y[place])
    return out


def change_prior__loops(z, w, shares, new_shares):
    out = z.copy()
    for c in range(len(w)):
        out[..., c] += np.log(new_shares[c]) - np.log(shares[c]) - np.log(w[c])
    return out


def change_prior__torch(z, w, shares, new_shares):
    import torch

    ratio = torch.from_numpy(new_shares / shares / w)
    return torch.log_softmax(torch.from_numpy(z) + ratio.log(), dim=-1).numpy()


def change_prior__float32(z, w, shares, new_shares):
    return change_prior__loops(z.astype(np.float32), w.astype(np.float32), shares, new_shares)


def class_weights__einsum(counts, power):
    share = counts / counts.sum()
    raw = np.where(share > 0, np.power(np.where(share > 0, share, 1.0), -power), 0.0)
    return np.where(share > 0, raw / np.einsum("c,c->", share, raw), 1.0)


def class_weights__torch(counts, power):
    import torch

    n = torch.from_numpy(counts).double()
    raw = torch.where(n > 0, n.clamp(min=1.0) ** -power, torch.zeros_like(n))
    return torch.where(n > 0, raw * n.sum() / (n * raw).sum(), torch.ones_like(n)).numpy()


def class_weights__float32(counts, power):
    return class_weights__einsum(counts.astype(np.float32), np.float32(power))


def least_cost__torch(p, cost):
    import torch

    return torch.argmax(-torch.from_numpy(p).float() @ torch.from_numpy(cost).float(), dim=-1).numpy()


def least_cost__loops(p, cost):
    said = np.zeros(p.shape[:-1], int)
    for place in np.ndindex(said.shape):
        prices = [sum(p[place][i] * cost[i, j] for i in range(len(cost))) for j in range(len(cost))]
        said[place] = prices.index(min(prices))
    return said


def least_cost__einsum(p, cost):
    return np.argmin(np.einsum("...i,ij->...j", p, cost), axis=-1).astype(np.uint8)


def two_means__weighted(z, y, w):
    loss, weight = losses_and_weights(z, y, w)
    return float(np.average(loss * weight)), float(np.average(loss, weights=weight))


def two_means__float32(z, y, w):
    return two_means__weighted(z.astype(np.float32), y, w.astype(np.float32))


def two_means__loops(z, y, w):
    total, pixels, weights = 0.0, 0, 0.0
    for place in np.ndindex(y.shape):
        if y[place] != 255:
            weight = w[y[place]]
            top = z[place].max()
            total += weight * (top + np.log(np.exp(z[place] - top).sum()) - z[place][y[place]])
            pixels, weights = pixels + 1, weights + weight
    return total / pixels, total / weights


def weight_for_recall__quantile(p1, y, recall):
    return float(np.quantile((1.0 - p1[y]) / p1[y], recall, method="inverted_cdf"))


def weight_for_recall__trying(p1, y, recall):
    odds = np.unique((1.0 - p1) / p1)
    for w in odds:
        if np.count_nonzero(w * p1[y] >= (1.0 - p1[y]) * (1 - 1e-12)) >= recall * np.count_nonzero(y):
            return w


def weight_for_recall__partition(p1, y, recall):
    true = p1[np.flatnonzero(y)]
    missed = int(np.floor((1.0 - recall) * len(true) + 1e-9))
    return 1.0 / np.partition(true, missed)[missed] - 1.0
