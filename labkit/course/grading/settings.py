"""course.toml beside labs/: what an instructor decided, in blocks that commands write and anybody can read or edit."""

import datetime
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path

from labkit.course.topics import TOPICS

FILE = "course.toml"
TABLES = ("change", "deadline", "extension")
BLOCK = re.compile(rf"(?ms)^[ \t]*\[\[[ \t]*({'|'.join(TABLES)})[ \t]*\]\].*?(?=^[ \t]*\[|\Z)")
WORDS = {
    str: "a text",
    datetime.date: "a date such as 2026-10-05",
    float: "a number that is not negative",
    bool: "true",
}


def read_blocks(course: Path, table: str) -> list[tuple[str, dict]]:
    """The blocks of one kind, each with the file and the line where it stands; none if there is no file.

    Raises ValueError, with file and line, for what is no TOML and for blocks of another name.
    """
    path = Path(course) / FILE
    try:
        text = path.read_text(encoding="utf-8") if path.is_file() else ""
        odd = tomllib.loads(text).keys() - set(TABLES)
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: {error}") from None
    if odd:
        found = re.search(rf"(?m)^[ \t\[]*{re.escape(min(odd))}", text)
        line = text.count("\n", 0, found.start() if found else 0) + 1
        raise ValueError(f"{path}, line {line}: expected blocks [[{']], [['.join(TABLES)}]], got {min(odd)}")
    blocks = [
        (f"{path}, line {text.count(chr(10), 0, block.start()) + 1}", tomllib.loads(block[0])[table][0])
        for block in BLOCK.finditer(text)
        if block[1] == table
    ]
    return blocks


def fault_of_fields(data: Mapping, needed: Mapping[str, type], possible: Mapping[str, type]) -> str:
    """What of a block's fields cannot be used, "" if nothing: one that lacks, of another kind, or unknown."""
    for name, kind in (*needed.items(), *possible.items()):
        value = data.get(name)
        if value is None and name in possible:
            continue
        good = isinstance(value, int | float if kind is float else kind) and (kind is bool) == isinstance(value, bool)
        if not good or value is False or (kind is float and not 0 <= value < 1e6):
            return f"expected {name}, {WORDS[kind]}, in this block" + ("" if value is None else f", got {value}")
    if odd := data.keys() - needed.keys() - possible.keys():
        return f"expected {', '.join((*needed, *possible))} in this block, got {min(odd)}"
    return "" if data["lab"] in TOPICS else f"lab: expected one of {', '.join(TOPICS)}, got {data['lab']}"
