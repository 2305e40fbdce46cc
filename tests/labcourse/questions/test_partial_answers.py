"""Answers that are right on a part of what their statements allow lose: on public cases, and on secret ones alone.

tests/data/partial.json has some that a check ticked once, each with its question and what its author took for granted.
"""

import json

import pytest
from notebooks import ROOT

from labgrader.course import find
from labgrader.program.live import LiveProgram
from labgrader.question import PUBLIC_SEED
from labgrader.reply.judge import judge

pytestmark = pytest.mark.bad_input  # as outside the suite
PARTIAL = json.loads((ROOT / "tests/data/partial.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("partial", PARTIAL, ids=lambda answer: answer["thought"])
@pytest.mark.parametrize("seed", [PUBLIC_SEED, 20_260_103])
def test_what_is_right_on_a_part_loses(partial, seed):
    question = find(partial["question"])
    pieces = ("setup", "import numpy as np"), (question.function, partial["source"])
    assert not judge(question, LiveProgram(question.function, pieces).answer, seed).passed
