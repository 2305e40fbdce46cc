"""Answers in words that were written into a new cell beside the one that is theirs, or in the place of a deleted one.

A grade id belongs to a cell, and what a student writes into the next one has none: the answer would count as empty, and
nobody would read it. Such cells get the grade id of the answer that they follow; above an empty one, of that.
"""

from collections.abc import Collection, Sequence
from itertools import pairwise

from labgrader.program.cell import grade_id


def with_texts_astray(cells: Sequence, released: Sequence[dict], written: Collection[str]) -> list:
    """A submission's cells, of which those of new text beside a written answer have its grade id.

    released: the lab's cells, of the release that the student had; written: grade ids of the answers in words.
    """
    known, blank = set(map(bare, released)), {grade_id(cell): bare(cell) for cell in released if grade_id(cell)}
    gone = {*written} - set(map(grade_id, cells))
    place = {known_by(above): grade_id(cell) for above, cell in pairwise(released) if grade_id(cell) in gone}
    found, owner, waiting = [], "", []  # waiting: positions of new texts that follow no answer
    for cell in cells:
        name, text = grade_id(cell), bare(cell)
        if name not in blank and is_text(cell) and text and text not in known:
            if owner:
                cell = marked(cell, owner)
            else:
                waiting.append(len(found))
        else:
            owner = name if name in written else place.get(known_by(cell), "")
            if name in written and text in ("", blank[name]):
                for i in waiting:
                    found[i] = marked(found[i], name)
            waiting = []
        found.append(cell)
    return found


def is_text(cell: object) -> bool:
    """Whether a cell holds text, formatted or raw."""
    return isinstance(cell, dict) and cell.get("cell_type") in ("markdown", "raw")


def bare(cell: object) -> str:
    """The source of a cell without blanks and ends of lines, which editors change."""
    source = cell.get("source") if isinstance(cell, dict) else ""
    lines = source if isinstance(source, list) else [source]
    return "".join("".join(line for line in lines if isinstance(line, str)).split())


def known_by(cell: dict) -> str:
    """What a cell of the lab is found by in a submission."""
    return grade_id(cell) or bare(cell)


def marked(cell: dict, name: str) -> dict:
    """A cell with a grade id."""
    return cell | {"metadata": {"nbgrader": {"grade_id": name}}}
