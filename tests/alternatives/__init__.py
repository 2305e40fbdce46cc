"""Right answers to the questions, written in other ways: loops, einsum, torch, float32, another formula.

tests/data/right.json has those of readers of the labs, as text. The modules have what is not among them: tensors, and
what a task leaves free. In `t04_iou`, those of topic 04_iou, `iou__loops` answers the question `iou`. Checks and grades
must accept each; those of one question differ in what a check can see.
"""

import importlib
import importlib.util
import json
from collections.abc import Callable
from functools import cache
from pathlib import Path

from labgrader.program.live import LiveProgram
from labgrader.question import Question

RIGHT = json.loads((Path(__file__).parents[1] / "data/right.json").read_text())


def alternatives(question: Question) -> tuple[Callable, ...]:
    """The right answers to a question beside its reference; those that are a text have it as their `source`."""
    module = f"{__name__}.t{question.topic}"
    made = vars(importlib.import_module(module)) if importlib.util.find_spec(module) else {}
    functions = [found for name, found in made.items() if name.startswith(f"{question.function}__")]
    texts = [answer["source"] for answer in RIGHT if answer["question"] == question.name]
    return (*functions, *(written(question.function, text) for text in texts))


@cache
def written(name: str, text: str) -> Callable:
    """The function that a text defines, after NumPy was imported."""
    answer = LiveProgram(name, (("quiet", "import numpy as np"), (name, text))).answer
    answer.source = text
    return answer
