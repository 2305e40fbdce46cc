"""A folder of photographs as a phone writes them: upright, all turned the same way, one size (topic 06).

A phone writes what its sensor saw, and beside it how the phone was held (EXIF). One camera has one K for its sensor, so
all photographs are turned as most of them are: portrait among landscape is turned back.
"""

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import UInt8
from PIL import Image, UnidentifiedImageError
from tqdm.auto import tqdm

from labkit.support.images import turned, turned_size
from labkit.support.validation import require

ENDINGS = (".jpg", ".jpeg", ".png", ".tif", ".tiff", ".webp", ".bmp", ".heic", ".heif")
MOST_PIXELS = 120_000_000  # of one photograph: phones end at a hundred million
ORIENTATION = 0x0112  # EXIF's number for how the camera was held
HEIC = (
    "HEIC is read where pillow-heif is installed (pip install pillow-heif); or let the phone write JPEG: on an iPhone "
    "Settings > Camera > Formats > Most Compatible"
)

WHY_NONE = "hidden, too far, too flat, blurred, or not the sheet that `labkit sheet` prints"


@dataclass(frozen=True)
class Photograph:
    """A file with a photograph: its size as the sensor saw it, and EXIF's number for how it was held."""

    path: Path
    sensor_size: tuple[int, int]
    orientation: int

    def size(self, orientation: int) -> tuple[int, int]:
        """Width and height once it is turned as `orientation` says."""
        return turned_size(self.sensor_size, orientation)

    def read(self, orientation: int, size: tuple[int, int] | None = None) -> UInt8[np.ndarray, "H W 3"]:
        """The picture, RGB, turned as `orientation` says; no larger than `size`, if given, with the same proportions.

        Raises ValueError if the file is damaged.
        """
        try:
            with Image.open(self.path) as image:
                picture = image.convert("RGB")
                if size is not None and size != self.size(orientation):
                    picture = picture.resize(turned_size(size, orientation), Image.Resampling.BOX)
                return turned(np.array(picture), orientation)
        except (OSError, SyntaxError, ValueError) as error:
            raise ValueError(f"{self.path.name}: expected a photograph, got a damaged file ({error})") from None


def photographs(folder, wanted: tuple[tuple[int, int], int] | None = None) -> tuple[list[Photograph], int, list[str]]:
    """The photographs of a folder in the order of their names, how to turn them, and what is said of those left out.

    wanted: size and orientation that a calibration names; else what most of them have. Left out, by name, is what
    cannot be read or has another size. Raises FileNotFoundError if the folder has none.
    """
    folder, said, found = Path(folder), [], []
    require("folder", folder.is_dir(), "a folder of photographs", folder)
    for path in sorted(folder.iterdir()):
        if path.suffix.lower() in ENDINGS and not path.name.startswith(".") and path.is_file():
            try:
                found.append(_opened(path))
            except ValueError as error:
                said.append(f"left out: {error}")
    if not found:
        raise FileNotFoundError(f"folder: expected photographs ({', '.join(ENDINGS)}) in {folder}; {'; '.join(said)}")
    if wanted is None:
        orientation = _most(photograph.orientation for photograph in found)
        size = _most(photograph.size(orientation) for photograph in found)
    else:
        size, orientation = wanted
    for photograph in found:
        if photograph.size(orientation) != size:
            w, h = photograph.size(orientation)
            why = "another aspect ratio, zoom or camera" if w * size[1] != h * size[0] else "another resolution"
            if (h, w) == size:
                why = "it was cut or turned by another program, and nobody knows which way"
            said.append(f"left out: {photograph.path.name}: {w} x {h}, the others {size[0]} x {size[1]}: {why}")
    return [photograph for photograph in found if photograph.size(orientation) == size], orientation, said


def showing(found: list[Photograph], orientation: int, find: Callable, said: list[str]) -> Iterator[tuple]:
    """Each photograph in which `find` sees a sheet, with what it sees there; the others are named in `said`.

    find: a function of an RGB picture; None means that it sees no sheet.
    """
    for photograph in tqdm(found, desc="looking for the sheet", unit="photograph"):
        try:
            picture = photograph.read(orientation)
        except ValueError as error:
            said.append(f"left out: {error}")
            continue
        if (seen := find(picture)) is None:
            said.append(f"left out: {photograph.path.name}: no sheet found: {WHY_NONE}")
        else:
            yield photograph, seen


def _opened(path: Path) -> Photograph:
    """Read a file's header alone."""
    heic = path.suffix.lower() in (".heic", ".heif")
    if heic:
        try:
            import pillow_heif
        except ModuleNotFoundError:
            raise ValueError(f"{path.name}: {HEIC}") from None
        pillow_heif.register_heif_opener()
    try:
        with Image.open(path) as image:
            width, height = image.size
            if width * height > MOST_PIXELS:
                raise ValueError(f"{path.name}: expected at most {MOST_PIXELS} pixels, got {width} x {height}")
            # pillow-heif turns the picture itself, and says 1 then
            orientation = image.getexif().get(ORIENTATION, 1)
    except (UnidentifiedImageError, Image.DecompressionBombError, SyntaxError, OSError) as error:
        raise ValueError(f"{path.name}: not a picture that can be read ({type(error).__name__})") from None
    return Photograph(path, (width, height), orientation if orientation in range(1, 9) else 1)


def _most(values: Iterator):
    """The commonest value; of equals the one that came first."""
    return Counter(values).most_common(1)[0][0]
