"""The class: of each question how many tried and passed, which mistakes how many made, and comments for all of them.

Wrong answers are one group if the same hint names their mistake, and otherwise if they give the same outputs on the
public cases: a class of a hundred makes few mistakes, so one comment per group answers many students.
"""

import hashlib
import json
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from labgrader.grade.batch import Record
from labgrader.grade.grade import Result
from labgrader.handin.reading import Lab
from labgrader.support import write_atomically

COMMENTS_FILE = "comments.json"
NOT_RUN = ("refused", "syntax")
COUNTED = {"time": "time-outs", "refused": "refused", "syntax": "syntax errors"}  # by kind of result


@dataclass(frozen=True)
class Group:
    """Wrong answers to a question that are wrong in the same way. named: whether a hint says what the mistake is.

    says: the hint, or what the first of them was told. sample: the program of the first.
    """

    name: str
    question: str
    named: bool
    says: str
    sample: str
    students: tuple[str, ...]


@dataclass(frozen=True)
class Standing:
    """What became of a question: how many have an answer of their own to it, how many are right, and the groups.

    discrimination: correlation of right answers with the points of the other questions, None where all or none are
    right, or all have the same points there. counts: how many ended in each of `COUNTED`.
    """

    question: str
    tried: int
    passed: int
    discrimination: float | None
    counts: dict[str, int]
    groups: tuple[Group, ...]


def group_of(result: Result) -> str:
    """The name of the group that a result belongs to, "" for a right answer and for none: iou-2a3091."""
    key = result.behaviour or result.hint or (result.says if result.kind in NOT_RUN else "")
    return f"{result.question}-{hashlib.sha256(key.encode()).hexdigest()[:6]}" if key and not result.right else ""


def lines_of(result: Result, comments: Mapping[str, str]) -> list[str]:
    """What a student is told about a question."""
    said = result.says[:1].upper() + result.says[1:] + "."
    hint = [f"Hint: {result.hint}"] if result.hint else []
    comment = comments.get(group_of(result), "")
    note = [f"{result.note[:1].upper()}{result.note[1:]}."] if result.note else []
    return [said, *note, *result.shown.splitlines(), *hint, *([f"Comment: {comment}"] if comment else [])]


def standings(lab: Lab, records: Sequence[Record]) -> list[Standing]:
    """What became of each question in a class, in the lab's order; the largest groups first."""
    found = []
    for name in lab.answers:
        results = [
            (record.student, result) for record in records for result in record.results if result.question == name
        ]
        members: dict[str, list[tuple[str, Result]]] = {}
        for student, result in results:
            if group := group_of(result):
                members.setdefault(group, []).append((student, result))
        groups = [
            Group(group, name, not first.behaviour, first.hint or first.says, first.program, tuple(s for s, _ in same))
            for group, same in members.items()
            for first in [same[0][1]]
        ]
        groups.sort(key=lambda group: (-len(group.students), group.name))
        tried = sum(bool(result.right or group_of(result) or result.flag) for _, result in results)
        passed = sum(result.right for _, result in results)
        counts = {kind: sum(result.kind == kind for _, result in results) for kind in COUNTED}
        found.append(Standing(name, tried, passed, discrimination(name, records), counts, tuple(groups)))
    return found


def discrimination(question: str, records: Sequence[Record]) -> float | None:
    """The point-biserial correlation of a right answer with the points of all other questions, None without one."""
    pairs = [
        (float(result.right), record.points - result.points)
        for record in records
        for result in record.results
        if result.question == question
    ]
    try:
        return statistics.correlation(*zip(*pairs, strict=True))
    except (statistics.StatisticsError, TypeError):  # fewer than two, or all the same
        return None


# ------------------------------------------------------------------------------------------------- comments


def read_comments(out: Path) -> dict[str, str]:
    """An instructor's comments, by group; {} if there are none. Raises ValueError for a damaged file."""
    path = Path(out) / COMMENTS_FILE
    try:
        comments = json.loads(path.read_bytes()) if path.is_file() else {}
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{path}: {error}; mend it, or delete it and give the comments again") from None
    if not isinstance(comments, dict) or not all(isinstance(text, str) for text in comments.values()):
        raise ValueError(f"{path}: expected a text by group of wrong answers; mend or delete it")
    return comments


def add_comment(out: Path, groups: Sequence[str], group: str, text: str) -> dict[str, str]:
    """Keep a comment for a group, "" to take it back; returns all comments. Raises ValueError for an unknown group."""
    if group not in groups:
        raise ValueError(f"comment: expected one of the groups {', '.join(groups) or '(there is none)'}, got {group!r}")
    comments = {name: said for name, said in (read_comments(out) | {group: text}).items() if said}
    write_atomically(Path(out) / COMMENTS_FILE, (json.dumps(comments, indent=1, ensure_ascii=False) + "\n").encode())
    return comments
