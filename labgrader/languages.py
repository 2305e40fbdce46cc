"""Hints and statements of checks in another language: a file beside the question, `iou.de.toml` beside `iou.py`.

    [hints]
    dice = "Das ist Dice (F1), ein anderes Maß: ..."

    [statements]
    at_most_one = "der Wert ist höchstens 1"

Each line is named like the function of the wrong answer, or of the property, that it belongs to. What the file does not
say stays English, and so does a question without one. The language is that of `LABGRADER_LANGUAGE` in the environment,
else `language` in [tool.labgrader]; for English no file is looked for.
"""

import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from labgrader.question import Question

CHOSEN = "LABGRADER_LANGUAGE"
ENGLISH = "en"


class HintsUnreadable(ValueError):
    """Raised for a file of hints that is no TOML, or has a line that belongs to nothing."""


def translated(question: Question, module: Path, language: str) -> Question:
    """A question with the hints and statements of its file in a language, where there are any.

    Raises HintsUnreadable, which names the file, if a line belongs to no wrong answer and no property of the question.
    """
    path = module.with_suffix(f".{language}.toml")
    if language == ENGLISH or not path.is_file():
        return question
    try:
        said = tomllib.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise HintsUnreadable(f"{path}: {error}") from error
    hints, statements = said.pop("hints", {}), said.pop("statements", {})
    wrong = {in_source(one.answer) for one in question.misconceptions}
    properties = {one.holds.__name__ for one in question.properties}
    for table, lines, names in (("hints", hints, wrong), ("statements", statements, properties)):
        if unknown := lines.keys() - names:
            expected = f"expected functions of {module.name} ({', '.join(sorted(names)) or 'there are none'})"
            raise HintsUnreadable(f"{path}: {table}: {expected}, got {min(unknown)}")
    if said:
        raise HintsUnreadable(f"{path}: expected the tables hints and statements, got {min(said)}")
    return replace(
        question,
        misconceptions=[
            replace(one, hint=hints.get(in_source(one.answer), one.hint)) for one in question.misconceptions
        ],
        properties=[replace(one, says=statements.get(one.holds.__name__, one.says)) for one in question.properties],
    )


def in_source(answer: Callable) -> str:
    """The name by which a question's module defines a wrong answer, whichever of its variants this is."""
    return getattr(answer, "of", answer).__name__
