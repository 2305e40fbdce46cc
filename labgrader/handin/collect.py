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
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path, PurePosixPath

from nbgrader.plugins import ExtractorPlugin, FileNameCollectorPlugin

from labgrader.handin.reading import LEFT_OUT, Lab, is_copy_of, read_lab
from labgrader.handin.several import OTHERS, SEVERAL, HandIn, the_later
from labgrader.program.notebook import LARGEST_FILE, LARGEST_NOTEBOOK, Unreadable, parse, readable
from labgrader.support import keep_closed

# A name may hold a line's end, which `.` takes in as well: else what a platform wrote would not be seen around it.
MOODLE = re.compile(r"(?P<name>[^_]+)_(?P<number>[0-9]+)_assignsubmission_(?:file|onlinetext)_?(?P<file>.*)", re.DOTALL)
CANVAS = re.compile(
    r"(?P<name>.+?)(?P<late>_LATE)?_(?P<number>[0-9]+)_"
    r"(?:(?P<upload>[0-9]+)_(?P<file>(?!assignsubmission_file).+)|(?P<text>(?:text|link)\.html.*))",
    re.DOTALL,
)
# What browsers and systems make of a notebook's name when they save it.
NOTEBOOK = re.compile(r"(.+)\.ipynb(?:\.json|\.txt)?", re.DOTALL | re.IGNORECASE)
HIDDEN = ("__MACOSX", ".ipynb_checkpoints")  # folders in which systems and editors keep copies
MOST_NOTEBOOKS = 20  # in a zip of a student's
MOST_NAMED = 3  # files of a student who handed in no notebook
MOST_OF_A_STUDENT = 2 * LARGEST_FILE  # bytes of notebooks, unpacked: two of the largest
MOST_OF_A_CLASS = 4 << 30  # of what is kept of them


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
                return found, found["file"] or found.groupdict().get("text") or ""
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
    """What was taken out of a platform's zips: notebooks, and what stands for a student without any."""
    folder = Path(course) / "downloaded" / topic / "extracted"
    return sorted(path for kind in ("*.ipynb", f"*.{LEFT_OUT}") for path in folder.rglob(kind))


def marked_late(course: Path, topic: str) -> dict[str, datetime.datetime]:
    """The students whose latest files Canvas marks as late, and by when that was: in UTC, when its zip was made."""
    found: dict[str, tuple[int, bool, datetime.datetime]] = {}
    for path in extracted(course, topic):
        mark, _ = read_name(path)
        if mark and mark.re is CANVAS:
            student, told = student_and_notebook(str(path))[0], time_of(path)
            now = datetime.datetime.now(datetime.UTC).replace(tzinfo=None)
            one = (int(mark["upload"] or 0), bool(mark["late"]), told or now)
            found[student] = max(one, found.get(student, one))
    return {student: by for student, (_, is_late, by) in found.items() if is_late}


def time_of(path: Path) -> datetime.datetime | None:
    """The time of a file in UTC, None for one that a zip said nothing of."""
    when = datetime.datetime.fromtimestamp(path.stat().st_mtime, datetime.UTC).replace(tzinfo=None, microsecond=0)
    return when if when.year > 1980 else None


def hand_in(path: Path) -> HandIn:
    """A file that was taken out of a zip, with what its platform tells of it: Moodle a time, Canvas a number."""
    found, name = read_name(path)
    if found is None:
        return HandIn(path, name)
    if found.re is MOODLE:
        return HandIn(path, name, when=time_of(path))
    return HandIn(path, name, number=int(found["upload"] or 0))


class LeftOut(Exception):
    """Why a file of a student's is not taken; in words of this module."""


@dataclass(frozen=True)
class Entry:
    """A file that a platform gave. path: with the usual ending; time: of the platform, 0 for none; read: its bytes."""

    path: PurePosixPath
    size: int
    time: float
    read: Callable[[], bytes]


