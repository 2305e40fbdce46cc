"""Right answers to the questions of 03_gradient, written in other ways than the references."""

import numpy as np


def softmax__loops(z):
    out = np.empty(z.shape)
    for place in np.ndindex(z.shape[:-1]):
        total = sum(np.exp(other - max(z[place])) for other in z[place])
        for c in range(z.shape[-1]):
            out[(*place, c)] = np.exp(z[place][c] - max(z[place])) / total
    return out


def softmax__einsum(z):
    e = np.exp(z - np.maximum.reduce(z, axis=-1)[..., None])
    return np.einsum("...c,...->...c", e, 1.0 / np.einsum("...c->...", e))


def softmax__float32(z):
    return softmax__einsum(z.astype(np.float32))


def log_sum_exp__pairwise(z):
    return np.logaddexp.reduce(z, axis=-1)


def log_sum_exp__loops(z):
    out = np.empty(z.shape[:-1])
    for place in np.ndindex(out.shape):
        top = max(z[place])
        out[place] = top + np.log(sum(np.exp(value - top) for value in z[place]))
    return out


def log_sum_exp__float32(z):
    return log_sum_exp__pairwise(z.astype(np.float32))


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


def cross_entropy__float32(z, y):
    return cross_entropy__one_hot(z.astype(np.float32), y)


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


def cross_entropy_grad__float32(z, y):
    return cross_entropy_grad__in_place(z.astype(np.float32), y)


def numerical_grad__in_place(z, y, h):
    moved, out = z.astype(float), []
    for c in range(len(z)):
        values = []
        for sign in (1.0, -1.0):
            moved[c] = z[c] + sign * h
            values.append(-np.log(np.exp(moved[y]) / np.exp(moved).sum()))
        moved[c] = z[c]
        out.append((values[0] - values[1]) / (2.0 * h))
    return np.array(out)


def numerical_grad__at_once(z, y, h):
    both = z + np.multiply.outer([h, -h], np.eye(len(z)))  # (2, C, C): up and down, the moved logit, the logits
    losses = np.logaddexp.reduce(both, axis=-1) - both[..., y]
    return (losses[0] - losses[1]) / (2.0 * h)


def numerical_grad__float32(z, y, h):
    steps = np.float32(h) * np.eye(len(z), dtype=np.float32)
    up, down = (z.astype(np.float32) + sign * steps for sign in (1, -1))
    return (np.log(np.exp(up).sum(1)) - up[:, y] - np.log(np.exp(down).sum(1)) + down[:, y]) / np.float32(2 * h)


def receptive_field__backwards(kernels, strides):
    size = 1
    for kernel, stride in list(zip(kernels, strides, strict=True))[::-1]:
        size = (size - 1) * int(stride) + int(kernel)
    return size


def receptive_field__products(kernels, strides):
    jumps = np.cumprod([1, *strides[:-1]])
    return 1 + int(np.dot(np.asarray(kernels) - 1, jumps))


def receptive_field__by_counting(kernels, strides):
    seen = {0}  # inputs of the last layer's output 0, then of the layer before, and so on
    for kernel, stride in list(zip(kernels, strides, strict=True))[::-1]:
        seen = {place * int(stride) + offset for place in seen for offset in range(int(kernel))}
    return max(seen) - min(seen) + 1
