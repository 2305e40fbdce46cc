"""What a notebook's file may be to be graded; `check` and `check FILE` say the same of it as the grader does."""

import json
from collections.abc import Sequence

from labgrader.program.cell import Cell, cells_of

LARGEST_NOTEBOOK = 20 << 20  # bytes
MOST_VALUES = 1_000_000  # of JSON: a second of parsing and 100 MB of memory
MOST_CELLS = 5_000
MOST_SOURCE = 1_000_000  # characters of code


class Unreadable(Exception):
    """A submission that cannot be read; the text says why, for the instructor's table."""


def refuse_large(data: bytes) -> None:
    """Raise Unreadable for a file that is not parsed: for its size, or for how many values it holds."""
    if len(data) > LARGEST_NOTEBOOK:
        raise Unreadable(f"it is larger than {LARGEST_NOTEBOOK >> 20} MB")
    if sum(map(data.count, (b",", b"[", b"{"))) > MOST_VALUES:
        raise Unreadable(f"it holds more than {MOST_VALUES:,} values: clear its outputs")


def parse(data: bytes) -> dict:
    """A notebook of format 4; raises Unreadable."""
    refuse_large(data)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise Unreadable("it is not UTF-8 text") from None
    try:
        notebook = json.loads(text)
    except (ValueError, RecursionError):
        raise Unreadable("it is not JSON, so not a notebook") from None
    if not isinstance(notebook, dict) or not isinstance(notebook.get("cells"), list):
        raise Unreadable("it is not a notebook of format 4: there is no list of cells")
    if len(notebook["cells"]) > MOST_CELLS:
        raise Unreadable(f"it has more than {MOST_CELLS:,} cells")
    return notebook


def code_of(cells: object) -> list[Cell]:
    """The code cells of a notebook; raises Unreadable if they hold more than is parsed."""
    found = cells_of(cells)
    refuse_long(found)
    return found


def refuse_long(cells: Sequence[Cell]) -> None:
    """Raise Unreadable for cells with more code than is parsed."""
    if sum(len(cell.source) for cell in cells) > MOST_SOURCE:
        raise Unreadable(f"its code is longer than {MOST_SOURCE:,} characters")
