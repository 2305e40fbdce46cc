"""`labkit photos`: photographs of one table with the sheet on it become a frame with depth (topic 06, parallax)."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial.transform import Rotation
from tqdm.auto import tqdm

from labcli.calibrate import dumped
from labcli.cameras import Intrinsics
from labcli.photographs import photographs, showing
from labkit.frame import RGBDFrame
from labkit.geometry.calibration import MISFIT
from labkit.geometry.sheet import Sheet
from labkit.geometry.sweep import LEAST_VIEWS, Swept, View, central_first, sweep, view_of_sheet
from labkit.support.files import check_writable, write_atomically
from labkit.support.validation import require

LEAST, MOST = 5, 12  # photographs that show the sheet
ASIDE = 50.0  # degrees around the table from the middle photograph, beyond which one shows other sides of things
APART = 2.0  # degrees of parallax that a set must have, at least
KNOWN = 0.1  # share of the picture whose depth must be known
HOW = (
    f"take {LEAST} to {MOST} photographs of one table from places a hand's width apart, the sheet in each, 0.4 to "
    "0.7 m away, with the focus locked and without zoom; move nothing meanwhile"
)


@dataclass(frozen=True, eq=False)
class Table:
    """A table as photographs show it: the middle one's frame in the sheet's base frame, and what is said of the others.

    name: of the photograph whose frame it is. used: how many the depth is of.
    """

    frame: RGBDFrame
    name: str
    used: int
    said: tuple[str, ...]


def table_in(folder, camera: Intrinsics, sheet: Sheet | None = None) -> Table:
    """Make a frame of a folder of photographs of one table; what does not belong is left out by name.

    camera: as `labkit calibrate` wrote it. Raises ValueError with what to do if too few photographs are left, or if
    they show too little of how far things are.
    """
    way = "brown_conrady" if camera.lens is None else camera.lens.model
    require("camera", way == "brown_conrady", "a lens of OpenCV's kind", way)
    require(
        "camera", camera.size is not None, "a file that says the photographs' size, as `labkit calibrate`'s", "none"
    )
    found, orientation, said = photographs(folder, (camera.size, camera.orientation))
    views, names = [], []
    for photograph, view in showing(
        found, orientation, lambda picture: view_of_sheet(picture, camera.K, camera.distortion, sheet), said
    ):
        views.append(view)
        names.append(photograph.path.name)
    views, names = _fitting(views, names, said)
    _check_count(len(views), LEAST, said)
    views, names = _from_one_side(views, names, said)
    swept, views, names = _unmoved(views, names, said)
    known = (swept.depth > 0.0).mean()
    require("folder", known >= KNOWN, f"photographs that agree on how far things are; {HOW}", f"{known:.0%} that agree")
    return Table(views[0].frame(swept.depth), names[0], len(views), tuple(said))


def _check_count(count: int, least: int, said: list[str]) -> None:
    got = "".join(f"\n{line}" for line in said)
    require(
        "folder",
        count >= least,
        f"at least {least} photographs of the sheet that belong together; {HOW}",
        f"{count}{got}",
    )


def _fitting(views: list[View], names: list[str], said: list[str]) -> tuple[list[View], list[str]]:
    """Those photographs that were taken with this camera: the sheet's corners lie where its K and lens put them."""
    limit = max(MISFIT[0] * np.median([view.misfit for view in views]), 1e-3 * MISFIT[1]) if views else 0.0
    limit = min(limit, 2e-3 * MISFIT[1])  # where most do not fit, none does
    kept = [view.misfit <= limit for view in views]
    for view, name, fits in zip(views, names, kept, strict=True):
        if not fits:
            off = view.misfit * 1e3
            said.append(
                f"left out: {name}: the sheet's corners lie {off:.1f} thousandths of the picture's width beside where "
                "this camera sees them: zoomed, focused anew, another camera, or a sheet that is bent or no sheet of "
                "this kit; calibrate anew with the focus locked"
            )
    return [[value for value, fits in zip(values, kept, strict=True) if fits] for values in (views, names)]


def _from_one_side(views: list[View], names: list[str], said: list[str]) -> tuple[list[View], list[str]]:
    """The middle photograph first, and up to eleven that see the table from its side; those too far are named."""
    order = central_first(views)
    views, names = [views[i] for i in order], [names[i] for i in order]
    angles = [_parallax(views[0], view) for view in views]
    for name, angle in zip(names, angles, strict=True):
        if angle > ASIDE:
            said.append(f"left out: {name}: taken {angle:.0f} degrees around the table from {names[0]}")
    near = sorted((i for i, angle in enumerate(angles) if angle <= ASIDE), key=lambda i: angles[i])
    said.extend(f"left out: {names[i]}: {MOST} photographs are enough" for i in near[MOST:])
    near = near[:MOST]
    _check_count(len(near), LEAST, said)
    widest = angles[near[-1]]
    require("folder", widest >= APART, f"photographs from several places; {HOW}", f"all within {widest:.1f} degrees")
    return [views[i] for i in near], [names[i] for i in near]


