"""What an instructor changes after a lab was released: points for everybody, other points, a question less, or partly.

`grade` keeps changes in changes.json beside labs/, and takes them out again. A person may write one into course.toml:

    [[change]]
    lab = "04_iou"
    question = "iou"
    everybody = true     # or: drop = true, or: points = 3, or: partial = true
    date = 2026-10-05
    reason = "the task did not say what an empty class gets"

Of several to one question that of changes.json counts, else the last. With partial, each output that the question names
earns its share alone, if it is right in all cases. Records keep what was earned; a change is applied to them each time
that tables, pages and the gradebook are written.
"""

import copy
import datetime
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from labgrader.course import find, of_topic
from labgrader.grade.batch import Record
from labgrader.grade.grade import Result
from labgrader.handin.reading import Lab
from labgrader.program.cell import grade_id
from labgrader.settings import FILE, fault_of_fields, read_blocks
from labgrader.support import write_atomically

CHANGES = "changes.json"
KINDS = ("everybody", "drop", "points", "partial")
NO_COUNT, FOR_ALL, IN_PARTS = "It does not count", "Everybody has these points", "Its outputs count one by one"


@dataclass(frozen=True)
class Change:
    """One change to a question of a lab. points: what it is worth now, None if that stays; partial: by its outputs."""

    lab: str
    question: str
    date: datetime.date
    reason: str
    everybody: bool = False
    drop: bool = False
    points: float | None = None
    partial: bool = False

    @property
    def fields(self) -> dict:
        """What stands in a file."""
        kind = {name: getattr(self, name) for name in KINDS}
        kind = {name: value for name, value in kind.items() if value is not None and value is not False}
        return {"lab": self.lab, "question": self.question, **kind, "date": self.date, "reason": self.reason}

    def __str__(self) -> str:
        return f"{NO_COUNT if self.drop else IN_PARTS if self.partial else FOR_ALL}: {self.reason}"


def change_of(lab: str, reason: str, **kinds: str | None) -> Change | None:
    """The change that a command asks for, None if for none; kinds: questions, as "iou=3" for points.

    Raises ValueError for several at a time, and for one without a reason.
    """
    asked = {kind: question for kind, question in kinds.items() if question is not None}
    if not asked:
        return None
    if len(asked) > 1:
        raise ValueError(f"expected one of --{', --'.join(KINDS)} at a time, got --{' and --'.join(asked)}")
    if not reason.strip():
        raise ValueError("reason: expected --reason, which students read beside the points, got none")
    ((kind, question),) = asked.items()
    question, _, number = question.partition("=") if kind == "points" else (question, "", "0")
    if not re.fullmatch(r"\d+(\.\d+)?", number):
        raise ValueError(f"points: expected QUESTION=NUMBER, such as iou=3, got {asked[kind]!r}")
    value = float(number) if kind == "points" else True
    return Change(lab, question, datetime.date.today(), reason.strip(), **{kind: value})


def read_changes(course: Path, lab: Lab) -> list[Change]:
    """The changes to a lab, those of course.toml first; raises ValueError, with the file, for what cannot be used."""
    path = Path(course) / CHANGES
    kept = [(f"{path}, number {i}", data) for i, data in enumerate(kept_changes(course), start=1)]
    found = []
    for where, data in (*read_blocks(course, "change"), *kept):
        if fault := fault_of(data, lab):
            raise ValueError(f"{where}: {fault}")
        if data["lab"] == lab.topic:
            found.append(Change(**data))
    return found


def kept_changes(course: Path) -> list[dict]:
    """The changes in changes.json, of all labs; none if there is no file, ValueError if it cannot be read."""
    path = Path(course) / CHANGES
    try:
        kept = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else []
        return [data | {"date": datetime.date.fromisoformat(data["date"])} for data in kept]
    except (ValueError, TypeError, KeyError) as error:
        raise ValueError(f"{path}: expected a list of changes, as grade writes it: {error}") from None


