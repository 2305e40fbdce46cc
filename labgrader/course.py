"""Which course is graded here: where its questions are, and what an answer may import.

A course says so in its pyproject.toml, and this package knows nothing else of it:

    [tool.labgrader]
    questions = "sums.questions"  # a package: a folder t01_adding per topic, in it a module with a QUESTION per blank;
                                  # RETIRED = ("adds_three",) in its __init__: what the lab asks no more
    packages = ["numpy"]          # what an answer may import beside the standard library
    kit = ["sums"]                # the course's own packages, which no answer may import
    command = "lab"               # what a student and an instructor type; messages name it

The course is the one that `use` named, else that of the working directory or a folder above it, else the one that this
package was installed with. Questions are imported when they are asked for.
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

FILE = "pyproject.toml"
NAMED = "LABGRADER_COURSE"  # the environment variable that `use` sets, so that processes started later know it, too


@dataclass(frozen=True)
class Course:
    """What a course says of itself.

    root: the folder from which its packages can be imported; file: its pyproject.toml. version: of its project. copied:
    the packages of kit whose functions an answer may have copied, which is flagged. bundle: folders and files of what
    students get; withheld: those of them that they do not. templates: folder in root of what `new` begins from.
    start: file in root with the page on which students begin; weeks: the topics of each week, one a week if it is not
    said. ignored: the label of what nobody judged, if the course has one; no_text: what a text that is to be written
    holds in a released lab. language: of hints, "de", where they were translated (`labgrader.languages`). dropped:
    topics that are there and not taught: no lab is released, no page or bundle has them. metadata: the key of a
    released notebook's metadata that says the version. project and repository: its name and its address, of [project];
    wheel: what installs it elsewhere (`labgrader.release.publishing`), and extras: what of its optional dependencies a
    topic needs there.
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
    wheel: str = ""
    extras: dict[str, str] = field(default_factory=dict)


def use(folder: Path) -> None:
    """Take the course of a folder, from now on and in the processes that this one starts; others stay as they are."""
    if file_above(Path(folder).resolve()):
        os.environ[NAMED] = str(Path(folder).resolve())


def course() -> Course:
    """The course; raises ValueError if there is none."""
    return course_of(os.environ.get(NAMED) or os.getcwd())


@functools.cache
def course_of(folder: str) -> Course:
    """The course of a folder, else the one that came with this package."""
    here = Path(__file__).resolve().parent
    path = file_above(Path(folder)) or file_above(here)
    if path is None:
        raise ValueError(f"course: expected a {FILE} with [tool.labgrader] in {folder} or above it, found none")
    settings = tomllib.loads(path.read_text(encoding="utf-8"))
    said = {name: tuple(v) if isinstance(v, list) else v for name, v in settings["tool"]["labgrader"].items()}
    unknown = said.keys() - Course.__dataclass_fields__.keys() | {"questions", "packages", "command"} - said.keys()
    if unknown:
        raise ValueError(f"{path}: [tool.labgrader] holds {', '.join(Course.__dataclass_fields__)}; see {min(unknown)}")
    root = path.parent.parent if path.parent == here else path.parent
    if str(root) not in sys.path:
        sys.path.append(str(root))
    project = settings.get("project", {})
    of_project = {"version": str(project.get("version", "0")), "project": project.get("name", "")}
    of_project["repository"] = project.get("urls", {}).get("Repository", "")
    return Course(root, path, **of_project | said)


def file_above(folder: Path) -> Path | None:
    """The nearest pyproject.toml with [tool.labgrader], in a folder or above it."""
    for path in (place / FILE for place in (folder, *folder.parents)):
        try:
            if "labgrader" in tomllib.loads(path.read_text(encoding="utf-8")).get("tool", {}):
                return path
        except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError):
            continue
    return None


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
        raise ValueError(f"topic: expected one of {', '.join(topics())}, got {topic!r}")
    folder = f"{course().questions}.t{topic}"
    return {name: question_of(f"{folder}.{name}", chosen_language()) for name in modules_in(folder)}


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
