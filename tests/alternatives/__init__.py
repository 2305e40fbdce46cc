"""Right answers to the questions, written in other ways: loops, einsum, torch, float32, another formula.

In `t04_iou`, those of topic 04_iou, `iou__loops` answers the question `iou`. Checks and grades must accept each.
Those of one question differ in what a check can see: class, dtype, rounding, or what the task leaves free.
"""

import importlib
from collections.abc import Callable

from labkit.course.checker.question import Question


def alternatives(question: Question) -> tuple[Callable, ...]:
    """The right answers to a question beside its reference."""
    module = importlib.import_module(f"alternatives.t{question.topic}")
    return tuple(found for name, found in vars(module).items() if name.startswith(f"{question.function}__"))
