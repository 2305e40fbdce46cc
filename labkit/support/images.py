"""What an image file says of itself before its pixels are read: a file of 300 KB may claim a picture of a gigabyte."""

import io
import re
import struct

import numpy as np
from jaxtyping import Shaped

from labkit.support.validation import require

MOST_PIXELS = 64_000_000  # a phone's largest photographs have 50 million


def image_size(name: str, data: bytes, what: str = "the image") -> tuple[int, int]:
    """Width and height that the header of an image file's bytes states; the pixels are not looked at.

    name, what: the argument and the file that the errors speak of. Raises ValueError for bytes that are no image, and
    for a picture of more than 64 million pixels, which no camera of this kit takes.

    >>> image_size("color", b"P6 100000 90000 255 ")
    Traceback (most recent call last):
    ...
    ValueError: color: expected at most 64 million pixels, got 9000 million in the image
    """
    try:
        width, height = _tiff_size(data) if data[:4] in (b"II*\0", b"MM\0*") else _size(data)
    except Exception as error:  # each format's reader raises what it likes for a damaged header
        raise ValueError(f"{name}: {what} is not an image that can be read (damaged or truncated?)") from error
    check_pixels(name, width * height, what)
    return width, height


def turned(image: Shaped[np.ndarray, "H W *C"], orientation: int) -> Shaped[np.ndarray, "h w *C"]:
    """A sensor's picture as EXIF's number for how the camera was held says it is upright; 1 leaves it.

    >>> turned(np.array([[1, 2, 3]]), 6).tolist()  # a quarter turn clockwise
    [[1], [2], [3]]
    """
    image = image.swapaxes(0, 1) if orientation >= 5 else image
    image = image[::-1] if orientation in (3, 4, 7, 8) else image
    return np.ascontiguousarray(image[:, ::-1] if orientation in (2, 3, 6, 7) else image)


def turned_size(size: tuple[int, int], orientation: int) -> tuple[int, int]:
    """Width and height of a picture that was `turned`."""
    return size[::-1] if orientation >= 5 else size


def check_pixels(name: str, count: int, what: str) -> None:
    """Raise a ValueError for a picture that has no pixels, or more than any camera's."""
    most = f"at most {MOST_PIXELS // 1_000_000} million pixels"
    require(name, count <= MOST_PIXELS, most, lambda: f"{count // 1_000_000} million in {what}")
    require(name, count > 0, "at least one pixel", f"none in {what}")


def _size(data: bytes) -> tuple[int, int]:
    from PIL import Image  # loaded when a picture is first read

    try:
        with Image.open(io.BytesIO(data)) as image:
            return image.size
    except Image.DecompressionBombError as error:  # "Image size (10000000000 pixels) exceeds ...", and no sides
        return int(re.search(r"\d+", str(error))[0]), 1


def _tiff_size(data: bytes) -> tuple[int, int]:
    """Of the first picture of a TIFF: Pillow does not know all kinds of numbers that one may hold."""
    order = "<" if data[:2] == b"II" else ">"
    (start,) = struct.unpack_from(order + "I", data, 4)
    (count,) = struct.unpack_from(order + "H", data, start)
    found = {}
    for entry in range(count):
        tag, kind, _, value = struct.unpack_from(order + "HHI4s", data, start + 2 + 12 * entry)
        if tag in (256, 257):  # width and length, a short or a long
            found[tag] = struct.unpack_from(order + ("H" if kind == 3 else "I"), value)[0]
    return found[256], found[257]
