"""A case and a student's lines in words: the call, what came and what was expected; the marked part, and a question.

`shown_case` is about a case, `said` and `marked` are about a finding.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from labgrader.comparison import Case, Problem, canonical, differences, different, parts
from labgrader.question import Question
from labgrader.reply.finding import IDLE, REPAIRS, WATCHES, Finding

LONGEST = 100  # characters of a line
LONGEST_CALL = 180  # of a call's arguments; they wrap, and whoever does a case by hand needs them all
MOST_NUMBERS = 24  # of an array that is shown whole
LONGEST_LINE = 110  # characters of a student's line that are shown


def shown_case(question: Question, case: Case, got: object) -> tuple[str, ...]:
    """Lines that show a case whose output is wrong, or a Problem."""
    lines = [call(question, case.args)]
    if isinstance(got, Problem):
        return tuple(lines)
    digits = enough_digits(got, case.expected)
    returned, expected = written(got, digits), written(case.expected, digits)
    if len(returned) <= LONGEST and len(expected) <= LONGEST and "..." not in returned + expected:
        return (*lines, f"returns   {returned}", f"expected  {expected}")
    return (*lines, *first_difference(question, case.expected, got))


def enough_digits(got: object, expected: object) -> int:
    """As many digits as show a difference."""
    return next((n for n in (5, 7, 9, 12) if written(got, n) != written(expected, n)), 5)


def call(question: Question, args: tuple) -> str:
    """The call of a case: small arguments written out, large ones by shape and type.

    >>> question = Question(name="0.mean", reference=lambda n, k: n, inputs=lambda rng: ())
    >>> call(question, (np.zeros((90, 120), np.uint8), 0.5))
    'mean(n = (90, 120) uint8 from 0 to 0, 0.5)'
    """
    whole = [written(value) for value in args]
    if sum(map(len, whole)) <= LONGEST_CALL and not any("..." in text for text in whole):
        return f"{question.function}({', '.join(whole)})"
    names = question.parameters
    short = [
        text if len(text) <= 30 and "..." not in text else f"{n} = {size_in_words(v)}"
        for n, v, text in zip(names, args, whole, strict=True)
    ]
    return f"{question.function}({', '.join(short)})"


def size_in_words(value: object) -> str:
    """Shape, type and range of an array; how many, of anything else."""
    if not isinstance(value, np.ndarray):
        return f"{type(value).__name__} of {len(value)}" if isinstance(value, tuple | list) else type(value).__name__
    if not value.size or value.dtype.kind not in "iuf":
        return f"{value.shape} {value.dtype}"
    with np.errstate(all="ignore"):
        return f"{value.shape} {value.dtype} from {number(np.nanmin(value))} to {number(np.nanmax(value))}"


def written(value: object, digits: int = 5) -> str:
    """A number, array or tuple in one line; "..." for what is too large. digits: of each number.

    >>> written((np.array([[1.0, 0.5], [-0.0, np.nan]]), True))
    '([[1, 0.5], [0, nan]], True)'
    """
    if isinstance(value, tuple | list):
        return "(" + ", ".join(written(part, digits) for part in value) + ")"
    if isinstance(value, np.ndarray) and value.ndim:
        return "[" + ", ".join(written(part, digits) for part in value) + "]" if value.size <= MOST_NUMBERS else "..."
    return number(value, digits)


def number(value: object, digits: int = 5) -> str:
    """A number in so many digits."""
    if isinstance(value, float | np.floating) or (isinstance(value, np.ndarray) and value.dtype.kind == "f"):
        return f"{float(value) + 0.0:.{digits}g}"  # + 0.0: -0 is 0
    return str(value)


def first_difference(question: Question, expected: object, got: object) -> list[str]:
    """Where two large outputs first differ, and in how many numbers."""
    for k, (e, g) in enumerate(zip(parts(expected), parts(got), strict=False)):
        name = f"output {k + 1}" if isinstance(expected, tuple) else "the output"
        e, g = np.asarray(e), np.asarray(g)
        if e.shape != g.shape:
            return [f"{name} has shape {g.shape}, expected {e.shape}"]
        (wrong,) = differences(question, *((e, g) if isinstance(expected, tuple) else canonical(question, e, g)))[:1]
        if wrong.shape != np.atleast_1d(e).shape:
            wrong = different(question, np.atleast_1d(e), np.atleast_1d(g))
        if wrong.any():
            at = tuple(int(i) for i in np.argwhere(wrong)[0])
            came, right = np.atleast_1d(g)[at], np.atleast_1d(e)[at]
            digits = enough_digits(came, right)
            came, right = number(came, digits), number(right, digits)
            place = f"at {list(at)} " if e.ndim else ""
            return [
                f"{name} is {came} {place}where {right} is expected; {np.count_nonzero(wrong)} of {wrong.size} differ"
            ]
    return []


# -------------------------------------------------------------------------------------- a student's own lines


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
    size = "" if finding.exponent is None else f": a number as large as {finding.exponent:.4g} goes into it"
    plural, singular = ("s", "") if len(finding.spans) > 1 else ("", "s")
    says = (WATCHES | IDLE | REPAIRS)[finding.kind].replace("{exponent}", size)
    return says.replace("{s}", plural).replace("{es}", singular)


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
    return tuple(shown_line(n, pieces[k][1].split("\n")[n - 1], parts[k, n]) for k, n in sorted(parts))


def shown_line(number: int, text: str, parts: set[tuple[int, int]]) -> Marked:
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
