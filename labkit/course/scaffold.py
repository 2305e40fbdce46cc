"""A new question, or a new lab, begun: all files that it needs, which work, with a TODO wherever an author must write.

What is written asks for the sum of each row, so that it can be checked, released and graded before anything is changed
in it. `left_to_do` finds what is not changed yet, and `make test` fails once for each.
"""

import io
import json
import keyword
import re
import tokenize
from pathlib import Path

from nbformat import NotebookNode
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook

from labkit.course.release import read, tidy, to_bytes
from labkit.support.files import write_atomically
from labkit.support.validation import require

# ------------------------------------------------------------------------------------------ what is written

QUESTION = '''"""TOPIC.NAME: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.checker.question import Question, wrong


def NAME(values):
    """Sum each row."""  # TODO the right answer, short and complete in itself
    return values.sum(axis=1)


def inputs(rng):
    """Draw the argument of one case."""  # TODO asymmetric arguments, so that exchanged axes, rows and units show
    rows = int(rng.integers(2, 6))
    return (rng.integers(-9, 10, (rows, rows + 2)),)


QUESTION = Question(
    name="TOPIC.NAME",
    reference=NAME,
    inputs=inputs,
    points=POINTS,
    by_hand=(  # TODO cases that can be done by hand, each with something that goes wrong in it
        (np.array([[1, 2, 3], [4, 5, 7]]),),
        (np.array([[5, 0, 0, -2]]),),
    ),
)


@wrong(QUESTION, "Which axis is left, rows or columns, after yours has been summed away?")
def columns_for_rows(values):  # TODO a mistake that students make; its hint asks or points, and never holds the answer
    return values.sum(axis=0)


@wrong(QUESTION, "A row of two equal numbers shows it: is a sum as large as one of them?")
def means_for_sums(values):  # TODO another mistake
    return values.mean(axis=1)
'''

NO_ALTERNATIVES = '''"""Right answers to the questions of TOPIC, written in other ways than the references."""

import numpy as np
'''

ALTERNATIVES = """

def NAME__loops(values):  # TODO a right answer as a student writes it
    return np.array([sum(row) for row in values])


def NAME__einsum(values):  # TODO another one, by other means
    return np.einsum("ij->i", values)


def NAME__torch(values):  # TODO a third one
    import torch

    return torch.as_tensor(values).sum(1).numpy()
"""

TASK = """## Task NUMBER: TODO title (10 minutes)

TODO what the robot needs it for, what is given, and an example that can be done by hand."""

ANSWER = '''def NAME(values):
    """TODO say what it returns, to somebody who reads nothing else of the lab.

    values: integers (H, W). TODO each argument with its shape and units. Returns integers (H,). Do not change values.

    >>> np.asarray(NAME(np.array([[1, 2, 3], [4, 5, 7]]))).tolist()
    [6, 16]
    """
    ### BEGIN SOLUTION
    # TODO the right answer; half of a lab's points are for steps of no lesson: "# New step: ..." says what is new
    return values.sum(axis=1)
    ### END SOLUTION'''

HINTS = """<details><summary>Hint 1</summary>TODO a question that leads to the first step.</details>
<details><summary>Hint 2</summary>TODO what to look up.</details>
<details><summary>Hint 3</summary>TODO the way, but not the line.</details>"""

TOPIC = '"""Questions of topic DIGITS: TODO what they are about."""\n'

START = """# Lab DIGITS: TODO title

TODO which question of a robot this lab answers, in three sentences.

| task | you write | minutes |
|---|---|---|
| | a written question | 15 |

15 minutes in all. Each blank has a check below it that says at once whether it is right. If yours is not ready, the lab
goes on with the kit's own function, so that no task blocks the next."""

IMPORTS = """import matplotlib.pyplot as plt

import data_gen
from labkit import check
from labkit.course.plots import panels, style
from labkit.labels import overlay

style()"""

