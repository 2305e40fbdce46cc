"""The explorers of topic 02: what a change of a control does to the picture and to the numbers that it shows."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

from labcourse.explorers import crf as widgets
from labkit.crf import PottsCRF, solve

PSI = np.array([[[0.0, 2.0], [1.5, 0.5]], [[0.2, 1.0], [3.0, 0.1]]])


def titles(explorer) -> list[str]:
    """The titles of an explorer's picture."""
    return [axes.get_title() for axes in explorer.figure().axes]


def test_without_pairs_z_is_the_product_of_the_pixels_sums():
    explorer = widgets.gibbs(PSI)
    Z = np.exp(-PSI).sum(axis=2).prod()
    assert f"Z = {Z:.3f}" in titles(explorer)[0]
    assert explorer.figure(w=2.5).axes[0].get_title().startswith("w = 2.5")


def test_a_clicked_pixel_changes_the_energy_that_is_shown():
    explorer = widgets.you_are_the_solver()
    y = np.zeros((4, 5), np.uint8)
    assert titles(explorer)[0] == f"you: {widgets.toy_model(2.0).energy(y):.2f}"
    explorer.controls["pixel_2_1"].value = True
    y[2, 1] = 1
    assert titles(explorer)[0] == f"you: {widgets.toy_model(2.0).energy(y):.2f}"
    explorer.controls["lam"].value = 0.3
    assert titles(explorer)[0] == f"you: {widgets.toy_model(0.3).energy(y):.2f}"


def test_the_cut_that_is_revealed_is_the_least_energy_of_all_labellings():
    shown, least = widgets.you_are_the_solver().figure(reveal=True), solve(widgets.toy_model(2.0), "brute_force").energy
    assert shown.axes[1].get_title() == f"the cut: {least:.2f}"


@pytest.mark.parametrize("start", ["nothing", "network alone"])
def test_the_toy_has_dead_ends_for_single_clicks(start):
    """What the lesson asks its readers to find: no click helps, yet the cut is better, and it is the truth."""
    crf = widgets.toy_model(2.0)
    labels = np.zeros((4, 5), np.uint8) if start == "nothing" else crf.unary.argmin(axis=2)
    stuck, best = solve(crf, "icm", labels=labels), solve(crf, "min_cut")
    assert stuck.energy > best.energy + 0.5
    assert np.array_equal(best.labels == 1, widgets.TOY_IMAGE > 120)


@pytest.mark.parametrize("y", [(0, 0, 0), (0, 1, 1), (1, 0, 1), (1, 1, 1)])
def test_the_arcs_drawn_as_cut_add_up_to_the_energy(y):
    psi, w = np.array([[1.0, 4.0], [2.5, 0.5], [3.0, 0.25]]), np.array([0.75, 2.0])
    figure, axes = plt.subplots()
    widgets.draw_cut(axes, psi, w, np.array(y))
    crf = PottsCRF(psi[None], np.stack([np.append(w, 0.0)[None], np.zeros((1, 3))]))
    assert axes.get_title() == f"labels {' '.join(map(str, y))}: cut {crf.energy(np.array([y])):g}"
    plt.close(figure)
