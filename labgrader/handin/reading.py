"""Reading a released lab, which is the instructor's, and submissions of it, which are anybody's.

A submission is bytes of a stranger: its place is looked at before it is opened, its size before it is read, how many
values it holds before it is parsed, and all that is taken from it is the source of its code cells, in their order, and
of the cells that carry one of the lab's grade ids, what it says of its release, and nbgrader's two texts beside it. Its
tests decide nothing, its points and its outputs are not looked at. Each file is read once, so that what is graded is
what is shown, whatever happens to the file meanwhile.
"""

import hashlib
import json
import os
import stat
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from labgrader.course import asked, of_topic
from labgrader.course import course as course_here
from labgrader.handin.astray import with_texts_astray
from labgrader.handin.pictures import Pictures, pictures_of
from labgrader.handin.roster import keys_of
from labgrader.handin.several import OTHERS, SEVERAL
from labgrader.program.cell import Cell, grade_id, source_of
from labgrader.program.notebook import LARGEST_FILE, Unreadable, code_of, no_code, parse

MOST_WRITTEN = 100_000  # characters of a written answer, fifty pages: pages show less
LONGEST_NAME = 220  # bytes: the names of a student's pages are longer, and no file's has more than 255
LONGEST_SHOWN = 60  # characters of a name that will not do
LONGEST_SAID = 200  # characters of what stands for a notebook
MOST_NAMED = 3  # files that are named in the place of one that is not there
BESIDE = ("timestamp.txt", "submission_secret.txt")  # nbgrader's
LEFT_OUT = "left_out.txt"  # stands for a student who handed in no notebook, and says what came instead
ODD_NAME = "odd-name-"
# What pages, scripts, shells, addresses, other file systems or spreadsheets would read as more than a letter of a name.
UNSAFE_IN_NAMES = frozenset('<>"`/\\:*?|;%')


@dataclass(frozen=True)
class Lab:
    """A released lab. answers: source of each blank by its grade id; points: what each is worth, by the same.

    written: grade ids of the answers that a person grades. tasks: what names each task as it was released. notebook:
    all of it, as JSON has it; digest: of the file.
    """

    topic: str
    answers: dict[str, str]
    points: dict[str, float]
    written: tuple[str, ...]
    tasks: dict[str, str]
    notebook: dict
    digest: str


@dataclass(frozen=True)
class Submission:
    """What a student handed in. code: all code cells; cells: source by grade id, of the answers and the written ones.

    reason: why it cannot be graded; "" if it can. outdated: tasks that were other ones in the lab that the student had,
    with the version of the kit that released it. timestamp and secret: what nbgrader's timestamp.txt and
    submission_secret.txt beside the notebook say; nbgrader gives feedback back by them. file: the notebook's name, if
    it is another one than the lab's. others: names of notebooks that were handed in beside it, and differ. no_code:
    what to say of answers whose cells are no code any more. lacks: answers in words without any cell. pictures: those
    attached to answers in words, by grade id.
    """

    student: str
    code: tuple[Cell, ...] = ()
    cells: dict[str, str] = field(default_factory=dict)
    reason: str = ""
    digest: str = "unreadable"
    outdated: dict[str, str] = field(default_factory=dict)
    timestamp: str = ""
    secret: str = ""
    file: str = ""
    others: tuple[str, ...] = ()
    no_code: dict[str, str] = field(default_factory=dict)
    lacks: tuple[str, ...] = ()
    pictures: dict[str, Pictures] = field(default_factory=dict)

    @property
    def note(self) -> str:
        """Which of several notebooks was graded, and which answers in words have no cell; "" for neither."""
        said = f"{', '.join(self.others[:MOST_NAMED])}{', ...' if len(self.others) > MOST_NAMED else ''}"
        notes = [f"of its notebooks {self.file} was graded, not {said}"] if self.others else []
        notes += [f"it has no cell {', '.join(self.lacks)} any more, for an answer in words"] if self.lacks else []
        return "; ".join(notes)


