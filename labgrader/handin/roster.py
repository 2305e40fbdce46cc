"""roster.csv beside labs/: names and emails of the students, as a platform exports them or as somebody writes them.

It needs a heading and a column of ids, each a student's folder or the number that ends it. Moodle's grading worksheet
and Canvas's exported gradebook may be used as they are. Names are of the students' making: whatever one holds, it stays
in its own row and in its own cell, or the file is refused with the line where it stands.
"""

import csv
import io
import re
import unicodedata
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

FILE = "roster.csv"
# Headings that are understood, in small letters: the kit's own, Moodle's and Canvas's.
COLUMNS = {
    "id": ("id", "identifier"),
    "name": ("name", "full name", "student"),
    "email": ("email", "email address"),
}
NUMBERED = re.compile(r"(?P<name>.+)_(?P<number>[0-9]+)", re.DOTALL)
JOINERS = "\u200c\u200d"  # which Persian and Indian names need, and no line or page takes for more


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
    student = unicodedata.normalize("NFC", student)
    found = NUMBERED.fullmatch(student)
    return (student, found["number"]) if found else (student,)


def person_of(roster: dict[str, Person], student: str) -> Person | None:
    """The line of a student, None if there is none."""
    return next((roster[key] for key in keys_of(student) if key in roster), None)


def identity(roster: dict[str, Person], student: str) -> str:
    """What a person is known by in all labs: the email, since Moodle numbers people anew in each assignment.

    It is the id of the roster where that has no email, and the folder's name without a roster.
    """
    person = person_of(roster, student)
    return (person.email or person.id) if person is not None else student


def absent_of(roster: dict[str, Person], students: Iterable[str]) -> list[Person]:
    """The people of a roster of whom there is no folder, each once."""
    here = {identity(roster, student) for student in students}
    absent = {identity(roster, person.id): person for person in roster.values()}
    return [person for who, person in absent.items() if who not in here]


def ids_of(roster: dict[str, Person], name: str) -> list[str]:
    """The ids of whoever has this email, else the name itself: a folder's, or the number at its end."""
    return [person.id for person in roster.values() if person.email and person.email == name] or [name]


def read_roster(course: Path) -> dict[str, Person]:
    """The roster by id, {} if there is no file. Raises ValueError, with file and line, for what cannot be used."""
    path = Path(course) / FILE
    if not path.is_file():
        return {}
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError(f"{path}: it is not UTF-8 text; save it as CSV UTF-8") from None
    first = re.split(r"[\r\n]", text, maxsplit=1)[0]
    # Lines end at \n and \r alone, and not in quotes: U+2028 and its like are a part of the name that holds them.
    rows = csv.reader(io.StringIO(text, newline=""), delimiter=max(",;\t", key=first.count), strict=True)
    try:
        return people_of(rows, path, first)
    except csv.Error as error:
        raise ValueError(
            f"{path}, line {rows.line_num}: {error}; is there a quotation mark without its other?"
        ) from None


def people_of(rows: Iterator[list[str]], path: Path, first: str) -> dict[str, Person]:
    """The people in the rows of a file, by id; first: the file's first line."""
    heading = [in_one_line(cell) for cell in next(rows, [])]
    small = [cell.lower() for cell in heading]
    places = {name: next((small.index(h) for h in known if h in small), None) for name, known in COLUMNS.items()}
    if places["id"] is None:
        raise ValueError(f"{path}, line 1: expected a column id, Identifier (Moodle) or ID (Canvas), got {first!r}")
    people: dict[str, Person] = {}
    for row in rows:
        row = [in_one_line(cell) for cell in row]
        is_canvass = row[:1] in (["Points Possible"], ["Student, Test"]) or not set(row) - {"", "Manual Posting"}
        if is_canvass:
            continue
        values = {name: row[at] if at is not None and at < len(row) else "" for name, at in places.items()}
        values["id"] = values["id"].removeprefix("Participant ")
        where = f"{path}, line {rows.line_num}"
        if any(row[len(heading) :]):
            raise ValueError(
                f"{where}: expected {len(heading)} cells, got {len(row)}; a cell with a comma needs quotes"
            )
        if not values["id"]:
            raise ValueError(f"{where}: expected an id, got none for {values['name'] or 'this line'}")
        if values["id"] in people:
            raise ValueError(f"{where}: expected each id once, got {values['id']} again; keep one line of it")
        people[values["id"]] = Person(**values, more=dict(zip(heading, row, strict=False)))
    return people


def in_one_line(cell: str) -> str:
    r"""A cell in one line: a space for what is no letter, sign or space, such as a line's end or an escape code.

    >>> in_one_line("Ada\nLovelace "), in_one_line("Zoe\u0308") == "Zo\u00eb"
    ('Ada Lovelace', True)
    """
    text = unicodedata.normalize("NFC", cell)
    return "".join(c if c.isprintable() or c in JOINERS else " " for c in text).strip()
