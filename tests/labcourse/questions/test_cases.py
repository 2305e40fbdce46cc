"""Cases are sharp enough: what is useless in the lab is not ticked, nor what knows only the cases that a check shows.

The nightly searches draw arguments from the space that a statement allows, wider than `inputs` does, and look for some
on which an answer that passes differs from the reference. What they find becomes a case of its question.
"""

import copy
import json
import pickle
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from labgrader.comparison import Problem, compare, expected_cases, trusted
from labgrader.course import find, of_topic, topics
from labgrader.grade.grade import secret_cases
from labgrader.program.live import LiveProgram
from labgrader.program.slice import Program
from labgrader.reply.judge import judge, output_of
from labgrader.run import subprocess_worker
from labgrader.run.run import Limits, Run, public_cases

pytestmark = pytest.mark.bad_input  # as outside the suite
DATA = Path(__file__).parents[2] / "data"
GIVEN = [
    (answer["question"], answer["source"])
    for name in ("right", "refused", "answers")
    for answer in json.loads((DATA / f"{name}.json").read_text())
]
NAMES = [question.name for topic in topics() for question in of_topic(topic).values()]


def pieces(name: str, source: str) -> tuple[tuple[str, str], ...]:
    """The program of an answer, as a check cuts it."""
    return ("quiet", "import numpy as np"), (find(name).function, source)


# ----------------------------------------------------------------------------- right, and useless in the lab

ALL_LABELLINGS = """
import itertools

def row_labels(psi, w):
    def energy(y):
        return psi[np.arange(len(y)), y].sum() + w[np.diff(y) != 0].sum()

    rows = map(np.array, itertools.product(range(psi.shape[1]), repeat=len(psi)))
    return min(rows, key=energy)
"""
ONE_LOGIT_AFTER_THE_OTHER = """
def cross_entropy_grad(z, y, s):
    def loss(z):
        log_p = z - np.logaddexp.reduce(z, axis=-1, keepdims=True)
        t = (1 - s) * (y[..., None] == np.arange(z.shape[-1])) + s / z.shape[-1]
        return -(t * log_p)[y != 255].sum()

    grad, z, h = np.zeros(z.shape), z.copy(), 1e-5
    for place in np.ndindex(z.shape):
        old = z[place]
        z[place] = old + h
        above = loss(z)
        z[place] = old - h
        grad[place] = (above - loss(z)) / (2 * h)
        z[place] = old
    return grad
"""


@pytest.mark.parametrize(
    "name, source",
    [("02_crf.row_labels", ALL_LABELLINGS), ("03_gradient.cross_entropy_grad", ONE_LOGIT_AFTER_THE_OTHER)],
)
def test_what_the_lab_could_not_run_with_is_not_done_in_time(name, source):
    """Right on each small case; the one of the lab's size takes longer than a case may."""
    question = find(name)
    with Run(question, Program(pieces(name, source)), subprocess_worker.fresh_worker, Limits(case_s=2.0)) as run:
        verdict, _ = run.judge(expected_cases(question, 0))
    assert verdict.problem.kind == "time" and len(expected_cases(question, 0)[verdict.case].args[0]) > 100


# ----------------------------------------------------------- wrong, with a table of the cases that a check shows


# Wrong for one argument alone, no turn: with that one in a table it is a right answer.
RIGHT_WITH_A_TABLE = ("largest of x y z",)


@pytest.mark.nightly
@pytest.mark.parametrize("name", NAMES)
def test_a_wrong_answer_that_knows_the_public_cases_passes_in_a_draw_of_a_hundred_at_most(name):
    """Each secret case is drawn alone: what is right in a share p of them is right in all n by chance p ** n."""
    question, rng, drawn = find(name), np.random.default_rng(1), 400
    table = {pickle.dumps(case.args) for case in public_cases(question)}
    cases = [(args, trusted(question.reference, args)) for args in question.draws(rng, drawn)]
    new = [case for case in cases if pickle.dumps(case[0]) not in table]
    n = len(secret_cases(question, "secret", "student"))
    often = {}
    for mistake in (m for m in question.misconceptions if m.name not in RIGHT_WITH_A_TABLE):
        known = drawn - len(new) + sum(right(question, mistake.answer, *case) for case in new)
        if (known / drawn) ** n > 0.01:
            often[mistake.name] = known / drawn
    assert not often


