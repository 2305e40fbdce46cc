"""Each reference of topic 02 gives what the kit gives; where the kit has no such function, its solvers judge."""

import numpy as np
import pytest

from labkit.course.questions import t02_crf as questions
from labkit.course.questions.question import find, of_topic
from labkit.course.questions.run import judge
from labkit.crf import PottsCRF, solve, unary_from_probabilities
from labkit.crf.exact import grid_max_flow

SEEDS = range(5)


def model(seed: int, C: int = 3):
    """A small random model as arrays of the questions' shapes, and the same as the kit's."""
    psi, w_right, w_down = questions._model(np.random.default_rng(seed), 3, 4, C)
    return psi, w_right, w_down, as_crf(psi, w_right, w_down)


def as_crf(psi, w_right, w_down) -> PottsCRF:
    return PottsCRF(psi, np.stack([np.pad(w_right, ((0, 0), (0, 1))), np.pad(w_down, ((0, 1), (0, 0)))]))


def test_costs_are_the_kits():
    p, floor = questions.UNARY.inputs(np.random.default_rng(1))
    assert np.allclose(questions.unary_from_probabilities(p, floor), unary_from_probabilities(p, floor), atol=1e-12)


@pytest.mark.parametrize("seed", SEEDS)
def test_weights_are_the_kits(seed):
    image, lam, sigma_I, sigma_p = questions.WEIGHTS.inputs(np.random.default_rng(seed))
    crf = PottsCRF.from_image(np.zeros((*image.shape[:2], 2)), image, lam, sigma_I, sigma_p)
    w = questions.right_weights(image, lam, sigma_I, sigma_p)
    assert np.allclose(w, crf.weights[0][:, :-1], rtol=1e-12)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_energy_is_the_kits(seed):
    y, *parts = questions.ENERGY.inputs(np.random.default_rng(seed))
    assert questions.energy(y, *parts) == pytest.approx(as_crf(*parts).energy(y), rel=1e-12)


@pytest.mark.parametrize("seed", SEEDS)
def test_icm_steps_that_follow_the_costs_end_where_the_kits_icm_ends(seed):
    psi, w_right, w_down, crf = model(seed)
    y = psi.argmin(axis=2)
    for _ in range(20):
        for v, u in np.ndindex(*y.shape):
            y[v, u] = questions.icm_costs(y, psi, w_right, w_down, v, u).argmin()
    assert np.array_equal(y, solve(crf, "icm").labels)


@pytest.mark.parametrize("seed", SEEDS)
def test_costs_of_two_classes_differ_by_the_change_of_the_energy(seed):
    y, *parts, v, u = questions.ICM.inputs(np.random.default_rng(seed))
    costs, energies = questions.icm_costs(y, *parts, v, u), []
    for c in range(3):
        y[v, u] = c
        energies.append(as_crf(*parts).energy(y))
    assert np.allclose(np.diff(costs), np.diff(energies))


@pytest.mark.parametrize("seed", SEEDS)
def test_a_cut_of_these_capacities_and_the_constant_are_the_least_energy(seed):
    psi, _, _, crf = model(seed, C=2)
    source, sink, constant = questions.terminal_capacities(psi)
    integer = np.round((source - sink) * 2**20).astype(np.int64), np.round(crf.weights * 2**20).astype(np.int64)
    flow, source_side = grid_max_flow(*integer, crf.offsets)
    best = solve(crf, "brute_force")
    assert flow / 2**20 + constant == pytest.approx(best.energy, abs=1e-4)
    assert np.array_equal(source_side == 0, best.labels == 1)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_rows_bound_is_exact_without_columns_and_below_the_optimum_with_them(seed):
    psi, w_right, w_down, crf = model(seed)
    bound = questions.row_bound(psi, w_right)
    assert bound == pytest.approx(solve(as_crf(psi, w_right, 0.0 * w_down), "brute_force").energy, rel=1e-12)
    assert bound <= solve(crf, "brute_force").energy + 1e-12


@pytest.mark.parametrize("question", questions.QUESTIONS, ids=lambda question: question.function)
def test_wrong_answers_fail_with_their_own_hint_and_right_ones_pass(question):
    assert find(question.name) is question and of_topic("02_crf")[question.function] is question
    for misconception in question.misconceptions:
        verdict = judge(question, misconception.answer, seed=7)
        assert not verdict.passed and verdict.hint == misconception.hint, misconception.name
    for alternative in question.alternatives:
        assert judge(question, alternative, seed=7).passed, alternative.__name__
