"""A phone and a printed sheet: how good is depth from seven photographs, and what is found with it?

Simulated photographs (`data_gen.phone`) of scenes of `any` that nothing was trained on, seeds from 700,000: a lens,
exposure by picture and by place, blur, noise, JPEG, a hand that rolls; a fifth of the things white, a third of the
tables plain. The sheet is found at 1280 x 960, poses are those that it gives, and the sweep (`labkit.geometry.sweep`)
runs at 640 x 480. Beside it the same views drawn without lens and noise, with exact depth and poses. As one piece: a
thing's IoU with something found is over 0.5. False: most pixels of what is found lie on no thing. In brackets: 95 %
intervals (Wilson). No weights were trained on such depth; the sweep's constants were chosen on seeds 700,001, 700,003
and 700,004 and on the real sets. The last table is of real photographs of a table (`../shared/real/views`), whose poses
are a tracker's and whose depth is a Kinect's; where they are not, it is left out.
`python -m bench.bench_phone 40` takes 40 scenes.
"""

import sys
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from bench.measure import table
from data_gen.phone import Shots, photograph
from labcli.perceive import perceive
from labkit.frame import RGBDFrame
from labkit.geometry import back_project, base_on_table, find_tables, invert_transform, nearest_rotation
from labkit.geometry.sweep import LEAST_VIEWS, View, sweep, view_of_sheet
from labkit.instance_metrics import InstanceScores, pool, score_instances
from labkit.learning.network import load_model, weights_path
from labkit.learning.things import instance_finder, segment_instances
from labkit.metrics import wilson_interval
from labkit.pipeline import Pipeline

FIRST, SCENES = 700_000, 20
NEAR = 0.01  # metres
REAL = Path(__file__).resolve().parents[2] / "shared" / "real" / "views"
REAL_K = np.array([[525.0, 0.0, 320.0], [0.0, 525.0, 240.0], [0.0, 0.0, 1.0]])
ON_TABLE, ON_THINGS = 0.012, (0.02, 0.3)  # metres over the table


@dataclass(frozen=True, eq=False)
class Looked:
    """What was found in one frame: scores of its things, false ones, and whether the best grasp is on a thing."""

    scores: InstanceScores
    false: int
    grasp: str


def main(scenes: int = SCENES) -> str:
    """Photograph scenes and score both kinds of depth; returns the tables."""
    network = load_model(weights_path("unet_rgbd"))
    errors, without, poses, ways = [], 0, [], {"photographs": [], "exact": []}
    for seed in range(FIRST, FIRST + int(scenes)):
        shots = photograph(seed)
        views = [view_of_sheet(picture, shots.K, shots.distortion) for picture in shots.pictures]
        without += sum(view is None for view in views)
        poses += [pose_error(shots, i, view) for i, view in enumerate(views) if view is not None]
        ways["exact"].append(look(network, shots.frame, shots))
        seen = [view for view in views if view is not None]
        if views[0] is None or len(seen) < LEAST_VIEWS:
            empty = np.zeros_like(shots.frame.instances)
            scores = score_instances(shots.frame.instances, empty)
            ways["photographs"].append(Looked(scores, 0, "none"))
            continue
        depth = sweep(seen).depth
        frame = replace(shots.frame, rgb=views[0].rgb, depth=depth, T_base_cam=shots.T_base_sheet @ views[0].T_base_cam)
        errors.append(depth_errors(depth, shots.frame))
        ways["photographs"].append(look(network, frame, shots))
        print(seed, *(f"{way}: {looked_[-1].scores.over(0.5)}" for way, looked_ in ways.items()), file=sys.stderr)
    count = int(scenes) * len(shots.pictures)
    metres, degrees = np.median(poses, axis=0)
    head = (
        f"{scenes} scenes, {count} photographs; no sheet was found in {without}. Poses are off by "
        f"{1e3 * metres:.2f} mm and {degrees:.3f} degrees in the median."
    )
    parts = [
        head,
        table("depth of photographs | known | median error, mm | within 10 mm of what is known", depth_rows(errors)),
        table(
            "depth | things as one piece | found | false per scene | foreground IoU | best grasp on a thing, off, none",
            [row(way, looked_) for way, looked_ in ways.items()],
        ),
    ]
    if REAL.is_dir():
        header = "real views | table known | table within 10 mm, of all | things known | within 15 mm, of all"
        parts.append(table(header, [real(folder) for folder in sorted(REAL.iterdir()) if folder.is_dir()]))
    return "\n\n".join(parts)


