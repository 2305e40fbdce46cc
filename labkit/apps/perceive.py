"""`labkit perceive`: a colour picture and a depth picture of anybody's camera become a mask, clouds, grasps, a report.

Without a camera pose the table is found in the depth picture (`base_on_table`), and the base frame is laid on it.
"""

import base64
import html
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path

import cv2
import numpy as np
import trimesh
from jaxtyping import Float, UInt8
from matplotlib.colors import to_hex

from labkit.apps.node_command import numbers_of
from labkit.frame import RGBDFrame, read_image
from labkit.geometry import Plane, back_project, fit_plane, invert_transform, project, transform_points
from labkit.grasp import Gripper
from labkit.labels import CLASSES, IGNORE, PALETTE, SURFACE, TARGET, overlay
from labkit.notices import notices
from labkit.pipeline import Perception, Pipeline
from labkit.support.files import write_atomically
from labkit.support.validation import require
from labkit.views import View, fingers

MOST_POINTS = 9000  # of the report's view: more make the page heavy, and the eye sees no difference
TABLE_MARGIN = 0.02  # metres under the table that noise may reach
ROOM = 0.5  # metres over the table that matter for a grasp
WORKSPACE = ((-20.0, 20.0), (-20.0, 20.0), (-TABLE_MARGIN, ROOM))  # further off nothing is grasped
SHOWN = 5  # grasps that the report lists and draws
AROUND = 0.08  # metres around the targets that the view shows
JAWS = (255, 255, 255), (30, 110, 255)  # colours of the other grasps' jaws and of the best one's, in the picture


# --------------------------------------------------------------------------------------------- what comes in


@dataclass(frozen=True, eq=False)
class Intrinsics:
    """A camera's matrix K, (3, 3), and if the file says them its depth unit in metres, size and lens coefficients.

    size: width and height of the pictures that it is the camera of.
    """

    K: Float[np.ndarray, "3 3"]
    depth_scale: float | None = None
    size: tuple[int, int] | None = None
    distortion: tuple[float, ...] = ()


def read_intrinsics(text: str) -> Intrinsics:
    """Read a camera matrix: "fx fy cx cy" itself, or a file of one of the usual kinds.

    JSON of librealsense (fx, fy, ppx, ppy), of BOP (fx, fy, cx, cy, or cam_K of scene_camera.json; depth_scale in
    millimetres), of Open3D (intrinsic_matrix, column by column); the YAML of ROS (camera_matrix); or a text file of
    four or nine numbers. Raises ValueError if there is none of these, FileNotFoundError for a missing file. Topic 06.

    >>> read_intrinsics("600 601 320 240").K.tolist()
    [[600.0, 0.0, 320.0], [0.0, 601.0, 240.0], [0.0, 0.0, 1.0]]
    """
    numbers = numbers_of(text)
    if len(numbers) in (4, 9):
        return Intrinsics(_matrix(numbers))
    path = Path(text)
    if not path.is_file():
        raise FileNotFoundError(f'intrinsics: expected "fx fy cx cy" or a file, got {text!r}')
    content = path.read_text(encoding="utf-8", errors="replace")
    camera = None
    try:
        camera = _from_json(json.loads(content))
    except json.JSONDecodeError:
        yaml = re.search(r"camera_matrix:.*?data:\s*\[(.*?)\]", content, re.DOTALL)
        numbers = numbers_of(yaml[1] if yaml else content)
        lens = re.search(r"distortion_coefficients:.*?data:\s*\[(.*?)\]", content, re.DOTALL)
        sides = dict(re.findall(r"^image_(width|height):\s*(\d+)", content, re.MULTILINE))
        size = (int(sides["width"]), int(sides["height"])) if len(sides) == 2 else None
        if len(numbers) in (4, 9):
            camera = Intrinsics(_matrix(numbers), None, size, tuple(numbers_of(lens[1])) if lens else ())
    except (AttributeError, KeyError, TypeError, ValueError):
        pass
    if camera is None:
        raise ValueError(
            f"intrinsics: found no camera matrix in {path}; expected fx, fy, cx, cy (or ppx, ppy), cam_K, "
            "intrinsic_matrix, camera_matrix, or four or nine numbers"
        )
    model = re.search(r'model"?:\s*"?([\w.]+)', content)
    return replace(camera, distortion=_lens(camera.distortion, model[1] if model else ""))


