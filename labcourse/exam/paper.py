"""What a question for paper is, and the few ways in which all of them show numbers."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from fractions import Fraction

import numpy as np

LARGEST_DENOMINATOR = 1000  # an answer on paper is a whole number, three decimals, or a fraction up to this


class Again(Exception):
    """These numbers make no good question; draw others."""


@dataclass(frozen=True)
class Paper:
    """One question with its numbers.

    given: what was drawn, by name; labels, which are names and no quantities, are uint8 arrays. text: HTML. answer: the
    key, by the name of what is asked. how: the way there, for whoever corrects. mistakes: sentences, each with the
    wrong value that it explains, in the form of the first answer, or {name of an answer: value}. Raises Again if such
    a value looks on paper like the right one, or like that of another mistake.
    """

    given: dict[str, object]
    text: str
    answer: dict[str, object]
    how: str
    mistakes: dict[str, object] = field(default_factory=dict)

    def __post_init__(self):
        seen = {(name, shown(value)) for name, value in self.answer.items()}
        for what, (name, wrong) in self.wrong().items():
            if (name, shown(wrong)) in seen:
                raise Again(f"who {what} is right here, or made another mistake")
            seen.add((name, shown(wrong)))

    def wrong(self) -> dict[str, tuple[str, object]]:
        """Give for each mistake the name of the answer that it spoils, and the wrong value."""
        first = next(iter(self.answer))
        of = {what: value if isinstance(value, dict) else {first: value} for what, value in self.mistakes.items()}
        return {what: next(iter(value.items())) for what, value in of.items()}

    def worth(self, points: int) -> dict[str, Fraction]:
        """Split a question's points among its answers, in halves: each gets one, and more for more numbers."""
        halves = dict.fromkeys(self.answer, 1)
        values = {name: 0 if isinstance(value, str) else np.size(value) for name, value in self.answer.items()}
        for _ in range(2 * points - len(halves)):
            halves[max(halves, key=lambda name: (values[name] / halves[name], -halves[name]))] += 1
        return {name: Fraction(n, 2) for name, n in halves.items()}


@dataclass(frozen=True)
class PaperQuestion:
    """A question of the bank: its topic, such as "04_iou", its name, what it asks in a line, and how to draw it."""

    topic: str
    name: str
    about: str
    points: int
    minutes: int
    draw: Callable[[np.random.Generator], Paper]


def question(points: int, minutes: int) -> Callable:
    """Make a question of a function, whose docstring says in one line what is asked; the module's name is its topic."""

    def mark(draw: Callable) -> PaperQuestion:
        topic = draw.__module__.rpartition(".")[2].removeprefix("t")
        return PaperQuestion(topic, draw.__name__, draw.__doc__.strip().rstrip("."), points, minutes, draw)

    return mark


def again(bad: bool | np.bool_) -> None:
    """Ask for other numbers if these are no good."""
    if bad:
        raise Again("no good numbers")


def shown(value) -> str:
    """Write a value as on paper: whole numbers, at most three decimals, else a fraction; a row for an array.

    >>> shown(np.float64(0.25)), shown(12 / 35), shown(np.array([1.0, -0.5])), shown("a cut")
    ('0.25', '12/35 = 0.343', '(1, −0.5)', 'a cut')
    """
    if isinstance(value, str):
        return value
    if np.ndim(value) == 1:
        return f"({', '.join(shown(one) for one in value)})"
    if np.ndim(value) == 2:
        return table(value)
    number = float(value)
    if np.isnan(number):
        return "none"
    if abs(number * 1000 - round(number * 1000)) < 1e-6:
        return f"{round(number, 3) + 0.0:.12g}".replace("-", "−")
    part = Fraction(number).limit_denominator(LARGEST_DENOMINATOR)
    return f"{part.numerator}/{part.denominator} = {number:.3f}".replace("-", "−")


def named(label) -> str:
    """Write a label or a row of labels, which are names and no quantities: versions may share them."""
    return f"<b>{', '.join(str(one) for one in np.atleast_1d(label))}</b>"


def names(cells: Iterable, **headings) -> str:
    """Write a table of labels, or of other numbers that versions may share."""
    return table(cells, **headings).replace("<table", '<table class="names"', 1)


def table(cells: Iterable, top: Iterable = (), left: Iterable = (), corner: str = "") -> str:
    """Write rows of cells as an HTML table, with headings above and at the left if they are given.

    >>> table([[1, 2]], left=["a"])
    '<table><tr><th scope="row">a</th><td>1</td><td>2</td></tr></table>'
    """
    top, left = list(top), list(left)
    head = "".join(f'<th scope="col">{word}</th>' for word in top)
    rows = [f"<tr>{f'<th>{corner}</th>' if left else ''}{head}</tr>"] if top else []
    for number, row in enumerate(cells):
        start = f'<th scope="row">{left[number]}</th>' if left else ""
        rows.append(f"<tr>{start}{''.join(f'<td>{shown(cell)}</td>' for cell in row)}</tr>")
    return f"<table>{''.join(rows)}</table>"


def captioned(html: str, caption: str) -> str:
    """Write words above a table."""
    return html.replace(">", f"><caption>{caption}</caption>", 1)


def blank(rows: int, columns: int, top: Iterable = (), left: Iterable = ()) -> str:
    """Write an empty table to fill in."""
    return table([["&emsp;"] * columns] * rows, top, left).replace("<table", '<table class="fill"', 1)
