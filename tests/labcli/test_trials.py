"""Tables of trials: made scene by scene, stopped anywhere, read as they were written."""

import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import pytest

from labcli import cli, mask_study, score_study, stack_study
from labcli.trials import in_order, make_table, read_rows, write_rows


@dataclass(frozen=True)
class Row:
    seed: int
    share: float
    reason: str


def two_trials(seed):
    return [Row(seed, 1 / seed, "lifted"), Row(seed, 0.5, 'slipped, "alas"')]


def test_a_stopped_table_goes_on_where_it_was(tmp_path):
    calls, out = [], tmp_path / "new" / "table.csv"

    def make(stop_at=None):
        def trials_of_scene(seed):
            if seed == stop_at:
                raise KeyboardInterrupt
            calls.append(seed)
            return two_trials(seed)

        return make_table(out, Row, trials_of_scene, range(10, 15), progress=False)

    with pytest.raises(KeyboardInterrupt):
        make(stop_at=13)
    assert not out.exists() and calls == [10, 11, 12]
    rows = make()
    assert calls == [10, 11, 12, 13, 14] and [path.name for path in out.parent.iterdir()] == ["table.csv"]
    assert rows == read_rows(out, Row) == [row for seed in range(10, 15) for row in two_trials(seed)]


def test_what_is_left_of_other_scenes_or_other_tables_is_not_mixed_in(tmp_path):
    out, unfinished = tmp_path / "table.csv", tmp_path / "table.csv.unfinished"
    write_rows(unfinished, two_trials(3))
    with pytest.raises(ValueError, match=r"out: .*of other scenes"):
        make_table(out, Row, two_trials, range(10, 12), progress=False)
    unfinished.write_text("seed,kind\n")
    with pytest.raises(ValueError, match="path: expected a CSV file with columns seed, share, reason"):
        make_table(out, Row, two_trials, range(10, 12), progress=False)


def test_several_processes_give_results_in_order():
    assert list(in_order(abs, [-3, 2, -1], workers=2)) == [3, 2, 1]


@pytest.mark.parametrize(
    ("study", "command"),
    [(stack_study, cli.compare), (mask_study, cli.study), (score_study, partial(cli.study, scores=True))],
)
def test_no_command_overwrites_a_committed_table_unasked(study, command, monkeypatch):
    asked = []
    monkeypatch.setattr(study, "run", lambda out, *_, **__: asked.append(out) or sys.exit())
    with pytest.raises(SystemExit):
        command()
    (out,) = asked
    assert out.parts[0] == "out" and (Path(__file__).parents[2] / "labcourse" / "tables" / out.name).is_file()
