"""Honest submissions of many kinds: all of them earn their points, or were told before that they would not."""

import grading_course as kit
import pytest
from submissions import OWN, Honest, as_editors_save_it, as_students_leave_it, in_other_labs

from labkit.course.checker.program import cells_of
from labkit.course.checking_file import CheckedLab
from labkit.course.grading.run import grade_course
from labkit.course.topics import of_topic

HONEST = in_other_labs()
TOPICS = sorted({submission.name.partition(".")[0] for submission in HONEST})


@pytest.mark.parametrize("topic", TOPICS)
def test_what_is_honest_is_right_and_the_file_check_says_the_same_before(topic, tmp_path):
    kit.write_lab(tmp_path, topic)
    students = {f"s{i}": one for i, one in enumerate(HONEST) if one.name.startswith(topic)}
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


@pytest.mark.parametrize("topic", TOPICS)
def test_whole_labs_are_right_however_an_editor_saves_them_and_wherever_the_cells_went(topic, tmp_path):
    """Each lab takes every fifth of the ways."""
    right = whole_lab(topic)
    ways = as_editors_save_it(right) | as_students_leave_it(right)
    mine = list(ways.items())[TOPICS.index(topic) :: len(TOPICS)]
    kit.write_lab(tmp_path, topic)
    for way, notebook in mine:
        kit.submit(tmp_path, way, topic, notebook)
    records = grade_course(topic, tmp_path, seed="secret", workers=2, progress=False).records
    assert len(records) == len(mine) >= 2
    for record in records:
        assert not record.reason and all(result.right for result in record.results), (record.student, record)


def question_of(submission: Honest) -> str:
    """The function that a submission answers."""
    return submission.name.partition(":")[0].partition(".")[2]
