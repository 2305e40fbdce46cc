"""What a handed-in file is: named where it is no notebook, and read without its outputs where they are too much."""

import json
import subprocess
import sys

import pytest

from labgrader.program.notebook import LARGEST_FILE, Unreadable, no_code, parse, without_outputs

CELLS = [
    {
        "cell_type": "code",
        "source": '"outputs": [1, "]"',
        "outputs": [{"text": ["}]\\", 'a "quote"'], "outputs": [[]]}],
    },
    {
        "cell_type": "code",
        "source": "\\",
        "outputs": "x" * 50,
        "metadata": {"outputs": None, "kept": [1, {"a": "outputs"}]},
    },
    {"cell_type": "markdown", "source": "outputs", "attachments": {"outputs": {"image/png": "iVBO"}}},
]
NOTEBOOK = {"cells": CELLS, "metadata": {}, "nbformat": 4, "nbformat_minor": 5}


def stripped(value):
    """A value of JSON whose keys `outputs` hold nothing, by Python's own parser."""
    if isinstance(value, dict):
        return {key: [] if key == "outputs" else stripped(inner) for key, inner in value.items()}
    return [stripped(inner) for inner in value] if isinstance(value, list) else value


@pytest.mark.parametrize("indent", [None, 1])
@pytest.mark.parametrize("ascii_only", [True, False])
def test_outputs_are_cut_out_of_the_text_as_a_parser_would_take_them(indent, ascii_only):
    text = json.dumps(
        NOTEBOOK | {"x": "\u00fc\u2028\ud800" if ascii_only else "\u00fc"}, indent=indent, ensure_ascii=ascii_only
    )
    assert json.loads(without_outputs(text.encode())) == stripped(json.loads(text))


@pytest.mark.parametrize(
    "data, says",
    [
        (b"", "it is empty"),
        (b" \n", "it is empty"),
        (bytes(100), "it holds nothing but zeros"),
        (
            b'{"cells": [\n<<<<<<< HEAD\n{}\n=======\n{}\n>>>>>>> theirs\n]}',
            "git's conflict marks, the first in line 2",
        ),
        (b'{"worksheets": [{"cells": []}], "nbformat": 3}', "it is a notebook of format 3: open it in Jupyter"),
        (b'{"cells": [{"cell_type": "co', "it ends in the middle"),
        (b'{"cells": [', "it ends in the middle"),
        (b"%PDF-1.7", "it is no notebook but a PDF"),
        (b"PK\x03\x04...", "it is no notebook but a zip"),
        (b"\n\xef\xbb\xbf", "it is not JSON"),
        (b"<!DOCTYPE html><html>", "it is no notebook but a web page: download"),
        ("{}".encode("utf-16"), "it is no notebook but UTF-16 text: save it as UTF-8"),
        (b"version https://git-lfs.github.com/spec/v1", "it is no notebook but a pointer of git LFS"),
        (b"import numpy", "it is not JSON, so not a notebook"),
        (b"[" * 9_000_000 + b" " * (20 << 20), "texts and lists: clear its outputs"),
        (b'"' + b'\\"' * 3_000_000 + b" " * (20 << 20), "it is larger than 20 MB without its outputs"),
        (b" " * (LARGEST_FILE - 1) + b"{}", "it is larger than 100 MB"),
    ],
)
def test_what_is_no_notebook_is_named_as_what_it_is(data, says):
    with pytest.raises(Unreadable) as reason:
        parse(data)
    assert says in str(reason.value)


LARGE = """
import json, resource
from labgrader.program.notebook import LARGEST_FILE, parse
data = b'{"cells": [{"cell_type": "code", "source": "x = 1", "outputs": [{"data": {"image/png": "'
data += b"x" * (LARGEST_FILE - 200) + b'"}}]}], "metadata": {}}'
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
assert parse(data)["cells"][0]["source"] == "x = 1" and len(data) > 99 << 20
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
"""


def test_a_notebook_of_100_MB_takes_little_more_memory_than_its_bytes():
    done = subprocess.run([sys.executable, "-c", LARGE], capture_output=True, text=True, check=True)
    assert int(done.stdout) < 20_000, "kilobytes beside the file's own"


def test_a_cell_that_is_no_code_any_more_is_told_with_its_place():
    mark = {"nbgrader": {"grade_id": "iou"}}
    cells = [{}, None, {"cell_type": "raw", "metadata": mark}, {"cell_type": "markdown", "metadata": {}}]
    said = "its cell, number 3 of the notebook, is raw text, and must be code: click it, press Esc, Y"
    assert no_code(cells) == {"iou": said}
