"""What README and the model card say of masks and lifts is what `labkit evaluate --json` wrote into docs/results/."""

import json
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
MASKS = {"UNetRGBD": "", "true masks": "_truth"}
KINDS = {"test": "test", "hard": "hard", "test, perturbed": "test_perturbed", "hard, perturbed": "hard_perturbed"}
KINDS["other"] = "other"


def rows(page: str) -> list[tuple[str, str, list[float]]]:
    """The rows of a page's table of scores: kind of scenes, masks, and the numbers."""
    found = re.findall(r"^\| (\w[^|]*) \| (UNetRGBD|true masks) \| (\d.*) \|$", (ROOT / page).read_text(), re.MULTILINE)
    return [(kind, masks, [float(x) for x in re.findall(r"[\d.]+", numbers)]) for kind, masks, numbers in found]


@pytest.mark.parametrize(("page", "at_least"), [("README.md", 4), ("labkit/weights/MODEL_CARD.md", 10)])
def test_scores_are_those_that_were_measured(page, at_least):
    found = rows(page)
    assert len(found) >= at_least
    for kind, masks, said in found:
        report = json.loads((ROOT / "docs" / "results" / f"{KINDS[kind]}{MASKS[masks]}.json").read_text())
        masks_scores = [report["mean_iou"], report["iou"]["target"], report["boundary_iou"], report["pixel_accuracy"]]
        lifts = [report["lift_rate"], *report["lift_interval"]]
        assert said[:3] == [round(x, 3) for x in masks_scores[:3]] and said[3] == round(masks_scores[3], 4)
        assert said[4:] == pytest.approx([100 * x for x in lifts], abs=0.051), (page, kind, masks)


def test_the_lesson_shows_the_same_certainty():
    shown = json.loads((ROOT / "lessons" / "07_certainty.json").read_text())
    for kind, report in shown.items():
        measured = json.loads((ROOT / "docs" / "results" / f"{kind}.json").read_text())
        assert report["declining"] == [pytest.approx(row, abs=1e-4) for row in measured["declining"]]
        assert report["calibration"] == [pytest.approx(row, abs=1e-4) for row in measured["calibration"]]
