"""The explorers of topic 01: what a resize invents, and what the bits of a mask say."""

import numpy as np
import pytest

from labcourse.explorers import labels as widgets


def scene():
    """A table (1) with an obstacle (3) and a target (2) on it, before the background (0)."""
    y = np.zeros((48, 64), np.uint8)
    y[16:] = 1
    y[24:36, 10:24] = 3
    y[26:34, 40:50] = 2
    return y


@pytest.mark.parametrize("size", [(36, 48), (70, 100), (31, 90), (48, 64)])
def test_nearest_invents_nothing(size):
    resized = widgets.resize_nearest(scene(), *size)
    assert not widgets.ghosts(scene(), resized).any()
    assert set(np.unique(resized)) <= {0, 1, 2, 3}


def test_bilinear_dreams_targets_round_an_obstacle():
    y = scene()
    y[y == 2] = 1
    resized = widgets.resize_bilinear(y, 96, 128)
    ghost = widgets.ghosts(y, resized)
    assert np.count_nonzero(resized == 2) > 50 and ghost[resized == 2].all()
    v, u = np.argwhere(ghost).T / 2.0
    assert (v > 22).all() and (v < 37).all() and (u > 8).all() and (u < 25).all()  # only at the obstacle's rim


def test_ghosts_are_the_classes_that_no_neighbour_has():
    """By definition: a resized pixel lies between at most four old ones."""
    y = np.random.default_rng(0).integers(0, 4, (6, 8)).astype(np.uint8)
    resized = widgets.resize_bilinear(y, 9, 20)
    ghost = widgets.ghosts(y, resized)
    for (i, j), label in np.ndenumerate(resized):
        v, u = (i + 0.5) * 6 / 9 - 0.5, (j + 0.5) * 8 / 20 - 0.5
        rows = np.clip([np.floor(v), np.ceil(v)], 0, 5).astype(int)
        columns = np.clip([np.floor(u), np.ceil(u)], 0, 7).astype(int)
        assert ghost[i, j] == (label not in y[np.ix_(rows, columns)])
    assert 0 < np.count_nonzero(ghost) < ghost.size


def test_the_bits_add_up_to_the_value():
    (axes,) = widgets.segmentation_bits().figure(body=37, link=8).axes
    bits = [text.get_text() for text in axes.texts if text.get_text() in "01"]
    value = sum(int(bit) << place for place, bit in enumerate(bits))
    assert len(bits) == 32 and value == widgets.segmentation_value(37, 8)
    assert value & 0xFFFFFF == 37 and (value >> 24) - 1 == 8
