"""Facts about the notebooks as files: what a lesson and a lab hold, that names and links in them lead somewhere.

That they run, and give the outputs that are committed, is nbval's part of `make test`.
"""

import ast
import base64
import doctest
import importlib
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from notebooks import LABS, LESSONS, ROOT, SOLUTIONS, TOPICS, code, notebook, prose

from labkit.course.checker.run import Printed, judge
from labkit.course.checking import describe
from labkit.course.release import mistakes, release
from labkit.course.topics import of_topic

MAX_LINES, MAX_PNG = 25, 150_000
# Names that are undefined or unused, statements that do nothing or not what they seem, old NumPy, errors of syntax.
RULES = "E4,E7,E9,F,W,B,PLE,NPY,UP"


def each(paths):
    """Run a test once a notebook, named by its folder and topic."""
    return pytest.mark.parametrize("path", paths, ids=[f"{p.relative_to(ROOT).parts[0]}-{p.stem}" for p in paths])


def tags(cell) -> set[str]:
    """The tags of a cell."""
    return set(cell.metadata.get("tags", []))


# ------------------------------------------------------------------------------------------ all notebooks


def test_every_topic_has_a_lab_and_no_notebook_is_without_a_topic():
    found = {path for kind in ("lessons", "solutions", "labs") for path in (ROOT / kind).rglob("*.ipynb")}
    found = {path for path in found if ".ipynb_checkpoints" not in path.parts}
    assert found == {*LESSONS, *SOLUTIONS, *LABS}


@each([*LESSONS, *SOLUTIONS, *LABS])
def test_cells_are_short(path):
    for cell in code(path):
        assert len(cell.source.splitlines()) <= MAX_LINES, cell.source[:200]


def ruff(paths: list[Path], *options: str) -> str:
    """What ruff says about the cells of notebooks."""
    command = [sys.executable, "-m", "ruff", "check", "--isolated", "--no-cache", "--line-length", "120"]
    command += ["--select", RULES, "--target-version", "py311", "--output-format", "concise", *options]
    done = subprocess.run([*command, *map(str, paths)], cwd=ROOT, capture_output=True, text=True)
    return done.stdout if done.returncode else ""


def test_cells_are_free_of_lint():
    assert not ruff([*LESSONS, *SOLUTIONS])
    assert not ruff(LABS, "--ignore", "F401,F841")  # what the missing answers would have used


def test_prose_is_spelled_as_in_the_dictionary(tmp_path):
    for path in (*LESSONS, *SOLUTIONS):
        # Formulas, code and targets of links are not words.
        text = re.sub(r"\$\$.*?\$\$|\$[^$\n]*\$|```.*?```|`[^`\n]*`|\]\([^)]*\)", " ", prose(path), flags=re.DOTALL)
        (tmp_path / f"{path.parent.name}-{path.stem}.txt").write_text(text)
    done = subprocess.run([sys.executable, "-m", "codespell_lib", str(tmp_path)], capture_output=True, text=True)
    assert done.returncode == 0 and not done.stdout, done.stdout + done.stderr


@each([*LESSONS, *SOLUTIONS, *LABS])
def test_links_lead_to_files_and_headings(path):
    text = prose(path)
    headings = {re.sub(r"\s+", "-", h.strip()) for h in re.findall(r"^#+ (.+)$", text, re.MULTILINE)}
    targets = re.findall(r"\]\(([^)\s]+)", text) + re.findall(r"(?:src|href)=[\"']([^\"']+)", text)
    for target in targets:
        if target.startswith("#"):
            assert target[1:] in headings, target
        elif not re.match(r"https?://|mailto:|attachment:|data:", target):
            assert (path.parent / target.partition("#")[0]).exists(), target


# --------------------------------------------------------------------------------- names in prose


def resolve(dotted: str) -> None:
    """Raise if a dotted name of labkit or data_gen leads nowhere."""
    parts = dotted.split(".")
    found = importlib.import_module(parts[0])
    for i, part in enumerate(parts[1:], start=2):
        if not hasattr(found, part):
            found = importlib.import_module(".".join(parts[:i]))
        else:
            found = getattr(found, part)
        if not hasattr(found, "__path__") and not isinstance(found, type(sys)) and not isinstance(found, type):
            return  # an object: its attributes are its own business


@each([*LESSONS, *SOLUTIONS, *LABS])
def test_every_symbol_that_prose_names_exists(path):
    """Those that code names exist: nbval runs it."""
    for name in sorted(set(re.findall(r"`((?:labkit|data_gen)(?:\.\w+)+)", prose(path)))):
        resolve(name)


# --------------------------------------------------------------------------------------------- lessons


@each([*LESSONS, *SOLUTIONS])
def test_it_was_run_from_top_to_bottom_without_an_error(path):
    assert [cell.execution_count for cell in code(path)] == list(range(1, len(code(path)) + 1))
    outputs = [output for cell in code(path) for output in cell.outputs]
    assert not [output.evalue for output in outputs if output.output_type == "error"]
    said = "".join(output.text for output in outputs if output.get("name") == "stderr")
    assert not re.search("Warning|Traceback|build time", said), said[:300]


