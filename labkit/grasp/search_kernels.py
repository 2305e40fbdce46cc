"""The search for grips on maps of heights, compiled by numba; `labkit.grasp` explains the plan and calls it.

Seen from above, a hand that comes straight down is an underside: nothing below the tips under its fingers, a slot
between them, the palm over it all. It can go down until `height - underside` of what it covers meets the tips, so
everything here is a map of heights: float32 metres, -inf for an empty cell. A map is turned to a yaw: its columns run
along a, the direction in which the jaws close, its rows along b, across the pads. Nothing here holds Python's lock, so
that several targets are searched at once.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

CELL = 0.004  # edge of a cell, metres
COLUMNS = 84  # of a map: +-0.168 m, half a palm beside the furthest grip
ROWS = 39  # +-0.078 m, half the hand's body beside the furthest grip
REACH = 12  # rows to each side of the target's middle in which grips are tried
STRIDE = 2  # rows from one try to the next
BAND = 4  # rows: the best grip of each such band is kept
STEP = 0.006  # metres between the tip heights that are tried
SCAN = 8  # cells that an open jaw may stand off the target
SLOT = 5  # cells: in a narrower gap of the target there is no room for a finger
LEAST_DEPTH = 0.005  # metres that the tips must reach below the top of what they grip
WIDE, SHALLOW, FINGERS, PALM = range(4)  # why a grip was dropped, as `search` counts them


class Hand(NamedTuple):
    """The gripper as the kernels need it: metres, margins included; heights are above the tips.

    pad, finger, palm_half, body_half: half widths across. underside: of a finger, one height a cell outwards from its
    pad, float32.
    """

    opening: float
    pad: float
    finger: float
    thickness: float
    underside: np.ndarray
    palm: float
    palm_half: float
    body: float
    body_half: float
    palm_reach: float


class Grip(NamedTuple):
    """A grip found on the map: yaw, row, height of the tips, and from where to where each pad may start; metres."""

    yaw: float
    b: float
    tip: float
    left_near: float
    left_far: float
    right_near: float
    right_far: float


@njit(cache=True, nogil=True)
def middle_of_area(points):
    """The middle of what points cover, seen from above: every cell counts once, however many points it has."""
    x, y = points[:, 0].min(), points[:, 1].min()
    n = int((points[:, 0].max() - x) / CELL) + 1
    m = int((points[:, 1].max() - y) / CELL) + 1
    seen = np.zeros((n, m), np.bool_)
    sum_x, sum_y, count = 0.0, 0.0, 0
    for i in range(len(points)):
        c, r = int((points[i, 0] - x) / CELL), int((points[i, 1] - y) / CELL)
        if not seen[c, r]:
            seen[c, r] = True
            sum_x, sum_y, count = sum_x + c, sum_y + r, count + 1
    return np.array([x + (sum_x / count + 0.5) * CELL, y + (sum_y / count + 0.5) * CELL])


@njit(cache=True, nogil=True)
def points_near(points, x, y, radius):
    """Keep the points of a square around (x, y)."""
    keep = np.empty(len(points), np.int64)
    n = 0
    for i in range(len(points)):
        if abs(points[i, 0] - x) < radius and abs(points[i, 1] - y) < radius:
            keep[n] = i
            n += 1
    return points[keep[:n]]


@njit(cache=True, nogil=True)
def hidden_points(scene, x, y, radius, camera, floor):
    """Bound from above what the camera cannot see: one point (K, 3) a cell without a reading, if higher than `floor`.

    A ray that grazes the top of what is seen passes over the cells behind it; what stood higher there would have been
    seen. So walk from the cell towards the camera to the first one that was seen, and use that along a ray
    tau = (camera height - z) / distance over ground stays the same.
    """
    n = int(2.0 * radius / CELL)
    tau = np.full((n, n), np.inf)
    for i in range(len(scene)):
        dx, dy = scene[i, 0] - x + radius, scene[i, 1] - y + radius
        if 0.0 <= dx < n * CELL and 0.0 <= dy < n * CELL:
            r, c = int(dy / CELL), int(dx / CELL)
            distance = max(np.sqrt((scene[i, 0] - camera[0]) ** 2 + (scene[i, 1] - camera[1]) ** 2), CELL)
            tau[r, c] = min(tau[r, c], (camera[2] - scene[i, 2]) / distance)
    out = np.empty((n * n, 3))
    count = 0
    for r in range(n):
        for c in range(n):
            if tau[r, c] < np.inf:
                continue
            px, py = x - radius + (c + 0.5) * CELL, y - radius + (r + 0.5) * CELL
            dx, dy = camera[0] - px, camera[1] - py
            step = max(abs(dx), abs(dy), CELL)
            grazed = np.inf
            u, v = c + 0.5, r + 0.5
            while grazed == np.inf and 0.0 <= u < n and 0.0 <= v < n:
                grazed = tau[int(v), int(u)]
                u, v = u + dx / step, v + dy / step
            z = camera[2] - grazed * np.sqrt(dx**2 + dy**2)
            if z > floor:
                out[count, 0], out[count, 1], out[count, 2] = px, py, z
                count += 1
    return out[:count]


@njit(cache=True, nogil=True)
def surroundings(target, scene, radius, camera, lowest):
    """What matters around a target: its middle (x, y), the points near it that are higher than `lowest`, hidden ones.

    camera: its position; an empty array if nobody knows it, and then nothing is known to be hidden.
    """
    centre = middle_of_area(target)
    around = points_near(scene, centre[0], centre[1], radius)
    hidden = np.empty((0, 3))
    if len(camera):
        hidden = hidden_points(around, centre[0], centre[1], radius, camera, lowest)
    return centre, around[around[:, 2] > lowest], hidden


@njit(cache=True, nogil=True)
def fill(heights, points, x, y, cos, sin):
    """Make a map, turned by a yaw around (x, y): the highest point of each cell."""
    heights[:] = -np.inf
    for i in range(len(points)):
        dx, dy = points[i, 0] - x, points[i, 1] - y
        u, v = (dx * cos + dy * sin) / CELL + COLUMNS / 2, (dy * cos - dx * sin) / CELL + ROWS / 2
        if 0.0 <= u < COLUMNS and 0.0 <= v < ROWS:
            heights[int(v), int(u)] = max(heights[int(v), int(u)], points[i, 2])


@njit(cache=True, nogil=True)
def profile(heights, row, half, first, last, out):
    """Look at columns first to last of a map from the side: the highest cell within `half` metres of a row's middle."""
    out[:] = -np.inf
    n = int(half / CELL + 0.5)
    for r in range(max(row - n, 0), min(row + n + 1, ROWS)):
        for c in range(first, last):
            out[c] = heights[r, c] if heights[r, c] > out[c] else out[c]


