"""A phone and a printed sheet: how good is depth from seven photographs, and what is found with it?

Simulated photographs (`data_gen.phone`) of scenes of `any` that nothing was trained on, seeds from 700,000: a lens,
exposure by picture and by place, blur, noise, JPEG, a hand that rolls; a fifth of the things white, a third of the
tables plain. The sheet is found at 1280 x 960, poses are those that it gives, and the sweep (`labkit.geometry.sweep`)
runs at 640 x 480. Beside it the same views drawn without lens and noise, with exact depth and poses. As one piece: a
thing's IoU with something found is over 0.5. False: most pixels of what is found lie on no thing. Lifts: the simulated
Panda tries what is planned for a click in the middle of the largest target in view (as `labkit perceive --anything
--at`). Heaps: scenes of `clutter`, of which nothing was trained on either. In brackets: 95 % intervals, of shares by
Wilson, of other numbers by drawing the scenes again. No weights were trained on such depth; the sweep's constants were
chosen on seeds 700,000, 700,001, 700,003 and 700,004 and on the real sets. The last table is of real photographs of a
table (`../shared/real/views`), whose poses are a tracker's and whose depth is a Kinect's; where they are not, it is
left out. Looked at: with the photographs' depth the same objects come out as with the Kinect's, a mug, a box and a game
controller, and two mugs and a parcel, up to 2 cm too wide; the box is in two pieces, and the controller has holes.
Around them are false pieces: slivers along the joints of the boards, and behind the table the backs of chairs and a
shelf, since a plain wall is taken for more of the table. The best grasp is on an object in both.
`python -m bench.bench_phone 100 10 kept.jsonl` takes 100 scenes and 10 heaps, and keeps what it has in a file, from
which it goes on.
"""

import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from bench.bench_things import middle
from bench.measure import resampled, table
from data_gen.phone import Shots, photograph
from labcli.evaluation import lift_anew
from labcli.perceive import perceive
from labkit.frame import RGBDFrame
from labkit.geometry import back_project, base_on_table, find_tables, invert_transform, nearest_rotation
from labkit.geometry.sweep import LEAST_VIEWS, View, sweep, view_of_sheet
from labkit.instance_metrics import InstanceScores, pool, score_instances
from labkit.labels import TARGET
from labkit.learning.things import instance_finder
from labkit.metrics import wilson_interval
from labkit.pipeline import Pipeline

FIRST, SCENES, HEAPS = 700_000, 20, 5
NEAR = 0.01  # metres
LEAST_CLICKED = 200  # pixels of a target that somebody can click on
REAL = Path(__file__).resolve().parents[2] / "shared" / "real" / "views"
REAL_K = np.array([[525.0, 0.0, 320.0], [0.0, 525.0, 240.0], [0.0, 0.0, 1.0]])
ON_TABLE, ON_THINGS = 0.012, (0.02, 0.3)  # metres over the table


@dataclass(frozen=True, eq=False)
class Looked:
    """What was found in one frame: scores of its things, false ones, where the best grasp is, and how a lift ended.

    grasp: "on", "off" or "none". lift: "lifted" or why not; "" where no target is in view.
    """

    scores: InstanceScores
    false: int
    grasp: str
    lift: str


@dataclass(frozen=True, eq=False)
class Scene:
    """A scene by both kinds of depth: photographs, those without a sheet, errors of poses (m, degrees) and depth.

    depth: for "things" and "table" the share known, median error and share within 10 mm; None without a frame.
    """

    photographs: int
    without: int
    poses: list[tuple[float, float]]
    depth: dict[str, tuple[float, float, float]] | None
    ways: dict[str, Looked]


def main(scenes: int = SCENES, heaps: int = HEAPS, kept: str = "") -> str:
    """Photograph scenes and score both kinds of depth; returns the tables. kept: a file to go on from."""
    find, known = instance_finder(), read_kept(kept)
    results = {
        config: [known.get((config, seed)) or scene(config, seed, find, kept) for seed in range(FIRST, FIRST + int(n))]
        for config, n in (("any", scenes), ("clutter", heaps))
    }
    parts = [part for config, looked in results.items() if looked for part in tables(config, looked)]
    if REAL.is_dir():
        header = "real views | table known | table within 10 mm, of all | things known | within 15 mm, of all"
        header += " | pieces that stand on the table | the Kinect's"
        parts.append(table(header, [real(folder, find) for folder in sorted(REAL.iterdir()) if folder.is_dir()]))
    return "\n\n".join(parts)


