"""Solutions to labs: nbgrader's own converter clears the answers, and what it writes is made the same every time.

    solutions/04_iou/04_iou.ipynb  ->  labs/04_iou/04_iou.ipynb

The same command takes out of solutions and lessons what changes with every run and says nothing to a reader: times of
execution, the state of widgets, the version of Python. Their outputs stay.
"""

import ast
import hashlib
import logging
import os
import re
import shutil
import tempfile
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import nbformat
from nbformat import NotebookNode

from labgrader.course import asked as asked_in
from labgrader.course import course as course_here
from labgrader.course import is_taught, of_topic, topics
from labgrader.release.publishing import badges, published, unpublished, with_badges
from labgrader.support import git, write_atomically

KERNEL = {"display_name": "Python 3 (ipykernel)", "language": "python", "name": "python3"}
VOLATILE_CELL = ("execution", "ExecuteTime", "collapsed", "scrolled", "trusted")
WIDGET_VIEW = "application/vnd.jupyter.widget-view+json"
START = "START.md"  # what JupyterLab opens


def release(course: Path, topics: Sequence[str] = (), check: bool = False) -> list[Path]:
    """Tidy lessons and solutions, generate labs and the page on which students begin; returns what changed, in order.

    course: folder that holds lessons, solutions and labs. topics: whose labs; all that have a solution if none is
    given. check: change nothing, and return what would change. Raises ValueError, and changes nothing, if a topic has
    no solution or a solution is not an assignment (`mistakes` says why).
    """
    course = Path(course)
    written = {path.parent.name: path for path in sorted(course.glob("solutions/*/*.ipynb"))}
    solutions = {topic: path for topic, path in written.items() if is_taught(topic)}
    if not solutions:
        raise ValueError(f"course: expected a folder with solutions/TOPIC/TOPIC.ipynb, got {course}")
    unknown = [topic for topic in topics if topic not in solutions]
    if unknown:
        raise ValueError(f"topics: expected some of {', '.join(solutions)}, got {', '.join(unknown)}")
    chosen = {topic: path for topic, path in solutions.items() if not topics or topic in topics}
    lessons = [path for path in sorted(course.glob("lessons/*.ipynb")) if path.stem.startswith(tuple(topics) or "")]
    tidied = {path: to_bytes(as_published(course, path, read_notebook(path))) for path in lessons}
    tidied |= {path: to_bytes(tidy(unpublished(read_notebook(path), *place(course, path)))) for path in chosen.values()}
    made = {course / "labs" / topic: generate(path, tidied[path]) for topic, path in chosen.items()}
    left_over = [] if topics else [f for f in course.glob("labs/*") if f.is_dir() and f.name not in solutions]
    made |= {folder: {} for folder in left_over}
    changed = [path for path, data in tidied.items() if path.read_bytes() != data]
    drifted = {folder: differing(folder, files) for folder, files in made.items()}
    if not check:
        for folder, wrong in drifted.items():
            put_right(folder, made[folder], wrong)
        for path in changed:
            write_atomically(path, tidied[path])
    pages = {course / name: text for name, text in own_pages(course).items()}
    stale = [page for page, text in pages.items() if not page.is_file() or page.read_text(encoding="utf-8") != text]
    for page in () if check else stale:
        write_atomically(page, pages[page].encode())
    return [*changed, *(path for differ in drifted.values() for path in differ), *stale]


def place(course: Path, path: Path) -> tuple[str, Path]:
    """A file's name from the course's folder on, and the folder."""
    return path.relative_to(course).as_posix(), course


def as_published(course: Path, path: Path, notebook: NotebookNode) -> NotebookNode:
    """A notebook, tidied, as it stands where the course is published (`labgrader.release.publishing`)."""
    name, root = place(course, path)
    return nbformat.from_dict(published(tidy(unpublished(notebook, name, root)), name, root, course_here()))


