"""What students get, as one zip: lessons, labs, the kit that runs them, and a page on which they begin.

    bundle(course, "course.zip")                 everything
    bundle(course, "week.zip", ["04_iou"])       this lab, its lessons, and the kit

The solutions, which hold the model answers, and the tests stay with the instructor. Of what lies in the folders that
students get, only what git tracks is taken, where there is a repository: no draft, no key that was written there. A
link is left out, wherever it leads, and so is what bears the marks of a solution, a rubric or a key. The references of
the questions are there, since a check needs them: of some topics' bundle up to the last of these.
"""

import io
import os
import re
import zipfile
from collections.abc import Callable, Collection, Sequence
from pathlib import Path
from typing import NamedTuple

from labgrader.course import course as course_here
from labgrader.course import is_taught, taught_rows
from labgrader.course import topics as all_topics
from labgrader.release.publishing import ABSOLUTE, owner_and_name, texts, unpublished
from labgrader.release.release import START, read_notebook, release, start_page, to_bytes
from labgrader.support import PRIVATE, git, write_atomically

LINK = re.compile(r"!?\[([^\[\]]*)\]\(([^)\s#]+)(?:#[^)\s]*)?\)")

# What a file that students get does not hold, and what it would be.
MARKS = {
    b"### BEGIN SOLUTION": "a solution",
    b"### BEGIN HIDDEN TESTS": "hidden tests",
    b"**Rubric": "a rubric",
    b"Not for students": "a key",
}


class Chosen(NamedTuple):
    """What students get of a course: contents by name, what was left out and why, and whether there is a repository."""

    contents: dict[str, bytes]
    left_out: dict[str, str]
    tracked: bool


class Bundle(NamedTuple):
    """What is in a zip, by names in order; what was left out that lies beside it, and why.

    tracked: whether there is a repository, whose files alone were taken.
    """

    names: list[str]
    left_out: dict[str, str]
    tracked: bool


