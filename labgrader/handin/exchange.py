"""From a hub's exchange to submitted/STUDENT/TOPIC: what `nbgrader collect` takes (deploy/jupyter/nbgrader_config.py).

Whoever hands in chooses the name of the folder in `inbound`, STUDENT+TOPIC+TIME+RANDOM, and so whose it claims to be.
On a hub accounts are the machine's, and nobody can give a folder or file to somebody else: its owner is who handed it
in. nbgrader warns of another owner and collects all the same. Here such a folder is left, and an earlier one of the
student's own counts.

Its owner can change a folder while it is collected, and put a link to somebody else's work in the place of a file. So
nothing is looked at by its name and opened afterwards: a folder and each file in it are opened once, without following
links, from the descriptor of what is above, and owner, kind and size are those of what was opened. What one student
left there costs nobody else: it is left out and named, and the others are collected.

The time of hand-in is what timestamp.txt says, which the student owns, too. What the kernel keeps, when a file was last
changed, nobody can set: work that says an earlier time is named, and a person decides.
"""

import datetime
import errno
import os
import pwd
import secrets
import shutil
import stat
import tempfile
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from fnmatch import fnmatch
from pathlib import Path

from nbgrader.exchange.default.collect import ExchangeCollect
from nbgrader.utils import parse_utc

from labgrader.handin.reading import BESIDE, fault_of, text_of
from labgrader.support import keep_closed

SUBMITTING = datetime.timedelta(minutes=10)  # `nbgrader submit` writes the time, and copies the files then
MOST_BYTES, MOST_FILES, DEEPEST = 200 << 20, 1_000, 20  # of one folder; its folders count as files
PIECE = 1 << 20  # bytes that are copied at a time
MOST_NAMED = 5  # folders that one account handed in for others
OPEN = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC  # a pipe that nobody writes would block for ever
NEVER = datetime.datetime.min  # the time of a folder whose name says none


class LeftOut(Exception):
    """Why a folder is not collected. owner: the account that it belongs to, where that is another one's."""

    def __init__(self, reason: str, owner: str = ""):
        super().__init__(reason)
        self.owner = owner


