"""From the zip that Moodle or Canvas gives an instructor to submitted/STUDENT/TOPIC: for `nbgrader zip_collect`.

    Moodle, in folders     Ada Lovelace_1234567_assignsubmission_file_/04_iou.ipynb
    Moodle, without        Ada Lovelace_1234567_assignsubmission_file_04_iou.ipynb
    Canvas                 lovelaceada_LATE_1234_567890_04_iou-2.ipynb

A student is named by name and number, since two may share a name: "Ada Lovelace_1234567", "lovelaceada_1234".
Moodle's zip tells when each file was handed in; Canvas's only which are late.
"""

import datetime
import re
import unicodedata
import zipfile
from pathlib import Path

from nbgrader.plugins import FileNameCollectorPlugin

MOODLE = re.compile(r"(?P<name>[^/\\]+)_(?P<number>\d+)_assignsubmission_file_?[/\\]?(?:.*[/\\])?(?P<file>[^/\\]+)$")
CANVAS = re.compile(r"(?:.*[/\\])?(?P<name>[^/\\_]+)(?P<late>_LATE)?_(?P<number>\d+)_\d+_(?P<file>[^/\\]+)$")


def student_and_notebook(path: str) -> tuple[str, str] | None:
    """The student and the notebook's name, by the name that a file has in a learning platform's zip; None if by none.

    >>> student_and_notebook("extracted/all/Ada Lovelace_1234567_assignsubmission_file_/04_iou.ipynb")
    ('Ada Lovelace_1234567', '04_iou.ipynb')
    >>> student_and_notebook("extracted/all/lovelaceada_LATE_1234_567890_04_iou-2.ipynb")
    ('lovelaceada_1234', '04_iou.ipynb')
    """
    found = MOODLE.search(path) or CANVAS.match(path)
    if found is None:
        return None
    notebook = re.sub(r"(?: ?\(\d+\)|-\d+)(?=\.ipynb$)", "", found["file"])  # of a file handed in, or saved, again
    return f"{unicodedata.normalize('NFC', found['name'])}_{found['number']}", notebook


def marked_late(course: Path, topic: str) -> set[str]:
    """The students whose files Canvas marks as late."""
    found = set()
    for path in (Path(course) / "downloaded" / topic).rglob("*.ipynb"):
        mark = CANVAS.match(str(path))
        if not MOODLE.search(str(path)) and mark and mark["late"]:
            found.add(student_and_notebook(str(path))[0])
    return found


def handed_in(path: Path) -> str:
    """When a file in an extracted zip of Moodle's was handed in, as the zip says in local time; "" if it does not."""
    folder = next((parent for parent in path.parents if parent.name == "extracted"), None)
    if folder is None or not MOODLE.search(str(path)):
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
