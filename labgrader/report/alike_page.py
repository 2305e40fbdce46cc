"""alike.html and alike.csv: answers that are alike, side by side, for the instructor alone."""

from collections.abc import Sequence
from html import escape
from pathlib import Path

from labgrader.grade.batch import Record
from labgrader.handin.reading import Lab
from labgrader.report.alike import Found, Hand, Pair, by_people
from labgrader.report.outputs import harmless, new_table, page, warning_of
from labgrader.support import write_atomically

MOST_SHOWN = 200  # pairs of answers on the page; the table has all
MOST_NAMED = 10  # pairs of people in the terminal
COLUMNS = ("question", "student", "other", "share", "shapes")
WIDE = """body{max-width:96rem}.pair{display:grid;grid-template-columns:1fr 1fr;gap:1rem}
.pair pre{white-space:pre-wrap;overflow-wrap:anywhere;margin:.2rem 0}mark{background:#ffe9a8}
@media(max-width:60rem){.pair{grid-template-columns:1fr}}"""
SAYS = (
    "Each pair shares most of what is its own: what is in the lab, in the model solution or in many answers was left "
    "out. Marked are the lines that hold it. Names, layout and order do not count. This is a reason to read, not a "
    "proof, and no grade changes by it."
)


def write_alike(out: Path, lab: Lab, records: Sequence[Record], found: Found) -> None:
    """Write alike.html and alike.csv."""
    files = {"alike.html": alike_page(lab, records, found), "alike.csv": alike_csv(records, found)}
    for name, text in files.items():
        write_atomically(Path(out) / name, text.encode())


def alike_csv(records: Sequence[Record], found: Found) -> str:
    """A row per pair of answers."""
    text, table = new_table(records, COLUMNS)
    for pair in found.pairs:
        row = (pair.question, str(pair.one), str(pair.other), f"{pair.share:.2f}", str(len(pair.shared)))
        table.writerow([harmless(cell) for cell in row])
    return text.getvalue()


def alike_page(lab: Lab, records: Sequence[Record], found: Found) -> str:
    """The pairs of people, those who share most first, with each pair of answers side by side."""
    parts = [f"<h1>{escape(lab.topic)}: answers that are alike</h1>", warning_of(records)]
    parts += [f"<p>{SAYS}</p>"] if found.pairs else []
    parts += [] if found.pairs else ["<p>None.</p>"]
    if found.unread:
        parts.append(f'<p class="warning">Could not be compared: {escape(", ".join(found.unread))}.</p>')
    shown = 0
    for (one, other), pairs in by_people(found.pairs).items():
        if shown < MOST_SHOWN:
            parts.append(f'<section class="look"><h2>{escape(one)} and {escape(other)}</h2>')
            parts += [*map(side_by_side, pairs), "</section>"]
        shown += len(pairs)
    if shown > MOST_SHOWN:
        parts.append(f"<p>The first of {shown} pairs of answers; alike.csv has all of them.</p>")
    return page(escape(f"{lab.topic}: alike"), parts, WIDE)


def side_by_side(pair: Pair) -> str:
    """Two answers beside each other."""
    said = f"{escape(pair.question)}: {100 * pair.share:.0f} % of what is their own, {len(pair.shared)} shapes"
    both = "".join(marked(hand, pair) for hand in (pair.one, pair.other))
    return f'<h3>{said}</h3><div class="pair">{both}</div>'


def marked(hand: Hand, pair: Pair) -> str:
    """A program, with marks on the lines that hold what is shared."""
    numbers = {line for shape in pair.shared for line in hand.shapes.get(shape, ())}
    lines = [escape(line) for line in hand.program.split("\n")]
    lines = [f"<mark>{line}</mark>" if i in numbers and line else line for i, line in enumerate(lines, 1)]
    return f'<pre tabindex="0" aria-label="{escape(str(hand))}">' + "\n".join(lines) + "</pre>"


def told(found: Found, path: Path) -> Sequence[str]:
    """What the terminal says of answers that are alike: a line per two people, and the page."""
    people = by_people(found.pairs)
    if not people and not found.unread:
        return []
    count = "1 pair of answers is" if len(found.pairs) == 1 else f"{len(found.pairs)} pairs of answers are"
    lines = [f"{count} alike beyond what the task forces: {path}"]
    for (one, other), pairs in list(people.items())[:MOST_NAMED]:
        lines.append(f"  {one} and {other}: {', '.join(pair.question for pair in pairs)}")
    lines += ["  ..."] if len(people) > MOST_NAMED else []
    lines += [f"  could not be compared: {', '.join(found.unread)}"] if found.unread else []
    return lines
