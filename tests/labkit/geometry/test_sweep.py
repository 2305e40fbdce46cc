"""Depth by trying heights, against a scene that is drawn by ray casting: a table with a pattern, and a box on it."""

from unittest import mock

import cv2
import numpy as np
import pytest

from bench.bench_mirrors import shares
from data_gen.mirrors import photographed
from labkit.geometry import invert_transform, project, transform_points
from labkit.geometry import sweep as module
from labkit.geometry.sweep import (
    View,
    central_first,
    depth_at,
    exposure_gain,
    frame_from_views,
    mean_of_best,
    plane_homography,
    semi_global,
    sweep,
)
from labkit.sim.spec import Camera

SIZE = 160, 120
K = np.array([[150.0, 0.0, 79.5], [0.0, 150.0, 59.5], [0.0, 0.0, 1.0]])
BOX = (-0.04, 0.05), (-0.05, 0.04), 0.06  # from and to in x and y, and its height
AZIMUTHS = (0.0, 14.0, -14.0, 26.0, -26.0)


def noise(seed: int, colour, scatter: float) -> np.ndarray:
    """A picture of a pattern without direction, 1 mm per pixel, 0.8 m wide."""
    rough = np.random.default_rng(seed).normal(0.0, 1.0, (800, 800, 3))
    rough = cv2.GaussianBlur(rough, (0, 0), 4.0)
    return np.clip(np.array(colour) + scatter * rough / rough.std(), 10.0, 245.0).astype(np.float32)


def cast(T: np.ndarray, table: np.ndarray, box: np.ndarray, K=K, size=SIZE):
    """Colours and depth as a camera at T sees the table z = 0 and the box on it; each pixel's ray meets one of them."""
    u, v = np.meshgrid(np.arange(size[0], dtype=float), np.arange(size[1], dtype=float))
    rays = np.stack([u, v, np.ones_like(u)], axis=-1) @ np.linalg.inv(K).T @ T[:3, :3].T
    C = T[:3, 3]
    depth, rgb = np.full(u.shape, np.inf), np.zeros((*u.shape, 3), np.float32)

    def meet(axis, at, picture, inside):
        with np.errstate(divide="ignore", invalid="ignore"):
            far = (at - C[axis]) / rays[..., axis]
        P = C + far[..., None] * rays
        hit = (far > 0.0) & (far < depth) & inside(P)
        a, b = (P[..., i] for i in range(3) if i != axis)
        maps = [np.nan_to_num(1e3 * (w + 0.4), nan=0.0).astype(np.float32) for w in (a, b)]
        rgb[hit] = cv2.remap(picture, *maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)[hit]
        depth[hit] = far[hit]

    (x0, x1), (y0, y1), top = BOX
    meet(2, 0.0, table, lambda P: np.full(u.shape, True))
    meet(2, top, box, lambda P: (P[..., 0] > x0) & (P[..., 0] < x1) & (P[..., 1] > y0) & (P[..., 1] < y1))
    for x in (x0, x1):
        meet(0, x, 0.8 * box, lambda P: (P[..., 1] > y0) & (P[..., 1] < y1) & (P[..., 2] > 0) & (P[..., 2] < top))
    for y in (y0, y1):
        meet(1, y, 0.9 * box, lambda P: (P[..., 0] > x0) & (P[..., 0] < x1) & (P[..., 2] > 0) & (P[..., 2] < top))
    return rgb, depth


def scene(table, box, exposures=(1.0,) * 5, scatter=1.0, azimuths=AZIMUTHS):
    """Views of the scene around the table, each with its own exposure and noise, and the first's true depth."""
    rng, views = np.random.default_rng(5), []
    for azimuth, exposure in zip(azimuths, exposures, strict=True):
        camera = Camera.looking_at((0.0, 0.0, 0.02), 0.5, np.radians(azimuth), np.radians(50.0))
        T = np.array(camera.T_base_cam)
        rgb, depth = cast(T, table, box)
        if not views:
            truth = depth
        picture = exposure * rgb + rng.normal(0.0, scatter, rgb.shape)
        views.append(View(np.clip(picture, 0, 255).astype(np.uint8), K, T))
    return views, truth


