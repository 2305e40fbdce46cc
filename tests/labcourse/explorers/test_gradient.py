"""The explorers of 03_gradient: what they draw follows their controls, and is what the formulas say."""

import numpy as np
import pytest

from labcourse.explorers import gradient


def heights(axes, legend):
    """Heights of the bars of one series."""
    (bars,) = [container for container in axes.containers if container.get_label() == legend]
    return np.array([bar.get_height() for bar in bars])


def test_the_bars_are_p_and_y_and_their_difference():
    explorer = gradient.logits(z=(2.0, 1.0, -1.0), y=1)
    left, right = explorer.figure().axes
    p, y = heights(left, "p = softmax(z)"), heights(left, "y, one-hot")
    np.testing.assert_allclose(p, np.exp([2.0, 1.0, -1.0]) / np.exp([2.0, 1.0, -1.0]).sum())
    assert y.tolist() == [0, 1, 0]
    np.testing.assert_allclose(heights(right, "p - y"), p - y)
    np.testing.assert_allclose(heights(right, "differences, h = 1e-05"), p - y, atol=1e-8)
    assert left.get_title() == "loss = -log p[1] = 1.349"


def test_a_step_that_is_too_small_or_too_large_spoils_the_differences():
    explorer = gradient.logits()
    errors = {}
    for h in (1e-16, 1e-5, 1.0):
        _, right = explorer.figure(h=h).axes
        series = [heights(right, container.get_label()) for container in right.containers]
        errors[h] = np.abs(series[0] - series[1]).max()
    assert errors[1e-5] < 1e-8 and errors[1e-16] > 1e-2 and errors[1.0] > 1e-2


@pytest.fixture
def scene():
    rng = np.random.default_rng(0)
    rgb = rng.integers(0, 256, (30, 41, 3)).astype(np.uint8)
    y = np.zeros((30, 41), np.uint8)
    y[10:20, 12:30] = 2
    y[0, 0] = 255
    return rgb, y


@pytest.mark.parametrize("width", [1, 4, 7, 18])
@pytest.mark.parametrize(("u", "v"), [(0, 0), (15, 12), (40, 29), (3, 28)])
def test_the_keyhole_shows_exactly_the_pixels_round_the_pixel(scene, u, v, width):
    rgb, _ = scene
    patch, (left, top) = gradient.seen(rgb, u, v, width)
    before, after = width // 2, width - width // 2
    columns, rows = (
        np.array([i for i in range(length) if -before <= i - place < after]) for length, place in ((41, u), (30, v))
    )
    assert (left, top) == (columns[0], rows[0])
    np.testing.assert_array_equal(patch, rgb[np.ix_(rows, columns)])


def test_the_keyhole_names_the_class_only_when_it_is_asked(scene):
    explorer = gradient.keyhole(*scene, at=(15, 12), widths=(5, 18))
    assert "target" not in explorer.figure().axes[1].get_title()
    for at, label in (({}, "target"), ({"u": 2}, "background"), ({"u": 0, "v": 0}, "ignore")):
        assert explorer.figure(reveal=True, **at).axes[1].get_title() == f"true class: {label}"
    assert explorer.figure(u=0, v=0, width=18).axes[0].images[0].get_array().shape == (9, 9, 3)
