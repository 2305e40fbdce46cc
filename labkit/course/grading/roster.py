"""roster.csv beside labs/: names and emails of the students, as a platform exports them or as somebody writes them.

It needs a heading and a column of ids, each a student's folder or the number that ends it. Moodle's grading worksheet
and Canvas's exported gradebook may be used as they are.
"""

import csv
import re
from dataclasses import dataclass, field
from pathlib import Path

FILE = "roster.csv"
# Headings that are understood, in small letters: the kit's own, Moodle's and Canvas's.
COLUMNS = {
    "id": ("id", "identifier"),
    "name": ("name", "full name", "student"),
    "email": ("email", "email address"),
}
NUMBERED = re.compile(r"(?P<name>.+)_(?P<number>\d+)")


@dataclass(frozen=True)
class Person:
    """A line of the roster; more: all its cells, by their headings."""

    id: str
    name: str = ""
    email: str = ""
    more: dict[str, str] = field(default_factory=dict)

    @property
    def first_and_last(self) -> tuple[str, str]:
        """The first names and the last name: "Lovelace, Ada" or "Ada Lovelace"."""
        last, comma, first = self.name.partition(", ")
        return (first, last) if comma else tuple(map(str.strip, self.name.rpartition(" ")[::2]))


def keys_of(student: str) -> tuple[str, ...]:
    """What a student is known by: the folder's name, and the platform's number at its end."""
    found = NUMBERED.fullmatch(student)
    return (student, found["number"]) if found else (student,)


def person_of(roster: dict[str, Person], student: str) -> Person | None:
    """The line of a student, None if there is none."""
    return next((roster[key] for key in keys_of(student) if key in roster), None)


def read_roster(course: Path) -> dict[str, Person]:
    """The roster by id, {} if there is no file. Raises ValueError, with file and line, for what cannot be used."""
    path = Path(course) / FILE
    if not path.is_file():
        return {}
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError(f"{path}: it is not UTF-8 text; save it as CSV UTF-8") from None
    first = text.partition("\n")[0]
    rows = csv.reader(text.splitlines(), delimiter=max(",;\t", key=first.count))
    heading = [cell.strip() for cell in next(rows, [])]
    small = [cell.lower() for cell in heading]
    places = {name: next((small.index(h) for h in known if h in small), None) for name, known in COLUMNS.items()}
    if places["id"] is None:
        raise ValueError(f"{path}, line 1: expected a column id, Identifier (Moodle) or ID (Canvas), got {first!r}")
    people: dict[str, Person] = {}
    for row in rows:
        row = [cell.strip() for cell in row]
        if not any(row) or row[0] in ("Points Possible", "Student, Test"):  # of Canvas
            continue
        values = {name: row[at] if at is not None and at < len(row) else "" for name, at in places.items()}
        values["id"] = values["id"].removeprefix("Participant ")
        where = f"{path}, line {rows.line_num}"
        if not values["id"]:
            raise ValueError(f"{where}: expected an id, got none for {values['name'] or 'this line'}")
        if values["id"] in people:
            raise ValueError(f"{where}: expected each id once, got {values['id']} again; keep one line of it")
        people[values["id"]] = Person(**values, more=dict(zip(heading, row, strict=False)))
    return people
