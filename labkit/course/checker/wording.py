"""Findings in words: the student's own line, the marked part of it, and a question about it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from labkit.course.checker.finding import REPAIRS, WATCHES, Finding

LONGEST_LINE = 110  # characters of a student's line that are shown


@dataclass(frozen=True)
class Marked:
    """A student's line with the parts that are marked: number of the line, its text, (from, to) in characters."""

    number: int
    text: str
    parts: tuple[tuple[int, int], ...]

    def plain(self) -> tuple[str, str]:
        """The line, and a line below it with ^ under the marked parts."""
        label = f"Look at line {self.number}:  "
        below = "".join("^" if any(a <= i < b for a, b in self.parts) else " " for i in range(len(self.text)))
        return label + self.text, " " * len(label) + below.rstrip()


def said(finding: Finding) -> str:
    """The sentence about a finding."""
    value = ""
    if finding.kind == "overflow" and math.isfinite(finding.value):
        value = f": a number as large as {finding.value:.4g} goes into it"
    several = "s" if len(finding.spans) > 1 else ""
    return (WATCHES | REPAIRS)[finding.kind].replace("{value}", value).replace("{s}", several)


def marked(findings: Sequence[Finding], pieces: Sequence[tuple[str, str]]) -> tuple[Marked, ...]:
    """The lines that findings are in, each once, in the order of the text, with the marked parts."""
    parts: dict[tuple[int, int], set[tuple[int, int]]] = {}
    for finding in findings:
        lines = pieces[finding.piece][1].split("\n")
        for span in finding.spans:
            text = lines[span.line - 1].encode()
            end = span.end if span.last_line == span.line else len(text)
            within = len(text[: span.column].decode(errors="replace")), len(text[:end].decode(errors="replace"))
            parts.setdefault((finding.piece, span.line), set()).add(within)
    return tuple(shown(n, pieces[k][1].split("\n")[n - 1], parts[k, n]) for k, n in sorted(parts))


def shown(number: int, text: str, parts: set[tuple[int, int]]) -> Marked:
    """A line without its indentation and without what is too long for a page."""
    indent = len(text) - len(text.lstrip())
    parts = {trimmed(text, *part) for part in parts}
    first = min((a for a, _ in parts), default=indent)
    begin = indent if first - indent < LONGEST_LINE - 20 else first - 20
    clean = "".join(c if c.isprintable() else " " for c in text[begin : begin + LONGEST_LINE])
    return Marked(number, clean.rstrip(), tuple(sorted((max(a - begin, 0), max(b - begin, 0)) for a, b in parts)))


def trimmed(text: str, a: int, b: int) -> tuple[int, int]:
    """A part of a line without the blanks, brackets and commas round an operator."""
    while b - a > 1 and text[a] in " )]":
        a += 1
    while b - a > 1 and text[b - 1] in " ([":
        b -= 1
    return a, b
