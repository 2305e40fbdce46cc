"""alike.html and alike.csv: answers that are alike, side by side, for the instructor alone."""

from collections.abc import Sequence
from html import escape
from pathlib import Path

from labgrader.grade.batch import Record
from labgrader.handin.reading import Lab
from labgrader.report.alike import Found, Group, Hand, by_people
from labgrader.report.outputs import csv_text, harmless, page, warning_of
from labgrader.support import counted, write_atomically

MOST_SHOWN = 200  # groups of answers on the page; the table has all pairs
MOST_NAMED = 10  # groups of people in the terminal
MOST_PEOPLE = 4  # of a group, in the terminal
COLUMNS = ("question", "student", "other", "share", "shapes")
WIDE = """body{max-width:96rem}.pair{display:grid;grid-template-columns:repeat(2,minmax(0,1fr));gap:1rem}
.pair pre{white-space:pre-wrap;overflow-wrap:anywhere;margin:.2rem 0}mark{background:var(--mark);color:inherit}
@media(max-width:60rem){.pair{grid-template-columns:minmax(0,1fr)}}"""
SAYS = (
    "Each answer has most of its distinctive code in common with another answer in its group. Code that also appears "
    "in the lab, in the model solution or in many answers was ignored. The shared lines are marked. Names, layout and "
    "order do not count. This is a reason to read, not a proof, and no grade changes because of it."
)


def write_alike(out: Path, lab: Lab, records: Sequence[Record], found: Found) -> None:
    """Write alike.html and alike.csv."""
    files = {"alike.html": alike_page(lab, records, found), "alike.csv": alike_csv(records, found)}
    for name, text in files.items():
        write_atomically(Path(out) / name, text.encode())


def alike_csv(records: Sequence[Record], found: Found) -> str:
    """A row per pair of answers."""
    rows = [(p.question, str(p.one), str(p.other), f"{p.share:.2f}", str(len(p.shared))) for p in found.pairs]
    return csv_text([COLUMNS, *(map(harmless, row) for row in rows)], records)


def alike_page(lab: Lab, records: Sequence[Record], found: Found) -> str:
    """The pairs of people, those who share most first, with each pair of answers side by side."""
    parts = [f"<h1>{escape(lab.topic)}: answers that are alike</h1>", warning_of(records)]
    parts += [f"<p>{SAYS}</p>"] if found.pairs else []
    parts += [] if found.pairs else ["<p>None.</p>"]
    if found.unread:
        parts.append(f'<p class="warning">Could not be compared: {escape(", ".join(found.unread))}.</p>')
    shown = 0
    for people, groups in by_people(found.groups).items():
        if shown < MOST_SHOWN:
            parts.append(f'<section class="look"><h2>{escape(in_words(people))}</h2>')
            parts += [*map(side_by_side, groups), "</section>"]
        shown += len(groups)
    if shown > MOST_SHOWN:
        parts.append(f"<p>The first of {shown} groups of answers; alike.csv has all pairs of them.</p>")
    return page(escape(f"{lab.topic}: alike"), parts, WIDE)


def in_words(people: Sequence[str]) -> str:
    """Some names, and before many of them how many they are.

    >>> in_words(["ada", "ben"]), in_words(["a", "b", "c"])
    ('ada and ben', '3 answers: a, b and c')
    """
    said = f"{', '.join(people[:-1])} and {people[-1]}"
    return said if len(people) == 2 else f"{len(people)} answers: {said}"


def side_by_side(group: Group) -> str:
    """The different programs of a group beside each other."""
    share = f"{100 * group.least:.0f}" + (f" to {100 * group.most:.0f}" if group.most - group.least > 0.005 else "")
    said = f"{escape(group.question)}: {share} % of their distinctive code, {counted(len(group.shared), 'shape')}"
    programs: dict[str, list[Hand]] = {}
    for hand in group.hands:
        programs.setdefault(hand.program, []).append(hand)
    if len(programs) == 1:
        programs = dict(enumerate([hand] for hand in group.hands[:2]))  # two of them show that they are the same
    both = "".join(marked(hands, group) for hands in programs.values())
    return f'<h3>{said}</h3><div class="pair">{both}</div>'


def marked(hands: Sequence[Hand], group: Group) -> str:
    """A program, with marks on the lines that hold what is shared, below those who have it."""
    numbers = {line for shape in group.shared for line in hands[0].shapes.get(shape, ())}
    lines = [escape(line) for line in hands[0].program.split("\n")]
    lines = [f"<mark>{line}</mark>" if i in numbers and line else line for i, line in enumerate(lines, 1)]
    whose = escape(", ".join(map(str, hands)))
    head = f"<p>{whose}</p>" if len(group.hands) > 2 else ""
    return f'<div>{head}<pre tabindex="0" aria-label="{whose}">' + "\n".join(lines) + "</pre></div>"


def terminal_lines(found: Found, path: Path) -> Sequence[str]:
    """What the terminal says of answers that are alike: a line per group of people, and the page."""
    people = by_people(found.groups)
    if not people and not found.unread:
        return []
    count = sum(map(len, people.values()))
    what = "1 group of answers is" if count == 1 else f"{count} groups of answers are"
    lines = [f"{what} more alike than the task requires: {path}"]
    for names, groups in list(people.items())[:MOST_NAMED]:
        said = (
            in_words(names)
            if len(names) <= MOST_PEOPLE
            else f"{len(names)} answers: {', '.join(names[:MOST_PEOPLE])}, ..."
        )
        lines.append(f"  {said}: {', '.join(group.question for group in groups)}")
    lines += ["  ..."] if len(people) > MOST_NAMED else []
    lines += [f"  could not be compared: {', '.join(found.unread)}"] if found.unread else []
    return lines
