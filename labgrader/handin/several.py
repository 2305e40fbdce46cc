"""Which of several notebooks of one student is graded: the later one, as far as a platform tells which that is.

Moodle's zip has the time of each file, and Canvas numbers what is uploaded. What does not count lies in a folder
`others` beside the notebook that does. Where neither tells, all of them lie in `several`, and the student waits until
a person names one in course.toml, which may also be another one than the later:

    [[notebook]]
    lab = "04_iou"
    student = "1234567"
    file = "04_iou final.ipynb"
"""

import datetime
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from labgrader.handin.roster import ids_of, read_roster
from labgrader.settings import usable_blocks

OTHERS, SEVERAL = "others", "several"
COPY = re.compile(r"(?P<name>.+?)(?: ?\((?P<saved>\d+)\)|-(?P<uploaded>\d+))?\.ipynb")  # saved, or handed in, again


@dataclass(frozen=True)
class HandIn:
    """A notebook of a platform's. name: the student's for it; when: in UTC; number: of the upload; None if untold."""

    path: Path
    name: str
    when: datetime.datetime | None = None
    number: int | None = None

    @property
    def marked(self) -> str:
        """The name with what the platform tells of it, as a file may be called."""
        said = f"{self.when:%Y-%m-%d %H.%M.%S} UTC" if self.when else "" if self.number is None else str(self.number)
        return f"{said}, {self.name}" if said else self.name


def the_later(handed_in: Sequence[HandIn]) -> HandIn | None:
    """The notebook that was handed in last, None if nothing tells which that is.

    Several of the same bytes are one. Canvas's numbers and those in the names, "04_iou (2).ipynb", have to agree.
    """
    order = sorted(handed_in, key=lambda one: (one.when or datetime.datetime.min, one.number or 0))
    different = list({one.path.read_bytes(): one for one in order}.values())
    if len(different) == 1:
        return different[0]
    whens, numbers = [one.when for one in different], [one.number for one in different]
    told = next((marks for marks in (whens, numbers) if None not in marks), [])
    if len(set(told[-2:])) < 2:
        return None
    copies = [COPY.fullmatch(one.name) for one in different]
    if told is numbers and all(copies) and len({copy["name"] for copy in copies}) == 1:
        named = [int(copy["saved"] or copy["uploaded"] or 0) for copy in copies]
        if named.index(max(named)) != len(named) - 1:
            return None
    return different[-1]


def read_picks(course: Path, topic: str) -> dict[str, str]:
    """By student the notebook that a person named; raises ValueError, with the place, for what cannot be used."""
    roster, found = read_roster(course), {}
    for where, data in usable_blocks(course, "notebook", {"lab": str, "student": str, "file": str}):
        ids = ids_of(roster, data["student"]) if data["lab"] == topic else []
        if found.keys() & ids:
            raise ValueError(f"{where}: student: {data['student']} has a notebook above")
        found |= dict.fromkeys(ids, data["file"])
    return found
