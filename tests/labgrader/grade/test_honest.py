"""Honest submissions of many kinds: all of them earn their points, or were told before that they would not."""

from pathlib import Path

import grading_course as kit
import pytest
from at_night import others_at_night
from submissions import OWN, Honest, as_editors_save_it, as_students_leave_it, in_other_labs
from submissions.generated import generated

from labgrader.course import course, of_topic
from labgrader.file_check import CheckedLab
from labgrader.grade.grade import Result
from labgrader.grade_course import grade_course
from labgrader.program.cell import cells_of
from labgrader.program.slice import program
from labgrader.run import subprocess_worker
from labgrader.run.run import Limits, Run, public_cases

HONEST = in_other_labs()
PARTS = 6  # in which they are handed in
TOPICS = sorted({submission.name.partition(".")[0] for submission in HONEST})


@pytest.mark.parametrize("part", others_at_night(range(PARTS)))
@pytest.mark.parametrize("topic", TOPICS)
def test_what_is_honest_is_right_and_the_file_check_says_the_same_before(topic, part, tmp_path):
    kit.write_lab(tmp_path, topic, whole=True)
    submissions = [one for one in HONEST if one.name.startswith(topic)]
    students = {f"s{i}": one for i, one in enumerate(submissions[part::PARTS])}
    for student, submission in students.items():
        kit.submit(tmp_path, student, topic, submission.notebook())
    records = grade_course(topic, tmp_path, seed="secret", workers=2, progress=False).records
    assert [record.student for record in records] == sorted(students)
    for record in records:
        submission = students[record.student]
        (result,) = [result for result in record.results if result.question == question_of(submission)]
        before = CheckedLab(cells_of(submission.notebook()["cells"]), of_topic(topic)).verdict(result.question)
        if submission.refused:
            assert submission.refused in result.says and before.problem.says == result.says, submission.name
        else:
            assert result.right and before.passed, (submission.name, result.says, before.problem)


def whole_lab(topic: str) -> Honest:
    """A lab with a right answer to each question in its cell."""
    return Honest(topic, (*OWN["setup"], *((answer, name) for name, answer in kit.right_answers(topic).items())))


@pytest.mark.parametrize("topic", others_at_night(TOPICS))
def test_whole_labs_are_right_however_an_editor_saves_them_and_wherever_the_cells_went(topic, tmp_path):
    """Each lab takes every fifth of the ways."""
    right = whole_lab(topic)
    ways = as_editors_save_it(right) | as_students_leave_it(right)
    mine = list(ways.items())[TOPICS.index(topic) :: len(TOPICS)]
    kit.write_lab(tmp_path, topic, whole=True)
    for way, notebook in mine:
        kit.submit(tmp_path, way, topic, notebook)
    records = grade_course(topic, tmp_path, seed="secret", workers=2, progress=False).records
    assert len(records) == len(mine) >= 2
    for record in records:
        assert not record.reason and all(result.right for result in record.results), (record.student, record)


@pytest.mark.parametrize("count", [3, pytest.param(150, marks=[pytest.mark.nightly, pytest.mark.timeout(3000)])])
def test_what_a_check_ticks_earns_its_points(count, tmp_path):
    """Whenever it was ticked: in the notebook below the answer, at its end, or in the saved file."""
    found = fates(generated(count), tmp_path)
    assert not [(name, result.says) for name, (ticked, result) in found.items() if ticked and not result.right]
    assert sum(ticked for ticked, _ in found.values()) >= 0.95 * count


def fates(submissions: list[Honest], place: Path) -> dict[str, tuple[bool, Result]]:
    """Whether a check ticks each submission, and what it earns, by its name."""
    found = {}
    for topic in sorted({one.name.partition(".")[0] for one in submissions}):
        folder = place / topic
        kit.write_lab(folder, topic, whole=True)
        mine = {f"s{one.name.rpartition(' ')[2]}": one for one in submissions if one.name.startswith(topic)}
        for student, one in mine.items():
            kit.submit(folder, student, topic, one.notebook())
        for record in grade_course(topic, folder, seed="secret", workers=2, progress=False).records:
            one = mine[record.student]
            (result,) = [result for result in record.results if result.question == question_of(one)]
            found[one.name] = is_ticked(one, topic), result
    return found


def is_ticked(one: Honest, topic: str) -> bool:
    """Whether a check ticks a submission as a file, or in a kernel that ran its cells in their order."""
    name, questions, here = question_of(one), of_topic(topic), course()
    cells, question = cells_of(one.notebook()["cells"]), questions[name]
    asked = (name, questions, here.packages, question.forbidden, here.kit, {})
    saved = program(cells, *asked)
    if CheckedLab(cells, questions).verdict(name).passed:
        return True
    last = max(i for i, cell in enumerate(cells) if f"def {name}(" in cell.source or f"{name} = " in cell.source)
    for ran in (cells[: last + 1], cells):
        live = program(ran, *asked, latest=True)
        if live.refused or live.pieces == saved.pieces:
            continue
        with Run(question, live, subprocess_worker.fresh_worker, Limits()) as answer:
            if answer.judge(public_cases(question))[0].passed:
                return True
    return False


def question_of(submission: Honest) -> str:
    """The function that a submission answers."""
    return submission.name.partition(":")[0].partition(".")[2]
