"""A small course for the grading tests: released labs made of the kit's questions, and submissions made of functions.

`as_cell` turns any function of the kit (a reference, a misconception, an alternative, a lambda) into the source that a
student would have handed in, with everything that it calls.
"""

import ast
import copy
import functools
import inspect
import io
import json
import logging
import os
import shutil
import tempfile
import types
from collections.abc import Callable, Iterable
from contextlib import chdir, suppress
from glob import glob
from pathlib import Path

import numpy as np
import pytest
from alternatives import alternatives

from labgrader.course import of_topic
from labgrader.grade.gradebook import opened
from labgrader.question import Question

ROOT = Path(__file__).parents[1]


def code_cell(source: str, grade_id: str | None = None, **mark) -> dict:
    """A code cell as JSON has it, with nbgrader's mark if it has a grade id."""
    full = {"grade": False, "solution": False, "locked": False, "task": False, "schema_version": 3} | mark
    metadata = {} if grade_id is None else {"nbgrader": full | {"grade_id": grade_id}}
    return {
        "cell_type": "code",
        "id": (grade_id or "cell").replace("_", "-"),
        "metadata": metadata,
        "source": source,
        "outputs": [],
        "execution_count": None,
    }


def written_cell(source: str) -> dict:
    """The answer in words, which a person grades."""
    mark = {"grade": True, "solution": True, "locked": False, "task": False, "schema_version": 3, "points": 3}
    return {
        "cell_type": "markdown",
        "id": "explain",
        "metadata": {"nbgrader": mark | {"grade_id": "explain"}},
        "source": source,
    }


def notebook(cells: list[dict]) -> dict:
    """A notebook of format 4.5."""
    kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
    return {"cells": cells, "metadata": kernel, "nbformat": 4, "nbformat_minor": 5}


def blank(question: Question) -> str:
    """What a released lab has in the place of an answer."""
    return f"def {question.function}{inspect.signature(question.reference)}:\n    raise NotImplementedError\n"


# Each question costs each submission of each test its time.
FEW = {"04_iou": ("iou", "mean_iou"), "07_grasp": ("pad_slice",)}


def asked(topic: str) -> dict[str, Question]:
    """The questions of a lab as tests release it: all that there are, but where a few show the same."""
    questions = of_topic(topic)
    return {name: questions[name] for name in FEW.get(topic, questions)}


def lab_notebook(
    topic: str, answers: dict[str, str] | None = None, setup: str = "import numpy as np", whole: bool = False
) -> dict:
    """A lab, with answers in the place of its blanks where they are given. whole: it asks all that there is."""
    cells = [code_cell(setup, "setup", locked=True)]
    questions = of_topic(topic) if whole else asked(topic)
    for name, question in questions.items():
        source = (answers or {}).get(name, blank(question))
        cells.append(code_cell(source, name, solution=True))
        cells.append(code_cell("assert True", f"check_{name}", grade=True, locked=True, points=question.points))
    cells.append(written_cell("*Your answer.*" if answers is None else "Because of the union."))
    made = notebook(cells)
    made["metadata"]["labkit"] = {"version": "0", "tasks": dict.fromkeys(questions, "as it is")}
    return made


def write_lab(course: Path, topic: str, **how) -> None:
    """Write course/labs/TOPIC/TOPIC.ipynb, and an empty gradebook if there is none."""
    write(course / "labs" / topic / f"{topic}.ipynb", lab_notebook(topic, **how))
    if not (course / "gradebook.db").exists():
        (course / "gradebook.db").write_bytes(empty_gradebook())


@functools.cache
def empty_gradebook() -> bytes:
    """What nbgrader makes of a new gradebook; making one takes it two seconds."""
    with tempfile.TemporaryDirectory() as folder:
        with opened(Path(folder)):
            pass
        return (Path(folder) / "gradebook.db").read_bytes()


def submit(course: Path, student: str, topic: str, answers: dict[str, str] | dict, **how) -> Path:
    """Write a student's notebook: from answers, or a whole notebook; returns its path."""
    path = course / "submitted" / student / topic / f"{topic}.ipynb"
    write(path, answers if "cells" in answers else lab_notebook(topic, answers, **how))
    return path


def write(path: Path, content: dict) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(content))


