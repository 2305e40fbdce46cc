import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from labkit.labels import CLASSES, IGNORE, PALETTE, TARGET, colorize, from_one_hot, one_hot, overlay

labels = hnp.arrays(
    st.sampled_from([np.uint8, np.int32, np.int64]),
    hnp.array_shapes(min_dims=1, max_dims=3, max_side=6),
    elements=st.sampled_from([0, 1, 2, 3, IGNORE]),
)


@given(labels)
def test_one_hot_and_back_is_the_identity(y):
    assert np.array_equal(from_one_hot(one_hot(y)), y)


@given(labels)
def test_one_hot_has_a_single_one_at_the_label_and_none_where_ignored(y):
    Y = one_hot(y)
    for index, label in np.ndenumerate(y):
        expected = [int(label == c) for c in range(len(CLASSES))]
        assert Y[index].tolist() == expected


def test_colorize_gives_each_class_its_own_colour():
    y = np.array([[0, 1, 2, 3, IGNORE]])
    assert len(np.unique(colorize(y)[0], axis=0)) == 5
    assert colorize(y)[0, TARGET].tolist() == PALETTE[TARGET].tolist()


def test_overlay_leaves_background_and_mixes_the_rest():
    rgb = np.full((1, 2, 3), 200, np.uint8)
    mixed = overlay(rgb, np.array([[0, TARGET]]), alpha=1.0)
    assert mixed[0, 0].tolist() == [200, 200, 200]
    assert mixed[0, 1].tolist() == PALETTE[TARGET].tolist()


@pytest.mark.bad_input
@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda: one_hot(np.array([4])), "y"),
        (lambda: one_hot(np.array([-1])), "y"),
        (lambda: one_hot(np.array([0.0])), "y"),
        (lambda: from_one_hot(np.array([[1, 1]])), "Y"),
        (lambda: from_one_hot(np.array([[0.5, 0.5]])), "Y"),
        (lambda: from_one_hot(np.zeros((2, 0))), "Y"),
        (lambda: colorize(np.zeros((2, 2, 2), int)), "y"),
        (lambda: overlay(np.zeros((2, 2, 3), np.uint8), np.zeros((3, 2), int)), "y"),
        (lambda: overlay(np.zeros((2, 2, 3), np.uint8), np.zeros((2, 2), int), alpha=2.0), "alpha"),
        (lambda: overlay(np.zeros((2, 2, 3)), np.zeros((2, 2), int)), "rgb"),
    ],
)
def test_wrong_arguments_are_named(call, name):
    with pytest.raises(ValueError, match=rf"^{name}:"):
        call()
