"""From the zip that Moodle or Canvas gives an instructor to submitted/STUDENT/TOPIC: for `nbgrader zip_collect`.

    Moodle, in folders     Ada Lovelace_1234567_assignsubmission_file_/04_iou.ipynb
    Moodle, without        Ada Lovelace_1234567_assignsubmission_file_04_iou.ipynb
    Canvas                 lovelaceada_LATE_1234_567890_04_iou-2.ipynb

A student is named by name and number, since two may share a name: "Ada Lovelace_1234567", "lovelaceada_1234".
"""

import re
import unicodedata

from nbgrader.plugins import FileNameCollectorPlugin

MOODLE = re.compile(r"(?P<name>[^/\\]+)_(?P<number>\d+)_assignsubmission_file_?[/\\]?(?:.*[/\\])?(?P<file>[^/\\]+)$")
CANVAS = re.compile(r"(?:.*[/\\])?(?P<name>[^/\\_]+)(?:_LATE)?_(?P<number>\d+)_\d+_(?P<file>[^/\\]+)$")


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
        return {"student_id": whose[0], "file_id": whose[1]}
