"""Answers to topic 09's questions, of colours and regions: wrong ones as students give them, right ones otherwise."""

import numpy as np
import torch

# -------------------------------------------------------------------------------------------------------- hsv_mask


def between(hsv, lower, upper):
    return (hsv >= np.asarray(lower)) & (hsv <= np.asarray(upper))


def mask_without_going_round(hsv, lower, upper):
    return between(hsv, lower, upper).all(axis=-1)


def mask_of_any_channel(hsv, lower, upper):
    inside = between(hsv, lower, upper)
    if lower[0] > upper[0]:
        inside[..., 0] = (hsv[..., 0] >= lower[0]) | (hsv[..., 0] <= upper[0])
    return inside.any(axis=-1)


def mask_without_bounds(hsv, lower, upper):
    h, rest = hsv[..., 0], (hsv[..., 1:] > lower[1:]) & (hsv[..., 1:] < upper[1:])
    hue = (h > lower[0]) & (h < upper[0]) if lower[0] <= upper[0] else (h > lower[0]) | (h < upper[0])
    return hue & rest.all(axis=-1)


def mask_with_swapped_bounds(hsv, lower, upper):
    low, high = np.minimum(lower, upper), np.maximum(lower, upper)
    return between(hsv, low, high).all(axis=-1)


def mask_of_hue(hsv, lower, upper):
    h = hsv[..., 0]
    return (h >= lower[0]) & (h <= upper[0]) if lower[0] <= upper[0] else (h >= lower[0]) | (h <= upper[0])


def mask_in_degrees(hsv, lower, upper):
    doubled = hsv.astype(int) * (2, 1, 1)
    return mask_loops(doubled, lower, upper)


def mask_always_round(hsv, lower, upper):
    h = hsv[..., 0]
    return ((h >= lower[0]) | (h <= upper[0])) & between(hsv, lower, upper)[..., 1:].all(axis=-1)


def mask_loops(hsv, lower, upper):
    mask = np.zeros(hsv.shape[:2], bool)
    for v in range(hsv.shape[0]):
        for u in range(hsv.shape[1]):
            h, s, x = (int(value) for value in hsv[v, u])
            round_ = lower[0] > upper[0]
            hue = (h >= lower[0] or h <= upper[0]) if round_ else lower[0] <= h <= upper[0]
            mask[v, u] = hue and lower[1] <= s <= upper[1] and lower[2] <= x <= upper[2]
    return mask


def mask_modulo(hsv, lower, upper):
    shifted = (hsv[..., 0].astype(int) - int(lower[0])) % 180 <= (int(upper[0]) - int(lower[0])) % 180
    return shifted & between(hsv, lower, upper)[..., 1:].all(axis=-1)


def mask_by_table(hsv, lower, upper):
    hues = np.zeros(256, bool)
    hue = int(lower[0])
    while True:
        hues[hue] = True
        if hue == int(upper[0]):
            break
        hue = (hue + 1) % 180
    s, v = hsv[..., 1], hsv[..., 2]
    return hues[hsv[..., 0]] * (s >= lower[1]) * (s <= upper[1]) * (v >= lower[2]) * (v <= upper[2])


def mask_torch(hsv, lower, upper):
    x = torch.from_numpy(hsv.astype(np.int32))
    low, high = (torch.from_numpy(np.asarray(b).astype(np.int32)) for b in (lower, upper))
    above, below = x >= low, x <= high
    hue = above[..., 0] | below[..., 0] if low[0] > high[0] else above[..., 0] & below[..., 0]
    return hue & (above & below)[..., 1:].all(dim=-1)


# -------------------------------------------------------------------------------------------------- measure_pieces


def pieces_by_argwhere(pieces, first=1):
    for i in range(first, pieces.max() + 1):
        yield np.argwhere(pieces == i)


def measured(pieces, area=len, centroid=lambda vu: vu.mean(axis=0)[::-1], box=None, first=1):
    box = box or (lambda vu: (*vu.min(axis=0)[::-1], *vu.max(axis=0)[::-1]))
    found = list(pieces_by_argwhere(pieces, first))
    return (
        np.array([area(vu) for vu in found]),
        np.array([centroid(vu) for vu in found], float).reshape(-1, 2),
        np.array([box(vu) for vu in found]).reshape(-1, 4),
    )


def measured_rows_first(pieces):
    return measured(pieces, centroid=lambda vu: vu.mean(axis=0), box=lambda vu: (*vu.min(axis=0), *vu.max(axis=0)))


def measured_with_open_boxes(pieces):
    return measured(pieces, box=lambda vu: (*vu.min(axis=0)[::-1], *(vu.max(axis=0)[::-1] + 1)))


def measured_with_the_background(pieces):
    return measured(pieces, first=0)


def measured_by_boxes(pieces):
    return measured(pieces, centroid=lambda vu: (vu.min(axis=0) + vu.max(axis=0))[::-1] / 2)


