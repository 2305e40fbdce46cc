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
from at_night import others_at_night

from labgrader.course import find
from labgrader.program.live import LiveProgram, is_function
from labgrader.program.slice import Program
from labgrader.question import PUBLIC_SEED
from labgrader.reply.finding import IDLE, MOST_FINDINGS, WATCHES, Finding, read_findings
from labgrader.reply.judge import judge
from labgrader.reply.mutation import mutations
from labgrader.reply.repair_job import Look, comparison_settings, first, pairs
from labgrader.reply.sentences import sentences
from labgrader.run import subprocess_worker
from labgrader.run.run import Limits, Run, listed_mistakes, more_public_cases

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
    for statement in filter(is_function, tree.body):
        for mutation in mutations(statement):
            if mutation.kind == finding.kind and mutation.spans == finding.spans:
                with mutation.applied():
                    changed = ast.unparse(tree)
                answer = LiveProgram(question.function, (pieces[0], (label, changed))).answer
                if all(judge(question, answer, seed).passed for seed in UNSEEN):
                    return True
    return False


def looked_at(verdict, pieces, repair: bool = True) -> list[Finding]:
    """What a worker finds in a program, found in this process."""
    question, shown = verdict.question, verdict.case or 0
    public, listed = first(verdict.cases, shown), first(listed_mistakes(question), shown)
    job = Look(*comparison_settings(question), question.function, pieces, pairs(public), listed)
    found = read_findings(job.watch(), pieces)
    if repair:
        found += read_findings(job.repair(lambda: pairs(more_public_cases(question))), pieces)
    return found[:MOST_FINDINGS]


@pytest.mark.parametrize(
    "answer",
    others_at_night(ANSWERS, by_day=ANSWERS[::5]),
    ids=lambda a: f"{a['question'].partition('.')[2]}: {a['thought']}",
)
def test_an_answer_is_told_what_its_reader_can_use(answer):
    """A listed mistake may take the place of any other sentence, which still is true."""
    question, pieces = find(answer["question"]), pieces_of(answer)
    verdict = judge(question, LiveProgram(question.function, pieces).answer, PUBLIC_SEED)
    assert not verdict.passed
    if not answer["marked"]:
        assert verdict.sentence.kind in (answer["kind"], "misconception"), verdict.hint
        return
    comes_first = answer["kind"] in WATCHES and answer["kind"] != "writes"  # whatever repair finds
    found = looked_at(verdict, pieces, repair=not comes_first)
    assert first_sentence(verdict, pieces, found) == (answer["kind"], answer["marked"])
    if answer["kind"] not in (*WATCHES, *IDLE):
        assert mended(question, pieces, next(f for f in found if f.kind == answer["kind"]))


TWO_MISTAKES = [
    (
        "01_labels.class_shares",
        "def class_shares(y, C):\n    j = y[(y > 0) & (y != 255)]\n"
        "    return np.bincount(j, minlength=C) / max(j.size, 1)",
        ["2: >"],
        "Which images show the class at all?",
    ),
    (
        "04_iou.iou",
        'def iou(n):\n    with np.errstate(all="ignore"):\n'
        "        return np.nan_to_num(np.diagonal(n) / (n.sum(axis=0) + n.sum(axis=1)))",
        ["3: n.sum(axis=0)"],
        "what would a score of 0 say",
    ),
    (
        "09_other_stacks.enlarge",
        "def enlarge(labels, size):\n    H, W = size\n    h, w = labels.shape\n"
        "    return np.array([[labels[v * h // H, u * w // W] for u in range(W)] for v in range(H)])",
        ["2: H", "2: W"],
        "where is its centre?",
    ),
]  # a place, and a listed mistake beside it, in questions that have heavy cases


@pytest.mark.parametrize("name, source, marked, says", TWO_MISTAKES, ids=[name for name, *_ in TWO_MISTAKES])
def test_a_place_is_marked_beside_a_listed_mistake(name, source, marked, says):
    question = find(name)
    pieces = pieces_of({"question": name, "source": source})
    verdict = judge(question, LiveProgram(question.function, pieces).answer, PUBLIC_SEED)
    sentence = next(sentences(question, verdict.cases, verdict.outputs, pieces, looked_at(verdict, pieces)))
    assert [f"{line.number}: {line.text[a:b]}" for line in sentence.marked for a, b in line.parts] == marked
    assert sentence.says.startswith("Two things are wrong") and says in sentence.says


@pytest.mark.parametrize("answer", [a for a in ANSWERS if a["kind"] == "cast"], ids=lambda a: a["thought"])
def test_values_that_another_type_would_mend_are_not_called_right(answer):
    question, pieces = find(answer["question"]), pieces_of(answer)
    verdict = judge(question, LiveProgram(question.function, pieces).answer, PUBLIC_SEED)
    said = sentences(question, verdict.cases, verdict.outputs, pieces, looked_at(verdict, pieces))
    assert next(s.says for s in said if s.kind == "cast").startswith("The marked place needs another dtype")


@pytest.mark.parametrize("answer", [a for a in ANSWERS if a["marked"]][::15], ids=lambda a: a["thought"])
def test_a_worker_finds_the_same(answer):
    question, pieces = find(answer["question"]), pieces_of(answer)
    verdict = judge(question, LiveProgram(question.function, pieces).answer, PUBLIC_SEED)
    with Run(question, Program(pieces), subprocess_worker.fresh_worker, Limits()) as run:
        assert run.findings(verdict.case) == looked_at(verdict, pieces)


@pytest.mark.parametrize("seeds", others_at_night([(PUBLIC_SEED,), (PUBLIC_SEED, 1, 2, 16)]), ids=len)
@pytest.mark.parametrize("answer", REFUSED, ids=lambda a: f"{a['question'].partition('.')[2]}: {a['thought']}")
def test_what_was_accepted_by_mistake_is_refused_and_what_was_only_counted_is_named(answer, seeds):
    question = find(answer["question"])
    function = LiveProgram(question.function, pieces_of(answer)).answer
    first, *others = (judge(question, function, seed) for seed in seeds)
    assert not first.passed and not any(verdict.passed for verdict in others)
    assert answer["hint"] in (first.hint or "")
