"""The camera of a picture: a matrix in words or in a file of any usual kind, the right one of several, a lens to undo.

`labcli.camera_formats` has the formats; docs/cameras.md lists them. Topic 06.
"""

import re
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from jaxtyping import Shaped

from labcli.arrays import read_npy, read_npz
from labcli.camera_formats import Intrinsics, camera_of, matrix_of
from labcli.documents import numbers_of, parsed, text_of
from labcli.realsense import CSV, WITHOUT, cameras_printed
from labkit.geometry.lens import Lens, rectified
from labkit.support.validation import require

FOUND_NONE = (
    "intrinsics: found no camera matrix in {}; expected fx, fy, cx, cy (or ppx, ppy, fl_x), cam_K, K, "
    "intrinsic_matrix, camera_matrix, Kalibr's or COLMAP's cameras, or a matrix of 3x3 or 4x4; docs/cameras.md lists "
    "what is read"
)
COLOURS = re.compile("colou?r|rgb", re.IGNORECASE)
COLMAP_LINE = re.compile(r"^\s*(\d+)\s+([A-Z_]+)\s+(\d+)\s+(\d+)((?:\s+[-+.\deE]+)+)\s*$", re.MULTILINE)


def read_intrinsics(text: str, picture=None, name: str | None = None) -> Intrinsics:
    """Read a camera: "fx fy cx cy" itself, or a file of one of the usual kinds (`labcli.camera_formats`).

    picture: the colour picture's path: where a file has a camera for each frame (BOP), it is the one of its name. name:
    which of several cameras. Raises ValueError if there is none, or several and no way to choose; FileNotFoundError for
    a missing file. Topic 06.

    >>> read_intrinsics("600 601 320 240").K.tolist()
    [[600.0, 0.0, 320.0], [0.0, 601.0, 240.0], [0.0, 0.0, 1.0]]
    """
    if (K := matrix_of(numbers_of(text))) is not None:
        return Intrinsics(K)
    path = Path(text)
    if not path.is_file():
        raise FileNotFoundError(f'intrinsics: expected "fx fy cx cy" or a file, got {text[:200]!r}')
    found = _cameras(path, path.stat().st_mtime_ns)
    if not found:
        raise ValueError(FOUND_NONE.format(path))
    try:
        return _chosen(found, None if picture is None else Path(picture).stem, name)
    except ValueError as error:
        raise ValueError(f"{error}, in {path}") from None


def with_lens(numbers: list[float]) -> Intrinsics:
    """The camera of fx, fy, cx, cy and what TUM's data sets write behind them: k1, k2, p1, p2, k3.

    >>> with_lens([517.3, 516.5, 318.6, 255.3, 0.26, -0.95, -0.005, 0.003, 1.16]).distortion
    (0.26, -0.95, -0.005, 0.003, 1.16)
    """
    said = "intrinsics: the numbers behind fx fy cx cy are taken for the lens's k1 k2 p1 p2 k3"
    return Intrinsics(matrix_of(numbers[:4]), lens=Lens(tuple(numbers[4:]), "brown_conrady"), said=(said,))


@lru_cache(maxsize=4)  # a folder of pictures asks for each
def _cameras(path: Path, changed: int) -> dict[str, Intrinsics | ValueError]:
    """All cameras that a file tells of, by name; one that cannot be followed is its ValueError."""
    if path.suffix == ".npy":
        K = matrix_of(read_npy("intrinsics", path.read_bytes(), path).ravel()[:16].tolist())
        return {} if K is None else {"": Intrinsics(K)}
    if path.suffix == ".npz":
        return dict(_found({name: array.tolist() for name, array in read_npz("intrinsics", path).items()}, {}, ""))
    content = text_of("intrinsics", path)
    numbers = numbers_of(content)
    if len(numbers) in (8, 9) and numbers[2] and numbers[3]:  # a matrix of nine has a 0 in one of these places
        return {"": with_lens(numbers)}
    if (K := matrix_of(numbers)) is not None:
        return {"": Intrinsics(K, same_view=path.name == "camera_matrix.csv")}  # Stray Scanner's
    if printed := cameras_printed(content):
        said = (WITHOUT,) if content.startswith(CSV) else ()
        found = dict(_found(printed.get("", printed), {}, ""))
        return {name: replace(c, said=said) if isinstance(c, Intrinsics) else c for name, c in found.items()}
    lines = COLMAP_LINE.findall(content) if not content.lstrip().startswith(("{", "[")) else []
    if lines:
        facts = {
            f"camera {number}": {"colmap": model, "width": int(w), "height": int(h), "parameters": numbers_of(rest)}
            for number, model, w, h, rest in lines
        }
    else:
        try:
            facts = parsed("intrinsics", content)
        except ValueError as error:
            raise ValueError(f"{error}, in {path}") from None
    return dict(_found(facts, {}, ""))


