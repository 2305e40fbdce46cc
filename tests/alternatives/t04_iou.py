"""Right answers to the questions of 04_iou, written in other ways than the references."""

import numpy as np

from labkit.course.topics.t04_iou import iou_of
from labkit.course.topics.t04_iou.confusion_matrix import counted_pairs


def confusion_matrix__one_hot(y_true, y_pred, num_classes, ignore):
    rows, columns = counted_pairs(y_true, y_pred, ignore)
    Y = np.eye(num_classes, dtype=np.float32)
    return np.einsum("pi,pj->ij", Y[rows], Y[columns]).astype(np.int64)


def confusion_matrix__torch(y_true, y_pred, num_classes, ignore):
    import torch

    rows, columns = (torch.from_numpy(y) for y in counted_pairs(y_true, y_pred, ignore))
    return torch.bincount(rows * num_classes + columns, minlength=num_classes**2).reshape(num_classes, -1).numpy()


def iou__torch(n):
    import torch

    n = torch.as_tensor(n, dtype=torch.float32)
    return (n.diag() / (n.sum(0) + n.sum(1) - n.diag())).numpy()


def iou__float32(n):
    return iou_of(n.astype(np.float32)).astype(np.float32)


def mean_iou__torch(n_frames):
    import torch

    n = torch.as_tensor(n_frames).sum(0).to(torch.float32)
    return (n.diag() / (n.sum(0) + n.sum(1) - n.diag())).nanmean().item()


def merge_classes__blocks(n, group):
    classes = [np.flatnonzero(group == g) for g in np.unique(group)]
    return np.array([[n[np.ix_(rows, columns)].sum() for columns in classes] for rows in classes])


def merge_classes__bincount(n, group):
    G = group.max() + 1
    pairs = G * group[:, None] + group
    return np.bincount(pairs.ravel(), weights=n.ravel(), minlength=G * G).reshape(G, G).astype(int)


def trimap_band__one_class_at_a_time(y, width):
    window = (2 * width + 1, 2 * width + 1)
    near = []
    for c in np.unique(y[y != 255]):
        is_near = np.lib.stride_tricks.sliding_window_view(np.pad(y == c, width), window).any(axis=(-2, -1))
        near.append(is_near.astype(int))
    return (np.sum(near, axis=0) > 1) * (y != 255)


def trimap_band__torch(y, width):
    import torch

    classes = torch.unique(torch.from_numpy(y[y != 255]))
    masks = (torch.from_numpy(y)[None] == classes[:, None, None]).float()
    near = torch.nn.functional.max_pool2d(masks, 2 * width + 1, stride=1, padding=width)
    return (near.sum(0) > 1).numpy() & (y != 255)
