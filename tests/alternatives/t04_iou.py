"""Right answers to the questions of 04_iou, written in other ways than the references."""

import numpy as np

from labkit.course.questions.t04_iou import iou_of
from labkit.course.questions.t04_iou.confusion_matrix import counted_pairs, pair_count

# ---------- confusion_matrix


def confusion_loops(y_true, y_pred, num_classes, ignore):
    n = np.zeros((num_classes, num_classes), np.int64)
    for i, j in zip(y_true.ravel().tolist(), y_pred.ravel().tolist(), strict=True):
        if i != ignore:
            n[i, j] += 1
    return n


def confusion_bincount(y_true, y_pred, num_classes, ignore):
    return pair_count(*counted_pairs(y_true, y_pred, ignore), num_classes)


def confusion_one_hot(y_true, y_pred, num_classes, ignore):
    rows, columns = counted_pairs(y_true, y_pred, ignore)
    Y = np.eye(num_classes, dtype=np.float32)
    return np.einsum("pi,pj->ij", Y[rows], Y[columns]).astype(np.int64)


def confusion_torch(y_true, y_pred, num_classes, ignore):
    import torch

    rows, columns = (torch.from_numpy(y) for y in counted_pairs(y_true, y_pred, ignore))
    return torch.bincount(rows * num_classes + columns, minlength=num_classes**2).reshape(num_classes, -1).numpy()


# ---------- iou


def iou_loops(n):
    scores = []
    for c in range(len(n)):
        false_positive = sum(int(n[i, c]) for i in range(len(n)) if i != c)
        false_negative = sum(int(n[c, j]) for j in range(len(n)) if j != c)
        union = int(n[c, c]) + false_positive + false_negative
        scores.append(int(n[c, c]) / union if union else float("nan"))
    return np.array(scores)


def iou_einsum(n):
    correct = np.einsum("ii->i", n)
    union = np.einsum("ij->j", n) + np.einsum("ij->i", n) - correct
    return np.divide(correct, union, out=np.full(len(n), np.nan), where=union > 0)


def iou_torch(n):
    import torch

    n = torch.as_tensor(n, dtype=torch.float32)
    return (n.diag() / (n.sum(0) + n.sum(1) - n.diag())).numpy()


def iou_float32(n):
    return iou_of(n.astype(np.float32)).astype(np.float32)


# ---------- precision_recall


def precision_recall_loops(n):
    precision, recall = [], []
    for c in range(len(n)):
        predicted, true = sum(int(x) for x in n[:, c]), sum(int(x) for x in n[c])
        precision.append(int(n[c, c]) / predicted if predicted else float("nan"))
        recall.append(int(n[c, c]) / true if true else float("nan"))
    return np.array(precision), np.array(recall)


def precision_recall_einsum(n):
    shape = len(n)
    correct, predicted, true = np.einsum("ii->i", n), np.einsum("ij->j", n), np.einsum("ij->i", n)
    return tuple(np.divide(correct, whole, out=np.full(shape, np.nan), where=whole > 0) for whole in (predicted, true))


def precision_recall_torch(n):
    import torch

    n = torch.as_tensor(n, dtype=torch.float32)
    return (n.diag() / n.sum(0)).numpy(), (n.diag() / n.sum(1)).numpy()


# ---------- mean_iou


def mean_iou_loops(n_frames):
    C, scores = n_frames.shape[1], []
    for c in range(C):
        union = intersection = 0
        for n in n_frames:
            intersection += int(n[c, c])
            union += int(n[c].sum() + n[:, c].sum() - n[c, c])
        if union:
            scores.append(intersection / union)
    return sum(scores) / len(scores)


def mean_iou_einsum(n_frames):
    correct = np.einsum("fii->i", n_frames)
    union = np.einsum("fij->i", n_frames) + np.einsum("fij->j", n_frames) - correct
    return (correct[union > 0] / union[union > 0]).mean()


def mean_iou_torch(n_frames):
    import torch

    n = torch.as_tensor(n_frames).sum(0).to(torch.float32)
    return (n.diag() / (n.sum(0) + n.sum(1) - n.diag())).nanmean().item()


# ---------- boundary_band


def band_loops(mask, width):
    H, W = mask.shape
    band = np.zeros((H, W), bool)
    for v, u in np.argwhere(mask):
        whole = v >= width and u >= width and v + width < H and u + width < W
        window = mask[max(v - width, 0) : v + width + 1, max(u - width, 0) : u + width + 1]
        band[v, u] = not (whole and window.all())
    return band


def band_repeated_erosion(mask, width):
    inside = mask
    for _ in range(width):
        framed = np.pad(inside, 1)
        across = framed[:, :-2] & framed[:, 1:-1] & framed[:, 2:]
        inside = across[:-2] & across[1:-1] & across[2:]
    return mask & ~inside


def band_windows(mask, width):
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(mask, width), (2 * width + 1, 2 * width + 1))
    return mask & ~windows.all(axis=(2, 3))


def band_torch(mask, width):
    import torch

    outside = torch.nn.functional.pad(torch.from_numpy(~mask).float()[None, None], [width] * 4, value=1.0)
    near = torch.nn.functional.max_pool2d(outside, 2 * width + 1, stride=1)[0, 0] > 0.5
    return mask & near.numpy()


ALTERNATIVES = {
    "confusion_matrix": (confusion_loops, confusion_bincount, confusion_one_hot, confusion_torch),
    "iou": (iou_loops, iou_einsum, iou_torch, iou_float32),
    "precision_recall": (precision_recall_loops, precision_recall_einsum, precision_recall_torch),
    "mean_iou": (mean_iou_loops, mean_iou_einsum, mean_iou_torch),
    "boundary_band": (band_loops, band_repeated_erosion, band_windows, band_torch),
}
