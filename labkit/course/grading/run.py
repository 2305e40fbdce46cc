"""What `labkit grade` does, from the folder of submissions to the gradebook."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from labkit.course.grading.batch import Batch, Record, grade_batch, secret_for
from labkit.course.grading.changes import Change, add_change, changed, read_changes, undo
from labkit.course.grading.deadlines import read_deadline, strangers
from labkit.course.grading.final import finish_pages, settle
from labkit.course.grading.gradebook import write_gradebook
from labkit.course.grading.outputs import write_outputs
from labkit.course.grading.overview import add_comment, read_comments, standings
from labkit.course.grading.reading import Lab, read_lab, read_submissions
from labkit.course.grading.roster import read_roster
from labkit.course.grading.sandbox import Limits
from labkit.course.grading.students import known_students, remove_students, rename_students


@dataclass(frozen=True)
class Graded:
    """The records of all students, by name, and how many were graded in this run.

    failures: what could not be written into the gradebook, by student. late: how late who is; strangers: in extensions,
    but not here. renamed: new names by the old ones; gone: of
    whom there are pages and grades but no submission any more, in this run removed if it was to `tidy`.
    """

    lab: Lab
    records: list[Record]
    graded_now: int
    failures: dict[str, str]
    late: dict[str, str]
    strangers: list[str]
    renamed: dict[str, str]
    gone: list[str]

    @property
    def needs_a_look(self) -> bool:
        """Whether something is for a person to judge."""
        return bool(self.failures) or any(record.needs_a_look for record in self.records)


def grade_course(
    topic: str,
    course: Path = Path("."),
    submissions: Path | None = None,
    out: Path | None = None,
    seed: str | None = None,
    new_round: bool = False,
    comment: tuple[str, str] | None = None,
    limits: Limits | None = None,
    change: Change | None = None,
    undone: str | None = None,
    tidy: bool = False,
    progress: bool = True,
    **how,
) -> Graded:
    """Grade the submissions of a lab, and write tables, pages and the gradebook, for nobody else to read.

    course: folder with labs/ and gradebook.db. submissions: course/submitted by default; out: course/grades/TOPIC.
    seed: the secret one; new_round: take another one, and grade everybody anew. comment: (group, text), for the pages
    of all whose answers belong to that group of wrong ones. change: one more for course.toml; undone: a question whose
    change is taken out of it. tidy: remove what there is of students without a submission. how: workers, force, unsafe,
    as `Batch` has them. Raises ValueError for a topic, lab, folder, group or change that there is not, for another seed
    than the round's, and where no sandbox can be made.
    """
    course = Path(course)
    lab = read_lab(course, topic)
    read = read_submissions(course / "submitted" if submissions is None else Path(submissions), lab)
    out = course / "grades" / topic if out is None else Path(out)
    deadline, roster = read_deadline(course, topic), read_roster(course)
    if undone is not None:
        undo(course, lab, undone)
    if change is not None:
        add_change(course, lab, change)
    changes = read_changes(course, lab)
    with private():
        secret = secret_for(out, seed, new_round)
        renamed = rename_students(course, out, topic, read)
        batch = Batch(lab, read, out, secret, limits=limits or Limits(), **how)
        earned, graded_now = grade_batch(batch, progress)
        lab, records = changed(lab, earned, changes)
        comments = read_comments(out)
        if comment is not None:
            groups = [group.name for standing in standings(lab, records) for group in standing.groups]
            comments = add_comment(out, groups, *comment)
        write_outputs(out, lab, records, comments)
        failures = write_gradebook(course, lab, zip(records, read, strict=True), comments, roster)
        finals = settle(course, topic, changes, deadline)
        finish_pages(out, finals.values())
        gone = sorted(known_students(out) - {record.student for record in records})
        if tidy:
            remove_students(course, out, topic, gone)
        close_to_others(course, out)
    late = {student: str(final.late) for student, final in finals.items() if final.late.days}
    known = {record.student for record in records} | roster.keys()
    return Graded(lab, records, graded_now, failures, late, strangers(deadline, known), renamed, gone)


@contextmanager
def private() -> Iterator[None]:
    """Let the files that are written be read by their owner only: files 0600, folders 0700."""
    before = os.umask(0o077)
    try:
        yield
    finally:
        os.umask(before)


def close_to_others(course: Path, out: Path) -> None:
    """Take the rights of others away from what earlier runs, or nbgrader, may have left open."""
    for folder in (out, *(path for path in out.rglob("*") if path.is_dir()), course / "autograded"):
        if folder.is_dir():
            folder.chmod(0o700)
    (course / "gradebook.db").chmod(0o600)
