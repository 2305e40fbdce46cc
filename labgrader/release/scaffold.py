"""A new question, or a new lab, begun: all files that it needs, which work, with a TODO wherever an author must write.

What is written asks for the sum of each row, so that it can be checked, released and graded before anything is changed
in it. `make test` fails once for each TODO that is left.
"""

import io
import keyword
import re
import tokenize
from pathlib import Path

from nbformat import NotebookNode, reads
from nbformat.v4 import new_code_cell, new_markdown_cell

from labgrader.course import course as course_here
from labgrader.release.release import read_notebook, tidy, to_bytes
from labgrader.support import require, write_atomically

NO_ALTERNATIVES = '''"""Right answers to the questions of TOPIC, written in other ways than the references."""

import numpy as np
'''
TOPIC = '"""Questions of topic DIGITS: TODO what they are about."""\n'
ROW = "| DIGITS WORDS | | [lab](labs/TOPIC/TOPIC.ipynb) | TODO where in the kit, and a lesson if there is one |\n"


def template(name: str) -> str:
    """The text of a file that the course begins from."""
    return (course_here().root / course_here().templates / name).read_text(encoding="utf-8")


def filled(text: str, topic: str, name: str = "", number: int = 0, points: int = 0) -> str:
    """Put names and numbers into the text of a template."""
    digits, _, words = topic.partition("_")
    values = {"TOPIC": topic, "NAME": name, "DIGITS": digits, "WORDS": words.replace("_", " "), "GRADE": words}
    values |= {"NUMBER": str(number), "POINTS": str(points)}
    return re.sub("|".join(values), lambda found: values[found[0]], text)


# --------------------------------------------------------------------------------------------- the commands


def new_question(course: Path, name: str, points: int = 2) -> list[Path]:
    """Begin a question such as "04_iou.dice"; returns the files written: its module, right answers, the solution.

    course: a checkout. points: what it is worth. Raises ValueError, and writes nothing, if the topic is not there, or
    the name is no identifier or taken: by a question, by the topic's module, or by a cell of the solution.
    """
    course = checkout(course)
    topic, _, function = name.partition(".")
    folder, solution = topic_folder(course, topic), solution_of(course, topic)
    require("points", points >= 1, "at least 1", points)
    known = (folder / "__init__.py").is_file() and solution.is_file()
    expected = f"a topic and a function; `{course_here().command} new lab {topic}` begins a topic that is not there"
    require("name", known, expected, repr(name))
    fits = re.fullmatch(r"[a-z][a-z0-9]*(_[a-z0-9]+)*", function) and not keyword.iskeyword(function)
    require("name", fits, "lower-case letters, digits and single underscores behind the dot", repr(name))
    notebook, module = read_notebook(solution), folder / f"{function}.py"
    graded = [cell.metadata.nbgrader.grade_id for cell in notebook.cells if "nbgrader" in cell.metadata]
    cells = "\n".join([cell.source for cell in notebook.cells if cell.cell_type == "code"] + graded)
    shared = (folder / "__init__.py").read_text(encoding="utf-8")
    free = not (module.exists() or is_used(function, cells) or is_used(function, shared))
    expected = f"a name that neither the questions of {topic} nor the cells of its solution have already"
    require("name", free, expected, repr(name))
    answers = course / "tests" / "alternatives" / f"t{topic}.py"
    right = answers.read_text(encoding="utf-8") if answers.exists() else filled(NO_ALTERNATIVES, topic)
    add_task(notebook, topic, function, points)
    files = {
        module: filled(template("question.txt"), topic, function, points=points).encode(),
        answers: (right + filled(template("alternatives.txt"), topic, function)).encode(),
        solution: to_bytes(tidy(notebook)),
    }
    return write_all(files)


def is_used(name: str, source: str) -> bool:
    """Whether a name stands in code, strings and comments aside.

    >>> [is_used("iou", source) for source in ("iou = 1", "def iou(n): pass", "n.iou", "# iou")]
    [True, True, False, False]
    """
    tokens = list(tokenize.generate_tokens(io.StringIO(source).readline))
    pairs = zip([None, *tokens], tokens, strict=False)
    return any(token.string == name and (before is None or before.string != ".") for before, token in pairs)


def new_lab(course: Path, topic: str) -> list[Path]:
    """Begin a lab such as "11_instances", without a question yet; returns the files written.

    These are the topic's module, the solution, and README, whose table of topics gets a row. course: a checkout.
    Raises ValueError, and writes nothing, if the name is not two digits and an identifier, or its number is taken.
    """
    course = checkout(course)
    require("topic", re.fullmatch(r"\d\d(_[a-z0-9]+)+", topic), "two digits, _ and a name: 11_instances", repr(topic))
    there = {path.parent.name for path in course.glob("solutions/*/*.ipynb")}
    there |= {path.parent.name.removeprefix("t") for path in (course / questions_folder()).glob("t*/__init__.py")}
    taken = sorted(other for other in there if other[:2] == topic[:2])
    require("topic", not taken, f"a number that is free, not that of {', '.join(taken)}", repr(topic))
    readme = course / "README.md"
    table, link, rest = readme.read_text(encoding="utf-8").rpartition("](labs/")
    last, line_end, rest = rest.partition("\n")
    files = {
        topic_folder(course, topic) / "__init__.py": filled(TOPIC, topic).encode(),
        solution_of(course, topic): to_bytes(tidy(notebook_of(filled(template("lab.ipynb"), topic)))),
        readme: (table + link + last + line_end + filled(ROW, topic) + rest).encode(),
    }
    return write_all(files)


