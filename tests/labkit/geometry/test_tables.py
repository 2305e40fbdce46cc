"""The table among planes, and what stands on it: scenes made of rectangles whose places are known."""

from pathlib import Path

import numpy as np
import pytest

from labkit.frame import RGBDFrame
from labkit.geometry import back_project, find_tables
from labkit.geometry.tables import BESIDE, HANGS, height_of, table_at
from labkit.labels import TARGET
from labkit.pipeline import Pipeline
from labkit.sim.spec import Camera

K = np.array([[300.0, 0.0, 159.5], [0.0, 300.0, 119.5], [0.0, 0.0, 1.0]])
CAMERA = np.array(Camera.looking_at((0.5, 0.0, 0.0), 0.9, np.pi, 0.8).T_base_cam)
REAL = Path(__file__).resolve().parents[4] / "shared" / "real"


def seen(*boxes, T=CAMERA):
    """A frame and the number of the box at each pixel, ray by ray: boxes as (low, high) corners, 0 for none."""
    v, u = np.mgrid[:240, :320]
    rays = np.stack([u, v, np.ones_like(u)], axis=-1) @ np.linalg.inv(K).T @ T[:3, :3].T
    nearest, number = np.full(u.shape, np.inf), np.zeros(u.shape, int)
    with np.errstate(divide="ignore", invalid="ignore"):
        for n, (low, high) in enumerate(boxes, start=1):
            t = np.sort([(np.asarray(side) - T[:3, 3]) / rays for side in (low, high)], axis=0)
            enter, leave = t[0].max(axis=-1), t[1].min(axis=-1)
            hit = (enter < leave) & (enter > 0.0) & (enter < nearest)
            nearest[hit], number[hit] = enter[hit], n
    depth = np.where(np.isfinite(nearest), nearest, 0.0).astype(np.float32)
    return RGBDFrame(np.zeros((240, 320, 3), np.uint8), depth, K, T, table_z=0.0), number


FLOOR = ((-3.0, -3.0, -0.41), (3.0, 3.0, -0.4))
SMALL_TABLE = ((0.3, -0.2, -0.02), (0.7, 0.2, 0.0))
WIDE_TABLE = ((0.0, -0.8, -0.02), (1.2, 0.8, 0.0))
SHELF = ((0.6, -0.5, 0.18), (0.9, 0.5, 0.2))
THING = ((0.45, -0.05, 0.0), (0.51, 0.01, 0.08))
BEHIND = ((0.78, -0.05, -0.4), (0.88, 0.05, 0.08))  # on the floor behind the small table, and higher than it
ROBOT = ((0.45, 0.1, 0.12), (0.55, 1.5, 0.25))  # comes in from the picture's left border
EVERYTHING = ((-9.0, 9.0), (-9.0, 9.0), (-0.02, 0.5))


@pytest.mark.parametrize(
    ("boxes", "others"),
    [
        ((WIDE_TABLE, THING), []),
        ((FLOOR, SMALL_TABLE, THING), [-0.4]),
        ((WIDE_TABLE, SHELF, THING), [0.2]),
    ],
    ids=["alone", "floor", "shelf"],
)
def test_the_table_is_the_plane_that_things_stand_on_and_the_others_have_their_heights(boxes, others):
    frame, number = seen(*boxes)
    tables = find_tables(back_project(frame.depth, K))
    assert tables[0].plane.offset == pytest.approx(CAMERA[2, 3], abs=0.003), "height of the camera over the table"
    level = find_tables(_points(frame), CAMERA[:3, 3], up=(0.0, 0.0, 1.0))
    assert height_of(level[0]) == pytest.approx(0.0, abs=0.003)
    assert [height_of(other) for other in level[1:]] == pytest.approx(others, abs=0.01)
    if others and others[0] < 0.0:  # the floor is the larger plane
        assert np.mean(number == 1) > np.mean(number == 2)
    assert table_at(level, 0.0) is level[0] and table_at(level, 1.0) is None


def _points(frame, K=K):
    return back_project(frame.depth, K) @ frame.T_base_cam[:3, :3].T.astype(np.float32) + frame.T_base_cam[:3, 3]


