"""What several modules here need: files written whole or not at all, refusals in words, variables for a while."""

import os
import stat
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

# What of a course's folder is about persons, for the instructor alone; folders end with a slash.
PRIVATE = (
    *("downloaded/", "submitted/", "autograded/", "feedback/", "grades/"),
    *("gradebook.db*", "roster.csv", "course.toml", "changes.json"),
)


def keep_closed(course: Path) -> None:
    """Take the rights of others away from what a course's folder holds about persons, whoever wrote it.

    A folder with the set-group-ID bit is shared by its group, which keeps its rights.
    """
    course = Path(course)
    rights = 0o2770 if course.stat().st_mode & stat.S_ISGID else 0o700
    for name in PRIVATE:
        for path in course.glob(name.rstrip("/")):
            if not path.is_symlink():
                with suppress(OSError):  # of what a colleague owns
                    path.chmod(stat.S_IMODE(path.stat().st_mode) & rights & (~0 if path.is_dir() else 0o660))


def write_atomically(path, data: bytes) -> None:
    """Write bytes to `path` through a temporary file beside it: readers see the old file or the new one, whole.

    Creates missing folders. On any failure (a full disk, say) the temporary file is removed; an OSError names `path`.
    """
    path = Path(path)
    unfinished = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        unfinished.write_bytes(data)
        os.replace(unfinished, path)
    except OSError as error:
        raise OSError(error.errno, f"could not write the file ({os.strerror(error.errno or 0)})", str(path)) from error
    finally:
        unfinished.unlink(missing_ok=True)


def git(folder: Path, *words: str) -> subprocess.CompletedProcess:
    """Run a command of git's in a folder, without the programs that the folder's own configuration names.

    Nor does it fetch what a repository lacks, as it says, from elsewhere: that runs programs, too.
    """
    safe = ("-c", "core.fsmonitor=false", "-c", f"core.hooksPath={os.devnull}")
    command = ["git", "-C", str(Path(folder).resolve()), *safe, *words]
    alone = os.environ | {"GIT_ALLOW_PROTOCOL": "none", "GIT_NO_LAZY_FETCH": "1"}
    return subprocess.run(command, capture_output=True, check=False, env=alone)


def require(name: str, fits, expected: str, got) -> None:
    """Raise a ValueError that names an argument, what was expected and what came, unless `fits`."""
    if not fits:
        raise ValueError(f"{name}: expected {expected}, got {got}")


def counted(number: int | float, thing: str) -> str:
    """A number of things in words.

    >>> counted(1, "student"), counted(1.5, "point")
    ('1 student', '1.5 points')
    """
    return f"{number if number % 1 else int(number)} {thing}{'s' * (number != 1)}"


@contextmanager
def inherited(variables: dict[str, str]) -> Iterator[None]:
    """Processes that are started meanwhile have these environment variables; this one has its own again afterwards."""
    before = {name: os.environ[name] for name in variables if name in os.environ}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name in variables:
            os.environ.pop(name, None)
        os.environ.update(before)
