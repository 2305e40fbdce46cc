"""What grading leaves: tables for the instructor, and for each student a page of feedback and Gradescope's results.

All of it is written from the records alone, so that the same records give the same bytes. None of it holds an expected
value, an argument of a random case or the secret seed.
"""

import csv
import hashlib
import io
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path

from labgrader.grade.batch import ATTEMPT, Record
from labgrader.grade.grade import Result
from labgrader.grade.overview import COUNTED, Group, Standing, lines_of, standings
from labgrader.handin.reading import Lab
from labgrader.sandbox.sandbox import NO_SANDBOX
from labgrader.support import counted, write_atomically

COLUMNS = ("student", "lab", "question", "points", "max_points", "verdict", "hint", "look_at")
CLASS_COLUMNS = ("question", "group", "students", "tried", "passed", "discrimination", *COUNTED, "named", "says")
LONGEST_SAMPLE = 4000  # characters
NOT_GRADED = "not graded"
NOTHING = "handed in nothing"
DISCRIMINATION = (
    "Discrimination is the point-biserial correlation of a right answer with the points of the other questions: near 0 "
    "or below it, a question hardly separates good students from others, or is unclear."
)
# What begins a formula, in all its forms; where a spreadsheet may cut a line; and what it may pass over before.
STARTS = "[=+@\uff1d\uff0b\uff0d\uff20\ufe66\ufe62\ufe63\ufe6b\u207a\u207b\u207c\u208a\u208b\u208c-]"
CUTS = "[;,|\t\n\v\f\r\x1c-\x1e\x85\u2028\u2029\uff0c\uff1b]"
UNSEEN = "[\\s\u200b-\u200f\u2060\ufeff]"
# Colours are said once for each scheme; contrast of text is 4.5 to 1 or more in both.
STYLE = """:root{color-scheme:light dark;--ink:#222;--soft:#555;--page:#fff;--box:#f6f6f6;--line:#ddd;--note:#fff3cd;
--mark:#ffe9a8;--rubric:#eef4fb;--bar:#1565c0;--right:#2e7d32;--wrong:#c62828;--look:#f9a825;--failed:#b00020}
@media(prefers-color-scheme:dark){:root{--ink:#e6e6e6;--soft:#b0b0b0;--page:#16181b;--box:#24272b;--line:#444;
--note:#4a3b00;--mark:#5c4a00;--rubric:#1d2a38;--bar:#64b5f6;--right:#66bb6a;--wrong:#ef5350;--failed:#ff8a80}}
body{font:16px/1.5 system-ui,sans-serif;max-width:46rem;margin:2rem auto;padding:0 1rem;color:var(--ink);
background:var(--page);overflow-wrap:anywhere}
h1{font-size:1.5rem}.points{float:right;color:var(--soft)}
section{border-left:5px solid;padding:.2rem 1rem;margin:1rem 0}
.right{border-color:var(--right)}.wrong{border-color:var(--wrong)}.look{border-color:var(--look)}
.warning{background:var(--note);padding:.6rem 1rem}
h2{font-size:1.1rem;margin:.2rem 0}h2[id]{font-size:1.3rem;margin-top:2rem}h3{font-size:1rem;margin:.2rem 0}
p{margin:.3rem 0}table{border-collapse:collapse;overflow-wrap:normal}.scrolls,pre{overflow:auto}
td,th{padding:.2rem 1rem;text-align:left;border-bottom:1px solid var(--line)}pre{background:var(--box);padding:.5rem}
th{font-weight:normal}th[scope=row]{overflow-wrap:anywhere;min-width:7rem}tr:first-child>th[scope=col]{font-weight:bold}.bar{background:var(--bar);height:1rem}
.key{color:var(--soft);font-size:.85rem}.bars td,.bars th{border:0;padding:.05rem .5rem}"""


def write_outputs(
    out: Path, lab: Lab, records: Sequence[Record], comments: Mapping[str, str], absent: Sequence[str] = ()
) -> None:
    """Write grades.csv, class.csv and class.html, and feedback/STUDENT.html and results/STUDENT/results.json of each.

    comments: an instructor's, by group of wrong answers. absent: who handed in nothing.
    """
    out, found = Path(out), standings(lab, records)
    files = {
        "grades.csv": grades_csv(lab, records, absent),
        "class.csv": class_csv(found, records),
        "class.html": class_page(lab, found, comments, records),
    }
    for record in records:
        files[f"feedback/{record.student}.html"] = feedback_page(lab, record, comments)
        files[f"results/{record.student}/results.json"] = gradescope(lab, record, comments)
    for name, text in files.items():
        write_atomically(out / name, text.encode())


def grades_csv(lab: Lab, records: Sequence[Record], absent: Sequence[str] = ()) -> str:
    """One row per student and question; one row, with the reason, for what could not be graded, or is not there."""
    table, total = [COLUMNS], f"{sum(lab.points.values()):g}"
    for record in records:
        rows = [("", "0", total, record.reason, "", NOT_GRADED)] if record.reason else map(row_of, record.results)
        table += [map(harmless, (record.student, lab.topic, *row)) for row in rows]
    table += [map(harmless, (name, lab.topic, "", "0", total, NOTHING, "", NOT_GRADED)) for name in absent]
    return csv_text(table, records)


