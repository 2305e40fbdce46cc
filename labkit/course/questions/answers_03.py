"""Answers to topic 03's questions: wrong ones as students give them, and right ones written in other ways."""

import numpy as np

# ---------------------------------------------------------------------------------------------- softmax


def softmax_over_pixels(z):
    e = np.exp(z - z.max(axis=-2 if z.ndim > 1 else -1, keepdims=True))
    return e / e.sum(axis=-2 if z.ndim > 1 else -1, keepdims=True)


def softmax_over_everything(z):
    e = np.exp(z - z.max())
    return e / e.sum()


def softmax_that_overflows(z):
    return np.exp(z) / np.exp(z).sum(axis=-1, keepdims=True)


def softmax_of_global_maximum(z):
    e = np.exp(z - z.max())
    return e / e.sum(axis=-1, keepdims=True)


def softmax_clipped(z):
    e = np.exp(np.clip(z, -50.0, 50.0))
    return e / e.sum(axis=-1, keepdims=True)


def sigmoid_of_each(z):
    return 1.0 / (1.0 + np.exp(-z))


def logits_divided_by_their_sum(z):
    return z / z.sum(axis=-1, keepdims=True)


def softmax_loops(z):
    out = np.empty(z.shape)
    for place in np.ndindex(z.shape[:-1]):
        total = sum(np.exp(other - max(z[place])) for other in z[place])
        for c in range(z.shape[-1]):
            out[(*place, c)] = np.exp(z[place][c] - max(z[place])) / total
    return out


def softmax_einsum(z):
    e = np.exp(z - np.maximum.reduce(z, axis=-1)[..., None])
    return np.einsum("...c,...->...c", e, 1.0 / np.einsum("...c->...", e))


def softmax_torch(z):
    import torch

    return torch.softmax(torch.from_numpy(z), dim=-1).numpy()


def softmax_float32(z):
    return softmax_einsum(z.astype(np.float32))


# ---------------------------------------------------------------------------------------- log-sum-exp


def log_sum_exp_that_overflows(z):
    return np.log(np.exp(z).sum(axis=-1))


def log_sum_exp_without_the_largest(z):
    return np.log(np.exp(z - z.max(axis=-1, keepdims=True)).sum(axis=-1))


def log_sum_exp_with_epsilon(z):
    return np.log(np.exp(z).sum(axis=-1) + 1e-8)


def log_sum_exp_over_pixels(z):
    axis = -2 if z.ndim > 1 else -1
    largest = z.max(axis=axis, keepdims=True)
    return (largest + np.log(np.exp(z - largest).sum(axis=axis, keepdims=True))).squeeze(axis)


def largest_logit(z):
    return z.max(axis=-1)


def log_mean_exp(z):
    largest = z.max(axis=-1)
    return largest + np.log(np.exp(z - largest[..., None]).mean(axis=-1))


def log_sum_exp_of_global_maximum(z):
    return z.max() + np.log(np.exp(z - z.max()).sum(axis=-1))


def log_sum_exp_pairwise(z):
    return np.logaddexp.reduce(z, axis=-1)


def log_sum_exp_loops(z):
    out = np.empty(z.shape[:-1])
    for place in np.ndindex(out.shape):
        top = max(z[place])
        out[place] = top + np.log(sum(np.exp(value - top) for value in z[place]))
    return out


def log_sum_exp_torch(z):
    import torch

    return torch.logsumexp(torch.from_numpy(z), dim=-1).numpy()


def log_sum_exp_float32(z):
    return log_sum_exp_pairwise(z.astype(np.float32))


# -------------------------------------------------------------------------------------- cross-entropy


def true_log_probabilities(z, y):
    """Log-probabilities of the true classes of the counted pixels, a list."""
    counted = y != 255
    z, y = z[counted], y[counted]
    log_p = z - np.logaddexp.reduce(z, axis=-1, keepdims=True)
    return log_p[np.arange(len(y)), y]


def cross_entropy_mean(z, y):
    values = true_log_probabilities(z, y)
    return -float(values.mean()) if values.size else 0.0


def cross_entropy_sign(z, y):
    return float(true_log_probabilities(z, y).sum())


def cross_entropy_epsilon(z, y):
    p = np.exp(true_log_probabilities(z, y))
    return float(-np.log(p + 1e-7).sum())


