"""The study of the planner's score: its committed table comes out again, and holds the ranks that it promises."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scenes import box, scene
from typer.testing import CliRunner

import data_gen
from labcli import score_study
from labcli.cli import app
from labcli.score_study import Row
from labcli.trials import Study

TABLE = Path(__file__).parents[2] / "labcourse" / "tables" / "07_scores.csv"


def test_the_table_holds_ranked_grasps_of_every_scene():
    rows = score_study.read(TABLE)
    assert list(dict.fromkeys(row.seed for row in rows)) == list(score_study.STUDY.seeds)
    for seed in {row.seed for row in rows}:
        ranks, scores = zip(*((row.rank, row.score) for row in rows if row.seed == seed), strict=True)
        assert ranks in (score_study.RANKS[: len(ranks)], (0,))
        assert (np.diff(scores) <= 0.0).all()
    assert all((row.lifted == 1) == (row.reason == "lifted") for row in rows)


@pytest.mark.nightly
def test_a_scene_tried_again_gives_the_tables_rows():
    again = score_study.STUDY.of_scene(600_210)
    assert again == [row for row in score_study.read(TABLE) if row.seed == 600_210]
    assert {row.lifted for row in again} == {0, 1}


def test_a_target_without_a_grasp_has_one_row_that_says_why(monkeypatch):
    wide = replace(scene(box("wide", 0.5, 0.0, (0.2, 0.2, 0.03))), seed=3)
    monkeypatch.setattr(data_gen, "sample_scene", lambda seed, config: wide)
    (row,) = score_study.STUDY.of_scene(3)
    assert row == Row(3, 0, 0.0, 0, "too wide for the gripper in every direction")


def test_the_command_runs_it(tmp_path, monkeypatch):
    monkeypatch.setattr(Study, "of_scene", lambda self, seed: [Row(seed, 1, 0.8, 1, "lifted")])
    out = tmp_path / "scores.csv"
    done = CliRunner().invoke(app, ["study", "--scores", "--out", str(out)])
    assert done.exit_code == 0 and len(score_study.read(out)) == 34
    assert "34 lifts, 100.0% succeeded" in done.output