DATA = """## The data

TODO what the data are, and what to notice in the picture. About 5 seconds."""

PICTURE = """frame = data_gen.render(data_gen.sample_scene(1, "test"), (320, 240))
panels({"the camera's image": frame.rgb, "its true labels": overlay(frame.rgb, frame.labels)})
plt.show()"""

WRITTEN = """## Written question (15 minutes)

TODO a derivation or an interpretation, in numbered parts."""

MODEL_ANSWER = """TODO the model answer, part by part, in 500 characters or more.

**Rubric (2 points).**

- 1 point: TODO
- 1 point: TODO"""

END = """## Before you hand in

Save the notebook (Ctrl+S), then run the last cell. It checks the saved file as the grader will: each answer in \
a fresh process, with what it needs of your other cells and nothing else. What is ticked here is right there."""

ROW = "| DIGITS WORDS | | [lab](labs/TOPIC/TOPIC.ipynb) | TODO where in the kit, and a lesson if there is one |\n"


def filled(template: str, topic: str, name: str = "", number: int = 0, points: int = 0) -> str:
    """Put names and numbers into a template."""
    digits, _, words = topic.partition("_")
    values = {"TOPIC": topic, "NAME": name, "DIGITS": digits, "WORDS": words.replace("_", " ")}
    values |= {"NUMBER": str(number), "POINTS": str(points)}
    return re.sub("|".join(values), lambda found: values[found[0]], template)


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
    expected = f"a topic and a function; `labkit new lab {topic}` begins a topic that is not there"
    require("name", known, expected, repr(name))
    fits = re.fullmatch(r"[a-z][a-z0-9]*(_[a-z0-9]+)*", function) and not keyword.iskeyword(function)
    require("name", fits, "lower-case letters, digits and single underscores behind the dot", repr(name))
    notebook, module = read(solution), folder / f"{function}.py"
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
        module: filled(QUESTION, topic, function, points=points).encode(),
        answers: (right + filled(ALTERNATIVES, topic, function)).encode(),
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
    """Begin a lab such as "10_instances", without a question yet; returns the files written.

    These are the topic's module, the solution, and README, whose table of topics gets a row. course: a checkout.
    Raises ValueError, and writes nothing, if the name is not two digits and an identifier, or its number is taken.
    """
    course = checkout(course)
    require("topic", re.fullmatch(r"\d\d(_[a-z0-9]+)+", topic), "two digits, _ and a name: 10_instances", repr(topic))
    there = {path.parent.name for path in course.glob("solutions/*/*.ipynb")}
    there |= {path.parent.name.removeprefix("t") for path in course.glob("labkit/course/topics/t*/__init__.py")}
    taken = sorted(other for other in there if other[:2] == topic[:2])
    require("topic", not taken, f"a number that is free, not that of {', '.join(taken)}", repr(topic))
    readme = course / "README.md"
    table, link, rest = readme.read_text(encoding="utf-8").rpartition("](labs/")
    last, line_end, rest = rest.partition("\n")
    files = {
        topic_folder(course, topic) / "__init__.py": filled(TOPIC, topic).encode(),
        solution_of(course, topic): to_bytes(tidy(lab_notebook(topic))),
        readme: (table + link + last + line_end + filled(ROW, topic) + rest).encode(),
    }
    return write_all(files)


def left_to_do(course: Path) -> list[str]:
    """List each TODO of questions, right answers, solutions and README: "FILE:LINE: what", or "FILE, cell ID: what"."""
    found = []
    for pattern in ("labkit/course/topics/t*/*.py", "tests/alternatives/t*.py", "README.md"):
        for path in sorted(course.glob(pattern)):
            for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
                found += [f"{path.relative_to(course)}:{number}: {todo}" for todo in todos(line)]
    for path in sorted(course.glob("solutions/*/*.ipynb")):
        for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
            place = f"{path.relative_to(course)}, cell {cell['id']}"
            found += [f"{place}: {todo}" for line in "".join(cell["source"]).splitlines() for todo in todos(line)]
    return found


