"""Answers to topic 09's questions of blobs: wrong ones as students give them, and right ones written in other ways."""

import numpy as np
import torch

# ------------------------------------------------------------------------------------------------------ make_blob


def scaled(x):
    return (x / np.float32(255)).astype(np.float32)


def blob_still_bgr(bgr):
    return scaled(bgr.transpose(2, 0, 1)[None])


def blob_in_bytes(bgr):
    return bgr[..., ::-1].transpose(2, 0, 1)[None].astype(np.float32)


def blob_reshaped(bgr):
    H, W, _ = bgr.shape
    return scaled(bgr[..., ::-1].reshape(1, 3, H, W))


def blob_rows_for_columns(bgr):
    H, W, _ = bgr.shape
    return scaled(bgr[..., ::-1].T.reshape(1, 3, H, W))


def blob_mirrored(bgr):
    return scaled(bgr[:, ::-1].transpose(2, 0, 1)[None])


def blob_from_minus_one(bgr):
    return 2 * scaled(bgr[..., ::-1].transpose(2, 0, 1)[None]) - 1


def blob_of_256(bgr):
    return (bgr[..., ::-1].transpose(2, 0, 1)[None] / 256.0).astype(np.float32)


def blob_loops(bgr):
    H, W, _ = bgr.shape
    blob = np.zeros((1, 3, H, W), np.float32)
    for v in range(H):
        for u in range(W):
            for c in range(3):
                blob[0, c, v, u] = bgr[v, u, 2 - c] / 255.0
    return blob


def blob_stacked(bgr):
    return np.stack([bgr[:, :, c].astype(np.float32) / 255 for c in (2, 1, 0)])[np.newaxis]


def blob_torch(bgr):
    return torch.from_numpy(bgr).flip(-1).permute(2, 0, 1).unsqueeze(0).float() / 255


def blob_einsum(bgr):
    swap = np.eye(3, dtype=np.float32)[::-1]
    return np.einsum("hwc,dc->dhw", bgr.astype(np.float32), swap / np.float32(255))[None]


# ------------------------------------------------------------------------------------------------ labels_from_blob


def labels_as_nhwc(scores):
    _, C, H, W = scores.shape
    return scores.reshape(H, W, C).argmax(axis=-1)


def labels_column_by_column(scores):
    _, C, H, W = scores.shape
    return scores.reshape(C, W, H).argmax(axis=0).T


def last_of_equals(scores):
    return scores.shape[1] - 1 - scores[0, ::-1].argmax(axis=0)


def worst_class(scores):
    return scores[0].argmin(axis=0)


def without_class_0(scores):
    return scores[0, 1:].argmax(axis=0) + 1


def best_scores(scores):
    return scores[0].max(axis=0)


def classes_from_1(scores):
    return scores[0].argmax(axis=0) + 1


def above_zero(scores):
    return np.where(scores[0].max(axis=0) > 0, scores[0].argmax(axis=0), 0)


def labels_loops(scores):
    _, C, H, W = scores.shape
    labels = np.zeros((H, W), np.uint8)
    for v in range(H):
        for u in range(W):
            for c in range(1, C):
                if scores[0, c, v, u] > scores[0, labels[v, u], v, u]:
                    labels[v, u] = c
    return labels


def labels_in_memory(scores):
    H, W = scores.shape[2:]
    data = scores.ravel()
    return np.array([data[i :: H * W].argmax() for i in range(H * W)], np.uint8).reshape(H, W)


def labels_channels_last(scores):
    return np.argmax(np.moveaxis(scores[0], 0, -1), axis=-1)


def labels_torch(scores):
    best = torch.from_numpy(scores)[0]
    return (best == best.amax(dim=0)).int().argmax(dim=0)


# --------------------------------------------------------------------------------------------------------- enlarge


def resize_swapped(labels, size):
    return resize_nearest(labels, size[::-1])


def resize_nearest(labels, size):
    W, H = size
    h, w = labels.shape
    return labels[np.arange(H)[:, None] * h // H, np.arange(W) * w // W]


def resize_bilinear(labels, size):
    W, H = size
    image = torch.from_numpy(labels.astype(np.float32))[None, None]
    return torch.nn.functional.interpolate(image, (H, W), mode="bilinear")[0, 0].round().numpy()


def resize_rounded(labels, size):
    W, H = size
    h, w = labels.shape
    rows = np.minimum(np.round(np.arange(H) * h / H).astype(int), h - 1)
    columns = np.minimum(np.round(np.arange(W) * w / W).astype(int), w - 1)
    return labels[rows[:, None], columns]


def resize_corner_to_corner(labels, size):
    W, H = size
    h, w = labels.shape
    rows, columns = np.linspace(0, h - 1, H).round().astype(int), np.linspace(0, w - 1, W).round().astype(int)
    return labels[rows[:, None], columns]


def resize_tiled(labels, size):
    W, H = size
    return np.resize(labels, (H, W))


def resize_one_factor(labels, size):
    W, H = size
    h, w = labels.shape
    factor = max(W // w, 1)
    rows = np.minimum(np.arange(H) // factor, h - 1)
    return labels[rows[:, None], np.minimum(np.arange(W) // factor, w - 1)]


def resize_loops(labels, size):
    W, H = size
    h, w = labels.shape
    out = np.zeros((H, W), labels.dtype)
    for v in range(H):
        for u in range(W):
            out[v, u] = labels[int(v * h / H), int(u * w / W)]
    return out


def resize_take(labels, size):
    W, H = size
    h, w = labels.shape
    return labels.take(np.arange(H) * h // H, axis=0).take(np.arange(W) * w // W, axis=1)


def resize_one_hot(labels, size):
    W, H = size
    h, w = labels.shape
    rows = np.eye(h, dtype=int)[np.arange(H) * h // H]
    columns = np.eye(w, dtype=int)[np.arange(W) * w // W]
    return np.einsum("ij,jk,lk->il", rows, labels.astype(int), columns)
