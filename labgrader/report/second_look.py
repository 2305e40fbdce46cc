"""A second look at one answer, which a student asked for by the key on the page: its program, all cases and replies.

The instructor reads what a student does not: secret cases, and what they expect. What a student wrote stands here
without signs that a terminal obeys.
"""

from collections.abc import Iterator
from contextlib import closing, suppress
from pathlib import Path

from nbgrader.api import MissingEntry

from labgrader.comparison import Case, Problem, compare
from labgrader.course import of_topic
from labgrader.grade.batch import SECRET_FILE, read_record, record_path
from labgrader.grade.changes import changed, read_changes
from labgrader.grade.diagnose_outputs import diagnosers
from labgrader.grade.grade import Grading, Result
from labgrader.grade.gradebook import opened
from labgrader.grade.overview import NOT_RUN
from labgrader.handin.reading import Lab, read_lab, read_submissions
from labgrader.handin.several import read_picks
from labgrader.question import Question
from labgrader.reply.messages import call, shown_case, written
from labgrader.report.outputs import answer_key
from labgrader.run.channel import Changed
from labgrader.run.run import public_cases
from labgrader.sandbox import sandbox


def second_look(
    topic: str, course: Path, key: str, submissions: Path | None = None, out: Path | None = None, unsafe: bool = False
) -> list[str]:
    """What an instructor reads about the answer that a key names; it runs again on all cases of the round.

    Raises ValueError for a key of no answer here, and where the lab was not graded.
    """
    course = Path(course)
    lab, out = read_lab(course, topic), course / "grades" / topic if out is None else Path(out)
    folder = course / "submitted" if submissions is None else Path(submissions)
    read = read_submissions(folder, lab, read_picks(course, topic))
    found = [(one, name) for one in read for name in lab.answers if answer_key(one.student, lab, name) == key]
    if not found:
        raise ValueError(f"look: expected the key of an answer on a page in {out / 'feedback'}, got {key!a}")
    submission, name = found[0]
    record = read_record(record_path(out, submission.student))
    now = changed(lab, [record], read_changes(course, lab))[1] if record is not None else []
    results = [result for one in now for result in one.results if result.question == name]
    if not results or not (out / SECRET_FILE).is_file():
        raise ValueError(f"look: {submission.student} has no grade of {name} in {out}; grade {topic} first")
    lines = [f"{submission.student}, {topic}.{name}", *by_a_person(course, lab, submission.student, name)]
    lines += about(results[0])
    with closing(sandbox.servers), closing(diagnosers):
        grading = Grading(lab, submission, unsafe=unsafe)
        replies = grading.replies(name, (out / SECRET_FILE).read_text().strip())
    lines += [line for i, (case, got) in enumerate(replies) for line in case_lines(of_topic(topic)[name], i, case, got)]
    return ["".join(c if c.isprintable() else ascii(c)[1:-1] for c in line) for line in lines]


def by_a_person(course: Path, lab: Lab, student: str, name: str) -> Iterator[str]:
    """The points that a person gave, which count in the place of those below."""
    if (course / "gradebook.db").is_file():
        with opened(course) as gradebook, suppress(MissingEntry):
            grade = gradebook.find_grade(f"check_{name}", lab.topic, lab.topic, student)
            if grade.manual_score is not None:
                yield f"A person gave it {grade.manual_score:g} points, which count."


def about(result: Result) -> Iterator[str]:
    """The points, what was said of an answer, and its program: what was said counts the lines of the student's cell."""
    yield f"{result.points:g} of {result.max_points:g} points: {result.says}"
    yield from [f"Hint: {result.hint}"] if result.hint else []
    yield from [f"To look at: {result.flag}"] if result.flag else []
    yield ""
    yield "Its cell:" if result.kind in NOT_RUN else "Its program, its lines numbered without blank ones:"
    for number, line in enumerate(result.program.split("\n"), start=1):
        yield f"{number:4}  {line.expandtabs(4)}"


def case_lines(question: Question, i: int, case: Case, got: object) -> Iterator[str]:
    """A case, and the reply to it; i: its position among all."""
    public = len(public_cases(question))
    where = f"public case {i + 1}" if i < public else f"secret case {i + 1 - public}"
    value = got.value if isinstance(got, Changed) else got
    problem = value if isinstance(value, Problem) else compare(question, case.expected, value)
    yield ""
    if problem is None:
        yield f"{where}: {'right, but it changes its arguments' if isinstance(got, Changed) else 'right'}"
        yield from (f"    {line}" for line in (call(question, case.args), f"returns   {written(value)}"))
        return
    yield f"{where}: {problem.says}"
    lines = list(shown_case(question, case, value))
    lines += [] if any("expected" in line for line in lines[1:]) else [f"expected  {written(case.expected)}"]
    yield from (f"    {line}" for line in lines)
