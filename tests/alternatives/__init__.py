"""Right answers to the questions, written in other ways: loops, einsum, torch, float32, another formula.

`t04_iou.ALTERNATIVES` holds those of topic 04_iou, by the question's function. Checks and grades must accept each.
"""

import importlib
from collections.abc import Callable

from labkit.course.questions.question import Question


def alternatives(question: Question) -> tuple[Callable, ...]:
    """The right answers to a question beside its reference."""
    return importlib.import_module(f"alternatives.t{question.topic}").ALTERNATIVES[question.function]