def height_over_table(view, depth):
    """z of each pixel's point, metres."""
    rays = np.stack([*np.meshgrid(np.arange(160.0), np.arange(120.0)), np.ones((120, 160))], -1) @ np.linalg.inv(K).T
    return depth * (rays @ view.T_base_cam[2, :3]) + view.T_base_cam[2, 3]


def on_box(views, truth):
    """Pixels on the box, away from its edges; and on the table, likewise."""
    high = (height_over_table(views[0], truth) > 0.005).astype(np.uint8)
    frame = np.zeros_like(high)
    frame[10:-10, 10:-10] = 1
    inner = cv2.erode(high, np.ones((5, 5))) > 0
    outer = (cv2.dilate(high, np.ones((9, 9))) == 0) & (frame > 0)
    return inner, outer


WOOD, RED = noise(1, (150, 120, 90), 25.0), noise(2, (180, 40, 40), 25.0)


def test_a_box_on_a_table_has_its_depth():
    """With patterns on both: within 4 mm nearly everywhere, from views that are exposed differently."""
    views, truth = scene(WOOD, RED, exposures=(1.0, 0.8, 1.2, 0.9, 1.1))
    found = sweep(views)
    box, table = on_box(views, truth)
    off = np.abs(found.depth - truth)
    for where, share in ((box, 0.9), (table, 0.97)):
        known = found.depth[where] > 0.0
        assert known.mean() > share and (off[where][known] < 0.004).mean() > share
    assert not found.odd


def test_a_plain_box_on_a_plain_table_is_not_flat():
    """Where nothing has a pattern the colours tell: the table is at its height, most of the box near its own."""
    plain = np.full((800, 800, 3), 1.0, np.float32)
    views, truth = scene(plain * (60, 110, 60), plain * (230, 228, 225), exposures=(1.0, 0.85, 1.15, 0.95, 1.05))
    found = sweep(views)
    box, table = on_box(views, truth)
    off = np.abs(found.depth - truth)
    assert (off[table] < 0.003).mean() > 0.9
    assert (off[box] < 0.012).mean() > 0.6


def test_nothing_rises_from_a_plain_table_where_nothing_proves_it():
    """At the picture's border few views see the same: without the rule 18 % of the table seem to rise."""
    plain = np.full((800, 800, 3), 1.0, np.float32)
    views, truth = scene(plain * (60, 110, 60), plain * (230, 228, 225), exposures=(1.0, 0.85, 1.15, 0.95, 1.05))
    found = sweep(views)
    box = height_over_table(views[0], truth) > 0.005
    table = cv2.dilate(box.astype(np.uint8), np.ones((9, 9))) == 0
    rises = (found.depth > 0.0) & (height_over_table(views[0], found.depth) > 0.012)
    assert rises[table].mean() < 0.06 and (found.depth[table] > 0.0).mean() > 0.8
    assert (found.depth[box] > 0.0).mean() > 0.9, "the middle of the plain box is kept with its rim"


def test_where_a_mirror_shows_a_pattern_depth_is_unknown():
    """A square of 12 cm on the table that shows a ceiling with a pattern, elsewhere from each view; the rest is known.

    Without a look below the table a quarter of it has a wrong height, by chance.
    """
    with mock.patch.dict(globals(), BOX=((0.5, 0.51), (0.5, 0.51), 0.001)):  # out of sight
        views, _ = scene(WOOD, RED)
    there, views = zip(*(with_mirror(view, noise(9, (200, 200, 210), 40.0)) for view in views), strict=True)
    found = sweep(views).depth
    wrong = (found > 0.0) & (np.abs(height_over_table(views[0], found)) > 0.02)
    inner = cv2.erode(there[0].astype(np.uint8), np.ones((5, 5))) > 0
    assert wrong[there[0]].mean() < 0.02 and (found > 0.0)[inner].mean() < 0.1
    assert (found > 0.0)[~there[0]].mean() > 0.85