def read_lab(course: Path, topic: str) -> Lab:
    """Read course/labs/TOPIC/TOPIC.ipynb.

    Raises ValueError if it is not a released lab of that topic.
    """
    questions = of_topic(topic)
    path = Path(course) / "labs" / topic / f"{topic}.ipynb"
    if not path.is_file():
        mend = f"`{course_here().command} release {topic}` makes it"
        raise ValueError(f"topic: expected a released lab at {path}; {mend}")
    data = path.read_bytes()
    notebook = json.loads(data)
    for cell in notebook["cells"]:
        cell["source"] = source_of(cell)
    cells = {grade_id(cell): cell for cell in notebook["cells"] if grade_id(cell)}
    marks = {name: cell["metadata"]["nbgrader"] for name, cell in cells.items()}
    answers = {name: source_of(cells[name]) for name in marks if name in questions and marks[name].get("solution")}
    expected = released_by(notebook)[1] or asked(topic)  # a lab has the blanks that it was released with
    lacking = [name for name in expected if name not in answers or f"check_{name}" not in cells]
    if lacking:
        raise ValueError(f"{path}: expected an answer and tests of each question, lacks {', '.join(lacking)}")
    points = {name: float(marks[f"check_{name}"]["points"]) for name in answers}
    written = tuple(name for name, mark in marks.items() if mark.get("grade") and mark.get("solution"))
    digest = hashlib.sha256(data).hexdigest()
    return Lab(topic, answers, points, written, released_by(notebook)[1], notebook, digest)


def released_by(notebook: dict) -> tuple[str, dict[str, str]]:
    """The version of the kit that released a notebook, and what names its tasks; ("", {}) if it does not say.

    >>> released_by({"metadata": {course_here().metadata: {"version": "0.1.0", "tasks": {"iou": "5c0e"}}}})
    ('0.1.0', {'iou': '5c0e'})
    """
    try:
        mark = notebook["metadata"][course_here().metadata]
        version, tasks = str(mark["version"])[:20], dict(mark["tasks"])
    except (TypeError, KeyError, ValueError):
        return "", {}
    good = version.isascii() and version.isprintable() and all(isinstance(task, str) for task in tasks.values())
    return (version, tasks) if good else ("", {})


# -------------------------------------------------------------------------------------------------- submissions


def read_submissions(folder: Path, lab: Lab, picks: Mapping[str, str] | None = None) -> list[Submission]:
    """Read what is in a folder of students' folders, by their names; each file once.

    picks: by student the notebook that a person named (`several`). A student who handed in nothing of this topic is
    passed over, and so is what begins with a dot and holds nothing of it. What a student put there never raises;
    ValueError says that there is no such folder.
    """
    folder, picks = Path(folder), picks or {}
    if not folder.is_dir():
        raise ValueError(f"submissions: expected a folder of students' folders, got {folder}")
    names = sorted((entry.name for entry in os.scandir(folder)), key=os.fsencode)
    names = [name for name in names if not name.startswith(".") or os.path.isdir(folder / name / lab.topic)]
    read = [read_submission(folder / name, lab, pick_of(picks, name)) for name in names]
    return [submission for submission in read if submission is not None]


def pick_of(picks: Mapping[str, str], student: str) -> str:
    """The notebook that a person named for a student, "" for none."""
    return next((picks[key] for key in keys_of(student) if key in picks), "")


def read_submission(place: Path, lab: Lab, pick: str = "") -> Submission | None:
    """Read what a student's folder holds of a lab, None if it has no folder of it; never raises for what it holds."""
    student, digest = name_of(place.name), "unreadable"
    try:
        notebook = find_notebook(place, lab.topic, pick)
        if notebook is None:
            return None
        data = read_bytes(notebook, LARGEST_FILE)
        digest = hashlib.sha256(data).hexdigest()
        content = parse(data)
        if released_by(content)[0] in ("", released_by(lab.notebook)[0]):
            content["cells"] = with_texts_astray(content["cells"], lab.notebook["cells"], lab.written)
        other = "" if notebook.stem == lab.topic else printable(notebook.name)
        if other and not is_copy_of(content, lab):
            raise Unreadable(f"the folder {lab.topic} holds no {lab.topic}.ipynb, and {other} is no copy of that lab")
        code, cells = pick_cells(content["cells"], lab)
    except Unreadable as reason:
        return Submission(student, reason=str(reason), digest=digest)
    except Exception as error:  # of one student's folder: the others are read all the same
        why = getattr(error, "strerror", None) or type(error).__name__
        return Submission(student, reason=f"it cannot be opened: {why}", digest=digest)
    folder = place / lab.topic
    beside = text_of(folder / "timestamp.txt"), text_of(folder / "submission_secret.txt")
    others = () if pick else others_of(folder, notebook, data)
    file = printable(notebook.name) if others else other
    pictures = pictures_of(content["cells"], lab.written)
    lacks = tuple(name for name in lab.written if name not in cells)
    told = outdated(content, lab), *beside, file, others, no_code(content["cells"]), lacks, pictures
    return Submission(student, code, cells, "", digest, *told)


