"""`labkit calibrate`: photographs of the sheet become a camera, or tell where a camera is on an arm (topic 06)."""

import csv
import html
import io
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib.figure
import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from labcli.photographs import Photograph, photographs, showing
from labkit.geometry import invert_transform
from labkit.geometry.calibration import LEAST_VIEWS, Calibration, calibrate, hand_eye, sheet_pose
from labkit.geometry.sheet import RULER_MM, Chessboard, Corners, Sheet, Target
from labkit.support.validation import require

BLURRED = 2.0, 4.0  # edges so many times as wide as the median photograph's, and so many pixels in 1000 wide
ARROWS = 40.0  # how much longer than true the page draws residuals
POSES = "name, x, y, z, qx, qy, qz, qw"


@dataclass(frozen=True, eq=False)
class Views:
    """The sheet's corners in those photographs that show it well; their names, size and orientation; what is said."""

    corners: list[Corners]
    names: list[str]
    size: tuple[int, int]
    orientation: int
    said: list[str]


def target_of(chessboard: str, square: float | None, measured_mm: float) -> Target:
    """The kit's sheet as it was printed, or a chessboard "9x6" of one's own with squares of so many metres.

    >>> target_of("9x6", 0.025, 150.0)
    Chessboard(columns=9, rows=6, square=0.025)
    """
    if not chessboard:
        require("square", square is None, "--chessboard COLUMNSxROWS beside it", square)
        return Sheet(measured_mm / RULER_MM)
    counts = chessboard.lower().split("x")
    whole = len(counts) == 2 and all(count.strip().isdigit() for count in counts)
    require("chessboard", whole, "inner corners across and down, as 9x6", repr(chessboard))
    require("square", square is not None, "--square METRES beside --chessboard", square)
    return Chessboard(int(counts[0]), int(counts[1]), square)


def look(folder, target: Target, wanted: tuple[tuple[int, int], int] | None = None) -> Views:
    """Find a sheet in each photograph of a folder; those without it, and blurred ones, are left out by name.

    wanted: as in `photographs`. Raises ValueError or FileNotFoundError where no photograph can be read.
    """
    found, orientation, said = photographs(folder, wanted)
    corners, kept = [], []
    for photograph, seen in showing(found, orientation, target.find, said):
        corners.append(seen)
        kept.append(photograph)
    kept, corners = _sharp(kept, corners, said)
    size = (kept or found)[0].size(orientation) if found else (0, 0)
    return Views(corners, [photograph.path.name for photograph in kept], size, orientation, said)


def _sharp(kept: list[Photograph], corners: list[Corners], said: list[str]):
    """Those photographs that are not blurred beside the others."""
    widths = np.array([view.blur for view in corners])
    times, share = BLURRED
    limit = max(times * np.nanmedian(widths), 1e-3 * share * max(kept[0].sensor_size)) if kept else 0.0
    sharp = [not width > limit for width in widths]
    for photograph, width, fine in zip(kept, widths, sharp, strict=True):
        if not fine:
            said.append(f"left out: {photograph.path.name}: blurred, its edges are {width:.0f} pixels wide")
    return [[value for value, fine in zip(values, sharp, strict=True) if fine] for values in (kept, corners)]


def calibrated(views: Views) -> Calibration:
    """K and the lens from what `look` found; a photograph that does not fit the others is named in `views.said`."""
    if len(views.corners) < LEAST_VIEWS:
        raise ValueError(
            f"folder: expected at least {LEAST_VIEWS} photographs that show the sheet sharply, "
            f"got {len(views.corners)}; {'; '.join(views.said)}"
        )
    found = calibrate(views.corners, views.size)
    for i in found.dropped:
        views.said.append(f"left out: {views.names[i]}: does not fit the others: zoomed, focused anew, or a bent sheet")
    return found


def camera_json(found: Calibration, orientation: int) -> dict:
    """A camera as `labkit perceive --intrinsics` reads it, with its standard errors and how photographs are turned."""
    (fx, _, cx), (_, fy, cy) = found.K[:2].tolist()
    names = ("fx", "fy", "cx", "cy")
    return {
        "width": found.size[0],
        "height": found.size[1],
        **dict(zip(names, (fx, fy, cx, cy), strict=True)),
        "model": "plumb_bob",
        "coeffs": list(found.distortion),
        "rms": found.rms,
        "standard_errors": dict(zip(names, found.K_std, strict=True)),
        "exif_orientation": orientation,
    }


def describe(found: Calibration) -> str:
    """Say what was found, for a terminal and the page."""
    fx, fy, cx, cy = found.K[0, 0], found.K[1, 1], found.K[0, 2], found.K[1, 2]
    lines = [
        f"{len(found.used)} photographs of {found.size[0]} x {found.size[1]} pixels",
        *(
            f"{name} = {value:8.2f} pixels, standard error {error:.2f}"
            for name, value, error in zip(("fx", "fy", "cx", "cy"), (fx, fy, cx, cy), found.K_std, strict=True)
        ),
        f"lens k1, k2, p1, p2, k3 = {', '.join(f'{k:.4f}' for k in found.distortion)}",
        f"corners lie {found.rms:.2f} pixels from where this camera would see them (root mean square)",
        f"at 0.5 m, the error of fx alone puts a point at the picture's edge "
        f"{500.0 * found.size[0] / 2.0 / fx * found.K_std[0] / fx:.2f} mm off",
    ]
    return "\n".join(lines)


