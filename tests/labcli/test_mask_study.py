"""The study of masks: its committed table comes out again, and it can be stopped anywhere."""

from collections import defaultdict
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from scenes import box, scene
from scipy.stats import binom, binomtest
from typer.testing import CliRunner

import data_gen
from labcli import mask_study
from labcli.cli import app
from labcli.mask_study import ALL, STUDY, Row
from labcli.trials import SIZE, Study
from labkit.labels import OBSTACLE, TARGET
from labkit.sim.world import World

TABLE = Path(__file__).parents[2] / "labcourse" / "tables" / "07_grasp.csv"


@pytest.fixture(scope="module")
def table():
    return mask_study.read(TABLE)


def test_the_table_holds_every_way_of_spoiling_in_every_scene(table):
    assert len(table) >= 1000
    assert [(row.seed, row.kind, row.strength) for row in table] == [(s, *way) for s in STUDY.seeds for way in ALL]
    assert all((row.lifted == 1) == (row.reason == "lifted") for row in table)


def test_more_spoilt_masks_have_less_iou_and_iou_is_worth_something(table):
    scores = defaultdict(list)
    for row in table:
        scores[row.seed, row.kind].append(row.iou)
    assert all((np.diff(iou) <= 0.0).all() for iou in scores.values())
    assert all(iou == [1.0] for (_, kind), iou in scores.items() if kind == "true")
    worse, better = (mask_study.lift_rate(rows) for rows in mask_study.by_iou(table, [0.0, 0.4, 1.0]))
    assert worse[2] < better[1]  # the intervals lie apart


def test_of_25_pairs_of_kinds_with_nearly_equal_iou_one_has_a_small_p_value(table):
    """Lesson 07, worth: McNemar's test of all such pairs; four times in ten chance gives one p below 0.05, or more."""
    iou, lifted = defaultdict(list), defaultdict(list)
    for row in table:
        iou[row.kind, row.strength].append(row.iou)
        lifted[row.kind, row.strength].append(row.lifted)
    pairs = [(a, b) for a, b in combinations(iou, 2) if a[0] != b[0] and abs(np.mean(iou[a]) - np.mean(iou[b])) < 0.05]
    gains = [np.subtract(lifted[a], lifted[b]) for a, b in pairs]
    p = [binomtest(int((gain > 0).sum()), max(1, int(abs(gain).sum()))).pvalue for gain in gains]
    assert len(pairs) == 25 and [set(pairs[k]) for k in np.flatnonzero(np.array(p) < 0.05)] == [
        {("holed", 0.2), ("part missing", 0.2)}
    ]
    assert min(p) == pytest.approx(0.0156, abs=1e-4)
    none = 1.0  # the chance of no such p, with as many scenes in which the two differ
    for n in (int(abs(gain).sum()) for gain in gains if gain.any()):
        none *= sum(binom.pmf(k, n, 0.5) for k in range(n + 1) if binomtest(k, n).pvalue >= 0.05)
    assert 0.35 < 1.0 - none < 0.45

    eroded = np.array(iou["eroded", 5.0])
    assert eroded.min() == 0.0 and 0.68 < eroded.max() < 0.70
    failed = eroded[np.array(lifted["eroded", 5.0]) == 0]
    assert (np.sum(failed < 0.3), failed.size) == (30, 38)


@pytest.mark.nightly
def test_a_few_lifts_made_again_give_the_tables_rows(table):
    ways = [("true", 0.0), ("part missing", 0.2)]
    again = STUDY.of_scene(600_001, kinds=ways)
    assert again == [row for row in table if row.seed == 600_001 and (row.kind, row.strength) in ways]
    assert [row.lifted for row in again] == [1, 0]


@pytest.mark.parametrize("seed", [600_007, 600_031])
def test_the_masks_of_a_scene_made_again_have_the_tables_iou(table, seed):
    spec = data_gen.sample_scene(seed, "test")
    _, truth = mask_study.target_mask(spec, data_gen.render(spec, SIZE))
    for row in table:
        if row.seed == seed:
            mask = mask_study.spoil(truth, row.kind, row.strength, seed)
            assert round(mask_study.mask_iou(mask, truth), 4) == row.iou


def test_only_the_masks_target_is_a_target_and_only_that_one_counts():
    spec = scene(box("small", 0.5, -0.1, (0.03, 0.03, 0.03)), box("large", 0.5, 0.1, (0.045, 0.045, 0.045)))
    with World(spec) as world:
        frame = world.render((160, 120))
    name, truth = mask_study.target_mask(spec, frame)
    assert name == "large" and truth.sum() == (frame.instances == 2).sum()
    perception = mask_study.see(frame, truth)
    assert len(perception.clouds) == 1
    assert (perception.labels[frame.instances == 1] == OBSTACLE).all()
    assert (perception.labels[truth] == TARGET).all()
    assert mask_study.try_lift(spec, perception, "large") == (True, "lifted")
    assert mask_study.try_lift(spec, perception, "small") == (False, "lifted another target")
    nothing = mask_study.see(frame, np.zeros_like(truth))
    assert mask_study.try_lift(spec, nothing, "large") == (False, "no target points")


def test_the_command_runs_it_and_says_what_came_out(tmp_path, monkeypatch):
    def trials(self, seed):
        return [Row(seed, "true", 0.0, 1.0, seed % 2, "lifted" if seed % 2 else "slipped")]

    monkeypatch.setattr(Study, "of_scene", trials)
    out = tmp_path / "study.csv"
    done = CliRunner().invoke(app, ["study", "--out", str(out)])
    assert done.exit_code == 0 and len(mask_study.read(out)) == 60
    assert f"{out}: 60 lifts, 50.0% succeeded (95 % interval 37.7% to 62.3%)" in done.output