def measured_box_areas(pieces):
    return measured(pieces, area=lambda vu: np.prod(np.ptp(vu, axis=0) + 1))


def measured_widths(pieces):
    return measured(pieces, box=lambda vu: (*vu.min(axis=0)[::-1], *(np.ptp(vu, axis=0)[::-1] + 1)))


def measured_loops(pieces):
    n = int(pieces.max())
    area, total = [0] * n, [[0, 0] for _ in range(n)]
    box = [[10**9, 10**9, -1, -1] for _ in range(n)]
    for v in range(pieces.shape[0]):
        for u in range(pieces.shape[1]):
            i = int(pieces[v, u]) - 1
            if i >= 0:
                area[i] += 1
                total[i][0] += u
                total[i][1] += v
                box[i] = [min(box[i][0], u), min(box[i][1], v), max(box[i][2], u), max(box[i][3], v)]
    area = np.array(area)
    return area, np.array(total) / area[:, None], np.array(box)


def measured_bincount(pieces):
    flat, n = pieces.ravel(), int(pieces.max())
    v, u = (grid.ravel() for grid in np.mgrid[: pieces.shape[0], : pieces.shape[1]])
    area = np.bincount(flat, minlength=n + 1)[1:]
    middle = np.stack([np.bincount(flat, x, n + 1)[1:] / area for x in (u, v)], axis=1)
    box = np.array([[f(x[flat == i]) for f in (np.min, np.max) for x in (u, v)] for i in range(1, n + 1)])
    return area, middle.astype(np.float32), box


def measured_einsum(pieces):
    H, W = pieces.shape
    member = pieces[None] == np.arange(1, pieces.max() + 1)[:, None, None]
    area = np.einsum("nhw->n", member.astype(np.int64))
    middle = np.stack([np.einsum("nhw,w->n", member, np.arange(W)), np.einsum("nhw,h->n", member, np.arange(H))], 1)
    columns, rows = member.any(axis=1), member.any(axis=2)
    last = W - 1 - columns[:, ::-1].argmax(axis=1), H - 1 - rows[:, ::-1].argmax(axis=1)
    return area, middle / area[:, None], np.stack([columns.argmax(axis=1), rows.argmax(axis=1), *last], axis=1)


# --------------------------------------------------------------------------------------------------- choose_region


def distances(features, mean, covariance):
    off = features - mean
    return (off @ np.linalg.inv(covariance) * off).sum(axis=1)


def chosen(distance, allowed):
    return 1 + int(np.where(allowed, distance, np.inf).argmin()) if np.any(allowed) else 0


def chosen_euclidean(features, mean, covariance, allowed):
    return chosen(((features - mean) ** 2).sum(axis=1), allowed)


def chosen_by_spread(features, mean, covariance, allowed):
    return chosen(((features - mean) ** 2 / np.diag(covariance)).sum(axis=1), allowed)


def chosen_without_inverse(features, mean, covariance, allowed):
    off = features - mean
    return chosen((off @ covariance * off).sum(axis=1), allowed)


def chosen_unlikeliest(features, mean, covariance, allowed):
    return 1 + int(np.where(allowed, distances(features, mean, covariance), -np.inf).argmax()) if allowed.any() else 0


def chosen_from_0(features, mean, covariance, allowed):
    return chosen(distances(features, mean, covariance), allowed) - 1


def chosen_although_forbidden(features, mean, covariance, allowed):
    return chosen(distances(features, mean, covariance), np.ones(len(features), bool)) if allowed.any() else 0


def chosen_among_the_allowed(features, mean, covariance, allowed):
    return 1 + int(distances(features[allowed], mean, covariance).argmin()) if allowed.any() else 0


def chosen_always(features, mean, covariance, allowed):
    return 1 + int(np.where(allowed, distances(features, mean, covariance), np.inf).argmin())


def chosen_loops(features, mean, covariance, allowed):
    best, number, P = np.inf, 0, np.linalg.inv(covariance)
    for i in range(len(features)):
        off = features[i] - mean
        if allowed[i] and off @ P @ off < best:
            best, number = off @ P @ off, i + 1
    return number


def chosen_einsum(features, mean, covariance, allowed):
    off = features - mean
    return chosen(np.einsum("ni,ij,nj->n", off, np.linalg.inv(covariance), off), allowed)


def chosen_whitened(features, mean, covariance, allowed):
    white = np.linalg.solve(np.linalg.cholesky(covariance), (features - mean).T)
    return chosen((white**2).sum(axis=0), allowed)


def chosen_torch(features, mean, covariance, allowed):
    off = torch.from_numpy(features - mean)
    distance = (off * torch.linalg.solve(torch.from_numpy(covariance), off.T).T).sum(dim=1)
    distance[~torch.from_numpy(allowed)] = torch.inf
    return distance.argmin() + 1 if allowed.any() else 0