class LmsExtractor(ExtractorPlugin):
    """Takes the notebooks out of a platform's zips, and out of zips that students handed in.

    What cannot be read, or is more than a student or a class may have, is named and left: nbgrader's own extractor
    stops at a student's broken zip, and never ends with one that holds itself. For a student without any notebook there
    is a text that says what came instead, so that no table lacks anybody. A file has the time of Moodle's entry, or of
    Canvas's zip, which is no earlier; 1970 for none.
    """

    def __init__(self, **options):
        super().__init__(**options)
        self.taken: Counter[str] = Counter()  # bytes by student
        self.kept = 0  # bytes of the class
        self.files: dict[str, list[str]] = {}  # their names by student
        self.first: dict[str, Path] = {}  # where the first one would lie
        self.left: dict[str, str] = {}  # by student why a file was left out

    def extract(self, archive_path: str, extracted_path: str) -> None:
        """Extract what is in a folder of zips, and what lies there without one: some browsers unpack what they load."""
        archive, target = Path(archive_path), Path(extracted_path)
        course = getattr(getattr(self.parent, "coursedir", None), "root", None)
        if course:  # nbgrader copies to submitted next
            (Path(course) / "submitted").mkdir(exist_ok=True)
            keep_closed(course)
        for path in sorted(path for path in archive.rglob("*") if path.is_file() and path.suffix.lower() != ".zip"):
            name = PurePosixPath(*(usual(part) for part in path.relative_to(archive).parts))
            self.take(Entry(name, path.stat().st_size, 0.0, path.read_bytes), target / "files")
        for path in sorted(archive.rglob("*.zip")):
            with zipfile.ZipFile(path) as packed:
                for entry in entries_of(packed):
                    is_canvas = CANVAS.fullmatch(entry.path.parts[0]) if entry.path.parts else None
                    entry = replace(entry, time=path.stat().st_mtime) if is_canvas else entry
                    self.take(entry, target / path.stem)
        for student, names in self.files.items():
            if student not in self.taken:
                self.log.warning("No notebook of %a, only %s", student, ", ".join(map(ascii, names[:MOST_NAMED])))
                said = f"no notebook was handed in, only {', '.join(names[:MOST_NAMED])}"
                said = f"{said}: {self.left[student]}" if student in self.left else said
                self.write(self.first[student], said.encode(), 0.0)

    def take(self, entry: Entry, folder: Path) -> None:
        """Write the notebook that a platform's file is, or those in the zip that it is; what is left out is named."""
        whose = student_and_notebook(str(entry.path))
        student = whose[0] if whose else str(entry.path)
        if whose:
            self.files.setdefault(student, []).append(read_name(entry.path)[1])
            self.first.setdefault(student, folder / place_of_stub(read_name(entry.path)[0]))
        try:
            self.take_notebooks(entry, student, folder)
        except Exception as error:  # of one student's file: the others' are extracted all the same
            why = (
                str(error)
                if isinstance(error, LeftOut | Unreadable)
                else f"it cannot be opened ({type(error).__name__})"
            )
            self.left[student] = why
            self.log.warning("Left out %a: %s", str(entry.path), why)

    def take_notebooks(self, entry: Entry, student: str, folder: Path) -> None:
        """Write the notebooks of a platform's file; raises LeftOut or Unreadable for what is not taken."""
        found = [entry]
        if entry.path.suffix == ".zip":
            if entry.size > LARGEST_FILE:
                raise LeftOut(f"it is a zip of more than {LARGEST_FILE >> 20} MB")
            with zipfile.ZipFile(io.BytesIO(entry.read())) as packed:
                inner = [one for one in entries_of(packed) if not set(HIDDEN) & set(one.path.parts)]
                found = [replace(one, path=entry.path / one.path.name, time=entry.time) for one in inner]
                return self.write_notebooks(found, student, folder)
        return self.write_notebooks(found, student, folder)

    def write_notebooks(self, found: Sequence[Entry], student: str, folder: Path) -> None:
        """Write those of some files that are notebooks, each under a name of its own."""
        notebooks = [one for one in found if one.path.suffix == ".ipynb" and not one.path.name.startswith(".")]
        notebooks = notebooks[:MOST_NOTEBOOKS]
        if any(one.path.is_absolute() or ".." in one.path.parts for one in notebooks):
            raise LeftOut("it names a place outside")
        size = sum(min(one.size, LARGEST_FILE + 1) for one in notebooks)
        if self.taken[student] + size > MOST_OF_A_STUDENT:
            whole, most = (self.taken[student] + size) / 2**20, MOST_OF_A_STUDENT >> 20
            raise LeftOut(f"with it the student's notebooks are {whole:.0f} MB unpacked, at most {most} MB are taken")
        for one in notebooks:
            data = one.read()
            data = data if len(data) <= LARGEST_NOTEBOOK else readable(data)
            if self.kept + len(data) > MOST_OF_A_CLASS:
                raise LeftOut(f"the class's notebooks are more than {MOST_OF_A_CLASS >> 30} GB; collect in parts")
            self.kept += len(data)
            self.taken[student] += min(one.size, LARGEST_FILE + 1)
            self.write(free_path(folder / one.path), data, one.time)

    def write(self, path: Path, data: bytes, time: float) -> None:
        """Write a file with a time."""
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
        os.utime(path, (time, time))


