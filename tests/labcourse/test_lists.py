"""Every solution runs with answers that return lists, and with tuples, as a lab allows; what it shows is the same.

Its cells give each answer the types that the statement names, so they are asked for here as well.
"""

import ast
import json
import os
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest
from notebooks import ROOT, SOLUTIONS

from labgrader.comparison import expected_cases
from labgrader.course import asked
from labgrader.question import PUBLIC_SEED, Question

# What an answer does first, and how it returns what it returns otherwise.
FIRST = """
for name, types in {types}.items():
    assert str(locals()[name].dtype) in types, f"{{name}}: {{locals()[name].dtype}}, not {{types}}"

def nested(value):
    value = value.tolist() if isinstance(value, np.ndarray | np.generic) else value
    return {container}(map(nested, value)) if isinstance(value, list | tuple) else value
"""


class Returning(ast.NodeTransformer):
    """Makes what a function returns lists or tuples; functions in it return what they did."""

    def __init__(self, question: Question, container: str):
        self.first = ast.parse(FIRST.format(types=types_of(question), container=container)).body

    def visit_Return(self, node):
        return ast.Return(ast.Call(ast.Name("nested", ast.Load()), [node.value], []))

    def visit_FunctionDef(self, node):
        return node

    def applied(self, function: ast.FunctionDef) -> None:
        """Change a function, behind its docstring."""
        docstring, *body = function.body
        function.body = [docstring, *self.first, *map(self.visit, body)]


def types_of(question: Question) -> dict[str, list[str]]:
    """The types of the arguments that are arrays in all cases."""
    types = defaultdict(set)
    for case in expected_cases(question, PUBLIC_SEED):
        for name, value in zip(question.parameters, case.args, strict=True):
            types[name].add(str(getattr(value, "dtype", "")))
    return {name: sorted(found) for name, found in types.items() if "" not in found}


def with_returns(source: str, question: Question, container: str) -> str:
    """The cell of an answer that returns lists or tuples."""
    cell = ast.parse(source)
    (function,) = [node for node in cell.body if isinstance(node, ast.FunctionDef) and node.name == question.function]
    Returning(question, container).applied(function)
    return ast.unparse(ast.fix_missing_locations(cell))


@pytest.mark.nightly
@pytest.mark.parametrize("container", ["list", "tuple"])
@pytest.mark.parametrize("path", [path for path in SOLUTIONS if asked(path.stem)], ids=lambda path: path.stem)
def test_a_solution_runs_with_answers_that_return_lists_or_tuples(path: Path, container, tmp_path):
    notebook, questions = json.loads(path.read_text(encoding="utf-8")), asked(path.stem)
    for cell in notebook["cells"]:
        if question := questions.get(cell["metadata"].get("nbgrader", {}).get("grade_id")):
            cell["source"] = with_returns("".join(cell["source"]), question, container)
    changed = tmp_path / "solutions" / path.stem / path.name
    changed.parent.mkdir(parents=True)
    changed.write_text(json.dumps(notebook), encoding="utf-8")
    # The settings of pyproject.toml are not found from a folder elsewhere: nbval is asked for once, by tests.notebooks.
    words = "-q -p no:nbval -p tests.notebooks -p no:cacheprovider --nbval --nbval-current-env --nbval-cell-timeout 500"
    done = subprocess.run(
        [sys.executable, "-m", "pytest", *words.split(), "--rootdir", ROOT, changed],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout[-6000:]


def test_lists_of_an_answer_are_lists_and_its_arguments_types_are_asked_for():
    double = Question(name="0.double", reference=lambda x: 2 * x, inputs=lambda rng: (np.ones((1, 2)),))
    space = {"np": np}
    exec(with_returns("def double(x):\n    'twice'\n    return 2 * x", double, "tuple"), space)
    assert space["double"](np.ones((1, 2))) == ((2.0, 2.0),)
    with pytest.raises(AssertionError, match=r"x: int64, not \['float64'\]"):
        space["double"](np.ones((1, 2), int))