@njit(cache=True, nogil=True)
def finger_floor(heights, underside, first, last, left, right):
    """How low the tips can go with a pad at the left edge of columns first to last: left finger, right finger."""
    left[:], right[:] = np.inf, np.inf  # beyond these there is no place
    left[first:last], right[first:last] = -np.inf, -np.inf
    for k in range(len(underside)):
        for edge in range(first, last):
            z = heights[edge - 1 - k] - underside[k]
            left[edge] = z if z > left[edge] else left[edge]
            z = heights[edge + k] - underside[k]
            right[edge] = z if z > right[edge] else right[edge]


@njit(cache=True, nogil=True)
def find_runs(heights, first, last, tip, runs):
    """Find the stretches of columns higher than the tips, as rows of `runs`: first column, one past the last; how many.

    A gap too narrow for a finger does not end a stretch.
    """
    n, gap = 0, SLOT
    for c in range(first, last):
        if heights[c] <= tip:
            gap += 1
            continue
        if gap >= SLOT:
            if n == len(runs):
                break
            runs[n, 0] = c
            n += 1
        runs[n - 1, 1] = c + 1
        gap = 0
    return n


@njit(cache=True, nogil=True)
def free_side(floors, edge, step, tip):
    """Where may a pad start, from an edge of the target outwards (step -1 or 1)? The nearest place and the furthest."""
    for near in range(edge, edge + 3 * step, step):
        if 0 <= near < COLUMNS and floors[near] <= tip:
            far = near
            while abs(far + step - edge) <= SCAN and 0 <= far + step < COLUMNS and floors[far + step] <= tip:
                far += step
            return near, far
    return -1, -1


@njit(cache=True, nogil=True)
def end_height(heights, first, last):
    """The lower of the two ends of a stretch of columns, each the higher of its two outermost ones."""
    left, right = heights[first], heights[last]
    if last > first:
        left, right = max(left, heights[first + 1]), max(right, heights[last - 1])
    return min(left, right)


@njit(cache=True, nogil=True)
def hand_fits(heights, row, middle, tip, hand):
    """Is there room for the palm, and for the wider body behind it, with the tips at a height?"""
    palm_rows, body_rows = int(hand.palm_half / CELL + 0.5), int(hand.body_half / CELL + 0.5)
    n = int(np.ceil(hand.palm_reach / CELL)) + 1  # the jaws need not open evenly around the middle
    for r in range(max(row - body_rows, 0), min(row + body_rows + 1, ROWS)):
        limit = tip + (hand.palm if abs(r - row) <= palm_rows else hand.body)
        top = heights[r, middle]
        for c in range(max(middle - n, 0), min(middle + n + 1, COLUMNS)):
            top = heights[r, c] if heights[r, c] > top else top
        if top > limit:
            return False
    return True


