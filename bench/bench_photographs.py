"""Photographs: how well are things told apart, and found at all, in nine frames of three real cameras?

No frame was trained on. Five tabletop frames of YCB objects (from the demo images of PoseCNN) have outlines of their 21
things by hand: `bench/outlines.py`, drawn before any network that finds things had seen the frames. Two overhead frames
(PrimeSense) and two of bins (PhoXi), from the examples of gqcnn, have a picture of what is thing and what is not. The
frames stand in `../shared/real`; where they do not, the benchmark is skipped. Pose and workspace are unknown: each way
gets the picture, and the table that its depth shows. As one piece: a true thing has an IoU over 0.5 (or 0.75) with
something found. Overlap and boundary: precision, recall and F, means over pictures (`labkit.instance_metrics`).
Foreground: all things together. On the board: only where no arm of the robot is in view. A best grasp is on a thing if
most pixels of its target are. Geometry and colour alone (a plane cut away, clusters cut where colours step; what the
kit had before) find 15 of the 21 on the table that is found today, with foreground IoUs of 0.77, 0.31, 0.80 on the
board and 0.00. As `labkit perceive --anything` ran them, on the table that it found itself, they found 10, with 0.54,
0.31, 0.80 and 0.00; the best grasp was on a thing in two frames, on none in five, and two had no grasp.
"""

import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np

from bench.measure import table
from bench.outlines import BOARD, OUTLINES, filled, instances
from labcli.evaluate_folder import Judged, TrueThings, judge, things_by_class
from labcli.perceive import perceive
from labkit.instance_metrics import pool, score_instances
from labkit.labels import IGNORE
from labkit.learning.network import load_model, weights_path
from labkit.learning.things import instance_finder
from labkit.pipeline import Pipeline

PHOTOGRAPHS = Path(__file__).resolve().parents[2] / "shared" / "real"


def main(photographs: Path = PHOTOGRAPHS, weights: str = "unet_rgbd") -> str:
    """Score each way on a folder's frames; returns the tables. weights: of a network that tells things apart."""
    network = load_model(weights_path(weights))
    apart = instance_finder(network)
    ways = {  # the finder of things, and what plans grasps of its targets
        "`unet_rgbd`, target or obstacle": (things_by_class(network), Pipeline(network, workspace="table")),
        "`unet_rgbd`, its things": (apart, Pipeline(find_objects=apart, workspace="table")),
    }
    with TemporaryDirectory() as scratch:
        sets = {"tabletop": with_outlines(photographs / "tabletop", Path(scratch))}
        sets |= {name: TrueThings(photographs / name) for name in ("overhead", "bin")}
        divided, whole, grasps = zip(*(rows(way, *finder, sets) for way, finder in ways.items()), strict=True)
    things = sum(len(frame["things"]) for frame in OUTLINES.values())
    header = "as one piece (by frame) | IoU over 0.75 | found | overlap P, R, F | boundary P, R, F"
    places = "best grasp on a thing, off all things, no grasp"
    return "\n\n".join(
        [
            table(f"five tables, {things} things | {header}", divided),
            table("foreground IoU | tabletop | overhead | overhead, on the board | bin", whole),
            table(f"frames: {places} | tabletop | overhead | bin", grasps),
        ]
    )


def with_outlines(folder: Path, scratch: Path) -> TrueThings:
    """The tabletop frames with their outlines as masks, in a folder that is thrown away."""
    for part in ("color", "depth", "camera.json"):
        (scratch / part).symlink_to(folder / part)
    (scratch / "mask").mkdir()
    for name in OUTLINES:
        cv2.imwrite(str(scratch / "mask" / f"{Path(name).name}.png"), instances(name))
    return TrueThings(scratch)


def rows(way: str, find: Callable, pipeline: Pipeline, sets: dict[str, TrueThings]) -> tuple[list, list, list]:
    """One way's rows of the three tables."""
    judged = {name: judge(things, find) for name, things in sets.items()}
    pooled = {name: pool([one.scores for one in pictures]) for name, pictures in judged.items()}
    t = pooled["tabletop"]
    overlap, boundary = (", ".join(f"{x:.2f}" for x in three) for three in (t.overlap, t.boundary))
    board = pool([on_the_board(one) for one in judged["overhead"]]).foreground_iou
    foreground = [pooled[name].foreground_iou for name in sets]
    foreground = [*foreground[:2], board, *foreground[2:]]
    by_frame = ", ".join(str(one.scores.over(0.5)) for one in judged["tabletop"])
    apart = [
        way,
        f"{t.over_half} of {t.true} ({by_frame})",
        f"{t.over_three_quarters} of {t.true}",
        t.found,
        overlap,
        boundary,
    ]
    grasps = [best_grasps(sets[name], judged[name], pipeline) for name in sets]
    return apart, [way, *(f"{x:.2f}" for x in foreground)], [way, *grasps]


def on_the_board(one: Judged):
    """The scores of an overhead frame where no arm hides the board."""
    board = filled(BOARD[f"overhead/{one.name}"], one.true.shape[::-1])
    return score_instances(np.where(board, one.true, IGNORE), (one.found > 0).astype(int), IGNORE)


def best_grasps(things: TrueThings, judged: list[Judged], pipeline: Pipeline) -> str:
    """In how many frames the best grasp is on a true thing, on none, and in how many there is no grasp."""
    places = Counter()
    for frame, one in zip(things, judged, strict=True):
        seen = perceive(replace(frame, instances=None), pipeline).perception
        if not seen.plan.grasps:
            places["none"] += 1
            continue
        under = one.true.ravel()[seen.pixels[seen.plan.grasps[0].target]]
        places["on" if np.mean((under > 0) & (under != one.ignore)) > 0.5 else "off"] += 1
    return ", ".join(str(places[place]) for place in ("on", "off", "none"))


if __name__ == "__main__":
    print(main(*map(Path, sys.argv[1:])))
