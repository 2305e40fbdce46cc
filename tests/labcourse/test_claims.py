"""Sentences of lessons that speak of many cases, counted: what readers refuted once stands here with its number."""

from itertools import combinations

import cv2
import numpy as np
import pytest
import torch
from notebooks import ROOT

import data_gen
from labcli import mask_study
from labcourse.explorers.node import journeys
from labkit import losses
from labkit.frame import RGBDFrame
from labkit.geometry import back_projection_jacobian
from labkit.metrics import paired_difference


@pytest.mark.bad_input
def test_01_what_a_frame_refuses_and_what_it_cannot_see():
    """Millimetres and sizes are refused; BGR, a mirrored depth, another K and an inverted pose are frames as well."""
    frame = data_gen.render(data_gen.sample_scene(600_002, "test"), (160, 120))
    parts = {"rgb": frame.rgb, "depth": frame.depth, "K": frame.K, "T_base_cam": frame.T_base_cam}
    for wrong in ({"depth": 1000 * frame.depth}, {"depth": frame.depth[:-1]}):
        with pytest.raises(ValueError, match="depth"):
            RGBDFrame(**parts | wrong)
    larger = frame.K * [[2.0], [2.0], [1.0]]
    unseen = {"rgb": frame.rgb[..., ::-1].copy(), "depth": frame.depth[:, ::-1].copy(), "K": larger}
    for name, value in (unseen | {"T_base_cam": np.linalg.inv(frame.T_base_cam)}).items():
        RGBDFrame(**parts | {name: value})


def largest_share(y, size, names):
    """Resize the plane of each name bilinearly; the name with the largest share."""
    shares = [cv2.resize((y == name).astype(np.float32), size) for name in names]
    return np.asarray(names)[np.argmax(shares, axis=0)]


def test_01_a_pixel_that_nobody_judged_needs_a_plane_of_its_own():
    row = np.array([[255, 1]])
    assert largest_share(row, (4, 1), [1, 255]).tolist() == [[255, 255, 1, 1]]
    shares = cv2.resize((row == 1).astype(np.float32), (4, 1))
    assert np.where(shares > 0, 1, 255).tolist() == [[255, 1, 1, 1]]
    square = np.zeros((100, 100), int)
    square[40:60, 40:60] = 255
    assert (largest_share(square, (150, 150), [0, 255]) == 255).sum() == 30 * 30


def test_02_a_border_costs_the_pairs_that_it_cuts():
    """With four neighbours a border at 45 degrees cuts 1.41 pairs per pixel of its length, a straight one 1."""
    v, u = np.indices((200, 200))
    for y, length in ((u > v, 200 * np.sqrt(2)), (u > 99, 200)):
        cut = np.count_nonzero(y[:, 1:] != y[:, :-1]) + np.count_nonzero(y[1:] != y[:-1])
        assert cut / length == pytest.approx(np.sqrt(2) if length > 200 else 1.0, rel=0.01)


def test_03_how_exact_a_difference_is():
    """To 1e-11 for the toy, to 5e-9 with 1000 added to its logits; at 1e-16 two logits move, and the loss does not."""
    y, h = np.array(1), 1e-5

    def off(z):
        differences = [
            (losses.cross_entropy(z + s, y) - losses.cross_entropy(z - s, y)) / (2 * h) for s in h * np.eye(3)
        ]
        return np.abs(differences - losses.cross_entropy_grad(z, y)).max()

    toy = np.array([2.0, 1.0, -1.0])
    assert off(toy) < 3e-11 and 1e-9 < off(toy + 1000) < 2e-8
    steps = 1e-16 * np.eye(3)
    moved = [bool(((toy + s != toy) | (toy - s != toy)).any()) for s in steps]
    assert moved == [False, True, True]
    assert [losses.cross_entropy(toy + s, y) - losses.cross_entropy(toy - s, y) for s in steps] == [0.0, 0.0, 0.0]


def test_03_a_bias_of_class_frequencies_begins_below_log_4():
    shares = np.array([0.239, 0.714, 0.013, 0.034])
    assert -(shares @ np.log(shares)) == pytest.approx(0.754, abs=0.001) and np.log(4) > 1.38