# ----------------------------------------------------------------------------------------------- notebooks


def notebook_of(text: str) -> NotebookNode:
    """A notebook of a template's text, whose cells have ids of their own."""
    notebook = reads(text, as_version=4)
    for cell in notebook.cells:
        cell.id = new_code_cell().id
    return notebook


def add_task(notebook: NotebookNode, topic: str, function: str, points: int) -> None:
    """Add a task of ten minutes after the last blank's section, so before the written question and the sources.

    The beginning of the lab tells of it: its minutes, and a row if there is a table of tasks. If the written question
    is a task with a number, that one becomes the new task's, and hers the next.
    """
    place = split_at_end(notebook)
    texts = [cell.source if cell.cell_type == "markdown" else "" for cell in notebook.cells]
    before, after = (re.findall(TASK, "\n".join(part), re.MULTILINE) for part in (texts[:place], texts[place:]))
    number = min(map(int, after)) if after else 1 + max(map(int, before), default=0)
    for cell in notebook.cells[place:]:
        if cell.cell_type == "markdown":
            cell.source = re.sub(TASK, lambda found: f"## Task {int(found[1]) + 1}", cell.source, flags=re.MULTILINE)
    task = notebook_of(filled(template("task.ipynb"), topic, function, number)).cells
    task[2].metadata.nbgrader.points = points
    notebook.cells[place:place] = task
    start = next((i for i, text in enumerate(texts) if "minutes in all" in text), None)
    if start is not None:
        text = re.sub(r"\d+(?= minutes in all)", lambda total: str(int(total[0]) + 10), texts[start])
        notebook.cells[start].source = with_row(text, number, f"`{function}`: TODO in a few words | 10")


TASK = r"^## Task (\d+)"
LAST = ("## Sources", "## Before you hand in")


def split_at_end(notebook: NotebookNode) -> int:
    """Where a lab's last part begins: at the written question behind its blanks, else at its sources, else its end.

    If that heading stands within a cell, the cell is cut in two there.
    """
    answers = [i for i, cell in enumerate(notebook.cells) if cell.metadata.get("nbgrader", {}).get("solution")]
    blank = max((i for i in answers if notebook.cells[i].cell_type == "code"), default=-1)
    written = min((i for i in answers if i > blank), default=len(notebook.cells))
    found = None
    for i, cell in enumerate(notebook.cells):
        for heading in re.finditer(r"^## .*", cell.source, re.MULTILINE) if cell.cell_type == "markdown" else ():
            if blank < i < written or (found is None and heading[0].startswith(LAST)):
                found = i, heading.start()
    if found is None:
        return len(notebook.cells)
    i, at = found
    if not at:
        return i
    rest = new_markdown_cell(notebook.cells[i].source[at:])
    notebook.cells[i].source = notebook.cells[i].source[:at].rstrip()
    notebook.cells.insert(i + 1, rest)
    return i + 1


def with_row(text: str, number: int, row: str) -> str:
    """A text whose table of tasks has one more row, behind that of the task before; later ones count one more."""
    lines = text.splitlines(keepends=True)
    place = next((i + 1 for i, line in enumerate(lines) if re.fullmatch(r"\|(---\|)+\n", line)), None)
    for i, line in enumerate(lines):
        if found := re.match(r"\| (\d+) \|", line):
            if int(found[1]) < number:
                place = i + 1
            else:
                lines[i] = f"| {int(found[1]) + 1} |{line[found.end() :]}"
    if place is not None:
        lines.insert(place, f"| {number} | {row} |\n")
    return "".join(lines)


# --------------------------------------------------------------------------------------------------- files


def checkout(course: Path) -> Path:
    """The folder itself; raises ValueError if it is no checkout."""
    parts = (questions_folder(), "solutions", "tests/alternatives", "README.md")
    missing = [part for part in parts if not (Path(course) / part).exists()]
    require("course", not missing, f"a checkout, with {', '.join(parts)}", f"{course} without {', '.join(missing)}")
    return Path(course)


def topic_folder(course: Path, topic: str) -> Path:
    """Where a topic's questions are."""
    return course / questions_folder() / f"t{topic}"


def questions_folder() -> str:
    """Where the questions are in a checkout."""
    return course_here().questions.replace(".", "/")


def solution_of(course: Path, topic: str) -> Path:
    """Where a topic's solution is."""
    return course / "solutions" / topic / f"{topic}.ipynb"


def write_all(files: dict[Path, bytes]) -> list[Path]:
    """Write files, all of them, or none when something fails."""
    before = {path: path.read_bytes() for path in files if path.exists()}
    folders = [path.parent for path in files if not path.parent.exists()]
    try:
        for path, data in files.items():
            write_atomically(path, data)
    except BaseException:
        for path in files:
            path.unlink(missing_ok=True)
        for path, data in before.items():
            path.write_bytes(data)
        for folder in filter(Path.exists, folders):
            folder.rmdir()
        raise
    return list(files)
