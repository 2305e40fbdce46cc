"""All questions of all topics: right answers pass, wrong ones lose and earn their hint, and none slips through.

`pytest tests/labgrader/reply -k 04_iou` tries one topic. Right are the reference and the alternatives; wrong are the
misconceptions, and the small mutations of the reference that do not behave like it. A mutant that passes every case is
searched for a difference on many more inputs: without one it is equivalent; with one, the question's cases are too
weak.
"""

import ast
import inspect
import math
import textwrap
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from itertools import chain

import numpy as np
import pytest
from alternatives import alternatives

from labgrader.comparison import Case, Problem, compare, expected_cases, trusted
from labgrader.course import find, of_topic, topics
from labgrader.question import Question
from labgrader.reply.alarm import TimeIsUp, limited
from labgrader.reply.judge import Verdict, outputs_of, verdict
from labgrader.reply.mutation import mutations
from labgrader.reply.sentences import Sentence

CHECKS, SEEDS = (0,), (0, 1, 20_260_101)  # the seed of `check`; those of the night
LIMIT_S = 0.5
# On how many random inputs a surviving mutant must differ nowhere, how many seconds of a processor it may take, and
# which mutants are tried: every third, or all.
BY_DAY, AT_NIGHT = (40, 0.1, 3), (150, 1.0, 1)

KINDS = ("operator", "comparison", "order", "sign", "not", "axis", "constant", "function", "brackets")


@dataclass(frozen=True)
class Mutant:
    """A reference with one small mutation."""

    name: str
    function: Callable


def mutants(reference: Callable) -> list[Mutant]:
    """The mutations of a reference that change one node, each as a function that can be called."""
    reference = inspect.unwrap(reference)  # the globals of what is wrapped round it are others
    tree = ast.parse(textwrap.dedent(inspect.getsource(reference)))
    found = []
    for mutation in mutations(tree.body[0]):
        if mutation.kind not in KINDS or mutation.cost > 1 or len(mutation.places) > 1:
            continue
        before, line = mutation.places[0].node, mutation.spans[0].line
        with mutation.applied():
            text = f"line {line}: {ast.unparse(before)} -> {ast.unparse(mutation.places[0].node)}"
            namespace = dict(reference.__globals__)
            exec(compile(tree, "<mutant>", "exec"), namespace)
        found.append(Mutant(text, namespace[reference.__name__]))
    return found


def names() -> list[str]:
    """Names of all questions; a topic that cannot be imported is left to `test_a_topic_has_questions`."""
    found = []
    for topic in topics():
        try:
            found += [question.name for question in of_topic(topic).values()]
        except Exception:  # any error of a module: the other topics are tried all the same
            continue
    return found


QUESTIONS = pytest.mark.parametrize("name", names())
pytestmark = pytest.mark.bad_input  # graded as outside the suite: thousands of calls, many with wrong shapes on purpose


@dataclass(frozen=True)
class Trial:
    """What grading many answers to one question gave: names of answers by how they fared."""

    right: int
    wrong: int
    false_rejects: tuple[str, ...]
    false_accepts: tuple[str, ...]
    equivalent: tuple[str, ...]


@cache
def trial(name: str) -> Trial:
    """Grade the right and the wrong answers to one of the kit's questions, under the seed of `check`."""
    return grade(find(name), alternatives(find(name)))


