"""Which courses may run code here: their folders are kept in a file of the user's, as git keeps `safe.directory`.

A course's questions are Python. Whoever unpacks a stranger's folder and types a command in it has not said that its
code may run, though all of it belongs to the user by then; what lies in a folder that all can write, such as /tmp, may
be anybody's.
"""

import os
import shlex
from pathlib import Path

from labgrader.support import write_atomically


def file() -> Path:
    """Where trusted folders are kept, one on each line."""
    return Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config") / "labgrader" / "trusted"


def trusted() -> list[str]:
    """The folders that are trusted."""
    try:
        return file().read_text(encoding="utf-8").splitlines()
    except (OSError, ValueError, RuntimeError):  # a user without a home, too
        return []


def is_trusted(folder: Path) -> bool:
    """Whether a course's folder was trusted once."""
    return str(folder.resolve()) in trusted()


def keep_trusted(folder: Path) -> Path:
    """Note that the course of a folder is trusted from now on; returns the file that says so."""
    if not is_trusted(folder):
        write_atomically(file(), "\n".join([*trusted(), str(folder), ""]).encode())
    return file()


def is_of_another_account(path: Path) -> bool:
    """Whether a file belongs to neither this user nor root."""
    return hasattr(os, "getuid") and path.stat().st_uid not in (os.getuid(), 0)


def refusal(path: Path, questions: object, command: str) -> str:
    """What a user is told of a course that nobody has trusted."""
    folder = shlex.quote(str(path.parent)) if str(path.parent).isprintable() else ascii(str(path.parent))
    return (
        f"course: {folder} has a course of its own, whose code ({str(questions)[:60]!a}) would run here. Do you trust "
        f"who wrote it? Then type `{command} trust {folder}`, once; else work outside that folder"
    )
