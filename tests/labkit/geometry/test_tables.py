"""The table among planes, and what stands on it: scenes made of rectangles whose places are known."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from labcli.perceive import on_table
from labkit.frame import RGBDFrame
from labkit.geometry import back_project, find_tables
from labkit.geometry.standing import BESIDE, HANGS
from labkit.geometry.tables import height_of, planes_beside, table_at
from labkit.labels import TARGET
from labkit.pipeline import Pipeline
from labkit.sim.spec import Camera

K = np.array([[300.0, 0.0, 159.5], [0.0, 300.0, 119.5], [0.0, 0.0, 1.0]])
CAMERA = np.array(Camera.looking_at((0.5, 0.0, 0.0), 0.9, np.pi, 0.8).T_base_cam)
REAL = Path(__file__).resolve().parents[4] / "shared" / "real"
needs_photographs = pytest.mark.skipif(not REAL.is_dir(), reason="needs ../shared/real")


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
CLOSE_BEHIND = ((0.72, -0.1, -0.4), (0.8, 0.1, 0.08))  # its face crosses the table's height two centimetres beside it
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
    [
        ((FLOOR, SMALL_TABLE, THING, BEHIND), BESIDE),
        ((FLOOR, SMALL_TABLE, THING, CLOSE_BEHIND), BESIDE),
        ((WIDE_TABLE, FLOOR, THING, ROBOT), HANGS),
    ],
    ids=["behind the table", "close behind it", "robot"],
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


def bent(frame, by: float = 0.12, seed: int = 0):
    """Depth of a camera that is right in its middle: off by `by` (z r)^2, r = 1 at 45 degrees; noise grows as z^2."""
    z, (v, u) = frame.depth.astype(float), np.indices(frame.depth.shape)
    r2 = ((u - K[0, 2]) / K[0, 0]) ** 2 + ((v - K[1, 2]) / K[1, 1]) ** 2
    noisy = z + z**2 * (by * r2 + 0.0014 * np.random.default_rng(seed).standard_normal(z.shape))
    return replace(frame, depth=np.where(z > 0.0, noisy, 0.0).astype(np.float32))


def large(things):
    """The things of which 60 pixels are seen."""
    return np.where(np.bincount(things.ravel())[things] < 60, 0, things)


def kept(frame, things, **of_pipeline):
    """The numbers of the things that are targets, and the perception."""
    p = Pipeline(workspace="table", **of_pipeline).locate(frame, np.where(things > 0, TARGET, 0), instances=things)
    return {int(things.ravel()[pixels[0]]) for pixels in p.pixels}, p


LOW = np.array(Camera.looking_at((0.5, 0.0, 0.0), 1.0, np.pi, 0.5).T_base_cam)
ALONG = [(x, y) for x in (0.1, 0.56, 1.02) for y in (-0.4, 0.0, 0.4)]
AT_THE_EDGES = [((x, y - 0.03, 0.0), (x + 0.06, y + 0.03, 0.07)) for x, y in ALONG]
SQUARE_TABLE = ((0.09, -0.45, -0.02), (1.09, 0.45, 0.0))


@pytest.mark.parametrize("seed", range(2))
def test_things_at_the_edges_of_a_table_that_the_camera_bends_stand_on_it(seed):
    """Its ends lie off the plane of the rest, twice as far as off the surface; nothing of it is another plane."""
    frame, number = seen(FLOOR, SQUARE_TABLE, *AT_THE_EDGES, T=LOW)
    frame = bent(frame, seed=seed)
    things = large(np.maximum(number - 2, 0))
    found = on_table(replace(frame, T_base_cam=np.eye(4)))[0]
    stands, p = kept(found, things)
    assert stands == set(np.unique(things[things > 0])), p.left_out
    table = table_at(p.tables, 0.0)
    P = p.points[number == 2].astype(float)
    off_plane, off_surface = P @ table.plane.normal + table.plane.offset, table.over(P)[1]
    assert np.percentile(np.abs(off_plane), 95) > 0.007 > 2.0 * np.percentile(np.abs(off_surface), 95)
    beside = planes_beside(p.tables, table)
    assert all(height_of(other) < -0.3 for other in beside), beside


CARTON = ((0.35, 0.3, 0.0), (0.5, 0.36, 0.24))  # leaves the picture at its left
HAND = ((0.45, 0.02, 0.1), (0.5, 0.07, 0.16))  # of the robot, over the thing
FINGERS = ((0.46, -0.02, 0.07), (0.5, 0.06, 0.12))  # that touch the thing


def test_what_the_border_cuts_off_stands_and_a_robot_that_touches_a_thing_does_not():
    frame, number = seen(WIDE_TABLE, THING, CARTON)
    assert (number[:, 0] == 3).any(), "the carton is cut off"
    stands, p = kept(bent(frame), np.maximum(number - 1, 0))
    assert stands == {1, 2} and not p.left_out
    which = [int(number.ravel()[pixels[0]]) for pixels in p.pixels].index(3) + 1
    assert f"target {which} touches the picture's border: a part of it is unseen" in p.notices
    for arm in ((ROBOT,), (ROBOT, FINGERS)):
        frame, number = seen(WIDE_TABLE, THING, *arm)
        robot = np.where(number >= 3, 2, np.maximum(number - 1, 0))
        assert kept(bent(frame), robot)[0] == {1}, "the whole robot"


def crate(rows: int = 3):
    """Blocks side by side in two layers within walls that leave the picture."""
    walls = [((0.2, y, 0.0), (0.8, y + 0.02, 0.2)) for y in (-0.28, 0.26)]
    walls += [((x, -0.28, 0.0), (x + 0.02, 0.28, 0.2)) for x in (0.18, 0.8)]
    low = [
        ((0.24 + 0.14 * i, -0.2 + 0.14 * j, 0.0), (0.33 + 0.14 * i, -0.12 + 0.14 * j, 0.08))
        for i in range(4)
        for j in range(rows)
    ]
    high = [((0.25 + 0.14 * i, -0.19, 0.08), (0.32 + 0.14 * i, -0.13, 0.14)) for i in range(3)]
    return walls, low + high


def test_the_things_of_a_full_crate_stand_in_it_although_its_walls_leave_the_picture():
    walls, blocks = crate()
    T = np.array(Camera.looking_at((0.5, 0.0, 0.0), 0.62, np.pi, 1.1).T_base_cam)
    frame, number = seen(WIDE_TABLE, *walls, *blocks, T=T)
    things = np.maximum(number - 5, 0)
    things = large(things)
    stands, p = kept(bent(frame), things)
    assert stands == set(np.unique(things[things > 0])), p.left_out


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


@needs_photographs
@pytest.mark.parametrize(("name", "desk", "floor"), [("3", (302, 408), (90, 150)), ("4", (468, 321), (75, 125))])
def test_a_real_floor_that_fills_the_picture_is_not_the_table(name, desk, floor):
    """Pixels (u, v) of the bare desk and of the floor, chosen in the picture by eye."""
    frame, K = real(name)
    points = _points(on_table(frame)[0], K)
    z = [np.nanmedian(points[v - 5 : v + 6, u - 5 : u + 6, 2]) for u, v in (desk, floor)]
    assert abs(z[0]) < 0.01 and z[1] < -0.5


def real(name: str):
    """A tabletop frame of a real camera, and its intrinsics."""
    from labcli.cameras import read_intrinsics
    from labcli.perceive import read_frame

    folder = REAL / "tabletop"
    camera = read_intrinsics(str(folder / "camera.json"))
    return read_frame(folder / "color" / f"{name}.png", folder / "depth" / f"{name}.png", camera), camera.K


@needs_photographs
def test_a_real_thing_behind_the_tables_corner_is_no_piece_of_it_although_its_face_crosses_the_height():
    """A black thing on the desk behind, at (16, 212), beside the board's far left corner."""
    frame, K = real("1")
    frame = on_table(frame)[0]
    points = _points(frame, K)
    table = table_at(find_tables(points, frame.T_base_cam[:3, 3], up=(0.0, 0.0, 1.0)), 0.0)
    inside, height = table.over(points[[212, 250, 300], [16, 10, 10]].astype(float))
    assert inside.tolist() == [False, False, True]
    assert abs(height[1]) < 0.012, "the face at the table's height"
