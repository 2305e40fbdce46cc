"""The labelled images that a network is trained on, decoded once. Topics 03 and 06."""

from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Integer, UInt8
from tqdm.auto import tqdm

from labkit.frame import RGBDFrame
from labkit.geometry.projection import back_project_to_base
from labkit.labels import CLASSES, IGNORE, SURFACE, unknown_number
from labkit.support.validation import check_labels, check_rgb, require


class ImagesInMemory:
    """Images and labels of a dataset, decoded once: 4,000 of 320x240 take 1.2 GB, 2.5 with depth.

    dataset: a sequence of (rgb uint8 (H, W, 3), labels (H, W)), arrays or tensors, or of RGBDFrame with labels.
    rgb: uint8 tensor (N, H, W, 3); y: uint8 tensor (N, H, W). depth: keep depth and cameras, too, for a network that
    looks at geometry; a frame that does not state its table's height gets that of the pixels labelled surface.
    instances: keep them, too, for a network that tells things apart: uint8, each frame's things in the order of their
    numbers, 255 where nobody knows. Raises ValueError if the dataset is empty or has no frames though depth is asked
    for, its images differ in size, a label is out of range, or a frame has more than 254 things.
    """

    def __init__(
        self,
        dataset: Sequence,
        num_classes: int = len(CLASSES),
        name: str = "dataset",
        progress: bool = True,
        depth: bool = False,
        instances: bool = False,
    ):
        require(name, len(dataset) > 0, "at least one image", "none")
        size = image_and_labels(f"{name}[0]", dataset[0])[1].shape
        rgb, y = np.empty((len(dataset), *size, 3), np.uint8), np.empty((len(dataset), *size), np.uint8)
        self.depth = np.empty((len(dataset), *size), np.float32) if depth else None
        self.cameras = np.empty((len(dataset), 26)) if depth else None  # K, T_base_cam and the table's height in a row
        self.instances = np.full((len(dataset), *size), IGNORE, np.uint8) if instances else None
        for i in tqdm(range(len(dataset)), desc=f"reading {name}", unit="image", disable=not progress):
            item = dataset[i]
            image, labels = image_and_labels(f"{name}[{i}]", item)
            require(name, labels.shape == size, f"images of one size, {size}", f"{labels.shape} at {i}")
            rgb[i], y[i] = image, check_labels(f"{name}[{i}]", labels, num_classes)
            if depth:
                require(f"{name}[{i}]", isinstance(item, RGBDFrame), "an RGBDFrame, for its depth", type(item).__name__)
                self.depth[i] = item.depth
                self.cameras[i] = [*item.K.ravel(), *item.T_base_cam.ravel(), table_height(item)]
            if instances and getattr(item, "instances", None) is not None:
                self.instances[i] = in_8_bits(f"{name}[{i}]", item.instances)
        self.rgb, self.y = torch.from_numpy(rgb), torch.from_numpy(y)

    def pictures(self, chosen: Sequence[int]) -> list:
        """The frames of these numbers, or their RGB images if depth was not kept: what an engine takes."""
        if self.depth is None:
            return [self.rgb[i].numpy() for i in chosen]
        cameras = [np.split(self.cameras[i], [9, 25]) for i in chosen]
        return [
            RGBDFrame(
                self.rgb[i].numpy(),
                self.depth[i],
                K.reshape(3, 3),
                T.reshape(4, 4),
                self.y[i].numpy(),
                None if self.instances is None else self.instances[i],
                table_z=float(z[0]),
            )
            for i, (K, T, z) in zip(chosen, cameras, strict=True)
        ]

    def __len__(self) -> int:
        return len(self.y)

    def class_counts(self, num_classes: int) -> np.ndarray:
        """Pixels of each class; ignored ones are not counted."""
        return sum(np.bincount(y.numpy().ravel(), minlength=256)[:num_classes] for y in self.y)


def image_and_labels(name: str, item) -> tuple[np.ndarray, np.ndarray]:
    """Take the image and the labels out of a dataset's item."""
    rgb, y = (item.rgb, item.labels) if isinstance(item, RGBDFrame) else item
    require(name, y is not None, "a frame with labels", "one without")
    rgb, y = np.ascontiguousarray(check_rgb(name, np.asarray(rgb))), np.asarray(y)
    require(name, y.shape == rgb.shape[:2], f"labels of the size of the image, {rgb.shape[:2]}", y.shape)
    return rgb, y


def in_8_bits(name: str, instances: Integer[np.ndarray, "H W"]) -> UInt8[np.ndarray, "H W"]:
    """An image of objects' numbers as uint8, numbered anew from 1 if it has another type; 255 where nobody knows.

    Raises ValueError naming `name` if it shows more than 254 objects.

    >>> in_8_bits("frame", np.array([[0, 255, 300, 65535]], np.uint16))
    array([[  0,   1,   2, 255]], dtype=uint8)
    """
    if instances.dtype == np.uint8:
        return instances
    numbers, place = np.unique(instances, return_inverse=True)
    is_thing = (numbers > 0) & (numbers != unknown_number(instances))
    require(name, is_thing.sum() < IGNORE, f"at most {IGNORE - 1} objects in a frame", is_thing.sum())
    new = np.where(is_thing, np.cumsum(is_thing), np.where(numbers == 0, 0, IGNORE)).astype(np.uint8)
    return new[place].reshape(instances.shape)


def table_height(frame: RGBDFrame) -> float:
    """Height of the table in the base frame, metres: the frame's own, else the median over the pixels labelled surface.

    0 without any such pixel.

    >>> frame = RGBDFrame(np.zeros((2, 2, 3), np.uint8), np.ones((2, 2)), np.eye(3), np.eye(4), np.ones((2, 2), int))
    >>> table_height(frame)
    1.0
    """
    if frame.table_z is not None:
        return frame.table_z
    heights = back_project_to_base(frame.depth, frame.K, frame.T_base_cam)[frame.labels == SURFACE, 2]
    heights = heights[np.isfinite(heights)]
    return float(np.median(heights)) if heights.size else 0.0
