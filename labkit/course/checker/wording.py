"""Findings in words: the student's own line, the marked part of it, and a question about it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from labkit.course.checker.finding import REPAIRS, WATCHES, Finding

LONGEST_LINE = 110  # characters of a student's line that are shown

SAYS = {
    # What a watch showed: these are not repairs, so they say what happens there.
    "overflow": "The marked part grows beyond what a float can hold{value}. What keeps it small?",
    "division": "The marked part divides by 0, or takes the logarithm of 0. When is that, and what is right then?",
    "no number": "The marked part has no result (0 / 0, for example). In which case is that, and what is right then?",
    "wraps": "The marked part is computed in bytes or other small integers. Behind their largest number they begin "
    "again. Which type is wide enough?",
    "writes": "This line changes an argument, perhaps through another name for it or for a part of it. Whoever calls "
    "the function still needs the old values: work on a copy.",
    # Repairs: with the marked part written otherwise, every case is right.
    "comparison": "Another comparison belongs at the marked place{s}. What should come out on the limit itself?",
    "operator": "Another operator belongs at the marked place{s}. Which one?",
    "axis": "Another axis belongs at the marked place{s}. Along which one do the numbers belong together?",
    "keepdims": "The numbers are right, the axes are not: should the summed axis stay, with length 1?",
    "name": "Another of your variables belongs at the marked place{s}. Which one?",
    "sign": "The sign is wrong at the marked place{s}: is there a minus too many, or one too few?",
    "absolute": "The sign of the marked part should not count. What makes it positive?",
    "not": "The marked condition is true where it should be false, and false where it should be true.",
    "order": "Something stands in the wrong order at the marked place{s}. What comes first there?",
    "brackets": "Brackets are missing here, or they stand elsewhere. What has to be computed first?",
    "constant": "Another number belongs at the marked place{s}. Which one?",
    "slice": "Another slice belongs at the marked place{s}. Where does it begin and end, and in which direction?",
    "type": "Another type belongs at the marked place{s}. Which numbers must it be able to hold?",
    "option": "The marked option is wrong, or one too many. What does it do, and what happens without it?",
    "function": "A similar function belongs at the marked place{s}. What does yours do, and what should it do?",
    "transpose": "Rows and columns are the wrong way round at the marked place{s}.",
    "condition": "In the marked condition a part is missing, or one part is too much. What must hold there?",
    "branch": "Here the wrong branch runs, in some case or in all. When should it run?",
    "cast": "The values are right, but their type is not. Should they be whole numbers, fractions, or true and false?",
    "index": "This index counts along the wrong axis. Along which axis should it count?",
    "size": "This is another length than the one that you need. How many of what should be counted?",
    "line too many": "Without the marked line every case is right. What should it do, and what does it really do?",
    "lines exchanged": "These two lines stand in the wrong order. Which one needs what the other one changes?",
    "moved": "The line is right, but it stands in the wrong block. When should it run: in each turn, or once?",
    "names exchanged": "Two names are exchanged here. Which one belongs where?",
    "copy": "A later line changes this array, although you still need its old values. Where is a copy needed?",
    "factor": "The marked part should be larger or smaller by a constant factor. Which one, and why?",
    "power": "The marked part should be squared, or its root taken. Which one, and why?",
    "logarithm": "A logarithm is missing here. What does the formula take: the number, or its logarithm?",
    "exponential": "An exponential is missing here. What does the formula take: the number, or its logarithm?",
    "off by one": "The marked part is off by one, or by a half. Where do you begin to count?",
    "complement": "The marked part is the share of the others. Whose share do you need?",
    "reciprocal": "Numerator and denominator are exchanged here. What is divided by what?",
    "shift": "Something has to be subtracted from the marked part before it is used. What is it?",
    "divided": "The marked part is not yet divided by what it should be. What should its sum or its length be?",
    "term": "Beside the marked part a term or a factor is missing, made of your own variables. Which one?",
    "new axis": "An axis is missing here. Which shapes meet in this line, and which entries should meet?",
    "sum": "The marked part should become fewer numbers first: a sum, a mean, a largest or a smallest one. Of what?",
    "reversed": "The order is turned round here. Which one comes first?",
    "rounding": "The marked part should be a whole number. Which one: the nearest, the one below, or the one above?",
    "bound": "The marked part may grow too large or too small. Between which bounds should it stay?",
    "period": "The marked part comes round again, as an angle does. After how much?",
    "index missing": "All entries are used here, but one of them is meant. Which one?",
    "index too many": "One entry is used here, but all are meant.",
    "call too many": "The marked call is one too many: every case is right without it. What does it do there?",
    "too much": "The marked part is one too many: every case is right without it. What is it there for?",
}
assert SAYS.keys() == {*WATCHES, *REPAIRS}


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
    return SAYS[finding.kind].replace("{value}", value).replace("{s}", several)


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