class OwnersCollect(ExchangeCollect):
    """nbgrader's collect, which leaves what its owner did not hand in, and says whose it claims to be."""

    def __init__(self, **options):
        super().__init__(**options)
        self.in_order: dict[str, list[dict]] = {}  # by student the folders, the newest first
        self.of_others: Counter[str] = Counter()  # by account the folders that it handed in for others

    def _path_to_record(self, path: str) -> dict:
        """What a folder's name says; NEVER as its time if that is none."""
        name = os.path.basename(path)
        try:
            record = super()._path_to_record(path)
            if isinstance(record["timestamp"], datetime.datetime):
                return record
        except Exception:  # dateutil raises many kinds for what is no date
            pass
        self.log.error("Left out %a: its name says no time", name)
        return {"username": name.rsplit("+", 3)[0], "filename": name, "timestamp": NEVER}

    def _sort_by_timestamp(self, records: list[dict]) -> list[dict]:
        """One student's folders, the newest first."""
        ordered = super()._sort_by_timestamp(records)
        self.in_order[records[0]["username"]] = ordered
        return ordered

    def copy_files(self) -> None:
        """Copy of each student the newest folder that is the student's own, for nobody else to read."""
        course, is_shared = Path(self.coursedir.root), self.coursedir.groupshared
        submitted = course / self.coursedir.submitted_directory
        before = os.umask(0o007 if is_shared else 0o077)
        try:
            submitted.mkdir(parents=True, exist_ok=True)
            if not is_shared:
                submitted.chmod(0o700)
                keep_closed(course)
            for newest in self.src_records:
                self.collect(newest, submitted)
        finally:
            os.umask(before)
        for owner, count in self.of_others.items():
            if count > MOST_NAMED:
                self.log.error("Left out %d more that belong to %a", count - MOST_NAMED, owner)

    def collect(self, newest: dict, submitted: Path) -> None:
        """Take a student's newest folder, or the newest before it that can be taken, unless it is there already."""
        student, topic = newest["username"], self.coursedir.assignment_id
        if fault := fault_of(student) if student else "it is empty":
            self.log.error("Left out %a: its name names no student: %s", newest["filename"], fault)
            return
        target = Path(self.coursedir.format_path(self.coursedir.submitted_directory, student, topic))
        candidates = [one for one in self.in_order[student] if NEVER < one["timestamp"] <= newest["timestamp"]]
        for record in candidates:
            if target.is_dir() and not self.is_newer(record, target):
                self.log.info("Already collected, use --update to update: %s %s", student, topic)
                return
            try:
                with staged(submitted) as folder:
                    self.take(record, folder / topic)
                    put(folder / topic, target)
                self.log.info("Collected: %s %s", student, topic)
                return
            except LeftOut as reason:
                self.of_others[reason.owner] += bool(reason.owner)
                if self.of_others[reason.owner] <= MOST_NAMED:
                    self.log.error("Left out %a: %s", record["filename"], reason)
            except OSError as error:
                self.log.error("Left out %a: %s", record["filename"], os.strerror(error.errno or 0))

    def is_newer(self, record: dict, target: Path) -> bool:
        """Whether a folder is to take the place of what was collected, by nbgrader's options."""
        there = time_told(target)
        if self.update and (there is None or record["timestamp"] > there):
            return True
        return bool(self.before_duedate and there != record["timestamp"])

    def take(self, record: dict, folder: Path) -> None:
        """Copy a record's folder; raises LeftOut, or OSError, if it is not as it should be."""
        inbound = os.open(self.inbound_path, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        try:
            student = record["username"] if self.check_owner else None
            copying = Copying(student, self.coursedir.ignore or (), self.coursedir.include or ())
            copying.copy(inbound, record["filename"], folder)
        finally:
            os.close(inbound)
        changed, told = as_utc(copying.changed), time_told(folder)
        if told is None or changed - told > SUBMITTING:
            says = "%a says that it was handed in %s, and was changed %s UTC: see [[extension]] of course.toml"
            when = f"{told:%Y-%m-%d %H:%M} UTC" if told else "at no time"
            self.log.warning(says, record["filename"], when, f"{changed:%Y-%m-%d %H:%M}")
        # `nbgrader release_feedback` stops at a student without them.
        time, secret = (folder / name for name in BESIDE)
        if told is None:
            time.write_text(f"{changed:%Y-%m-%d %H:%M:%S} UTC")
        if not text_of(secret):
            secret.write_text(secrets.token_hex(64))


@dataclass
class Copying:
    """The copy of one folder that an account handed in.

    student: to whom all of it has to belong; None for anybody. ignore, include: patterns of names, as nbgrader has
    them. left, files: bytes and files that there may still be. changed: when anything in it was changed last, in
    seconds.
    """

    student: str | None
    ignore: tuple[str, ...] = ()
    include: tuple[str, ...] = ()
    left: int = MOST_BYTES
    files: int = MOST_FILES
    changed: float = 0.0
    buffer: bytearray = field(default_factory=lambda: bytearray(PIECE), repr=False)

    def copy(self, above: int, name: str, target: Path, depth: int = 0) -> None:
        """Copy what has a name in an open folder, if it is a folder or file of the student's; follows no link.

        Raises LeftOut if it is not, or if all is too large together.
        """
        try:
            opened = os.open(name, OPEN | (os.O_DIRECTORY if depth == 0 else 0), dir_fd=above)
        except OSError as error:
            owner = account(os.stat(name, dir_fd=above, follow_symlinks=False).st_uid)
            self.refuse_anothers(owner)
            what = "a link" if error.errno in (errno.ELOOP, errno.ENOTDIR) else os.strerror(error.errno).lower()
            raise LeftOut(f"{name!a}: {what}") from None
        try:
            status = os.fstat(opened)
            self.refuse_anothers(account(status.st_uid))
            self.changed = max(self.changed, status.st_ctime)
            self.files -= 1
            if self.files < 0 or depth > DEEPEST:
                raise LeftOut(f"more than {MOST_FILES} files, or folders more than {DEEPEST} deep")
            if stat.S_ISDIR(status.st_mode):
                target.mkdir()
                for entry in os.scandir(opened):
                    if self.is_wanted(entry.name):
                        self.copy(opened, entry.name, target / entry.name, depth + 1)
            elif stat.S_ISREG(status.st_mode):
                self.copy_file(opened, status.st_size, target)
            else:
                raise LeftOut(f"{name!a} is no file")
        finally:
            os.close(opened)

    def copy_file(self, opened: int, size: int, target: Path) -> None:
        """Copy a file's content, which may grow meanwhile."""
        with open(target, "xb") as file:
            while size <= self.left and (count := os.readv(opened, [self.buffer])):
                self.left -= count
                size = 0
                file.write(memoryview(self.buffer)[:count])
        if size > self.left or self.left < 0:
            raise LeftOut(f"it is larger than {MOST_BYTES >> 20} MB")

    def is_wanted(self, name: str) -> bool:
        """Whether nbgrader's settings take a file of a name."""
        if any(fnmatch(name, pattern) for pattern in self.ignore):
            return False
        return not self.include or name in BESIDE or any(fnmatch(name, pattern) for pattern in self.include)

    def refuse_anothers(self, owner: str) -> None:
        """Raise LeftOut for what belongs to another account than the student's."""
        if self.student is not None and owner != self.student:
            raise LeftOut(f"it claims to be from {self.student!a} and belongs to {owner!a}", owner)


@contextmanager
def staged(submitted: Path) -> Iterator[Path]:
    """A folder to copy into, beside the students' ones, that is gone afterwards."""
    folder = Path(tempfile.mkdtemp(prefix=".collecting-", dir=submitted))
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def put(folder: Path, target: Path) -> None:
    """Put a folder that was copied whole in the place of an earlier one, if there is one, which goes with the stage."""
    target.parent.mkdir(parents=True, exist_ok=True)
    with suppress(FileNotFoundError):
        target.chmod(0o700)
        target.rename(folder.with_name("before"))
    folder.rename(target)


def as_utc(seconds: float) -> datetime.datetime:
    """A file's time, in UTC without a zone, as nbgrader has times."""
    return datetime.datetime.fromtimestamp(seconds, datetime.UTC).replace(tzinfo=None)


def time_told(folder: Path) -> datetime.datetime | None:
    """When a folder says that it was handed in, in UTC; None if it says nothing that is a time."""
    try:
        return parse_utc(text_of(folder / "timestamp.txt"))
    except Exception:  # dateutil raises many kinds for what is no date
        return None


def account(number: int) -> str:
    """The name of an account of this machine."""
    try:
        return pwd.getpwuid(number).pw_name
    except KeyError:
        return f"account {number}"
