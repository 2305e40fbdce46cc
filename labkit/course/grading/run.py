"""What `labkit grade` does, from the folder of submissions to the gradebook."""

from dataclasses import dataclass, replace
from pathlib import Path

from labkit.course.grading.batch import Batch, Record, grade_folder, secret_for, write_record
from labkit.course.grading.gradebook import write_gradebook
from labkit.course.grading.outputs import write_outputs
from labkit.course.grading.reading import Lab, find_submissions, read_lab, read_submission
from labkit.course.grading.sandbox import Limits


@dataclass(frozen=True)
class Graded:
    """The records of all students, by name, and how many were graded in this run."""

    lab: Lab
    records: list[Record]
    graded_now: int

    @property
    def needs_a_look(self) -> bool:
        """Whether something is for a person to judge."""
        return any(record.needs_a_look for record in self.records)


def grade_course(
    topic: str,
    course: Path = Path("."),
    submissions: Path | None = None,
    out: Path | None = None,
    seed: str | None = None,
    limits: Limits | None = None,
    progress: bool = True,
    **how,
) -> Graded:
    """Grade the submissions of a lab, and write tables, pages and the gradebook.

    course: folder with labs/ and gradebook.db. submissions: course/submitted by default; out: course/grades/TOPIC.
    seed: the secret one. how: workers, dask, force, unsafe, as `Batch` has them. Raises ValueError for a topic, lab or
    folder that there is not, and where no sandbox can be made.
    """
    course = Path(course)
    lab, _ = read_lab(course, topic)
    submissions = course / "submitted" if submissions is None else Path(submissions)
    out = course / "grades" / topic if out is None else Path(out)
    places = dict(find_submissions(submissions, topic))
    batch = Batch(lab, submissions, out, secret_for(out, seed), limits=limits or Limits(), **how)
    records, graded_now = grade_folder(batch, progress)
    write_outputs(out, lab, records)
    news = [record for record in records if not record.in_gradebook]
    read = ((record, read_submission(record.student, places[record.student], lab)) for record in news)
    triples = ((record, submission, places[record.student]) for record, submission in read)
    write_gradebook(course, lab, triples, lambda record: write_record(out, replace(record, in_gradebook=True)))
    return Graded(lab, records, graded_now)