def cross_entropy_softmax_twice(z, y):
    return cross_entropy_one_hot(softmax_einsum(z), y)


def cross_entropy_without_softmax(z, y):
    counted = y != 255
    return -float(np.take_along_axis(z[counted], y[counted][:, None], -1).sum())


def cross_entropy_counts_ignored(z, y):
    return cross_entropy_one_hot(z, np.where(y == 255, 0, y))


def cross_entropy_of_probabilities(z, y):
    return float((1.0 - np.exp(true_log_probabilities(z, y))).sum())


def cross_entropy_of_all_classes(z, y):
    counted = y != 255
    log_p = z[counted] - np.logaddexp.reduce(z[counted], axis=-1, keepdims=True)
    return -float(log_p.sum())


def cross_entropy_loops(z, y):
    total = 0.0
    for place in np.ndindex(y.shape):
        if y[place] != 255:
            top = z[place].max()
            total += top + np.log(sum(np.exp(value - top) for value in z[place])) - z[place][y[place]]
    return total


def cross_entropy_one_hot(z, y):
    Y = (y[..., None] == np.arange(z.shape[-1])).astype(float)
    log_p = z - np.logaddexp.reduce(z, axis=-1, keepdims=True)
    return -(Y * log_p).sum()


def cross_entropy_torch(z, y):
    import torch

    logits, labels = torch.from_numpy(z).reshape(-1, z.shape[-1]), torch.from_numpy(y.astype(np.int64)).reshape(-1)
    return torch.nn.functional.cross_entropy(logits, labels, ignore_index=255, reduction="sum").item()


def cross_entropy_float32(z, y):
    return cross_entropy_one_hot(z.astype(np.float32), y)


# --------------------------------------------------------------------------------------- the gradient


def one_hot(z, y):
    """The labels as ones and zeros in the logits' shape."""
    return (y[..., None] == np.arange(z.shape[-1])).astype(float)


def grad_without_one_hot(z, y):
    return softmax_einsum(z) * (y != 255)[..., None]


def grad_sign(z, y):
    return -grad_in_place(z, y)


def grad_mean(z, y):
    return grad_in_place(z, y) / max(1, np.count_nonzero(y != 255))


def grad_counts_ignored(z, y):
    return softmax_einsum(z) - one_hot(z, y)


def grad_over_pixels(z, y):
    return (softmax_over_pixels(z) - one_hot(z, y)) * (y != 255)[..., None]


def grad_true_class_only(z, y):
    return grad_in_place(z, y) * one_hot(z, y)


def grad_of_logits(z, y):
    return (z - one_hot(z, y)) * (y != 255)[..., None]


def grad_of_squared_error(z, y):
    p = softmax_einsum(z)
    error = p - one_hot(z, y)
    return p * (error - (p * error).sum(axis=-1, keepdims=True)) * (y != 255)[..., None]


def grad_loops(z, y):
    out = np.zeros(z.shape)
    for place in np.ndindex(y.shape):
        if y[place] != 255:
            e = np.exp(z[place] - z[place].max())
            for c in range(z.shape[-1]):
                out[place][c] = e[c] / e.sum() - (1.0 if c == y[place] else 0.0)
    return out


def grad_in_place(z, y):
    p = np.exp(z - np.logaddexp.reduce(z, axis=-1, keepdims=True))
    counted = y != 255
    rows = np.nonzero(counted)
    p[(*rows, y[rows])] -= 1.0
    return np.einsum("...c,...->...c", p, counted)


def grad_torch(z, y):
    import torch

    logits = torch.from_numpy(z).requires_grad_()
    labels = torch.from_numpy(y.astype(np.int64)).reshape(-1)
    loss = torch.nn.functional.cross_entropy(logits.reshape(-1, z.shape[-1]), labels, ignore_index=255, reduction="sum")
    loss.backward()
    return logits.grad.numpy()


def grad_float32(z, y):
    return grad_in_place(z.astype(np.float32), y)


# ----------------------------------------------------------------------------- the numerical gradient


def pixel_loss(z, y):
    """The loss of one pixel."""
    return np.log(np.exp(z).sum()) - z[y]


def forward_difference(z, y, h):
    return np.array([(pixel_loss(z + step, y) - pixel_loss(z, y)) / h for step in h * np.eye(len(z))])


