"""Facts about the notebooks as files: what a lab asks and checks, and what of a lesson is compared.

That they run, and give the outputs that are committed, is nbval's part of `make test`; how they read is `make prose`'s.
"""

import ast
import doctest
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from at_night import others_at_night
from notebooks import FEWER, FEWER_IN_LABS, LABS, LESSONS, ROOT, SOLUTIONS, code, is_compared, notebook, prose

from labgrader.check import describe
from labgrader.course import asked
from labgrader.release.release import mistakes
from labgrader.reply.judge import judge


def each(paths):
    """Run a test once a notebook, named by its folder and topic."""
    return pytest.mark.parametrize("path", paths, ids=[f"{p.relative_to(ROOT).parts[0]}-{p.stem}" for p in paths])


# ------------------------------------------------------------------------------------------ all notebooks


def test_every_topic_has_a_lab_and_no_notebook_is_without_a_topic():
    found = {path for kind in ("lessons", "solutions", "labs") for path in (ROOT / kind).rglob("*.ipynb")}
    found = {path for path in found if ".ipynb_checkpoints" not in path.parts}
    assert found == {*LESSONS, *SOLUTIONS, *LABS}


def test_lessons_are_listed_as_they_are_read():
    """What lists files sorts them by name, and pages that list a topic's lessons follow."""
    second = [path.stem for path in LESSONS if path.stem.startswith("02")]
    assert second == ["02_crf", "02_crf_cut", "02_crf_lower_bounds"]
    for page in (ROOT / "README.md", ROOT / "docs/teaching.md"):
        lines = [re.findall(r"lessons/(\w+)\.ipynb", line) for line in page.read_text().splitlines()]
        rows = [named for named in lines if len(named) > 1]
        assert len(rows) >= 8 and rows == [sorted(named) for named in rows], page.name


# --------------------------------------------------------------------------------------------- lessons


def test_what_notebooks_do_less_of_in_the_suite_stands_in_them_and_shows_in_no_compared_output():
    for name, replaced in [*FEWER.items(), *FEWER_IN_LABS.items()]:
        source = "\n".join(cell.source for path in [*LABS, *LESSONS] if path.stem == name for cell in code(path))
        assert not [many for many in replaced if many not in source], name
    for name, replaced in FEWER.items():
        paths = [path for path in [*SOLUTIONS, *LESSONS] if path.stem == name]
        compared = [cell.source for path in paths for cell in code(path) if is_compared(cell)]
        assert not [source for source in compared if any(many in source for many in replaced)], name


@each([*LESSONS, *SOLUTIONS])
def test_it_was_run_from_top_to_bottom_without_an_error(path):
    assert [cell.execution_count for cell in code(path)] == list(range(1, len(code(path)) + 1))
    outputs = [output for cell in code(path) for output in cell.outputs]
    assert not [output.evalue for output in outputs if output.output_type == "error"]
    said = "".join(output.text for output in outputs if output.get("name") == "stderr")
    assert not re.search("Warning|Traceback|build time", said), said[:300]


@each([*LESSONS, *SOLUTIONS])
def test_compared_outputs_hold_no_address_and_no_time(path):
    for cell in filter(is_compared, code(path)):
        text = "".join(output.get("text", output.get("data", {}).get("text/plain", "")) for output in cell.outputs)
        assert not re.search(r"0x[0-9a-f]{6,}|\bit/s|\d:\d\d<", text), text[:200]


# ------------------------------------------------------------------------------------------------ labs


def graded(path: Path) -> dict:
    """The cells that have a grade id, by it."""
    return {c.metadata.nbgrader.grade_id: c for c in notebook(path).cells if "nbgrader" in c.metadata}


def answer(path: Path, function: str):
    """A lab's or a solution's function: its own cell, run after the setup cell, as the grader does."""
    cells, namespace = graded(path), {"__name__": "__main__"}
    for name in ("setup", function):
        exec(compile(cells[name].source, f"<{path.stem} {name}>", "exec"), namespace)
    return namespace[function]