def zip_collect(course: Path, topic: str) -> str:
    """What `nbgrader zip_collect TOPIC` does in a course, whose zips lie in downloaded/TOPIC/archive; what it says."""
    from nbgrader.apps import ZipCollectApp  # a second, which other tests need not wait

    shutil.copy(ROOT / "nbgrader_config.py", course)
    said, app, umask = io.StringIO(), ZipCollectApp(), os.umask(0o022)
    try:
        with chdir(course), pytest.MonkeyPatch.context() as patch:
            patch.syspath_prepend(ROOT)  # nbgrader adds to it, which is undone
            app.initialize([topic])
            app.init_logging(logging.StreamHandler, [said], color=False)
            app.start()
    finally:
        os.umask(umask)
        app.reset()
    return said.getvalue()


def other_answers(topic: str) -> dict[str, list[str]]:
    """The alternatives of each question that need nothing that is forbidden, or not there where answers are graded."""
    cells = {}
    for name, question in of_topic(topic).items():
        written = [as_cell(answer, name) for answer in alternatives(question)]
        cells[name] = [cell for cell in written if not any(no in cell for no in ("cv2", *question.forbidden))]
    return cells


@functools.cache
def _right_answers(topic: str) -> dict[str, str]:
    return {name: next(c for c in cells if "torch" not in c) for name, cells in other_answers(topic).items()}


def right_answers(topic: str) -> dict[str, str]:
    """An answer to each question that is right, and not the kit's own."""
    return dict(_right_answers(topic))


def copied_answers(topic: str) -> dict[str, str]:
    """The reference of each question."""
    return {name: as_cell(question.reference, name) for name, question in of_topic(topic).items()}


def descendants(pid: int) -> set[int]:
    """Processes below one, by the kernel's lists of children."""
    found, waiting = set(), [pid]
    while waiting:
        for thread in glob(f"/proc/{waiting.pop()}/task/*/children"):
            with suppress(OSError):  # this thread has ended since it was listed; the children of others still count
                children = {int(child) for child in Path(thread).read_text().split()} - found
                found |= children
                waiting += children
    return found


# ------------------------------------------------------------------------------------- functions as source


def as_cell(function: Callable, name: str) -> str:
    """The source of a cell that defines a function under a name, with all that it needs of its own module."""
    if text := getattr(function, "source", None):
        return text
    done: dict[int, tuple[str, str]] = {}
    define(function, name, name, done)
    return "\n\n".join(dict.fromkeys(source for _, source in done.values())) + "\n"


def define(function: Callable, name: str, cell: str, done: dict[int, tuple[str, str]]) -> str:
    """Add the source of a function under a name, after what it uses, and give the name.

    Whatever it uses of the kit gets a name of this cell's own, so that no two cells of a notebook disturb each other.
    """
    function = inspect.unwrap(function)  # the suite checks shapes in a wrapper
    if id(function) in done:
        return done[id(function)][0]
    done[id(function)] = (name, "")  # it may call itself
    renamed, lines = {}, []
    for used, value in values_of(function):
        if isinstance(value, types.FunctionType) and value.__module__.startswith(OURS):
            renamed[used] = define(value, f"{cell}_{used}".replace(".", "_"), cell, done)
        elif not (isinstance(value, types.ModuleType) and value.__name__.startswith(OURS)):
            if used in function.__code__.co_freevars:  # another answer of the notebook may have a value of this name
                renamed[used] = f"{cell}_{used}"
            lines.append(assignment(renamed.get(used, used), value))
    node = Renamed(renamed).visit(node_of(function))
    if isinstance(node, ast.Lambda):
        source = f"{name} = {ast.unparse(node)}"
    else:
        node.name = name
        source = ast.unparse(node)
    del done[id(function)]
    done[id(function)] = (name, "\n".join([*lines, source]))
    return name


OURS = ("labkit", "labtrain", "labros", "labcourse", "alternatives")  # packages whose functions are written out


class Renamed(ast.NodeTransformer):
    """Gives names, and attributes of modules such as answers.iou_of, other names."""

    def __init__(self, names: dict[str, str]):
        self.names = names

    def visit_Name(self, node: ast.Name) -> ast.AST:
        return ast.Name(self.names.get(node.id, node.id), node.ctx)

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        dotted = ast.unparse(node)
        return ast.Name(self.names[dotted], node.ctx) if dotted in self.names else self.generic_visit(node)


