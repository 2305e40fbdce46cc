"""What `grade` does, from the folder of submissions to the gradebook."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from labgrader.grade.batch import Batch, Record, grade_batch, secret_for, with_attempts
from labgrader.grade.changes import Change, add_change, changed, read_changes, undo
from labgrader.grade.deadlines import read_deadline, unknown_extensions
from labgrader.grade.gradebook import write_gradebook
from labgrader.grade.overview import add_comment, read_comments, standings
from labgrader.grade.read_programs import read_all
from labgrader.grade.students import known_students, remove_students, rename_students
from labgrader.grade.totals import finish_pages, settle
from labgrader.handin.reading import Lab, read_lab, read_submissions
from labgrader.handin.roster import absent_of, read_roster
from labgrader.handin.several import read_picks
from labgrader.report.alike import Found, find_alike, old_records
from labgrader.report.alike_page import write_alike
from labgrader.report.forget import keep_out_of_git
from labgrader.report.outputs import write_outputs
from labgrader.sandbox.sandbox import Limits
from labgrader.support import keep_closed


@dataclass(frozen=True)
class Graded:
    """The records of all students, by name, and how many were graded in this run.

    failures: what could not be written into the gradebook, by student. late: how late who is; strangers: in extensions,
    but not here. renamed: new names by the old ones; gone: of whom there are pages and grades but no submission any
    more, in this run removed if it was to `tidy`. other_files: the notebook's name where it is not the lab's.
    new_gradebook: whether there were grades, and no gradebook beside them. kept_out: what git would have taken. alike:
    the answers that are alike. notes: what a person should know of a hand-in, by student. absent: who is in the roster
    and handed in nothing.
    """

    lab: Lab
    records: list[Record]
    graded_now: int
    failures: dict[str, str]
    late: dict[str, str]
    strangers: list[str]
    renamed: dict[str, str]
    gone: list[str]
    other_files: dict[str, str]
    new_gradebook: bool
    kept_out: list[str]
    alike: Found
    notes: dict[str, str]
    absent: list[str]

    @property
    def told(self) -> dict[str, str]:
        """What the table says of hand-ins, by student."""
        both = self.late.keys() | self.notes.keys()
        return {one: "; ".join(filter(None, [self.late.get(one), self.notes.get(one)])) for one in both}

    @property
    def needs_a_look(self) -> bool:
        """Whether something is for a person to judge."""
        records = any(record.needs_a_look for record in self.records)
        return self.new_gradebook or bool(self.failures or self.notes) or records


@dataclass(frozen=True)
class Options:
    """What may be asked of a grading.

    submissions: their folder, COURSE/submitted by default; out: for results, COURSE/grades/TOPIC by default. seed: the
    secret one; new_round: take another one, and grade everybody anew. comment: (group, text), for the pages of all
    whose answers belong to that group of wrong ones. change: one more (`changes`); undone: a question whose change is
    taken back. tidy: remove what there is of students without a submission. against: an earlier course, whose answers
    are compared with these (`alike`). workers, limits, force, unsafe: as `Batch` has them.
    """

    submissions: Path | None = None
    out: Path | None = None
    seed: str | None = None
    new_round: bool = False
    comment: tuple[str, str] | None = None
    change: Change | None = None
    undone: str | None = None
    tidy: bool = False
    against: Path | None = None
    workers: int = 1
    limits: Limits = field(default_factory=Limits)
    force: bool = False
    unsafe: bool = False
    progress: bool = True


def grade_course(topic: str, course: Path = Path("."), **options) -> Graded:
    """Grade the submissions of a lab, and write tables, pages and the gradebook, for nobody else to read.

    course: folder with labs/ and gradebook.db. options: as `Options` has them. Raises ValueError for a topic, lab,
    folder, group or change that there is not, for another seed than the round's, and where no sandbox can be made.
    """
    course, how = Path(course), Options(**options)
    lab = read_lab(course, topic)
    folder = course / "submitted" if how.submissions is None else Path(how.submissions)
    read = read_submissions(folder, lab, read_picks(course, topic))
    out = course / "grades" / topic if how.out is None else Path(how.out)
    deadline, roster = read_deadline(course, topic), read_roster(course)
    old = [] if how.against is None else old_records(how.against, topic)
    if how.undone is not None:
        undo(course, lab, how.undone)
    if how.change is not None:
        add_change(course, lab, how.change)
    changes = read_changes(course, lab)
    absent = [person.name or person.id for person in absent_of(roster, [one.student for one in read])]
    new_gradebook = bool(known_students(out)) and not (course / "gradebook.db").is_file()
    with private():
        secret = secret_for(out, how.seed, how.new_round)
        renamed = rename_students(course, out, topic, read, roster)
        batch = Batch(lab, read, out, secret, how.workers, how.force, how.unsafe, how.limits)
        earned, graded_now = grade_batch(batch, how.progress)
        known = read_all([result.program for record in (*earned, *old) for result in record.results])
        terms = {"": earned} if how.against is None else {"": earned, Path(how.against).resolve().name: old}
        alike = find_alike(course, lab, terms, known)
        earned = [with_attempts(record, known) for record in earned]
        lab, records = changed(lab, earned, changes)
        comments = read_comments(out)
        if how.comment is not None:
            groups = [group.name for standing in standings(lab, records) for group in standing.groups]
            comments = add_comment(out, groups, *how.comment)
        write_outputs(out, lab, records, comments, absent)
        write_alike(out, lab, records, alike)
        failures = write_gradebook(course, lab, zip(records, read, strict=True), comments, roster)
        finals = settle(course, topic, changes, deadline)
        finish_pages(out, finals.values())
        gone = sorted(known_students(out) - {record.student for record in records})
        if how.tidy:
            remove_students(course, out, topic, gone)
        close_to_others(course, out)
        kept_out = keep_out_of_git(course)
    late = {name: f"{final.late}, so {final.score:g} in all" for name, final in finals.items() if final.late.days}
    students = {record.student for record in records} | roster.keys()
    files = {one.student: one.file for one in read if one.file and not one.others}
    notes = {one.student: one.note for one in read if one.note}
    notes |= {name: str(final.late) for name, final in finals.items() if final.late.unknown}
    odd = unknown_extensions(deadline, students)
    told = failures, late, odd, renamed, gone, files, new_gradebook, kept_out, alike, notes, absent
    return Graded(lab, records, graded_now, *told)


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
    for folder in (out, *(path for path in out.rglob("*") if path.is_dir())):
        if folder.is_dir():
            folder.chmod(0o700)
    keep_closed(course)