@each(SOLUTIONS)
def test_a_solution_is_an_assignment(path):
    assert mistakes(notebook(path), path.stem) == []
    cells = graded(path).values()
    written = [c for c in cells if c.cell_type == "markdown" and c.metadata.nbgrader.grade]
    assert len(written) >= 1 and all(c.metadata.nbgrader.points > 0 for c in written)
    assert prose(path).count("<details") >= 3 * len(asked(path.stem))
    for cell in written:
        answer, head, rubric = cell.source.partition(f"**Rubric ({cell.metadata.nbgrader.points} points).**")
        assert len(answer) > 500 and head
        points = re.findall(r"^- (\d+) points?: ", rubric, re.MULTILINE)
        assert len(points) >= 2 and sum(map(int, points)) == cell.metadata.nbgrader.points


@each(SOLUTIONS)
def test_each_blank_is_followed_by_its_own_check(path):
    for function, question in asked(path.stem).items():
        call = rf"^{function} = check\(\"{re.escape(question.name)}\", {function}\)"
        assert re.search(call, graded(path)[f"check_{function}"].source, re.MULTILINE)
        (definition,) = [
            node
            for node in ast.parse(graded(path)[function].source).body
            if isinstance(node, ast.FunctionDef) and node.name == function
        ]
        assert len(ast.get_docstring(definition) or "") > 60, function


def test_labs_say_in_one_wording_what_comes_and_what_may_go_back():
    said = {
        path.stem: re.findall(r"^\*\*Inputs and return values\..*\n.*$", prose(path), re.MULTILINE)
        for path in SOLUTIONS
    }
    wordings = {tuple(said[path.stem]) for path in SOLUTIONS if asked(path.stem)}
    assert len(wordings) == 1 and len(*wordings) == 1


@each(LABS)
def test_every_blank_fails_its_own_check_and_says_that_it_is_one(path):
    for function, question in asked(path.stem).items():
        verdict = judge(question, answer(path, function), seed=0)
        shown = repr(describe(question, verdict))
        assert not verdict.passed and shown.startswith(f"○ {function}: not answered yet")


@each(SOLUTIONS)
def test_every_solution_passes_under_another_seed_than_the_checks(path):
    for function, question in asked(path.stem).items():
        verdict = judge(question, answer(path, function), 20_260_102)
        assert verdict.passed and not verdict.notes, (function, verdict)


@each(SOLUTIONS)
def test_a_right_answer_prints_what_its_docstring_shows(path):
    for function in asked(path.stem):
        right = answer(path, function)
        examples = doctest.DocTestFinder(recurse=False).find(right, function, module=False, globs=right.__globals__)
        assert [doctest.DocTestRunner().run(example).failed for example in examples] == [0], function


def cells_to_first_check(path: Path) -> str:
    """A lab's code from its first cell to its first check."""
    sources = [cell.source for cell in code(path)]
    return "\n".join(sources[: next(i for i, text in enumerate(sources) if " = check(" in text) + 1])


@pytest.mark.parametrize("topic", others_at_night(["01_labels", "04_iou"], by_day=("04_iou",)))
def test_a_lab_loads_no_heavy_package_before_its_first_check(topic):
    """On a hub everybody's kernel has its own copy: PyTorch takes 120 MB of memory, numba 30."""
    path = ROOT / "labs" / topic / f"{topic}.ipynb"
    heavy = "print(sorted({'torch', 'numba', 'onnxruntime', 'plotly', 'pandas'} & set(sys.modules)))"
    program = f"{cells_to_first_check(path)}\nimport sys\n{heavy}".replace("raise NotImplementedError", "pass")
    environment = {**os.environ, "MPLBACKEND": "agg"}
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=ROOT, env=environment)
    assert done.stdout.splitlines()[-1:] == ["[]"], done.stderr
