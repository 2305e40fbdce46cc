"""From the zip that Moodle or Canvas gives an instructor to submitted/STUDENT/TOPIC: for `nbgrader zip_collect`.

    Moodle, in folders     Ada Lovelace_1234567_assignsubmission_file_/04_iou.ipynb
    Moodle, without        Ada Lovelace_1234567_assignsubmission_file_04_iou.ipynb
    Canvas                 lovelaceada_LATE_1234_567890_04_iou-2.ipynb

A student is named by name and number, since two may share a name: "Ada Lovelace_1234567", "lovelaceada_1234".
Moodle's zip tells when each file was handed in; Canvas's only which are late. What follows these words is the name that
the student gave the file, which may look like another student's or the other platform's: the platform's words come
first, and count.
"""

import datetime
import re
import unicodedata
import zipfile
from pathlib import Path

from nbgrader.plugins import FileNameCollectorPlugin

MOODLE = re.compile(r"(?P<name>.+?)_(?P<number>\d+)_assignsubmission_file_?(?P<file>.*)")
CANVAS = re.compile(r"(?P<name>[^_]+)(?P<late>_LATE)?_(?P<number>\d+)_\d+_(?P<file>.+)")


def read_name(path: str | Path) -> tuple[re.Match | None, str]:
    """What a platform says in a file's name or in that of a folder around it, None if nothing; and the file's own name.

    Canvas comes first for a file: no name of Moodle's has its two numbers.
    """
    *folders, last = Path(path).parts
    for folder in folders:
        if (found := MOODLE.fullmatch(folder)) and not found["file"]:
            return found, last
    found = CANVAS.fullmatch(last) or MOODLE.fullmatch(last)
    return found, found["file"] if found else last


def student_and_notebook(path: str) -> tuple[str, str] | None:
    """The student and the notebook's name, by the name that a file has in a learning platform's zip; None if by none.

    >>> student_and_notebook("extracted/all/Ada Lovelace_1234567_assignsubmission_file_/04_iou.ipynb")
    ('Ada Lovelace_1234567', '04_iou.ipynb')
    >>> student_and_notebook("extracted/all/lovelaceada_LATE_1234_567890_04_iou-2.ipynb")
    ('lovelaceada_1234', '04_iou.ipynb')
    """
    found, file = read_name(path)
    if found is None:
        return None
    notebook = re.sub(r"(?: ?\(\d+\)|-\d+)(?=\.ipynb$)", "", file)  # of a file handed in, or saved, again
    return f"{unicodedata.normalize('NFC', found['name'])}_{found['number']}", notebook


def marked_late(course: Path, topic: str) -> set[str]:
    """The students whose files Canvas marks as late."""
    found = set()
    for path in (Path(course) / "downloaded" / topic).rglob("*.ipynb"):
        mark, _ = read_name(path)
        if mark and mark.re is CANVAS and mark["late"]:
            found.add(student_and_notebook(str(path))[0])
    return found


def handed_in(path: Path) -> str:
    """When a file in an extracted zip of Moodle's was handed in, as the zip says in local time; "" if it does not."""
    folder = next((parent for parent in path.parents if parent.name == "extracted"), None)
    found, _ = read_name(path)
    if folder is None or found is None or found.re is not MOODLE:
        return ""
    archive, *parts = path.relative_to(folder).parts
    try:
        with zipfile.ZipFile(folder.with_name("archive") / f"{archive}.zip") as packed:
            stamp = packed.getinfo("/".join(parts)).date_time
        when = datetime.datetime(*stamp).astimezone(datetime.UTC)
    except (OSError, KeyError, ValueError, zipfile.BadZipFile):
        return ""
    return f"{when:%Y-%m-%d %H:%M:%S} UTC" if when.year > 1980 else ""  # of a zip without times


class LmsCollector(FileNameCollectorPlugin):
    """Tells nbgrader whose a file is. Of two notebooks of one student the first counts: the other is named and left."""

    def __init__(self, **options):
        super().__init__(**options)
        self.seen: set[tuple[str, str]] = set()

    def collect(self, submitted_file: str) -> dict | None:
        """Whose a file is and which notebook, None for a file that is no notebook or that nobody can be named for."""
        whose = student_and_notebook(submitted_file) if submitted_file.endswith(".ipynb") else None
        if whose is None or whose in self.seen:
            return None
        self.seen.add(whose)
        return {"student_id": whose[0], "file_id": whose[1], "timestamp": handed_in(Path(submitted_file)) or None}