def right(question, answer, args, expected) -> bool:
    """Whether an answer is right in a case."""
    got = output_of(answer, copy.deepcopy(args))
    return not isinstance(got, Problem) and compare(question, expected, got) is None


# --------------------------------------------------------------------------------- a search over what is allowed

sides, seeds = st.integers(1, 12), st.integers(0, 2**32 - 1)
sizes = st.integers(1, 700)


@st.composite
def label_images(draw, classes=255):
    """Labels (H, W), any of 0 .. classes - 1, and 255."""
    rng, H, W = np.random.default_rng(draw(seeds)), draw(sides), draw(sides)
    few = rng.choice(classes, size=draw(st.integers(1, 4)))
    y = rng.choice(few, size=(H, W))
    return np.where(rng.random((H, W)) < draw(st.sampled_from([0.0, 0.2, 0.9])), 255, y).astype(np.uint8)


@st.composite
def logits(draw, C):
    """Logits (N, C) of any size, single ones far off."""
    rng = np.random.default_rng(draw(seeds))
    z = rng.normal(size=(draw(sides), C)) * draw(st.sampled_from([0.0, 1.0, 30.0]))
    return z + draw(st.sampled_from([0.0, 1000.0, -3000.0])) * (rng.random(z.shape) < 0.3)


@st.composite
def shares(draw, C):
    """Shares (C,) above 0 that sum to 1, some of them small."""
    rng = np.random.default_rng(draw(seeds))
    s = np.exp(rng.uniform(draw(st.sampled_from([-1.0, -12.0])), 0.0, C))
    return s / s.sum()


@st.composite
def resized(draw):
    """A label image and another size, of a column or a row."""
    old, new = draw(sizes), draw(sizes)
    y = (np.arange(old) % 251).astype(np.uint8)
    return (y[:, None], new, 1) if draw(st.booleans()) else (y[None], 1, new)


@st.composite
def coloured(draw):
    """A picture and a palette; single channels, and all small or large numbers among them."""
    rng = np.random.default_rng(draw(seeds))
    some = rng.choice(draw(st.sampled_from([[0, 1, 255], [0, 1, 11, 34], list(range(256))])), (draw(sides) + 8, 3))
    some = np.unique(some, axis=0).astype(np.uint8)
    rng.shuffle(some)
    return rng.choice(some, (3, 7)), some[: draw(st.integers(1, len(some)))]


@st.composite
def masks(draw):
    """A raw mask of bodies up to a million, and the table of their parts."""
    rng, bodies, parts = np.random.default_rng(draw(seeds)), draw(st.integers(1, 10**6)), draw(st.integers(1, 4))
    body, part = rng.integers(0, bodies, (3, 5)), rng.integers(0, parts, (3, 5))
    raw = np.where(rng.random((3, 5)) < 0.2, -1, body + (part << 24))
    return raw.astype(np.int32), rng.integers(0, 4, (bodies, parts), np.uint8)


@st.composite
def adjusted(draw):
    """Logits, labels, shares and a tau."""
    C = draw(st.integers(2, 5))
    z = draw(logits(C))
    y = np.random.default_rng(draw(seeds)).choice([*range(C), 255], len(z)).astype(np.uint8)
    return z, y, draw(shares(C)), draw(st.one_of(st.just(0.0), st.floats(0.1, 2000.0)))


@st.composite
def depths(draw):
    """Depths of any size above 0, holes, a camera, and either kind of distance."""
    rng = np.random.default_rng(draw(seeds))
    depth = np.exp(rng.uniform(np.log(1e-3), np.log(65.0), (draw(sides), draw(sides))))
    depth = np.where(rng.random(depth.shape) < 0.2, rng.choice([0.0, np.nan]), depth)
    return depth, camera(draw), draw(st.booleans())


