"""Submissions that are odd as files or as notebooks, with what should become of them.

Each is a function that writes into a student's folder of 04_iou, and what is expected: a reason for which the whole
submission is not graded (its beginning), or whether iou is right, as the others are.
"""

import copy
import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

TOPIC, FILE = "04_iou", "04_iou.ipynb"
WRONG = "def iou(n):\n    return np.zeros(len(n))\n"


@dataclass(frozen=True)
class Odd:
    """One odd submission: writes itself into course/submitted, given the notebook of right answers."""

    name: str
    write: Callable[[Path, dict], None]
    reason: str = ""
    right: bool = False
    says: str = ""


def as_bytes(content: bytes) -> Callable[[Path, dict], None]:
    """Write a file of these bytes in the place of the notebook."""
    return lambda folder, right: put(folder, content)


def put(folder: Path, content: bytes) -> None:
    folder.mkdir(parents=True)
    (folder / f"{TOPIC}.ipynb").write_bytes(content)


def as_notebook(change: Callable[[list], object]) -> Callable[[Path, dict], None]:
    """Write the right answers after a change to the list of cells (a new list, or the old one altered)."""

    def write(folder: Path, right: dict) -> None:
        notebook = copy.deepcopy(right)
        changed = change(notebook["cells"])
        put(folder, json.dumps(notebook | ({"cells": changed} if isinstance(changed, list) else {})).encode())

    return write


def cell(cells: list, name: str) -> dict:
    """The cell of a grade id."""
    return next(c for c in cells if c["metadata"].get("nbgrader", {}).get("grade_id") == name)


def with_iou(**fields) -> Callable[[Path, dict], None]:
    """Write the right answers with other fields in the cell iou."""
    return as_notebook(lambda cells: cell(cells, "iou").update(fields))


def rewritten(change: Callable[[str], str | list[str]]) -> Callable[[Path, dict], None]:
    """Write the right answers after a change to the source of the cell iou."""
    return as_notebook(lambda cells: cell(cells, "iou").update(source=change(cell(cells, "iou")["source"])))


def doubled(source: str | None) -> Callable[[list], list]:
    """The cell iou twice, the second one with another source if there is one."""

    def change(cells: list) -> list:
        second = copy.deepcopy(cell(cells, "iou"))
        second["source"] = second["source"] if source is None else source
        return [*cells, second]

    return change


def with_markdown_cells(cells: list) -> None:
    """Nineteen Markdown cells of a million characters, with the grade id of a code cell."""
    mark = {"metadata": copy.deepcopy(cell(cells, "iou")["metadata"]), "cell_type": "markdown", "id": "x"}
    cells += [mark | {"source": f"{i}" + "x" * 1_000_000} for i in range(19)]


def better_marks(cells: list) -> None:
    """A wrong answer whose tests, points and marks the student has improved."""
    cell(cells, "iou")["source"] = "import numpy as np\n" + WRONG
    cell(cells, "iou")["metadata"]["tags"] = ["skip-execution", "raises-exception"]
    tests = cell(cells, "check_iou")
    tests["source"] = "assert True"
    tests["metadata"]["nbgrader"].update(points=1000, grade=True, locked=False, checksum="0")
    tests["outputs"] = [{"output_type": "execute_result", "data": {"text/plain": "1000"}, "metadata": {}}]
    cell(cells, "setup")["source"] = "raise SystemExit"


def in_its_place(name: str, make: Callable[[Path, str], object]) -> Callable[[Path, dict], None]:
    """Make something else under a name in the student's folder, given its path and what the right file holds."""

    def write(folder: Path, right: dict) -> None:
        folder.mkdir(parents=True)
        make(folder / name, json.dumps(right))

    return write


def linked(place: str) -> Callable[[Path, dict], None]:
    """A link to the honest student's file, folder or student's folder, in the place of one's own."""

    def write(folder: Path, right: dict) -> None:
        honest = folder.parent.parent / "honest"
        mine = {"student": folder.parent, "folder": folder, "file": folder / FILE}[place]
        mine.parent.mkdir(parents=True, exist_ok=True)
        mine.symlink_to({"student": honest, "folder": honest / TOPIC, "file": honest / TOPIC / FILE}[place])

    return write


def sparse(path: Path, text: str) -> None:
    path.write_text("{")
    os.truncate(path, 200 << 20)


def with_time(text: str) -> Callable[[Path, dict], None]:
    """Right answers that were handed in at a time of the student's making."""

    def write(folder: Path, right: dict) -> None:
        plain(folder, right)
        (folder / "timestamp.txt").write_text(text)

    return write


def plain(folder: Path, right: dict) -> None:
    put(folder, json.dumps(right).encode())


