"""The sections of docs/library.md run as they stand, in a folder with files of one's own."""

import re
from pathlib import Path

import cv2
import numpy as np
import pytest

from data_gen import render, sample_scene

PAGE = (Path(__file__).parent.parent / "docs/library.md").read_text()
BLOCKS = dict(re.findall(r"^## ([^\n]*)\n(?:(?!^## ).)*?^```python\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL))


@pytest.fixture(scope="module")
def own_files(tmp_path_factory):
    """What a reader of the page has: a picture with depth and calibration, and four labelled pictures."""
    folder = tmp_path_factory.mktemp("own")
    frame = render(sample_scene(8, "test"), (320, 240))
    cv2.imwrite(str(folder / "color.png"), frame.rgb[..., ::-1])
    cv2.imwrite(str(folder / "depth.png"), np.round(1000.0 * frame.depth).astype(np.uint16))
    np.savetxt(folder / "intrinsics.txt", [frame.K[0, 0], frame.K[1, 1], frame.K[0, 2], frame.K[1, 2]])
    np.savetxt(folder / "T_base_cam.txt", frame.T_base_cam)
    for kind in ("images", "labels"):
        (folder / kind).mkdir()
    for i in range(4):
        frame = render(sample_scene(i, "test"), (160, 120))
        cv2.imwrite(str(folder / f"images/{i}.png"), frame.rgb[..., ::-1])
        cv2.imwrite(str(folder / f"labels/{i}.png"), frame.labels)
    return folder


NIGHTLY = pytest.mark.nightly  # they train, as test_training does


@pytest.mark.parametrize(
    ("section", "prints"),
    [
        ("A scene of your own", r"Perception\(320 x 240, .*, 10 grasps\)\nLiftResult\(success=True, reason='lifted'"),
        (
            "A frame of your own",
            r"Plane\(.* mm\) at .*\nPerception\(.* grasps\)\nGraspPlan\(\d+ grasps, the best G",
        ),
        ("A model of your own", r"\(240, 320, 2\) \[0 1\]\nPerception\(.*\n\(240, 320, 7\) .*\nPerception\("),
        ("An exported network in a program of your own", r"equal labels: (100.00|99.99)%"),
        (
            "Objects of your own",
            r"Perception\(.* grasps\)\n(\d+) objects in truth, \d+ found\n(Perception\(.* grasps\)\n){2}",
        ),
        (
            "Masks of a foundation model",
            r"Perception\(.*, clouds of \d+, \d+.* grasps\)\nPerception\(.*clouds of \d+ points, ",
        ),
        ("A gripper of your own", r"GraspPlan\(no grasp: too wide .*\nGraspPlan\(10 grasps, the best Grasp\("),
        pytest.param(
            "A loss of your own", r"\{'epoch': 2, 'steps': 4, 'loss': 0\.\d+, 'mean_iou': 0\.\d+, .*\}", marks=NIGHTLY
        ),
        pytest.param("Data of your own", r"\{.*'loss': .*\}\n\[.*\]\nPerception\(", marks=NIGHTLY),
    ],
)
def test_each_block_runs_and_prints_what_it_says(section, prints, own_files, monkeypatch, capsys):
    monkeypatch.chdir(own_files)
    exec(compile(BLOCKS[section], section, "exec"), {"__name__": "__main__"})
    assert re.search(prints, capsys.readouterr().out)