def _parallax(one: View, other: View) -> float:
    """Degrees between two cameras as a point of the table sees them that lies in the middle of the first's picture."""
    C, z = one.T_base_cam[:3, 3], one.T_base_cam[:3, 2]
    point = C + z * min(C[2] / max(-z[2], 1e-3), 2.0)
    a, b = C - point, other.T_base_cam[:3, 3] - point
    return float(np.degrees(np.arccos(np.clip(a @ b / np.linalg.norm(a) / np.linalg.norm(b), -1.0, 1.0))))


def _unmoved(views: list[View], names: list[str], said: list[str]) -> tuple[Swept, list[View], list[str]]:
    """Sweep; a photograph in which something lies elsewhere is named and left out, and the others are swept again."""
    while True:
        swept = sweep(views, lambda heights: tqdm(heights, desc="trying heights", unit="height"))
        odd = {0} if 2 * len(swept.odd) > len(views) - 1 else {*swept.odd}
        if not odd:
            return swept, views, names
        said.extend(
            f"left out: {names[i]}: something lies elsewhere than in the others, or hides it" for i in sorted(odd)
        )
        views, names = [[value for i, value in enumerate(values) if i not in odd] for values in (views, names)]
        _check_count(len(views), LEAST_VIEWS, said)


def write(data, name: str, frame: RGBDFrame) -> list[Path]:
    """Add a frame to a folder of the kit's layout, whole or not at all; returns what was written.

    color/NAME.png, depth/NAME.png (16 bits, millimetres, 0 unknown), pose/NAME.txt (x y z qx qy qz qw, T_base_cam in
    the sheet's base frame) and camera.json. Raises ValueError for a camera.json of another camera that is there.
    """
    from labcli.camera_formats import camera_of
    from labcli.documents import parsed, text_of

    data = Path(data)
    check_new(data, name)
    (fx, _, cx), (_, fy, cy) = frame.K[:2].tolist()
    camera = {"width": frame.size[0], "height": frame.size[1], "fx": fx, "fy": fy, "cx": cx, "cy": cy}
    there = data / "camera.json"
    if there.is_file():
        old = camera_of(parsed("camera", text_of("camera", there)))
        same = old is not None and old.size == frame.size and np.allclose(old.K, frame.K, rtol=1e-6)
        require(
            "out", same, f"a folder whose camera.json is this camera's, or a new one, not {data}", "another camera's"
        )
    pose = (*frame.T_base_cam[:3, 3], *Rotation.from_matrix(frame.T_base_cam[:3, :3]).as_quat())
    millimetres = np.rint(1e3 * frame.depth).clip(0, 65_535).astype(np.uint16)
    files = {
        there: dumped(camera),
        data / "pose" / f"{name}.txt": (" ".join(f"{number:.8f}" for number in pose) + "\n").encode(),
        data / "depth" / f"{name}.png": cv2.imencode(".png", millimetres)[1].tobytes(),
        data / "color" / f"{name}.png": cv2.imencode(".png", frame.rgb[..., ::-1])[1].tobytes(),
    }
    new = {path: content for path, content in files.items() if not path.is_file()}
    try:
        for path, content in new.items():  # colour last: who looks into the folder takes that for a picture
            write_atomically(path, content)
    except BaseException:
        for path in new:
            path.unlink(missing_ok=True)
        raise
    return list(files)


def check_new(data, name: str) -> None:
    """Raise ValueError or OSError if a frame of that name cannot be added to a folder, before the work."""
    plain = name and Path(name).name == name and not name.startswith(".") and not {*name} & {*'\\/:*?"<>|'}
    require("name", plain, "a file's name without folder and ending", repr(name))
    for part in ("color", "depth", "pose"):
        there = sorted(Path(data, part).glob(f"{name}.*")) if Path(data, part).is_dir() else []
        there = [path.name for path in there if path.stem == name]
        require("name", not there, f"one that {data} does not have yet", f"{part}/{''.join(there[:1])}")
    check_writable(data)


def describe(table: Table, written: list[Path]) -> str:
    """Say what was found, and how to go on."""
    frame = table.frame
    tilt = np.degrees(np.arcsin(np.clip(-frame.T_base_cam[2, 2], -1.0, 1.0)))
    camera, _, depth, color = written
    return "\n".join(
        [
            *table.said,
            f"{table.used} photographs; the frame is that of {table.name}",
            f"camera: {frame.T_base_cam[2, 3]:.3f} m over the sheet, looking {tilt:.0f} degrees down",
            f"depth is known at {(frame.depth > 0.0).mean():.0%} of the pixels",
            *(f"wrote {path}" for path in written),
            f"next: labkit perceive {color} {depth} --intrinsics {camera} --anything",
        ]
    )
