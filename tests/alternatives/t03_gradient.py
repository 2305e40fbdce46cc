"""Right answers to the questions of 03_gradient, written in other ways than the references."""

import numpy as np

from labkit.course.topics.t03_gradient.cross_entropy import one_hot
from labkit.course.topics.t03_gradient.cross_entropy_grad import in_place


def softmax__einsum(z):
    e = np.exp(z - np.maximum.reduce(z, axis=-1)[..., None])
    return np.einsum("...c,...->...c", e, 1.0 / np.einsum("...c->...", e))


def softmax__float32(z):
    return softmax__einsum(z.astype(np.float32))


def cross_entropy__float32(z, y):
    return one_hot(z.astype(np.float32), y)


def cross_entropy_grad__float32(z, y):
    return in_place(z.astype(np.float32), y)


def softmax_backward__float32(p, g):
    weighted = (p * g).astype(np.float32)
    return weighted - p.astype(np.float32) * np.sum(weighted, axis=-1)[..., None]


def max_pool_backward__by_corners(x, g):
    """The four corners of all blocks one after the other."""
    out, corners = np.zeros(x.shape), np.stack([x[v::2, u::2] for v in (0, 1) for u in (0, 1)])
    winner = corners.argmax(axis=0)
    for k in range(4):
        out[k // 2 :: 2, k % 2 :: 2] = g * (winner == k)
    return out


def input_window__recursive(kernels, strides, paddings, u):
    if len(kernels) == 0:
        return int(u), int(u)
    first, last = input_window__recursive(kernels[:0], strides[:0], paddings[:0], u)
    k, s, p = int(kernels[-1]), int(strides[-1]), int(paddings[-1])
    first, last = first * s - p, last * s - p + k - 1
    head = input_window__recursive(kernels[:-1], strides[:-1], paddings[:-1], first)
    return head[0], input_window__recursive(kernels[:-1], strides[:-1], paddings[:-1], last)[1]