def read_kept(kept: str) -> dict[tuple[str, int], Scene]:
    """The scenes that `scene` wrote to a file, by config and seed; none where there is no file."""
    found = {}
    for line in map(json.loads, Path(kept).read_text().splitlines() if kept and Path(kept).is_file() else []):
        key, ways = (line.pop("config"), line.pop("seed")), line.pop("ways")
        ways = {way: Looked(**one | {"scores": InstanceScores(**one["scores"])}) for way, one in ways.items()}
        found[key] = Scene(ways=ways, **line)
    return found


def scene(config: str, seed: int, find: Callable, kept: str = "") -> Scene:
    """Photograph and judge a scene, and add it to a file of those that were judged."""
    found = judged(photograph(seed, config), find)
    if kept:
        with Path(kept).open("a") as file:
            file.write(json.dumps({"config": config, "seed": seed, **asdict(found)}) + "\n")
    print(
        config,
        seed,
        *(f"{way}: {one.scores.over(0.5)}, {one.lift};" for way, one in found.ways.items()),
        file=sys.stderr,
    )
    return found


def judged(shots: Shots, find: Callable) -> Scene:
    """Look at a scene by photographs, and by exact depth."""
    views = [view_of_sheet(picture, shots.K, shots.distortion) for picture in shots.pictures]
    seen = [view for view in views if view is not None]
    poses = [pose_error(shots, i, view) for i, view in enumerate(views) if view is not None]
    ways, depth = {}, None
    if views[0] is None or len(seen) < LEAST_VIEWS:
        scores = score_instances(shots.frame.instances, np.zeros_like(shots.frame.instances))
        ways["photographs"] = Looked(scores, 0, "none", "no frame" if clicked(shots) else "")
    else:
        swept = sweep(seen).depth
        pose = shots.T_base_sheet @ views[0].T_base_cam
        depth = depth_errors(swept, shots.frame)
        ways["photographs"] = look(find, replace(shots.frame, rgb=views[0].rgb, depth=swept, T_base_cam=pose), shots)
    ways["exact"] = look(find, shots.frame, shots)
    return Scene(len(views), len(views) - len(seen), poses, depth, ways)


def tables(config: str, scenes: Sequence[Scene]) -> list[str]:
    """What is said of the scenes of one kind: a sentence, and two tables."""
    photographs, without = (sum(getattr(one, name) for one in scenes) for name in ("photographs", "without"))
    metres, degrees = np.median([pose for one in scenes for pose in one.poses], axis=0)
    name = {"any": "scenes", "clutter": "heaps"}[config]
    head = (
        f"{len(scenes)} {name}, {photographs} photographs; no sheet was found in {share(without, photographs)}. Poses "
        f"are off by {1e3 * metres:.2f} mm and {degrees:.3f} degrees in the median."
    )
    header = "things as one piece | of those that exact depth finds | found | false per scene | foreground IoU"
    return [
        head,
        table(
            f"{name}: depth of photographs | known | median error, mm | within 10 mm of what is known",
            depth_rows(scenes),
        ),
        table(
            f"{name}: depth | {header} | best grasp on a thing (off, none) | target lifted after a click",
            [row(way, scenes) for way in ("photographs", "exact")],
        ),
    ]


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
        name: tuple(map(float, (known[mask].mean(), np.median(off[known & mask]), (off[known & mask] < NEAR).mean())))
        for name, mask in where.items()
    }


def depth_rows(scenes: Sequence[Scene]) -> list[list]:
    """Means over scenes."""
    rows = []
    for name in ("things", "table"):
        numbers = np.array([one.depth[name] for one in scenes if one.depth])
        known, off, near = (around(numbers[:, i], np.mean) for i in range(3))
        rows.append(
            [name, percent(*known), "{:.1f} ({:.1f} to {:.1f})".format(*(1e3 * x for x in off)), percent(*near)]
        )
    return rows


