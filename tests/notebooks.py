"""The course's notebooks, for the tests that look into them; as a plugin of pytest, nbval and what it compares.

Outputs of lessons and solutions are compared with the committed ones. Labs have none: they run as students get them,
but on fewer scenes, for fewer steps of training and without pictures; the others have fewer scenes and steps where no
compared output shows it. Each notebook has a kernel of its own, which is forked from one that has imported what they
import.
"""

import re
import sys
from functools import cache
from pathlib import Path

import pytest

from labgrader.course import topics
from tests.warm_kernels import WarmKernels

sys.modules.setdefault("rfc3987_syntax", None)  # as conftest.py says, which is read after nbval
pytest_plugins = ["nbval.plugin"]  # which pyproject.toml leaves out elsewhere
ROOT = Path(__file__).parents[1]
LESSONS = [path for topic in topics() for path in sorted(ROOT.glob(f"lessons/{topic}*.ipynb"))]  # some topics have two
SOLUTIONS = [ROOT / "solutions" / topic / f"{topic}.ipynb" for topic in topics()]
LABS = [ROOT / "labs" / topic / f"{topic}.ipynb" for topic in topics()]


@cache
def notebook(path: Path):
    """Read a notebook once."""
    import nbformat

    return nbformat.read(path, as_version=4)


def code(path: Path) -> list:
    """The code cells that have something in them."""
    return [cell for cell in notebook(path).cells if cell.cell_type == "code" and cell.source.strip()]


def prose(path: Path) -> str:
    """All Markdown of a notebook."""
    return "\n\n".join(cell.source for cell in notebook(path).cells if cell.cell_type == "markdown")


def is_compared(cell) -> bool:
    """Whether nbval compares something of a cell's output."""
    ignored = (
        set(cell.metadata.get("tags", [])) & {"nbval-ignore-output", "nbval-skip"}
        or "NBVAL_IGNORE_OUTPUT" in cell.source
    )
    texts = [o for o in cell.outputs if o.get("name") == "stdout" or "text/plain" in o.get("data", {})]
    return bool(texts) and not ignored and cell.execution_count is not None


# What cells say of scenes, trainings and pictures, and what they say when only the notebook's running is at stake: what
# no compared output shows, and in labs the rest as well.
FEWER = {
    "03_gradient_network": {"y_train, steps=300)": "y_train, steps=25)"},
    "05_class_weights": {"of=40": "of=4"},
    "07_grasp": {"of=40": "of=2", "workers=2": "workers=1"},
    "07_grasp_worth": {"range(600_100, 600_110)": "range(600_100, 600_102)"},
    "10_capstone": {"else (12, 10, 8)": "else (12, 2, 2)"},
}
FEWER_IN_LABS = {
    "03_gradient": {"range(200)": "range(5)"},
    "05_class_weights": {"steps=400": "steps=5"},
    "08_node": {"(600131, 600132)": "(600131,)"},
    "09_other_stacks": {
        "(600011, 600002, 600006, 600007)": "(600011, 600002)",
        "plt.subplots(3, 4": "plt.subplots(3, 2",
        "range(630000, 630008)": "range(630000, 630003)",
        "[trial(*case) for case in zip(": "[k == 0 and trial(*case) for k, case in enumerate(zip(",
        "masks, strict=True)] for way": "masks, strict=True))] for way",
    },
    # Its pictures lie in a folder that its solution, which runs at the same time, does not share.
    "10_capstone": {"else (12, 10, 8)": "else (4, 2, 2)", '"small")': '"few")'},
}
NO_PICTURES = {"plt.show()": 'plt.close("all")'}  # solutions draw the same ones


def imported() -> list[str]:
    """Modules that the notebooks import. tqdm is none of them: it looks where it is when it is imported."""
    lines = [line for path in LESSONS + SOLUTIONS for cell in code(path) for line in cell.source.splitlines()]
    named = [match[1] for line in lines if (match := re.match(r"(?:import|from) ([\w.]+)", line))]
    return [name for name in dict.fromkeys(named) if not name.startswith("tqdm")]


@cache
def warm_kernels() -> WarmKernels:
    """Kernels of this process: forks of one that has imported what the notebooks import."""
    return WarmKernels(imported())


def is_cell(item) -> bool:
    """Whether a test is a notebook's cell."""
    return item.path.suffix == ".ipynb"


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup(item):
    """Fork a notebook's kernel, where a process can be forked and go on; the tests beside begin theirs from nothing."""
    from jupyter_client.provisioning import local_provisioner

    with pytest.MonkeyPatch.context() as patch:
        if is_cell(item) and sys.platform == "linux":
            patch.setattr(local_provisioner, "launch_kernel", warm_kernels())
        return (yield)


def pytest_ignore_collect(collection_path):
    """Leave out notebooks that are not the course's, such as the sample class's."""
    ours = any(collection_path.is_relative_to(ROOT / folder) for folder in ("lessons", "solutions", "labs"))
    return True if collection_path.suffix == ".ipynb" and not ours else None


def pytest_collectstart(collector):
    """Let nbval run a lab without outputs to compare."""
    if collector.path.suffix == ".ipynb" and collector.path.is_relative_to(ROOT / "labs"):
        collector.compare_outputs = False


def pytest_itemcollected(item):
    """Let a cell do with fewer scenes; the file that students get says what it says."""
    if not is_cell(item):
        return
    changes = FEWER.get(item.path.stem, {})
    if item.path.is_relative_to(ROOT / "labs"):
        changes = changes | FEWER_IN_LABS.get(item.path.stem, {}) | NO_PICTURES
    for many, few in changes.items():
        item.cell.source = item.cell.source.replace(many, few)