def bundle(course: Path, target: Path, topics: Sequence[str] = ()) -> Bundle:
    """Write a zip of what students get, in a folder of its name.

    topics: whose lessons and labs; all if none is given, and then the guides are there, too. The same course gives the
    same bytes. Raises ValueError if a topic is not there, or the labs are not as the solutions make them.
    """
    target, chosen = Path(target), for_students(course, topics)
    archived = io.BytesIO()
    with zipfile.ZipFile(archived, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(chosen.contents):
            entry = zipfile.ZipInfo(f"{target.stem}/{name}", date_time=(1980, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = (0o755 if os.access(Path(course) / name, os.X_OK) else 0o644) << 16
            archive.writestr(entry, chosen.contents[name])
    write_atomically(target, archived.getvalue())
    return Bundle(sorted(chosen.contents), chosen.left_out, chosen.tracked)


def for_students(course: Path, topics: Sequence[str] = (), change: Callable = unpublished) -> Chosen:
    """What students get of a course, as `bundle` says it; raises ValueError as that does.

    change: (notebook, name, course) -> the notebook as they get it. By default its links lead to the files beside it,
    wherever the course is published. Of a link to what they do not get, only the words stay.
    """
    course, here = Path(course), course_here()
    if drift := release(course, topics, check=True):
        raise ValueError(f"course: run `{here.command} release` first, {drift[0]} is not what it makes")
    why, is_tracked = looked_through(course, here.bundle)
    why = {name: said for name, said in why.items() if of(topics, name)}
    kept = [name for name, said in why.items() if not said]
    contents = {name: (course / name).read_bytes() for name in kept}
    contents |= dict.fromkeys((START, "README.md"), start_page(course, topics).encode()) if here.start else {}
    for name, data in contents.items():
        if name.endswith(".md"):
            contents[name] = without_dead_links(name, taught_rows(data.decode("utf-8")), contents).encode()
        if name.endswith(".ipynb"):
            notebook = change(read_notebook(course / name), name, course)
            for cell in texts(notebook):
                cell["source"] = without_dead_links(name, cell["source"], contents)
            contents[name] = to_bytes(notebook)
    return Chosen(contents, {name: said for name, said in why.items() if said}, is_tracked)


def without_dead_links(name: str, text: str, names: Collection[str]) -> str:
    """The text of a page or cell of the file `name`; of a link that leads to none of the files `names`, the words stay.

    >>> without_dead_links("docs/a.md", "[a](b.md#c), [d](../e.md), [f](https://f.example), [g](#g)", ["docs/b.md"])
    '[a](b.md#c), d, [f](https://f.example), [g](#g)'
    """
    ours = f"/{owner_and_name(course_here())}/"

    def mend(match: re.Match) -> str:
        target = match[2]
        if ours != "//" and ours in target:
            target = ABSOLUTE.sub(r"/\2", f"]({target}").removeprefix("](")
        if re.match(r"\w+:|#", target):
            return match[0]
        path = os.path.normpath(Path(name).parent / target if target[0] != "/" else target[1:]).replace(os.sep, "/")
        return match[0] if path in names or any(other.startswith(f"{path}/") for other in names) else match[1]

    return LINK.sub(mend, text)


def looked_through(course: Path, places: Sequence[str]) -> tuple[dict[str, str], bool]:
    """By the name of each file in some folders why students do not get it, "" if they do; and as `Bundle.tracked`.

    What the course withholds, and what running leaves behind, is not named.
    """
    found = [path for name in places for path in (course / name, *(course / name).rglob("*"))]
    names = {path.relative_to(course).as_posix() for path in found if path.is_symlink() or path.is_file()}
    tracked = tracked_files(course)
    wanted = sorted(name for name in names if not (is_withheld(name) or is_left_over(name)))
    return {name: reason_against(course, name, tracked) for name in wanted}, tracked is not None


def tracked_files(course: Path) -> set[str] | None:
    """The files of a course's folder that git tracks, None where there is no repository.

    Raises ValueError where there is one that git does not read, such as another account's: nothing is known of it then.
    """
    try:
        done = git(course, "ls-files", "-z")
        status, said = done.returncode, done.stderr.decode(errors="replace").strip()
    except OSError as error:
        status, said = 1, f"git: {error.strerror}"
    if not status:
        return set(os.fsdecode(done.stdout).split("\0")) - {""}
    place = course.resolve()
    if any(os.path.lexists(folder / ".git") for folder in (place, *place.parents)):
        raise ValueError(f"course: expected what git tracks of {place}, got {said}")
    return None


def reason_against(course: Path, name: str, tracked: set[str] | None) -> str:
    """Why students do not get a file of the folders that they get, "" if they do."""
    path = course / name
    if path.resolve() != course.resolve() / name:
        return "a link"
    if tracked is not None and name not in tracked:
        return "git does not track it"
    data = path.read_bytes()
    if name.endswith(".py") and name.partition("/")[0] in course_here().kit:  # which writes those marks, in its texts
        data = b"\n".join(line.strip() for line in data.splitlines() if line.strip().startswith(tuple(MARKS)))
    if found := next((what for mark, what in MARKS.items() if mark in data), ""):
        return f"{found}, by its marks"
    if name.endswith(".ipynb") and not name.startswith("labs/"):
        marks = (cell.metadata.get("nbgrader", {}) for cell in read_notebook(path).cells)
        return "a notebook with solution cells" if any(mark.get("solution") for mark in marks) else ""
    return ""


def is_withheld(name: str) -> bool:
    """Whether the course withholds a file, or a folder that it is in."""
    return any(name == kept or name.startswith(f"{kept}/") for kept in course_here().withheld)


def of(topics: Sequence[str], name: str) -> bool:
    """Whether a file belongs to some topics: files of lessons and labs begin with their number, guides are of none.

    Questions of earlier topics belong to them, too: a student may still work on those.

    >>> [of(["04_iou"], f"lessons/{name}") for name in ("04_iou_edges.ipynb", "07_grasp.ipynb", "schematics/04_a.svg")]
    [True, False, True]
    """
    folder, _, rest = name.partition("/")
    numbers = {topic[:2] for topic in topics}
    if questions := re.match(rf"{course_here().questions.replace('.', '/')}/t(\d\d)_", name):
        return not topics or questions[1] <= max(numbers)
    number = re.match(r"(?:schematics/)?(\d\d)_", rest)
    if folder not in ("lessons", "labs", "docs"):
        return True
    if number is not None and not is_taught(f"{number[1]}_"):
        return False
    return not topics or (number is not None and number[1] in numbers)


def is_left_over(name: str) -> bool:
    """Whether a file is one that running, editing or grading leaves behind.

    >>> [is_left_over(name) for name in ("a/__pycache__/b", "a/.ipynb_checkpoints/b.ipynb", "README.md", "roster.csv")]
    [True, True, False, True]
    """
    parts = name.split("/")
    if name.startswith(tuple(private.rstrip("*") for private in PRIVATE)):
        return True
    return any(part.startswith(".") or part == "__pycache__" or part.endswith(".egg-info") for part in parts)


def topics_of_week(week: int) -> tuple[str, ...]:
    """The topics of a week of the syllabus, from 1: the course's `weeks`, or one a week; ValueError for another."""
    weeks = course_here().weeks or tuple((topic,) for topic in all_topics())
    if not 1 <= week <= len(weeks):
        raise ValueError(f"week: expected 1 to {len(weeks)}, got {week}")
    return tuple(weeks[week - 1])
