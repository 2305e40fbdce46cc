"""All labs of a course together: a page for the instructor, and a file that Moodle or Canvas takes.

Each lab counts by its share of the points, under the policy in course.toml (`policy`). Who handed in nothing has 0
there. Students are the same person in two labs if the roster has one email for both, or if their folders have one name:
Moodle gives each a number of its own in every assignment.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path

from labgrader.course import topics
from labgrader.grade.policy import Policy, read_policy
from labgrader.grade.totals import NOT_FINAL, Final, settle_anew
from labgrader.handin.reading import read_lab
from labgrader.handin.roster import Person, identity, person_of, read_roster
from labgrader.report.outputs import csv_text, harmless, page, scrolled
from labgrader.report.platforms import canvas_rows, person_by_name
from labgrader.support import write_atomically

FOLDER, TOTAL = "course", "Course total"
WIDE = "body{max-width:none}s{color:var(--soft)}"


@dataclass
class Row:
    """A student's line. finals: by lab; total: in percent; dropped: labs that do not count.

    unread: labs in which something was handed in that could not be graded.
    """

    name: str
    person: Person | None
    finals: dict[str, Final] = field(default_factory=dict)
    total: float = 0.0
    dropped: list[str] = field(default_factory=list)
    unread: list[str] = field(default_factory=list)

    @property
    def waits(self) -> bool:
        """Whether something of it still has to be graded by hand."""
        return bool(self.unread) or any(final.waits for final in self.finals.values())

    @property
    def has_a_total(self) -> bool:
        """Whether a total is final: not of who waits, nor of who handed in nothing, in which no lab has a grade."""
        return bool(self.finals) and not self.waits


def write_course(course: Path, platform: str) -> tuple[list[Path], list[str]]:
    """Write course.html and the table of a platform into grades/course; returns them, and who waits for a person.

    platform: "moodle", "canvas" or "scores". Raises ValueError if no lab was graded, if course.toml or the roster
    cannot be used, or if the platform could not find a student.
    """
    course = Path(course)
    labs = [lab for lab in topics() if any((course / "grades" / lab / "feedback").glob("*.html"))]
    if not labs or not (course / "gradebook.db").is_file():
        raise ValueError(f"topic: expected labs that were graded in {course}, there is none")
    policy, roster, finals, unread = read_policy(course), read_roster(course), {}, {}
    for name in labs:
        _, finals[name] = settle_anew(course, read_lab(course, name))
        pages = (page.stem for page in sorted((course / "grades" / name / "feedback").glob("*.html")))
        unread[name] = [student for student in pages if student not in finals[name]]
    rows = rows_of(finals, roster, unread)
    for row in rows:
        maxima = {lab: max((final.max_score for final in finals[lab].values()), default=0.0) for lab in labs}
        scores = {lab: row.finals[lab].score if lab in row.finals else 0.0 for lab in labs}
        shares = {lab: scores[lab] / maxima[lab] for lab in labs if maxima[lab]}
        share, row.dropped = policy.total(shares)
        row.total = 100.0 * share
    if platform != "scores" and (odd := [row.name for row in rows if row.person is None]):
        raise ValueError(f"{platform}: expected students in roster.csv, got {', '.join(odd)}")
    heading = next((h for person in roster.values() for h in person.more if h.startswith(f"{TOTAL} (")), TOTAL)
    if platform == "canvas":  # the total in percent; Canvas keeps what it has of one that is not final
        points = [(row.person, f"{row.total:.2f}" if row.has_a_total else "") for row in rows]
        table = canvas_rows(heading, "100", points)
    else:
        table = moodle_table(labs, rows) if platform == "moodle" else plain_table(labs, rows)
    text = csv_text(map(harmless, cells) for cells in table)
    files = {"course.html": course_page(labs, rows, policy), f"{platform}.csv": text}
    for name, content in files.items():
        write_atomically(course / "grades" / FOLDER / name, content.encode())
    return [course / "grades" / FOLDER / name for name in files], [row.name for row in rows if row.waits]


def rows_of(
    finals: Mapping[str, Mapping[str, Final]], roster: dict[str, Person], unread: Mapping[str, Sequence[str]]
) -> list[Row]:
    """A row per person, in the order of names; who is in the roster and handed in nothing has an empty one.

    unread: by lab the students whose work could not be graded.
    Raises ValueError if two folders of a lab are one person's.
    """
    rows: dict[str, Row] = {}
    for lab, of_lab in finals.items():
        for student, final in of_lab.items():
            person = person_of(roster, student) or person_by_name(student)
            who = identity(roster, student)
            row = rows.setdefault(who, Row(student, person))
            if lab in row.finals:
                both = " and ".join(other for other in of_lab if identity(roster, other) == who)
                raise ValueError(f"{lab}: {both} are both {who}; rename the folder of one")
            row.finals[lab] = final
    for lab, students in unread.items():
        for student in students:
            person = person_of(roster, student) or person_by_name(student)
            rows.setdefault(identity(roster, student), Row(student, person)).unread.append(lab)
    for person in roster.values():
        rows.setdefault(identity(roster, person.id), Row(person.name or person.id, person))
    return sorted(rows.values(), key=lambda row: row.name)


def cell(row: Row, lab: str) -> str:
    """A student's points in a lab, "" for none."""
    return f"{row.finals[lab].score:g}" if lab in row.finals else ""


