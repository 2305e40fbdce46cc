"""Findings: a place in a student's program and what is to be said of it, as they travel between processes.

A finding comes from a process that ran a student's program, perhaps a hostile one: `read` believes nothing of it but
numbers within the program's own text and words of a fixed list. The module needs the standard library alone.
"""

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass

MOST_FINDINGS = 8
MOST_SPANS = 6
WATCHES = ("overflow", "division", "no number", "wraps", "writes")
# Kinds of repairs. Of those that change as much the first is told: what a copy mends nothing else explains, and where
# a part can go, any other change of it is right by accident; the rest is learnt from answers of students.
REPAIRS = (
    "copy",
    "line too many",
    "too much",
    "condition",
    "option",
    "call too many",
    "comparison",
    "operator",
    "axis",
    "keepdims",
    "name",
    "sign",
    "absolute",
    "not",
    "order",
    "brackets",
    "constant",
    "slice",
    "type",
    "function",
    "index",
    "transpose",
    "branch",
    "cast",
    "size",
    "lines exchanged",
    "moved",
    "names exchanged",
    "off by one",
    "factor",
    "power",
    "logarithm",
    "exponential",
    "complement",
    "reciprocal",
    "shift",
    "divided",
    "term",
    "new axis",
    "sum",
    "reversed",
    "rounding",
    "bound",
    "period",
    "index missing",
    "index too many",
)


@dataclass(frozen=True)
class Span:
    """A part of a text: lines from 1, columns in bytes from 0; `end` is the first column behind it, on `last_line`."""

    line: int
    column: int
    last_line: int
    end: int


@dataclass(frozen=True)
class Finding:
    """What a watch or a repair found.

    kind: of WATCHES or REPAIRS. piece: number of the program's piece; spans: the places in its text. value: a number
    that was met there, NaN if none.
    """

    kind: str
    piece: int
    spans: tuple[Span, ...]
    value: float = math.nan

    @property
    def width(self) -> int:
        """How much is marked: bytes of the text; a line more counts as many."""
        return sum(span.end - span.column + 200 * (span.last_line - span.line) for span in self.spans)


def write(findings: Sequence[Finding]) -> str:
    """Findings as JSON."""
    return json.dumps([asdict(finding) for finding in findings[:MOST_FINDINGS]])


def read(text: str, pieces: Sequence[tuple[str, str]]) -> list[Finding]:
    """Findings of JSON that anybody may have written; none if anything in it is not as `write` makes it.

    >>> read('[{"kind": "axis", "piece": 0, "spans": [[1, 0, 1, 3]], "value": 1}]', [("f", "def f(): 0")])
    []
    """
    try:
        return [checked(entry, pieces) for entry in json.loads(text)[:MOST_FINDINGS]]
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return []


def checked(entry: dict, pieces: Sequence[tuple[str, str]]) -> Finding:
    """One finding; raises ValueError, TypeError or KeyError for one that cannot be."""
    kind, piece, value = entry["kind"], entry["piece"], float(entry["value"])
    if kind not in (*WATCHES, *REPAIRS) or type(piece) is not int or not 0 <= piece < len(pieces):
        raise ValueError("no such kind or piece")
    lines = pieces[piece][1].split("\n")
    spans = tuple(Span(**span) for span in entry["spans"][:MOST_SPANS])
    for span in spans:
        if any(type(number) is not int for number in asdict(span).values()):
            raise ValueError("places are whole numbers")
        if not 1 <= span.line <= span.last_line <= len(lines):
            raise ValueError("no such line")
        first, last = lines[span.line - 1].encode(), lines[span.last_line - 1].encode()
        backwards = span.line == span.last_line and span.end < span.column
        if backwards or not 0 <= span.column <= len(first) or not 0 <= span.end <= len(last):
            raise ValueError("no such column")
    if not spans:
        raise ValueError("no place")
    return Finding(kind, piece, spans, value)
