"""Masks spoilt on purpose, against distances computed another way, and against counts."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import distance_transform_edt

from labcli import degrade


def blob():
    """A mask with a slanted side, a notch and a hole, and more to the right than to the left; read-only."""
    v, u = np.mgrid[:40, :56]
    mask = (v > 5) & (v < 33) & (u > 12) & (u + 0.4 * v < 52)
    mask[18:22, 12:20] = mask[14:17, 28:31] = False
    mask.setflags(write=False)
    return mask


@pytest.mark.parametrize("pixels", [0, 1, 2, 3, 5])
def test_dilate_adds_and_erode_removes_what_lies_within_a_distance(pixels):
    mask = blob()
    np.testing.assert_array_equal(degrade.dilate(mask, pixels), distance_transform_edt(~mask) <= pixels)
    np.testing.assert_array_equal(degrade.erode(mask, pixels), distance_transform_edt(mask) > pixels)


@given(right=st.integers(-60, 60), down=st.integers(-45, 45))
@settings(max_examples=40, deadline=None)
def test_shift_moves_each_pixel_and_loses_those_that_leave(right, down):
    mask = blob()
    moved = np.zeros_like(mask)
    for v, u in np.argwhere(mask):
        if 0 <= v + down < mask.shape[0] and 0 <= u + right < mask.shape[1]:
            moved[v + down, u + right] = True
    np.testing.assert_array_equal(degrade.shift(mask, right, down), moved)


@pytest.mark.parametrize("share", [0.0, 0.2, 0.5, 0.8, 1.0])
def test_holes_take_their_share_and_hardly_more(share):
    mask = blob()
    for seed in range(5):
        left = degrade.holes(mask, share, np.random.default_rng(seed))
        assert not (left & ~mask).any()
        lost = 1.0 - left.sum() / mask.sum()
        assert share <= lost <= share + 0.07
    same = [degrade.holes(mask, share, np.random.default_rng(3)) for _ in range(2)]
    np.testing.assert_array_equal(*same)


@pytest.mark.parametrize("direction", [0.0, 0.7, np.pi / 2, 3.0, 5.1])
def test_cut_loses_the_share_that_lies_furthest_in_the_direction(direction):
    mask = blob()
    before = mask
    for share in (0.0, 0.2, 0.4, 0.75, 1.0):
        left = degrade.cut(mask, share, direction)
        assert left.sum() == mask.sum() - round(share * mask.sum())
        assert not (left & ~before).any()  # a larger cut takes the smaller one with it
        before = left
        far = [v * np.sin(direction) + u * np.cos(direction) for v, u in np.argwhere(mask & ~left)]
        near = [v * np.sin(direction) + u * np.cos(direction) for v, u in np.argwhere(left)]
        assert not far or not near or max(near) <= min(far) + 1e-9