def test_05_descent_with_weights_a_hundred_times_as_large_does_not_settle():
    p, w = torch.tensor([0.70, 0.24, 0.01, 0.05]).double(), torch.tensor([0.6, 0.8, 30.0, 4.0]).double()
    z, sure = torch.zeros(4, dtype=torch.float64, requires_grad=True), []
    optimiser = torch.optim.SGD([z], lr=0.5)
    for _ in range(21):
        optimiser.zero_grad()
        (100 * w * p * -torch.log_softmax(z, dim=0)).sum().backward()
        optimiser.step()
        sure.append(int(z.argmax()))
    assert sure[18:] == [1, 0, 2]


def test_05_weights_leave_a_certain_class_where_it_is():
    assert losses.weighted_optimum(np.array([1.0, 0.0]), np.array([1.0, 50.0])).tolist() == [1.0, 0.0]


def test_06_depth_moves_heights_off_the_axis_of_a_level_camera():
    frame = data_gen.render(data_gen.sample_scene(600_002, "test"), (320, 240))
    up = np.array([0.0, -1.0, 0.0])  # of a level camera
    on, off = (10 * up @ back_projection_jacobian(160.0, v, 1.0, frame.K)[:, 2] for v in (119.0, 0.0))
    assert on == 0.0 and off == pytest.approx(4.3, abs=0.05)


def test_07_a_hemisphere_counted_by_area_is_off_by_half_of_its_radius():
    z = np.linspace(0, 1, 100_001)  # slices of equal thickness have equal areas; seen by pixels, an area counts z-fold
    assert z.mean() == pytest.approx(1 / 2) and (z * z).sum() / z.sum() == pytest.approx(2 / 3, rel=1e-4)


@pytest.fixture(scope="module")
def spoilt():
    """The rows of lesson 07's table whose mask is spoilt, by kind."""
    rows = mask_study.read(ROOT / "labcourse" / "tables" / "07_grasp.csv")
    return {kind: [row for row in rows if row.kind == kind] for kind in mask_study.KINDS if kind != "true"}


def p_of(one, other):
    """McNemar's p of two lists of rows, scene by scene; the shares of each scene's lifts are compared."""
    shares = [{s: np.mean([row.lifted for row in rows if row.seed == s]) for s in {row.seed for row in rows}}
              for rows in (one, other)]  # fmt: skip
    both = shares[0].keys() & shares[1].keys()
    more, fewer = (sum(bool(sign * (shares[0][s] - shares[1][s]) > 0) for s in both) for sign in (1, -1))
    return paired_difference(more, fewer, len(both))[2]


def test_07_one_of_twenty_comparisons_survives_their_number(spoilt):
    left = set()
    for low, high in ((0.2, 0.5), (0.5, 1.0)):
        ranges = {kind: [row for row in rows if low <= row.iou < high] for kind, rows in spoilt.items()}
        left |= {
            (low, one, other) for one, other in combinations(spoilt, 2) if 20 * p_of(ranges[one], ranges[other]) < 0.05
        }
    assert left == {(0.2, "eroded", "holed")}
    means = [np.mean([row.iou for row in spoilt[kind] if 0.2 <= row.iou < 0.5]) for kind in ("eroded", "holed")]
    assert np.round(means, 2).tolist() == [0.36, 0.39] or np.round(means, 2).tolist() == [0.36, 0.38]


@pytest.mark.parametrize("network, wait", [(99.0, 33), (100.0, 17), (101.0, 33)])
def test_08_how_long_a_frame_waits_for_a_network_of_one_and_a_half_periods(network, wait):
    waits = [j.begin - j.arrived for j in journeys(15, network, seconds=20.0) if j.end is not None]
    assert np.mean(waits) == pytest.approx(wait, abs=0.6)


def test_04_iou_of_a_shifted_square():
    for side, shift in ((20, 2), (20, 20), (20, 30)):
        square = np.zeros((60, 80), bool)
        square[10:30, 10 : 10 + side] = True
        moved = np.roll(square, shift, axis=1)
        score = (square & moved).sum() / (square | moved).sum()
        assert score == pytest.approx(max(side - shift, 0) / (side + min(shift, side)))
