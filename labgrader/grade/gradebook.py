"""nbgrader's gradebook, and the copies of submissions that formgrader shows.

nbgrader's own autograder would run a submission's tests in the submission's kernel; here it only gets the scores. In
the copies, autograded/STUDENT/TOPIC, everything is the released lab's but the answers, and nothing was executed.
"""

import copy
import datetime
import json
import os
import re
import secrets
import subprocess
import sys
import warnings
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import quote

import nbformat
from nbgrader.api import (
    Assignment,
    BaseCell,
    Grade,
    Gradebook,
    InvalidEntry,
    MissingEntry,
    SubmittedAssignment,
    SubmittedNotebook,
)
from nbgrader.preprocessors import SaveCells
from nbgrader.utils import parse_utc
from sqlalchemy.engine import make_url
from sqlalchemy.exc import SQLAlchemyError

from labgrader.grade.batch import Record
from labgrader.grade.markdown import harmless_markdown, harmless_with_pictures
from labgrader.grade.nbgrader_plugins import KERNEL, RUBRIC_TAG
from labgrader.grade.overview import lines_of
from labgrader.handin.reading import Lab, Submission, text_of
from labgrader.handin.roster import Person, person_of
from labgrader.program.cell import grade_id, source_of
from labgrader.sandbox.sandbox import NO_SANDBOX
from labgrader.support import inherited, write_atomically

RUBRIC = "**Rubric"  # begins it in a solution
# What SQLite says of the file, not of one student's row, and what an instructor can do.
FAULTS = {
    "locked": "another program is writing it; end nbgrader's commands and formgrader, then run this again",
    "malformed|not a database|encrypted": "it is damaged; put back a copy, or move it away: then scores are written "
    "anew, and what a person graded is lost",
    "full|disk I/O error": "the disk is full; make room, then run this again",
    "readonly|unable to open": "it cannot be written; look at its rights and at those of its folder",
}


def write_gradebook(
    course: Path,
    lab: Lab,
    graded: Iterable[tuple[Record, Submission]],
    comments: Mapping[str, str],
    roster: dict[str, Person],
) -> dict[str, str]:
    """Write scores and comments into course/gradebook.db, and the copies; returns by student why that failed.

    comments: an instructor's, by group of wrong answers; roster: names for formgrader. What stands there as it should,
    scores, time and copy, is left alone. Manual scores stay, and are marked for another look where something changed.
    Raises ValueError if the gradebook has a lab of that name with other questions.
    """
    course, failures = Path(course), {}
    rubrics = rubrics_of(course, lab)
    register(course, lab)
    with opened(course) as gradebook:
        kept = kept_scores(gradebook, lab)
        for record, submission in graded:
            target = course / "autograded" / record.student / lab.topic / f"{lab.topic}.ipynb"
            there = kept.get(record.student)
            try:
                if record.reason:
                    if there is not None and any(score for name, score in there.items() if name != "timestamp"):
                        write_nothing(gradebook, lab, record)
                else:
                    name_student(gradebook, record.student, person_of(roster, record.student))
                    copied = copy_for_formgrader(lab, record, submission, comments, rubrics)
                    wanted = {f"check_{result.question}": result.points for result in record.results}
                    wanted["timestamp"] = time_of(submission.timestamp)
                    write_beside(target, submission)
                    if there is not None and wanted.items() <= there.items() and is_file_of(target, copied):
                        continue
                    write_scores(gradebook, lab, record, submission, comments)
                    write_atomically(target, copied)
                gradebook.db.commit()
            except Exception as error:  # of one student: the others' scores are written all the same
                if fault_of_file(error):
                    raise
                gradebook.db.rollback()
                failures[record.student] = f"not in the gradebook: {type(error).__name__}"
    return failures


def kept_scores(gradebook: Gradebook, lab: Lab) -> dict[str, dict[str, object]]:
    """What the gradebook has of a lab: by student the score of each graded cell, and the "timestamp"."""
    rows = (
        gradebook.db.query(
            SubmittedAssignment.student_id, SubmittedAssignment.timestamp, BaseCell.name, Grade.auto_score
        )
        .join(Assignment, Assignment.id == SubmittedAssignment.assignment_id)
        .join(SubmittedNotebook, SubmittedNotebook.assignment_id == SubmittedAssignment.id)
        .join(Grade, Grade.notebook_id == SubmittedNotebook.id)
        .join(BaseCell, BaseCell.id == Grade.cell_id)
        .filter(Assignment.name == lab.topic)
    )
    kept: dict[str, dict[str, object]] = {}
    for student, timestamp, name, score in rows:
        kept.setdefault(student, {"timestamp": timestamp})[name] = score
    return kept


