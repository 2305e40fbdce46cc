"""A simulated phone's photographs: the same for one seed, and a sheet in them that tells where each was taken."""

import numpy as np
import pytest

from data_gen.phone import SIZE, photograph
from labkit.geometry import invert_transform
from labkit.geometry.sweep import view_of_sheet


@pytest.fixture(scope="module")
def shots():
    return photograph(700_001, count=2)


def test_the_sheet_tells_where_each_was_taken(shots):
    for picture, T in zip(shots.pictures, shots.T_base_cam, strict=True):
        view = view_of_sheet(picture, shots.K, shots.distortion)
        off = invert_transform(invert_transform(shots.T_base_sheet) @ T) @ view.T_base_cam
        assert picture.shape == (SIZE[1], SIZE[0], 3) and view.rgb.shape == (480, 640, 3)
        assert np.linalg.norm(off[:3, 3]) < 0.004 and np.trace(off[:3, :3]) > 3.0 - 1e-4
    assert (shots.frame.instances > 0).any() and shots.frame.size == (640, 480)


def test_one_seed_gives_the_same_bytes_and_no_two_photographs_the_same_exposure(shots):
    again = photograph(700_001, count=1)
    assert np.array_equal(again.pictures[0], shots.pictures[0])
    assert abs(shots.pictures[0].mean() - shots.pictures[1].mean()) > 0.5


def test_a_thing_is_pushed_for_one_photograph_alone(shots):
    moved = photograph(700_001, count=2, moved=0)
    assert (np.abs(moved.pictures[0].astype(int) - shots.pictures[0]) > 40).mean() > 0.002
    assert np.array_equal(moved.frame.instances, shots.frame.instances)
    assert np.abs(moved.pictures[1].astype(int) - shots.pictures[1]).mean() < 0.5
