"""From the zip that Moodle or Canvas gives an instructor to submitted/STUDENT/TOPIC: for `nbgrader zip_collect`.

    Moodle, in folders     Ada Lovelace_1234567_assignsubmission_file_/04_iou.ipynb
    Moodle, without        Ada Lovelace_1234567_assignsubmission_file_04_iou.ipynb
    Canvas                 lovelaceada_LATE_1234_567890_04_iou-2.ipynb

A student is named by name and number, since two may share a name: "Ada Lovelace_1234567", "lovelaceada_1234".
Moodle's zip tells when each file was handed in; Canvas's only which are late. Moodle writes no underscore into a name,
and Canvas none beside a number, so these words can be read in one way only. What follows them, or lies in a zip that a
student handed in, has names of the student's making, which may look like another student's: they name nobody.

What lies in a zip is measured before it is unpacked, by the sizes that its directory states: `zipfile` reads no more of
an entry than that.
"""

import datetime
import io
import os
import re
import unicodedata
import zipfile
from collections import Counter
from pathlib import Path, PurePosixPath

from nbgrader.plugins import ExtractorPlugin, FileNameCollectorPlugin

from labgrader.program.notebook import LARGEST_NOTEBOOK
from labgrader.support import keep_closed

# A name may hold a line's end, which `.` takes in as well: else what a platform wrote would not be seen around it.
MOODLE = re.compile(r"(?P<name>[^_]+)_(?P<number>[0-9]+)_assignsubmission_file_?(?P<file>.*)", re.DOTALL)
CANVAS = re.compile(
    r"(?P<name>.+?)(?P<late>_LATE)?_(?P<number>[0-9]+)_[0-9]+_(?P<file>(?!assignsubmission_file).+)", re.DOTALL
)
# What browsers and systems make of a notebook's name when they save it.
NOTEBOOK = re.compile(r"(.+)\.ipynb(?:\.json|\.txt)?", re.DOTALL | re.IGNORECASE)
MOST_NOTEBOOKS = 20  # in a zip of a student's
MOST_NAMED = 3  # files of a student who handed in no notebook
MOST_OF_A_STUDENT = 40 << 20  # bytes of notebooks, unpacked: two of the largest
MOST_OF_A_CLASS = 4 << 30


def read_name(path: str | Path) -> tuple[re.Match | None, str]:
    """What a platform says in a file's name or in that of a folder around it, None if nothing; and the file's own name.

    path: ../extracted/ARCHIVE/..; the outermost name in it that a platform could have written counts.
    """
    parts = Path(path).parts
    if "extracted" in parts:
        parts = parts[parts.index("extracted") + 2 :]
    for depth, part in enumerate(parts, 1):
        if found := MOODLE.fullmatch(part) or CANVAS.fullmatch(part):
            if depth == len(parts):
                return found, found["file"]
            is_platforms = not found["file"] or found["file"].endswith(".zip")
            return found if is_platforms else None, parts[-1]
    return None, parts[-1]


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


def extracted(course: Path, topic: str) -> list[Path]:
    """The notebooks that were taken out of a platform's zips."""
    return sorted((Path(course) / "downloaded" / topic / "extracted").rglob("*.ipynb"))


def marked_late(course: Path, topic: str) -> set[str]:
    """The students whose files Canvas marks as late."""
    found = set()
    for path in extracted(course, topic):
        mark, _ = read_name(path)
        if mark and mark.re is CANVAS and mark["late"]:
            found.add(student_and_notebook(str(path))[0])
    return found


def handed_in(path: Path) -> str:
    """When a file from Moodle's zip was handed in, as the zip says in local time; "" if it does not."""
    found, _ = read_name(path)
    when = datetime.datetime.fromtimestamp(path.stat().st_mtime, datetime.UTC)
    is_told = found is not None and found.re is MOODLE and when.year > 1980
    return f"{when:%Y-%m-%d %H:%M:%S} UTC" if is_told else ""


class LeftOut(Exception):
    """Why a file of a student's is not taken; in words of this module."""


