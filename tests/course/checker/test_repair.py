"""Wrong answers that readers of the labs gave: the marked place is where a change mends them.

tests/data/answers.json has them, each with its question, what the reader thought, and what a good reply is: the kind of
the sentence, and the marked parts with their lines' numbers.
tests/data/refused.json has wrong ones that were right by mistake once, or whose hint, some words of which it has, came
without a look at their program; of a question's listed mistakes none is among them.
"""

import ast
import json
from pathlib import Path

import pytest

from labkit.course.checker import child, repair
from labkit.course.checker.diagnosis import sentences
from labkit.course.checker.finding import WATCHES
from labkit.course.checker.mutation import mutations
from labkit.course.checker.program import Program
from labkit.course.checker.question import PUBLIC_SEED
from labkit.course.checker.run import define, judge
from labkit.course.topics import find

pytestmark = pytest.mark.bad_input  # without the shape checks, as outside the suite
ANSWERS, REFUSED = (
    json.loads((Path(__file__).parents[2] / "data" / f"{name}.json").read_text()) for name in ("answers", "refused")
)
UNSEEN = (101, 102, 103)  # seeds that repair does not try


def pieces_of(answer: dict) -> tuple[tuple[str, str], ...]:
    """The program of an answer, as a check cuts it."""
    return ("quiet", "import numpy as np"), (find(answer["question"]).function, answer["source"])


def first_sentence(verdict, pieces, found):
    """The kind of what is said first if no hand-written hint fits, and the parts that it marks."""
    said = sentences(verdict.question, verdict.cases, verdict.outputs, pieces, found)
    sentence = next(sentence for sentence in said if sentence.kind != "misconception")
    return sentence.kind, [f"{line.number}: {line.text[a:b]}" for line in sentence.marked for a, b in line.parts]


def mended(question, pieces, finding) -> bool:
    """Whether some change of the kind, at the places of a finding, makes the answer right with other seeds."""
    label, text = pieces[finding.piece]
    tree = ast.parse(text)
    for statement in filter(repair.is_function, tree.body):
        for mutation in mutations(statement):
            if mutation.kind == finding.kind and mutation.spans == finding.spans:
                with mutation.applied():
                    changed = ast.unparse(tree)
                answer = define(Program((pieces[0], (label, changed))), question.function, 10.0)
                if callable(answer) and all(judge(question, answer, seed, 20.0).passed for seed in UNSEEN):
                    return True
    return False


@pytest.mark.parametrize("answer", ANSWERS, ids=lambda a: f"{a['question'].partition('.')[2]}: {a['thought']}")
def test_an_answer_is_told_what_its_reader_can_use(answer, monkeypatch):
    """A listed mistake may take the place of any other sentence, which still is true."""
    monkeypatch.setattr(child, "CLOCK_S", 250.0)  # a busy machine
    question, pieces = find(answer["question"]), pieces_of(answer)
    function = define(Program(pieces), question.function)
    verdict = judge(question, function, PUBLIC_SEED)
    assert not verdict.passed
    if not answer["marked"]:
        assert verdict.sentence.kind in (answer["kind"], "misconception"), verdict.hint
        return
    found = child.findings(question, pieces, PUBLIC_SEED)
    assert first_sentence(verdict, pieces, found) == (answer["kind"], answer["marked"])
    if answer["kind"] not in WATCHES:
        assert mended(question, pieces, next(f for f in found if f.kind == answer["kind"]))


@pytest.mark.parametrize("answer", REFUSED, ids=lambda a: f"{a['question'].partition('.')[2]}: {a['thought']}")
def test_what_was_accepted_by_mistake_is_refused_and_what_was_only_counted_is_named(answer):
    question = find(answer["question"])
    function = define(Program(pieces_of(answer)), question.function)
    first, *others = (judge(question, function, seed) for seed in (0, 1, 2, 16))
    assert not first.passed and not any(verdict.passed for verdict in others)
    assert answer["hint"] in (first.hint or "")