def csv_text(table: Iterable[Iterable], records: Sequence[Record] = ()) -> str:
    """A table as text, with a warning above it if records come from a run without a sandbox."""
    text = io.StringIO(newline="")
    text.write("" if all(record.sandboxed for record in records) else f"# {NO_SANDBOX}\n")
    csv.writer(text, lineterminator="\n").writerows(table)
    return text.getvalue()


def row_of(result: Result) -> tuple[str, ...]:
    """A question's cells of the table."""
    look = "; ".join(filter(None, [result.flag, result.note]))
    return result.question, f"{result.points:g}", f"{result.max_points:g}", result.says, result.hint, look


def harmless(cell: str) -> str:
    """A cell that no spreadsheet takes for a formula, wherever it cuts the line: at commas, semicolons or line ends.

    Some take the full-width, small and raised forms of = + - @ for these.

    >>> harmless("=1+1"), harmless("0.5"), harmless("ada;=1+1")
    ("'=1+1", '0.5', "ada;'=1+1")
    """
    return re.sub(rf"(^|{CUTS})({UNSEEN}*)(?={STARTS})", r"\1\2'", cell)


def gradescope(lab: Lab, record: Record, comments: Mapping[str, str]) -> str:
    """The results.json that Gradescope's autograder harness reads."""
    warning = "" if record.sandboxed else f"Warning: {NO_SANDBOX}."
    tests = [
        {
            "name": result.question,
            "score": result.points,
            "max_score": result.max_points,
            "status": "passed" if result.right else "failed",
            "output": "\n".join(lines_of(result, comments)),
            "visibility": "visible",
        }
        for result in record.results
    ]
    said = f"This submission could not be graded: {record.reason}." if record.reason else warning
    content = {"score": record.points, "output": said, "visibility": "visible", "tests": tests}
    return json.dumps(content, indent=1) + "\n"


def feedback_page(lab: Lab, record: Record, comments: Mapping[str, str]) -> str:
    """A student's page."""
    title = escape(f"{lab.topic}: {record.student}")
    total = f"{record.points:g} of {sum(lab.points.values()):g} points for the functions"
    by_hand = " Written answers appear at the end once graded." if lab.written else ""
    look = " Is something graded wrongly? Ask for a second look, and quote the key below the answer."
    parts = [f"<h1>{title}</h1>\n<p>{total}.{by_hand}{look}</p>", warning_of([record])]
    if record.reason:
        parts.append(f'<p class="warning">This submission could not be graded: {escape(record.reason)}.</p>')
    for result in record.results:
        told = "".join(f"<p>{escape(line)}</p>" for line in lines_of(result, comments))
        told += (
            f'<p class="key">Key for a second look: <code>{answer_key(record.student, lab, result.question)}</code></p>'
        )
        mark, kind = ("✔", "right") if result.right else ("✘", "wrong")
        points = f'<span class="points">{result.points:g} of {result.max_points:g} points</span>'
        parts.append(f'<section class="{kind}"><h2>{points}{mark} {escape(result.question)}</h2>{told}</section>')
    return page(title, parts)


def answer_key(student: str, lab: Lab, question: str) -> str:
    """What names one answer of one student, without the student's name: "iou-3f09c2ab"."""
    return f"{question}-{hashlib.sha256(repr((student, lab.topic, question)).encode()).hexdigest()[:8]}"


def page(title: str, parts: Iterable[str], style: str = "") -> str:
    """A page of HTML; its title and parts are HTML already. style: more CSS."""
    return head(title, style) + "\n".join(filter(None, parts)) + "\n</main></body></html>\n"


def head(title: str, style: str = "") -> str:
    """How a page begins, whatever it shows: for a phone as for a desk, in the light and in the dark scheme."""
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
        '<meta name="viewport" content="width=device-width"><link rel="icon" href="data:,">'
        f"<style>{STYLE}\n{style}</style></head><body><main>\n"
    )


def scrolled(table: str, label: str) -> str:
    """A table that scrolls where the page is narrower, by keys, too. label: what it holds, in words."""
    return f'<div class="scrolls" tabindex="0" role="region" aria-label="{label}">{table}</div>'


def class_csv(found: Sequence[Standing], records: Sequence[Record]) -> str:
    """One row per question, and one per group of wrong answers."""
    table = [CLASS_COLUMNS]
    for standing in found:
        counts = (standing.tried, standing.passed, two_decimals(standing.discrimination), *standing.counts.values())
        table.append((standing.question, "", "", *counts, "", ""))
        for group in standing.groups:
            count, named = str(len(group.students)), "yes" if group.named else "no"
            row = (group.question, group.name, count, *[""] * (3 + len(COUNTED)), named, group.says)
            table.append(map(harmless, row))
    return csv_text(table, records)


