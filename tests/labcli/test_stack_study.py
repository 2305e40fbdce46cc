"""The stacks side by side: what a trial counts, what the committed table says, and that it is the one command's."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import data_gen
from labcli import stack_study
from labcli.stack_study import STUDY, Row, read, summarise, table
from labcli.trials import Study
from labkit.labels import SURFACE, TARGET
from labkit.metrics import confusion_matrix, iou

COMMITTED = Path(__file__).parents[2] / "labcourse" / "tables" / "09_other_stacks.csv"
ROW = Row(600_000, "a", 10, 40, 90, 100, 5.0, 1, "lifted")


@pytest.fixture(scope="module")
def trials():
    """One scene by the true labels, twice, and by labels without a target."""
    seed = 600_003
    ways = {
        "true": lambda frame: frame.labels,
        "again": lambda frame: frame.labels.copy(),
        "blind": lambda frame: np.where(frame.labels == TARGET, SURFACE, frame.labels),
    }
    return data_gen.render(data_gen.sample_scene(seed, "test")), STUDY.of_scene(seed, ways=ways)


def test_a_trial_counts_pixels_and_lifts(trials):
    frame, (true, again, blind) = trials
    assert true.target_both == true.target_either == np.count_nonzero(frame.labels == TARGET)
    assert (true.lifted, true.reason) == (1, "lifted") == (again.lifted, again.reason)
    assert (blind.target_both, blind.lifted) == (0, 0) and "target" in blind.reason
    expected = iou(confusion_matrix(frame.labels, np.where(frame.labels == TARGET, SURFACE, frame.labels), 4))
    assert np.isclose(blind.surface_both / blind.surface_either, expected[SURFACE])
    assert all(row.milliseconds >= 0.0 for row in (true, again, blind))


def test_summaries_pool_counts_before_they_divide():
    rows = [ROW, replace(ROW, target_both=0, target_either=60, lifted=0), replace(ROW, method="b", milliseconds=7.0)]
    first, second = summarise(rows)
    assert (first.target_iou, first.lifts, first.trials) == (0.1, 1, 2), "10 of 100, not the mean of 1/4 and 0"
    assert second.milliseconds == 7.0 and second.interval[0] < 1.0
    assert [line.split("  ")[0] for line in table(rows).splitlines()[1:]] == ["a", "b"]


def test_a_run_tries_every_method_in_every_scene(tmp_path, monkeypatch):
    monkeypatch.setattr(stack_study, "methods", lambda frames, unet: {"one": None, "two": None})
    monkeypatch.setattr(stack_study, "TRAINING_SEEDS", range(0))
    monkeypatch.setattr(Study, "of_scene", lambda self, seed, ways: [replace(ROW, seed=seed, method=w) for w in ways])
    rows = stack_study.run(tmp_path / "t.csv", 2, progress=False)
    assert [(row.seed, row.method) for row in rows] == [(s, w) for s in (600_000, 600_001) for w in ("one", "two")]


def test_the_committed_table_is_whole_and_says_what_the_lesson_says():
    rows = read(COMMITTED)
    names = list(dict.fromkeys(row.method for row in rows))
    assert {(row.seed, row.method) for row in rows} == {(seed, name) for seed in STUDY.seeds for name in names}
    found = {s.method: s for s in summarise(rows)}
    networks = [s for name, s in found.items() if name.startswith("U-Net")]
    others = [s for name, s in found.items() if not name.startswith("U-Net")]
    assert max(s.target_iou for s in networks) - min(s.target_iou for s in networks) < 0.001, "one network, one answer"
    assert min(s.target_iou for s in networks) > 2 * max(s.target_iou for s in others)
    assert min(s.interval[0] for s in networks) > max(s.interval[1] for s in others)
    assert found["HSV, this table"].surface_iou > 0.9 > 0.7 > found["HSV, other tables"].surface_iou


@pytest.mark.nightly
def test_a_row_of_the_committed_table_comes_out_again():
    row = next(row for row in read(COMMITTED) if row.method == "HSV, this table")

    def this_table(frame):
        return stack_study.threshold_labels(frame.rgb, stack_study.fit_hsv([frame.rgb], [frame.labels == SURFACE]))

    (again,) = STUDY.of_scene(row.seed, ways={row.method: this_table})
    assert replace(again, milliseconds=row.milliseconds) == row