@pytest.mark.parametrize(
    ("boxes", "why"),
    [((FLOOR, SMALL_TABLE, THING, BEHIND), BESIDE), ((WIDE_TABLE, FLOOR, THING, ROBOT), HANGS)],
    ids=["behind the table", "robot"],
)
def test_what_does_not_stand_on_the_table_is_no_target_without_a_workspace(boxes, why):
    frame, number = seen(*boxes)
    things = np.where(number >= 3, number - 2, 0)
    labels = np.where(things > 0, TARGET, 0)
    p = Pipeline(workspace="table").locate(frame, labels, instances=things)
    assert len(p.clouds) == 1 and set(things.ravel()[p.pixels[0]]) == {1}
    assert {grasp.target for grasp in p.plan.grasps} == {0}
    (said,) = p.left_out
    assert said.startswith("1 of 2 targets") and why in said and said in p.notices
    assert len(Pipeline(workspace=EVERYTHING).locate(frame, labels, instances=things).clouds) == 2
    alone = Pipeline(workspace="table").locate(frame, labels, instances=np.where(things == 2, 2, 0))
    assert not alone.plan.grasps and why in alone.plan.reason


def test_a_thing_is_chosen_by_its_pixel_whatever_its_class():
    second = ((0.45, 0.1, 0.0), (0.5, 0.15, 0.06))
    frame, number = seen(WIDE_TABLE, THING, second)
    labels = np.where(number == 3, 3, np.where(number == 2, TARGET, 1))
    v, u = (int(x.mean()) for x in np.nonzero(number == 3))
    p = Pipeline(workspace="table").locate(frame, labels, at=(u, v))
    assert set(number.ravel()[p.pixels[0]]) == {3} and len(p.clouds) == 1 and p.certainty == (1.0,)
    q = Pipeline(find_objects=lambda frame: np.maximum(number - 1, 0)).run(frame, at=(u, v))
    assert set(number.ravel()[q.pixels[0]]) == {3}
    v, u = (x[0] for x in np.nonzero(number == 1))
    nothing = Pipeline().locate(frame, labels, at=(u, v))
    assert not nothing.plan.grasps and "the pixel shows the table" in nothing.plan.reason
    for outside in ((320, 0), (-1, 5)):
        with pytest.raises(ValueError, match=r"at: expected a pixel \(u, v\) of the picture of 320 x 240"):
            Pipeline().locate(frame, labels, at=outside)


def test_a_mask_outside_the_workspace_says_where_it_lies():
    frame, number = seen(WIDE_TABLE, THING)
    low = Pipeline(workspace=((-9.0, 9.0), (-9.0, 9.0), (-0.5, -0.1))).locate(frame, np.where(number == 2, TARGET, 0))
    assert low.plan.reason.startswith("no") and not low.clouds
    part = ((-9.0, 9.0), (-9.0, 9.0), (-0.1, 0.004))
    assert (
        "lie above the workspace"
        in Pipeline(workspace=part).locate(frame, np.where(number == 2, TARGET, 0)).plan.reason
    )


@pytest.mark.skipif(not REAL.is_dir(), reason="needs ../shared/real")
@pytest.mark.parametrize(("name", "desk", "floor"), [("3", (302, 408), (90, 150)), ("4", (468, 321), (75, 125))])
def test_a_real_floor_that_fills_the_picture_is_not_the_table(name, desk, floor):
    """Pixels (u, v) of the bare desk and of the floor, chosen in the picture by eye."""
    from labcli.cameras import read_intrinsics
    from labcli.perceive import on_table, read_frame

    folder = REAL / "tabletop"
    camera = read_intrinsics(str(folder / "camera.json"))
    frame = read_frame(folder / "color" / f"{name}.png", folder / "depth" / f"{name}.png", camera)
    points = _points(on_table(frame)[0], camera.K)
    z = [np.nanmedian(points[v - 5 : v + 6, u - 5 : u + 6, 2]) for u, v in (desk, floor)]
    assert abs(z[0]) < 0.01 and z[1] < -0.5