def _matrix(numbers: list[float]) -> Float[np.ndarray, "3 3"]:
    if len(numbers) == 9:
        return np.array(numbers).reshape(3, 3)
    fx, fy, cx, cy = numbers
    return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])


def _from_json(facts: dict) -> Intrinsics:
    """The camera of a JSON file; of several frames (BOP) the first one's."""
    if "fx" not in facts and all(isinstance(value, dict) for value in facts.values()):
        facts = facts[min(facts, key=lambda name: (len(name), name))]
    scale = facts.get("depth_scale")
    if "cam_K" in facts:
        K = _matrix([float(value) for value in facts["cam_K"]])
    elif "intrinsic_matrix" in facts:
        K = _matrix([float(value) for value in facts["intrinsic_matrix"]]).T
    else:
        cx, cy = (facts[new] if new in facts else facts[old] for new, old in (("cx", "ppx"), ("cy", "ppy")))
        K = _matrix([float(value) for value in (facts["fx"], facts["fy"], cx, cy)])
    size = (int(facts["width"]), int(facts["height"])) if {"width", "height"} <= facts.keys() else None
    distortion = tuple(float(k) for k in facts.get("coeffs", ()))
    return Intrinsics(K, None if scale is None else 0.001 * float(scale), size, distortion)


def _lens(coefficients: Sequence[float], model: str) -> tuple[float, ...]:
    """Coefficients that `rectify` can undo; of a lens that does nothing, none."""
    if not any(coefficients):
        return ()
    known = not re.search("inverse|equidistant|fisheye|kannala|theta", model, re.IGNORECASE)
    if not known or len(coefficients) not in (4, 5, 8, 12, 14):
        raise ValueError(
            f"intrinsics: expected a lens of 4, 5, 8, 12 or 14 coefficients k1, k2, p1, p2, ... (plumb_bob), got "
            f"{len(coefficients)} of {model or 'no named model'}; rectify the pictures first"
        )
    return tuple(coefficients)


def rectify(image: np.ndarray, camera: Intrinsics, smooth: bool = False, outside: int = 0) -> np.ndarray:
    """Undo the camera's lens: the picture, (H, W) or (H, W, 3), that a pinhole with the same K would have taken.

    smooth: mix neighbours, for colours; depth and labels take the nearest pixel. outside: what stands where the lens
    saw nothing. A picture of a lens without distortion is given back as it is. Topic 06.
    """
    if not camera.distortion:
        return image
    lens, size = np.array(camera.distortion), image.shape[1::-1]
    maps = cv2.initUndistortRectifyMap(camera.K, lens, None, camera.K, size, cv2.CV_32FC1)
    return cv2.remap(image, *maps, cv2.INTER_LINEAR if smooth else cv2.INTER_NEAREST, borderValue=(outside,) * 3)


def read_gripper(text: str) -> Gripper:
    """Read a gripper's measures in metres, "max_opening=0.14 pad_width=0.022" or a JSON file; the rest is the Panda's.

    Raises ValueError for other words, other names, or measures that do not fit together.

    >>> read_gripper("max_opening=0.14").max_opening
    0.14
    """
    names = [measure.name for measure in fields(Gripper)]
    try:
        words = (
            json.loads(Path(text).read_text(encoding="utf-8"))
            if Path(text).is_file()
            else text.replace(",", " ").split()
        )
        given = words if isinstance(words, dict) else dict(word.split("=") for word in words)
        measures = {name: float(metres) for name, metres in given.items()}
    except (TypeError, ValueError):
        raise ValueError(f'gripper: expected "NAME=METRES ..." or a JSON file of them, got {text!r}') from None
    unknown = ", ".join(sorted(measures.keys() - set(names)))
    require("gripper", not unknown, f"measures of {', '.join(names)}", unknown)
    return Gripper(**measures)


def read_workspace(text: str) -> tuple[tuple[float, float], ...]:
    """Read "x x y y z z": from and to, metres in the base frame, z from the table.

    Raises ValueError for other words than six numbers.
    """
    numbers = numbers_of(text)
    require("workspace", len(numbers) == 6, "six numbers, x x y y z z", repr(text))
    return tuple(zip(numbers[::2], numbers[1::2], strict=True))


