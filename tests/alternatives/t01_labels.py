"""Right answers to the questions of 01_labels, written in other ways than the references."""

import numpy as np


def class_shares__torch(y, C):
    import torch

    n = torch.bincount(torch.as_tensor(y[y != 255].astype(np.int64)), minlength=C).float()
    return n / n.sum()


def labels_from_segmentation__torch(segmentation, class_of_body):
    import torch

    s, table = torch.as_tensor(segmentation.astype(np.int64)), torch.as_tensor(class_of_body.astype(np.int64))
    return torch.where(s < 0, 0, table[torch.bitwise_and(s.clamp(min=0), 0xFFFFFF)])


def one_hot__torch(y, C):
    import torch

    y = torch.as_tensor(y.astype(np.int64))
    return torch.nn.functional.one_hot(torch.where(y == 255, C, y), C + 1)[..., :C]