def keep_changes(course: Path, changes: Sequence[dict]) -> None:
    """Write changes.json."""
    written = [data | {"date": str(data["date"])} for data in changes]
    text = json.dumps(written, indent=1, ensure_ascii=False) + "\n"
    write_atomically(Path(course) / CHANGES, text.encode())


def fault_of(data: dict, lab: Lab) -> str:
    """What of a change cannot be used, "" if nothing; questions of other labs are not looked for."""
    needed = {"lab": str, "question": str, "date": datetime.date, "reason": str}
    if fault := fault_of_fields(data, needed, {kind: float if kind == "points" else bool for kind in KINDS}):
        return fault
    if len(data.keys() & set(KINDS)) != 1:
        return "expected one of everybody = true, drop = true, points = NUMBER and partial = true in this block"
    if data["lab"] != lab.topic:
        return ""
    in_parts = [name for name, question in of_topic(lab.topic).items() if question.outputs]
    if "partial" in data and data["question"] not in in_parts:
        several = ", ".join(in_parts) or f"{lab.topic} has none"
        return f"partial: expected a question of several outputs ({several}), got {data['question']}"
    if data["question"] in lab.points:
        return ""
    if data["question"] not in lab.written:
        return f"question: expected one of {', '.join((*lab.points, *lab.written))}, got {data['question']}"
    return "points: a person gives those of an answer in words; drop and everybody are possible" * ("points" in data)


def add_change(course: Path, lab: Lab, change: Change) -> None:
    """Keep a change, in the place of an earlier one to its question; ValueError if it is none."""
    if fault := fault_of(change.fields, lab):
        raise ValueError(fault)
    keep_changes(course, [*others(course, lab, change.question), change.fields])


def undo(course: Path, lab: Lab, question: str) -> None:
    """Take the change to a question out of changes.json; ValueError if there is none in it."""
    kept = others(course, lab, question)
    if len(kept) == len(kept_changes(course)):
        by_hand = any(change.question == question for change in read_changes(course, lab))
        where = Path(course) / (FILE if by_hand else CHANGES)
        remedy = f"delete its block in {where}" if by_hand else f"there is no change to it in {where}"
        raise ValueError(f"undo: {question} of {lab.topic}: {remedy}")
    keep_changes(course, kept)


def others(course: Path, lab: Lab, question: str) -> list[dict]:
    """The changes in changes.json but those to a question."""
    return [data for data in kept_changes(course) if (data["lab"], data["question"]) != (lab.topic, question)]


def changed(lab: Lab, records: Sequence[Record], changes: Sequence[Change]) -> tuple[Lab, list[Record]]:
    """A lab and what was earned in it under changes; of several to one question the last counts."""
    by_question = {change.question: change for change in changes}
    if not by_question:
        return lab, list(records)
    points, notebook = dict(lab.points), copy.deepcopy(lab.notebook)
    for name, change in by_question.items():
        if name in points:
            points[name] = 0.0 if change.drop else points[name] if change.points is None else float(change.points)
    for cell in notebook["cells"]:
        name = (grade_id(cell) or "").removeprefix("check_")
        if name in by_question and "points" in cell["metadata"]["nbgrader"]:
            mark = cell["metadata"]["nbgrader"]
            mark["points"] = points.get(name, 0.0 if by_question[name].drop else mark["points"])
    now = []
    for record in records:
        results = (changed_result(result, by_question.get(result.question), points) for result in record.results)
        now.append(replace(record, results=tuple(results)))
    return replace(lab, points=points, notebook=notebook), now


def changed_result(result: Result, change: Change | None, points: dict[str, float]) -> Result:
    """A result under the change to its question."""
    if change is None:
        return result
    worth = points[result.question]
    earned = worth if result.right or change.everybody else 0.0
    says = result.says
    if change.partial and not result.right:
        outputs = find(f"{change.lab}.{change.question}").outputs
        earned = round(worth * len(result.parts) / len(outputs), 2)
        says += f". Right in all cases: {', '.join(result.parts) or 'none'} (of {', '.join(outputs)})"
    if change.points is None:
        says += f". {change}"
    return replace(result, points=earned, max_points=worth, says=says)
