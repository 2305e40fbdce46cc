"""A folder of somebody's labelled RGB-D pictures, to train on: `labkit train FOLDER --init unet_rgbd`."""

import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
from tqdm.auto import tqdm

from labcli.cameras import read_intrinsics
from labcli.perceive import on_own_table, taken_for_target
from labcli.pictures import NOTHING_SAID, Reading, camera_file, depth_beside, pictures_in, pose_beside, read_shot
from labkit.frame import RGBDFrame, read_image
from labkit.geometry import back_project_to_base
from labkit.labels import BACKGROUND, CLASSES, IGNORE, SURFACE, TARGET
from labkit.notices import notices
from labtrain import ranks

FLAT = 0.010  # metres: what is nearer to the table's plane is table


class PictureFolder(Sequence):
    """FOLDER/color/NAME.png (or .jpg), depth/NAME.png and mask/NAME.png, with the camera in FOLDER/camera.json.

    Depth is aligned to colour, of any kind that `labkit perceive` reads, 0 where there is no reading; reading: what is
    known of its unit and size, and of the camera's file. A mask has its picture's name and holds the kit's classes, 0
    to 3, or 255 where nobody knows. If all masks together hold 0 and one other value alone, such as 255 or 1, that
    value is the target, as in `labkit perceive --mask`. camera.json (or .yaml, .txt) is anything that `labkit perceive
    --intrinsics` reads. The table is found in each depth picture, and the base frame laid on it, unless pose/NAME.txt
    says where the camera was, as `labkit photos` writes it, with the table at z = 0. If no mask has a pixel of surface,
    0 does not say what is table: there what lies on the table's plane is surface, and what has no depth is ignored.

    An item is an RGBDFrame with labels. All pictures are read once when the folder is opened: on stderr stands which
    are left out and why, what looks wrong about the others, and the share of each class. Raises FileNotFoundError or
    ValueError naming the file if the camera is missing or no picture is left. Topics 01 and 06.
    """

    def __init__(self, folder, reading: Reading = NOTHING_SAID):
        self.folder, self.reading = Path(folder), reading
        found, said = pictures_in(self.folder / "color")
        if not found:
            raise FileNotFoundError(
                f"data: expected a data set of data_gen, or pictures in color/, depth/ and mask/, in {self.folder}"
            )
        self.camera = camera_file(self.folder)
        if self.camera is None:
            raise FileNotFoundError(f"data: expected {self.folder / 'camera.json'}, the camera of these pictures")
        read_intrinsics(str(self.camera), found[0], reading.camera_name)  # what is wrong with it is said of no picture
        for sentence in said:
            _say(sentence)
        self._told = set()
        values = self._values(found)
        self.target = next(iter(values)) if len(values) == 1 else None
        self.says_surface = SURFACE in values and self.target is None
        if self.target is not None and (said := taken_for_target(self.target)):
            _say(f"{self.folder}: of all masks together, {said}")
        self.pictures, self.poses, self.size, why = [], [], None, ""
        counts = np.zeros(256, np.int64)
        for color in tqdm(found, desc=f"checking {self.folder}", unit="picture", disable=not ranks.is_main()):
            try:
                frame = self._with_surface(on_own_table(self._read(color), color))
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
        if posed := sum(pose_beside(color) is not None for color in self.pictures):
            _say(f"{self.folder}: pose/ says where the camera was for {posed} of them, with the table at z = 0")
        if not self.says_surface:
            _say(f"{self.folder}: no mask has a pixel of surface, 1: what is 0 on the table's plane is taken for it")

    def __len__(self) -> int:
        return len(self.pictures)

    def __getitem__(self, index):
        if isinstance(index, slice):
            return [self[i] for i in range(len(self))[index]]
        frame = replace(self._read(self.pictures[index]), T_base_cam=self.poses[index], table_z=0.0)
        return self._with_surface(frame)

    def _read(self, color: Path) -> RGBDFrame:
        """A picture with its labels, in the camera's own frame."""
        mask = self.folder / "mask" / f"{color.stem}.png"
        try:
            camera = read_intrinsics(str(self.camera), color, self.reading.camera_name)
            shot = read_shot(color, depth_beside(color), camera, self.reading)
            labels = read_image("mask", mask, (np.uint8, np.uint16))
        except FileNotFoundError as error:
            missing = Path(error.filename)
            raise FileNotFoundError(f"{missing.parent.name}: expected {missing}, named as its picture is") from None
        frame = shot.frame
        if self.size not in (None, frame.size):
            raise ValueError(f"color: expected pictures of one size, {self.size} as before, got {frame.size}")
        for sentence in {*shot.said} - self._told:
            _say(f"{color}: {sentence}")
        self._told |= {*shot.said}
        values = np.unique(labels).tolist()
        if values == [IGNORE]:
            raise ValueError(f"mask: expected a labelled pixel in {mask}, got {IGNORE} alone")
        if self.target is not None:
            labels = np.where(labels == self.target, TARGET, 0)
        elif not set(values) <= {*range(len(CLASSES)), IGNORE}:
            raise ValueError(
                f"mask: expected classes 0 to {len(CLASSES) - 1}, or {IGNORE}, in {mask}, got {values[:6]}"
            )
        return replace(frame, labels=shot.labels_like(labels.astype(np.uint8), IGNORE, mask))

    def _values(self, found: list[Path]) -> set[int]:
        """All values above 0 of all masks that can be read; what cannot is said when the picture is."""
        values = set()
        for color in found:
            mask = self.folder / "mask" / f"{color.stem}.png"
            with suppress(OSError, ValueError):
                values |= {*np.unique(read_image("mask", mask, (np.uint8, np.uint16))).tolist()}
        return values - {0}

    def _with_surface(self, frame: RGBDFrame) -> RGBDFrame:
        """The frame on its table: if no mask says what is table, what is labelled 0 and lies on its plane is."""
        if self.says_surface:
            return frame
        z = back_project_to_base(frame.depth, frame.K, frame.T_base_cam)[..., 2]
        zero, labels = frame.labels == BACKGROUND, frame.labels.copy()
        labels[zero & np.isnan(z)] = IGNORE
        labels[zero & (np.abs(z) < FLAT)] = SURFACE  # NaN is not
        return replace(frame, labels=labels)


def _say(sentence: str) -> None:
    if ranks.is_main():
        tqdm.write(sentence, file=sys.stderr)
