"""course.toml beside labs/: what an instructor decided, in blocks; of this package only `forget` writes there."""

import datetime
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path

from labgrader.course import topics

FILE = "course.toml"
TABLES = ("change", "deadline", "extension", "notebook", "bonus", "weight", "course", "canvas")
YEARS = range(2000, 2200)  # of dates, so that no zone or extension leads out of the calendar
WORDS = {
    str: "a text",
    datetime.date: "a date such as 2026-10-05",
    float: "a number that is not negative",
    bool: "true",
}


def read_blocks(course: Path, table: str) -> list[tuple[str, dict]]:
    """The blocks of one kind, each with words for where it stands; none if there is no file.

    Raises ValueError, with the file, for what is no TOML, for blocks of another name and for what is no block.
    """
    path = Path(course) / FILE
    try:
        settings = tomllib.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: {error}") from None
    for name, blocks in settings.items():
        if name not in TABLES or not isinstance(blocks, list) or not all(isinstance(block, dict) for block in blocks):
            raise ValueError(f"{path}: expected blocks [[{']], [['.join(TABLES)}]], got {name}")
    return [(f"{path}, [[{table}]] number {i}", block) for i, block in enumerate(settings.get(table, []), start=1)]


def usable_blocks(
    course: Path, table: str, needed: Mapping[str, type], possible: Mapping[str, type] | None = None
) -> Iterator[tuple[str, dict]]:
    """The blocks of one kind as `read_blocks` gives them; raises ValueError at one whose fields cannot be used."""
    for where, data in read_blocks(course, table):
        if fault := fault_of_fields(data, needed, possible or {}):
            raise ValueError(f"{where}: {fault}")
        yield where, data


def fault_of_fields(data: Mapping, needed: Mapping[str, type], possible: Mapping[str, type]) -> str:
    """What of a block's fields cannot be used, "" if nothing: one that lacks, of another kind, or unknown."""
    for name, kind in (*needed.items(), *possible.items()):
        value = data.get(name)
        if value is None and name in possible:
            continue
        good = isinstance(value, int | float if kind is float else kind) and (kind is bool) == isinstance(value, bool)
        if good and kind is datetime.date:
            good = value.year in YEARS
        if not good or value is False or (kind is float and not 0 <= value < 1e6):
            return f"expected {name}, {WORDS[kind]}, in this block" + ("" if value is None else f", got {value}")
    if odd := data.keys() - needed.keys() - possible.keys():
        return f"expected {', '.join((*needed, *possible))} in this block, got {min(odd)}"
    if "lab" not in needed:
        return ""
    return "" if data["lab"] in topics() else f"lab: expected one of {', '.join(topics())}, got {data['lab']}"
