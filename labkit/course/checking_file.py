"""`labkit check LAB.ipynb`: a saved lab checked as the grader will check it, but on the public cases.

The answers are cut out of the file (`labkit.course.checker.program`), each runs in a fresh process that has the
packages of the grader and nothing of the kit, and other answers that one calls are the kit's where they are wrong. No
sandbox is needed, since it is one's own notebook. What is ticked here is right with the grader.
"""

import json
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from labkit.course.checker.comparison import Problem
from labkit.course.checker.judge import Verdict
from labkit.course.checker.program import Cell, Parsed, cells_of, program
from labkit.course.checker.question import PACKAGES, Question
from labkit.course.checker.run import Printed
from labkit.course.checking import describe, jupyter, looked_at
from labkit.course.grading.isolated import Run, public_cases
from labkit.course.grading.sandbox import Limits
from labkit.course.topics import TOPICS, of_topic

NO_TEXT = "*Your answer.*"  # what a released lab holds in the place of a text


def check_file(path: Path | str) -> bool:
    """Check every answer in a saved lab, print the results, and tell whether all are right.

    Of the texts that a person grades it says which are still empty; a lab of texts alone is right if none is.
    path: of a notebook file. Raises ValueError if it is no lab of the course.
    """
    path = Path(path)
    try:
        notebook = json.loads(path.read_text(encoding="utf-8-sig"))
        cells = cells_of(notebook["cells"])
    except FileNotFoundError as error:
        raise ValueError(f"path: there is no file {path} here; is the notebook saved, and under this name?") from error
    except (KeyError, TypeError, ValueError) as error:
        raise ValueError(f"path: expected a notebook, but {path} cannot be read as one") from error
    topic = topic_of(path, cells)
    lab = CheckedLab(cells, of_topic(topic))
    order = [cell.grade_id for cell in cells if cell.grade_id in lab.questions]
    names = [*dict.fromkeys(order), *(name for name in lab.questions if name not in order)]
    for name in names:
        print(describe(lab.questions[name], lab.verdict(name), Printed()))
    right = sum(lab.verdict(name).passed for name in names)
    if names:
        print(f"{path.name}, as it is saved: {right} of {len(names)} answers are right.")
    texts = texts_of(notebook["cells"])
    empty = [name for name, text in texts.items() if text.strip() in ("", NO_TEXT)]
    if empty or not names:
        said = f"still empty: {', '.join(empty)}." if empty else "none of them is empty."
        print(f"{path.name}, as it is saved, has {len(texts)} texts that a person grades; {said}")
    for name in not_saved(names, cells):
        print(f"The {name} that you ran last is not in the file: save the notebook (Ctrl+S), then run this cell again.")
    return right == len(names) if names else not empty


def texts_of(cells: Sequence[dict]) -> dict[str, str]:
    """The texts of a notebook's cells that a person grades, by their grade ids."""
    marks = [(cell, cell.get("metadata", {}).get("nbgrader", {})) for cell in cells if cell["cell_type"] == "markdown"]
    return {mark["grade_id"]: "".join(cell["source"]) for cell, mark in marks if mark.get("grade")}


def topic_of(path: Path, cells: Sequence[Cell]) -> str:
    """The topic of a lab: the one whose checks it calls most often, else the one in its name."""
    called = Counter(topic for cell in cells for topic in re.findall(r"check\(\s*[\"'](\w+)\.", cell.source))
    for topic in (*(topic for topic, _ in called.most_common()), path.stem):
        if topic in TOPICS:
            return topic
    raise ValueError(f"path: expected a lab of the course, but {path.name} calls no check of one")


@dataclass
class CheckedLab:
    """The answers of a saved lab, each judged once."""

    cells: Sequence[Cell]
    questions: dict[str, Question]
    verdicts: dict[str, Verdict] = field(default_factory=dict)

    def verdict(self, name: str) -> Verdict:
        """The verdict on an answer; answers that it calls come before, and are the kit's if they are wrong."""
        if name not in self.verdicts:
            self.verdicts[name] = Verdict(Problem("refused", "it calls itself through another answer"), None, "")
            self.verdicts[name] = self.judged(name)
        return self.verdicts[name]

    def judged(self, name: str) -> Verdict:
        """Run an answer's program on the public cases."""
        question, given = self.questions[name], {}
        cut = program(self.cells, name, self.questions, PACKAGES, question.forbidden)
        wrong = [other for other in cut.calls if not self.verdict(other).passed]
        if wrong:
            given = {other: self.questions[other].source for other in wrong}
            cut = program(self.cells, name, self.questions, PACKAGES, question.forbidden, given)
        if cut.refused:
            return Verdict(Problem("refused", cut.refused), None, "")
        verdict = Run(question, cut, Limits(), unsafe=True).judged(public_cases(question))[0]
        return looked_at(question, replace(verdict, pieces=cut.pieces))


def not_saved(names: Sequence[str], cells: Sequence[Cell]) -> list[str]:
    """The answers whose last run definition in this kernel is not in the file."""
    shell = jupyter()
    if shell is None:
        return []
    saved = {cell.source.strip() for cell in cells}
    ran = [Parsed(Cell(source)) for source in shell.history_manager.input_hist_raw]
    last = {name: [cell for cell in ran if cell.defines(name)][-1:] for name in names}
    return [name for name, found in last.items() if found and found[0].source.strip() not in saved]