def test_a_mirror_among_things_is_hardly_ever_wrong():
    """Drawn by ray casting, with all that a phone does: it lies flat, and shows a patterned ceiling and what is beside
    it."""
    found = shares(photographed("flat", 1, size=(320, 240), count=5))
    assert found.wrong < 0.02 and found.without > 0.8 and found.rest > 0.9


@pytest.mark.nightly
@pytest.mark.parametrize(("kind", "most"), [("leaning", 0.05), ("tilted", 0.02)])
def test_a_mirror_that_leans_is_seldom_wrong(kind, most):
    found = shares(photographed(kind, 1, size=(320, 240)))
    assert found.wrong < most and found.without > 0.8 and found.rest > 0.9


@pytest.mark.nightly
@pytest.mark.parametrize("kind", ["standing", "pane", "standing pane", "tumbler"])
def test_what_looks_like_a_hole_has_the_depth_of_what_is_seen_in_it(kind):
    """All photographs agree on the table that an upright mirror shows, and on the one behind a glass."""
    found = shares(photographed(kind, 1, size=(320, 240)))
    assert found.seen > 0.7 and found.wrong < 0.05


def test_no_pixel_of_a_table_and_a_box_changes_by_a_look_below():
    """Bit by bit: what is below the table only takes depth away, and here nothing is; nor where a lens left a strip."""
    views, _ = scene(WOOD, RED)
    strip = np.zeros((120, 160, 3), np.uint8)
    strip[3:-3, 3:-3] = 1
    views = [View(view.rgb * strip, K, view.T_base_cam) for view in views]
    none = np.zeros((120, 160), bool)
    with mock.patch.object(module, "_below", return_value=(none, none)):
        without = sweep(views).depth
    assert np.array_equal(sweep(views).depth, without)


