"""Which course is graded here: where its questions are, and what an answer may import.

A course says so in its pyproject.toml, and this package knows nothing else of it:

    [tool.labgrader]
    questions = "sums.questions"  # a package: a folder t01_adding per topic, in it a module with a QUESTION per blank;
                                  # RETIRED = ("adds_three",) in its __init__: what the lab asks no more
    packages = ["numpy"]          # what an answer may import beside the standard library
    kit = ["sums"]                # the course's own packages, which no answer may import
    command = "lab"               # what a student and an instructor type; messages name it

Its questions are Python, which runs, so its user says which course it is: the one that `use` or LABGRADER_COURSE
named; else that of the working directory or a folder above it, if it was trusted (`labgrader.trust`) or its package is
imported already; else the one that this package was installed with. Any other course around the working directory is
refused in words, and nothing of it is imported. A copy of the installed course is that course. Questions are imported
when they are asked for.
"""

import functools
import importlib
import importlib.util
import os
import pkgutil
import re
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from labgrader.languages import CHOSEN, ENGLISH, translated
from labgrader.question import Question
from labgrader.trust import is_of_another_account, is_trusted, keep_trusted, refusal

FILE = "pyproject.toml"
MOST_BYTES = 1 << 20  # of such a file
NAMED = "LABGRADER_COURSE"  # the environment variable that `use` sets, so that processes started later know it, too
HERE = Path(__file__).resolve().parent


@dataclass(frozen=True)
class Course:
    """What a course says of itself.

    root: the folder from which its packages can be imported; file: its pyproject.toml. version: of its project. copied:
    the packages of kit whose functions an answer may have copied, which is flagged. bundle: folders and files of what
    students get; withheld: those of them, and folders in them, that they do not get. templates: folder in root of what
    `new` begins from.
    start: file in root with the page on which students begin; weeks: the topics of each week, one a week if it is not
    said. ignored: the label of what nobody judged, if the course has one; no_text: what a text that is to be written
    holds in a released lab. language: of hints, "de", where they were translated (`labgrader.languages`). dropped:
    topics that are there and not taught: no lab is released, no page or bundle has them. metadata: the key of a
    released notebook's metadata that says the version. project: its name; repository and site: its addresses, of
    [project]; wheel: what installs it elsewhere (`labgrader.release.publishing`), and extras: what of its optional
    dependencies a topic needs there.
    """

    root: Path
    file: Path
    questions: str
    packages: tuple[str, ...]
    command: str
    kit: tuple[str, ...] = ()
    copied: tuple[str, ...] = ()
    version: str = "0"
    bundle: tuple[str, ...] = ("lessons", "labs", FILE)
    withheld: tuple[str, ...] = ()
    templates: str = ""
    start: str = ""
    weeks: tuple[tuple[str, ...], ...] = ()
    ignored: int | None = None
    no_text: str = "*Your answer.*"
    metadata: str = "labgrader"
    language: str = ENGLISH
    dropped: tuple[str, ...] = ()
    project: str = ""
    repository: str = ""
    site: str = ""
    wheel: str = ""
    extras: dict[str, str] = field(default_factory=dict)


def use(folder: Path) -> None:
    """Take the course of a folder, from now on and in the processes that this one starts; others stay as they are.

    A folder without settings of its own, which may hold labs of the installed course, names none: what stands above it
    may be anybody's.
    """
    if settings_in(Path(folder)):
        os.environ[NAMED] = str(Path(folder).resolve())


def course() -> Course:
    """The course; raises ValueError if there is none, or if nobody said that the one around here is to be trusted."""
    named = os.environ.get(NAMED)
    return course_named(named) if named else course_around(os.getcwd())


def environment() -> dict[str, str]:
    """The variable by which a process that is started has this course, if it has a folder of its own."""
    here = course()
    return {NAMED: str(here.root)} if here.file.parent == here.root else {}


@functools.cache
def course_named(folder: str) -> Course:
    """The course of a folder that somebody named."""
    if not settings_in(Path(folder)):
        raise ValueError(f"{NAMED}: expected a folder that has a {FILE} with [tool.labgrader], got {folder}")
    return read_course(Path(folder).resolve() / FILE)


@functools.cache
def course_around(folder: str) -> Course:
    """The course of a folder or of one above it, if it may be; the installed one where there is none."""
    own, path = installed(), file_above(Path(folder))
    if path is None or path == own or (own is not None and questions_of(path) == questions_of(own)):
        if own is None:
            raise ValueError(f"course: expected a {FILE} with [tool.labgrader] in {folder} or above it, found none")
        return read_course(own)
    if is_trusted(path.parent) or is_imported(str(questions_of(path)), path.parent):
        return read_course(path)
    raise ValueError(refusal(path, questions_of(path), read_course(own).command if own else "COMMAND"))


def read_course(path: Path) -> Course:
    """The course of a file, whose packages can be imported from now on."""
    settings = tomllib.loads(path.read_text(encoding="utf-8"))
    said = {name: tuple(v) if isinstance(v, list) else v for name, v in settings["tool"]["labgrader"].items()}
    unknown = said.keys() - Course.__dataclass_fields__.keys() | {"questions", "packages", "command"} - said.keys()
    if unknown:
        raise ValueError(f"{path}: [tool.labgrader] holds {', '.join(Course.__dataclass_fields__)}; see {min(unknown)}")
    root = HERE.parent if path.parent == HERE else path.parent
    if str(root) not in sys.path:
        sys.path.append(str(root))
    project = settings.get("project", {})
    of_project = {"version": str(project.get("version", "0")), "project": project.get("name", "")}
    urls = project.get("urls", {})
    of_project |= {"repository": urls.get("Repository", ""), "site": urls.get("Documentation", "")}
    return Course(root, path, **of_project | said)


