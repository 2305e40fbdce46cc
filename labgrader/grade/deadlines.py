"""Who is late, and what it costs: deadlines and extensions in course.toml.

    [[deadline]]
    lab = "04_iou"
    due = 2026-10-05T23:59:00    # local time, if no offset follows; a date alone means its end
    grace_minutes = 15
    penalty_per_day = 10         # percent of the points that were earned, for each day that was begun

    [[extension]]
    lab = "04_iou"
    student = "Ada Lovelace_1234567"    # or the number alone, or an email of the roster or of Gradescope
    due = 2026-10-12T23:59:00           # or late_days = 0: so many days, whatever the clock says
    reason = "ill"

A platform that says only that somebody is late (Canvas) is believed, and one day is counted. It knows nothing of an
extension here: until that is over nothing is taken off, and later neither, but then a person is told to write how many
days it were.
"""

import datetime
import math
from collections.abc import Collection
from dataclasses import dataclass, field, replace
from pathlib import Path

from labgrader.handin.roster import ids_of, keys_of, read_roster
from labgrader.settings import usable_blocks
from labgrader.support import counted

DAY_S = 86400.0
UNKNOWN = "nothing is taken off until its [[extension]] says late_days = N in the place of due"


@dataclass(frozen=True)
class Lateness:
    """How late work is, and what it costs. guessed: whether nobody knows more than that it is late.

    free: days that cost nothing, of those that a student has in the whole course. unknown: when an extension ended, in
    UTC, where it is called late and may have come before or after that.

    >>> str(Lateness(1, free=1)), str(Lateness(3, 20.0, free=1))
    ('1 day late, covered by a free late day; no deduction', '3 days late, 1 of them free, 20 % less')
    """

    days: int = 0
    percent: float = 0.0
    guessed: bool = False
    free: int = 0
    unknown: datetime.datetime | None = None

    def __str__(self) -> str:
        if self.unknown is not None:
            until = f"{self.unknown.replace(tzinfo=datetime.UTC).astimezone():%Y-%m-%d %H:%M}"
            return f"its platform calls it late and not since when, its extension ended on {until}: {UNKNOWN}"
        if not self.days:
            return ""
        guessed = ", as its platform marks it late and does not say by how much" if self.guessed else ""
        free = f", {self.free} of them free" if self.free else ""
        if self.free == self.days:
            free = f", covered by {'a free late day' if self.days == 1 else f'{self.days} free late days'}"
        off = f", {self.percent:g} % less" if self.percent else "; no deduction"
        return f"{counted(self.days, 'day')} late{guessed}{free}{off}"


@dataclass(frozen=True)
class Deadline:
    """The deadline of a lab, and extensions by student. due: in UTC, without a zone, as nbgrader has it."""

    due: datetime.datetime
    grace_minutes: float = 0.0
    penalty_per_day: float = 0.0
    extensions: dict[str, dict] = field(default_factory=dict)

    def due_for(self, student: str) -> datetime.datetime:
        """When a student's work is due."""
        return self.extension(student).get("due", self.due)

    def extension(self, student: str) -> dict:
        """A student's extension, {} for none."""
        return next((self.extensions[key] for key in keys_of(student) if key in self.extensions), {})

    def lateness(
        self, student: str, handed_in: datetime.datetime | None, marked: datetime.datetime | None = None
    ) -> Lateness:
        """How late a student is, times being in UTC. handed_in: None if unknown.

        marked: where the platform calls it late and does not say since when, a time by which it was there.
        """
        extension = self.extension(student)
        if "late_days" in extension:
            days, guessed = math.ceil(extension["late_days"]), False
        elif handed_in is not None:
            seconds, guessed = (handed_in - self.due_for(student)).total_seconds(), False
            days = math.ceil(seconds / DAY_S) if seconds > 60.0 * self.grace_minutes else 0
        elif marked is not None and "due" in extension:
            on_time = (marked - extension["due"]).total_seconds() <= 60.0 * self.grace_minutes
            return Lateness() if on_time else Lateness(unknown=extension["due"])
        else:
            days, guessed = int(marked is not None), marked is not None
        return Lateness(days, min(100.0, days * self.penalty_per_day), guessed)

    def with_free(self, late: Lateness, free: int) -> Lateness:
        """The same lateness when some of its days are free."""
        return replace(late, free=free, percent=min(100.0, (late.days - free) * self.penalty_per_day))


def read_deadline(course: Path, topic: str) -> Deadline | None:
    """The deadline of a lab in course.toml, None if there is none; ValueError, with its line, for what cannot be."""
    roster, extensions = read_roster(course), {}
    needed, possible = {"lab": str, "student": str, "reason": str}, {"due": datetime.date, "late_days": float}
    for where, data in usable_blocks(course, "extension", needed, possible):
        if ("due" in data) == ("late_days" in data):
            raise ValueError(f"{where}: expected one of due = DATE and late_days = NUMBER in this block")
        ids = ids_of(roster, data["student"]) if data["lab"] == topic else []
        if extensions.keys() & ids:
            raise ValueError(f"{where}: student: {data['student']} has an extension above")
        extensions |= dict.fromkeys(ids, data | ({"due": in_utc(data["due"])} if "due" in data else {}))
    found, needed = None, {"lab": str, "due": datetime.date}
    for where, data in usable_blocks(course, "deadline", needed, {"grace_minutes": float, "penalty_per_day": float}):
        if data["lab"] == topic:
            if found is not None:
                raise ValueError(f"{where}: lab: {topic} has a deadline above")
            numbers = {name: float(value) for name, value in data.items() if name not in needed}
            found = Deadline(in_utc(data["due"]), **numbers, extensions=extensions)
    return found


def in_utc(when: datetime.date) -> datetime.datetime:
    """A date or time of TOML, local where it names no offset, in UTC and without a zone."""
    if not isinstance(when, datetime.datetime):
        when = datetime.datetime.combine(when, datetime.time(23, 59, 59))
    return when.astimezone(datetime.UTC).replace(tzinfo=None)


def unknown_extensions(deadline: Deadline | None, students: Collection[str]) -> list[str]:
    """The names in extensions that none of the students has."""
    known = {key for student in students for key in keys_of(student)}
    return sorted(set(deadline.extensions) - known) if deadline else []
