"""Right answers to the questions of 09_other_stacks, written in other ways than the references."""

import numpy as np
import torch


def engine_contract__torch(reference, other, tolerance):
    z, y = torch.from_numpy(np.array(reference)), torch.from_numpy(np.array(other))
    best = z.topk(2, dim=0).values
    changed = ((z.argmax(0) != y.argmax(0)) | y.isnan().any(0)).double().mean()
    return ((z - y).abs() <= tolerance).all(), changed, (best[0] - best[1] <= 2 * tolerance).double().mean()


def engine_contract__without_the_best(reference, other, tolerance):
    labels = reference.argmax(axis=0)
    rest = np.where(np.arange(len(reference))[:, None, None] == labels, -np.inf, reference)
    margin = reference.max(axis=0) - rest.max(axis=0)
    kept = bool(np.all(np.abs(other - reference) <= tolerance))
    numbers = np.isfinite(other).all(axis=0)
    same = np.mean(numbers & (labels == np.where(numbers, other, 0.0).argmax(axis=0)))
    return kept, 1.0 - same, np.count_nonzero(margin <= 2 * tolerance) / margin.size


def hsv_mask__torch(hsv, lower, upper):
    x = torch.from_numpy(hsv.astype(np.int32))
    low, high = (torch.from_numpy(np.asarray(b).astype(np.int32)) for b in (lower, upper))
    above, below = x >= low, x <= high
    hue = above[..., 0] | below[..., 0] if low[0] > high[0] else above[..., 0] & below[..., 0]
    return hue & (above & below)[..., 1:].all(dim=-1)