def todos(line: str) -> list[str]:
    """The TODOs of a line.

    >>> todos("values: TODO its shape. Returns TODO its type.")
    ['TODO its shape. Returns', 'TODO its type.']
    """
    return [found.strip(' "|') for found in re.findall(r"\bTODO\b(?:(?!\bTODO\b|<).)*", line)]


# ----------------------------------------------------------------------------------------------- notebooks


def marked(cell: NotebookNode, grade_id: str, **mark) -> NotebookNode:
    """Mark a cell as nbgrader does."""
    cell.metadata["nbgrader"] = {
        "grade": False,
        "grade_id": grade_id,
        "locked": False,
        "schema_version": 3,
        "solution": False,
        "task": False,
    } | mark
    return cell


def lab_notebook(topic: str) -> NotebookNode:
    """A solution with data, a written question and no blank."""
    written = marked(new_markdown_cell(MODEL_ANSWER), f"{topic[3:]}_in_words", grade=True, solution=True, points=2)
    end = f'from labkit import check_file\n\ncheck_file("{topic}.ipynb")'
    cells = [
        new_markdown_cell(filled(START, topic)),
        marked(new_code_cell("import numpy as np"), "setup", locked=True),
        new_code_cell(IMPORTS, metadata={"tags": ["nbval-ignore-output"]}),
        new_markdown_cell(DATA),
        new_code_cell(PICTURE),
        new_markdown_cell(WRITTEN),
        written,
        new_markdown_cell(END),
        new_code_cell(end),
    ]
    return new_notebook(cells=cells)


def add_task(notebook: NotebookNode, topic: str, function: str, points: int) -> None:
    """Add a task of ten minutes before the written question, if that has a cell of its own, else before the end.

    The beginning of the lab tells of it: its minutes, and a row if there is a table of tasks.
    """
    headings = [cell.source if cell.cell_type == "markdown" else "" for cell in notebook.cells]
    numbers = re.findall(r"^## Task (\d+)", "\n".join(headings), re.MULTILINE)
    number = 1 + max(map(int, numbers), default=0)
    starts = [i for i, text in enumerate(headings) if text.startswith(("## Written question", "## Before you hand in"))]
    place = min(starts, default=len(headings))
    call = f'{function} = check("{topic}.{function}", {function})'
    notebook.cells[place:place] = [
        new_markdown_cell(filled(TASK, topic, function, number)),
        marked(new_code_cell(filled(ANSWER, topic, function)), function, solution=True),
        marked(new_code_cell(call), f"check_{function}", grade=True, locked=True, points=points),
        new_markdown_cell(HINTS),
    ]
    row = f"| {number} | `{function}`: TODO in a few words | 10 |\n"
    start = next((i for i, text in enumerate(headings) if "minutes in all" in text), None)
    if start is not None:
        text = re.sub(r"\d+(?= minutes in all)", lambda total: str(int(total[0]) + 10), headings[start])
        rows = list(re.finditer(r"^\|(?:---\|)+\n|^\| \d+ \|.*\|\n", text, re.MULTILINE))
        notebook.cells[start].source = text[: rows[-1].end()] + row + text[rows[-1].end() :] if rows else text


# --------------------------------------------------------------------------------------------------- files


def checkout(course: Path) -> Path:
    """The folder itself; raises ValueError if it is no checkout."""
    parts = ("labkit/course/topics", "solutions", "tests/alternatives", "README.md")
    missing = [part for part in parts if not (Path(course) / part).exists()]
    require("course", not missing, f"a checkout, with {', '.join(parts)}", f"{course} without {', '.join(missing)}")
    return Path(course)


def topic_folder(course: Path, topic: str) -> Path:
    """Where a topic's questions are."""
    return course / "labkit" / "course" / "topics" / f"t{topic}"


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
