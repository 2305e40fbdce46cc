"""Lessons run again, and their marked numbers written anew: after a change of camera, scenes or versions.

A marked number is found in the old output by its value, and in the new one at the same place. The output must say the
same but for its numbers: where it does not, or where two places would give two numbers, a person has to look.
"""

import ast
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from itertools import combinations, product
from pathlib import Path

from labcli.marks import CONSTANTS, MARK, NUMBER, OPERAND, computed, numbers, printed, rounds_to, value
from labkit.support.validation import require

LEAST_SEED, MOST_SEED = 600_000, 700_000  # seeds of lessons and labs; a smaller one stands in a call alone


@dataclass(frozen=True)
class Doubt:
    """A sentence of a cell that a person has to read, and why."""

    cell: str
    sentence: str
    why: str


def run(path: Path) -> dict[str, str]:
    """Run a notebook in place, its outputs as the committed ones are; what each cell printed before, by its id."""
    import nbformat
    from nbclient import NotebookClient

    notebook = nbformat.read(path, as_version=4)
    before = {cell.id: printed(cell) for cell in notebook.cells}
    place = {"metadata": {"path": str(path.parent)}}
    metadata = dict(notebook.metadata)
    NotebookClient(notebook, timeout=None, resources=place, store_widget_state=False, record_timing=False).execute()
    for cell in notebook.cells:
        for output in cell.get("outputs", []):
            output.get("data", {}).pop("application/vnd.jupyter.widget-view+json", None)
    notebook.metadata = metadata
    nbformat.write(notebook, path)
    return before


def scenes_of(path: Path) -> list[tuple[int, str]]:
    """Seeds and configs of the scenes that a notebook names in its code, and perhaps some more.

    A seed in a list or a range goes with each config that the notebook names. A seed that is computed is not found.
    """
    import nbformat

    from data_gen.scenes import CONFIGS

    cells = [cell for cell in nbformat.read(path, as_version=4).cells if cell.cell_type == "code"]
    code = "\n".join(re.sub(r"^[%!].*", "pass", cell.source, flags=re.MULTILINE) for cell in cells)
    nodes = list(ast.walk(ast.parse(code)))
    named = {node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str)}
    found, seeds, ends = set(), set(), set()
    for node in nodes:
        if isinstance(node, ast.Call) and node.args:
            values = [argument.value for argument in node.args if isinstance(argument, ast.Constant)]
            name = ast.unparse(node.func).rpartition(".")[2]
            if name == "sample_scene" and len(values) == len(node.args):
                found.add((values[0], values[1] if len(values) > 1 else "train"))
            elif name == "range" and len(values) == len(node.args) > 1 and values[0] >= LEAST_SEED:
                seeds |= set(range(*values))
                ends.add(id(node.args[1]))  # ast.walk comes to it later
        elif (
            isinstance(node, ast.Constant)
            and id(node) not in ends
            and type(node.value) is int
            and LEAST_SEED <= node.value < MOST_SEED
        ):
            seeds.add(node.value)
    return sorted(found | set(product(seeds, named & CONFIGS.keys() or {"train"})))


def holding(family: str, paths: list[Path]) -> dict[Path, list[tuple[int, str]]]:
    """Notebooks whose scenes hold a thing of a family, and which of their scenes do.

    Raises ValueError if no scene can hold such a thing.
    """
    import data_gen
    from data_gen.families import FAMILIES

    require("family", family in FAMILIES, f"one of {', '.join(FAMILIES)}", repr(family))

    @cache
    def holds(seed: int, config: str) -> bool:
        return any(thing.family == family for thing in data_gen.sample_scene(seed, config).objects)

    found = {path: [scene for scene in scenes_of(path) if holds(*scene)] for path in paths}
    return {path: scenes for path, scenes in found.items() if scenes}


def renumber(path: Path, before: dict[str, str]) -> tuple[int, list[Doubt]]:
    """Write the marked numbers of a notebook that was run again; how many changed, and what has to be read.

    before: what each cell printed when the numbers were written, by the cell's id.
    """
    import nbformat

    notebook = nbformat.read(path, as_version=4)
    after = {cell.id: printed(cell) for cell in notebook.cells}
    changed, doubts, last = 0, [], ""
    for cell in notebook.cells:
        if cell.cell_type == "code":
            last = cell.id if re.search(r"\d", before[cell.id]) else last
            continue
        text, n, found = in_prose(cell.source, cell.id, last, before, after)
        changed, doubts, cell.source = changed + n, doubts + found, text
    nbformat.write(notebook, path)
    return changed, doubts


