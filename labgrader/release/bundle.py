"""What students get, as one zip: lessons, labs, the kit that runs them, and a page on which they begin.

    bundle(course, "course.zip")                 everything
    bundle(course, "week.zip", ["04_iou"])       this lab, its lessons, and the kit

The solutions, which hold the model answers, and the tests stay with the instructor.
"""

import io
import os
import re
import zipfile
from collections.abc import Sequence
from pathlib import Path

from labgrader.course import course as course_here
from labgrader.course import is_taught, taught_rows
from labgrader.course import topics as all_topics
from labgrader.release.publishing import unpublished
from labgrader.release.release import START, read, release, start_page, to_bytes
from labgrader.support import PRIVATE, write_atomically


def bundle(course: Path, target: Path, topics: Sequence[str] = ()) -> list[str]:
    """Write a zip of what students get, in a folder of its name; returns the names in it, in order.

    topics: whose lessons and labs; all if none is given, and then the guides are there, too. The same course gives the
    same bytes. Raises ValueError if a topic is not there, or the labs are not as the solutions make them.
    """
    course, target, here = Path(course), Path(target), course_here()
    if drift := release(course, topics, check=True):
        raise ValueError(f"course: run `{here.command} release` first, {drift[0]} is not what it makes")
    found = [path for name in here.bundle for path in (course / name, *(course / name).rglob("*"))]
    names = {path.relative_to(course).as_posix(): path for path in found if path.is_file()}
    kept = sorted(name for name in names if name not in here.withheld and not is_left_over(name) and of(topics, name))
    contents = {name: names[name].read_bytes() for name in kept}
    for name in kept:
        if name.endswith(".md"):
            contents[name] = taught_rows(contents[name].decode("utf-8")).encode()
        if name.endswith(".ipynb"):  # its links lead to the files of the bundle, wherever the course is published
            contents[name] = to_bytes(unpublished(read(names[name]), name, course))
    if here.start:
        contents |= dict.fromkeys((START, "README.md"), start_page(course, topics).encode())
    archived = io.BytesIO()
    with zipfile.ZipFile(archived, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(contents):
            entry = zipfile.ZipInfo(f"{target.stem}/{name}", date_time=(1980, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = (0o755 if name in names and os.access(names[name], os.X_OK) else 0o644) << 16
            archive.writestr(entry, contents[name])
    write_atomically(target, archived.getvalue())
    return sorted(contents)


def of(topics: Sequence[str], name: str) -> bool:
    """Whether a file belongs to some topics: files of lessons and labs begin with their number, guides are of none.

    >>> [of(["04_iou"], f"lessons/{name}") for name in ("04_iou_edges.ipynb", "07_grasp.ipynb", "schematics/04_a.svg")]
    [True, False, True]
    """
    folder, _, rest = name.partition("/")
    numbers = {topic[:2] for topic in topics}
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
