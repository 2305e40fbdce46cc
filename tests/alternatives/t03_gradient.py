"""Right answers to the questions of 03_gradient, written in other ways than the references."""

import numpy as np


def cross_entropy__float32(z, y):
    return cross_entropy__one_hot(z.astype(np.float32), y)


def cross_entropy__one_hot(z, y):
    Y = (y[..., None] == np.arange(z.shape[-1])).astype(float)
    log_p = z - np.logaddexp.reduce(z, axis=-1, keepdims=True)
    return -(Y * log_p).sum()


def cross_entropy_grad__float32(z, y):
    return cross_entropy_grad__in_place(z.astype(np.float32), y)


def cross_entropy_grad__in_place(z, y):
    p = np.exp(z - np.logaddexp.reduce(z, axis=-1, keepdims=True))
    counted = y != 255
    rows = np.nonzero(counted)
    p[(*rows, y[rows])] -= 1.0
    return np.einsum("...c,...->...c", p, counted)


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


def softmax_backward__float32(p, g):
    weighted = (p * g).astype(np.float32)
    return weighted - p.astype(np.float32) * np.sum(weighted, axis=-1)[..., None]


def softmax_backward__by_jacobian(p, g):
    J = np.einsum("...k,kc->...kc", p, np.eye(p.shape[-1])) - p[..., :, None] * p[..., None, :]
    return np.einsum("...k,...kc->...c", g, J)