def read_notebook(path: Path) -> NotebookNode:
    """Read a notebook; raises ValueError with its name if it is none."""
    try:
        return nbformat.from_dict(nbformat.read(path, as_version=4))
    except Exception as error:  # nbformat raises many kinds
        raise ValueError(f"{path}: expected a notebook, but it cannot be read: {error}") from error


def to_bytes(notebook: NotebookNode) -> bytes:
    """Write a notebook as the bytes of its file."""
    nbformat.validate(notebook)
    return (nbformat.writes(notebook) + "\n").encode()


def tidy(notebook: NotebookNode) -> NotebookNode:
    """Copy a notebook without what is volatile; its outputs stay, of a widget the picture and the text.

    >>> from nbformat.v4 import new_code_cell, new_notebook
    >>> cell = new_code_cell("1 + 1", metadata={"execution": {"iopub.status.busy": "2024-01-01"}})
    >>> tidied = tidy(new_notebook(cells=[cell], metadata={"language_info": {"name": "python", "version": "3.11.2"}}))
    >>> dict(tidied.cells[0].metadata), dict(tidied.metadata.language_info)
    ({}, {'name': 'python'})
    """
    notebook = nbformat.from_dict(notebook)
    notebook.metadata.pop("widgets", None)
    notebook.metadata["kernelspec"] = dict(KERNEL)
    notebook.metadata["language_info"] = {"name": "python"}
    notebook.nbformat, notebook.nbformat_minor = 4, 5
    seen = Counter()
    for cell in notebook.cells:
        for key in VOLATILE_CELL:
            cell.metadata.pop(key, None)
        for output in cell.get("outputs", []):
            output.get("data", {}).pop(WIDGET_VIEW, None)
            if "metadata" in output:
                output["metadata"] = {}
        cell["id"] = cell_id(cell, seen)
    return notebook


def cell_id(cell: NotebookNode, seen: Counter) -> str:
    """Name a cell: by its grade id, else by its text, numbered where the same occurs again."""
    name = cell.metadata.get("nbgrader", {}).get("grade_id")
    name = name or hashlib.sha256(f"{cell.cell_type}\n{cell.source}".encode()).hexdigest()[:8]
    seen[name] += 1
    return name if seen[name] == 1 else f"{name}-{seen[name]}"


# ------------------------------------------------------------------------------------------------ generating


def generate(solution: Path, tidied: bytes) -> dict[str, bytes]:
    """Make a lab from a solution: what its folder holds, by relative path. `tidied`: the solution's tidied bytes."""
    topic = solution.parent.name
    if wrong := mistakes(nbformat.reads(tidied.decode(), as_version=4), topic):
        raise ValueError(f"{solution}: expected an assignment, but {'; '.join(wrong)}")
    with tempfile.TemporaryDirectory() as folder:
        course = Path(folder)
        source = course / "solutions" / topic
        for path in belonging(solution.parent):
            (source / path.relative_to(solution.parent)).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(path, source / path.relative_to(solution.parent))
        (source / solution.name).write_bytes(tidied)
        convert(course, topic)
        files = sorted(path for path in (course / "labs" / topic).rglob("*") if path.is_file())
        made = {path.relative_to(course / "labs" / topic).as_posix(): path.read_bytes() for path in files}
    lab = tidy(nbformat.reads(made[solution.name].decode(), as_version=4))
    for cell, source in zip(lab.cells, nbformat.reads(tidied.decode(), as_version=4).cells, strict=True):
        cell["id"] = source.id  # a lab's cells are found again in the solution
    lab.metadata[course_here().metadata] = {"version": course_here().version, "tasks": task_names(lab)}
    course = solution.parents[2]
    lab = nbformat.from_dict(published(lab, f"labs/{topic}/{solution.name}", course, course_here()))
    return made | {solution.name: to_bytes(lab)}


