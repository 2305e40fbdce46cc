"""Honest submissions of many kinds: all of them earn their points, or were told before that they would not."""

import grading_course as kit
import pytest
from submissions import Honest, in_other_labs

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


def question_of(submission: Honest) -> str:
    """The function that a submission answers."""
    return submission.name.partition(":")[0].partition(".")[2]
