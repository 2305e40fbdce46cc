"""The kernel that `make lab` and a hub start."""

import sys

import nbformat
import pytest
from nbclient import NotebookClient
from notebooks import ROOT

# 200 MB in pieces that the C library keeps when they are freed, since one that stays lies above them.
FILL = "pieces = [bytes([1]) * 100_000 for _ in range(2000)]\nlast = pieces[-1]\ndel pieces"
RESIDENT = "import pathlib\nprint(int(pathlib.Path('/proc/self/statm').read_text().split()[1]) * 4096 // 10**6)"


@pytest.mark.skipif(sys.platform != "linux", reason="the C library of Linux")
def test_memory_that_a_cell_has_freed_goes_back_to_the_machine(monkeypatch):
    monkeypatch.setenv("JUPYTER_PATH", str(ROOT / "labcourse/jupyter"))
    cells = [nbformat.v4.new_code_cell(text) for text in (f"{FILL}\n{RESIDENT}", RESIDENT)]
    done = NotebookClient(nbformat.v4.new_notebook(cells=cells), kernel_name="python3").execute()
    before, after = (int(cell.outputs[0].text) for cell in done.cells)
    assert before > 200 > after + 50