def belonging(folder: Path) -> list[Path]:
    """The files of a solution's or a lab's folder, without hidden ones, caches, and what git ignores.

    That is what running a notebook leaves behind, such as its table of attempts: no part of a release.
    """
    left_behind = shutil.ignore_patterns(".*", "*.tmp", "__pycache__")
    names = [path.relative_to(folder) for path in sorted(folder.rglob("*")) if path.is_file()]
    names = [name.as_posix() for name in names if not left_behind("", name.parts)]
    try:
        said = git(folder, "-c", "core.quotePath=false", "check-ignore", "--", *names).stdout
        ignored = set(os.fsdecode(said).splitlines())
    except OSError:  # no git
        ignored = set()
    return [folder / name for name in names if name not in ignored]


def task_names(lab: NotebookNode) -> dict[str, str]:
    """A short name for each task as its blank states it, so that grading knows a lab of another version of the kit."""
    cells = {cell.metadata.nbgrader.grade_id: cell for cell in lab.cells if "nbgrader" in cell.metadata}
    blanks = {
        name: cell.source for name, cell in cells.items() if cell.cell_type == "code" and f"check_{name}" in cells
    }
    return {name: hashlib.sha256(source.encode()).hexdigest()[:12] for name, source in blanks.items()}


def convert(course: Path, topic: str) -> None:
    """Run nbgrader's generate_assignment without its database; raises ValueError with what it logs."""
    from nbgrader.converters import GenerateAssignment
    from nbgrader.converters.base import NbGraderException
    from nbgrader.coursedir import CourseDirectory
    from traitlets.config import Config

    said = []
    log = logging.Logger("labgrader.release.release")
    log.addHandler(handler := logging.Handler(logging.ERROR))
    handler.emit = lambda record: said.append(record.getMessage().strip().splitlines()[-1])
    config = Config()
    config.CourseDirectory.root = str(course)
    config.CourseDirectory.source_directory = "solutions"
    config.CourseDirectory.release_directory = "labs"
    config.CourseDirectory.assignment_id = topic
    config.GenerateAssignment.no_database = True
    config.GenerateAssignment.force = True
    config.SaveCells.enabled = False
    config.ClearSolutions.code_stub = {"python": "# your lines\nraise NotImplementedError"}
    config.ClearSolutions.text_stub = course_here().no_text
    converter = GenerateAssignment(coursedir=CourseDirectory(config=config, log=log), config=config, log=log)
    try:
        converter.start()
    except NbGraderException as error:
        raise ValueError(f"{topic}: nbgrader could not make the lab: {'; '.join(said) or error}") from error


def differing(folder: Path, files: dict[str, bytes]) -> list[Path]:
    """Files of a folder that are not what they should be: other bytes, missing, or too many."""
    there = {path.relative_to(folder).as_posix() for path in belonging(folder)}
    wrong = {name for name in there & files.keys() if (folder / name).read_bytes() != files[name]}
    return [folder / name for name in sorted(wrong | (there ^ files.keys()))]


def put_right(folder: Path, files: dict[str, bytes], wrong: Sequence[Path]) -> None:
    """Write what should be in a folder in the place of its wrong files, and remove what should not; {} removes it."""
    for path in wrong:
        name = path.relative_to(folder).as_posix()
        if name in files:
            write_atomically(path, files[name])
        else:
            path.unlink()
    if not files:
        shutil.rmtree(folder)


# ------------------------------------------------------------------------------------ where students begin


def own_pages(course: Path) -> dict[str, str]:
    """The pages that a release writes into the folder of the course here, by name: START.md, and README's badges."""
    here, pages = course_here(), {}
    if course.resolve() != here.root:
        return pages
    if here.start:
        pages[START] = start_page(course)
    readme, first = course / "README.md", next(iter(sorted(course.glob("lessons/*.ipynb"))), None)
    if readme.is_file() and first:
        found = badges(course, here, first.relative_to(course).as_posix())
        pages[readme.name] = with_badges(readme.read_text(encoding="utf-8"), found)
    return pages


