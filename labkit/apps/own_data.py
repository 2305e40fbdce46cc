"""A folder of somebody's labelled RGB-D pictures, to train on: `labkit train FOLDER --init unet_rgbd`."""

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from tqdm.auto import tqdm

from labkit.apps.perceive import Intrinsics, on_table, read_frame, read_intrinsics
from labkit.frame import read_image
from labkit.labels import CLASSES, IGNORE, TARGET
from labkit.notices import notices


class PictureFolder(Sequence):
    """FOLDER/color/NAME.png (or .jpg), depth/NAME.png and mask/NAME.png, with the camera in FOLDER/camera.json.

    Depth is aligned to colour, 16 bit, 0 where there is no reading. A mask is 8 bit and holds the kit's classes, 0 to
    3, or 255 where nobody knows; one of 0 and 255 alone says what is a target. Its name is its picture's. camera.json
    (or .yaml, .txt) is anything that `labkit perceive --intrinsics` reads. The table is found in each depth picture,
    and the base frame laid on it. An item is an RGBDFrame with labels; what looks wrong about it is said on stderr.
    Raises FileNotFoundError or ValueError naming the file that is missing or does not fit. Topics 01 and 06.
    """

    def __init__(self, folder):
        self.folder = Path(folder)
        self.pictures = sorted(path for path in (self.folder / "color").glob("*") if path.is_file())
        if not self.pictures:
            raise FileNotFoundError(
                f"data: expected a data set of data_gen, or pictures in color/, depth/ and mask/, in {self.folder}"
            )
        cameras = [path for end in (".json", ".yaml", ".txt") if (path := self.folder / f"camera{end}").is_file()]
        if not cameras:
            raise FileNotFoundError(f"data: expected {self.folder / 'camera.json'}, the camera of these pictures")
        self.camera: Intrinsics = read_intrinsics(str(cameras[0]))

    def __len__(self) -> int:
        return len(self.pictures)

    def __getitem__(self, index):
        if isinstance(index, slice):
            return [self[i] for i in range(len(self))[index]]
        color = self.pictures[index]
        depth, mask = (self.folder / kind / f"{color.stem}.png" for kind in ("depth", "mask"))
        try:
            frame, _ = on_table(read_frame(color, depth, self.camera))
        except ValueError as error:
            raise ValueError(f"data: {color}: {error}") from error
        for sentence in notices(frame, distortion=self.camera.distortion):
            tqdm.write(f"{color}: {sentence}", file=sys.stderr)
        labels = read_image("mask", mask, np.uint8)
        if set(np.unique(labels)) == {0, IGNORE}:  # as many tools write a mask of one thing
            labels = np.where(labels == IGNORE, TARGET, 0).astype(np.uint8)
        if not np.isin(labels, [*range(len(CLASSES)), IGNORE]).all():
            values = np.unique(labels)[:6].tolist()
            raise ValueError(f"mask: expected classes 0 to {len(CLASSES) - 1}, or {IGNORE}, in {mask}, got {values}")
        return replace(frame, labels=labels)
