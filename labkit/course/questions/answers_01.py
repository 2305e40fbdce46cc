"""Answers to topic 01's questions: wrong ones as students give them, and right ones written in other ways."""

import numpy as np

# ------------------------------------------------------------------------------------------ a renderer's mask


def numbers_and_seen(segmentation):
    return segmentation & 0xFFFFFF, segmentation >= 0


def base_links_only(segmentation, class_of_body):
    """Compare the raw values with body numbers: whatever has link bits matches none."""
    labels = np.zeros(segmentation.shape, np.uint8)
    for body, c in enumerate(class_of_body):
        labels[segmentation == body] = c
    return labels


def nothing_is_the_last_body(segmentation, class_of_body):
    body, seen = numbers_and_seen(segmentation)
    return class_of_body[np.where(seen, body, -1)]


def link_for_body(segmentation, class_of_body):
    link = np.minimum(segmentation >> 24, len(class_of_body) - 1)
    return np.where(segmentation >= 0, class_of_body[link], 0)


def body_for_class(segmentation, class_of_body):
    body, seen = numbers_and_seen(segmentation)
    return np.where(seen, body, 0)


def one_body_further(segmentation, class_of_body):
    body, seen = numbers_and_seen(segmentation)
    return np.where(seen, class_of_body[np.where(seen, body, 0) - 1], 0)


def nothing_is_ignored(segmentation, class_of_body):
    return np.where(segmentation >= 0, labels_modulo(segmentation, class_of_body), 255)


def labels_modulo(segmentation, class_of_body):
    with_nothing = np.append(class_of_body, np.uint8(0))
    return with_nothing[np.where(segmentation < 0, -1, segmentation % (1 << 24))]


def labels_loops(segmentation, class_of_body):
    labels = np.zeros(segmentation.shape, np.uint8)
    for place, value in np.ndenumerate(segmentation):
        if value != -1:
            labels[place] = class_of_body[int(value) - ((int(value) >> 24) << 24)]
    return labels


def labels_by_body(segmentation, class_of_body):
    body, seen = numbers_and_seen(segmentation)
    return sum((seen & (body == number)) * int(c) for number, c in enumerate(class_of_body))


def labels_torch(segmentation, class_of_body):
    import torch

    s, table = torch.as_tensor(segmentation.astype(np.int64)), torch.as_tensor(class_of_body.astype(np.int64))
    return torch.where(s < 0, 0, table[torch.bitwise_and(s.clamp(min=0), 0xFFFFFF)])


# ------------------------------------------------------------------------------------------ one-hot and back


def classes_first(y, C):
    return np.moveaxis(one_hot_eye(y, C), -1, 0)


def ignored_as_background(y, C):
    return np.eye(C, dtype=np.uint8)[np.where(y == 255, 0, y)]


def ignored_as_last_class(y, C):
    return np.eye(C, dtype=np.uint8)[np.minimum(y, C - 1)]


def ignored_as_every_class(y, C):
    return one_hot_eye(y, C) | (y == 255)[..., None].astype(np.uint8)


def counted_from_one(y, C):
    return (y[..., None] == np.arange(1, C + 1)).astype(np.uint8)


def classes_that_occur(y, C):
    return (y[..., None] == np.unique(y[y != 255])).astype(np.uint8)


def one_hot_eye(y, C):
    return np.vstack([np.eye(C, dtype=np.uint8), np.zeros((1, C), np.uint8)])[np.where(y == 255, C, y)]


def one_hot_loops(y, C):
    Y = np.zeros((*y.shape, C), np.uint8)
    for place, c in np.ndenumerate(y):
        if c != 255:
            Y[(*place, c)] = 1
    return Y


def one_hot_planes(y, C):
    return np.stack([y == c for c in range(C)], axis=-1).astype(int)


def one_hot_torch(y, C):
    import torch

    y = torch.as_tensor(y.astype(np.int64))
    return torch.nn.functional.one_hot(torch.where(y == 255, C, y), C + 1)[..., :C]


def ignored_as_class(number):
    """Make the answer that gives pixels without a class this number."""

    def answer(Y):
        return np.where(Y.any(axis=-1), Y.argmax(axis=-1), number)

    return answer


def along_the_columns(Y):
    return np.where(Y.any(axis=1), Y.argmax(axis=1), 255)


def numbered_from_one(Y):
    return np.where(Y.any(axis=-1), Y.argmax(axis=-1) + 1, 255)


