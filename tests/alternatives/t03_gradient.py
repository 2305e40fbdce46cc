"""Right answers to the questions of 03_gradient, written in other ways than the references."""

import numpy as np


def votes_loss__loops(votes, instances, beta):
    things = sorted({int(k) for k in instances.ravel()} - {0, 255})
    loss, grad = 0.0, np.zeros_like(votes)
    for k in things:
        pixels = [(v, u) for v in range(instances.shape[0]) for u in range(instances.shape[1]) if instances[v, u] == k]
        middle_v, middle_u = np.mean(pixels, axis=0)
        for v, u in pixels:
            e = votes[v, u] - np.array([middle_u - u, middle_v - v])
            r = np.hypot(*e)
            if r <= beta:
                loss += r * r / (2 * beta) / len(pixels) / len(things)
                grad[v, u] = e / beta / len(pixels) / len(things)
            else:
                loss += (r - beta / 2) / len(pixels) / len(things)
                grad[v, u] = e / r / len(pixels) / len(things)
    return loss, grad


def votes_loss__torch(votes, instances, beta):
    """By autograd, the length kept away from the square root's steep end."""
    import torch

    d = torch.tensor(votes, requires_grad=True)
    things = [k for k in np.unique(instances) if 0 < k < 255]
    if not things:
        return 0.0, np.zeros_like(votes)
    total = 0.0
    for k in things:
        v, u = np.nonzero(instances == k)
        e = d[v, u] - torch.tensor(np.stack([u.mean() - u, v.mean() - v], axis=1))
        square = (e**2).sum(dim=1)
        r = square.clamp(min=1e-30).sqrt()
        total = total + torch.where(r <= beta, square / (2 * beta), r - beta / 2).mean()
    loss = total / len(things)
    loss.backward()
    return loss.item(), d.grad


def votes_loss__bincount(votes, instances, beta):
    """All things at once."""
    v, u = np.nonzero((instances != 0) & (instances != 255))
    grad = np.zeros_like(votes)
    if len(v) == 0:
        return np.float64(0.0), grad
    _, k, n = np.unique(instances[v, u], return_inverse=True, return_counts=True)
    middle = np.stack([np.bincount(k, u), np.bincount(k, v)], axis=1) / n[:, None]
    e = votes[v, u] + np.stack([u, v], axis=1) - middle[k]
    r = np.linalg.norm(e, axis=1)
    part = 1.0 / n[k] / len(n)
    grad[v, u] = part[:, None] * np.where((r <= beta)[:, None], e / beta, e / np.maximum(r, 1e-12)[:, None])
    return part @ np.where(r <= beta, r**2 / (2 * beta), r - beta / 2), grad


def group__loops(foreground, votes, cell, least):
    H, W = foreground.shape
    rows, columns = (H + cell - 1) // cell, (W + cell - 1) // cell
    voters = {}
    for v in range(H):
        for u in range(W):
            if foreground[v, u] > 0.5:
                row, column = int(np.floor((v + votes[v, u, 1]) / cell)), int(np.floor((u + votes[v, u, 0]) / cell))
                if 0 <= row < rows and 0 <= column < columns:
                    voters.setdefault((row, column), []).append((v, u))
    numbers, number = np.zeros((H, W), np.int32), 0
    while True:
        best, peak = 0, None
        scores = {}
        for (r, c), pixels in voters.items():
            for i in (-1, 0, 1):
                for j in (-1, 0, 1):
                    scores[r + i, c + j] = scores.get((r + i, c + j), 0) + (2 - abs(i)) * (2 - abs(j)) * len(pixels)
        for place in sorted(scores):
            if scores[place] > best and 0 <= place[0] < rows and 0 <= place[1] < columns:
                best, peak = scores[place], place
        if peak is None:
            return numbers
        around = [(peak[0] + i, peak[1] + j) for i in (-1, 0, 1) for j in (-1, 0, 1)]
        pixels = [pixel for place in around for pixel in voters.pop(place, ())]
        if len(pixels) < least:
            return numbers
        number += 1
        for v, u in pixels:
            numbers[v, u] = number


def group__bincount(foreground, votes, cell, least):
    """With a running histogram in one row, and a frame of empty cells around it."""
    shape = -(-np.array(foreground.shape) // cell) + 2
    v, u = np.where(foreground > 0.5)
    at = np.floor((np.stack([v, u]) + votes[v, u, ::-1].T) / cell).astype(int) + 1
    inside = ((at > 0) & (at < shape[:, None] - 1)).all(axis=0)
    v, u, at = v[inside], u[inside], at[:, inside]
    numbers = np.zeros(foreground.shape, np.uint16)
    for number in range(1, foreground.size + 1):
        if len(v) == 0:
            break
        n = np.bincount(at[0] * shape[1] + at[1], minlength=shape.prod()).reshape(shape).astype(float)
        for axis in (0, 1):
            n = 2 * n + np.roll(n, 1, axis) + np.roll(n, -1, axis)
        peak = np.array(np.unravel_index(n[1:-1, 1:-1].argmax(), shape - 2)) + 1
        near = (np.abs(at - peak[:, None]) <= 1).all(axis=0)
        if near.sum() < least:
            break
        numbers[v[near], u[near]] = number
        v, u, at = v[~near], u[~near], at[:, ~near]
    return numbers
