"""What stands on a table, without a network: its plane is cut away, and the rest falls into objects (topic 09)."""

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float32, Int32, UInt8

from labkit.frame import RGBDFrame
from labkit.geometry import back_project_to_base, cluster_indices, fit_plane
from labkit.learning.view import canonical_view

NEAR = 0.25  # metres over or under the table's stated height, where its plane is looked for
CUT, TOP = 0.006, 0.010  # metres over the plane: lower is table; an object is higher somewhere
NOISE = 3.0, 5.0  # the same two, if that is more, in standard deviations of the table's points
HANGING = 0.1  # metres over the plane where nothing begins that stands on it
LARGEST = 0.35  # metres: a wider thing is a wall or the robot
GAP = 0.025  # metres of empty space between objects of one colour, at least
CELL = 0.02  # metres: the grid on which the table's points must hang together
STEP, ALIKE = 0.08, 0.12  # of r, g, b as shares of their sum: within 3 x 3 pixels; between the medians of two regions
NECK = 0.25  # of an object's greatest inner radius: what is thinner joins two objects
LEAST, REGION = 40, 60  # pixels of the view that an object has, and a region of one colour


def on_the_table(frame: RGBDFrame) -> Int32[np.ndarray, "H W"]:
    """Number everything that stands on the table: 0 is no object, the others count from 1.

    The plane is fitted near the frame's table_z (0 if unknown). What rises over it, by more than its noise, falls into
    clusters with 25 mm of space between them; a cluster is cut where its colour steps and where it has a neck. So a
    thing of two colours comes apart, and so do two things that touch: colours cannot tell these cases apart. All this
    happens in the frame's canonical view; walls, the robot and what hangs are left out. Without a table nothing stands.
    `Pipeline(on_the_table)` takes each object for a target. Topic 09.
    """
    view = canonical_view(frame)
    table = None if view is None else _table(view.frame)
    if table is None:
        return np.zeros(frame.depth.shape, np.int32)
    points, heights, cut, top, area = table
    numbers = np.zeros(heights.shape, np.int32)
    rgb = colour_shares(view.frame.rgb)
    rising = np.flatnonzero((heights > cut) & (heights < LARGEST))  # NaN does not
    for group in cluster_indices(points.reshape(-1, 3)[rising], GAP, LEAST):
        pixels = rising[group]
        P, z = points.reshape(-1, 3)[pixels], heights.ravel()[pixels]
        middle = tuple(map(float, np.median(P[:, :2], axis=0)))
        if np.ptp(P, axis=0).max() > LARGEST or z.min() > HANGING or np.percentile(z, 90) < top:
            continue
        if cv2.pointPolygonTest(area, middle, measureDist=False) < 0:  # behind the table's edge
            continue
        v, u = np.divmod(pixels, heights.shape[1])
        box = np.s_[v.min() : v.max() + 1, u.min() : u.max() + 1]
        mask = np.zeros(heights[box].shape, bool)
        mask[v - v.min(), u - u.min()] = True
        for region in colour_regions(mask, rgb[box]):
            for part in _by_neck(region):
                if np.count_nonzero(part) >= LEAST:
                    numbers[box][part] = numbers.max() + 1
    return view.back(numbers[..., None].astype(np.float32), cv2.INTER_NEAREST)[..., 0].astype(np.int32)


on_the_table.gives_instances = True  # this is how a `Pipeline` knows


def _table(frame: RGBDFrame):
    """Points, their heights over the table's plane, the heights CUT and TOP for its noise, its outline; None without.

    The outline is the convex hull, in x and y of the base, of the largest piece of the plane: not of a shelf beside it.
    """
    points = back_project_to_base(frame.depth, frame.K, frame.T_base_cam)
    near = points[np.abs(points[..., 2] - (frame.table_z or 0.0)) < NEAR]
    if len(near) < 100:
        return None
    plane = fit_plane(near, viewer=(0.0, 0.0, 1e3))
    cut, top = (max(least, n * plane.residual) for least, n in zip((CUT, TOP), NOISE, strict=True))
    flat = near[plane.inliers, :2].astype(np.float32)
    cells = np.floor(flat / CELL).astype(int)
    cells -= cells.min(axis=0)
    grid = np.zeros(cells.max(axis=0) + 1, np.uint8)
    grid[tuple(cells.T)] = 1
    piece = cv2.connectedComponents(grid)[1][tuple(cells.T)]
    area = cv2.convexHull(flat[piece == np.bincount(piece).argmax()])
    return points, points @ plane.normal + plane.offset, cut, top, area


def colour_shares(rgb: UInt8[np.ndarray, "H W 3"]) -> Float32[np.ndarray, "H W 3"]:
    """Each of red, green and blue as a share of their sum, which light and shade hardly change; dark is grey."""
    light = cv2.medianBlur(rgb, 5).astype(np.float32) + 8.0
    return light / light.sum(axis=-1, keepdims=True)


def colour_regions(mask: Bool[np.ndarray, "h w"], rgb: Float[np.ndarray, "h w 3"]) -> list[Bool[np.ndarray, "h w"]]:
    """Cut a mask where its colour steps: regions without a step inside, those of like colours joined again."""
    around = np.ones((3, 3))
    step = (cv2.dilate(rgb, around) - cv2.erode(rgb, around)).sum(axis=-1)
    count, region, stats, _ = cv2.connectedComponentsWithStats((mask & (step < STEP)).astype(np.uint8), connectivity=4)
    large = [r for r in range(1, count) if stats[r, cv2.CC_STAT_AREA] >= REGION]
    if len(large) < 2:
        return [mask]
    colours = np.array([np.median(rgb[region == r], axis=0) for r in large])
    group = np.arange(len(large))
    for i, j in np.argwhere(np.abs(colours[:, None] - colours).sum(axis=-1) < ALIKE):
        group[group == group[j]] = group[i]
    return _grown(mask, region, large, 1 + np.unique(group, return_inverse=True)[1])


def _by_neck(mask: Bool[np.ndarray, "h w"]) -> list[Bool[np.ndarray, "h w"]]:
    """Cut a mask where it is much thinner than on both sides."""
    radius = cv2.distanceTransform(np.pad(mask, 1).astype(np.uint8), cv2.DIST_L2, 5)[1:-1, 1:-1]
    count, region = cv2.connectedComponents((radius > NECK * radius.max()).astype(np.uint8), connectivity=4)
    thick = [r for r in range(1, count) if radius[region == r].max() > 0.6 * radius.max()]
    return _grown(mask, region, thick, range(1, len(thick) + 1))


def _grown(mask: Bool[np.ndarray, "h w"], region, chosen, numbers) -> list[Bool[np.ndarray, "h w"]]:
    """Share a mask out among the chosen regions: each pixel goes to the part, numbered from 1, of the nearest one."""
    seeds = np.zeros(region.max() + 1, np.int32)
    seeds[chosen] = numbers
    seeds = seeds[region]
    away = (seeds == 0).astype(np.uint8)
    _, nearest = cv2.distanceTransformWithLabels(away, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    number = np.zeros(nearest.max() + 1, np.int32)
    number[nearest[seeds > 0]] = seeds[seeds > 0]
    return [mask & (number[nearest] == n) for n in range(1, seeds.max() + 1)]