def camera(draw) -> np.ndarray:
    """K with unequal focal lengths from 2 to 4000 pixels."""
    fx, fy = (draw(st.sampled_from([2.0, 150.0, 1000.0, 4000.0])) * draw(st.floats(0.8, 1.0)) for _ in range(2))
    return np.array([[fx, 0.0, draw(st.floats(0.0, fx))], [0.0, fy, draw(st.floats(0.0, fy))], [0.0, 0.0, 1.0]])


@st.composite
def seen(draw):
    """Pixels through a lens, of rays up to r = 0.9."""
    K, k = camera(draw), np.array([draw(st.floats(-0.3, 0.4)), draw(st.floats(0.0, 0.1))])
    rng = np.random.default_rng(draw(seeds))
    r, angle = 0.9 * np.sqrt(rng.random(9)), rng.uniform(0.0, 2.0 * np.pi, 9)
    r = (r * (1.0 + k[0] * r**2 + k[1] * r**4))[:, None]
    return K[:2, 2] + np.diagonal(K)[:2] * r * np.stack([np.cos(angle), np.sin(angle)], axis=1), K, k


@st.composite
def recalls(draw):
    """Probabilities, which are of class 1, and a share of these that is no whole number of them."""
    rng, n = np.random.default_rng(draw(seeds)), draw(st.integers(1, 30))
    q1 = 1.0 / (1.0 + np.exp(-rng.normal(0.0, draw(st.sampled_from([1.0, 4.0])), n + 5)))
    recall = (draw(st.integers(0, n - 1)) + draw(st.floats(0.1, 0.9))) / n
    return q1, rng.permutation(np.arange(n + 5) < n), draw(st.sampled_from([1.0, recall]))


@st.composite
def softmaxes(draw):
    """Logits, and which classes are possible, at least one."""
    C = draw(st.integers(1, 5))
    possible = np.random.default_rng(draw(seeds)).random(C) < 0.5
    possible[draw(st.integers(0, C - 1))] = True
    return draw(logits(C)), possible


SPACES = {
    "01_labels.resize_labels": resized(),
    "01_labels.labels_from_colours": coloured(),
    "01_labels.labels_from_segmentation": masks(),
    "01_labels.one_hot": st.tuples(label_images(9).map(lambda y: y[None]), st.just(9)),
    "01_labels.class_shares": st.tuples(label_images(9).map(lambda y: np.stack([y, y[::-1, ::-1]])), st.just(9)),
    "03_gradient.softmax": softmaxes(),
    "04_iou.trimap_band": st.tuples(label_images(), st.integers(1, 14)),
    "05_class_weights.adjusted_grad": adjusted(),
    "05_class_weights.weight_for_recall": recalls(),
    "06_back_projection.back_project": depths(),
    "06_back_projection.undistort": seen(),
    "09_other_stacks.enlarge": resized().map(lambda args: (args[0].astype(int), args[:0:-1])),
}


@pytest.mark.nightly
@pytest.mark.parametrize("name", SPACES)
def test_what_passes_is_right_wherever_the_statement_allows(name):
    """Answers of the data that a check ticks give what the reference gives; nothing is said of those that lose."""
    question = find(name)
    answers = [LiveProgram(question.function, pieces(*given)).answer for given in GIVEN if given[0] == name]
    answers = [answer for answer in answers if judge(question, answer, 0).passed]
    assert answers

    @settings(max_examples=100, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True)
    @given(SPACES[name])
    def same_everywhere(args):
        expected = trusted(question.reference, args)
        assert not isinstance(expected, Problem), expected
        for answer in answers:
            got = output_of(answer, copy.deepcopy(args))
            problem = got if isinstance(got, Problem) else compare(question, expected, got)
            assert problem is None, (answer.__code__.co_filename, problem)

    same_everywhere()