def pictures(path: Path) -> list[bytes]:
    """The PNG pictures among a notebook's outputs."""
    data = [output.get("data", {}) for cell in code(path) for output in cell.outputs]
    return [base64.b64decode(d["image/png"]) for d in data if "image/png" in d]


@each([*LESSONS, *SOLUTIONS])
def test_pictures_are_there_and_small(path):
    found = pictures(path)
    assert len(found) >= (2 if path in LESSONS else 1)
    for picture in found:
        assert picture.startswith(b"\x89PNG") and len(picture) < MAX_PNG, f"{len(picture)} bytes"


@pytest.mark.parametrize("topic", [topic for topic in TOPICS if any(p.name.startswith(topic) for p in LESSONS)])
def test_each_topics_lessons_have_an_explorer(topic):
    cells = [cell for path in LESSONS if path.name.startswith(topic) for cell in code(path)]
    texts = [output.get("data", {}).get("text/plain", "") for cell in cells for output in cell.outputs]
    assert any(text.startswith("an explorer: ") for text in texts)


def is_compared(cell) -> bool:
    """Whether nbval compares something of a cell's output."""
    ignored = tags(cell) & {"nbval-ignore-output", "nbval-skip"} or "NBVAL_IGNORE_OUTPUT" in cell.source
    texts = [o for o in cell.outputs if o.get("name") == "stdout" or "text/plain" in o.get("data", {})]
    return bool(texts) and not ignored and cell.execution_count is not None


@each(LESSONS)
def test_at_least_half_of_the_cells_with_output_are_compared(path):
    shown = [cell for cell in code(path) if cell.outputs]
    assert 2 * sum(map(is_compared, shown)) >= len(shown)


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
    assert prose(path).count("<details") >= 3 * len(of_topic(path.stem))
    for cell in written:
        answer, head, rubric = cell.source.partition(f"**Rubric ({cell.metadata.nbgrader.points} points).**")
        assert len(answer) > 500 and head
        points = re.findall(r"^- (\d+) points?: ", rubric, re.MULTILINE)
        assert len(points) >= 2 and sum(map(int, points)) == cell.metadata.nbgrader.points


@each(SOLUTIONS)
def test_each_blank_is_followed_by_its_own_check(path):
    for function, question in of_topic(path.stem).items():
        call = rf"^{function} = check\(\"{re.escape(question.name)}\", {function}\)"
        assert re.search(call, graded(path)[f"check_{function}"].source, re.MULTILINE)
        (definition,) = [
            node
            for node in ast.parse(graded(path)[function].source).body
            if isinstance(node, ast.FunctionDef) and node.name == function
        ]
        assert len(ast.get_docstring(definition) or "") > 60, function


@each(LABS)
def test_every_blank_fails_its_own_check_and_says_that_it_is_one(path):
    for function, question in of_topic(path.stem).items():
        verdict = judge(question, answer(path, function), seed=0)
        shown = repr(describe(question, verdict, Printed()))
        assert not verdict.passed and shown.startswith(f"○ {function}: not answered yet")


@each(SOLUTIONS)
def test_every_solution_passes_under_another_seed_than_the_checks(path):
    for function, question in of_topic(path.stem).items():
        verdict = judge(question, answer(path, function), 20_260_102)
        assert verdict.passed and not verdict.notes, (function, verdict)


@each(SOLUTIONS)
def test_a_right_answer_prints_what_its_docstring_shows(path):
    for function in of_topic(path.stem):
        right = answer(path, function)
        examples = doctest.DocTestFinder(recurse=False).find(right, function, module=False, globs=right.__globals__)
        assert [doctest.DocTestRunner().run(example).failed for example in examples] == [0], function


def cells_to_first_check(path: Path) -> str:
    """A lab's code from its first cell to its first check."""
    sources = [cell.source for cell in code(path)]
    return "\n".join(sources[: next(i for i, text in enumerate(sources) if " = check(" in text) + 1])


@pytest.mark.parametrize("topic", ["01_labels", "04_iou", "06_back_projection"])
def test_a_lab_loads_no_heavy_package_before_its_first_check(topic):
    """On a hub everybody's kernel has its own copy: PyTorch takes 120 MB of memory, numba 30."""
    path = ROOT / "labs" / topic / f"{topic}.ipynb"
    heavy = "print(sorted({'torch', 'numba', 'onnxruntime', 'plotly', 'pandas'} & set(sys.modules)))"
    program = f"{cells_to_first_check(path)}\nimport sys\n{heavy}".replace("raise NotImplementedError", "pass")
    environment = {**os.environ, "MPLBACKEND": "agg"}
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=ROOT, env=environment)
    assert done.stdout.splitlines()[-1:] == ["[]"], done.stderr


def test_labs_and_what_they_come_from_are_as_the_release_makes_them():
    assert release(ROOT, check=True) == []
