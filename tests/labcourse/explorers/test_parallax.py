"""The explorer of topic 06, parallax: at the right height two photographs agree, and white agrees everywhere."""

import numpy as np
import pytest

from labcourse.explorers import parallax as widgets
from labkit.geometry import back_project_to_base


@pytest.fixture(scope="module")
def photographs():
    return widgets.two_photographs()


@pytest.fixture(scope="module")
def height(photographs):
    first = photographs[0]
    return back_project_to_base(first.depth, first.K, first.T_base_cam)[..., 2]


def test_painted_at_its_height_a_surface_agrees_and_at_another_it_does_not(photographs, height):
    own = widgets.grey(photographs[0])
    for level, others in ((0.0, (0.06,)), (widgets.PRINTED, (0.0, 0.1))):
        there = np.abs(height - level) < 0.001
        there[:, :20] = there[:, -60:] = False  # what the other one does not show
        right = np.nanmedian(np.abs(widgets.painted_by(*photographs, level) - own)[there])
        wrong = [np.nanmean(np.abs(widgets.painted_by(*photographs, other) - own)[there]) for other in others]
        assert right < 1.0 < min(wrong)


def test_the_cost_is_least_at_the_height_where_there_is_a_print_and_flat_where_there_is_none(photographs, height):
    heights = np.arange(-0.02, 0.161, 0.002)
    printed = widgets.cost_over_height(*photographs, (100, 100), heights)
    assert abs(heights[printed.argmin()] - height[100, 100]) < 0.003 and printed.max() > 20.0 * printed.min()
    plain = widgets.cost_over_height(*photographs, (210, 100), heights)
    assert height[100, 210] == pytest.approx(widgets.PLAIN, abs=1e-3) and plain.max() < 0.1


def test_a_window_that_the_other_photograph_does_not_show_whole_has_no_cost(photographs):
    painted, cost = widgets.painted_by(*photographs, 0.0), widgets.cost_image(*photographs, 0.0)
    assert np.isnan(painted).any() and np.isnan(cost[np.isnan(painted)]).all()
    assert np.isnan(cost).sum() > np.isnan(painted).sum()
    v, u = np.argwhere(~np.isnan(cost))[1000]
    window = np.s_[v - 4 : v + 5, u - 4 : u + 5]
    own = widgets.grey(photographs[0])
    assert cost[v, u] == pytest.approx(np.abs(painted - own)[window].mean(), rel=1e-4)


def test_the_explorer_is_black_where_the_height_is_right(photographs, height):
    explorer = widgets.try_a_height(*photographs, 0.0)
    printed = np.abs(height - widgets.PRINTED) < 0.001
    shown = {mm: explorer.figure(height=mm).axes[2].images[0].get_array()[printed].mean() for mm in (0, 60, 100)}
    assert shown[60] < 0.3 * shown[0] and shown[60] < 0.3 * shown[100]
