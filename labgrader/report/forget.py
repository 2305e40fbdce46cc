"""What is private in a course's folder, kept out of git and of bundles; and a student who is to be forgotten.

A student is in more places than one remembers: `forget` goes through all that grading and nbgrader write, and says
where there was something. Tables and pages of a whole class that name the student go, too: grading makes them anew.
"""

import csv
import io
import json
import re
import shutil
import sqlite3
import tomllib
import zipfile
from contextlib import closing, suppress
from html import unescape
from pathlib import Path

from nbgrader.api import MissingEntry

from labgrader.course import course as course_here
from labgrader.grade.gradebook import opened
from labgrader.grade.overview import COMMENTS_FILE, read_comments
from labgrader.handin.collect import student_and_notebook
from labgrader.handin.roster import FILE as ROSTER
from labgrader.handin.roster import in_one_line, keys_of, person_of, read_roster
from labgrader.settings import FILE as SETTINGS
from labgrader.settings import read_blocks
from labgrader.support import PRIVATE, counted, git, write_atomically

EXTENSION = re.compile(r"(?ms)^[ \t]*\[\[[ \t]*extension[ \t]*\]\].*?(?=^[ \t]*\[|\Z)")
STEPS = ("submitted", "autograded", "feedback")


def keep_out_of_git(course: Path) -> list[str]:
    """Add what is private and there, and what git would take, to course/.gitignore; returns what was added.

    Where there is no git, or the folder lies in no repository, nothing is done.
    """
    course, added = Path(course), []
    for name in PRIVATE:
        for path in sorted(course.glob(name.rstrip("/"))):
            try:
                status = git(course, "check-ignore", "-q", str(path.resolve())).returncode
            except OSError:
                return []
            if status == 1 and f"/{name}" not in added:
                added.append(f"/{name}")
    if added:
        file = course / ".gitignore"
        before = file.read_text().rstrip("\n") + "\n" if file.is_file() and file.stat().st_size else ""
        write_atomically(file, (before + "\n".join(added) + "\n").encode())
    return added


def forget(course: Path, student: str) -> list[str]:
    """Remove a student from all that there is in a course's folder; returns where something was, in order.

    student: a folder's name, the number that ends it, or an id of the roster. Raises ValueError if there is nothing.
    """
    course = Path(course)
    roster = read_roster(course)
    person = person_of(roster, student)
    asked = {student, *({person.id} if person is not None else ())}
    names = asked | {name for name in all_names(course) if asked & set(keys_of(name))}
    keys = {key for name in names for key in keys_of(name)}
    told = keys | ({person.name, person.email} - {""} if person is not None else set())
    done = [*from_folders(course, names), *from_downloads(course, names)]
    for out in sorted((course / "grades").glob("*/")):
        done += from_grades(out, names, told)
    done += from_gradebook(course, names)
    done += from_roster(course, {person.id} if person is not None else set())
    done += from_settings(course, keys)
    if not done:
        raise ValueError(f"student: expected a folder, a number or an id of {ROSTER}, no student matches {student!r}")
    return done


def all_names(course: Path) -> set[str]:
    """The names that students have in folders, records and the gradebook."""
    names = {folder.name for step in STEPS for folder in (course / step).glob("*/")}
    names |= {path.stem for path in (course / "grades").glob("*/records/*.json")}
    names |= {whose[0] for path in downloads(course) if (whose := student_and_notebook(str(path)))}
    if (course / "gradebook.db").is_file():
        with opened(course) as gradebook:
            names |= {one.id for one in gradebook.students}
    return names


def downloads(course: Path) -> list[Path]:
    """The files that were taken out of a platform's zips."""
    return [path for path in sorted((course / "downloaded").glob("*/extracted/**/*")) if path.is_file()]


def from_folders(course: Path, names: set[str]) -> list[str]:
    """Remove the student's folders."""
    folders = [course / step / name for step in STEPS for name in sorted(names)]
    found = [folder for folder in folders if folder.is_dir()]
    for folder in found:
        shutil.rmtree(folder)
    return [f"removed {folder}" for folder in found]


def from_downloads(course: Path, names: set[str]) -> list[str]:
    """Remove what was taken out of a platform's zips, and name the zips, which are the platform's and stay."""
    found = [path for path in downloads(course) if (student_and_notebook(str(path)) or ("",))[0] in names]
    for path in found:
        path.unlink()
    done = [f"removed {path}" for path in found]
    for path in sorted((course / "downloaded").glob("*/archive/**/*.zip")):
        with suppress(zipfile.BadZipFile), zipfile.ZipFile(path) as packed:
            whose = (student_and_notebook(f"extracted/all/{name}") for name in packed.namelist())
            if any(found is not None and found[0] in names for found in whose):
                done.append(f"still in {path}, which is the platform's: delete it")
    return done