def others_of(folder: Path, notebook: Path, data: bytes) -> tuple[str, ...]:
    """The names of the notebooks that were handed in beside the one that is graded; copies of it are not named."""
    found = [path for path in notebooks_in(folder, OTHERS) if path != notebook]
    return tuple(printable(path.name) for path in found if not is_same(path, data))


def is_same(path: Path, data: bytes) -> bool:
    """Whether a file has these bytes; False if it cannot be read."""
    try:
        return read_bytes(path, len(data)) == data
    except (OSError, Unreadable):
        return False


def notebooks_in(folder: Path, *inner: str) -> list[Path]:
    """The notebooks in a folder, and in some folders in it, by their names; follows no link."""
    places = [folder, *(folder / name for name in inner)]
    there = [place for place in places if stat.S_ISDIR(mode_of(place) or 0)]
    names = [(place, sorted(entry.name for entry in os.scandir(place))) for place in there]
    return [place / name for place, some in names for name in some if name.endswith(".ipynb") and name[0] != "."]


def outdated(notebook: dict, lab: Lab) -> dict[str, str]:
    """The tasks that were other ones in the notebook that a student got, with the version that released it."""
    version, tasks = released_by(notebook)
    return {name: version for name in lab.answers if name in tasks and tasks[name] != lab.tasks.get(name)}


def text_of(path: Path) -> str:
    """The text of a small file beside a notebook, "" if there is none that can be read."""
    try:
        return read_bytes(path, 200).decode().strip()
    except (OSError, UnicodeDecodeError, Unreadable):
        return ""


def find_notebook(place: Path, topic: str, pick: str = "") -> Path | None:
    """The notebook in a student's folder, None if there is no folder of this topic; follows no link.

    Where none has the lab's name and there is one notebook alone, it is that one. pick: its name, if a person chose it.
    """
    if not is_folder(place, "the student's folder"):
        raise Unreadable(f"not in a student's folder; expected STUDENT/{topic}/{topic}.ipynb")
    if fault := fault_of(place.name):
        raise Unreadable(f"rename the student's folder {printable(place.name)}: {fault}")
    if not is_folder(place / topic, f"the folder {topic}"):
        return None
    if pick:
        return picked(place / topic, pick)
    several, there = notebooks_in(place / topic, SEVERAL), notebooks_in(place / topic)
    notebook = place / topic / f"{topic}.ipynb"
    if len(several) > len(there):
        raise Unreadable(f"it is not known which of {listed(several)} is the later one: {NAME_ONE}")
    if mode_of(notebook) is None:
        if len(there) != 1:
            raise Unreadable(why_none(place / topic, there))
        notebook = there[0]
    refuse_odd(notebook)
    return notebook


NAME_ONE = "name the one to be graded in [[notebook]] of course.toml"


def picked(folder: Path, pick: str) -> Path:
    """The notebook of a student's that a person named, with or without what a platform tells before its name."""
    there = notebooks_in(folder, OTHERS, SEVERAL)
    found = [path for path in there if path.name == pick] or [path for path in there if path.name.endswith(f", {pick}")]
    if len(found) != 1:
        said = "none" if not found else f"{len(found)} of them"
        raise Unreadable(f"[[notebook]] of course.toml names {pick}, which {said} of {listed(there)} is")
    refuse_odd(found[0])
    return found[0]


def why_none(folder: Path, there: Sequence[Path]) -> str:
    """Why no notebook of a folder is graded."""
    if not there and (said := text_of(folder / LEFT_OUT)):
        return printable(said, LONGEST_SAID)
    names = there or [path for path in sorted(folder.iterdir()) if path.name[0] != "." and path.name not in BESIDE]
    mend = f"it holds {listed(names)}; {NAME_ONE if there else 'expected a notebook'}" if names else "it is empty"
    return f"the folder {folder.name} holds no {folder.name}.ipynb: {mend}"


