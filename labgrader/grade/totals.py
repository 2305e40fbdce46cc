"""What students have in the end: points of functions and of a person, under changes, less what late work costs.

nbgrader's gradebook keeps it all. A page of feedback/STUDENT.html ends with it: that page is the one for students.
"""

from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

from labgrader.grade.changes import FOR_ALL, NO_COUNT, Change, changed, read_changes
from labgrader.grade.deadlines import Deadline, Lateness, read_deadline
from labgrader.grade.gradebook import opened, register
from labgrader.grade.policy import free_days, read_bonus, read_policy
from labgrader.handin.collect import marked_late
from labgrader.handin.reading import Lab
from labgrader.support import counted, write_atomically

NOT_FINAL = "Not final: an answer still has to be graded or reviewed"
OFF = "That is taken off above."
BEGIN, END = "<!-- what a person graded, and the total -->", "</body></html>\n"


@dataclass(frozen=True)
class Final:
    """A student's grade. waits: the questions that still have to be graded by hand; section: the page's end, HTML."""

    student: str
    score: float
    max_score: float
    waits: tuple[str, ...]
    late: Lateness
    section: str


def settle(course: Path, topic: str, changes: Sequence[Change], deadline: Deadline | None) -> dict[str, Final]:
    """Bring changes of answers in words, extensions and penalties into the gradebook; the grades there, by student."""
    by_question, marked, found = {change.question: change for change in changes}, marked_late(course, topic), {}
    bonus, policy = read_bonus(course, topic), read_policy(course)
    with opened(course) as gradebook:
        free = free_days(course, gradebook, topic, policy.late_days) if policy.late_days else Counter()
        if deadline is not None:
            gradebook.find_assignment(topic).duedate = deadline.due
        for submission in gradebook.assignment_submissions(topic):
            (notebook,), student = submission.notebooks, submission.student.id
            said = {comment.name: comment for comment in notebook.comments}
            for grade in notebook.grades:
                if grade.name in said:  # an answer in words
                    apply_change(grade, said[grade.name], by_question.get(grade.name))
            gradebook.db.commit()  # which computes the scores
            late = Lateness()
            if deadline is not None:
                late = deadline.lateness(student, submission.timestamp, marked.get(student))
                late = deadline.with_free(late, free[student])
                submission.extension = deadline.due_for(student) - deadline.due or None
            notebook.late_submission_penalty = notebook.score * late.percent / 100.0
            score = submission.score - notebook.late_submission_penalty + sum(points for points, _ in bonus)
            grades = sorted(notebook.grades, key=lambda grade: grade.name)
            sections = [section_by_hand(grade, said[grade.name.removeprefix("check_")]) for grade in grades]
            waits = tuple(grade.name.removeprefix("check_") for grade in grades if grade.needs_manual_grade)
            begin = "So far" if waits else "Total"
            total = f"<h2>{begin}: {score:g} of {submission.max_score:g} points</h2>"
            notes = [f"<p>{NOT_FINAL}.</p>" if waits else "", handed_in_late(late)]
            more = [f"<p>{counted(extra, 'point')} more for everybody: {escape(reason)}</p>" for extra, reason in bonus]
            section = "\n".join(filter(None, [*sections, *more, total, *notes]))
            found[student] = Final(student, score, submission.max_score, waits, late, section)
        gradebook.db.commit()
    return dict(sorted(found.items()))


def settle_anew(course: Path, lab: Lab) -> tuple[Lab, dict[str, Final]]:
    """Bring the gradebook and the pages of a graded lab up to date; the lab with its changes, and the grades."""
    changes, deadline = read_changes(course, lab), read_deadline(course, lab.topic)
    now = changed(lab, [], changes)[0]
    register(course, now)
    finals = settle(course, lab.topic, changes, deadline)
    finish_pages(course / "grades" / lab.topic, finals.values())
    return now, finals


def handed_in_late(late: Lateness) -> str:
    """What a page says of late work, "" if it came in time."""
    return f"<p>Handed in {late}.{f' {OFF}' if late.percent else ''}</p>" if late.days else ""


def apply_change(grade, comment, change: Change | None) -> None:
    """Apply a change to an answer in words, or undo it: the manual score stays, `extra_credit` holds the difference."""
    if change is not None:
        wanted = grade.max_score if change.everybody else 0.0
        if grade.manual_score is None:
            grade.auto_score, grade.extra_credit = wanted, None
        else:
            grade.extra_credit = wanted - grade.manual_score
        grade.needs_manual_grade, comment.auto_comment = False, str(change)
    elif (comment.auto_comment or "").startswith((FOR_ALL, NO_COUNT)):
        grade.auto_score = grade.extra_credit = comment.auto_comment = None
        grade.needs_manual_grade = grade.manual_score is None


def section_by_hand(grade, comment) -> str:
    """What a page says of an answer in words, and of a function that a person graded; "" if that is still to come."""
    in_words = grade.name == comment.name
    if not (comment.manual_comment or grade.manual_score is not None or (in_words and not grade.needs_manual_grade)):
        return ""
    texts = (comment.auto_comment if in_words else None, comment.manual_comment)
    said = "".join(f"<p>{escape(text)}</p>" for text in texts if text)
    return f"<section><h2>{escape(comment.name)}: {grade.score:g} of {grade.max_score:g} points</h2>{said}</section>"


def finish_pages(out: Path, finals: Collection[Final]) -> None:
    """End the page of each student with what a person graded, and the total; what stood there before is replaced."""
    for final in finals:
        page = Path(out) / "feedback" / f"{final.student}.html"
        if page.is_file():
            begun = page.read_text(encoding="utf-8").removesuffix(END).partition(BEGIN)[0].rstrip("\n")
            write_atomically(page, f"{begun}\n{BEGIN}\n{final.section}\n{END}".encode())
