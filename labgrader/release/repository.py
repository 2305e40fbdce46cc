"""A public repository for students: what a bundle holds, with the notebooks as they are published.

    repository(course, "public")                 then, in public: git remote add origin ...; git push -u origin main

Its notebooks have the badge and the first cell for Colab, its README the course's badges and the link to the site, as
far as pyproject.toml says where these are (`labgrader.release.publishing`). No link leads to what stays with the
instructor.
"""

import os
import re
from collections.abc import Sequence
from pathlib import Path

from labgrader.course import course as course_here
from labgrader.release.bundle import Bundle, for_students
from labgrader.release.publishing import badges, published
from labgrader.support import git, write_atomically

AUTHOR = ("-c", "user.name=course", "-c", "user.email=course")


def repository(course: Path, folder: Path, topics: Sequence[str] = ()) -> Bundle:
    """Write what students get into a git repository, made where there is none, and commit it to its branch main.

    Run again, it brings the repository up to date, and takes out what students get no more; files there that git does
    not track stay as they are, and are not committed. Raises ValueError for a folder that holds something else, lies
    in the course, or has changes that were not committed, and as `bundle` does.
    """
    course, folder, here = Path(course), Path(folder), course_here()
    if folder.resolve().is_relative_to(course.resolve()):
        raise ValueError(f"repository: expected a folder outside the course, got {folder}")
    there = (folder / ".git").is_dir()
    if not there and folder.is_dir() and any(folder.iterdir()):
        raise ValueError(f"repository: expected an empty folder or a git repository, got {folder}")
    if there and said(folder, "status", "--porcelain", "--untracked-files=no"):
        raise ValueError(f"repository: expected no changes in {folder}; commit them or take them back first")
    chosen = for_students(course, topics, lambda notebook, name, root: published(notebook, name, root, here))
    contents = chosen.contents
    folder.mkdir(parents=True, exist_ok=True)
    if not there:
        said(folder, "init", "-q", "-b", "main")
    for name in set(said(folder, "ls-files", "-z").split("\0")) - {"", *contents}:
        (folder / name).unlink(missing_ok=True)
    for name, data in contents.items():
        write_atomically(folder / name, data)
        (folder / name).chmod(0o755 if os.access(course / name, os.X_OK) else 0o644)
    first = min((name for name in contents if re.fullmatch(r"lessons/[^/]*\.ipynb", name)), default="")
    if "README.md" in contents:
        page = below_title(contents["README.md"].decode("utf-8"), badges(folder, here, first))
        write_atomically(folder / "README.md", page.encode())
    said(folder, "add", "-u")
    said(folder, "add", "-f", "--", *sorted(contents))
    said(folder, *AUTHOR, "commit", "-q", "-m", "Released", "--allow-empty")
    return Bundle(sorted(contents), chosen.left_out, chosen.tracked)


def said(folder: Path, *words: str) -> str:
    """What a command of git's says; raises ValueError with its complaint."""
    done = git(folder, *words)
    if done.returncode:
        raise ValueError(f"repository: git {words[0]} failed in {folder}: {os.fsdecode(done.stderr).strip()}")
    return os.fsdecode(done.stdout)


def below_title(page: str, badges: Sequence[str]) -> str:
    """A page with badges below its title.

    >>> below_title("# A\\n\\nText.", ["b", "c"]), below_title("# A", [])
    ('# A\\n\\nb\\nc\\n\\nText.', '# A')
    """
    title, _, rest = page.partition("\n")
    return "\n".join([title, "", *badges, rest]) if badges else page
