"""Arrays as files hold them: NPY, NPZ and EXR, whose sizes are read before their numbers."""

import ast
import io
import math
import struct
import zipfile
import zlib
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Real, Shaped

from labkit.frame import decode_image_file
from labkit.support.images import check_pixels, image_size
from labkit.support.validation import require

MOST_BYTES = 1 << 30
BARE = (".raw", ".depth")  # of librealsense's viewer, and within an .r3d
SMALL = 1 << 16  # bytes of a camera's matrix and lens, and more
UNREADABLE = (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, OSError, EOFError)
EXR = 'EXR is read by the package OpenEXR (pip install "labkit-manipulation[exr]"); or save depth as TIFF or NPY'


@dataclass(frozen=True, eq=False)
class ArrayFile:
    """An image of numbers in a file: its width and height, and what reads it, (H, W) or (H, W, channels)."""

    size: tuple[int, int]
    read: Callable[[], Shaped[np.ndarray, "H W *channels"]]


def open_array(name: str, path) -> ArrayFile:
    """Open an image of numbers, of any of `FORMATS` or an image file; `name` is the argument that errors speak of.

    Raises FileNotFoundError, or ValueError for a damaged file or one that claims more than a camera's picture.
    """
    path = Path(path)
    known = path.suffix.lower() not in BARE
    require(name, known, "16-bit PNG, TIFF, PFM, NPY, NPZ or EXR", f"{path}, which says no size and no type of number")
    require(name, path.stat().st_size <= MOST_BYTES, f"a file of at most {MOST_BYTES >> 20} MiB", path)
    data = path.read_bytes()
    for magic, read in FORMATS.items():
        if data.startswith(magic):
            return read(name, data, path)
    return ArrayFile(image_size(name, data, str(path)), lambda: decode_image_file(name, data, path))


def read_npy(name: str, data: bytes, path) -> Real[np.ndarray, "..."]:
    """The array of an NPY file's bytes, numbers alone; raises ValueError for others, and where bytes are missing."""
    dtype, order, shape, start = _npy_header(name, data, path)
    count = math.prod(shape)
    whole = len(data) - start >= count * dtype.itemsize
    require(name, whole, f"{count} numbers in {path}", "fewer: is it cut short?")
    return np.frombuffer(data, dtype, count, start).reshape(shape, order=order)


def read_npz(name: str, path) -> dict[str, Real[np.ndarray, "..."]]:
    """The small arrays of numbers of an NPZ file by name, as cv2.calibrateCamera's results are kept."""
    data = Path(path).read_bytes()
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            small = [
                info for info in archive.infolist()[:100] if info.file_size <= SMALL and info.filename[-4:] == ".npy"
            ]
            members = {info.filename[:-4]: archive.read(info) for info in small}
    except UNREADABLE as error:
        raise ValueError(f"{name}: {path} is not an NPZ that can be read: {error}") from None
    found = {}
    for member, content in members.items():
        with suppress(ValueError):  # arrays of objects stand beside those of numbers
            found[member] = read_npy(name, content, path)
    return found


def _npy_header(name: str, data: bytes, path) -> tuple[np.dtype, str, tuple[int, ...], int]:
    """Type, order ("C" or "F"), shape and where the numbers begin, as NumPy's format 1 to 3 says."""
    try:
        long = data[6] > 1
        (length,) = struct.unpack_from("<I" if long else "<H", data, 8)
        start = (12 if long else 10) + length
        require(name, length < 10_000, "a short header", length)
        facts = ast.literal_eval(data[start - length : start].decode("latin1").strip())
        dtype, shape = np.dtype(facts["descr"]), tuple(facts["shape"])
        fits = dtype.kind in "fiu" and all(type(n) is int and 0 <= n < 1 << 40 for n in shape) and len(shape) <= 4
        require(name, fits, "an array of numbers", f"{dtype} {shape}")
        return dtype, "F" if facts["fortran_order"] else "C", shape, start
    except (
        IndexError,
        KeyError,
        TypeError,
        SyntaxError,
        MemoryError,
        RecursionError,
        struct.error,
        ValueError,
    ) as error:
        raise ValueError(f"{name}: {path} is not an array of numbers that can be read: {error}") from None


def _of_npy(name: str, data: bytes, path) -> ArrayFile:
    shape = tuple(n for n in _npy_header(name, data, path)[2] if n != 1)  # (H, W, 1), (1, H, W)
    require(name, len(shape) == 2, f"an array (height, width) in {path}", f"shape {shape}")
    check_pixels(name, math.prod(shape), str(path))
    return ArrayFile(shape[::-1], lambda: read_npy(name, data, path).reshape(shape))


def _of_npz(name: str, data: bytes, path) -> ArrayFile:
    """An archive with one array, or with one that is called depth."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = {Path(info.filename).stem: info for info in archive.infolist()}
            chosen = members.get("depth") or (next(iter(members.values())) if len(members) == 1 else None)
            got = ", ".join(list(members)[:10]) or "none"
            require(name, chosen, f"one array, or one called depth, in {path}", got)
            require(name, chosen.file_size <= MOST_BYTES, f"at most {MOST_BYTES >> 20} MiB", chosen.file_size)
            with archive.open(chosen) as member:
                return _of_npy(name, member.read(chosen.file_size), path)
    except UNREADABLE as error:
        raise ValueError(f"{name}: {path} is not an NPZ that can be read: {error}") from None


def _of_exr(name: str, data: bytes, path) -> ArrayFile:
    """Depth in its channel Z, R, Y or V, or in the only one; Record3D has R."""
    try:
        import OpenEXR
    except ModuleNotFoundError:
        raise ValueError(f"{name}: {path}: {EXR}") from None
    try:
        header = OpenEXR.File(str(path), separate_channels=True, header_only=True).header()
        (left, top), (right, bottom) = (corner.tolist() for corner in header["dataWindow"])
        channels = [channel.name for channel in header["channels"]]
    except Exception as error:  # its own, RuntimeError, KeyError
        raise ValueError(f"{name}: {path} is not an EXR that can be read: {error}") from None
    size = right - left + 1, bottom - top + 1
    check_pixels(name, size[0] * size[1], str(path))
    chosen = next((channel for channel in ("Z", "R", "Y", "V") if channel in channels), None)
    chosen = chosen or (channels[0] if len(channels) == 1 else None)
    require(name, chosen, f"a channel Z, R, Y or V in {path}", ", ".join(channels) or "none")

    def read() -> Real[np.ndarray, "H W"]:
        try:
            return OpenEXR.File(str(path), separate_channels=True).channels()[chosen].pixels
        except Exception as error:  # of missing pixels it warns, and has no channel
            raise ValueError(f"{name}: {path} is cut short: {error}") from None

    return ArrayFile(size, read)


FORMATS = {b"\x93NUMPY": _of_npy, b"PK\x03\x04": _of_npz, b"\x76\x2f\x31\x01": _of_exr}