def grade(
    question: Question, extra: tuple[Callable, ...] = (), seeds: tuple[int, ...] = CHECKS, search: tuple = BY_DAY
) -> Trial:
    """Grade the right and the wrong answers to a question under some seeds; extra: right ones beside its own."""
    count, seconds, every = search
    cases = [cases_of(question, seed) for seed in seeds]
    rng = np.random.default_rng(7)
    right = (question.reference, *extra)
    rejected = [said for answer in right for said in objections(question, answer, seeds)]
    accepted = [
        m.name
        for m in question.misconceptions
        if any(passes(question, m.answer, of_seed) for of_seed in cases)  # or it writes into its arguments
        and any(judged(question, m.answer, seed).passed for seed in seeds)
    ]
    all_mutants = mutants(question.reference)[::every]
    survivors = [m for m in all_mutants if any(passes(question, m.function, of_seed, seconds) for of_seed in cases)]
    drawn = question.draws(rng, count) if survivors else []
    searched = [Case(args, trusted(question.reference, args), False) for args in drawn]
    # One that was right on the cases and takes too long now, on a busy machine, gave no other number.
    tried = {"cases": [*chain(*cases), *searched], "seconds": seconds, "late": True}
    accepted += [m.name for m in survivors if not passes(question, m.function, **tried)]
    equivalent = [m.name for m in survivors if m.name not in accepted]
    wrong = len(question.misconceptions) + len(all_mutants) - len(equivalent)
    return Trial(len(right), wrong, tuple(rejected), tuple(accepted), tuple(equivalent))


@lru_cache(maxsize=4)
def cases_of(question: Question, seed: int) -> list[Case]:
    """The cases of a seed, which the reference answers once for all that are judged on them."""
    return expected_cases(question, seed)


def judged(question: Question, answer: Callable, seed: int) -> Verdict:
    """What `judge` says."""
    cases = cases_of(question, seed)
    return verdict(question, cases, *outputs_of(answer, [case.args for case in cases]))


def objections(question: Question, answer: Callable, seeds: tuple[int, ...]) -> list[str]:
    """What the judge has against an answer, under each seed."""
    title = getattr(answer, "source", answer.__name__)
    verdicts = {seed: judged(question, answer, seed) for seed in seeds}
    return [f"{title}, seed {seed}: {v.problem} in {v.where}" for seed, v in verdicts.items() if not v.passed]


def passes(
    question: Question, answer: Callable, cases: list[Case], seconds: float = math.inf, late: bool = False
) -> bool:
    """Whether an answer is right on all cases, and returns in time; the judge asks more, and says what is wrong.

    seconds: of a processor, after which no further case is tried: a mutant may go round a loop a thousand times. late:
    what is said of one that does not return in time.
    """
    end = time.process_time() + seconds
    for case in cases:
        if time.process_time() > end:
            break
        try:
            with limited(LIMIT_S):
                (got,), _ = outputs_of(answer, [case.args])
        except TimeIsUp:
            return late
        if isinstance(got, Problem) or compare(question, case.expected, got) is not None:
            return False
    return True


# ---------------------------------------------------------------------------------------- the tests


@pytest.mark.parametrize("topic", topics())
def test_a_topics_questions_have_its_name(topic):
    questions = of_topic(topic)
    for function, question in questions.items():
        assert question.name == f"{topic}.{function}" and find(question.name) is question


@QUESTIONS
def test_a_question_is_complete(name):
    question = find(name)
    titles = [m.name for m in question.misconceptions]
    assert len(set(titles)) == len(titles)
    assert len(set(alternatives(question))) >= 2
    assert 0 <= question.edges < len(question.by_hand) and question.random_cases >= 3 and question.points > 0
    for misconception in question.misconceptions:
        assert 20 <= len(misconception.hint) <= 200 and "\n" not in misconception.hint
        assert misconception.hint[-1] in ".?!:", misconception.hint


@QUESTIONS
def test_a_reference_is_short_and_complete_in_itself(name):
    """So that it can be read as the answer, and mutated: no helper of its own module, constants excepted."""
    question = find(name)
    source = inspect.getsource(question.reference)
    assert question.reference.__name__ == question.function
    assert ast.get_docstring(ast.parse(source).body[0])
    names = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Name)]
    used = {node.id for node in names} - {node.id for node in names if isinstance(node.ctx, ast.Store)}
    globals_used = {key: question.reference.__globals__[key] for key in used & question.reference.__globals__.keys()}
    assert not [key for key, value in globals_used.items() if inspect.isfunction(value) or inspect.isclass(value)]