def look(find: Callable, frame: RGBDFrame, shots: Shots) -> Looked:
    """Find things in a frame, plan grasps of them, and let the arm try what a click on a target gives."""
    true, pose, table_z = shots.frame.instances, frame.T_base_cam, frame.table_z
    bare = replace(frame, labels=None, instances=None)
    things = find(bare)
    found = things.instances
    false = sum((true[found == number] > 0).mean() <= 0.5 for number in np.unique(found[found > 0]))
    pipeline = Pipeline(find_objects=lambda _: things, workspace="table")
    seen = perceive(bare, pipeline, T_base_cam=pose, table_z=table_z).perception
    grasp = "none"
    if seen.plan.grasps:
        under = true.ravel()[seen.pixels[seen.plan.grasps[0].target]]
        grasp = "on" if np.mean(under > 0) > 0.5 else "off"
    at, lift = clicked(shots), ""
    if at is not None:
        asked = perceive(bare, pipeline, T_base_cam=pose, table_z=table_z, at=at).perception
        lift = lifted(shots, asked, shots.spec.objects[true[at[1], at[0]] - 1].name)
    return Looked(score_instances(true, found), int(false), grasp, lift)


def clicked(shots: Shots) -> tuple[int, int] | None:
    """The middle of the target that shows most of itself, if one can be clicked on."""
    true = shots.frame.instances
    targets = true[shots.frame.labels == TARGET]
    number = np.bincount(targets, minlength=1).argmax()
    return middle(true == number) if np.count_nonzero(targets == number) >= LEAST_CLICKED else None


def lifted(shots: Shots, perception, name: str) -> str:
    """Let the arm try in the scene that was photographed: "lifted" if the thing of that name is up, else why not."""
    result = lift_anew(replace(shots.spec, robot=True), perception)
    return "lifted" if result.success and result.name == name else f"{result.reason} {result.name or ''}".strip()


def row(way: str, scenes: Sequence[Scene]) -> list:
    """One way's row of the table of things."""
    looked, exact = [one.ways[way] for one in scenes], [one.ways["exact"] for one in scenes]
    s = pool([one.scores for one in looked])
    both = [
        a > 0.5
        for one, of in zip(looked, exact, strict=True)
        for a, b in zip(one.scores.iou, of.scores.iou, strict=True)
        if b > 0.5
    ]
    grasps = [one.grasp for one in looked]
    tried = [one.lift for one in looked if one.lift]
    false = around([one.false for one in looked], np.mean)
    foreground = around(
        [one.scores.foreground for one in looked], lambda counts: counts[:, 0].sum() / counts[:, 1].sum()
    )
    return [
        way,
        share(s.over_half, s.true),
        "" if way == "exact" else share(sum(both), len(both)),
        s.found,
        "{:.1f} ({:.1f} to {:.1f})".format(*false),
        "{:.2f} ({:.2f} to {:.2f})".format(*foreground),
        f"{share(grasps.count('on'), len(grasps))} ({grasps.count('off')}, {grasps.count('none')})",
        share(tried.count("lifted"), len(tried)) if tried else "",
    ]


def share(count: int, of: int) -> str:
    """A share with its 95 % interval, as "54 of 92 (59%; 48% to 68%)"."""
    low, high = wilson_interval(count, of)
    return f"{count} of {of} ({count / of:.0%}; {low:.0%} to {high:.0%})"


def around(numbers, statistic: Callable) -> tuple[float, float, float]:
    """A statistic of scenes' numbers and its 95 % interval."""
    numbers = np.array(numbers)
    return (float(statistic(numbers)), *resampled(numbers, statistic))


def percent(value: float, low: float, high: float) -> str:
    """As "64% (60% to 68%)"."""
    return f"{value:.0%} ({low:.0%} to {high:.0%})"


def real(folder: Path, find: Callable) -> list:
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
    stand = [standing(find, views[0].frame(d)) for d in (swept, depth)]
    return [folder.name, *(f"{share:.0%}" for share in shares), *stand]


def standing(find: Callable, frame: RGBDFrame) -> int:
    """How many pieces `labkit perceive --anything` takes for targets."""
    pipeline = Pipeline(find_objects=find, workspace="table")
    return len(perceive(frame, pipeline, T_base_cam=frame.T_base_cam).perception.clouds)


if __name__ == "__main__":
    print(main(*sys.argv[1:]))