def is_file_of(path: Path, content: bytes) -> bool:
    """Whether there is a file of this content."""
    return path.is_file() and path.read_bytes() == content


@contextmanager
def opened(course: Path) -> Iterator:
    """Open course/gradebook.db, or make it, for which nbgrader runs `alembic` from the environment's folder.

    Raises ValueError, with what to do, where the file is locked, damaged or cannot be written.
    """
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', os.defpath)}"
    with inherited({"PATH": path}), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # SQLAlchemy's, about nbgrader's way with sessions
        try:
            with Gradebook(url_of(course)) as gradebook:
                yield gradebook
        except (SQLAlchemyError, InvalidEntry, subprocess.CalledProcessError) as error:
            said = fault_of_file(error) or f"nbgrader could not use it: {getattr(error, 'orig', None) or error}"
            raise ValueError(f"{Path(course) / 'gradebook.db'}: {said}") from error


def fault_of_file(error: Exception) -> str:
    """What is wrong with the gradebook's file, and what to do; "" for an error of another kind."""
    if not isinstance(error, SQLAlchemyError | InvalidEntry):  # nbgrader wraps some of the first in the second
        return ""
    said = str(getattr(error, "orig", None) or error)
    return next((words for pattern, words in FAULTS.items() if re.search(pattern, said)), "")


def url_of(course: Path) -> str:
    """Where nbgrader keeps its gradebook by default; escaped, by whom it will be read, if its path holds ?, % or #."""
    path = str(course.resolve() / "gradebook.db")
    for address in (f"sqlite:///{path}", f"sqlite:///{quote(path)}"):
        if (found := make_url(address)).database == path and not found.query:
            return address
    return f"sqlite:///file:{quote(path)}?uri=true"  # SQLAlchemy 2.0 escapes nothing, but SQLite does


def register(course: Path, lab: Lab) -> None:
    """Tell the gradebook of the released lab, as `nbgrader generate_assignment` does."""
    with opened(course) as gradebook:
        try:
            gradebook.find_assignment(lab.topic)
        except MissingEntry:
            gradebook.add_assignment(lab.topic)
    names = {"notebook": lab.topic, "assignment": lab.topic, "db_url": url_of(course)}
    notebook = nbformat.from_dict(lab.notebook)
    notebook.metadata["kernelspec"] = KERNEL
    try:
        SaveCells().preprocess(notebook, {"nbgrader": names})
    except RuntimeError as error:
        raise ValueError(f"{lab.topic}: the gradebook has it with other cells: {error}") from error


def write_scores(gradebook, lab: Lab, record: Record, submission: Submission, comments: Mapping[str, str]) -> None:
    """Write one submission's scores, what is said about each answer, and what a person has to grade."""
    where = (lab.topic, lab.topic, record.student)
    gradebook.update_or_create_submission(lab.topic, record.student, timestamp=time_of(submission.timestamp))
    for result in record.results:
        grade = gradebook.find_grade(f"check_{result.question}", *where)
        grade.auto_score = result.points
        grade.needs_manual_grade = grade.manual_score is not None or bool(result.flag)
        warning = [] if record.sandboxed else [f"Warning: {NO_SANDBOX}."]
        said = harmless_markdown(" ".join([*lines_of(result, comments), *warning]))
        gradebook.find_comment(result.question, *where).auto_comment = said
    released = {grade_id(cell): source_of(cell) for cell in lab.notebook["cells"]}
    for name in lab.written:
        answered = submission.cells.get(name, released[name]) != released[name] or name in submission.pictures
        grade = gradebook.find_grade(name, *where)
        grade.auto_score = None if answered else 0.0
        grade.needs_manual_grade = answered or grade.manual_score is not None
        gradebook.find_comment(name, *where).auto_comment = None if answered else "No response."