def page(found: Calibration, views: Views) -> str:
    """HTML of a calibration: where the corners were, how far off each lies, what was left out."""
    from labcli.report import PAGE

    rows = "".join(
        f"<tr><td>{html.escape(views.names[i])}</td><td>{len(left)}</td>"
        f"<td>{np.sqrt((left**2).sum(axis=1).mean()):.2f}</td><td>{views.corners[i].blur:.1f}</td></tr>"
        for i, left in zip(found.used, found.residuals, strict=True)
    )
    body = [
        f"<pre>{html.escape(describe(found))}</pre>",
        _figure(found, views),
        f"<ul>{''.join(f'<li>{html.escape(line)}</li>' for line in views.said)}</ul>",
        "<table><tr><th>photograph</th><th>corners</th><th>error (pixels)</th><th>width of edges (pixels)</th></tr>"
        f"{rows}</table>",
    ]
    return PAGE.format(title="What the camera is", body="\n".join(body))


def _figure(found: Calibration, views: Views) -> str:
    """The corners of all photographs in one picture, with their residuals as arrows, as SVG."""
    figure = matplotlib.figure.Figure(figsize=(8.0, 8.0 * found.size[1] / found.size[0] + 0.6), layout="constrained")
    axes = figure.add_subplot(
        xlim=(0, found.size[0]),
        ylim=(found.size[1], 0),
        aspect="equal",
        xlabel="u (pixels)",
        ylabel="v (pixels)",
        title=f"where the corners were, and their errors, drawn {ARROWS:.0f} times as long",
    )
    pixels = np.concatenate([views.corners[i].pixels for i in found.used])
    left = np.concatenate(found.residuals)
    axes.quiver(*pixels.T, *(ARROWS * left).T, angles="xy", scale_units="xy", scale=1.0, width=0.0015, color="#c62828")
    axes.plot(*pixels.T, ".", markersize=2, color="#1565c0")
    file = io.StringIO()
    with matplotlib.rc_context({"svg.hashsalt": "labkit"}):
        figure.savefig(file, format="svg", metadata={"Date": None})
    return file.getvalue()[file.getvalue().index("<svg") :]


# ------------------------------------------------------------------------------------------- a camera and an arm


def read_arm(path) -> dict[str, Float[np.ndarray, "4 4"]]:
    """Read a table of the arm's poses, T_base_hand, by photograph: rows "name, x, y, z, qx, qy, qz, qw", metres.

    Raises ValueError naming the row that is none.
    """
    from labkit.node.convert import rigid

    poses = {}
    for number, row in enumerate(csv.reader(io.StringIO(Path(path).read_text(encoding="utf-8-sig"))), start=1):
        words = [word.strip() for word in row]
        if not any(words) or words[0].startswith("#") or (number == 1 and words[1:2] == ["x"]):
            continue
        try:
            numbers = [float(word) for word in words[1:]]
            require("arm", len(numbers) == 7, f"{POSES}", row)
            require("arm", words[0] not in poses, "each photograph once", words[0])
            poses[words[0]] = rigid(numbers[:3], numbers[3:])
        except ValueError as error:
            raise ValueError(f"arm: row {number} of {path}: {error}; a row is {POSES}") from None
    return poses


def on_arm(
    views: Views, arm: dict[str, Float[np.ndarray, "4 4"]], K, distortion: Sequence[float]
) -> tuple[bool, Float[np.ndarray, "4 4"], Float[np.ndarray, "N 2"]]:
    """Find a camera beside or on an arm: whether it is on the hand, T_hand_cam then, else T_base_cam, and the scatter.

    Both are tried, a camera on the hand before a sheet that lies, and one that stands before a sheet on the hand: the
    right one has the sheet in one place. Raises ValueError where neither has, or a photograph has no pose.
    """
    missing = [name for name in views.names if name not in arm]
    require("arm", not missing, "a pose of each photograph", f"none of {', '.join(missing)}")
    T_base_hand = [arm[name] for name in views.names]
    T_cam_sheet = [sheet_pose(corners, K, distortion)[0] for corners in views.corners]
    hand = hand_eye(T_base_hand, T_cam_sheet)
    stand = hand_eye([invert_transform(T) for T in T_base_hand], T_cam_sheet)
    on_hand = bool(hand[1][:, 0].mean() < stand[1][:, 0].mean())
    X, scatter = hand if on_hand else stand
    require(
        "arm",
        scatter[:, 0].mean() < 0.02,
        "poses under which the sheet stays in one place, within 20 mm",
        f"{1000.0 * scatter[:, 0].mean():.0f} mm; do poses and photographs belong together, in metres, base from hand?",
    )
    return on_hand, X, scatter


def arm_json(on_hand: bool, X: Float[np.ndarray, "4 4"], scatter: Float[np.ndarray, "N 2"]) -> tuple[str, bytes]:
    """What was found of a camera and an arm, in words and as JSON, with the pose as `--camera-pose` takes it."""
    name = "T_hand_cam" if on_hand else "T_base_cam"
    seven = " ".join(f"{number:.6g}" for number in (*X[:3, 3], *Rotation.from_matrix(X[:3, :3]).as_quat()))
    away, turned = 1000.0 * scatter[:, 0], np.degrees(scatter[:, 1])
    where = "on the hand" if on_hand else "beside the arm"
    text = (
        f"the camera is {where}: {name} = {seven} (x y z qx qy qz qw)\n"
        f"under it the sheet stays within {away.mean():.1f} mm and {turned.mean():.2f} degrees in the mean, "
        f"{away.max():.1f} mm and {turned.max():.2f} degrees at most"
    )
    text += f'\n--camera-pose "{seven}"' if not on_hand else "\nT_base_cam of a picture is T_base_hand @ T_hand_cam"
    facts = {name: X.tolist(), "pose": seven, "millimetres": away.tolist(), "degrees": turned.tolist()}
    return text, dumped(facts)


def dumped(facts: dict) -> bytes:
    """JSON for a file."""
    return (json.dumps(facts, indent=1) + "\n").encode()