def read_mask(path, size: tuple[int, int], target: int | None = None, instances: bool = False, camera=None):
    """Read somebody's mask: labels, uint8 (H, W), and the numbers of the objects if it holds them, else None.

    0 and one other value, such as 255, mean "target"; other values are the kit's own classes. size: width and height
    that it must have. target: the value that means "target", whatever the others mean. instances: each value above 0 is
    an object, and a target. camera: whose lens is undone, as `read_frame` does. Raises ValueError for an image of
    another kind or size, and for values that no class has.
    """
    mask = read_image("mask", path, np.uint8)
    require("mask", mask.shape[::-1] == size, f"the colour picture's size, {size[0]} x {size[1]}", mask.shape[::-1])
    mask = mask if camera is None else rectify(mask, camera)
    values = np.unique(mask)
    if instances or target is not None or len(values[values > 0]) <= 1:
        chosen = mask > 0 if target is None else mask == target
        return np.where(chosen, TARGET, 0).astype(np.uint8), mask if instances else None
    if not np.isin(values, [*range(len(CLASSES)), IGNORE]).all():
        raise ValueError(
            f"mask: expected 0 and one other value, or labels 0 to {len(CLASSES) - 1} and 255, "
            f"got {values[:6].tolist()}{' ...' if len(values) > 6 else ''}; --instances takes each for an object, "
            "--target N one for the target"
        )
    return mask, None


def read_frame(color, depth, intrinsics: Intrinsics, depth_scale: float | None = None) -> RGBDFrame:
    """Read the two pictures as one frame, in the camera's own frame (T_base_cam is the identity), the lens undone.

    depth_scale: metres per unit of the depth file; if None, what the intrinsics' file says, or else 0.001. Raises
    ValueError with the likely cause if the files are swapped, their sizes differ, or the depths cannot be metres.
    """
    scale = depth_scale or intrinsics.depth_scale or 0.001
    rgb = read_image("color", color, np.uint8, colour=True)
    raw = read_image("depth", depth, np.uint16)
    if raw.shape != rgb.shape[:2]:
        sizes = " and ".join(f"{w} x {h}" for h, w in (rgb.shape[:2], raw.shape))
        raise ValueError(f"depth: expected the size of the colour picture, got {sizes}; align depth to colour first")
    size = rgb.shape[1::-1]
    if intrinsics.size not in (None, size):
        raise ValueError(
            f"intrinsics: expected a calibration of pictures of {size[0]} x {size[1]}, got one of "
            f"{intrinsics.size[0]} x {intrinsics.size[1]}"
        )
    metres = raw.astype(np.float32) * np.float32(scale)
    seen = metres[raw > 0]
    if not seen.size:
        raise ValueError(f"depth: {depth} holds no reading, only zeros")
    middle = float(np.median(seen))
    if not 0.05 <= middle <= 20.0:
        raise ValueError(
            f"depth_scale: with {scale:g} metres per unit the median depth is {middle:.3g} m; the file's values are "
            f"around {np.median(raw[raw > 0]):.0f}: 0.001 is right for millimetres, 0.0001 for tenths of them"
        )
    pictures = rectify(rgb, intrinsics, smooth=True), rectify(metres, intrinsics)
    return RGBDFrame(*pictures, intrinsics.K, np.eye(4))


def on_table(frame: RGBDFrame) -> tuple[RGBDFrame, Plane]:
    """Find the table in a frame's depth, and give the frame with the base frame laid on it; its table_z is 0."""
    P = back_project(frame.depth, frame.K)
    plane = fit_plane(P[np.isfinite(P[..., 2])])
    return replace(frame, T_base_cam=base_on_table(plane), table_z=0.0), plane


def base_on_table(plane: Plane) -> Float[np.ndarray, "4 4"]:
    """Lay a base frame on a table that was found in the camera's frame: T_base_cam.

    The origin is the table's point under the camera, z is the table's normal, and x points away from the camera, along
    its line of sight; looking straight down, along the picture's upper edge. Topic 06.

    >>> base_on_table(Plane(np.array([0.0, 0.0, -1.0]), 0.7, np.ones(4, bool), 0.0))[:3, 3].tolist()
    [0.0, 0.0, 0.7]
    """
    z = plane.normal
    ahead = np.array([0.0, 0.0, 1.0])
    if abs(z @ ahead) > 0.999:
        ahead = np.array([0.0, -1.0, 0.0])
    x = ahead - (ahead @ z) * z
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3] = np.stack([x, np.cross(z, x), z])
    T[2, 3] = plane.offset
    return T


# ---------------------------------------------------------------------------------------------- what is made of it