def start_page(course: Path, topics: Sequence[str] = ()) -> str:
    """The page on which students begin: the course's template, with a row per topic in the place of ROWS."""
    here, rows = course_here(), []
    labs = sorted(path.parent.name for path in course.glob("labs/*/*.ipynb"))
    for topic in topics or filter(is_taught, labs):
        lessons = [path for path in sorted((course / "lessons").glob("*.ipynb")) if path.stem.startswith(topic)]
        lab = course / "labs" / topic / f"{topic}.ipynb"
        cells = [", ".join(link(course, path) for path in paths) for paths in (lessons, [lab])]
        rows.append(f"| {topic.replace('_', ' ')} | {cells[0]} | {cells[1]} |")
    return (here.root / here.start).read_text(encoding="utf-8").replace("ROWS", "\n".join(rows))


def link(course: Path, path: Path) -> str:
    """A notebook's title that leads to it; a title's number, which the row has already, is left out."""
    title = read_notebook(path).cells[0].source.splitlines()[0].removeprefix("# ").removeprefix("Lab ")
    title = re.sub(r"^\d\d(, \w+)?\W+", "", title)
    return f"[{title[:1].upper()}{title[1:]}]({path.relative_to(course).as_posix()})"


# ---------------------------------------------------------------------------------- what an assignment must be


def mistakes(notebook: NotebookNode, topic: str) -> list[str]:
    """Say why a solution cannot be released and graded; an empty list if it can.

    An answer cell defines the function that its grade id names, holds a marked solution, and has one tests cell
    `check_NAME`, worth the points of the question if the kit has one. A locked cell `setup` comes first of all. Each
    question that a cell checks is one of the kit's.
    """
    graded = [(cell, cell.metadata["nbgrader"]) for cell in notebook.cells if "nbgrader" in cell.metadata]
    ids = [data["grade_id"] for _, data in graded]
    found = [f"grade id {name} occurs twice" for name, count in Counter(ids).items() if count > 1]
    answers = {data["grade_id"]: cell for cell, data in graded if cell.cell_type == "code" and data["solution"]}
    tests = {
        data["grade_id"]: data.get("points") for cell, data in graded if cell.cell_type == "code" and data["grade"]
    }
    if not ids or ids[0] != "setup" or not graded[0][1]["locked"]:
        found.append("its first graded cell is not a locked `setup`")
    for name, cell in answers.items():
        if name not in functions(cell.source):
            found.append(f"cell {name} defines no function {name}")
        if "### BEGIN SOLUTION" not in cell.source or "### END SOLUTION" not in cell.source:
            found.append(f"cell {name} marks no solution")
        if f"check_{name}" not in tests:
            found.append(f"{name} has no tests cell check_{name}")
    found += [f"{name} tests no answer" for name in tests if name.removeprefix("check_") not in answers]
    called = "\n".join(cell.source for cell in notebook.cells if cell.cell_type == "code")
    asked = dict.fromkeys(re.findall(r"\bcheck\(\s*[\"'](\w+\.\w+)[\"']", called))
    if topic in topics():
        questions = asked_in(topic)
        asked |= dict.fromkeys(f"{topic}.{name}" for name in answers)
        for name in answers.keys() & questions.keys():
            if tests.get(f"check_{name}") not in (None, questions[name].points):
                found.append(f"check_{name} has {tests[f'check_{name}']} points, its question {questions[name].points}")
        found += [f"no cell answers {topic}.{name}" for name in questions if name not in answers]
    return found + [f"there is no question {name}" for name in asked if not exists(name)]


def exists(name: str) -> bool:
    """Whether the kit has a question of this name, such as "04_iou.iou"."""
    topic, _, function = name.partition(".")
    return topic in topics() and function in of_topic(topic)


def functions(source: str) -> set[str]:
    """Names of the functions that a cell defines at its top level."""
    try:
        return {node.name for node in ast.parse(source).body if isinstance(node, ast.FunctionDef)}
    except SyntaxError:
        return set()