def class_page(lab: Lab, found: Sequence[Standing], comments: Mapping[str, str], records: Sequence[Record]) -> str:
    """The page for the instructor, with a sample of each group."""
    parts = [f"<h1>{escape(lab.topic)}: {len(records)} submissions</h1>", warning_of(records)]
    heads = ("question", "tried", "passed", "discrimination", *COUNTED.values(), "kinds of mistakes")
    rows = ["<table><tr>" + "".join(f'<th scope="col">{name}</th>' for name in heads) + "</tr>"]
    for s in found:
        link = f'<a href="#{escape(s.question)}">{escape(s.question)}</a>'
        cells = (s.tried, s.passed, two_decimals(s.discrimination), *s.counts.values(), len(s.groups))
        rows.append(f'<tr><th scope="row">{link}</th>' + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>")
    parts.append(scrolled("\n".join([*rows, "</table>"]), "questions"))
    parts += [f"<p>{DISCRIMINATION}</p>", histogram(lab, records), attempted(records)]
    for standing in found:
        parts.append(f'<h2 id="{escape(standing.question)}">{escape(standing.question)}</h2>')
        parts += [group_section(group, comments.get(group.name, "")) for group in standing.groups]
        parts += [] if standing.groups else ["<p>No wrong answer.</p>"]
    return page(escape(f"{lab.topic}: the class"), parts)


def two_decimals(correlation: float | None) -> str:
    """A correlation as tables have it, "-" for none."""
    return "-" if correlation is None else f"{correlation:.2f}"


def histogram(lab: Lab, records: Sequence[Record]) -> str:
    """How many have how many points for the functions, in ten steps or fewer."""
    most = sum(lab.points.values())
    steps = max(1, min(10, round(most)))
    found = [min(steps - 1, int(steps * record.points / most)) if most else 0 for record in records]
    parts = ['<h2>Points for the functions</h2><table class="bars">']
    for i in reversed(range(steps)):
        count, last = found.count(i), i + 1 == steps
        upto = f"{most * i / steps:.3g} to {'' if last else 'below '}{most * (i + 1) / steps:.3g}"
        bar = f'<div class="bar" style="width:calc({count / max(1, len(found)):.3f} * min(20rem, 40vw))"></div>'
        parts.append(f'<tr><th scope="row">{upto}</th><td>{bar}</td><td>{count}</td></tr>')
    return "".join([*parts, "</table>"])


def attempted(records: Sequence[Record]) -> str:
    """The programs that try what no answer needs, "" if there is none."""
    tries = [
        f"{record.student}, {result.question}: {result.flag.removeprefix(ATTEMPT)}; {result.says}"
        for record in records
        for result in record.results
        if result.flag.startswith(ATTEMPT)
    ]
    said = "An honest program may hold such a thing, too: read it."
    items = "".join(f"<li>{escape(one)}</li>" for one in tries)
    return f"<h2>Attempts</h2><p>{said}</p><ul>{items}</ul>" if tries else ""


def group_section(group: Group, comment: str) -> str:
    """One group: who is in it, what they were told, and the program of the first."""
    count = counted(len(group.students), "student")
    kind = "" if group.named else " <em>unnamed</em>"
    said = f"<p><b>Your comment:</b> {escape(comment)}</p>" if comment else ""
    sample = escape(group.sample[:LONGEST_SAMPLE])
    return (
        f'<section class="wrong"><h3>{escape(group.name)}: {count}{kind}</h3><p>{escape(group.says)}</p>{said}'
        f"<p>{escape(', '.join(group.students))}</p><details><summary>The first of them</summary>"
        f'<pre tabindex="0">{sample}</pre></details></section>'
    )


def warning_of(records: Sequence[Record]) -> str:
    """What a page says if something on it was graded without a sandbox."""
    sandboxed = all(record.sandboxed for record in records)
    return "" if sandboxed else f'<p class="warning">Warning: {escape(NO_SANDBOX)}.</p>'


def terminal_table(lab: Lab, records: Sequence[Record], told: Mapping[str, str], absent: Sequence[str] = ()) -> str:
    """A line per student: points by question, all together, and what an instructor should know and look at.

    told: of the hand-in, by student, such as how late it is. absent: who handed in nothing.
    """
    names = list(lab.points)
    rows = [["student", *names, f"points of {sum(lab.points.values()):g}", ""]]
    for record in records:
        earned = {result.question: f"{result.points:g}" for result in record.results}
        both = [(result.question, said) for result in record.results for said in (result.flag, result.note)]
        flags = [f"{question}: {said}" for question, said in both if said]
        flags = [f"{NOT_GRADED}: {record.reason}"] if record.reason else flags
        look = "; ".join([told[record.student], *flags] if record.student in told else flags)
        rows.append([record.student, *(earned.get(name, "-") for name in names), f"{record.points:g}", look])
    rows += [[name, *("-" for _ in names), "-", NOTHING] for name in absent]
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]) - 1)]
    return "\n".join(aligned(row, widths) for row in rows)


def aligned(row: Sequence[str], widths: Sequence[int]) -> str:
    """One line: the first cell to the left, numbers to the right, and the last as long as it is."""
    numbers = [cell.rjust(width) for cell, width in zip(row[1:-1], widths[1:], strict=True)]
    return "  ".join([row[0].ljust(widths[0]), *numbers, row[-1]]).rstrip()