def plain_table(labs: Sequence[str], rows: Sequence[Row]) -> list[list[str]]:
    """A row per student."""
    table = [["student", "name", "email", *labs, "dropped", TOTAL, "not final"]]
    for row in rows:
        who = [row.person.name, row.person.email] if row.person else ["", ""]
        points = [*(cell(row, lab) for lab in labs), " ".join(row.dropped), f"{row.total:.2f}"]
        table.append([row.name, *who, *points, "yes" if row.waits else ""])
    return table


def moodle_table(labs: Sequence[str], rows: Sequence[Row]) -> list[list[str]]:
    """For Moodle's gradebook, which finds students by email: Grades > Import > CSV file."""
    table = [["Full name", "Email address", *labs, TOTAL, "Feedback"]]
    for row in rows:
        points = [*(cell(row, lab) for lab in labs), f"{row.total:.2f}" if row.finals else ""]
        table.append([row.person.name, row.person.email, *points, NOT_FINAL if row.waits else ""])
    return table


def course_page(labs: Sequence[str], rows: Sequence[Row], policy: Policy) -> str:
    """The page for the instructor."""
    weights = ", ".join(f"{lab} {policy.weights.get(lab, 1.0):g}" for lab in labs)
    said = f"Weights: {weights}. Dropped: the lowest {policy.drop_lowest}. Free late days: {policy.late_days}."
    heads = "".join(f'<th scope="col">{escape(head)}</th>' for head in ("student", *labs, TOTAL))
    parts = ["<h1>The course</h1>", f"<p>{escape(said)}</p>"]
    table = [f"<table><tr>{heads}</tr>"]
    for row in rows:
        cells = "".join(f"<td>{of_lab(row, lab)}</td>" for lab in labs)
        total = f"{row.total:.1f} %{' (not final)' if row.waits else ''}"
        table.append(f'<tr><th scope="row">{escape(row.name)}</th>{cells}<td>{total}</td></tr>')
    return page("The course", [*parts, scrolled("\n".join([*table, "</table>"]), "points by lab")], WIDE)


def of_lab(row: Row, lab: str) -> str:
    """A cell of the page: points, struck out where they do not count, and what is to know about them."""
    final = row.finals.get(lab)
    points = "not graded" if lab in row.unread else "-" if final is None else f"{final.score:g} of {final.max_score:g}"
    notes = [] if final is None else [str(final.late) if final.late.days else "", "not final" if final.waits else ""]
    note = f"<br><small>{escape('; '.join(filter(None, notes)))}</small>" if any(notes) else ""
    return (f"<s>{points}</s> dropped" if lab in row.dropped else points) + note
