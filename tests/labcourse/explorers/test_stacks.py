"""The explorers of topic 09: what the controls change, and that the pictures show what the numbers say."""

import numpy as np
import pytest
from scenes import random_frame

from labcourse.explorers import stacks
from labcourse.stacks.threshold import HSVRange, hsv_mask
from labgrader.course import find
from labkit.labels import overlay
from labkit.learning.engines import labels_of_scores


@pytest.fixture
def frame():
    masks = {name: random_frame(seed, (24, 36)).labels for seed, name in enumerate("abc")}
    return random_frame(3, (24, 36)).rgb, masks


def test_the_wipe_shows_one_stack_at_each_side(frame):
    rgb, masks = frame
    (axes,) = stacks.wipe(rgb, masks, masks["a"]).figure(at=10, right="c").axes
    picture = np.asarray(axes.images[0].get_array())
    np.testing.assert_array_equal(picture[:, :10], overlay(rgb, masks["a"], 0.65)[:, :10])
    np.testing.assert_array_equal(picture[:, 10:], overlay(rgb, masks["c"], 0.65)[:, 10:])
    both = np.sum((masks["a"] == 2) & (masks["c"] == 2)) / np.sum((masks["a"] == 2) | (masks["c"] == 2))
    assert axes.get_title().startswith(f"a 1.00   |   {both:.2f} c")


@pytest.mark.parametrize("first, last", [(20, 90), (150, 30)])
def test_the_range_darkens_what_is_outside_and_scores_the_rest(frame, first, last):
    rgb, masks = frame
    table = masks["a"] == 1
    explorer = stacks.colour_range(rgb, table)
    picture, hues = explorer.figure(first=first, last=last, saturation=30, value=(40, 230)).axes
    inside = hsv_mask(rgb, HSVRange((first, 30, 40), (last, 255, 230)))
    np.testing.assert_array_equal(np.asarray(picture.images[0].get_array())[inside], rgb[inside])
    assert picture.get_title().endswith(f"{np.sum(inside & table) / np.sum(inside | table):.3f}")
    marked = sum(patch.get_width() for patch in hues.patches)
    assert marked == (last - first + 1 if first <= last else 180 - first + last + 1)


def test_addresses_are_those_of_numpys_memory():
    x = np.random.default_rng(1).normal(size=(3, 4, 5))
    for v, u in ((0, 0), (3, 1), (2, 4)):
        np.testing.assert_array_equal(x.ravel()[stacks.addresses(3, 4, 5, v, u, "NCHW")], x[:, v, u])
        nhwc = np.ascontiguousarray(x.transpose(1, 2, 0)).ravel()
        np.testing.assert_array_equal(nhwc[stacks.addresses(3, 4, 5, v, u, "NHWC")], x[:, v, u])


@pytest.mark.parametrize("block, step", [(1, 16), (2, 32), (4, 48), (8, 80)])
def test_an_engines_buffer_holds_the_scores_where_it_says(block, step):
    scores = np.random.default_rng(2).permutation(3 * 4 * 5).reshape(3, 4, 5) / 4.0
    buffer, found = stacks.engine_buffer(scores, block, 16)
    assert found == step and len(buffer) == -(-3 // block) * 4 * step
    for c, v, u in np.ndindex(3, 4, 5):
        at = (c // block * 4 + v) * step + 2 * (u * block + c % block)
        assert buffer[at : at + 2].view("<f2")[0] == scores[c, v, u]
    labels = find("09_other_stacks.labels_of_buffer").reference(buffer, 3, 4, 5, block, step)
    np.testing.assert_array_equal(labels, labels_of_scores(scores[None]))


def test_the_right_layout_gives_the_right_label_and_the_other_does_not():
    scores = np.array([[[9, 1, 1], [1, 1, 1]], [[2, 8, 2], [2, 7, 2]], [[3, 3, 6], [5, 3, 4]]], float)
    labels = labels_of_scores(scores[None])
    explorer = stacks.memory(scores)
    wrong = 0
    for v in range(2):
        for u in range(3):
            (axes,) = explorer.figure(v=v, u=u, layout="NCHW").axes
            assert axes.get_title().endswith(f"label {labels[v, u]}")
            (axes,) = explorer.figure(v=v, u=u, layout="NHWC").axes
            wrong += not axes.get_title().endswith(f"label {labels[v, u]}")
            assert sum(patch.get_linewidth() == 3 for patch in axes.patches) == 3
    assert wrong >= 3
