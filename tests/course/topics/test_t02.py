"""Each reference of topic 02 gives what the kit gives; where the kit has no such function, its solvers judge."""

import re

import numpy as np
from notebooks import ROOT, notebook

from labkit.course.topics import of_topic, t02_crf
from labkit.crf import PottsCRF, solve, unary_from_probabilities

SEEDS = range(5)
QUESTIONS = of_topic("02_crf")
right = {name: question.reference for name, question in QUESTIONS.items()}


def test_costs_are_the_kits():
    p, floor = QUESTIONS["unary_from_probabilities"].inputs(np.random.default_rng(1))
    assert np.allclose(right["unary_from_probabilities"](p, floor), unary_from_probabilities(p, floor), atol=1e-12)


def test_weights_are_the_kits():
    image, *settings = QUESTIONS["pair_weights"].inputs(np.random.default_rng(1))
    kit = PottsCRF.from_image(np.zeros((*image.shape[:2], 2)), image, *settings, connectivity=8)
    assert np.allclose(right["pair_weights"](image, *settings), kit.weights)


def test_energy_and_a_pixels_costs_are_the_kits():
    for seed in SEEDS:
        y, psi, weights = t02_crf.labelled_model(np.random.default_rng(seed))
        kit = PottsCRF(psi, weights)
        assert np.isclose(right["energy"](y, psi, weights), kit.energy(y))
        for v, u in ((0, 0), (1, 3), (3, 5), (2, 0)):
            changed = [np.where(np.arange(y.size).reshape(y.shape) == v * y.shape[1] + u, c, y) for c in range(3)]
            costs = right["icm_costs"](y, psi, weights, v, u)
            assert np.allclose(np.diff(costs), np.diff([kit.energy(labels) for labels in changed]))


def test_capacities_and_a_rows_labels_solve_their_problems():
    for seed in SEEDS:
        psi, w = QUESTIONS["row_labels"].inputs(np.random.default_rng(seed))
        row = PottsCRF(psi[None], np.stack([np.append(w, 0.0)[None], np.zeros((1, len(psi)))]))
        assert np.array_equal(right["row_labels"](psi, w), solve(row, "brute_force").labels[0])
        source, sink, constant = right["terminal_capacities"](psi[None, :, :2])
        for label, arc in ((1, source), (0, sink)):
            assert np.allclose(arc.sum() + constant, psi[:, label].sum())


def test_the_labs_open_task_leaves_something_to_win():
    """As the solution shows it: ICM, which is to be beaten, stops well above the bound."""
    cells = notebook(ROOT / "solutions/02_crf/02_crf.ipynb").cells
    table = next(cell.outputs[-1].data["text/plain"] for cell in cells if 'score("ICM"' in cell.source)
    assert float(re.search(r"ICM +([\d.]+)% above", table)[1]) > 5.0
