"""Grading submissions: what changed is graded, by threads, and kept as it comes.

Each finished submission is a record, a file of its own that is written at once; a run that was killed is taken up by
the next one. The record's key tells what it depends on: the lab, the submission, the secret, the limits, this code, and
the course's questions, settings and language. The secret belongs to a round of grading: late work is graded with the
same one until a new round begins.
"""

import hashlib
import json
import secrets
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from contextlib import closing, contextmanager
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

from tqdm.auto import tqdm

from labgrader.course import chosen_language, course, files_of
from labgrader.grade.diagnose_outputs import diagnosers
from labgrader.grade.grade import Grading, Result
from labgrader.grade.read_programs import Read
from labgrader.handin.reading import Lab, Submission
from labgrader.sandbox import sandbox
from labgrader.sandbox.sandbox import Limits
from labgrader.support import write_atomically

SECRET_FILE = "secret_seed"
ATTEMPT = "suspicious code: "  # begins a flag
DRAFT = ", public cases"  # ends the key of a record whose answers have not run on secret cases yet


@dataclass(frozen=True)
class Record:
    """What is kept of a graded submission. reason: why it could not be graded, "" if it was.

    digest: of the notebook; key: of all that the results depend on.
    """

    student: str
    reason: str
    results: tuple[Result, ...]
    sandboxed: bool
    digest: str
    key: str

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
    """One run of the grader: a lab, its submissions, the folder for what comes out, and the secret of this course.

    workers: processes beside each other; force: grade again what has a record; unsafe: without a sandbox.
    """

    lab: Lab
    submissions: Sequence[Submission]
    out: Path
    secret: str
    workers: int = 1
    force: bool = False
    unsafe: bool = False
    limits: Limits = field(default_factory=Limits)


def grade_batch(batch: Batch, progress: bool = True) -> tuple[list[Record], int]:
    """Grade the submissions of a batch; returns a record of each, in their order, and how many were graded now.

    All of them run on the public cases, then those answers that are right run on secret ones. Raises ValueError if no
    sandbox can be made.
    """
    if not batch.unsafe:
        sandbox.probe(("numpy",), batch.limits)
    code = code_digest()
    keys = {submission.student: record_key(batch, submission, code) for submission in batch.submissions}
    records = {} if batch.force else kept_records(batch.out, keys)
    finished = {student for student, record in records.items() if record.key == keys[student]}
    gradings = {}
    for submission in batch.submissions:
        if submission.student not in finished:
            drafts = records[submission.student].results if submission.student in records else ()
            gradings[submission.student] = Grading(batch.lab, submission, batch.limits, batch.unsafe, drafts)
    with closing(sandbox.servers), closing(diagnosers), ThreadPoolExecutor(batch.workers) as executor:
        for cases, mark in (("public", DRAFT), ("secret", "")):
            bar = tqdm(
                total=len(gradings), desc=f"{batch.lab.topic}, {cases} cases", unit="student", disable=not progress
            )
            secret = batch.secret if cases == "secret" else None
            waiting = [executor.submit(graded, grading, secret) for grading in gradings.values()]
            with bar, cancelled_at_the_end(waiting):
                for judged, results in (future.result() for future in as_completed(waiting)):
                    submission, student, sandboxed = judged.submission, judged.submission.student, not batch.unsafe
                    key = "" if judged.failed else keys[student] + mark  # the next run tries again
                    record = Record(student, submission.reason, results, sandboxed, submission.digest, key)
                    records[student] = record
                    write_record(batch.out, record)
                    bar.update()
    return [records[submission.student] for submission in batch.submissions], len(gradings)


@contextmanager
def cancelled_at_the_end(waiting: Sequence[Future]) -> Iterator[None]:
    """However a block ends, what has not begun does not begin."""
    try:
        yield
    finally:
        for future in waiting:
            future.cancel()


def graded(grading: Grading, secret: str | None) -> tuple[Grading, tuple[Result, ...]]:
    """A grading with its results in public, or those of all cases if there is a secret; none if it is unreadable."""
    if grading.submission.reason:
        return grading, ()
    return grading, grading.in_public() if secret is None else grading.in_secret(secret)


def with_attempts(record: Record, known: Mapping[str, Read | None]) -> Record:
    """A record whose flags say what its programs try that no answer needs; known: what is in the programs."""
    results = []
    for result in record.results:
        found = known.get(result.program)
        tried = f"{ATTEMPT}{', '.join(found.attempts)}" if found is not None and found.attempts else ""
        results.append(replace(result, flag="; ".join(filter(None, [tried, result.flag]))))
    return replace(record, results=tuple(results))


# ------------------------------------------------------------------------------------------------------ records


def record_key(batch: Batch, submission: Submission, code: str) -> str:
    """Name everything that a submission's results depend on."""
    parts = (code, batch.lab.digest, submission.digest, submission.reason, batch.secret, batch.limits, batch.unsafe)
    return hashlib.sha256(repr(parts).encode()).hexdigest()


def code_digest() -> str:
    """Name the questions, in the language that is chosen, the grader, and the settings that it reads of the course."""
    here, language = course(), chosen_language()
    files = [path for package in ("labgrader", here.questions) for _, path in files_of(package)]
    files += [path for _, path in files_of(here.questions, f"*.{language}.toml")]
    settings = (here.packages, here.kit, here.copied, here.ignored, language)
    content = (repr(settings).encode(), *(path.read_bytes() for path in files))
    return hashlib.sha256(b"\0".join(content)).hexdigest()


def record_path(out: Path, student: str) -> Path:
    """Where a student's record is kept."""
    return Path(out) / "records" / f"{student}.json"


def kept_records(out: Path, keys: Mapping[str, str]) -> dict[str, Record]:
    """The records of an earlier run that still hold, by student, finished or drafts; keys: of what they depend on."""
    kept = {student: read_record(record_path(out, student)) for student in keys}
    return {s: record for s, record in kept.items() if record is not None and record.key in (keys[s], keys[s] + DRAFT)}


def write_record(out: Path, record: Record) -> None:
    """Keep a record."""
    write_atomically(record_path(out, record.student), (json.dumps(asdict(record), indent=1) + "\n").encode())


def read_record(path: Path) -> Record | None:
    """Read a record; None if there is none, or none of this version."""
    try:
        data = json.loads(path.read_bytes())
        return Record(**data | {"results": tuple(map(read_result, data["results"]))})
    except (OSError, ValueError, TypeError, KeyError):
        return None


def read_result(data: dict) -> Result:
    """A result as its record has it."""
    return Result(**data | {"parts": tuple(data["parts"])})


def secret_for(out: Path, given: str | None, new_round: bool = False) -> str:
    """The secret seed of the round of grading in OUT: the kept one, else the given one, else a new one, which is kept.

    new_round: forget the kept one. Raises ValueError if another one is given in the middle of a round, or if what is
    kept is damaged.
    """
    path = Path(out) / SECRET_FILE
    kept = path.read_text(errors="replace").strip() if path.is_file() and not new_round else None
    if kept is not None and (not kept.isprintable() or kept == "" or "\ufffd" in kept):
        raise ValueError(f"{path}: expected one line of text, it is damaged; --new-round draws another for everybody")
    if kept is not None and given not in (None, kept):
        raise ValueError(f"seed: expected that of the round in {path}; --new-round grades everybody with another one")
    secret = kept or given or secrets.token_hex(16)
    if secret != kept:
        write_atomically(path, f"{secret}\n".encode())
    return secret
