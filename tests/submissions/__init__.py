"""Submissions as students hand them in: honest ones to 04_iou.iou in honest.txt, to other tasks in labs.txt."""

import ast
from dataclasses import dataclass, replace
from pathlib import Path

FUNCTION = "iou"
# What short names of cells in honest.txt stand for: the lab's own cells.
OWN = {
    "setup": [("import numpy as np", "setup")],
    "check": [('iou = check("04_iou.iou", iou)', "check_iou")],
}
OWN["lab"] = [
    *OWN["setup"],
    ("import matplotlib.pyplot as plt\n\nimport data_gen\nfrom labkit import check", ""),
    ("frames = [data_gen.render(data_gen.sample_scene(seed)) for seed in (1, 2)]", ""),
]


@dataclass(frozen=True)
class Honest:
    """A submission: its name, its code cells with their grade ids, and words of its refusal, "" if it is right."""

    name: str
    cells: tuple[tuple[str, str], ...]
    refused: str = ""

    def notebook(self, **metadata) -> dict:
        """The notebook as JSON has it."""
        return {"cells": [code(*cell) for cell in self.cells], "metadata": metadata, "nbformat": 4, "nbformat_minor": 4}


def code(source: str, grade_id: str = "") -> dict:
    """A code cell as JSON has it."""
    mark = {"nbgrader": {"grade_id": grade_id, "solution": grade_id == FUNCTION}} if grade_id else {}
    return {"cell_type": "code", "metadata": mark, "source": source, "outputs": [], "execution_count": None}


def in_other_labs() -> list[Honest]:
    """The submissions of labs.txt, whose names begin with their question: "02_crf.energy: async"."""
    return [Honest(one.name, (*OWN["setup"], *one.cells), one.refused) for one in honest("labs.txt")]


def honest(file: str = "honest.txt") -> list[Honest]:
    """Read a file: "=== NAME | REFUSED WORDS" begins a submission, "--- GRADE ID" a cell."""
    found = []
    for text in ("\n" + Path(__file__).with_name(file).read_text()).split("\n=== ")[1:]:
        head, *cells = (
            text.split("\n--- ") if "\n---\n" not in text else text.replace("\n---\n", "\n--- \n").split("\n--- ")
        )
        name, _, refused = head.partition(" | ")
        pairs = [cell.partition("\n")[::2] for cell in cells]
        sources = [OWN.get(grade_id) or [(source.rstrip("\n"), grade_id)] for grade_id, source in pairs]
        found.append(Honest(name, tuple(cell for own in sources for cell in own), refused.strip()))
    return found


def as_editors_save_it(right: Honest) -> dict[str, dict]:
    """A notebook as Colab, VS Code, Windows and old editors save it."""
    colab = right.notebook(colab={"provenance": []}, accelerator="GPU", kernelspec={"name": "python3"})
    for number, cell in enumerate(colab["cells"]):
        cell["metadata"] |= {"id": f"x{number}", "executionInfo": {"status": "ok"}, "colab": {"base_uri": "local"}}
    lines = right.notebook()
    for cell in lines["cells"]:
        cell["source"] = cell["source"].splitlines(keepends=True)
        cell["metadata"] |= {"tags": ["mine"], "collapsed": True, "jupyter": {"source_hidden": False}}
    code_editor = right.notebook(language_info={"name": "python"}, vscode={"interpreter": {"hash": "0"}})
    for cell in code_editor["cells"]:
        cell["metadata"] |= {"vscode": {"languageId": "python"}}
    windows = right.notebook()
    for cell in windows["cells"]:
        cell["source"] = cell["source"].replace("\n", "\r\n")
    odd = right.notebook()
    odd["cells"] += [{"cell_type": "markdown", "metadata": {}, "source": "iou"}, {"cell_type": "raw"}, {}, None]
    return {"Colab": colab, "lines": lines, "VS Code": code_editor, "CRLF": windows, "other cells": odd}


def as_students_leave_it(right: Honest) -> dict[str, dict]:
    """A notebook whose first cell is the setup, with cells and their grade ids in other places."""
    setup, *answers = right.cells
    sources, ids = zip(*answers, strict=True)
    pieces = [
        (part, name if part is parts[-1] else "")
        for text, name in answers
        for parts in [parts_of(text)]
        for part in parts
    ]
    kinds = {
        "in reverse order": right.cells[::-1],
        "grade ids lost": [(text, "") for text, _ in right.cells],
        "grade ids of other cells": [setup, *zip(sources, ids[1:] + ids[:1], strict=True)],
        "all in one cell without a grade id": [setup, ("\n".join(sources), "")],
        "all in the first answer's cell": [setup, ("\n".join(sources), ids[0])],
        "copied cells": [setup, *(cell for cell in answers for _ in range(2))],
        "a cell for each definition": [setup, *pieces],
    }
    return {kind: replace(right, cells=tuple(cells)).notebook() for kind, cells in kinds.items()}


def parts_of(source: str) -> list[str]:
    """The statements of a cell."""
    return [ast.get_source_segment(source, statement) for statement in ast.parse(source).body]
