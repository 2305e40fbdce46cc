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
# What a watch shows, and what is said of it: these are no repairs, so they say what happens there.
WATCHES = {
    "overflow": "The marked part overflows a float{exponent}. What keeps it small?",
    "wraps": "The marked part is a whole number of a type that cannot hold it, so it wraps around. Which type can?",
    "division": "The marked part divides by 0, or takes the log of 0. When does that happen, and what is right then?",
    "nothing": "The marked part is the mean of nothing, and so NaN. When is nothing left there, and should it be?",
    "no number": "The marked part is NaN (0 / 0, for example). When does that happen, and what is right then?",
    "aliased": "All rows of this list are the same list: what you write into one row appears in all of them. How "
    "is a new list made for each row?",
    "writes": "This line changes an argument, perhaps through another name for it or for a part of it. Whoever calls "
    "the function still needs the old values: work on a copy.",
}
# What has no effect: `unread` is told before repairs, `unused` where nothing else names a mistake.
IDLE = {
    "unread": "Your function never reads the marked argument. What is it for in this task?",
    "unused": "Nothing uses what the marked line computes. Is it left over, or where does it belong?",
}
# Kinds of repairs, and what is said of each: with the marked part written otherwise, every case is right. Of repairs
# that change equally much, the kind that stands first here is told. A copy comes first, since nothing else explains
# what it mends; then what can be left out, since any other change of such a part is right by accident; the order of
# the rest is learnt from answers of students.
REPAIRS = {
    "copy": "A later line changes this array, although you still need its old values. Where is a copy needed?",
    "line too many": "Without the marked line every case is right. What should it do, and what does it really do?",
    "branch": "Without the marked branch every case is right. When does it run, and what is different then?",
    "always": "The marked condition should not be there: every case is right if its lines always run.",
    "too much": "The marked part should not be there: every case is right without it. What is it for?",
    "condition": "The marked condition lacks a part, or has one too many. What must hold there?",
    "option": "The marked option is wrong, or should not be there. What does it do, and what happens without it?",
    "call too many": "The marked call should not be there: every case is right without it. What does it do?",
    "comparison": "The marked place{s} need{es} another comparison. What should happen exactly at the limit?",
    "operator": "The marked place{s} need{es} another operator. Which one?",
    "axis": "The marked place{s} need{es} another axis. Along which axis do the numbers belong together?",
    "name": "The marked place{s} need{es} another of your variables. Which one?",
    "sign": "The sign is wrong at the marked place{s}: is there a minus too many, or one too few?",
    "absolute": "The sign of the marked part should not count. What makes it positive?",
    "not": "The marked condition is true where it should be false, and false where it should be true.",
    "order": "Something is in the wrong order at the marked place{s}. What comes first there?",
    "brackets": "Brackets are missing here, or are misplaced. What has to be computed first?",
    "constant": "The marked place{s} need{es} another number. Which one?",
    "slice": "The marked place{s} need{es} another slice. Where does it begin and end, and in which direction?",
    "part": "Not all of the marked part is meant here. Which of its entries, rows or columns are?",
    "type": "The marked place{s} need{es} another dtype. Which numbers must it be able to hold?",
    "function": "The marked place{s} need{es} a similar function. What does yours do, and what should it do?",
    "transpose": "Rows and columns are the wrong way round at the marked place{s}.",
    "cast": "The values are right, but their type is not. Should they be whole numbers, fractions, or true and false?",
    "loop": "`break` ends the whole loop, `continue` only this iteration. Which one do you want here?",
    "lines exchanged": "These two lines are in the wrong order. Which one needs what the other changes?",
    "moved": "The line is right, but it is in the wrong block. When should it run: in each iteration, or once?",
    "names exchanged": "Two names are swapped here. Which one belongs where?",
    "a hair": "The marked part comes out a hair below a whole number, 12.999... for 13, and is then cut off. "
    "How does dividing integers, once and at the very end, avoid that?",
    "off by one": "The marked part is off by one, or by a half. Where do you start counting? If you round: which way?",
    "factor": "The marked part should be larger or smaller by a constant factor. Which one, and why?",
    "logarithm": "A logarithm is missing here. What does the formula take: the number, or its logarithm?",
    "reciprocal": "Numerator and denominator are swapped here. What is divided by what?",
    "shift": "Something has to be subtracted from the marked part before it is used. What is it?",
    "divided": "The marked part is not yet divided by what it should be. What should its sum or its length be?",
    "term": "A term or a factor, made of your own variables, is missing next to the marked part. Which one?",
    "new axis": "An axis is missing here. Which shapes meet in this line, and which entries should meet?",
    "sum": "The marked part should be reduced first: to a sum, a mean, a maximum or a minimum. Over what?",
    "reversed": "The order is reversed here. Which one comes first?",
    "rounding": "The marked part should be a whole number. Which one: the nearest, the one below, or the one above?",
    "index too many": "One entry is used here, but all are needed.",
}


@dataclass(frozen=True)
class Span:
    """A part of a text: lines from 1, columns in bytes from 0; `end` is the first column behind it, on `last_line`."""

    line: int
    column: int
    last_line: int
    end: int


@dataclass(frozen=True)
class Finding:
    """What a watch or a repair found, or what stands idle.

    kind: of WATCHES, IDLE or REPAIRS. piece: number of the program's piece; spans: the places in its text.
    exponent: the largest one, where an exponential overflows. listed: the number of a listed mistake, where it is wrong
    beside this place.
    """

    kind: str
    piece: int
    spans: tuple[Span, ...]
    exponent: float | None = None
    listed: int | None = None

    @property
    def width(self) -> int:
        """How much is marked: bytes of the text; a line more counts as many."""
        return sum(span.end - span.column + 200 * (span.last_line - span.line) for span in self.spans)


def write(findings: Sequence[Finding]) -> str:
    """Findings as JSON."""
    return json.dumps([asdict(finding) for finding in findings[:MOST_FINDINGS]])


def read_findings(text: str, pieces: Sequence[tuple[str, str]]) -> list[Finding]:
    """Findings of JSON that anybody may have written; none if anything in it is not as `write` makes it.

    >>> read_findings('[{"kind": "axis", "piece": 0, "spans": [[1, 0, 1, 3]], "exponent": 1}]', [("f", "def f(): 0")])
    []
    """
    try:
        return [checked(entry, pieces) for entry in json.loads(text)[:MOST_FINDINGS]]
    except (ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError):
        return []


def checked(entry: dict, pieces: Sequence[tuple[str, str]]) -> Finding:
    """One finding; raises ValueError, TypeError or KeyError for one that cannot be."""
    kind, piece, exponent, listed = (entry[name] for name in ("kind", "piece", "exponent", "listed"))
    if kind not in (*WATCHES, *IDLE, *REPAIRS) or type(piece) is not int or not 0 <= piece < len(pieces):
        raise ValueError("no such kind or piece")
    if exponent is not None and not math.isfinite(exponent):
        raise ValueError("no such number")
    if listed is not None and (type(listed) is not int or listed < 0):
        raise ValueError("no such mistake")
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
    return Finding(kind, piece, spans, exponent, listed)
