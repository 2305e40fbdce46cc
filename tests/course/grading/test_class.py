"""A class of synthetic students over all labs: every grade as constructed, nothing wrong passes or right fails.

Students hand in all misconceptions, alternatives and spoilt answers; the attacks are in test_attacks.
"""

import grading_course as kit
import pytest

from labkit.course.grading.run import grade_course
from labkit.course.grading.sandbox import Limits
from labkit.course.topics import TOPICS, of_topic

SEED = "a hidden seed"


@pytest.mark.parametrize("topic", [topic for topic in TOPICS if of_topic(topic)])  # those that have questions
def test_every_grade_is_as_constructed(topic, tmp_path):
    students = kit.synthetic_class(topic)
    kit.write_lab(tmp_path, topic)
    for student, (cells, _) in students.items():
        kit.submit(tmp_path, student, topic, cells)
    graded = grade_course(topic, tmp_path, seed=SEED, workers=2, limits=Limits(), progress=False)
    assert [record.student for record in graded.records] == sorted(students)
    odd = []
    for record in graded.records:
        for result in record.results:
            expected, got = students[record.student][1][result.question], result.points == result.max_points
            odd += [(record.student, result)] if got != expected else []
    assert not odd
