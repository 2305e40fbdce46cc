"""The course's notebooks, for the tests that look into them."""

from functools import cache
from pathlib import Path

import nbformat

from labkit.course.topics import TOPICS

ROOT = Path(__file__).parents[1]
LESSONS = [path for topic in TOPICS for path in sorted(ROOT.glob(f"lessons/{topic}*.ipynb"))]  # some topics have two
SOLUTIONS = [ROOT / "solutions" / topic / f"{topic}.ipynb" for topic in TOPICS]
LABS = [ROOT / "labs" / topic / f"{topic}.ipynb" for topic in TOPICS]


@cache
def notebook(path: Path):
    """Read a notebook once."""
    return nbformat.read(path, as_version=4)


def code(path: Path) -> list:
    """The code cells that have something in them."""
    return [cell for cell in notebook(path).cells if cell.cell_type == "code" and cell.source.strip()]


def prose(path: Path) -> str:
    """All Markdown of a notebook."""
    return "\n\n".join(cell.source for cell in notebook(path).cells if cell.cell_type == "markdown")