def first_zero(Y):
    return np.where(Y.any(axis=-1), Y.argmin(axis=-1), 255)


def from_one_hot_sum(Y):
    classes = np.arange(Y.shape[-1])
    return (Y * classes).sum(axis=-1) + 255 * (Y.sum(axis=-1) == 0)


def from_one_hot_loops(Y):
    y = np.full(Y.shape[:-1], 255, np.uint8)
    for *place, c in np.argwhere(Y):
        y[tuple(place)] = c
    return y


def from_one_hot_einsum(Y):
    C = Y.shape[-1]
    y = np.einsum("...c,c->...", Y.astype(int), np.arange(1, C + 1)) - 1
    return np.where(y < 0, 255, y)


def from_one_hot_torch(Y):
    import torch

    Y = torch.as_tensor(Y)
    return torch.where(Y.sum(-1) > 0, Y.to(torch.float32).argmax(-1), 255)


# ------------------------------------------------------------------------------------------ shares


def counts(y, C):
    return np.bincount(y[y != 255], minlength=C)


def of_all_pixels(y, C):
    return counts(y, C) / y.size


def without_background(y, C):
    n = counts(y, C)
    return np.append(0.0, n[1:] / max(n[1:].sum(), 1))


def mean_of_rows(y, C):
    """Average the shares of the image's rows, though some rows count fewer pixels."""
    return np.mean([counts(row, C) / np.count_nonzero(row != 255) for row in y if (row != 255).any()], axis=0)


def only_what_occurs(y, C):
    n = counts(y, C)
    return n[n > 0] / n.sum()


def inverse_shares(y, C):
    n = counts(y, C)
    return n.sum() / np.maximum(n, 1)


def shares_loops(y, C):
    n = [0] * C
    for c in y.ravel().tolist():
        if c != 255:
            n[c] += 1
    return np.array([count / sum(n) for count in n])


def shares_one_hot(y, C):
    n = np.einsum("vuc->c", one_hot_eye(y, C).astype(np.float64))
    return n / n.sum()


def shares_float32(y, C):
    return np.stack([np.mean(y[y != 255] == c, dtype=np.float32) for c in range(C)])


def shares_torch(y, C):
    import torch

    n = torch.bincount(torch.as_tensor(y[y != 255].astype(np.int64)), minlength=C).float()
    return n / n.sum()


# ------------------------------------------------------------------------------------------ resizing


def bilinear(y, height, width):
    import cv2

    return np.round(cv2.resize(y.astype(np.float32), (width, height), interpolation=cv2.INTER_LINEAR)).astype(np.uint8)


def from_the_corner(y, height, width):
    rows, columns = (np.arange(n) * old // n for n, old in zip((height, width), y.shape, strict=True))
    return y[rows[:, None], columns]


def corner_to_corner(y, height, width):
    rows, columns = (
        np.round(np.linspace(0, old - 1, n)).astype(int) for n, old in zip((height, width), y.shape, strict=True)
    )
    return y[rows[:, None], columns]


def sides_swapped(y, height, width):
    return resize_integers(y, width, height)


def refilled(y, height, width):
    return np.resize(y, (height, width))


def padded_or_cropped(y, height, width):
    H, W = y.shape
    return np.pad(y, ((0, max(height - H, 0)), (0, max(width - W, 0))), mode="edge")[:height, :width]


def resize_integers(y, height, width):
    H, W = y.shape
    rows = (2 * np.arange(height) + 1) * H // (2 * height)
    columns = (2 * np.arange(width) + 1) * W // (2 * width)
    return y[np.ix_(rows, columns)]


def resize_loops(y, height, width):
    (H, W), out = y.shape, np.empty((height, width), y.dtype)
    for i in range(height):
        for j in range(width):
            out[i, j] = y[int((i + 0.5) * H / height), int((j + 0.5) * W / width)]
    return out


def resize_take(y, height, width):
    H, W = y.shape
    rows = np.floor((np.arange(height) + 0.5) * H / height).astype(np.intp)
    return y.take(rows, axis=0).take(np.floor((np.arange(width) + 0.5) * W / width).astype(np.intp), axis=1)


def resize_torch(y, height, width):
    import torch

    H, W = y.shape
    rows = torch.div((2 * torch.arange(height) + 1) * H, 2 * height, rounding_mode="floor")
    columns = torch.div((2 * torch.arange(width) + 1) * W, 2 * width, rounding_mode="floor")
    return torch.as_tensor(y)[rows][:, columns]
