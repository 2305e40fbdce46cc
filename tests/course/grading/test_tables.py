"""A table of all public cases, and a listed mistake for any other arguments: secret cases tell it from an answer."""

import pickle

import pytest

from labkit.course.checker.comparison import compare
from labkit.course.checker.question import Question
from labkit.course.checker.run import run
from labkit.course.grading.isolated import public_cases, secret_cases
from labkit.course.topics import TOPICS, of_topic

NOTEBOOKS = ("one", "another", "a third")
# Wrong for one argument alone, no turn: with that one in a table it is a right answer.
RIGHT_WITH_A_TABLE = ("largest of x y z",)
QUESTIONS = [question for topic in TOPICS for question in of_topic(topic).values()]


@pytest.mark.parametrize("question", QUESTIONS, ids=lambda question: question.name)
def test_who_has_the_public_cases_in_a_table_needs_the_right_answer_as_well(question: Question):
    table = {pickle.dumps(case.args) for case in public_cases(question)}
    passed = []
    for notebook in NOTEBOOKS:
        cases = secret_cases(question, "secret", notebook)
        new = [case for case in cases if pickle.dumps(case.args) not in table]
        assert len(new) > len(cases) / 2
        for mistake in question.misconceptions:
            if mistake.name in RIGHT_WITH_A_TABLE:
                continue
            outputs, _ = run(mistake.answer, [case.args for case in new])
            if not any(compare(question, case.expected, got) for case, got in zip(new, outputs, strict=True)):
                passed.append((mistake.name, notebook))
    assert not passed
