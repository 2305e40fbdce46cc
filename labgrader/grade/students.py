"""Students who are gone from the submissions: one who was renamed keeps what there was, the others are listed.

A record whose notebook now lies in exactly one new folder is the same student's, unless platform or roster tell two
people: whoever hands in a copy, byte by byte, of somebody whose folder is missing gets nothing of theirs. `grade
--tidy` removes what is left of the others.
"""

import os
import shutil
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from nbgrader.api import MissingEntry

from labgrader.grade.batch import read_record, record_path, write_record
from labgrader.grade.gradebook import opened
from labgrader.handin.reading import Submission
from labgrader.handin.roster import Person, keys_of, person_of


def known_students(out: Path) -> set[str]:
    """The students that there is a record of."""
    return {path.stem for path in (Path(out) / "records").glob("*.json")}


def rename_students(
    course: Path, out: Path, topic: str, submissions: Sequence[Submission], roster: Mapping[str, Person]
) -> dict[str, str]:
    """Move what belongs to students whose folder has another name now; returns the new names by the old ones."""
    known = known_students(out)
    new = [submission for submission in submissions if submission.student not in known and not submission.reason]
    gone = [read_record(record_path(out, name)) for name in sorted(known - {s.student for s in submissions})]
    names = {submission.digest: submission.student for submission in new}
    found = Counter(submission.digest for submission in new)
    left = Counter(record.digest for record in gone if record is not None)
    moved = {}
    for record in gone:
        if record is not None and found[record.digest] == left[record.digest] == 1:
            if are_two(roster, record.student, names[record.digest]):
                continue
            moved[record.student] = replace(record, student=names[record.digest])
    if moved:
        with opened(course) as gradebook:
            for old, record in moved.items():
                gradebook.update_or_create_student(record.student)
                with suppress(MissingEntry):
                    gradebook.find_submission(topic, old).student = gradebook.find_student(record.student)
            gradebook.db.commit()
    for old, record in moved.items():
        for step in ("autograded", "feedback"):
            move(course / step / old / topic, course / step / record.student / topic)
        write_record(out, record)  # from here on the new name is known; a run that ended before is made again
        remove_pages(course, out, topic, old)
    return {old: record.student for old, record in moved.items()}


def are_two(roster: Mapping[str, Person], old: str, new: str) -> bool:
    """Whether two names are of two people: by the platform's numbers at their ends, or by the roster."""
    numbers, people = [keys_of(name)[1:] for name in (old, new)], [person_of(roster, name) for name in (old, new)]
    return (all(numbers) and numbers[0] != numbers[1]) or (None not in people and people[0] != people[1])


def move(folder: Path, target: Path) -> None:
    """Move a folder, if it is there and the target is not."""
    if folder.is_dir() and not target.exists():
        target.parent.mkdir(parents=True, exist_ok=True)
        os.rename(folder, target)


def remove_students(course: Path, out: Path, topic: str, students: Sequence[str]) -> None:
    """Remove all that there is of students in a lab: records, pages, copies, and their scores in the gradebook."""
    with opened(course) as gradebook:
        for student in students:
            with suppress(MissingEntry):  # what could not be read was never written there
                gradebook.remove_submission(topic, student)
    for student in students:
        remove_pages(course, out, topic, student)


def remove_pages(course: Path, out: Path, topic: str, student: str) -> None:
    """Remove a student's record, pages and copies of a lab."""
    for file in (record_path(out, student), out / "feedback" / f"{student}.html"):
        file.unlink(missing_ok=True)
    for step in ("autograded", "feedback"):
        shutil.rmtree(course / step / student / topic, ignore_errors=True)
        if (course / step / student).is_dir() and not any((course / step / student).iterdir()):
            (course / step / student).rmdir()
    shutil.rmtree(out / "results" / student, ignore_errors=True)
