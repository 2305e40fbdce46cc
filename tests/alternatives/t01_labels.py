"""Right answers to the questions of 01_labels, written in other ways than the references."""

import numpy as np


def class_shares__torch(y, C):
    import torch

    n = torch.stack([torch.bincount(torch.as_tensor(image[image != 255].astype(np.int64)), minlength=C) for image in y])
    return n.sum(dim=0) / (n.sum(dim=1) @ (n > 0).long()).clamp(min=1)


def labels_from_segmentation__torch(segmentation, class_of_part):
    import torch

    s, table = torch.as_tensor(segmentation.astype(np.int64)), torch.as_tensor(class_of_part.astype(np.int64))
    at = s.clamp(min=0)
    return torch.where(s < 0, 0, table[torch.bitwise_and(at, 0xFFFFFF), at // 2**24])


def one_hot__torch(y, C):
    import torch

    y = torch.as_tensor(y.astype(np.int64))
    return torch.nn.functional.one_hot(torch.where(y == 255, C, y), C + 1)[..., :C].permute(0, 3, 1, 2)
