"""A class of synthetic students over all labs: every grade as constructed, nothing wrong passes or right fails."""

import grading_course as kit
import pytest

from labkit.course.grading.run import grade_course
from labkit.course.grading.sandbox import Limits
from labkit.course.topics import TOPICS

SEED = "a hidden seed"
totals = {"students": 0, "wrong": 0, "accepted": 0, "right": 0, "rejected": 0}


@pytest.mark.parametrize("topic", TOPICS)
def test_every_grade_is_as_constructed(topic, tmp_path):
    students = kit.synthetic_class(topic)
    kit.write_lab(tmp_path, topic)
    for student, (cells, _) in students.items():
        kit.submit(tmp_path, student, topic, cells)
    graded = grade_course(topic, tmp_path, seed=SEED, workers=2, limits=Limits(), progress=False)
    assert [record.student for record in graded.records] == sorted(students)
    odd = []
    for record in graded.records:
        totals["students"] += 1
        for result in record.results:
            expected, got = students[record.student][1][result.question], result.points == result.max_points
            totals["right" if expected else "wrong"] += 1
            totals["rejected" if expected else "accepted"] += got != expected
            odd += [(record.student, result)] if got != expected else []
    assert not odd


def test_no_false_accepts_and_no_false_rejects(capsys):
    """Over all misconceptions, alternatives and spoilt answers; those of tests/attacks are in test_grading_attacks."""
    with capsys.disabled():
        print(
            "\n{students} synthetic students: false accepts {accepted} of {wrong}, "
            "false rejects {rejected} of {right}".format(**totals)
        )
    assert totals["students"] >= 100 and totals["wrong"] > 200 and totals["right"] > 200
    assert totals["accepted"] == totals["rejected"] == 0