def installed() -> Path | None:
    """The settings of the course that this package was installed with, in a wheel or from its folder."""
    return next((place / FILE for place in (HERE, HERE.parent) if settings_in(place)), None)


def file_above(folder: Path) -> Path | None:
    """The nearest settings in a folder or above it; another account's are nobody's, unless they are trusted."""
    for place in (folder, *folder.parents):
        path = place / FILE
        if settings_in(place) and (path == installed() or is_trusted(place) or not is_of_another_account(path)):
            return path
    return None


def settings_in(folder: Path) -> dict:
    """What a folder says of a course, {} if nothing; a file of a stranger's is read as one."""
    path = folder / FILE
    try:
        if not path.is_file() or path.stat().st_size > MOST_BYTES:
            return {}
        found = tomllib.loads(path.read_text(encoding="utf-8"))["tool"]["labgrader"]
    except (OSError, ValueError, RecursionError, LookupError, TypeError):
        return {}
    return found if isinstance(found, dict) else {}


def questions_of(path: Path) -> object:
    """Where a course says that its questions are."""
    return settings_in(path.parent).get("questions")


def is_imported(questions: str, root: Path) -> bool:
    """Whether a course's package was imported from its folder already: its code has run in this process."""
    module = sys.modules.get(questions.partition(".")[0])
    return any(Path(place).resolve().is_relative_to(root) for place in getattr(module, "__path__", ()))


# ---------------------------------------------------------------------------------------------- its questions


def topics() -> tuple[str, ...]:
    """The topics that have a folder of questions, in order: "01_labels", ..."""
    names = sorted(name.removeprefix("t") for name in modules_in(course().questions))
    return tuple(name for name in names if is_taught(name))


def is_taught(name: str) -> bool:
    """Whether a topic, or a file whose name begins with its number, is taught: none of the course's `dropped`."""
    return not any(name.startswith(f"{topic.partition('_')[0]}_") for topic in course().dropped)


def taught_rows(page: str) -> str:
    """A page of Markdown without those rows of its tables that link to lessons or labs of dropped topics alone."""
    kept = []
    for row in page.split("\n"):
        linked = re.findall(r"\]\([^)]*(?:lessons|labs)/([^)/]+)", row) if row.startswith("|") else []
        if not linked or any(is_taught(name) for name in linked):
            kept.append(row)
    return "\n".join(kept)


def of_topic(topic: str) -> dict[str, Question]:
    """Give the questions of a topic by their functions' names: of each module in the topic's folder its QUESTION.

    Those are there, too, that its lab asks no more. Raises ValueError for a topic that there is not.
    """
    if topic not in topics():
        raise ValueError(f"topic: expected one of {', '.join(topics())}, got {topic!r}{of_another_copy()}")
    folder = f"{course().questions}.t{topic}"
    return {name: question_of(f"{folder}.{name}", chosen_language()) for name in modules_in(folder)}


def of_another_copy() -> str:
    """What to say of a topic that there is not, where the folder around is another copy of the installed course."""
    path, here = file_above(Path(os.getcwd())), course()
    if path is None or path.parent == here.root or questions_of(path) != here.questions:
        return ""
    return f"; this Python has the course of {here.root}, not that of {path.parent}: start the Python of that folder"


def chosen_language() -> str:
    """The language of hints: that of the environment, else that of the course."""
    return os.environ.get(CHOSEN) or course().language


@functools.cache
def question_of(name: str, language: str) -> Question:
    """The QUESTION of a module, in a language as far as it was translated."""
    module = importlib.import_module(name)
    return translated(module.QUESTION, Path(module.__file__), language)


def asked(topic: str) -> dict[str, Question]:
    """Give the questions that a topic's lab asks, by their functions' names: all but those of its folder's RETIRED.

    A lab that was released when it asked those, too, is checked and graded all the same. Raises as `of_topic` does.
    """
    questions, folder = of_topic(topic), importlib.import_module(f"{course().questions}.t{topic}")
    return {name: question for name, question in questions.items() if name not in getattr(folder, "RETIRED", ())}


def find(name: str) -> Question:
    """Find a question by its name, such as "04_iou.iou"; raises ValueError, and lists the names that there are."""
    topic, _, function = name.partition(".")
    questions = of_topic(topic)
    if function not in questions:
        raise ValueError(f"name: expected one of {', '.join(q.name for q in questions.values())}, got {name!r}")
    return questions[function]


def modules_in(package: str) -> list[str]:
    """Names of the modules and packages in a package."""
    return [module.name for module in pkgutil.iter_modules(importlib.import_module(package).__path__)]


def files_of(package: str, pattern: str = "*.py") -> Iterator[tuple[str, Path]]:
    """The files of an installed package, Python's by default, in order: name from the package on, and path."""
    spec = importlib.util.find_spec(package)
    folders = [Path(place) for place in (spec.submodule_search_locations if spec else None) or ()]
    for folder in folders:
        for path in sorted(folder.rglob(pattern)):
            yield f"{package.replace('.', '/')}/{path.relative_to(folder).as_posix()}", path


def trust(folder: Path) -> Path:
    """Trust the course of a folder from now on; returns the file that says so.

    Raises ValueError for a folder without a course.
    """
    folder = Path(folder).resolve()
    if not settings_in(folder) or not str(folder).isprintable():
        raise ValueError(f"folder: expected a course, with a {FILE} that has [tool.labgrader], got {folder}")
    return keep_trusted(folder)
