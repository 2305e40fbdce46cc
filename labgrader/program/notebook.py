"""What a notebook's file may be to be graded; `check` and `check FILE` say the same of it as the grader does."""

import json
import re
from collections.abc import Sequence

from labgrader.program.cell import CONFLICT, Cell, cells_of, grade_id

LARGEST_FILE = 100 << 20  # bytes
LARGEST_NOTEBOOK = 20 << 20  # bytes: a larger one is read without its outputs
MOST_MARKS = 8_000_000  # quotation marks and brackets of a large one: two seconds of looking for its outputs
MOST_VALUES = 1_000_000  # of JSON: a second of parsing and 100 MB of memory
MOST_CELLS = 5_000
MOST_SOURCE = 1_000_000  # characters of code
TOKEN = re.compile(rb'"[^"\\]*+(?:\\.[^"\\]*+)*+(?:"|\\?\Z)|[\[\]{}]', re.DOTALL)  # a text, or a bracket
OUTPUTS = re.compile(rb'"outputs"\s*:\s*')
# What a file is that is none of a notebook, by how it begins.
OTHERS = {
    b"%PDF": "a PDF",
    b"PK\x03\x04": "a zip or an office document",
    b"\x1f\x8b": "a packed file",
    b"\x89PNG": "a picture",
    b"\xff\xd8\xff": "a picture",
    b"\xff\xfe": "UTF-16 text: save it as UTF-8",
    b"\xfe\xff": "UTF-16 text: save it as UTF-8",
    b"<!doctype html": "a web page: download the notebook itself",
    b"<html": "a web page: download the notebook itself",
    b"version https://git-lfs": "a pointer of git LFS: fetch the notebook itself",
}


class Unreadable(Exception):
    """A submission that cannot be read; the text says why, for the instructor's table."""


def readable(data: bytes) -> bytes:
    """What is parsed of a file: all of it, or, where that is too much, what is left without the cells' outputs.

    Raises Unreadable for one that is not parsed: for its size, or for how many values it holds.
    """
    if len(data) > LARGEST_FILE:
        raise Unreadable(f"it is larger than {LARGEST_FILE >> 20} MB")
    if len(data) <= LARGEST_NOTEBOOK and values_in(data) <= MOST_VALUES:
        return data
    data = without_outputs(data)
    if len(data) > LARGEST_NOTEBOOK:
        raise Unreadable(f"it is larger than {LARGEST_NOTEBOOK >> 20} MB without its outputs")
    if values_in(data) > MOST_VALUES:
        raise Unreadable(f"it holds more than {MOST_VALUES:,} values without its outputs")
    return data


def values_in(data: bytes) -> int:
    """How many values a text of JSON holds at most."""
    return sum(map(data.count, (b",", b"[", b"{")))


def without_outputs(data: bytes) -> bytes:
    """A notebook's text without its outputs, which is neither decoded nor parsed for it.

    >>> without_outputs(b'{"outputs": [{"x": "]"}], "source": "\\\\"outputs\\\\": [1]"}')
    b'{"outputs": [], "source": "\\\\"outputs\\\\": [1]"}'
    """
    if sum(map(data.count, (b'"', b"[", b"{"))) > MOST_MARKS:
        raise Unreadable(f"it holds more than {MOST_MARKS // 2:,} texts and lists: clear its outputs")
    kept, begin, at = [], 0, 0
    while token := TOKEN.search(data, at):
        at = token.end()
        key = OUTPUTS.match(data, token.start()) if data[token.start() : at] == b'"outputs"' else None
        if key is not None:
            kept += [data[begin : key.end()], b"[]"]
            begin = at = end_of_value(data, key.end())
    return b"".join([*kept, data[begin:]])


def end_of_value(data: bytes, at: int) -> int:
    """Where the JSON value that begins at `at` ends."""
    if data[at : at + 1] not in (b"[", b"{", b'"'):
        return re.compile(rb"[^,\]}\s]*").match(data, at).end()
    depth = 0
    while token := TOKEN.search(data, at):
        at, mark = token.end(), data[token.start()]
        depth += (mark in b"[{") - (mark in b"]}")
        if depth <= 0:
            return at
    return len(data)


def parse(data: bytes) -> dict:
    """A notebook of format 4, without outputs if it is large; raises Unreadable, which says what a file is instead."""
    if not data.strip(b"\0 \t\r\n"):
        raise Unreadable("it holds nothing but zeros: its upload failed" if data.strip() else "it is empty")
    begin = data[:99].removeprefix(b"\xef\xbb\xbf").lstrip().lower()
    if what := next((said for start, said in OTHERS.items() if begin.startswith(start.lower())), ""):
        raise Unreadable(f"it is no notebook but {what}")
    data = readable(data)
    try:
        notebook = json.loads(data.decode("utf-8-sig"))
    except UnicodeDecodeError:
        raise Unreadable("it is not UTF-8 text") from None
    except (ValueError, RecursionError) as error:
        raise Unreadable(fault_of_text(data, error)) from None
    if isinstance(notebook, dict) and "cells" not in notebook and isinstance(notebook.get("worksheets"), list):
        raise Unreadable("it is a notebook of format 3: open it in Jupyter and save it, which makes it one of format 4")
    if not isinstance(notebook, dict) or not isinstance(notebook.get("cells"), list):
        raise Unreadable("it is not a notebook of format 4: there is no list of cells")
    if len(notebook["cells"]) > MOST_CELLS:
        raise Unreadable(f"it has more than {MOST_CELLS:,} cells")
    return notebook


def fault_of_text(data: bytes, error: Exception) -> str:
    """Why a text is no JSON, as far as somebody can mend it."""
    text = data.decode("utf-8", "replace")
    if (mark := CONFLICT.search(text)) and "\n=======" in text:
        line = text.count("\n", 0, mark.start()) + 1
        return f"it has git's conflict marks, the first in line {line}: keep one of the two versions, then save it"
    is_at_end = isinstance(error, json.JSONDecodeError) and not error.doc[error.pos :].strip()
    if is_at_end or str(error).startswith("Unterminated string"):
        return "it ends in the middle: its upload, or its saving, was cut off"
    return "it is not JSON, so not a notebook"


def no_code(cells: Sequence) -> dict[str, str]:
    """By grade id what to say of the cells that are not code, and may have been: a key press makes them so."""
    found = {}
    for number, cell in enumerate(cells, start=1):
        kind = cell.get("cell_type") if isinstance(cell, dict) else None
        if kind in ("markdown", "raw") and (name := grade_id(cell)):
            kind = "Markdown" if kind == "markdown" else "raw text"
            found[name] = (
                f"its cell, number {number} of the notebook, is {kind}, and must be code: click it, press Esc, Y"
            )
    return found


def code_of(cells: object) -> list[Cell]:
    """The code cells of a notebook; raises Unreadable if they hold more than is parsed."""
    found = cells_of(cells)
    refuse_long(found)
    return found


def refuse_long(cells: Sequence[Cell]) -> None:
    """Raise Unreadable for cells with more code than is parsed."""
    if sum(len(cell.source) for cell in cells) > MOST_SOURCE:
        raise Unreadable(f"its code is longer than {MOST_SOURCE:,} characters")