def pose_error(shots: Shots, i: int, view: View) -> tuple[float, float]:
    """How far a detected pose is off: metres, degrees."""
    true = invert_transform(shots.T_base_sheet) @ shots.T_base_cam[i]
    off = invert_transform(true) @ view.T_base_cam
    turn = np.degrees(np.linalg.norm(cv2.Rodrigues(off[:3, :3])[0]))
    return float(np.linalg.norm(off[:3, 3])), float(turn)


def depth_errors(depth, true: RGBDFrame) -> dict[str, tuple[float, float, float]]:
    """Of things and of the table: share known, median error in metres, share of these within 10 mm."""
    known, off = depth > 0.0, np.abs(depth - true.depth)
    where = {"things": true.instances > 0, "table": true.labels == 1}
    return {
        name: (known[mask].mean(), float(np.median(off[known & mask])), (off[known & mask] < NEAR).mean())
        for name, mask in where.items()
    }


def depth_rows(errors: list[dict]) -> list[list]:
    """Means over scenes."""
    means = {name: np.mean([scene[name] for scene in errors], axis=0) for name in errors[0]}
    return [[name, f"{k:.0%}", f"{1e3 * off:.1f}", f"{near:.0%}"] for name, (k, off, near) in means.items()]


def look(network, frame: RGBDFrame, shots: Shots) -> Looked:
    """Find things in a frame, and plan grasps of them."""
    true = shots.frame.instances
    found = segment_instances(network, frame).instances
    false = sum((true[found == number] > 0).mean() <= 0.5 for number in np.unique(found[found > 0]))
    pipeline = Pipeline(find_objects=instance_finder(network), workspace="table")
    bare = replace(frame, labels=None, instances=None)
    seen = perceive(bare, pipeline, T_base_cam=frame.T_base_cam, table_z=frame.table_z).perception
    if not seen.plan.grasps:
        return Looked(score_instances(true, found), int(false), "none")
    under = true.ravel()[seen.pixels[seen.plan.grasps[0].target]]
    return Looked(score_instances(true, found), int(false), "on" if np.mean(under > 0) > 0.5 else "off")


def row(way: str, looked: list[Looked]) -> list:
    """One way's row of the table of things."""
    s = pool([one.scores for one in looked])
    low, high = wilson_interval(s.over_half, s.true)
    grasps = ", ".join(str(sum(one.grasp == place for one in looked)) for place in ("on", "off", "none"))
    pieces = f"{s.over_half} of {s.true} ({s.over_half / s.true:.0%}; {low:.0%} to {high:.0%})"
    false = sum(one.false for one in looked) / len(looked)
    return [way, pieces, s.found, f"{false:.1f}", f"{s.foreground_iou:.2f}", grasps]


def real(folder: Path) -> list:
    """One set of real photographs: its table and what stands on it, beside the Kinect's depth."""
    depth = cv2.imread(str(folder / "depth_0.png"), cv2.IMREAD_UNCHANGED).astype(np.float32) / 1e3
    P = back_project(depth, REAL_K)
    found = find_tables(P)[0]
    T_base_cam = base_on_table(found.plane)
    views = []
    for i in range(len(list(folder.glob("color_*.jpg")))):
        T = np.loadtxt(folder / f"pose_{i}.txt")
        T[:3, :3] = nearest_rotation(T[:3, :3])
        rgb = cv2.imread(str(folder / f"color_{i}.jpg"))[..., ::-1]
        views.append(View(np.ascontiguousarray(rgb), REAL_K, T_base_cam @ T))
    swept = sweep(views).depth
    over = found.over(np.nan_to_num(P.reshape(-1, 3)).astype(float))[0].reshape(depth.shape) & (depth > 0.0)
    z = P @ T_base_cam[2, :3] + T_base_cam[2, 3]
    known, off = swept > 0.0, np.abs(swept - depth)
    flat, high = over & (np.abs(z) < ON_TABLE), over & (z > ON_THINGS[0]) & (z < ON_THINGS[1])
    shares = [known[flat].mean(), (known & (off < NEAR))[flat].mean()]
    shares += [known[high].mean(), (known & (off < 1.5 * NEAR))[high].mean()]
    return [folder.name, *(f"{share:.0%}" for share in shares)]


if __name__ == "__main__":
    print(main(*sys.argv[1:]))
