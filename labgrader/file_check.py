"""`check LAB.ipynb`: a lab, as it is saved or on Colab's page, checked as the grader will, but on the public cases.

The answers are cut out of the file (`labgrader.program.slice`), each runs in a worker of its own that has the
packages of the grader and nothing of the kit, and other answers that one calls are the kit's where they are wrong. In
a notebook that is a plain process, since it is one's own; the command `check` has a sandbox where there is one. What is
ticked here is right with the grader.
"""

import json
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from labgrader.check import LIMITS, describe, jupyter, reply_to
from labgrader.comparison import Problem
from labgrader.course import asked, course, of_topic, topics
from labgrader.handin.reading import released_by
from labgrader.program.cell import Cell, Parsed, cells_of, grade_id
from labgrader.program.notebook import Unreadable, code_of, no_code, parse
from labgrader.program.open_notebook import live_notebook, running_file
from labgrader.program.slice import NO_CELL, program
from labgrader.question import Question
from labgrader.reply.judge import Verdict
from labgrader.run import subprocess_worker
from labgrader.run.run import Budget, Start
from labgrader.support import counted


def check_file(path: Path | str | None = None, start: Start = subprocess_worker.fresh_worker) -> bool:
    """Check every answer in a lab, print the results, and tell whether all are right.

    Of the texts that a person grades it says which are still empty; a lab of texts alone is right if none is.
    path: of a notebook file; if it is not given, the notebook that runs (`program.open_notebook`). On Colab, which
    keeps the notebook elsewhere, it is the one on the page. start: gives a worker, with a sandbox or without. Raises
    ValueError if it is no lab of the course.
    """
    is_here = path is not None and Path(path).is_file()
    live = None if is_here else live_notebook()
    state = "as it is saved" if live is None else "as it is now"
    if live is None:
        path = running_file(jupyter(), is_lab) if path is None else Path(path)
    path = Path(path or "This notebook")
    try:
        notebook = parse(path.read_bytes() if live is None else json.dumps(live).encode())
        cells, texts = code_of(notebook["cells"]), texts_of(notebook["cells"])
    except FileNotFoundError as error:
        raise ValueError(f"path: there is no file {path} here; is the notebook saved, and under this name?") from error
    except Unreadable as reason:
        raise ValueError(f"path: expected a notebook, but {path} cannot be read as one: {reason}") from reason
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise ValueError(f"path: expected a notebook, but {path} cannot be read as one") from error
    topic = topic_of(path, cells)
    if topic is None and not texts:
        raise ValueError(f"path: expected a lab of the course, but {path.name} calls no check of one")
    questions, tasks = (of_topic(topic), asked(topic)) if topic else ({}, {})
    lab = CheckedLab(cells, questions, start, no_code(notebook["cells"]))
    order = [cell.grade_id for cell in cells if cell.grade_id in questions]
    expected = [name for name in released_by(notebook)[1] or tasks if name in questions]
    names = list(dict.fromkeys([*order, *expected]))
    for name in names:
        verdict = lab.verdict(name)
        note = lab.notes.get(name, "")
        print(describe(questions[name], verdict, notes=[f"{note[:1].upper()}{note[1:]}."] if note else ()))
    right = sum(lab.verdict(name).passed for name in names)
    if names:
        print(f"{path.name}, {state}: {right} of {len(names)} answers are right.")
    empty = [name for name, text in texts.items() if text.strip() in ("", course().no_text)]
    if empty or not names:
        said = f"still empty: {', '.join(empty)}." if empty else "none of them is empty."
        print(f"{path.name}, {state}, has {counted(len(texts), 'written answer')}, graded by hand; {said}")
    for name in not_saved(names, cells) if state == "as it is saved" else ():
        print(f"The {name} that you ran last is not in the file: save the notebook (Ctrl+S), then run this cell again.")
    return right == len(names) if names else not empty


def is_lab(notebook: dict) -> bool:
    """Whether a notebook calls checks of one of the course's topics, has graded cells, or the course's own key."""
    called = "\n".join(cell.source for cell in cells_of(notebook.get("cells")))
    cells = notebook.get("cells")
    graded = any(grade_id(cell) for cell in (cells if isinstance(cells, list) else ()))
    is_named = course().metadata in notebook.get("metadata", {})
    return is_named or graded or bool(re.search(r"check\(\s*[\"']\w+\.", called))


def texts_of(cells: Sequence[dict]) -> dict[str, str]:
    """The texts of a notebook's cells that a person grades, by their grade ids."""
    marks = [(cell, cell.get("metadata", {}).get("nbgrader", {})) for cell in cells if cell["cell_type"] == "markdown"]
    texts = {mark["grade_id"]: "".join(cell["source"]) for cell, mark in marks if mark.get("grade")}
    return {"".join(c if c.isprintable() else ascii(c)[1:-1] for c in name): text for name, text in texts.items()}


def topic_of(path: Path, cells: Sequence[Cell]) -> str | None:
    """The topic of a lab: the one whose checks it calls most often, else the one in its name; None if neither says.

    A lab of texts alone calls no checks, and on Colab its name is not known.
    """
    called = Counter(topic for cell in cells for topic in re.findall(r"check\(\s*[\"'](\w+)\.", cell.source))
    for topic in (*(topic for topic, _ in called.most_common()), path.stem):
        if topic in topics():
            return topic
    return None


@dataclass
class CheckedLab:
    """The answers of a saved lab, each judged once.

    no_code: what to say of those whose cells are no code; notes: which of several cells of an answer was judged.
    """

    cells: Sequence[Cell]
    questions: dict[str, Question]
    start: Start = subprocess_worker.fresh_worker
    no_code: dict[str, str] = field(default_factory=dict)
    notes: dict[str, str] = field(default_factory=dict)
    verdicts: dict[str, Verdict] = field(default_factory=dict)
    budget: Budget = field(default_factory=lambda: Budget(LIMITS))

    def verdict(self, name: str) -> Verdict:
        """The verdict on an answer; answers that it calls come before, and are the kit's if they are wrong."""
        if name not in self.verdicts:
            self.verdicts[name] = Verdict(Problem("refused", "it calls itself through another answer"), None, "")
            self.verdicts[name] = self.reply_to(name)
        return self.verdicts[name]

    def reply_to(self, name: str) -> Verdict:
        """Run an answer's program on the public cases."""
        question, here = self.questions[name], course()
        asked = (name, self.questions, here.packages, question.forbidden, here.kit)
        cut = program(self.cells, *asked)
        self.notes[name] = cut.note
        if cut.refused.startswith(NO_CELL) and name in self.no_code:
            return Verdict(Problem("refused", self.no_code[name]), None, "")
        wrong = [other for other in cut.calls if not self.verdict(other).passed]
        if wrong:
            given = {other: self.questions[other].source for other in wrong}
            cut = program(self.cells, *asked, given)
        return reply_to(question, cut, budget=self.budget, start=self.start)[0]


def not_saved(names: Sequence[str], cells: Sequence[Cell]) -> list[str]:
    """The answers whose last run definition in this kernel is not in the file."""
    shell = jupyter()
    if shell is None:
        return []
    saved = {cell.source.strip() for cell in cells}
    ran = [Parsed(Cell(source)) for source in shell.history_manager.input_hist_raw]
    last = {name: [cell for cell in ran if cell.defines(name)][-1:] for name in names}
    return [name for name, found in last.items() if found and found[0].source.strip() not in saved]
