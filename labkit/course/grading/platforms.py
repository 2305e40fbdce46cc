"""What goes back to a learning platform: a file of grades that it imports, and a zip of pages that it hands out.

    Moodle   the grading worksheet of an assignment ("Upload grading worksheet"), and "Upload multiple feedback files"
    Canvas   a file for "Import Grades", and a zip for "Upload Submissions"

Scores are those of nbgrader's gradebook: functions, what a person graded, and penalties. Students have the names that
`nbgrader zip_collect` gave them, which end with the platform's number: "Ada Lovelace_1234567".
"""

import csv
import io
import re
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

from labkit.course.grading.collect import student_and_notebook
from labkit.course.grading.gradebook import opened
from labkit.course.grading.outputs import harmless
from labkit.support.files import write_atomically

NUMBERED = re.compile(r"(?P<name>.+)_(?P<number>\d+)")


@dataclass(frozen=True)
class Graded:
    """A student's grade. waits: whether something is still to be graded by hand; by_hand: that page section, HTML."""

    student: str
    score: float
    max_score: float
    waits: bool
    by_hand: str

    @property
    def name(self) -> str:
        """The name without the platform's number."""
        return NUMBERED.fullmatch(self.student)["name"]

    @property
    def number(self) -> str:
        """The platform's number."""
        return NUMBERED.fullmatch(self.student)["number"]


def write_grades(course: Path, topic: str, platform: str) -> tuple[list[Path], list[str]]:
    """Write the files of a platform into grades/TOPIC; returns their paths, and who is still to be graded by hand.

    platform: "moodle" or "canvas", or "scores" for a table and no zip. Raises ValueError, and writes nothing, if
    nothing was graded, or if a platform's number is missing in a student's name.
    """
    course = Path(course)
    out = course / "grades" / topic
    graded = graded_students(course, topic) if (course / "gradebook.db").is_file() else []
    if not graded:
        raise ValueError(f"topic: expected a lab with grades in {course}; `labkit grade {topic}` makes them")
    odd = [one.student for one in graded if not NUMBERED.fullmatch(one.student)]
    if odd and platform != "scores":
        names = ", ".join(odd)
        raise ValueError(
            f"{platform}: expected names that end with _NUMBER, as `nbgrader zip_collect` makes, got {names}"
        )
    rows = {"scores": plain_rows, "moodle": moodle_rows, "canvas": canvas_rows}[platform](topic, graded)
    text = io.StringIO(newline="")
    csv.writer(text, lineterminator="\n").writerows([harmless(cell) for cell in row] for row in rows)
    files = {out / f"{platform}.csv": text.getvalue().encode()}
    if platform != "scores":
        names = names_in_zip(course, topic, graded, platform)
        files[out / f"{platform}_feedback.zip"] = zip_of(out / "feedback", graded, names)
    for path, data in files.items():
        write_atomically(path, data)
    return list(files), [one.student for one in graded if one.waits]


def graded_students(course: Path, topic: str) -> list[Graded]:
    """The grades of a lab in the gradebook, by students' names."""
    found = []
    with opened(course) as gradebook:
        for submission in gradebook.assignment_submissions(topic):
            (notebook,) = submission.notebooks
            said = {comment.name: comment.comment or "" for comment in notebook.comments}
            sections = [
                f"<h2>{escape(grade.name)}: {grade.score:g} of {grade.max_score:g} points</h2>"
                f"<p>{escape(said.get(grade.name, ''))}</p>"
                for grade in sorted(notebook.grades, key=lambda grade: grade.name)
                if grade.manual_score is not None
            ]
            total = f"<h2>All together: {submission.score:g} of {submission.max_score:g} points</h2>"
            by_hand = "".join([*sections, total])
            waits = bool(notebook.needs_manual_grade)
            found.append(Graded(submission.student.id, submission.score, submission.max_score, waits, by_hand))
    return sorted(found, key=lambda one: one.student)


def plain_rows(topic: str, graded: Sequence[Graded]) -> list[list[str]]:
    """A row per student."""
    rows = [[one.student, f"{one.score:g}", f"{one.max_score:g}", "yes" if one.waits else ""] for one in graded]
    return [["student", "score", "max_score", "to be graded by hand"], *rows]


def moodle_rows(topic: str, graded: Sequence[Graded]) -> list[list[str]]:
    """Moodle's grading worksheet: it finds students by their identifier."""
    rows = [[f"Participant {one.number}", one.name, f"{one.score:g}", f"{one.max_score:g}"] for one in graded]
    return [["Identifier", "Full name", "Grade", "Maximum Grade"], *rows]


def canvas_rows(topic: str, graded: Sequence[Graded]) -> list[list[str]]:
    """Canvas's gradebook: it finds students by its own ID, and the assignment by its name, which is the lab's here."""
    possible = ["    Points Possible", "", "", "", "", f"{graded[0].max_score:g}"]
    rows = [[one.name, one.number, "", "", "", f"{one.score:g}"] for one in graded]
    return [["Student", "ID", "SIS User ID", "SIS Login ID", "Section", topic], possible, *rows]


def names_in_zip(course: Path, topic: str, graded: Sequence[Graded], platform: str) -> dict[str, str]:
    """By student the name that the platform knows a page by; Canvas knows only names of files that it gave out."""
    if platform == "moodle":
        return {one.student: f"{one.student}_assignsubmission_file_{topic}.html" for one in graded}
    names = {}
    for path in sorted((course / "downloaded" / topic).rglob("*.ipynb")):
        if (whose := student_and_notebook(str(path))) is not None:
            names.setdefault(whose[0], f"{path.stem}.html")
    return names


def zip_of(pages: Path, graded: Sequence[Graded], names: dict[str, str]) -> bytes:
    """A zip of the students' pages, with what a person graded; the same pages give the same bytes."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for one in graded:
            page = pages / f"{one.student}.html"
            if one.student in names and page.is_file():
                text = page.read_text(encoding="utf-8").replace("</body>", f"{one.by_hand}\n</body>")
                archive.writestr(zipfile.ZipInfo(names[one.student]), text)
    return content.getvalue()
