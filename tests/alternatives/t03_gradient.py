"""Right answers to the questions of 03_gradient, written in other ways than the references."""

import numpy as np


def cross_entropy__float32(z, y):
    return cross_entropy__one_hot(z.astype(np.float32), y)


def cross_entropy__loops(z, y):
    total = 0.0
    for place in np.ndindex(y.shape):
        if y[place] != 255:
            top = z[place].max()
            total += top + np.log(sum(np.exp(value - top) for value in z[place])) - z[place][y[place]]
    return total


def cross_entropy__one_hot(z, y):
    Y = (y[..., None] == np.arange(z.shape[-1])).astype(float)
    log_p = z - np.logaddexp.reduce(z, axis=-1, keepdims=True)
    return -(Y * log_p).sum()


def cross_entropy_grad__float32(z, y):
    return cross_entropy_grad__in_place(z.astype(np.float32), y)


def cross_entropy_grad__loops(z, y):
    out = np.zeros(z.shape)
    for place in np.ndindex(y.shape):
        if y[place] != 255:
            e = np.exp(z[place] - z[place].max())
            for c in range(z.shape[-1]):
                out[place][c] = e[c] / e.sum() - (1.0 if c == y[place] else 0.0)
    return out


def cross_entropy_grad__in_place(z, y):
    p = np.exp(z - np.logaddexp.reduce(z, axis=-1, keepdims=True))
    counted = y != 255
    rows = np.nonzero(counted)
    p[(*rows, y[rows])] -= 1.0
    return np.einsum("...c,...->...c", p, counted)


def input_window__recursive(kernels, strides, paddings, u):
    if len(kernels) == 0:
        return int(u), int(u)
    first, last = input_window__recursive(kernels[:0], strides[:0], paddings[:0], u)
    k, s, p = int(kernels[-1]), int(strides[-1]), int(paddings[-1])
    first, last = first * s - p, last * s - p + k - 1
    head = input_window__recursive(kernels[:-1], strides[:-1], paddings[:-1], first)
    return head[0], input_window__recursive(kernels[:-1], strides[:-1], paddings[:-1], last)[1]


def input_window__by_counting(kernels, strides, paddings, u):
    """The set of all pixels that are read, layer by layer."""
    seen = {int(u)}
    for k, s, p in list(zip(kernels, strides, paddings, strict=True))[::-1]:
        seen = {int(place * s - p + i) for place in seen for i in range(k)}
    return min(seen), max(seen)


def input_window__by_products(kernels, strides, paddings, u):
    """Forward: how far a step of each layer's input is in the image."""
    jumps = np.concatenate([[1], np.cumprod(strides)])
    first = int(u * jumps[-1] - (paddings * jumps[:-1]).sum())
    return first, first + int(((kernels - 1) * jumps[:-1]).sum())


def max_pool_backward__by_corners(x, g):
    """The four corners of all blocks one after the other."""
    out, corners = np.zeros(x.shape), np.stack([x[v::2, u::2] for v in (0, 1) for u in (0, 1)])
    winner = corners.argmax(axis=0)
    for k in range(4):
        out[k // 2 :: 2, k % 2 :: 2] = g * (winner == k)
    return out


def max_pool_backward__by_comparison(x, g):
    """Each pixel against the largest of its block; no two pixels of a block are equal."""
    largest = np.maximum(np.maximum(x[::2, ::2], x[1::2, ::2]), np.maximum(x[::2, 1::2], x[1::2, 1::2]))
    big = np.ones((2, 2))
    return np.where(x == np.kron(largest, big), np.kron(g, big), 0.0)


def max_pool_backward__by_blocks(x, g):
    H, W = x.shape
    b = x.reshape(H // 2, 2, W // 2, 2).transpose(0, 2, 1, 3).reshape(H // 2, W // 2, 4)
    chosen = np.eye(4, dtype=np.float32)[b.argmax(axis=2)] * g[..., None]
    return chosen.reshape(H // 2, W // 2, 2, 2).transpose(0, 2, 1, 3).reshape(H, W)


def softmax__einsum(z):
    e = np.exp(z - np.maximum.reduce(z, axis=-1)[..., None])
    return np.einsum("...c,...->...c", e, 1.0 / np.einsum("...c->...", e))


def softmax__float32(z):
    return softmax__einsum(z.astype(np.float32))


def softmax__loops(z):
    out = np.zeros(z.shape)
    for place in np.ndindex(z.shape[:-1]):
        total = sum(np.exp(other - max(z[place])) for other in z[place])
        for c in range(z.shape[-1]):
            out[(*place, c)] = np.exp(z[place][c] - max(z[place])) / total
    return out


def softmax_backward__float32(p, g):
    weighted = (p * g).astype(np.float32)
    return weighted - p.astype(np.float32) * np.sum(weighted, axis=-1)[..., None]


def softmax_backward__by_jacobian(p, g):
    J = np.einsum("...k,kc->...kc", p, np.eye(p.shape[-1])) - p[..., :, None] * p[..., None, :]
    return np.einsum("...k,...kc->...c", g, J)


def softmax_backward__loops(p, g):
    out = np.zeros(p.shape)
    for place in np.ndindex(p.shape[:-1]):
        for c in range(p.shape[-1]):
            for k in range(p.shape[-1]):
                out[place][c] += g[place][k] * p[place][k] * ((k == c) - p[place][c])
    return out
