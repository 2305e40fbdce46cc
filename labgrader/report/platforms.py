"""What goes back to a learning platform: a file of grades that it imports, and a zip of pages that it hands out.

    Moodle   the grading worksheet of an assignment ("Upload grading worksheet"), and "Upload multiple feedback files"
    Canvas   a file for "Import Grades", and a zip for "Upload Submissions"

Scores are those of nbgrader's gradebook: functions, what a person graded, and penalties. Students have the names that
`nbgrader zip_collect` gave them, which end with the platform's number, "Ada Lovelace_1234567"; a roster knows more.
"""

import io
import re
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from labgrader.course import course as course_here
from labgrader.grade.batch import read_record, record_path
from labgrader.grade.totals import NOT_FINAL, Final, settle_anew
from labgrader.handin.collect import extracted, read_name, student_and_notebook
from labgrader.handin.reading import LEFT_OUT, Lab, read_lab
from labgrader.handin.roster import FILE as ROSTER
from labgrader.handin.roster import Person, absent_of, keys_of, person_of, read_roster
from labgrader.report.outputs import NOTHING, csv_text, harmless
from labgrader.settings import usable_blocks
from labgrader.support import write_atomically

CANVAS = ("SIS User ID", "SIS Login ID", "Section")  # columns beside name and ID
ASSIGNMENT = re.compile(r"(.*) \((\d+)\)")  # the heading of one in an exported gradebook


@dataclass(frozen=True)
class Written:
    """Files for a platform. waiting: who is to be graded by hand yet, and in what; without: who has no grade, and why.

    maximum: what all is worth; released: what it was worth in the lab that students got.
    """

    files: list[Path]
    waiting: list[str]
    without: dict[str, str]
    maximum: float
    released: float


def write_grades(course: Path, topic: str, platform: str, assignment: int | None = None) -> Written:
    """Write the files of a platform into grades/TOPIC, and bring the pages there up to date.

    platform: "moodle" or "canvas", or "scores" for a table and no zip. assignment: Canvas's number of it, if the roster
    has its column under another name and course.toml does not say it. Raises ValueError, and writes nothing, if
    nothing was graded, if course.toml or the roster cannot be used, or if the platform could not find a student.
    """
    course = Path(course)
    out, lab = course / "grades" / topic, read_lab(course, topic)
    roster = read_roster(course)
    pages = {page.stem: page for page in sorted((out / "feedback").glob("*.html"))}
    if not pages or not (course / "gradebook.db").is_file():
        mend = f"`{course_here().command} grade {topic}` makes them"
        raise ValueError(f"topic: expected a lab with grades in {course}; {mend}")
    people = {student: person_of(roster, student) or person_by_name(student) for student in pages}
    odd = [student for student, person in people.items() if person is None]
    if odd and platform != "scores":
        raise ValueError(
            f"{platform}: expected students in roster.csv, or names that end with _NUMBER, as `nbgrader zip_collect` "
            f"makes, got {', '.join(odd)}"
        )
    one = {person.id: student for student, person in people.items() if person is not None}
    twice = [s for s, person in people.items() if person is not None and one[person.id] != s]
    if twice and platform != "scores":
        other = one[people[twice[0]].id]
        raise ValueError(f"{platform}: {twice[0]} and {other} are both {people[other].id}; rename the folder of one")
    now, finals = settle_anew(course, lab)
    graded = [(people[student], final) for student, final in finals.items() if student in pages]
    if platform == "canvas":
        points = [(person, "" if final.waits else f"{final.score:g}") for person, final in graded]
        most = f"{graded[0][1].max_score:g}" if graded else ""
        rows = canvas_rows(canvas_heading(course, topic, roster, assignment), most, points)
    else:
        rows = moodle_rows(graded) if platform == "moodle" else plain_rows(graded)
    files = {out / f"{platform}.csv": csv_text(map(harmless, row) for row in rows).encode()}
    if platform != "scores":
        files[out / f"{platform}_feedback.zip"] = zip_of(pages, names_in_zip(course, topic, people, platform))
    for path, data in files.items():
        write_atomically(path, data)
    reasons = {student: read_record(record_path(out, student)) for student in pages.keys() - finals.keys()}
    without = {s: f"not graded: {record.reason}" if record else "not graded" for s, record in reasons.items()}
    without |= {person.name or person.id: NOTHING for person in absent_of(roster, pages)}
    waiting = [f"{student} ({', '.join(final.waits)})" for student, final in finals.items() if final.waits]
    return Written(list(files), waiting, without, maximum_of(now), maximum_of(lab))


