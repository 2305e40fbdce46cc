"""Pages for a browser without a network, and the pictures on them: labels, jaws, a view in 3-D."""

import base64
import html
import json
from pathlib import Path

import cv2
import numpy as np
import trimesh
from jaxtyping import UInt8
from matplotlib.colors import to_hex

from labcli.perceive import Seen, describe, grasps_json
from labcourse.views import View, fingers
from labkit.frame import RGBDFrame
from labkit.geometry import invert_transform, project, transform_points
from labkit.grasp import Gripper
from labkit.labels import PALETTE, SURFACE, TARGET, overlay
from labkit.support.files import write_atomically

TABLE_MARGIN, ROOM = 0.02, 0.5  # metres under the table that noise may reach, and over it that matter for a grasp
MOST_POINTS = 9000  # of the report's view: more make the page heavy, and the eye sees no difference
SHOWN = 5  # grasps that the report lists and draws
AROUND = 0.08  # metres around the targets that the view shows
JAWS = (255, 255, 255), (30, 110, 255)  # colours of the other grasps' jaws and of the best one's, in the picture


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


def save(seen: Seen, out) -> list[Path]:
    """Write what was seen into the folder `out`: pictures, clouds, grasps.json and report.html; returns their paths.

    targets.png holds the number of the target at each pixel, 0 for none.
    """
    out = Path(out)
    p = seen.perception
    targets = np.zeros(p.labels.shape, np.uint8 if len(p.pixels) <= 255 else np.uint16)
    for number, pixels in enumerate(p.pixels, start=1):
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