def backward_difference(z, y, h):
    return np.array([(pixel_loss(z, y) - pixel_loss(z - step, y)) / h for step in h * np.eye(len(z))])


def difference_over_h(z, y, h):
    return 2.0 * numerical_grad_at_once(z, y, h)


def difference_not_divided(z, y, h):
    return 2.0 * h * numerical_grad_at_once(z, y, h)


def formula_instead_of_differences(z, y, h):
    return softmax_einsum(z) - (np.arange(len(z)) == y)


def all_logits_at_once(z, y, h):
    return np.full(len(z), (pixel_loss(z + h, y) - pixel_loss(z - h, y)) / (2 * h))


def step_never_taken_back(z, y, h):
    moved, out = z.astype(float), np.empty(len(z))
    for c in range(len(z)):
        moved[c] += h
        up = pixel_loss(moved, y)
        moved[c] -= h
        out[c] = (up - pixel_loss(moved - h * (np.arange(len(z)) == c), y)) / (2 * h)
        moved[c] -= h
    return out


def numerical_grad_in_place(z, y, h):
    moved, out = z.astype(float), []
    for c in range(len(z)):
        values = []
        for sign in (1.0, -1.0):
            moved[c] = z[c] + sign * h
            values.append(-np.log(np.exp(moved[y]) / np.exp(moved).sum()))
        moved[c] = z[c]
        out.append((values[0] - values[1]) / (2.0 * h))
    return np.array(out)


def numerical_grad_at_once(z, y, h):
    both = z + np.multiply.outer([h, -h], np.eye(len(z)))  # (2, C, C): up and down, the moved logit, the logits
    losses = np.logaddexp.reduce(both, axis=-1) - both[..., y]
    return (losses[0] - losses[1]) / (2.0 * h)


def numerical_grad_torch(z, y, h):
    import torch

    logits, steps = torch.from_numpy(z), h * torch.eye(len(z), dtype=torch.float64)

    def loss(rows):
        return torch.nn.functional.cross_entropy(rows, torch.full((len(z),), int(y)), reduction="none")

    return ((loss(logits + steps) - loss(logits - steps)) / (2.0 * h)).numpy()


def numerical_grad_float32(z, y, h):
    steps = np.float32(h) * np.eye(len(z), dtype=np.float32)
    up, down = (z.astype(np.float32) + sign * steps for sign in (1, -1))
    return (np.log(np.exp(up).sum(1)) - up[:, y] - np.log(np.exp(down).sum(1)) + down[:, y]) / np.float32(2 * h)


# ------------------------------------------------------------------------------------ receptive field


def field_without_strides(kernels, strides):
    return 1 + int(sum(kernel - 1 for kernel in kernels))


def field_sum_of_kernels(kernels, strides):
    return int(sum(kernels))


def field_product(kernels, strides):
    return int(np.prod(kernels))


def field_stride_too_early(kernels, strides):
    size, jump = 1, 1
    for kernel, stride in zip(kernels, strides, strict=True):
        jump *= int(stride)
        size += (int(kernel) - 1) * jump
    return size


def field_last_stride_only(kernels, strides):
    size = 1
    for i, kernel in enumerate(kernels):
        size += (int(kernel) - 1) * (int(strides[i - 1]) if i else 1)
    return size


def field_radius(kernels, strides):
    return (field_products(kernels, strides) - 1) // 2


def field_whole_kernels(kernels, strides):
    size, jump = 1, 1
    for kernel, stride in zip(kernels, strides, strict=True):
        size += int(kernel) * jump
        jump *= int(stride)
    return size


def field_backwards(kernels, strides):
    size = 1
    for kernel, stride in list(zip(kernels, strides, strict=True))[::-1]:
        size = (size - 1) * int(stride) + int(kernel)
    return size


def field_products(kernels, strides):
    jumps = np.cumprod([1, *strides[:-1]])
    return 1 + int(np.dot(np.asarray(kernels) - 1, jumps))


def field_by_counting(kernels, strides):
    seen = {0}  # inputs of the last layer's output 0, then of the layer before, and so on
    for kernel, stride in list(zip(kernels, strides, strict=True))[::-1]:
        seen = {place * int(stride) + offset for place in seen for offset in range(int(kernel))}
    return max(seen) - min(seen) + 1
