"""Clicks part what is one thing: where colour or the surface changes, and as the least cut there is."""

from dataclasses import replace

import numpy as np
import pytest

from labkit.crf.clicks import cut_between
from labkit.frame import RGBDFrame
from labkit.geometry import back_project
from labkit.labels import TARGET
from labkit.pipeline import Pipeline
from labkit.sim.spec import Camera

K = np.array([[300.0, 0.0, 79.5], [0.0, 300.0, 59.5], [0.0, 0.0, 1.0]])
BELOW, ABOVE = np.s_[60:100, 50:110], np.s_[25:60, 60:100]  # a box and one on it


def stack(colours=(90, 200), depths=(0.6, 0.6)):
    """Two boxes in the picture, the lower and the upper, as one mask: frame, mask, true upper one."""
    rgb, depth, true = np.full((120, 160, 3), 40, np.uint8), np.full((120, 160), 0.9, np.float32), np.zeros((120, 160))
    for number, (where, colour, z) in enumerate(zip((BELOW, ABOVE), colours, depths, strict=True), start=1):
        rgb[where], depth[where], true[where] = colour, z, number
    noise = np.random.default_rng(0)
    rgb = np.clip(rgb + noise.normal(0.0, 3.0, rgb.shape), 0, 255).astype(np.uint8)
    depth = (depth + noise.normal(0.0, 0.0005, depth.shape)).astype(np.float32)
    T = np.array(Camera.looking_at((0.5, 0.0, 0.0), 0.9, np.pi, 1.2).T_base_cam)
    return RGBDFrame(rgb, depth, K, T, table_z=0.0), true > 0, true == 2


@pytest.mark.parametrize(
    ("colours", "depths", "iou"),
    [((90, 200), (0.6, 0.6), 0.95), ((120, 120), (0.6, 0.57), 0.85)],
    ids=["by colour", "by depth, which is smoothed"],
)
def test_a_second_click_parts_at_a_step_of_colour_or_of_depth(colours, depths, iou):
    frame, mask, upper = stack(colours, depths)
    points = back_project(frame.depth, frame.K)
    for at, not_at in (((80, 40), (80, 80)), ((65, 30), (55, 95))):
        found = cut_between(mask, frame.rgb, points, [at], [not_at])
        other = cut_between(mask, frame.rgb, points, [not_at], [at])
        for part, true in ((found, upper), (other, mask & ~upper)):
            assert (part & true).sum() / (part | true).sum() > iou
        assert not (found & other).any() and not (found & ~mask).any()


def test_each_click_is_on_its_own_side_whatever_it_shows():
    """Random clicks on a mask without any step, and with holes of depth: several of each."""
    rng = np.random.default_rng(0)
    frame, mask, _ = stack((100, 100))
    points = back_project(np.where(rng.random(mask.shape) < 0.3, 0.0, frame.depth).astype(np.float32), frame.K)
    v, u = np.nonzero(mask)
    for _ in range(5):
        some = rng.choice(len(v), 6, replace=False)
        clicks = [(int(u[k]), int(v[k])) for k in some]
        part = cut_between(mask, frame.rgb, points, clicks[:3], clicks[3:])
        assert [bool(part[row, column]) for column, row in clicks] == 3 * [True] + 3 * [False]


def clicked(at, not_at, frame=None, **given):
    frame_, mask, _ = stack()
    frame = frame or frame_
    pipeline = Pipeline(find_objects=lambda _: mask.astype(int), workspace=((-9.0, 9.0), (-9.0, 9.0), (-9.0, 9.0)))
    return pipeline.run(frame, at=at, not_at=not_at, **given)


def test_the_pipeline_takes_the_part_and_the_rest_is_an_obstacle():
    _, mask, upper = stack()
    one, parted = clicked((80, 40), None), clicked((80, 40), (80, 80))
    assert (one.labels == TARGET).sum() == mask.sum()
    assert ((parted.labels == TARGET) == upper).mean() > 0.99 and len(parted.clouds) == 1
    rest = mask & (parted.labels != TARGET)
    assert rest.sum() > 2000 and len(parted.scene) == len(one.scene), "what is parted off is still in the way"
    both = clicked([(80, 40), (80, 50)], [(80, 80), (60, 90)])
    assert ((both.labels == TARGET) == upper).mean() > 0.99


def test_two_clicks_of_one_thing_that_was_found_as_two_join_it():
    frame, mask, upper = stack()
    pipeline = Pipeline(
        find_objects=lambda _: mask.astype(int) + upper, workspace=((-9.0, 9.0), (-9.0, 9.0), (-9.0, 9.0))
    )
    assert (pipeline.run(frame, at=(80, 40)).labels == TARGET).sum() == upper.sum()
    assert (pipeline.run(frame, at=[(80, 40), (80, 80)]).labels == TARGET).sum() == mask.sum()


@pytest.mark.bad_input
def test_clicks_that_part_nothing_get_a_sentence():
    with pytest.raises(ValueError, match=r"not_at: expected a pixel `at` the thing beside it"):
        clicked(None, (80, 80))
    with pytest.raises(ValueError, match=r"not_at: expected other pixels than `at`, got \(80, 40\) in both"):
        clicked((80, 40), [(80, 80), (80, 40)])
    with pytest.raises(ValueError, match=r"not_at: expected a pixel \(u, v\) of the picture of 160 x 120"):
        clicked((80, 40), (160, 0))
    off = clicked((80, 40), (3, 3))
    assert not off.clouds and "(3, 3) is not on the thing at (80, 40)" in off.plan.reason
    frame, _, _ = stack()
    depth = frame.depth.copy()
    depth[80, 80] = 0.0
    blind = clicked((80, 40), (80, 80), replace(frame, depth=depth))
    assert not blind.clouds and "there is no depth at (80, 80)" in blind.plan.reason
    with pytest.raises(ValueError, match=r"inside: expected pixels of the mask"):
        cut_between(np.eye(4, dtype=bool), np.zeros((4, 4, 3), np.uint8), np.zeros((4, 4, 3)), [(0, 1)], [(2, 2)])