@njit(cache=True, nogil=True)
def search(target, scene, hidden, centre, yaws, lowest, hand, weights):
    """Try every yaw, row and tip height, and every pair of edges of the target there; keep the best of each few rows.

    centre: x, y of the target's middle. lowest: height of the lowest tips. weights: of the shortcomings shallow, wide,
    offset, tight and shadow. Returns Grips as rows, their rough costs, and counts of what was dropped and why.
    """
    x, y = centre
    bands = 2 * REACH // BAND + 1
    costs = np.full((len(yaws), bands), np.inf)
    grips = np.empty((len(yaws), bands, 7))
    dropped = np.zeros(4, np.int64)
    maps = np.empty((3, ROWS, COLUMNS), np.float32)
    lines = np.empty((7, COLUMNS), np.float32)
    highest = scene[:, 2].max() if len(scene) else -np.inf
    for n, yaw in enumerate(yaws):
        cos, sin = np.cos(yaw), np.sin(yaw)
        fill(maps[0], target, x, y, cos, sin)
        fill(maps[1], scene, x, y, cos, sin)
        fill(maps[2], hidden, x, y, cos, sin)
        for row in range(ROWS // 2 - REACH, ROWS // 2 + REACH + 1, STRIDE):
            band = (row - ROWS // 2 + REACH) // BAND
            cost, grip = search_row(maps, lines, row, lowest, highest, hand, weights, costs[n, band], dropped)
            if cost < costs[n, band]:
                costs[n, band] = cost
                grips[n, band, 0], grips[n, band, 1] = yaw, (row - ROWS // 2) * CELL
                for i in range(5):
                    grips[n, band, 2 + i] = grip[i]
    found = costs.ravel() < np.inf
    return grips.reshape(-1, 7)[found], costs.ravel()[found], dropped


@njit(cache=True, nogil=True)
def search_row(maps, lines, row, lowest, highest, hand, weights, best, dropped):
    """Find the best grip of one row that costs less than `best`: its cost, and tip, left and right places of a Grip."""
    material, around, shadow, left, right, dark_left, dark_right = lines
    grip = (0.0, 0.0, 0.0, 0.0, 0.0)
    profile(maps[0], row, hand.pad, 0, COLUMNS, material)
    top = material.max()
    if top <= lowest + LEAST_DEPTH:
        dropped[SHALLOW] += top > lowest
        return np.inf, grip
    begin, stop = 0, COLUMNS
    while material[begin] <= lowest:
        begin += 1
    while material[stop - 1] <= lowest:
        stop -= 1
    thick = len(hand.underside)
    first, last = max(begin - SCAN, thick), min(stop + SCAN + 1, COLUMNS - thick)
    profile(maps[1], row, hand.finger, first - thick, last + thick, around)
    profile(maps[2], row, hand.finger, first - thick, last + thick, shadow)
    finger_floor(around, hand.underside, first, last, left, right)
    finger_floor(shadow, hand.underside, first, last, dark_left, dark_right)
    runs = np.empty((4, 2), np.int64)
    b = (row - ROWS // 2) * CELL
    tip = lowest - STEP
    while tip + STEP < top - LEAST_DEPTH:
        tip += STEP
        for i in range(find_runs(material, begin, stop, tip, runs)):
            for j in range(i + 1):
                first, last = runs[j, 0], runs[i, 1] - 1
                width = (last - first) * CELL  # between the cells' middles
                depth = end_height(material, first, last) - tip
                if width > hand.opening or depth < LEAST_DEPTH:
                    dropped[WIDE if width > hand.opening else SHALLOW] += 1
                    continue
                offset = np.sqrt((((first + last + 1) / 2 - COLUMNS / 2) * CELL) ** 2 + b**2)
                cost = weights[0] * lack(depth, 0.02) + weights[1] * width / 0.08 + weights[2] * min(offset / 0.04, 1.0)
                if cost >= best:
                    continue
                left_near, left_far = free_side(left, first, -1, tip)
                right_near, right_far = free_side(right, last + 1, 1, tip)
                if left_near < 0 or right_near < 0 or (right_near - left_near - 2) * CELL > hand.opening:
                    dropped[FINGERS] += 1
                    continue
                spare = min(min(first - left_far, right_far - last - 1) * CELL, (hand.opening - width) / 2)
                dark = max(dark_left[left_near], dark_right[right_near]) - tip
                cost += weights[3] * lack(spare, 0.01) + weights[4] * (1.0 - lack(dark, 0.03))
                if cost >= best:
                    continue
                if highest > tip + hand.palm and not hand_fits(maps[1], row, (first + last + 1) // 2, tip, hand):
                    dropped[PALM] += 1
                    continue
                best = cost
                grip = (tip, place(left_near), place(left_far), place(right_near), place(right_far))
    return best, grip


@njit(cache=True, nogil=True)
def lack(value, enough):
    """How much of `enough` is missing: 0 none, 1 all."""
    return 1.0 - min(max(value, 0.0) / enough, 1.0)


@njit(cache=True, nogil=True)
def place(column):
    """Where the left edge of a column lies along the jaws, metres."""
    return (column - COLUMNS / 2) * CELL
