"""What labcli's modules refuse, in one table; `test_cli` and `test_node` have what the command line refuses."""

import numpy as np
import pytest

from data_gen import sample_scene
from labcli import degrade, mask_study
from labcli.evaluation import run_trial, summarise

MASK = np.zeros((4, 5), bool)
BYTES = MASK.astype(np.uint8)
REFUSED = [  # call, the argument that the error names, what was expected and what came
    (lambda: degrade.erode(BYTES, 1), "mask", "expected bool, got dtype uint8"),
    (lambda: degrade.shift(BYTES, 1, 1), "mask", "expected bool, got dtype uint8"),
    (lambda: degrade.cut(BYTES, 0.5, 0.0), "mask", "expected bool, got dtype uint8"),
    (lambda: degrade.dilate(MASK[0], 1), "mask", "expected shape"),
    (lambda: degrade.erode(MASK, -1), "pixels", "expected 0 or more, got -1"),
    (lambda: degrade.cut(MASK, 20, 0.0), "share", "expected a share in .*, got 20"),
    (lambda: degrade.holes(~MASK, -0.1, np.random.default_rng(0)), "share", "expected a share in .*, got -0.1"),
    (lambda: mask_study.spoil(MASK, "melted", 1, 0), "kind", "expected one of true, eroded"),
    (lambda: summarise([]), "trials", "expected at least one"),
    (lambda: run_trial(sample_scene(0), crf=True), "crf", "expected none with true masks"),
]


@pytest.mark.bad_input
@pytest.mark.parametrize(("call", "name", "says"), REFUSED)
def test_what_does_not_fit_is_named(call, name, says):
    with pytest.raises(ValueError, match=f"^{name}: {says}"):
        call()
