"""The labelled images that a network is trained on: decoded once, in memory or in a file. Topics 03 and 06."""

import mmap
import os
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np
import torch
from tqdm.auto import tqdm

from labkit.frame import RGBDFrame
from labkit.geometry.projection import back_project_to_base
from labkit.labels import CLASSES, SURFACE
from labkit.learning import ranks
from labkit.support.validation import check_labels, check_rgb, require


class ImagesInMemory:
    """Images and labels of a dataset, decoded once: 4,000 of 320x240 take 1.2 GB, 2.5 with depth.

    dataset: a sequence of (rgb uint8 (H, W, 3), labels (H, W)), arrays or tensors, or of RGBDFrame with labels.
    rgb: uint8 tensor (N, H, W, 3); y: uint8 tensor (N, H, W). depth: keep depth and cameras, too, for a network that
    looks at geometry; a frame that does not state its table's height gets that of the pixels labelled surface. file:
    keep all of it in a file of this name, which has no name any more once it is open, and goes with the process; the
    ranks on one machine share it. Raises ValueError if the dataset is empty or has no frames though depth is asked
    for, its images differ in size, or a label is out of range.
    """

    def __init__(
        self,
        dataset: Sequence,
        num_classes: int = len(CLASSES),
        name: str = "dataset",
        progress: bool = True,
        depth: bool = False,
        file: Path | None = None,
    ):
        require(name, len(dataset) > 0, "at least one image", "none")
        size = image_and_labels(f"{name}[0]", dataset[0])[1].shape
        record = kept_of_one(size, depth)
        self.map = None
        if file is None:
            records, mine = np.empty(len(dataset), record), range(len(dataset))
        else:
            self.map = shared_map(file, len(dataset) * record.itemsize)
            records = np.frombuffer(self.map, record)
            mine = range(ranks.told("LOCAL_RANK"), len(dataset), ranks.told("LOCAL_WORLD_SIZE", 1))
        for i in tqdm(mine, desc=f"reading {name}", unit="image", disable=not progress):
            item = dataset[i]
            rgb, y = image_and_labels(f"{name}[{i}]", item)
            require(name, y.shape == size, f"images of one size, {size}", f"{y.shape} at {i}")
            records["rgb"][i] = rgb
            records["y"][i] = check_labels(f"{name}[{i}]", y, num_classes)
            if depth:
                require(f"{name}[{i}]", isinstance(item, RGBDFrame), "an RGBDFrame, for its depth", type(item).__name__)
                records["depth"][i] = item.depth
                records["camera"][i] = [*item.K.ravel(), *item.T_base_cam.ravel(), table_height(item)]
        ranks.total(torch.zeros(1))  # others write into the same file
        self.rgb, self.y = torch.from_numpy(records["rgb"]), torch.from_numpy(records["y"])
        self.depth, self.cameras = (records["depth"], records["camera"]) if depth else (None, None)

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
                table_z=float(z[0]),
            )
            for i, (K, T, z) in zip(chosen, cameras, strict=True)
        ]

    def read_ahead(self, chosen: Sequence[int]) -> None:
        """Let the system fetch these images from the file while other work goes on."""
        if self.map is None or not hasattr(mmap, "MADV_WILLNEED"):
            return
        length = len(self.map) // len(self)
        for i in chosen:
            first = i * length // mmap.PAGESIZE * mmap.PAGESIZE
            self.map.madvise(mmap.MADV_WILLNEED, first, (i + 1) * length - first)

    def __len__(self) -> int:
        return len(self.y)

    def class_counts(self, num_classes: int) -> np.ndarray:
        """Pixels of each class; ignored ones are not counted."""
        return sum(np.bincount(y.numpy().ravel(), minlength=256)[:num_classes] for y in self.y)


def kept_of_one(size: tuple[int, int], depth: bool) -> np.dtype:
    """What is kept of an image of (H, W); camera: K, T_base_cam and the table's height in a row."""
    geometry = [("camera", "f8", 26), ("depth", "f4", size)] if depth else []
    return np.dtype([*geometry, ("rgb", "u1", (*size, 3)), ("y", "u1", size)])


def image_and_labels(name: str, item) -> tuple[np.ndarray, np.ndarray]:
    """Take the image and the labels out of a dataset's item."""
    rgb, y = (item.rgb, item.labels) if isinstance(item, RGBDFrame) else item
    require(name, y is not None, "a frame with labels", "one without")
    rgb, y = np.ascontiguousarray(check_rgb(name, np.asarray(rgb))), np.asarray(y)
    require(name, y.shape == rgb.shape[:2], f"labels of the size of the image, {rgb.shape[:2]}", y.shape)
    return rgb, y


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


def shared_map(file: Path, size: int) -> mmap.mmap:
    """A new file of so many bytes as memory, which the ranks of this machine share; its name is gone again."""
    first = ranks.told("LOCAL_RANK") == 0
    file = file.with_name(f"{file.name}.{ranks.told('GROUP_RANK')}")  # one per machine, where the folder is shared
    if first:
        file.parent.mkdir(parents=True, exist_ok=True)
        with open(file, "wb") as empty:
            empty.truncate(size)
    ranks.total(torch.zeros(1))
    with open(file, "r+b") as opened:
        memory = mmap.mmap(opened.fileno(), size)
    ranks.total(torch.zeros(1))
    if first:
        with suppress(PermissionError):  # Windows removes no open file
            file.unlink()
    return memory


def too_large(name: str, dataset: Sequence, depth: bool, memory_gb: float | None) -> bool:
    """Whether a dataset's images, once per process of this machine, take more than so many gigabytes of memory.

    memory_gb: None is half of what the machine has.
    """
    if not len(dataset):
        return False
    record = kept_of_one(image_and_labels(f"{name}[0]", dataset[0])[1].shape, depth)
    needed = record.itemsize * len(dataset) * ranks.told("LOCAL_WORLD_SIZE", 1)
    return needed > (0.5 * machine_memory() if memory_gb is None else memory_gb * 1e9)


def machine_memory() -> float:
    """Bytes of memory of this machine; 8 GB where the system does not tell."""
    known = hasattr(os, "sysconf") and "SC_PHYS_PAGES" in os.sysconf_names
    return float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")) if known else 8e9