class LmsExtractor(ExtractorPlugin):
    """Takes the notebooks out of a platform's zips, and out of zips that students handed in.

    What cannot be read, or is more than a student or a class may have, is named and left: nbgrader's own extractor
    stops at a student's broken zip, and never ends with one that holds itself. Students without any notebook are named,
    too. A file has the time of the platform's entry, 1970 for none.
    """

    def __init__(self, **options):
        super().__init__(**options)
        self.taken: Counter[str] = Counter()  # bytes by student
        self.files: dict[str, list[str]] = {}  # their names by student

    def extract(self, archive_path: str, extracted_path: str) -> None:
        """Extract what is in a folder of zips; notebooks that lie there without a zip are copied."""
        archive, target = Path(archive_path), Path(extracted_path)
        course = getattr(getattr(self.parent, "coursedir", None), "root", None)
        if course:  # nbgrader copies to submitted next
            (Path(course) / "submitted").mkdir(exist_ok=True)
            keep_closed(course)
        for path in archive.rglob("*.ipynb"):
            self.write(target / "files" / path.relative_to(archive), path.read_bytes(), 0.0)
        for path in sorted(archive.rglob("*.zip")):
            with zipfile.ZipFile(path) as packed:
                for entry in packed.infolist():
                    try:
                        self.take(packed, entry, target / path.stem)
                    except Exception as error:  # of one student's file: the others' are extracted all the same
                        why = str(error) if isinstance(error, LeftOut) else type(error).__name__
                        self.log.warning("Left out %a: %s", entry.filename, why)
        for student, names in self.files.items():
            if student not in self.taken:
                self.log.warning("No notebook of %a, only %s", student, ", ".join(map(ascii, names[:MOST_NAMED])))

    def take(self, packed: zipfile.ZipFile, entry: zipfile.ZipInfo, folder: Path) -> None:
        """Write the notebook that an entry of a platform's zip is, or those in the zip that it is."""
        path, when = PurePosixPath(usual(entry.filename)), datetime.datetime(*entry.date_time)
        whose = student_and_notebook(str(path))
        student, found = whose[0] if whose else str(path), {path: entry}
        if whose and not entry.is_dir():
            self.files.setdefault(student, []).append(path.name)
        if path.suffix == ".zip":
            if entry.file_size > LARGEST_NOTEBOOK:
                raise LeftOut(f"it is a zip of more than {LARGEST_NOTEBOOK >> 20} MB")
            packed = zipfile.ZipFile(io.BytesIO(content(packed, entry)))
            found = {path / PurePosixPath(usual(inner.filename)).name: inner for inner in packed.infolist()}
        notebooks = [place for place in found if place.suffix == ".ipynb" and not place.name.startswith(".")]
        notebooks = notebooks[:MOST_NOTEBOOKS]
        if any(place.is_absolute() or ".." in place.parts for place in notebooks):
            raise LeftOut("it names a place outside")
        if notebooks:
            self.count(student, sum(size_of(found[place]) for place in notebooks))
        for place in notebooks:
            self.write(folder / place, content(packed, found[place]), when.timestamp() if when.year > 1980 else 0.0)

    def count(self, student: str, size: int) -> None:
        """Count bytes that a student is about to take; LeftOut says that they are too many."""
        whole = self.taken[student] + size
        if whole > MOST_OF_A_STUDENT:
            most = f"at most {MOST_OF_A_STUDENT >> 20} MB of a student are taken"
            raise LeftOut(f"with it the student's notebooks are {whole / 2**20:.0f} MB unpacked, {most}")
        if self.taken.total() + size > MOST_OF_A_CLASS:
            raise LeftOut(f"the class's notebooks are more than {MOST_OF_A_CLASS >> 30} GB unpacked; collect in parts")
        self.taken[student] = whole

    def write(self, path: Path, data: bytes, time: float) -> None:
        """Write a file with a time."""
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
        os.utime(path, (time, time))


def usual(name: str) -> str:
    r"""The name of a file in a zip without signs that a terminal obeys, and with the ending that it was meant to have.

    >>> usual("04_iou.IPYNB"), usual("04_iou.ipynb.txt"), usual("lab.ZIP"), usual("04_iou\u202e.ipynb")
    ('04_iou.ipynb', '04_iou.ipynb', 'lab.zip', '04_iou.ipynb')
    """
    name = "".join(character for character in name if character.isprintable())
    if found := NOTEBOOK.fullmatch(name):
        return f"{found[1]}.ipynb"
    return name[:-4] + ".zip" if name.lower().endswith(".zip") else name


def size_of(entry: zipfile.ZipInfo) -> int:
    """How many bytes `content` may read of an entry."""
    return min(entry.file_size, LARGEST_NOTEBOOK + 1)


def content(packed: zipfile.ZipFile, entry: zipfile.ZipInfo) -> bytes:
    """The bytes of an entry; of one that is larger than a notebook may be, enough for the grader to say so."""
    with packed.open(entry) as file:
        return file.read(LARGEST_NOTEBOOK + 1)


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
