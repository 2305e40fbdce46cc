"""CONTRIBUTING's rule: what a change of one place would fix is not listed, since repair marks that place.

A right answer in which one place is changed may give what a listed mistake gives. If repair finds that place again, the
hint has to say more than the place; tests/data/says_more.json names those that do, by question.
"""

import ast
import json
import resource
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import grading_course as kit
import pytest
from alternatives import alternatives

from labgrader.comparison import is_heavy, quiet, weight
from labgrader.course import find, of_topic, topics
from labgrader.program.live import LiveProgram, defines, is_function
from labgrader.question import Question
from labgrader.reply.alarm import TimeIsUp, finite, limited
from labgrader.reply.listed import fingerprint
from labgrader.reply.mutation import mutations
from labgrader.reply.repair import repairs
from labgrader.reply.repair_job import Look, comparison_settings, pairs
from labgrader.run.run import listed_mistakes, more_public_cases, public_cases

pytestmark = pytest.mark.bad_input
DATA = Path(__file__).parents[2] / "data/says_more.json"
SAYS_MORE = json.loads(DATA.read_text())
ANSWERS, CHANGES = 2, 500  # right answers of a question that are changed, and how often each: the likeliest changes
TRIES = 3  # changed answers that give the same listed mistake and are shown to repair, which takes seconds
MEMORY = 8 << 30  # bytes of address space
QUESTIONS = [question.name for topic in topics() for question in of_topic(topic).values()]


@pytest.fixture(autouse=True)
def little_memory():
    """A changed program that asks for much gets an error."""
    before = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_AS, before)


def one_place_changed(question: Question) -> Iterator[tuple[str, int]]:
    """Right answers with one place changed that give what a listed mistake gives: the text, the mistake's position."""
    both = zip(public_cases(question), listed_mistakes(question), strict=True)
    light = [(case, of_case) for case, of_case in both if not is_heavy(case.args, case.expected)]
    light.sort(key=lambda entry: weight(entry[0].args))
    right = [of_case.get(fingerprint(case.expected), frozenset()) for case, of_case in light]
    told_here = set(range(len(question.misconceptions))) - frozenset.intersection(*right)  # not in heavy cases alone
    absent = ("torch", "cv2", "scipy", "as_strided", *question.forbidden)  # a changed as_strided may end the process
    texts = [kit.as_cell(answer, question.function) for answer in alternatives(question)]
    for text in [text for text in texts if not any(name in text for name in absent)][:ANSWERS]:
        tree = ast.parse(text)
        program = LiveProgram(question.function, (("quiet", "import numpy as np"), ("answer", text)))
        for statement in filter(is_function, tree.body):
            right = program.namespace[defines(statement)]
            for mutation in sorted(mutations(statement), key=lambda mutation: mutation.cost)[:CHANGES]:
                with mutation.applied(), quiet(), finite():
                    try:
                        program.replace(statement)
                    except Exception:  # a change that is no program
                        continue
                    told = set(told_here)
                    for case, of_case in light:
                        told &= of_case.get(fingerprint(output_of(program, case.args)), frozenset())
                        if not told:
                            break
                    if told:
                        yield ast.unparse(tree), min(told)
                program.namespace[defines(statement)] = right


def output_of(program: LiveProgram, args: tuple) -> object:
    """What a changed program gives; None if it stops, or takes long."""
    try:
        with limited(0.1):
            return program.call(args)[0]
    except (Exception, SystemExit, TimeIsUp):
        return None


def repaired(question: Question, text: str) -> bool:
    """Whether repair marks a place of a program by which it would be right.

    Without heavy cases: nothing here ends a compiled function that takes minutes on one, as a worker's end does.
    """
    pieces = (("quiet", "import numpy as np"), (question.function, text))
    light = [case for case in public_cases(question) if not is_heavy(case.args, case.expected)]
    look = Look(*comparison_settings(question), question.function, pieces, pairs(light))
    fresh = lambda: pairs(more_public_cases(question))  # noqa: E731
    return bool(repairs(pieces, question.function, look.public, fresh, look.right, look.off))


@pytest.mark.nightly
@pytest.mark.parametrize("name", QUESTIONS)
def test_what_repair_would_mark_is_listed_only_if_its_hint_says_more(name):
    question, found, tried = find(name), set(), Counter(dict.fromkeys(SAYS_MORE.get(name, ()), TRIES))
    for text, position in one_place_changed(question):
        mistake = question.misconceptions[position].answer.__name__
        if tried[mistake] < TRIES:
            tried[mistake] += 1
            if repaired(question, text):
                found.add(mistake)
                tried[mistake] = TRIES
    assert not found, "take them out of the question, or name them in tests/data/says_more.json"


def test_whose_hint_says_more_is_listed_in_its_question():
    listed = {name: {m.answer.__name__ for m in find(name).misconceptions} for name in SAYS_MORE}
    assert not {name: sorted(gone) for name, known in SAYS_MORE.items() if (gone := set(known) - listed[name])}
