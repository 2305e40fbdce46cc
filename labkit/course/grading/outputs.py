"""What grading leaves: a table for the instructor, and for each student a page of feedback and Gradescope's results.

All of it is written from the records alone, so that the same records give the same bytes. None of it holds an expected
value, an argument of a random case or the secret seed.
"""

import csv
import io
import json
import re
from collections.abc import Sequence
from html import escape
from pathlib import Path

from labkit.course.grading.batch import Record
from labkit.course.grading.grade import Result
from labkit.course.grading.reading import Lab
from labkit.course.grading.sandbox import NO_SANDBOX
from labkit.support.files import write_atomically

COLUMNS = ("student", "lab", "question", "points", "max_points", "verdict", "hint", "look_at")
NOT_GRADED = "not graded"
STYLE = """body{font:16px/1.5 system-ui,sans-serif;max-width:46rem;margin:2rem auto;padding:0 1rem;color:#222}
h1{font-size:1.5rem}.points{float:right;color:#555}section{border-left:5px solid;padding:.2rem 1rem;margin:1rem 0}
.right{border-color:#2e7d32}.wrong{border-color:#c62828}.warning{background:#fff3cd;padding:.6rem 1rem}
h2{font-size:1.1rem;margin:.2rem 0}p{margin:.3rem 0}"""


def write_outputs(out: Path, lab: Lab, records: Sequence[Record]) -> None:
    """Write grades.csv, and feedback/STUDENT.html and results/STUDENT/results.json for each student."""
    out = Path(out)
    write_atomically(out / "grades.csv", grades_csv(lab, records).encode())
    for record in records:
        name = record.student
        write_atomically(out / "feedback" / f"{name}.html", feedback_page(lab, record).encode())
        write_atomically(out / "results" / name / "results.json", gradescope(lab, record).encode())


def grades_csv(lab: Lab, records: Sequence[Record]) -> str:
    """One row a student and question; a submission that could not be graded has one row, and its reason as verdict."""
    text = io.StringIO(newline="")
    if not all(record.sandboxed for record in records):
        text.write(f"# {NO_SANDBOX}\n")
    table = csv.writer(text, lineterminator="\n")
    table.writerow(COLUMNS)
    for record in records:
        total = f"{sum(lab.points.values()):g}"
        rows = [("", "0", total, record.reason, "", NOT_GRADED)] if record.reason else map(row_of, record.results)
        table.writerows([harmless(cell) for cell in (record.student, lab.topic, *row)] for row in rows)
    return text.getvalue()


def row_of(result: Result) -> tuple[str, ...]:
    """A question's cells of the table."""
    return result.question, f"{result.points:g}", f"{result.max_points:g}", result.says, result.hint, result.flag


def harmless(cell: str) -> str:
    """A cell that no spreadsheet takes for a formula, wherever it cuts the line: at commas, semicolons or tabs.

    >>> harmless("=1+1"), harmless("0.5"), harmless("ada;=1+1")
    ("'=1+1", '0.5', "ada;'=1+1")
    """
    return re.sub(r"(^|[;,|\t\r\n])(\s*)(?=[=+@-])", r"\1\2'", cell)


def gradescope(lab: Lab, record: Record) -> str:
    """The results.json that Gradescope's autograder harness reads."""
    warning = "" if record.sandboxed else f"Warning: {NO_SANDBOX}."
    tests = [
        {
            "name": result.question,
            "score": result.points,
            "max_score": result.max_points,
            "status": "passed" if is_right(result) else "failed",
            "output": "\n".join(lines_of(result)),
            "visibility": "visible",
        }
        for result in record.results
    ]
    said = f"This submission could not be graded: {record.reason}." if record.reason else warning
    content = {"score": record.points, "output": said, "visibility": "visible", "tests": tests}
    return json.dumps(content, indent=1) + "\n"


def is_right(result: Result) -> bool:
    """Whether a question earned its points."""
    return result.points == result.max_points


def lines_of(result: Result) -> list[str]:
    """What a student is told about a question."""
    said = result.says[:1].upper() + result.says[1:] + "."
    return [said, f"Hint: {result.hint}"] if result.hint else [said]


def feedback_page(lab: Lab, record: Record) -> str:
    """A student's page."""
    title = escape(f"{lab.topic}: {record.student}")
    parts = ["" if record.sandboxed else f'<p class="warning">Warning: {escape(NO_SANDBOX)}.</p>']
    if record.reason:
        parts.append(f'<p class="warning">This submission could not be graded: {escape(record.reason)}.</p>')
    for result in record.results:
        told = "".join(f"<p>{escape(line)}</p>" for line in lines_of(result))
        mark, kind = ("✔", "right") if is_right(result) else ("✘", "wrong")
        points = f'<span class="points">{result.points:g} of {result.max_points:g} points</span>'
        parts.append(f'<section class="{kind}"><h2>{points}{mark} {escape(result.question)}</h2>{told}</section>')
    total = f"{record.points:g} of {sum(lab.points.values()):g} points for the functions"
    by_hand = " What you wrote in words is graded by a person." if lab.written else ""
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title><style>{STYLE}</style>'
        f"</head><body>\n<h1>{title}</h1>\n<p>{total}.{by_hand}</p>\n"
        + "\n".join(part for part in parts if part)
        + "\n</body></html>\n"
    )


def terminal_table(lab: Lab, records: Sequence[Record]) -> str:
    """A line a student: points by question, all together, and what an instructor should look at."""
    names = list(lab.points)
    rows = [["student", *names, "points", ""]]
    for record in records:
        earned = {result.question: f"{result.points:g}" for result in record.results}
        flags = [f"{result.question}: {result.flag}" for result in record.results if result.flag]
        look = f"{NOT_GRADED}: {record.reason}" if record.reason else "; ".join(flags)
        rows.append([record.student, *(earned.get(name, "-") for name in names), f"{record.points:g}", look])
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]) - 1)]
    return "\n".join(aligned(row, widths) for row in rows)


def aligned(row: Sequence[str], widths: Sequence[int]) -> str:
    """One line: the first cell to the left, numbers to the right, and the last as long as it is."""
    numbers = [cell.rjust(width) for cell, width in zip(row[1:-1], widths[1:], strict=True)]
    return "  ".join([row[0].ljust(widths[0]), *numbers, row[-1]]).rstrip()