def values_of(function: Callable) -> Iterable[tuple[str, object]]:
    """The names that a function uses and does not define, with their values; of the kit's modules, what is used."""
    names = dict.fromkeys(n.id for n in ast.walk(node_of(function)) if isinstance(n, ast.Name))
    free = zip(function.__code__.co_freevars, function.__closure__ or (), strict=True)
    values = function.__globals__ | {name: cell.cell_contents for name, cell in free}
    for name in names:
        if name not in values:
            continue
        yield name, values[name]
        if isinstance(values[name], types.ModuleType) and values[name].__name__.startswith(OURS):
            for node in ast.walk(node_of(function)):
                if isinstance(node, ast.Attribute) and ast.unparse(node.value) == name:
                    yield f"{name}.{node.attr}", getattr(values[name], node.attr)


def assignment(name: str, value: object) -> str:
    """A line that gives a name its value."""
    if isinstance(value, types.ModuleType):
        return f"import {value.__name__} as {name}"
    if isinstance(value, np.ndarray):
        return f"{name} = np.array({value.tolist()!r}, np.{value.dtype.name})"
    if callable(value):
        return f"from {value.__module__} import {value.__qualname__} as {name}"
    return f"{name} = {value!r}"


def node_of(function: Callable) -> ast.FunctionDef | ast.Lambda:
    """A function's own piece of its module's source, a copy without decorators."""
    nodes = functions_of(inspect.getmodule(function))
    code = function.__code__
    for node in nodes:
        if isinstance(node, ast.FunctionDef) and node.name == code.co_name and first_line(node) == code.co_firstlineno:
            node = copy.deepcopy(node)
            node.decorator_list = []
            return node
    here = [node for node in nodes if isinstance(node, ast.Lambda) and node.lineno == code.co_firstlineno]
    fitting = [node for node in here if len(here) == 1 or [a.arg for a in node.args.args] == arguments(code)]
    if len(fitting) != 1:
        raise LookupError(f"no source of {function} in line {code.co_firstlineno}")
    return copy.deepcopy(fitting[0])


@functools.cache
def functions_of(module: types.ModuleType) -> list[ast.FunctionDef | ast.Lambda]:
    """All functions in a module's source."""
    nodes = ast.walk(ast.parse(inspect.getsource(module)))
    return [node for node in nodes if isinstance(node, ast.FunctionDef | ast.Lambda)]


def arguments(code: types.CodeType) -> list[str]:
    """Names of a function's arguments."""
    return list(code.co_varnames[: code.co_argcount])


def first_line(node: ast.FunctionDef) -> int:
    """The line where a definition begins, with its decorators."""
    return min([node.lineno, *(decorator.lineno for decorator in node.decorator_list)])


# ------------------------------------------------------------------------------------------ synthetic classes


def synthetic_class(topic: str) -> dict[str, tuple[dict[str, str], dict[str, bool]]]:
    """Students of a topic: the cells that each hands in, and which of the answers are right.

    Every misconception and every alternative is handed in by somebody; then there are a blank lab, answers that do not
    compile, raise, or end their process, and a student of each mixture.
    """
    questions = of_topic(topic)
    right = right_answers(topic)
    wrong = {name: [as_cell(m.answer, name) for m in q.misconceptions] for name, q in questions.items()}
    other = other_answers(topic)
    for cells in other.values():
        cells.sort(key=lambda cell: "torch" not in cell)  # torch takes a second to load: all of it in one submission
    students = {"reference": (copied_answers(topic), dict.fromkeys(right, True))}
    for kind, answers, is_right in (("misconception", wrong, False), ("alternative", other, True)):
        for i in range(max(map(len, answers.values()))):
            cells = {name: given[i] if i < len(given) else right[name] for name, given in answers.items()}
            students[f"{kind}_{i}"] = (cells, {n: is_right or i >= len(given) for n, given in answers.items()})
    spoilt = {
        "blank": lambda name: blank(questions[name]),
        "broken": lambda name: f"def {name}(:\n    return 0\n",
        "raising": lambda name: f"def {name}(*arguments):\n    raise KeyError\n",
        "ending": lambda name: f"import os\ndef {name}(*arguments):\n    os._exit(0)\n",
    }
    for i, (kind, make) in enumerate(spoilt.items()):
        cells = {name: make(name) if (j + i) % 2 else right[name] for j, name in enumerate(right)}
        students[kind] = (cells, {name: not (j + i) % 2 for j, name in enumerate(right)})
    return students