def name_student(gradebook, student: str, person: Person | None) -> None:
    """Make a student known to the gradebook, with name and email if the roster has them."""
    if person is None:
        gradebook.update_or_create_student(student)
        return
    first, last = person.first_and_last
    gradebook.update_or_create_student(student, first_name=first, last_name=last, email=person.email or None)


def write_nothing(gradebook, lab: Lab, record: Record) -> None:
    """Take back the scores of a submission that was graded once and cannot be read any more."""
    try:
        notebook = gradebook.find_submission_notebook(lab.topic, lab.topic, record.student)
    except MissingEntry:
        return
    for grade in notebook.grades:
        grade.auto_score, grade.needs_manual_grade = 0.0, True


def write_beside(target: Path, submission: Submission) -> None:
    """Write timestamp.txt and submission_secret.txt beside a copy: the student's, or new ones where there are none.

    `nbgrader generate_feedback` copies them to the feedback. It stops at a time that is none, and `release_feedback` at
    a student without them: nobody after that one gets feedback.
    """
    new = {
        "timestamp.txt": (submission.timestamp, lambda text: time_of(text) is not None, now),
        "submission_secret.txt": (submission.secret, bool, secrets.token_hex),
    }
    for name, (text, is_usable, make) in new.items():
        there = text_of(target.with_name(name))
        wanted = next(filter(is_usable, (text, there)), None) or make()
        if wanted != there:
            write_atomically(target.with_name(name), wanted.encode())


def now() -> str:
    """The time as nbgrader writes it."""
    return f"{datetime.datetime.now(datetime.UTC):%Y-%m-%d %H:%M:%S} UTC"


def time_of(text: str) -> datetime.datetime | None:
    """The time in a timestamp.txt, if it is one in a way that a calendar has."""
    try:
        stamp = parse_utc(text)
        return stamp if stamp and 2000 <= stamp.year < 2200 else None
    except Exception:  # dateutil raises many kinds for what is no date
        return None


def rubrics_of(course: Path, lab: Lab) -> dict[str, str]:
    """The rubric of each written question, from course/solutions; {} if that is not there."""
    path = course / "solutions" / lab.topic / f"{lab.topic}.ipynb"
    if not path.is_file():
        return {}
    cells = {grade_id(cell): source_of(cell) for cell in json.loads(path.read_bytes())["cells"]}
    found = {name: cells.get(name, "").partition(RUBRIC) for name in lab.written}
    return {name: RUBRIC + rubric for name, (_, mark, rubric) in found.items() if mark}


def copy_for_formgrader(
    lab: Lab,
    record: Record,
    submission: Submission,
    comments: Mapping[str, str],
    rubrics: Mapping[str, str],
) -> bytes:
    """The released lab with a student's answers, verdicts as the tests' outputs, and a rubric above each written one.

    nbgrader's feedback leaves out what is tagged as a rubric (`nbgrader_plugins.FeedbackPages`).
    """
    notebook = copy.deepcopy(lab.notebook)
    programs = {result.question: result.program for result in record.results}
    results = {f"check_{result.question}": result for result in record.results}
    for cell in notebook["cells"]:
        name = grade_id(cell)
        answer = programs.get(name) or submission.cells.get(name)
        if answer is not None and cell["metadata"]["nbgrader"].get("solution"):
            cell["source"] = answer
            if cell["cell_type"] != "code":
                cell["source"], shown = harmless_with_pictures(answer, submission.pictures.get(name, {}))
                cell |= {"attachments": shown} if shown else {}
        if cell["cell_type"] == "code":
            cell["outputs"], cell["execution_count"] = [], None
        if name in results:
            result = results[name]
            text = "\n".join([f"{result.points:g} of {result.max_points:g} points", *lines_of(result, comments)])
            if not record.sandboxed:
                text += f"\nWarning: {NO_SANDBOX}."
            cell["outputs"] = [{"output_type": "stream", "name": "stdout", "text": text + "\n"}]
    shown = []
    for cell in notebook["cells"]:
        if rubric := rubrics.get(grade_id(cell)):
            tags = {"tags": [RUBRIC_TAG]}
            shown.append({"cell_type": "markdown", "id": f"rubric-{len(shown)}", "metadata": tags, "source": rubric})
        shown.append(cell)
    notebook["cells"] = shown
    return (json.dumps(notebook, indent=1) + "\n").encode()
