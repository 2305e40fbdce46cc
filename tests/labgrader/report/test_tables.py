"""A table of all public cases, and a listed mistake for any other arguments: secret cases tell it from an answer."""

import pickle

import grading_course as kit
import pytest

from labgrader.comparison import compare
from labgrader.course import of_topic, topics
from labgrader.grade import grade
from labgrader.grade.grade import secret_cases
from labgrader.handin.reading import read_lab, read_submission
from labgrader.question import Question
from labgrader.reply.judge import outputs_of
from labgrader.run.run import public_cases

STUDENTS = ("one", "another", "a third")
# Wrong for one argument alone, no turn: with that one in a table it is a right answer.
RIGHT_WITH_A_TABLE = ("largest of x y z",)
QUESTIONS = [question for topic in topics() for question in of_topic(topic).values()]


@pytest.mark.parametrize("question", QUESTIONS, ids=lambda question: question.name)
def test_who_has_the_public_cases_in_a_table_needs_the_right_answer_as_well(question: Question):
    table = {pickle.dumps(case.args) for case in public_cases(question)}
    passed = []
    for student in STUDENTS:
        cases = secret_cases(question, "secret", student)
        new = [case for case in cases if pickle.dumps(case.args) not in table]
        assert len(new) > len(cases) / 2
        for mistake in question.misconceptions:
            if mistake.name in RIGHT_WITH_A_TABLE:
                continue
            outputs = (outputs_of(mistake.answer, [case.args])[0][0] for case in new)  # up to one that differs
            if not any(compare(question, case.expected, got) for case, got in zip(new, outputs, strict=True)):
                passed.append((mistake.name, student))
    assert not passed


def test_a_resubmission_meets_the_same_secret_cases_and_another_student_others(tmp_path, monkeypatch):
    met = {}

    def noted(question, secret, student):
        cases = secret_cases(question, secret, student)
        met.setdefault(student, []).append(pickle.dumps([case.args for case in cases]))
        return cases

    monkeypatch.setattr(grade, "secret_cases", noted)
    kit.write_lab(tmp_path, "04_iou")
    lab, answer = read_lab(tmp_path, "04_iou"), kit.right_answers("04_iou")["iou"]
    for student, text in (("ada", answer), ("ada", f"{answer}\n# once more"), ("ben", answer)):
        kit.submit(tmp_path, student, "04_iou", {"iou": text})
        submission = read_submission(tmp_path / "submitted" / student, lab)
        assert grade.Grading(lab, submission).result("iou", "secret").right
    assert met["ada"][0] == met["ada"][1] != met["ben"][0]
