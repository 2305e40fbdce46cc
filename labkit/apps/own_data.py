"""A folder of somebody's labelled RGB-D pictures, to train on: `labkit train FOLDER --init unet_rgbd`."""

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from tqdm.auto import tqdm

from labkit.apps.perceive import Intrinsics, on_table, read_frame, read_intrinsics, rectify
from labkit.frame import RGBDFrame, read_image
from labkit.labels import CLASSES, IGNORE, SURFACE, TARGET
from labkit.learning import ranks
from labkit.notices import notices


class PictureFolder(Sequence):
    """FOLDER/color/NAME.png (or .jpg), depth/NAME.png and mask/NAME.png, with the camera in FOLDER/camera.json.

    Depth is aligned to colour, 16 bit, 0 where there is no reading; depth_scale: metres per unit, if None what the
    camera's file says, or else 0.001. A mask is 8 bit and holds the kit's classes, 0 to 3, or 255 where nobody knows;
    one of 0 and 255 alone says what is a target. Its name is its picture's. camera.json (or .yaml, .txt) is anything
    that `labkit perceive --intrinsics` reads. The table is found in each depth picture, and the base frame laid on it.

    An item is an RGBDFrame with labels. All pictures are read once when the folder is opened: on stderr stands which
    are left out and why, what looks wrong about the others, and the share of each class. Raises FileNotFoundError or
    ValueError naming the file if the camera is missing or no picture is left. Topics 01 and 06.
    """

    def __init__(self, folder, depth_scale: float | None = None):
        self.folder, self.depth_scale = Path(folder), depth_scale
        found = sorted(path for path in (self.folder / "color").glob("*") if path.is_file())
        if not found:
            raise FileNotFoundError(
                f"data: expected a data set of data_gen, or pictures in color/, depth/ and mask/, in {self.folder}"
            )
        cameras = [path for end in (".json", ".yaml", ".txt") if (path := self.folder / f"camera{end}").is_file()]
        if not cameras:
            raise FileNotFoundError(f"data: expected {self.folder / 'camera.json'}, the camera of these pictures")
        self.camera: Intrinsics = read_intrinsics(str(cameras[0]))
        self.pictures, self.poses, self.size, why = [], [], None, ""
        counts = np.zeros(256, np.int64)
        for color in tqdm(found, desc=f"checking {self.folder}", unit="picture", disable=not ranks.leads()):
            try:
                frame, _ = on_table(self._read(color))
            except (ValueError, OSError) as error:
                why = f"{color} is left out: {error}"
                _say(why)
                continue
            for sentence in notices(frame):
                _say(f"{color}: {sentence}")
            self.pictures.append(color)
            self.poses.append(frame.T_base_cam)
            self.size = frame.size
            counts += np.bincount(frame.labels.ravel(), minlength=256)
        if not self.pictures:
            raise ValueError(f"data: expected a picture to train on in {self.folder}, got none; {why}")
        shares = zip(CLASSES, counts / max(1, counts[: len(CLASSES)].sum()), strict=False)
        shares = ", ".join(f"{name} {share:.1%}" for name, share in shares)
        _say(f"{self.folder}: {len(self.pictures)} of {len(found)} pictures; of the labelled pixels {shares}")
        if not counts[SURFACE]:
            _say(f"{self.folder}: no mask has a pixel of surface, 1: a table labelled 0 is learnt as background")

    def __len__(self) -> int:
        return len(self.pictures)

    def __getitem__(self, index):
        if isinstance(index, slice):
            return [self[i] for i in range(len(self))[index]]
        return replace(self._read(self.pictures[index]), T_base_cam=self.poses[index], table_z=0.0)

    def _read(self, color: Path) -> RGBDFrame:
        """A picture with its labels, in the camera's own frame."""
        depth, mask = (self.folder / kind / f"{color.stem}.png" for kind in ("depth", "mask"))
        try:
            frame, labels = read_frame(color, depth, self.camera, self.depth_scale), read_image("mask", mask, np.uint8)
        except FileNotFoundError as error:
            missing = Path(error.filename)
            raise FileNotFoundError(f"{missing.parent.name}: expected {missing}, named as its picture is") from None
        if self.size not in (None, frame.size):
            raise ValueError(f"color: expected pictures of one size, {self.size} as before, got {frame.size}")
        if set(np.unique(labels)) == {0, IGNORE}:  # as many tools write a mask of one thing
            labels = np.where(labels == IGNORE, TARGET, 0).astype(np.uint8)
        values = np.unique(labels).tolist()
        if not set(values) <= {*range(len(CLASSES)), IGNORE}:
            raise ValueError(
                f"mask: expected classes 0 to {len(CLASSES) - 1}, or {IGNORE}, in {mask}, got {values[:6]}"
            )
        if values == [IGNORE]:
            raise ValueError(f"mask: expected a labelled pixel in {mask}, got {IGNORE} alone")
        return replace(frame, labels=rectify(labels, self.camera, outside=IGNORE))


def _say(sentence: str) -> None:
    if ranks.leads():
        tqdm.write(sentence, file=sys.stderr)