@dataclass(frozen=True, eq=False)
class Seen:
    """A frame in the base frame, what was perceived in it, what looks wrong, and the table's plane if it was fitted.

    gripper: the hand that was planned for.
    """

    frame: RGBDFrame
    perception: Perception
    notices: tuple[str, ...] = ()
    plane: Plane | None = None
    gripper: Gripper = field(default_factory=Gripper)


def perceive(
    frame: RGBDFrame,
    model=None,
    labels=None,
    T_base_cam=None,
    table_z: float = 0.0,
    instances=None,
    gripper: Gripper | None = None,
    workspace=WORKSPACE,
    target_class: int = TARGET,
) -> Seen:
    """Run the chain on a frame that is given in the camera's own frame.

    model: what a `Pipeline` takes, or None with somebody else's `labels`, and the `instances` among them if known.
    T_base_cam: the camera's pose; without it the largest plane of the depth picture is taken for the table, and
    `table_z` for 0. gripper, workspace, target_class: as in `Pipeline`; all that was seen over the table is the
    workspace, if none is given. Raises ValueError if no plane can be found, or for an argument that does not fit.
    Topics 06 and 07.
    """
    plane = None
    if T_base_cam is None:
        frame, plane = on_table(frame)
    else:
        frame = replace(frame, T_base_cam=T_base_cam, table_z=table_z)
    pipeline = Pipeline(model, target_class=target_class, workspace=workspace, gripper=gripper)
    perception = pipeline.run(frame) if labels is None else pipeline.locate(frame, labels, instances=instances)
    return Seen(frame, perception, notices(frame, perception), plane, gripper or Gripper())


def describe(seen: Seen) -> str:
    """Say what was found, in lines for a terminal: what looks wrong, the table, each target, how to grasp."""
    p, lines = seen.perception, [f"notice: {sentence}" for sentence in seen.notices]
    if seen.plane is not None:
        height = seen.frame.T_base_cam[2, 3]
        tilt = np.degrees(np.arcsin(np.clip(-seen.frame.T_base_cam[2, 2], -1.0, 1.0)))
        lines.append(
            f"table: {seen.plane.inliers.mean():.0%} of {seen.plane.inliers.size} points lie on one plane, "
            f"{1000.0 * seen.plane.residual:.1f} mm off it (root mean square)"
        )
        lines.append(f"camera: {height:.3f} m over the table, looking {tilt:.0f} degrees down")
    for number, (cloud, certainty) in enumerate(zip(p.clouds, p.certainty, strict=True), start=1):
        middle = ", ".join(f"{x:+.3f}" for x in cloud.mean(axis=0, dtype=np.float64))
        lines.append(f"target {number}: {len(cloud)} points around ({middle}) m, certainty {certainty:.2f}")
    if not p.plan.grasps:
        return "\n".join([*lines, f"no grasp: {p.plan.reason}"])
    best = p.plan.grasps[0]
    place = ", ".join(f"{x:+.3f}" for x in best.T_base_grasp[:3, 3])
    yaw = np.degrees(np.arctan2(best.T_base_grasp[1, 1], best.T_base_grasp[0, 1])) % 180.0
    lines.append(
        f"best grasp: target {best.target + 1}, close at ({place}) m of the base frame, from jaws "
        f"{100.0 * best.width:.1f} cm apart, closing at {yaw:.0f} degrees from x; score {best.score:.2f}, the best of "
        f"{len(p.plan.grasps)}"
    )
    return "\n".join(lines)


def grasps_json(seen: Seen) -> dict:
    """The grasps as plain data: poses in the base frame and in the camera's, metres; width, score, target."""
    T_cam_base = invert_transform(seen.frame.T_base_cam)
    p = seen.perception
    return {
        "T_base_cam": seen.frame.T_base_cam.tolist(),
        "table_z": seen.frame.table_z,
        "reason": p.plan.reason,
        "notices": list(seen.notices),
        "targets": [
            {"points": len(cloud), "centroid": cloud.mean(axis=0, dtype=np.float64).tolist(), "certainty": certainty}
            for cloud, certainty in zip(p.clouds, p.certainty, strict=True)
        ],
        "grasps": [
            {
                "T_base_grasp": grasp.T_base_grasp.tolist(),
                "T_cam_grasp": (T_cam_base @ grasp.T_base_grasp).tolist(),
                "width": float(grasp.width),
                "score": float(grasp.score),
                "target": grasp.target + 1,
            }
            for grasp in p.plan.grasps
        ],
    }