ODD = (
    Odd("linked_file", linked("file"), "04_iou.ipynb is a symbolic link"),
    Odd("linked_folder", linked("folder"), "the folder 04_iou is a symbolic link"),
    Odd("linked_student", linked("student"), "the student's folder is a symbolic link"),
    Odd("pipe", in_its_place(FILE, lambda path, text: os.mkfifo(path)), "04_iou.ipynb is no file"),
    Odd("two_hundred_megabytes", in_its_place(FILE, sparse), "it is larger than 100 MB"),
    Odd("other_name", in_its_place("iou (1).ipynb", Path.write_text), right=True),  # the lab's own key tells what it is
    Odd(
        "loose.ipynb",
        lambda folder, right: folder.parent.write_text(json.dumps(right)),
        "not in a student's folder; expected STUDENT/04_iou/04_iou.ipynb",
    ),
    *(
        Odd(name, plain, "rename the student's folder")
        for name in (
            "line\nbreak",
            "long" * 60,
            "no_utf8_\udcff",
            "no_utf8_\\xff",  # what the one before would be written as
            "odd-name-0123456789ab",  # what a page of an odd name might be called
            "\x1b]0;a terminal's title\x07",
            "right\u202eot left",
            "<script>alert(1)<script>",
            'x" onmouseover="alert(1)',
            ".begins with a dot",
            "ada;=1+1",
        )
    ),
    Odd("nothing", as_bytes(b""), "it is empty"),
    Odd("half", as_bytes(b'{"cells": [{"cell_type": "code", "sou'), "it ends in the middle"),
    Odd("nested", as_bytes(b"[" * 200_000), "it is not JSON, so not a notebook"),
    Odd("long_number", as_bytes(b"1" * 1_000_000), "it is not JSON, so not a notebook"),
    Odd(
        "utf16",
        lambda folder, right: put(folder, json.dumps(right).encode("utf-16")),
        "it is no notebook but UTF-16 text",
    ),
    Odd(
        "many_empty_cells",
        as_bytes(b'{"cells": [' + b"[]," * 6_000_000 + b"1]}"),
        "it holds more than 1,000,000 values",
    ),
    Odd("many_cells", as_bytes(b'{"cells": [' + b"{}," * 6_000 + b"{}]}"), "it has more than 5,000 cells"),
    Odd("list", as_bytes(b"[]"), "it is not a notebook of format 4: there is no list of cells"),
    Odd(
        "format_3",
        as_bytes(b'{"nbformat": 3, "worksheets": [{"cells": []}]}'),
        "it is a notebook of format 3",
    ),
    Odd("other_lab", as_notebook(lambda cells: []), "it is not this lab: no cell has a grade id of 04_iou"),
    Odd(
        "no_cells", as_notebook(lambda cells: [1, None, {}, []]), "it is not this lab: no cell has a grade id of 04_iou"
    ),
    Odd("=HYPERLINK(1)", plain, right=True),
    *(
        Odd(name, plain, right=True)
        for name in ("Zoë Ångström", "Ben & Ada O'Brien", "x' onmouseover='alert(1)", "ä" * 100, "李 小龙", "a" * 200)
    ),
    *(
        Odd(f"time_{i}", with_time(text), right=True)
        for i, text in enumerate(
            ("9" * 90, "9" * 40 + "h", "99999-01-01", "0001-01-01", "1e308", "-1", "9999-12-31 23:59 -23:00", "\0")
        )
    ),
    Odd("byte_order_mark", lambda folder, right: put(folder, json.dumps(right).encode("utf-8-sig")), right=True),
    Odd("other_order", as_notebook(lambda cells: cells[::-1]), right=True),
    Odd("list_of_lines", rewritten(lambda source: source.splitlines(keepends=True)), right=True),
    Odd("magics", rewritten(lambda source: "%matplotlib inline\n" + source), right=True),
    Odd("check_in_the_cell", rewritten(lambda source: source + '\niou = check("04_iou.iou", iou)\n'), right=True),
    Odd("same_cell_twice", as_notebook(doubled(None)), right=True),
    Odd("two_answers", as_notebook(doubled(WRONG)), says="2 of 2 values are wrong"),
    Odd("cell_removed", as_notebook(lambda cells: cells.remove(cell(cells, "iou"))), says="no cell defines iou"),
    Odd("raw_cell", with_iou(cell_type="raw"), says="is raw text, and must be code"),
    Odd("markdown_cell", with_iou(cell_type="markdown"), says="is Markdown, and must be code"),
    Odd("nineteen_markdown_cells", as_notebook(with_markdown_cells), right=True),
    Odd("number_as_source", with_iou(source=7), says="no cell defines iou"),
    Odd("endless_source", with_iou(source="x = 1\n" * 200_000), "its code is longer than 1,000,000 characters"),
    Odd("half_a_character", with_iou(source=WRONG + "x = '\ud800'"), says="2 of 2 values are wrong"),
    Odd("null_byte", with_iou(source="x = 0\0"), says="its cell is not Python"),
    Odd("no_python", with_iou(source="def iou(n)\n  return {"), says="its cell is not Python: look at line 1"),
    Odd("deep_source", with_iou(source="x = " + "(" * 90_000), says="its cell is not Python"),
    Odd("deep_tree", with_iou(source="def iou(n): return " + "-" * 90_000 + "1"), says="its cell is not Python"),
    Odd("many_names", with_iou(source="\n".join(f"x{i} = x{i + 1}" for i in range(1_000))), says="no cell defines iou"),
    Odd("better_marks", as_notebook(better_marks), says="2 of 2 values are wrong"),
    Odd("blank", with_iou(source="def iou(n):\n    raise NotImplementedError\n"), says="not answered yet"),
)