def from_grades(out: Path, names: set[str], told: set[str]) -> list[str]:
    """Remove the student's records and pages of a lab, the class's tables that name them, and comments that do."""
    found = [path for name in names for path in (out / "records" / f"{name}.json", out / "feedback" / f"{name}.html")]
    found = [path for path in sorted(found) if path.is_file()]
    tables = (path for pattern in ("*.csv", "*.html", "*.zip") for path in sorted(out.glob(pattern)))
    of_class = [path for path in tables if mentions(path, told)]
    results = [out / "results" / name for name in sorted(names) if (out / "results" / name).is_dir()]
    for path in found + of_class:
        path.unlink()
    for folder in results:
        shutil.rmtree(folder)
    anew = f"; `{course_here().command} grade` and `grades` recreate it without them"
    done = [f"removed {path}" for path in found + results] + [f"removed {path}{anew}" for path in of_class]
    comments = read_comments(out)
    kept = {group: text for group, text in comments.items() if not names_one(text, told)}
    if kept != comments:
        write_atomically(out / COMMENTS_FILE, (json.dumps(kept, indent=1, ensure_ascii=False) + "\n").encode())
        done.append(f"removed {len(comments) - len(kept)} from {out / COMMENTS_FILE}")
    return done


def names_one(text: str, told: set[str]) -> bool:
    """Whether a text holds one of some names or numbers as a word."""
    return any(re.search(rf"(?<![\w]){re.escape(name)}(?![\w])", text) for name in told)


def mentions(path: Path, told: set[str]) -> bool:
    """Whether a table, a page or a zip of pages names a student."""
    if path.suffix != ".zip":
        text = path.read_text(encoding="utf-8", errors="replace")
        return names_one(unescape(text) if path.suffix == ".html" else text, told)
    with zipfile.ZipFile(path) as packed:
        names = "\n".join(packed.namelist()).replace("_", " ")
    return names_one(names, {name.replace("_", " ") for name in told})


def from_gradebook(course: Path, names: set[str]) -> list[str]:
    """Remove the student from the gradebook, whose file is then written anew: SQLite would keep what was deleted."""
    path, done = course / "gradebook.db", []
    if not path.is_file():
        return done
    with opened(course) as gradebook:
        for name in sorted(names):
            with suppress(MissingEntry):
                gradebook.remove_student(name)
                done.append(f"removed {name} from {path}")
    if done:
        with closing(sqlite3.connect(path)) as database:
            database.execute("VACUUM")
    return done


def from_roster(course: Path, ids: set[str]) -> list[str]:
    """Remove rows of the roster; all other rows stay as they are read."""
    if not ids:
        return []
    path = course / ROSTER
    text = path.read_text(encoding="utf-8-sig")
    first = re.split(r"[\r\n]", text, maxsplit=1)[0]
    delimiter = max(",;\t", key=first.count)
    rows = list(csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True))
    kept = [row for row in rows if not ids & {in_one_line(cell).removeprefix("Participant ") for cell in row}]
    written = io.StringIO(newline="")
    csv.writer(written, delimiter=delimiter, lineterminator="\n").writerows(kept)
    write_atomically(path, written.getvalue().encode())
    return [f"removed {len(rows) - len(kept)} row from {path}"]


def from_settings(course: Path, keys: set[str]) -> list[str]:
    """Remove the student's extensions from course.toml, which a person wrote; name those that are written otherwise."""
    path, table = course / SETTINGS, "extension"
    theirs = [(where, data) for where, data in read_blocks(course, table) if str(data.get("student")) in keys]
    if not theirs:
        return []
    text = path.read_text(encoding="utf-8")
    wanted = tomllib.loads(text)
    wanted[table] = [data for data in wanted[table] if str(data.get("student")) not in keys]
    edited = EXTENSION.sub(lambda block: "" if is_of(block[0], keys) else block[0], text)
    with suppress(tomllib.TOMLDecodeError):
        if {table: [], **tomllib.loads(edited)} == wanted:
            write_atomically(path, edited.encode())
            return [f"removed {counted(len(theirs), 'extension')} from {path}"]
    return [f"still in {where}: delete it" for where, _ in theirs]


def is_of(block: str, keys: set[str]) -> bool:
    """Whether the text of a block of course.toml is an extension of one of these students."""
    try:
        (data,) = tomllib.loads(block)["extension"]
    except (tomllib.TOMLDecodeError, KeyError, ValueError):
        return False
    return str(data.get("student")) in keys