@QUESTIONS
def test_cases_are_the_seeds_and_hold_what_is_claimed(name):
    """The same seed gives the same cases; the reference alters nothing; every property holds."""
    question = find(name)
    first, again, other = (expected_cases(question, seed) for seed in (3, 3, 4))
    assert all(same(a.args, b.args) and same(a.expected, b.expected) for a, b in zip(first, again, strict=True))
    assert not all(same(a.args, b.args) for a, b in zip(first, other, strict=True))
    _, altered = outputs_of(question.reference, [case.args for case in first])
    assert not altered
    for case in (*first, *other):
        assert not isinstance(case.expected, Problem), case.expected
        for prop in question.properties:
            assert prop.holds(*case.args, case.expected), prop.says


def same(a, b) -> bool:
    """Whether two arguments or outputs are equal to the last bit."""
    if isinstance(a, tuple | list):
        return len(a) == len(b) and all(map(same, a, b))
    return np.array_equal(a, b, equal_nan=np.asarray(a).dtype.kind in "fc")


@QUESTIONS
def test_right_answers_pass(name):
    assert not trial(name).false_rejects


@QUESTIONS
def test_wrong_answers_lose(name):
    assert not trial(name).false_accepts


@QUESTIONS
def test_misconceptions_earn_their_own_hints(name):
    """And none is wrong by a hair: they lose with a hundred times the tolerance, too."""
    earn_their_own_hints(find(name), CHECKS)


def earn_their_own_hints(question: Question, seeds: tuple[int, ...]) -> None:
    """Fail for a misconception that does not, under some seed."""
    lenient = replace(question, rtol=100 * question.rtol, atol=100 * question.atol)
    for misconception in question.misconceptions:
        for seed in seeds:
            found = judged(question, misconception.answer, seed)
            assert found.sentence == Sentence("misconception", misconception.hint), (misconception.name, seed, found)
        assert not passes(lenient, misconception.answer, cases_of(question, seeds[0])), misconception.name


def shares(n):
    """Divide each row by its sum."""
    return n / n.sum(axis=1, keepdims=True)


def test_weak_cases_let_mutants_through_and_are_found_out():
    """The net catches what it should: symmetric counts do not tell rows from columns, general ones do."""
    by_row = Question(name="00_test.shares", reference=shares, inputs=lambda rng: (rng.random((3, 4)),))
    found = grade(by_row, seeds=SEEDS, search=AT_NIGHT)
    assert (found.right, found.false_rejects, found.false_accepts) == (1, (), ())
    assert not any("1 -> 0" in name for name in found.equivalent)
    symmetric = replace(by_row, inputs=lambda rng: (np.full((3, 3), rng.integers(3)) + np.eye(3),))
    assert any("1 -> 0" in name for name in grade(symmetric, seeds=SEEDS, search=AT_NIGHT).equivalent)
    rarely = replace(by_row, inputs=lambda rng: (np.eye(3) + (rng.random() < 0.05) * np.arange(9).reshape(3, 3),))
    assert any("1 -> 0" in name for name in grade(rarely, seeds=SEEDS, search=AT_NIGHT).false_accepts)


@pytest.mark.nightly
@QUESTIONS
def test_misconceptions_earn_their_own_hints_under_other_seeds(name):
    earn_their_own_hints(find(name), SEEDS[1:])


@pytest.mark.nightly
def test_error_rates_over_all_questions(capsys):
    """The two rates that a grade stands on, under several seeds, printed and bounded."""
    trials = {name: grade(find(name), alternatives(find(name)), SEEDS, AT_NIGHT) for name in names()}
    accepts = sum(len(t.false_accepts) for t in trials.values())
    rejects = sum(len(t.false_rejects) for t in trials.values())
    wrong, right = sum(t.wrong for t in trials.values()), sum(t.right for t in trials.values())
    with capsys.disabled():
        print(f"\n{len(trials)} questions, seeds {SEEDS}:")
        print(f"false accepts {accepts} of {wrong} wrong answers, false rejects {rejects} of {right} right answers")
        for name, t in trials.items():
            for mutant in t.equivalent:
                print(f"  {name} equivalent: {mutant}")
    assert accepts == 0 and rejects == 0
    assert wrong > 30 * len(trials) and right >= 3 * len(trials)
