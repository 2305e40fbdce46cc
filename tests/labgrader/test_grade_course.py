"""A class of synthetic students over all labs: every grade as constructed, nothing wrong passes or right fails.

Students hand in all misconceptions, alternatives and spoilt answers; the attacks are in test_attacks. At night,
since every question's answers are judged in this process at each run (reply/test_questions).
"""

import grading_course as kit
import pytest

from labgrader.course import of_topic, topics
from labgrader.grade_course import grade_course
from labgrader.sandbox.sandbox import Limits

SEED = "a hidden seed"
LABS = [topic for topic in topics() if of_topic(topic)]  # those that have questions


@pytest.mark.nightly
@pytest.mark.parametrize("topic", LABS)
def test_every_grade_is_as_constructed(topic, tmp_path):
    students = kit.synthetic_class(topic)
    kit.write_lab(tmp_path, topic, whole=True)
    for student, (cells, _) in students.items():
        kit.submit(tmp_path, student, topic, cells, whole=True)
    graded = grade_course(topic, tmp_path, seed=SEED, workers=2, limits=Limits(), progress=False)
    assert [record.student for record in graded.records] == sorted(students)
    odd = []
    for record in graded.records:
        for result in record.results:
            expected, got = students[record.student][1][result.question], result.points == result.max_points
            odd += [(record.student, result)] if got != expected else []
    assert not odd
