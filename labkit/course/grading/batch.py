"""Grading a folder of submissions: what changed is graded, by threads here or on a Dask cluster, and kept as it comes.

Each finished submission is a record, a file of its own that is written at once; a run that was killed is taken up by
the next one. The record's key tells what it depends on: the lab, the submission, the secret, the limits and this code.
"""

import hashlib
import json
import os
import secrets
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

from tqdm.auto import tqdm

from labkit.course import questions
from labkit.course.grading import sandbox
from labkit.course.grading.grade import Result, grade_submission
from labkit.course.grading.reading import Lab, Submission, find_submissions, imported_roots, read_submission
from labkit.course.grading.sandbox import Limits
from labkit.support.files import write_atomically

SECRET_FILE = "secret_seed"
LONGEST_NAME = 100


@dataclass(frozen=True)
class Record:
    """What is kept of a graded submission. reason: why it could not be graded, "" if it was.

    key: of all that the results depend on; in_gradebook: whether nbgrader's database has them.
    """

    student: str
    reason: str
    results: tuple[Result, ...]
    sandboxed: bool
    key: str
    in_gradebook: bool = False

    @property
    def points(self) -> float:
        """The points of all questions together."""
        return sum((result.points for result in self.results), 0.0)

    @property
    def needs_a_look(self) -> bool:
        """Whether something about it is for a person to judge."""
        return bool(self.reason) or any(result.flag for result in self.results)


@dataclass(frozen=True)
class Batch:
    """How to grade: what is said of these in `labkit grade --help`."""

    lab: Lab
    submissions: Path
    out: Path
    secret: str
    workers: int = 1
    dask: str | None = None
    force: bool = False
    unsafe: bool = False
    limits: Limits = field(default_factory=Limits)


def grade_folder(batch: Batch, progress: bool = True) -> tuple[list[Record], int]:
    """Grade the submissions of a folder; returns a record of each student, by name, and how many were graded now.

    Raises ValueError if there is no such folder, or if no sandbox can be made.
    """
    if not batch.unsafe and batch.dask is None:
        sandbox.probe(imported_roots(batch.lab.setup), batch.limits)
    found = list(find_submissions(batch.submissions, batch.lab.topic))
    records: dict[str, Record] = {}
    waiting = []
    code = code_digest()
    for student, place in found:
        submission = read_submission(student, place, batch.lab)
        key = key_of(batch, submission, code)
        old = None if batch.force else read_record(record_path(batch.out, student))
        if old is not None and old.key == key:
            records[student] = old
        else:
            waiting.append((student, place))
    bar = tqdm(total=len(found), initial=len(records), desc=batch.lab.topic, unit="student", disable=not progress)
    with bar, executor_of(batch) as (executor, width):
        for submission, results in graded(executor, width, batch, waiting):
            key = key_of(batch, submission, code)
            record = Record(submission.student, submission.reason, tuple(results), not batch.unsafe, key)
            write_record(batch.out, record)
            records[submission.student] = record
            bar.update()
    return [records[student] for student, _ in found], len(waiting)


def graded(
    executor: Executor, width: int, batch: Batch, waiting: Iterable
) -> Iterator[tuple[Submission, list[Result]]]:
    """Grade submissions, a few at a time so that no more of them are in memory; gives them as they are ready."""
    lab = replace(batch.lab, notebook={})  # which grading does not need, and a cluster would be sent
    pending: dict[Future, Submission] = {}
    queue = iter(waiting)
    try:
        while True:
            for student, place in queue:
                submission = read_submission(student, place, batch.lab)
                if submission.reason:
                    yield submission, []
                    continue
                task = (lab, submission, batch.secret, batch.limits, batch.unsafe)
                pending[executor.submit(grade_submission, *task)] = submission
                if len(pending) >= width:
                    break
            if not pending:
                return
            for future in wait(pending, return_when=FIRST_COMPLETED).done:
                yield pending.pop(future), future.result()
    finally:
        for future in pending:
            future.cancel()


@contextmanager
def executor_of(batch: Batch) -> Iterator[tuple[Executor, int]]:
    """Threads, each of which waits for a worker of its own, or a Dask cluster; and how many tasks to keep in flight."""
    if batch.dask is None:
        with ThreadPoolExecutor(batch.workers) as executor:
            yield executor, 2 * batch.workers
        return
    from distributed import Client

    with Client(batch.dask) as client:
        yield client.get_executor(pure=False), max(2, 2 * sum(client.nthreads().values()))


# ------------------------------------------------------------------------------------------------------ records


def key_of(batch: Batch, submission: Submission, code: str) -> str:
    """Name everything that a submission's results depend on."""
    parts = (code, batch.lab.digest, submission.digest, submission.reason, batch.secret, batch.limits, batch.unsafe)
    return hashlib.sha256(repr(parts).encode()).hexdigest()


def code_digest() -> str:
    """Name the questions and the grader by the bytes of their files."""
    folders = (Path(questions.__file__).parent, Path(__file__).parent)
    files = [path for folder in folders for path in sorted(folder.rglob("*.py"))]
    return hashlib.sha256(b"\0".join(path.read_bytes() for path in files)).hexdigest()


def file_name(student: str) -> str:
    """A student's name as the name of a file: itself, unless it would not do as one."""
    if student.isprintable() and len(student.encode()) <= LONGEST_NAME and not set(student) & set('/\\:*?"<>|'):
        return student
    return f"odd-name-{hashlib.sha256(student.encode()).hexdigest()[:12]}"


def record_path(out: Path, student: str) -> Path:
    """Where a student's record is kept."""
    return Path(out) / "records" / f"{file_name(student)}.json"


def write_record(out: Path, record: Record) -> None:
    """Keep a record."""
    write_atomically(record_path(out, record.student), (json.dumps(asdict(record), indent=1) + "\n").encode())


def read_record(path: Path) -> Record | None:
    """Read a record; None if there is none, or none of this version."""
    try:
        data = json.loads(path.read_bytes())
        return Record(**data | {"results": tuple(Result(**result) for result in data["results"])})
    except (OSError, ValueError, TypeError, KeyError):
        return None


def secret_for(out: Path, given: str | None, draw: Callable[[], str] = lambda: secrets.token_hex(16)) -> str:
    """The secret seed: the given one, else the one of the last run, else a new one. It is kept for the next run."""
    path = Path(out) / SECRET_FILE
    if given is None:
        given = path.read_text().strip() if path.is_file() else draw()
    write_atomically(path, f"{given}\n".encode())
    os.chmod(path, 0o600)
    return given