def with_mirror(view, ceiling, half=0.06, up=0.8):
    """Where a mirror on the table is in a view, and the view with what it reflects: a ceiling 0.8 m over the table."""
    rays = np.stack([*np.meshgrid(np.arange(160.0), np.arange(120.0)), np.ones((120, 160))], -1) @ np.linalg.inv(K).T
    rays = rays @ view.T_base_cam[:3, :3].T
    on_table = (view.T_base_cam[:3, 3] - rays * (view.T_base_cam[2, 3] / rays[..., 2])[..., None])[..., :2]
    there = (np.abs(on_table) < half).all(axis=-1)
    above = on_table - up * rays[..., :2] / rays[..., 2:]
    maps = [(250.0 * above[..., i] + 400.0).astype(np.float32) for i in (0, 1)]
    seen = cv2.remap(ceiling, *maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
    return there, View(np.where(there[..., None], seen, view.rgb).astype(np.uint8), K, view.T_base_cam)


def test_depth_is_unknown_where_a_pixel_of_parallax_means_centimetres():
    """Views 1 cm apart: at half a metre one pixel is 17 cm, whatever the pattern."""
    views, _ = scene(WOOD, RED, azimuths=(0.0, 1.0, -1.0, 0.5, -0.5))
    assert not sweep(views).depth.any()


def test_a_plane_of_known_height_is_found_between_the_steps():
    """A board 37 mm over the table that fills the picture: heights that are tried are 4 mm apart."""
    board, views = noise(3, (120, 120, 120), 30.0), []
    for azimuth in AZIMUTHS:
        T = np.array(Camera.looking_at((0.0, 0.0, 0.0), 0.5, np.radians(azimuth), np.radians(60.0)).T_base_cam)
        lifted = T.copy()
        lifted[2, 3] += 0.037
        views.append(View(flat(T, board), K, lifted))
    found = sweep(views).depth
    truth = depth_at(views[0], np.full(found.shape, 0.037))
    inner = np.s_[15:-15, 15:-15]
    assert np.median(np.abs(found - truth)[inner]) < 0.001


def flat(T, board):
    """The board alone, as seen from T."""
    u, v = np.meshgrid(np.arange(160.0), np.arange(120.0))
    rays = np.stack([u, v, np.ones_like(u)], axis=-1) @ np.linalg.inv(K).T @ T[:3, :3].T
    P = T[:3, 3] - rays * (T[2, 3] / rays[..., 2])[..., None]
    maps = [(1e3 * (P[..., i] + 0.4)).astype(np.float32) for i in (0, 1)]
    return cv2.remap(board, *maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT).astype(np.uint8)


def test_what_moved_is_found_in_the_view_that_it_moved_in():
    views, _ = scene(WOOD, RED)
    global BOX
    kept, BOX = BOX, ((-0.10, -0.01), (-0.10, -0.01), 0.06)
    try:
        moved, _ = scene(WOOD, RED)
    finally:
        BOX = kept
    assert sweep([*views[:2], moved[2], *views[3:]]).odd == (2,)


def test_the_homography_agrees_with_projection():
    """A point at the height, seen by one camera, is where the homography says in the other."""
    views, _ = scene(WOOD, RED)
    height, (u, v) = 0.05, (50.0, 70.0)
    depth = depth_at(views[0], np.full((120, 160), height))[70, 50]
    P = transform_points(views[0].T_base_cam, depth * np.linalg.solve(K, (u, v, 1.0)))
    assert P[2] == pytest.approx(height)
    there = np.ravel(project(transform_points(invert_transform(views[3].T_base_cam), P[None]), K))
    w = plane_homography(views[0], views[3], height) @ (u, v, 1.0)
    assert w[:2] / w[2] == pytest.approx(there)


def test_exposure_is_matched_where_the_table_is():
    views, _ = scene(WOOD, RED, exposures=(1.0, 0.7, 1.0, 1.0, 1.0), scatter=0.0)
    one, other = (view.rgb.astype(np.float32) for view in views[:2])
    gain = exposure_gain(one, other, plane_homography(views[0], views[1], 0.0))
    assert np.median(gain) == pytest.approx(1.0 / 0.7, rel=0.03)


def test_ways_prefer_neighbours_that_agree():
    """A row whose middle tells nothing takes the height of its ends; where one pixel says otherwise, it is outvoted."""
    costs = np.full((1, 9, 30), 0.5, np.float32)
    costs[0, [0, 1, 7, 8], 25] = 0.0
    costs[0, 4, 0] = 0.4
    guide = np.zeros((1, 9, 3), np.float32)
    assert semi_global(costs, guide).argmin(axis=-1).tolist() == [[25] * 9]


def test_the_best_half_counts():
    costs = [np.full((2, 2), x, np.float32) for x in (1.0, 0.2, 0.4, 1.0)]
    assert mean_of_best(costs, 0.5) == pytest.approx(0.3)


def test_the_middle_view_comes_first():
    views, _ = scene(WOOD, RED, azimuths=(26.0, 14.0, -14.0, 0.0, -26.0))
    assert central_first(views) == [3, 0, 1, 2, 4]


def test_a_frame_is_made_of_the_first_view():
    views, _ = scene(WOOD, RED)
    heights = []
    frame = frame_from_views(views[:3], lambda tried: heights.extend(tried) or tried)
    assert np.array_equal(frame.rgb, views[0].rgb) and frame.table_z == 0.0 and len(heights) > 50
    assert np.array_equal(frame.T_base_cam, views[0].T_base_cam)


def test_too_few_views_and_other_sizes_are_refused():
    views, _ = scene(WOOD, RED)
    with pytest.raises(ValueError, match="views: expected at least 3"):
        sweep(views[:2])
    cut = View(views[2].rgb[:100].copy(), K, views[2].T_base_cam)
    with pytest.raises(ValueError, match="views\\[2\\]"):
        sweep([*views[:2], cut])