def _found(facts, outer: dict, name: str):
    """Yield each camera that facts tell of, with its name; what stands around it, such as depth_scale, holds for it."""
    if isinstance(facts, list):
        named = [(str(item.get("name", i)), item) for i, item in enumerate(facts) if isinstance(item, dict)]
        facts, own = dict(named), {}
    elif isinstance(facts, dict):
        try:
            camera = camera_of(outer | facts)
        except ValueError as error:
            camera = error
        if camera is not None:
            yield name, camera
            return
        own = {key: value for key, value in facts.items() if not isinstance(value, dict) or "distort" in key.lower()}
    else:
        return
    for key, value in facts.items():
        if key == "frames" and isinstance(value, list):  # NeRF's, each with a lens of its own
            value = {Path(str(frame.get("file_path", i))).stem: frame for i, frame in enumerate(value)}
        yield from _found(value, outer | own, f"{name}.{key}" if name else key)


def _chosen(found: dict[str, Intrinsics | ValueError], picture: str | None, name: str | None) -> Intrinsics:
    """The camera of a colour picture among several."""
    names = list(found)
    if name is not None:
        fitting = [one for one in names if one == name] or [one for one in names if name.lower() in one.lower()]
        require("camera_name", len(fitting) == 1, f"one of {_listed(names)}", repr(name))
        return _whole(found[fitting[0]])
    if len(names) == 1:
        return _whole(found[names[0]])
    last = {one.rpartition(".")[2]: one for one in names}
    own = last.get(picture) or next((last[n] for n in last if _same_number(n, picture)), None)
    if own is not None:
        return _whole(found[own])
    first, *others = found.values()
    if isinstance(first, Intrinsics) and all(_equal(first, other) for other in others):
        return first
    if all(n.isdigit() for n in last):
        raise ValueError(
            f"intrinsics: expected one camera, or one for the picture {picture!r}, got {len(names)} frames whose K "
            "differ; --camera-name says which"
        )
    colours = [one for one in names if COLOURS.search(one)]
    if len(colours) != 1:
        raise ValueError(f"intrinsics: expected one camera, got {_listed(names)}; --camera-name says which")
    camera = _whole(found[colours[0]])
    return replace(camera, said=(f"intrinsics: of {_listed(names)}, {colours[0]} is taken", *camera.said))


def _whole(camera: Intrinsics | ValueError) -> Intrinsics:
    if isinstance(camera, ValueError):
        raise camera
    return camera


def _listed(names: list[str]) -> str:
    return f"{', '.join(names[:8])}{' ...' if len(names) > 8 else ''}"


def _same_number(name: str, picture: str | None) -> bool:
    return picture is not None and name.isdigit() and picture.isdigit() and int(name) == int(picture)


def _equal(one: Intrinsics, other: Intrinsics | ValueError) -> bool:
    def key(camera):
        return camera.K.tolist(), camera.depth_scale, camera.size, camera.lens

    return isinstance(other, Intrinsics) and key(one) == key(other)


def rectify(
    image: Shaped[np.ndarray, "H W *channels"], camera: Intrinsics, smooth: bool = False, outside: int = 0
) -> Shaped[np.ndarray, "H W *channels"]:
    """Undo the camera's lens, as `labkit.geometry.lens.rectified`; a picture of a lens that does nothing stays."""
    return image if camera.lens is None else rectified(image, camera.K, camera.lens, smooth, outside)
