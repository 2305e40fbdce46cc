"""From a hub's exchange to submitted/STUDENT/TOPIC: what `nbgrader collect` takes (deploy/jupyter/nbgrader_config.py).

Whoever hands in chooses the name of the folder in `inbound`, STUDENT+TOPIC+TIME+RANDOM, and so whose it claims to be.
On a hub accounts are the machine's, and nobody can give a folder or file to somebody else: its owner is who handed it
in. nbgrader warns of another owner and collects all the same. Here such a folder is left, and an earlier one of the
student's own counts.

The time of hand-in is what timestamp.txt says, which the student owns, too. What the kernel keeps, when a file was last
changed, nobody can set: work that says an earlier time is named, and a person decides.
"""

import datetime
import os
import pwd
import stat
from pathlib import Path

from nbgrader.exchange.default.collect import ExchangeCollect
from nbgrader.utils import parse_utc

from labgrader.handin.reading import text_of

SUBMITTING = datetime.timedelta(minutes=10)  # `nbgrader submit` writes the time, and copies the files then


class OwnersCollect(ExchangeCollect):
    """nbgrader's collect, which leaves what its owner did not hand in, and says whose it claims to be."""

    def __init__(self, **options):
        super().__init__(**options)
        self.others: dict[str, list[str]] = {}  # by folder the accounts beside the student's

    def _sort_by_timestamp(self, records: list[dict]) -> list[dict]:
        """One student's folders, the newest first: those that are the student's own, or all if none is."""
        return super()._sort_by_timestamp([record for record in records if self.is_own(record)] or records)

    def copy_files(self) -> None:
        """Copy what was found, without those of whom nothing is their own."""
        self.src_records = [record for record in self.src_records if self.is_own(record)]
        for record in self.src_records:
            folder = Path(self.inbound_path) / record["filename"]
            changed, told = last_change(folder), time_told(folder)
            if told is None or changed - told > SUBMITTING:
                says = "%a says that it was handed in %s, and was changed %s UTC: see [[extension]] of course.toml"
                when = f"{told:%Y-%m-%d %H:%M} UTC" if told else "at no time"
                self.log.warning(says, record["filename"], when, f"{changed:%Y-%m-%d %H:%M}")
        super().copy_files()

    def is_own(self, record: dict) -> bool:
        """Whether a folder and all in it belongs to the student whose it claims to be; what does not is named once."""
        if not self.check_owner:
            return True
        name, student = record["filename"], record["username"]
        if name not in self.others:
            self.others[name] = sorted(owners(Path(self.inbound_path) / name) - {student})
            if self.others[name]:
                says = "Left out %a: it claims to be from %a and belongs to %a"
                self.log.error(says, name, student, ", ".join(self.others[name]))
        return not self.others[name]


def last_change(folder: Path) -> datetime.datetime:
    """When a folder or anything in it was changed last, in UTC, as the kernel keeps it: nobody can set that back."""
    latest = max(os.lstat(path).st_ctime for path in (folder, *folder.rglob("*")))
    return datetime.datetime.fromtimestamp(latest, datetime.UTC).replace(tzinfo=None)


def time_told(folder: Path) -> datetime.datetime | None:
    """When a folder says that it was handed in, in UTC; None if it says nothing that is a time."""
    try:
        return parse_utc(text_of(folder / "timestamp.txt"))
    except Exception:  # dateutil raises many kinds for what is no date
        return None


def owners(folder: Path) -> set[str]:
    """The accounts to which a folder and all below it belong; a link in it belongs to "a link"."""
    found = set()
    for path in (folder, *folder.rglob("*")):
        status = os.lstat(path)
        found.add("a link" if stat.S_ISLNK(status.st_mode) else account(status.st_uid))
    return found


def account(number: int) -> str:
    """The name of an account of this machine."""
    try:
        return pwd.getpwuid(number).pw_name
    except KeyError:
        return f"account {number}"