def maximum_of(lab: Lab) -> float:
    """What the questions and the answers in words of a lab are worth together."""
    marks = (cell["metadata"]["nbgrader"] for cell in lab.notebook["cells"] if "nbgrader" in cell["metadata"])
    return sum((float(mark["points"]) for mark in marks if mark.get("grade")), 0.0)


def person_by_name(student: str) -> Person | None:
    """Whom a platform knows by the number that ends a student's name, None without a number."""
    name, *number = reversed(keys_of(student))
    return Person(name, student.removesuffix(f"_{name}")) if number else None


def plain_rows(graded: Sequence[tuple[Person | None, Final]]) -> list[list[str]]:
    """A row per student."""
    rows = [["student", "name", "email", "score", "max_score", "late", "to be graded by hand"]]
    for person, final in graded:
        who = [person.name, person.email] if person else ["", ""]
        points = [f"{final.score:g}", f"{final.max_score:g}"]
        rows.append([final.student, *who, *points, str(final.late), "yes" if final.waits else ""])
    return rows


def moodle_rows(graded: Sequence[tuple[Person, Final]]) -> list[list[str]]:
    """Moodle's grading worksheet, which finds students by their identifier; its gradebook can find them by email."""
    rows = [["Identifier", "Full name", "Email address", "Grade", "Maximum Grade", "Feedback comments"]]
    for person, final in graded:
        points = [f"{final.score:g}", f"{final.max_score:g}", NOT_FINAL if final.waits else ""]
        rows.append([f"Participant {person.id}", person.name, person.email, *points])
    return rows


def canvas_heading(course: Path, name: str, roster: dict[str, Person], assignment: int | None = None) -> str:
    """The heading by which Canvas finds an assignment, "04_iou (5511)": an exported gradebook's, else the name.

    assignment: its number; without one that of course.toml counts, or the column of this name:

        [[canvas]]
        lab = "04_iou"
        assignment = 5511

    Raises ValueError, and names the columns, where an exported gradebook has none of this number or name: Canvas would
    make a new assignment of it.
    """
    headings = dict.fromkeys(heading for person in roster.values() for heading in person.more)
    found = [match for heading in headings if (match := ASSIGNMENT.fullmatch(heading))]
    numbered = {int(match[2]): match[0] for match in found}
    blocks = usable_blocks(course, "canvas", {"lab": str, "assignment": float})
    for where, data in blocks if assignment is None else ():
        if not isinstance(data["assignment"], int):
            raise ValueError(f"{where}: assignment: expected a whole number")
        assignment = data["assignment"] if data["lab"] == name else assignment
    if assignment is not None and (assignment in numbered or not numbered):
        return numbered.get(assignment, f"{name} ({assignment})")
    same = [match[0] for match in found if match[1].strip().lower() == name.lower()]
    if assignment is None and (len(same) == 1 or not numbered):
        return same[0] if same else name
    what = f"none has the number {assignment}"
    what = what if assignment is not None else f"{'several have' if same else 'none has'} the name {name}"
    mend = f"name one by --assignment NUMBER or in [[canvas]] of course.toml: {', '.join(numbered.values())}"
    raise ValueError(f"assignment: of the columns of {ROSTER} {what}; {mend}")


def canvas_rows(heading: str, most: str, points: Sequence[tuple[Person, str]]) -> list[list[str]]:
    """For Canvas's Import Grades, which finds students by its own ID; heading: that of a column, of `most` points.

    There is no room for words, so the points of a grade that is not final are "": Canvas keeps what it has.
    """
    possible = ["    Points Possible", *[""] * (len(CANVAS) + 1), most]
    rows = [[one.name, one.id, *(one.more.get(column, "") for column in CANVAS), said] for one, said in points]
    return [["Student", "ID", *CANVAS, heading], possible, *rows]


def names_in_zip(course: Path, topic: str, people: dict[str, Person], platform: str) -> dict[str, str]:
    """By student the name that the platform knows a page by; Canvas knows only names of files that it gave out."""
    if platform == "moodle":
        named = {student: keys_of(student)[0].removesuffix(f"_{person.id}") for student, person in people.items()}
        return {s: f"{named[s].replace('_', ' ')}_{people[s].id}_assignsubmission_file_{topic}.html" for s in people}
    names = {}
    for path in extracted(course, topic):
        if (whose := student_and_notebook(str(path))) is not None:
            mark, _ = read_name(path)
            names.setdefault(whose[0], f"{Path(mark.string.removesuffix(f'.{LEFT_OUT}')).stem}.html")
    return names


def zip_of(pages: dict[str, Path], names: dict[str, str]) -> bytes:
    """A zip of the students' pages; the same pages give the same bytes."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for student, page in pages.items():
            if student in names:
                archive.writestr(zipfile.ZipInfo(names[student]), page.read_bytes())
    return content.getvalue()