def in_prose(
    text: str, cell: str, last: str, before: dict[str, str], after: dict[str, str]
) -> tuple[str, int, list[Doubt]]:
    """A cell's text with its marked numbers anew, how many changed, and doubts; last: the cell that printed before."""
    changed, failed = 0, {}

    def anew(match: re.Match) -> str:
        nonlocal changed
        number, percent, identity, formula = match.groups()
        of = [last] if not identity else [name for name in before if name.startswith(identity)]
        old, new = ("\n".join(texts[name] for name in of if name in texts) for texts in (before, after))
        try:
            written, formula_now = renumbered(number, bool(percent), formula, old, new)
        except ValueError as error:
            failed[match.start()] = str(error)
            return match[0]
        changed += written != number
        whole = match[0].replace(number, written, 1)
        return whole.replace(formula, formula_now) if formula else whole

    result = MARK.sub(anew, text)
    doubts = [Doubt(cell, sentence_at(text, at), why) for at, why in failed.items()]
    for old, new in zip(sentences(text), sentences(result), strict=True):
        if why := reads_otherwise(old, new):
            doubts.append(Doubt(cell, " ".join(new.split()), why))
    return result, changed, doubts


def renumbered(number: str, percent: bool, formula: str | None, old: str, new: str) -> tuple[str, str]:
    """A marked number and its formula as the new output has them; ValueError says why it cannot be told."""
    if re.sub(NUMBER, "#", old) != re.sub(NUMBER, "#", new):
        raise ValueError("the output says something else")
    digits = len(number.partition(".")[2])
    if formula:
        formula_now = re.sub(OPERAND, lambda operand: in_its_place(operand[0], old, new), formula)
        n = computed(formula_now)
        factor = 100 if percent and not rounds_to(computed(formula), number, digits) else 1
    else:
        formula_now, n, factor = "", *number_in_its_place(number, percent, digits, old, new)
    if rounds_to(factor * n, number, digits):
        return number, formula_now
    if "e" in number:
        raise ValueError(f"it is {n:g} now")
    n = abs(factor * n) if value(number) > 0 else factor * n  # prose may leave a sign to its words
    return (f"{n:,.{digits}f}" if "," in number or abs(n) >= 10_000 else f"{n:.{digits}f}"), formula_now


def number_in_its_place(number: str, percent: bool, digits: int, old: str, new: str) -> tuple[float, int]:
    """The number that stands where a rounded one came from, and 100 if prose gives a share of 1 in percent."""
    found = set()
    for was, now in zip(numbers(old), numbers(new), strict=True):
        for factor in (1, 100) if percent else (1,):
            if rounds_to(factor * value(was), number, digits):
                found.add((value(now), factor))
    if len({round(abs(n) * factor, digits) for n, factor in found}) != 1:
        raise ValueError(
            "several places of the output could be meant" if found else "the output did not show it before"
        )
    return found.pop()


def in_its_place(operand: str, old: str, new: str) -> str:
    """An operand of a formula as the new output has it."""
    there = [now for was, now in zip(numbers(old), numbers(new), strict=True) if value(was) == value(operand)]
    if not there and value(operand) in CONSTANTS:
        return operand
    if len(set(there)) != 1:
        raise ValueError(
            "several places of the output could be meant" if there else "the output did not show it before"
        )
    return there[0].replace(",", "")


# ------------------------------------------------------------------------------------------ what has to be read


def sentences(text: str) -> list[str]:
    """A text's sentences, in order."""
    return re.split(r"(?<=[.!?:])\s+(?=[A-Z*(])|\n{2,}", text)


def sentence_at(text: str, place: int) -> str:
    """The sentence in which a place of a text is."""
    end = 0
    for sentence in sentences(text):
        end = text.index(sentence, end) + len(sentence)
        if place < end:
            return " ".join(sentence.split())
    raise ValueError(f"place: expected one in the text, got {place}")


def reads_otherwise(old: str, new: str) -> str:
    """Why a sentence's claim may no longer hold: two of its marked numbers changed order, or one its sign or size."""
    was, now = ([value(mark[1]) for mark in MARK.finditer(text)] for text in (old, new))
    for i, j in combinations(range(len(was)), 2):
        if order(was[i], was[j]) != order(now[i], now[j]):
            return f"{was[i]:g} and {was[j]:g} are {now[i]:g} and {now[j]:g} now"
    for before, after in zip(was, now, strict=True):
        if before * after < 0 or abs(after - before) > 0.25 * abs(before):
            return f"{before:g} is {after:g} now"
    return ""


def order(a: float, b: float) -> int:
    """-1, 0 or 1: a is smaller, equal or larger."""
    return (a > b) - (a < b)


def all_of(paths: list[Path], say: Callable[[str], None]) -> bool:
    """Run notebooks, write their numbers anew, and say what has to be read; whether there is nothing."""
    clear = True
    for path in paths:
        changed, doubts = renumber(path, run(path))
        say(f"{path}: {changed} numbers written anew, {len(doubts)} sentences to read")
        for doubt in doubts:
            say(f"  cell {doubt.cell[:8]}, {doubt.why}: {doubt.sentence}")
        clear = clear and not doubts
    return clear
