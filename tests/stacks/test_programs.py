"""`make stacks`: what it says of stacks that are missing or disagree; the comparison itself is not run here."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture
def runner(monkeypatch):
    """The script, imported by its path, with small frames."""
    monkeypatch.syspath_prepend(str(ROOT))
    from tests.stacks import run

    return run


def stacks(runner, *, found=(), installed=True):
    """The script's stacks, all alike: none has anything to build."""

    def compare(folder, frame, network):
        assert network.is_file() and (folder / "calibration.txt").is_file() and frame.labels is not None
        return list(found)

    return tuple(
        replace(stack, needs=lambda: installed, build=lambda folder: None, compare=compare)
        for stack in runner.STACKS
        if stack.name != "Octave"
    )


def test_what_is_missing_is_named_with_its_packages(runner, monkeypatch, capsys):
    monkeypatch.setattr(runner, "STACKS", stacks(runner, installed=False))
    assert runner.main(["--frames", "0"]) == 0
    said = capsys.readouterr().out
    assert "C++" in said and "libopencv-dnn-dev" in said and "default-jdk-headless" in said


@pytest.mark.parametrize("good, status", [(True, 0), (False, 1)])
def test_a_stack_that_disagrees_is_status_1(runner, monkeypatch, capsys, good, status):
    finding = runner.Finding("C++", "mask", "99 %", good)
    monkeypatch.setattr(runner, "STACKS", stacks(runner, found=[finding]))
    assert runner.main(["--frames", "1"]) == status
    assert capsys.readouterr().out.count("ok" if good else "DISAGREES") == 2


def test_comparisons_fail_for_what_differs_and_for_another_shape(runner):
    a = np.arange(10_000).reshape(100, 100)
    b = a.copy()
    b[0, :2] += 1
    assert runner.equal("s", "w", a, a.copy()).good and not runner.equal("s", "w", a, b).good
    assert not runner.equal("s", "w", a, a[:50]).good
    assert runner.close("s", "w", a, a + 1e-6, 1e-5, " m").good and not runner.close("s", "w", a, b, 1e-5, " m").good
    assert not runner.close("s", "w", a, a[1:], 1e-5, " m").good