def view(seen: Seen) -> View:
    """Cloud, targets and jaws in 3-D: the targets and what is close to them, or without any what is on the table."""
    p, table_z = seen.perception, seen.frame.table_z or 0.0
    P, rgb = p.points.reshape(-1, 3), seen.frame.rgb.reshape(-1, 3)
    others = (P[:, 2] > table_z - TABLE_MARGIN) & (P[:, 2] < table_z + ROOM)
    others = others if others.any() else np.isfinite(P[:, 2])  # a wrong unit or pose: nothing is near the table
    shown = np.concatenate(p.clouds or [P[others]] if others.any() else [np.zeros((1, 3))])
    low, high = np.percentile(shown, [1, 99], axis=0)
    middle, half = (low + high) / 2, (high - low) / 2 + AROUND
    others &= (p.labels.ravel() != p.target_class) & (np.abs(P - middle) < half).all(axis=1)
    others = np.flatnonzero(others)
    others = others[:: max(1, len(others) // MOST_POINTS)]
    around = (P[others], rgb[others]) if len(others) else (middle[None], rgb[:1])  # a view is of one point at least
    shown = View(eye=tuple((seen.frame.T_base_cam[:3, 3] - middle).tolist()), height=560)
    shown.points(around[0], "what the camera saw", around[1], 1.5)
    for number, cloud in enumerate(p.clouds, start=1):
        some = cloud[:: max(1, len(cloud) // 3000)]
        shown.points(some, f"target {number}", to_hex(PALETTE[TARGET] / 255), 2.5)
    hand = seen.gripper
    return shown.jaws(p.plan.grasps[:1], hand, "best grasp").jaws(
        p.plan.grasps[1:SHOWN], hand, "other grasps", "#bbbbbb"
    )


def picture(
    rgb: UInt8[np.ndarray, "H W 3"], labels: UInt8[np.ndarray, "H W"], targets=()
) -> UInt8[np.ndarray, "H W 3"]:
    """The colour picture with its labels laid over it, and the targets outlined in white.

    targets: the pixels of each, indices v * W + u; without any, those labelled target are outlined together.
    """
    painted = overlay(rgb, np.where(labels == SURFACE, 0, labels))
    for pixels in targets or [np.flatnonzero(labels == TARGET)]:
        target = np.zeros(labels.shape, np.uint8)
        target.ravel()[pixels] = 1
        outlines, _ = cv2.findContours(target, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
        cv2.drawContours(painted, outlines, -1, (255, 255, 255), 1)
    return painted


def with_grasps(frame: RGBDFrame, grasps, gripper: Gripper | None = None) -> UInt8[np.ndarray, "H W 3"]:
    """The colour picture with the outlines of the opened jaws as the camera would see them, the best ones blue."""
    image, T_cam_base = frame.rgb.copy(), invert_transform(frame.T_base_cam)
    for grasp in grasps[:SHOWN][::-1]:  # the best one last, on top
        for corners in fingers(grasp.T_base_grasp, grasp.width, gripper or Gripper()):
            uv = np.stack(project(transform_points(T_cam_base, corners), frame.K), axis=1)
            if np.isfinite(uv).all():  # all in front of the camera
                hull = cv2.convexHull(np.rint(16.0 * uv).astype(np.int32))  # in sixteenths of a pixel
                thickness = max(1, round(frame.size[0] / 400))
                cv2.polylines(image, [hull], True, JAWS[grasp is grasps[0]], thickness, cv2.LINE_AA, shift=4)
    return image


# -------------------------------------------------------------------------------------------------- what goes out


def save(seen: Seen, out) -> list[Path]:
    """Write what was seen into the folder `out`: pictures, clouds, grasps.json and report.html; returns their paths.

    targets.png holds the number of the target at each pixel, 0 for none.
    """
    out = Path(out)
    p = seen.perception
    targets = np.zeros(p.labels.shape, np.uint8)
    for number, pixels in enumerate(p.pixels[:255], start=1):
        targets.ravel()[pixels] = number
    painted = picture(seen.frame.rgb, p.labels, p.pixels)
    files = {"overlay.png": _png(painted), "targets.png": cv2.imencode(".png", targets)[1].tobytes()}
    files |= {"grasps.json": json.dumps(grasps_json(seen), indent=1).encode()}
    for number, (cloud, pixels) in enumerate(zip(p.clouds, p.pixels, strict=True), start=1):
        colours = seen.frame.rgb.reshape(-1, 3)[pixels]
        files[f"target_{number}.ply"] = trimesh.PointCloud(cloud, colours).export(file_type="ply")
    files["report.html"] = report(seen).encode()
    for stale in out.glob("target_*.ply"):  # of an earlier picture with more targets
        if stale.name not in files:
            stale.unlink()
    for name, data in files.items():
        write_atomically(out / name, data)
    return [out / name for name in files]


def report(seen: Seen) -> str:
    """One HTML page that needs no network: the pictures, what was found, the grasps, and a view to turn."""
    p, depth = seen.perception, seen.frame.depth
    known = np.isfinite(depth) & (depth > 0.0)
    low, high = np.percentile(depth[known], [2, 98]) if known.any() else (0.0, 1.0)
    grey = np.clip((high - depth) / max(high - low, 1e-6), 0.0, 1.0)
    coloured = cv2.applyColorMap((255 * np.where(known, grey, 0.0)).astype(np.uint8), cv2.COLORMAP_VIRIDIS)
    coloured[~known] = 0
    pictures = {
        "what the camera saw, and the jaws: of the best grasp blue, of others white": with_grasps(
            seen.frame, p.plan.grasps, seen.gripper
        ),
        f"depth: {low:.2f} m (yellow) to {high:.2f} m (violet), black without a reading": coloured[..., ::-1],
        "labels: targets orange, obstacles green": picture(seen.frame.rgb, p.labels, p.pixels),
    }
    rows = "".join(
        f"<tr><td>{number}</td><td>{grasp.target + 1}</td>"
        + "".join(f"<td>{x:+.3f}</td>" for x in grasp.T_base_grasp[:3, 3])
        + f"<td>{100.0 * grasp.width:.1f}</td><td>{grasp.score:.2f}</td></tr>"
        for number, grasp in enumerate(seen.perception.plan.grasps[:SHOWN], start=1)
    )
    table = (
        "<table><caption>the best grasps, in the base frame</caption><tr><th>grasp</th><th>target</th><th>x (m)</th>"
        f"<th>y (m)</th><th>z (m)</th><th>opening (cm)</th><th>score</th></tr>{rows}</table>"
    )
    body = [figures(pictures), f"<pre>{html.escape(describe(seen))}</pre>", table if rows else ""]
    body += ["<h2>The view in 3-D: drag to turn, wheel to come closer</h2>", view(seen).html(script=True)]
    return PAGE.format(title="What the camera saw, and where to close the jaws", body="\n".join(body))


def figures(pictures: dict[str, UInt8[np.ndarray, "_ _ 3"]]) -> str:
    """Pictures, by their captions, as HTML that holds them."""
    return "".join(
        f'<figure><img alt="{html.escape(title)}" src="data:image/png;base64,{_base64(_at_most(image, 640))}">'
        f"<figcaption>{html.escape(title)}</figcaption></figure>"
        for title, image in pictures.items()
    )


PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title><style>
body {{ font: 16px/1.5 system-ui, sans-serif; max-width: 66em; margin: 2em auto; padding: 0 1em; color: #222 }}
figure {{ display: inline-block; width: 19em; margin: 0 1em 1em 0; vertical-align: top }}
img {{ width: 100% }} figcaption, caption {{ font-size: 0.85em; color: #555; text-align: left }}
table {{ border-collapse: collapse; margin: 1em 0 }} th, td {{ padding: 0.2em 0.8em; text-align: right }}
tr + tr {{ border-top: 1px solid #ddd }} pre {{ white-space: pre-wrap; background: #f5f5f5; padding: 1em }}
</style></head><body>
<h1>{title}</h1>
{body}
</body></html>
"""


def _at_most(image: UInt8[np.ndarray, "H W 3"], width: int) -> UInt8[np.ndarray, "h w 3"]:
    """An image no wider than `width`."""
    if image.shape[1] <= width:
        return image
    return cv2.resize(image, (width, round(image.shape[0] * width / image.shape[1])), interpolation=cv2.INTER_AREA)


def _png(rgb: UInt8[np.ndarray, "H W 3"]) -> bytes:
    return cv2.imencode(".png", np.ascontiguousarray(rgb[..., ::-1]))[1].tobytes()


def _base64(rgb: UInt8[np.ndarray, "H W 3"]) -> str:
    return base64.b64encode(_png(rgb)).decode()