def entries_of(packed: zipfile.ZipFile) -> Iterator[Entry]:
    """The files in a zip; of one that is larger than a file may be, enough is read to say so."""
    for info in packed.infolist():
        when = datetime.datetime(*info.date_time) if info.date_time[0] > 1980 else None
        path = PurePosixPath(*(usual(part) for part in PurePosixPath(info.filename).parts))
        if not info.is_dir():
            yield Entry(path, info.file_size, when.timestamp() if when else 0.0, partial(content, packed, info))


def place_of_stub(mark: re.Match) -> str:
    """Where the text for a student without a notebook lies: `read_name` knows its student by the same words."""
    begin = mark.string[: mark.start("file")] if mark["file"] is not None else mark.string
    return f"{begin}/nothing.{LEFT_OUT}" if mark["file"] == "" else f"{begin}{(mark['file'] or '')[:20]}.{LEFT_OUT}"


def free_path(path: Path) -> Path:
    """The path, or one beside it that no file has yet: a student's zip may hold two notebooks of one name."""
    beside = (path.with_name(f"{path.stem} ({number}){path.suffix}") for number in range(2, 100))
    return next(one for one in (path, *beside) if not one.exists())


def usual(name: str) -> str:
    r"""The name of a file in a zip without signs that a terminal obeys, and with the ending that it was meant to have.

    >>> usual("04_iou.IPYNB"), usual("04_iou.ipynb.txt"), usual("lab.ZIP"), usual("04_iou\u202e.ipynb")
    ('04_iou.ipynb', '04_iou.ipynb', 'lab.zip', '04_iou.ipynb')
    """
    name = "".join(character for character in name if character.isprintable())
    if found := NOTEBOOK.fullmatch(name):
        return f"{found[1]}.ipynb"
    return name[:-4] + ".zip" if name.lower().endswith(".zip") else name


def content(packed: zipfile.ZipFile, entry: zipfile.ZipInfo) -> bytes:
    """The bytes of an entry; of one that is larger than a file may be, enough for the grader to say so."""
    with packed.open(entry) as file:
        return file.read(LARGEST_FILE + 1)


class LmsCollector(FileNameCollectorPlugin):
    """Tells nbgrader whose a file is, and where to put it: of several notebooks of one student see `several`."""

    @cached_property
    def planned(self) -> dict[Path, dict]:
        """What to say of each file that was extracted."""
        coursedir, found = self.parent.coursedir, {}
        whose: dict[str, list[Path]] = {}
        for path in extracted(coursedir.root, coursedir.assignment_id):
            if (named := student_and_notebook(str(path))) is not None:
                whose.setdefault(named[0], []).append(path)
        for student, paths in whose.items():
            for path, name in names_of(paths, coursedir).items():
                when = None if name.startswith(OTHERS) else hand_in(path).when
                found[path] = {"student_id": student, "file_id": name, "timestamp": f"{when} UTC" if when else None}
        return found

    def collect(self, submitted_file: str) -> dict | None:
        """Whose a file is and its name, None for a file that nobody can be named for."""
        return self.planned.get(Path(submitted_file))


def names_of(paths: Sequence[Path], coursedir) -> dict[Path, str]:
    """The names that one student's files get beside each other. coursedir: nbgrader's, of the course."""
    if len(paths) == 1:
        is_notebook = paths[0].suffix == ".ipynb"
        return {paths[0]: student_and_notebook(str(paths[0]))[1] if is_notebook else LEFT_OUT}
    handed_in = copies = [hand_in(path) for path in paths]
    with suppress(ValueError):  # the lab is not released here
        lab = read_lab(Path(coursedir.root), coursedir.assignment_id)
        copies = [one for one in handed_in if is_copy(one.path, lab)] or handed_in
    last, names = the_later(copies), {}
    for one in handed_in:
        folder = OTHERS if last or one not in copies else SEVERAL
        name = one.name if one == last else f"{folder}/{one.marked}"
        alike = list(names.values()).count(name)
        names[one.path] = f"{name.removesuffix('.ipynb')} ({alike + 1}).ipynb" if alike else name
    return names


def is_copy(path: Path, lab: Lab) -> bool:
    """Whether a file is a copy of a lab, whatever its name."""
    try:
        return is_copy_of(parse(path.read_bytes()), lab)
    except Unreadable:
        return False