def listed(paths: Sequence[Path]) -> str:
    """The first names of some files."""
    return ", ".join([printable(path.name) for path in paths[:MOST_NAMED]] + ["..."] * (len(paths) > MOST_NAMED))


def refuse_odd(notebook: Path) -> None:
    """Raise Unreadable for what is no file."""
    mode = mode_of(notebook)
    if mode is None or not stat.S_ISREG(mode):
        what = "no file" if mode is None or not stat.S_ISLNK(mode) else "a symbolic link"
        raise Unreadable(f"{printable(notebook.name)} is {what}")


def printable(name: str, most: int = LONGEST_SHOWN) -> str:
    """The beginning of a stranger's name for a file, as a table and a terminal may show it."""
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in name[:most])


def is_copy_of(notebook: dict, lab: Lab) -> bool:
    """Whether a notebook is the lab by its own mark or by its cells' grade ids, whatever the file's name."""
    tasks = released_by(notebook)[1]
    if tasks and lab.tasks:  # labs may call their texts alike
        return bool(tasks.keys() & lab.tasks.keys())
    ids = {name for name in map(grade_id, notebook["cells"]) if name}
    return bool(ids & {*lab.answers, *lab.written})


def fault_of(name: str) -> str:
    """What of a folder's name would not do in a page, a table, a terminal or as a file; "" if it may name a student.

    >>> fault_of("Zoë O'Brien & Co."), fault_of("two\\nlines")
    ('', "it holds '\\\\n'")
    """
    for character in name:
        if character in UNSAFE_IN_NAMES or not character.isprintable():
            return f"it holds {character!a}"
    if name != name.strip():
        return "it begins or ends with a space"
    if name.startswith((".", ODD_NAME)):
        return f"it begins with {'a dot' if name[0] == '.' else ODD_NAME}"
    size = len(os.fsencode(name))
    return f"it is {size} bytes long, at most {LONGEST_NAME} are possible" if size > LONGEST_NAME else ""


def name_of(name: str) -> str:
    """A student's name: the folder's, or one that is made of an odd one's bytes, so that no two are the same."""
    return ODD_NAME + hashlib.sha256(os.fsencode(name)).hexdigest()[:12] if fault_of(name) else name


def is_folder(path: Path, what: str) -> bool:
    """Whether there is a folder; a link in its place is Unreadable."""
    mode = mode_of(path)
    if mode is not None and stat.S_ISLNK(mode):
        raise Unreadable(f"{what} is a symbolic link")
    return mode is not None and stat.S_ISDIR(mode)


def mode_of(path: Path) -> int | None:
    """Kind of what is at a path, a link itself; None if there is nothing."""
    try:
        return os.lstat(path).st_mode
    except FileNotFoundError:
        return None


def read_bytes(path: Path, most: int) -> bytes:
    """Read a file that is no link and no longer than it may be."""
    flags = os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
    with open(os.open(path, flags), "rb") as file:
        data = file.read(most + 1)
    if len(data) > most:
        raise Unreadable(f"it is larger than {most >> 20} MB")
    return data


def pick_cells(cells: list, lab: Lab) -> tuple[tuple[Cell, ...], dict[str, str]]:
    """The code cells, and by grade id the sources that the lab asks for; where several have one, all of them.

    Those of answers are code, which has a limit for all cells; what a person grades is cut where it is very long.
    """
    code = tuple(code_of(cells))
    texts = {name: {} for name in (*lab.answers, *lab.written)}
    for cell in cells:
        name = grade_id(cell)
        if name in texts and (text := source_of(cell)) is not None:
            is_kept = name in lab.written or cell.get("cell_type") == "code"
            texts[name][text if is_kept else ""] = None
    if not any(texts.values()) and not any(f"def {name}" in cell.source for name in lab.answers for cell in code):
        raise Unreadable(f"it is not this lab: no cell has a grade id of {lab.topic}")
    for cell in lab.notebook["cells"]:  # what nobody changed is no part of an answer in words
        if (name := grade_id(cell)) in lab.written and len(texts[name]) > 1:
            texts[name].pop(source_of(cell), None)
    whole = {name: "\n\n".join(filter(None, found)) for name, found in texts.items() if found}
    return code, {name: text if name in lab.answers else text[:MOST_WRITTEN] for name, text in whole.items()}
