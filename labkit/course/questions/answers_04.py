"""Answers to topic 04's questions: wrong ones as students give them, and right ones written in other ways."""

import numpy as np

# ------------------------------------------------------------------------------------------ the confusion matrix


def counted_pairs(y_true, y_pred, ignore):
    counted = y_true != ignore
    return y_true[counted].astype(int), y_pred[counted].astype(int)


def pair_count(rows, columns, num_classes):
    return np.bincount(rows * num_classes + columns, minlength=num_classes**2).reshape(num_classes, num_classes)


def transposed(y_true, y_pred, num_classes, ignore):
    rows, columns = counted_pairs(y_true, y_pred, ignore)
    return pair_count(columns, rows, num_classes)


def each_pair_once(y_true, y_pred, num_classes, ignore):
    n = np.zeros((num_classes, num_classes), np.int64)
    n[counted_pairs(y_true, y_pred, ignore)] += 1
    return n


def ignored_as_class_0(y_true, y_pred, num_classes, ignore):
    rows = np.where(y_true == ignore, 0, y_true).astype(int)
    return pair_count(rows.ravel(), y_pred.ravel().astype(int), num_classes)


def prediction_ignored_too(y_true, y_pred, num_classes, ignore):
    rows, columns = counted_pairs(y_true, y_pred, ignore)
    return pair_count(rows[columns != ignore], columns[columns != ignore], num_classes)


def shares_of_rows(y_true, y_pred, num_classes, ignore):
    n = pair_count(*counted_pairs(y_true, y_pred, ignore), num_classes)
    return n / np.maximum(n.sum(axis=1, keepdims=True), 1)


def overflowing_bytes(y_true, y_pred, num_classes, ignore):
    counted = y_true != ignore
    pair = y_true[counted] * np.uint8(num_classes) + y_pred[counted]
    return np.bincount(pair, minlength=num_classes**2)[: num_classes**2].reshape(num_classes, num_classes)


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


# ------------------------------------------------------------------------------------------------------------ IoU


def parts(n):
    """The true positives, all that is predicted and all that is true, by class, as floats."""
    n = np.asarray(n, np.float64)
    return np.diagonal(n), n.sum(axis=0), n.sum(axis=1)


def divide(part, whole, empty=np.nan):
    return np.where(whole > 0, part / np.where(whole > 0, whole, 1.0), empty)


def iou_of(n, empty=np.nan):
    correct, predicted, true = parts(n)
    return divide(correct, predicted + true - correct, empty)


def recall_of(n):
    correct, _, true = parts(n)
    return divide(correct, true)


def precision_of(n):
    correct, predicted, _ = parts(n)
    return divide(correct, predicted)


def dice(n):
    correct, predicted, true = parts(n)
    return divide(2.0 * correct, predicted + true)


def union_counts_the_overlap_twice(n):
    correct, predicted, true = parts(n)
    return divide(correct, predicted + true)


def share_of_all_pixels(n):
    return np.diagonal(n) / n.sum()


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


# --------------------------------------------------------------------------------------------- precision and recall


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


def false_ones_over_true_ones(n):
    correct, predicted, true = parts(n)
    return divide(predicted - correct, predicted), divide(true - correct, true)


def over_all_pixels(n):
    correct = np.diagonal(n)
    return correct / n.sum(), correct / n.sum()


def off_the_diagonal_only(n):
    """Divide by FP and FN alone, as if TP were not among what is predicted, or true."""
    correct, predicted, true = parts(n)
    return divide(correct, predicted - correct), divide(correct, true - correct)


# ------------------------------------------------------------------------------------------ mean IoU of many frames


def mean_of_frames_means(n_frames):
    return np.mean([np.nanmean(iou_of(n)) for n in n_frames if n.sum()])


def mean_of_frames_by_class(n_frames):
    scores = np.array([iou_of(n) for n in n_frames])
    seen = ~np.isnan(scores).all(axis=0)
    return np.nanmean(scores[:, seen], axis=0).mean()


def sum_over_sum(n_frames):
    correct, predicted, true = parts(n_frames.sum(axis=0))
    return correct.sum() / (predicted + true - correct).sum()


def truth_only(n_frames):
    n = n_frames.sum(axis=0)
    return iou_of(n)[n.sum(axis=1) > 0].mean()


def accuracy(n_frames):
    n = n_frames.sum(axis=0)
    return np.trace(n) / n.sum()


def weighted_by_frequency(n_frames):
    n = n_frames.sum(axis=0)
    return np.nansum(iou_of(n) * n.sum(axis=1)) / n.sum()


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


# -------------------------------------------------------------------------------------------------- boundary bands


def grown(mask, down, right):
    """Mark the pixels with a pixel of the mask within `down` rows and `right` columns."""
    H, W = mask.shape
    framed = np.pad(mask, ((down, down), (right, right)))
    shifts = [framed[v : v + H, u : u + W] for v in range(2 * down + 1) for u in range(2 * right + 1)]
    return np.logical_or.reduce(shifts)


def border_is_no_edge(mask, width):
    return mask & grown(~mask, width, width)


def framed(mask, width):
    """The complement of the mask in an image that is `width` larger on each side, all of that outside the mask."""
    return np.pad(~mask, width, constant_values=True)


def cropped(image, width):
    return image[width : image.shape[0] - width, width : image.shape[1] - width]


def band_with_window(mask, down, right):
    reach = max(down, right)
    return mask & cropped(grown(framed(mask, reach), down, right), reach)


def outer_band(mask, width):
    return grown(mask, width, width) & ~mask


def both_sides(mask, width):
    return outer_band(mask, width) | band_with_window(mask, width, width)


def the_inside(mask, width):
    return mask & ~band_with_window(mask, width, width)


def cross_window(mask, width):
    return band_with_window(mask, width, 0) | band_with_window(mask, 0, width)


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
