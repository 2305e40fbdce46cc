"""The search for grips on maps of heights, compiled by numba. `labkit.grasp.planner` explains the plan and calls it.

Seen from above, a hand that comes straight down is an underside: nothing below the tips under its fingers, a slot
between them, the palm over it all. The hand can go down until `height - underside` of what it covers meets the tips.
So everything here is a map of heights: float32 metres, -inf for an empty cell. A map is turned to a yaw: its columns
run along a, the direction in which the jaws close, its rows along b, across the pads. The hand's size sets the size of
the cells and of the maps. Nothing here holds Python's lock, so that several targets are searched at once.
"""

from typing import NamedTuple

import numpy as np

from labkit.support.compiled import kernel, part

# In cells, of which CELLS cover the open gripper.
CELLS = 20
REACH = 12  # rows to each side of the target's middle in which grips are tried
STRIDE = 2  # rows from one try to the next
BAND = 4  # rows: the best grip of each such band is kept
OUTWARDS = 15  # columns to each side of the target's middle in which the middle of a grip may lie
STEP = 1.5  # between the tip heights that are tried
SCAN = 8  # how far a pad of the open jaw may stand off the target
LEAST_DEPTH = 1.25  # how far the tips must reach below the top of what they grip
WIDE, SHALLOW, FINGERS, PALM, SLIPPERY = range(5)  # why a grip was dropped, as `dropped` counts them


class Shortcomings(NamedTuple):
    """One number for each way in which a grip can be bad: a weight, or the length in metres that is full or enough.

    shallow: the tips reach too little below the top. wide: the target fills the jaws. tight: little air beside the
    target. offset: far from the target's middle. shadow: fingers and palm enter what the camera did not see. short:
    the pads touch little. skew: the two pads touch at different places across. unseen: the target may go on behind
    what the camera saw.
    """

    shallow: float
    wide: float
    tight: float
    offset: float
    shadow: float
    short: float
    skew: float
    unseen: float


class Hand(NamedTuple):
    """The gripper as the kernels need it: metres, margins included. Heights count from the tips upwards.

    cell: edge of a cell. columns, rows: size of a map. slot: how many empty cells a finger needs. pad, finger,
    palm_half, body_half: half widths across the pads. underside: of a finger, one height per cell outwards from its
    pad, float32. palm_reach: half the palm's length. spare, least: air beside the target that an open jaw should and
    must leave.
    """

    cell: float
    columns: int
    rows: int
    slot: int
    opening: float
    pad: float
    finger: float
    thickness: float
    underside: np.ndarray
    palm: float
    palm_half: float
    palm_reach: float
    body: float
    body_half: float
    spare: float
    least: float


class Rules(NamedTuple):
    """What holds for every grip of a target: the height of the lowest tips, the hand, and what counts how much."""

    lowest: float
    hand: Hand
    weights: Shortcomings
    enough: Shortcomings


class Maps(NamedTuple):
    """Maps of one yaw, float32 (rows, columns): the target, the scene, what is hidden; highest: of the whole scene."""

    target: np.ndarray
    scene: np.ndarray
    hidden: np.ndarray
    highest: float


class Row(NamedTuple):
    """One row of the maps from the side: float32 heights by column.

    number: the row's; b: its distance from the target's middle, metres. begin, stop: the columns that hold what can be
    gripped. material: the target between the pads. left, right: how low the tips of a finger can go with its pad at a
    column's left edge; dark_left, dark_right: the same among what is hidden.
    """

    number: int
    b: float
    begin: int
    stop: int
    material: np.ndarray
    left: np.ndarray
    right: np.ndarray
    dark_left: np.ndarray
    dark_right: np.ndarray


class Pads(NamedTuple):
    """The columns at which the pads may be, nearest to the target and furthest from it; -1: nowhere."""

    left_near: int
    left_far: int
    right_near: int
    right_far: int


NOWHERE = Pads(-1, -1, -1, -1)
# A grip found on the map, in radians and metres; a and b count from the target's middle.
GRIP = np.dtype(
    [
        ("yaw", float),  # direction in which the jaws close
        ("b", float),  # across the jaws
        ("tip", float),  # height of the tips
        ("left_near", float),  # where the left pad may be, nearest to the target
        ("left_far", float),
        ("right_near", float),
        ("right_far", float),
    ]
)
GRIP = np.dtype((np.record, GRIP))  # fields are attributes where nothing is compiled, too


def middle_of_area(points, cell):
    """Find the middle of what points cover, seen from above: every cell counts once, however many points it has."""
    corner = points[:, :2].min(axis=0)
    cells = ((points[:, :2] - corner) / cell).astype(int)
    seen = np.zeros(cells.max(axis=0) + 1, bool)
    seen[tuple(cells.T)] = True
    return corner + (np.argwhere(seen).mean(axis=0) + 0.5) * cell


def hidden_points(scene, x, y, radius, cell, camera, floor):
    """Bound from above what the camera cannot see: one point (K, 3) per cell without a reading, if above `floor`.

    A ray that grazes the top of what is seen passes over the cells behind it; what stood higher there would have been
    seen. So walk from the cell towards the camera to the first one that was seen, and use that along a ray
    tau = (camera height - z) / distance over ground stays the same.
    """
    n = int(2.0 * radius / cell)
    tau, hidden = np.full((n, n), np.inf), np.empty((n * n, 3))
    return hidden[: cast_shadows(scene, x, y, radius, cell, camera, floor, tau, hidden)]


@kernel
def cast_shadows(scene, x, y, radius, cell, camera, floor, tau, hidden):
    """Fill tau (n, n) by cell, infinite without a reading, and `hidden`; returns how many hidden points there are."""
    n = len(tau)
    for i in range(len(scene)):
        dx, dy = scene[i, 0] - x + radius, scene[i, 1] - y + radius
        if 0.0 <= dx < n * cell and 0.0 <= dy < n * cell:
            r, c = int(dy / cell), int(dx / cell)
            distance = max(np.sqrt((scene[i, 0] - camera[0]) ** 2 + (scene[i, 1] - camera[1]) ** 2), cell)
            tau[r, c] = min(tau[r, c], (camera[2] - scene[i, 2]) / distance)
    count = 0
    for r in range(n):
        for c in range(n):
            if tau[r, c] < np.inf:
                continue
            px, py = x - radius + (c + 0.5) * cell, y - radius + (r + 0.5) * cell
            dx, dy = camera[0] - px, camera[1] - py
            step = max(abs(dx), abs(dy), cell)
            grazed = np.inf
            u, v = c + 0.5, r + 0.5
            while grazed == np.inf and 0.0 <= u < n and 0.0 <= v < n:
                grazed = tau[int(v), int(u)]
                u, v = u + dx / step, v + dy / step
            z = camera[2] - grazed * np.sqrt(dx**2 + dy**2)
            if z > floor:
                hidden[count, 0], hidden[count, 1], hidden[count, 2] = px, py, z
                count += 1
    return count


def surroundings(target, scene, camera, lowest, hand):
    """Collect what matters around a target: its middle (x, y), the points near it above `lowest`, and hidden points.

    camera: its position, or None if it is unknown; then nothing counts as hidden.
    """
    centre = middle_of_area(target, hand.cell)
    radius = (hand.columns + 1) / 2 * hand.cell
    hidden = np.empty((0, 3))
    if camera is not None:
        hidden = hidden_points(scene, *centre, radius, hand.cell, camera, lowest)
    raised = scene.compress(scene[:, 2] > lowest, axis=0)
    x, y = raised[:, 0] - centre[0], raised[:, 1] - centre[1]
    return centre, raised.compress((np.abs(x) < radius) & (np.abs(y) < radius), axis=0), hidden


@part
def fill(heights, points, x, y, cos, sin, cell):
    """Make a map, turned by a yaw around (x, y): the highest point of each cell."""
    rows, columns = heights.shape
    heights[:] = -np.inf
    for i in range(len(points)):
        dx, dy = points[i, 0] - x, points[i, 1] - y
        u, v = (dx * cos + dy * sin) / cell + columns / 2, (dy * cos - dx * sin) / cell + rows / 2
        if 0.0 <= u < columns and 0.0 <= v < rows:
            heights[int(v), int(u)] = max(heights[int(v), int(u)], points[i, 2])


@part
def profile(heights, row, n, first, last, out):
    """Look at columns first to last of a map from the side: the highest of the cells within n rows of a row."""
    out[:] = -np.inf
    for r in range(max(row - n, 0), min(row + n + 1, len(heights))):
        for c in range(first, last):
            out[c] = heights[r, c] if heights[r, c] > out[c] else out[c]


@part
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


@part
def find_runs(heights, first, last, tip, slot, runs):
    """Find the stretches of columns higher than the tips, as rows of `runs`: first column, one past the last; how many.

    A gap too narrow for a finger does not end a stretch.
    """
    n, gap = 0, slot
    for c in range(first, last):
        if heights[c] <= tip:
            gap += 1
            continue
        if gap >= slot:
            if n == len(runs):
                break
            runs[n, 0] = c
            n += 1
        runs[n - 1, 1] = c + 1
        gap = 0
    return n


@part
def free_side(floors, edge, step, tip):
    """Where may a pad start, from an edge of the target outwards (step -1 or 1)? The nearest place and the furthest."""
    for near in range(edge, edge + 3 * step, step):
        if 0 <= near < len(floors) and floors[near] <= tip:
            far = near
            while abs(far + step - edge) <= SCAN and 0 <= far + step < len(floors) and floors[far + step] <= tip:
                far += step
            return near, far
    return -1, -1


@part
def end_height(heights, first, last):
    """The lower of the two ends of a stretch of columns, each the higher of its two outermost ones."""
    left, right = heights[first], heights[last]
    if last > first:
        left, right = max(left, heights[first + 1]), max(right, heights[last - 1])
    return min(left, right)


@part
def hand_fits(heights, row, middle, tip, hand):
    """Is there room for the palm, and for the wider body behind it, with the tips at a height?"""
    rows, columns = heights.shape
    palm_rows, body_rows = int(hand.palm_half / hand.cell + 0.5), int(hand.body_half / hand.cell + 0.5)
    n = int(np.ceil(hand.palm_reach / hand.cell)) + 1  # the jaws need not open evenly around the middle
    for r in range(max(row - body_rows, 0), min(row + body_rows + 1, rows)):
        limit = tip + (hand.palm if abs(r - row) <= palm_rows else hand.body)
        top = heights[r, middle]
        for c in range(max(middle - n, 0), min(middle + n + 1, columns)):
            top = heights[r, c] if heights[r, c] > top else top
        if top > limit:
            return False
    return True


def search(target, scene, hidden, centre, yaws, rules):
    """Try every yaw, row and tip height, and every pair of edges of the target there; keep the best of each few rows.

    centre: x, y of the target's middle. Returns GRIPs, their rough costs (infinite for a place without a grip), and
    counts of what was dropped and why.
    """
    hand = rules.hand
    bands = 2 * REACH // BAND + 1
    costs, grips = np.full((len(yaws), bands), np.inf), np.empty((len(yaws), bands), GRIP)
    grips["yaw"] = yaws[:, None]
    dropped = np.zeros(5, np.int64)
    heights = np.empty((3, hand.rows, hand.columns), np.float32)
    lines = np.empty((7, hand.columns), np.float32)
    maps = Maps(*heights, highest=scene[:, 2].max(initial=-np.inf))
    search_yaws(target, scene, hidden, centre, rules, maps, lines, grips, costs, dropped)
    return grips.ravel(), costs.ravel(), dropped


@kernel
def search_yaws(target, scene, hidden, centre, rules, maps, lines, grips, costs, dropped):
    """Write the best grip of each yaw and band of rows, and its cost, into `grips` and `costs`, (yaws, bands)."""
    x, y, cell = centre[0], centre[1], rules.hand.cell
    for n in range(len(grips)):
        cos, sin = np.cos(grips[n, 0].yaw), np.sin(grips[n, 0].yaw)
        fill(maps.target, target, x, y, cos, sin, cell)
        fill(maps.scene, scene, x, y, cos, sin, cell)
        fill(maps.hidden, hidden, x, y, cos, sin, cell)
        for offset in range(-REACH, REACH + 1, STRIDE):
            i, number = (offset + REACH) // BAND, rules.hand.rows // 2 + offset
            costs[n, i] = search_row(maps, lines, number, rules, costs[n, i], grips[n, i], dropped)


@part
def search_row(maps, lines, number, rules, best, grip, dropped):
    """Find the best grip of one row; if it costs less than `best`, write it into `grip`. Returns the lower cost.

    lines: room for the row's heights, (7, columns).
    """
    hand, lowest = rules.hand, rules.lowest
    cell, least_depth = hand.cell, LEAST_DEPTH * hand.cell
    profile(maps.target, number, int(hand.pad / cell + 0.5), 0, hand.columns, lines[0])
    top = lines[0, 0]
    for c in range(1, hand.columns):
        top = max(top, lines[0, c])
    if top <= lowest + least_depth:
        dropped[SHALLOW] += top > lowest
        return best
    row = from_the_side(maps, lines, number, rules)
    runs = np.empty((4, 2), np.int64)
    tip = lowest - STEP * cell
    while tip + STEP * cell < top - least_depth:
        tip += STEP * cell
        for i in range(find_runs(row.material, row.begin, row.stop, tip, hand.slot, runs)):
            for j in range(i + 1):
                cost, pads = rough_cost(maps, row, runs[j, 0], runs[i, 1] - 1, tip, rules, best, dropped)
                if cost < best:
                    best = cost
                    grip.b, grip.tip = row.b, tip
                    middle = hand.columns / 2
                    grip.left_near, grip.left_far = (pads.left_near - middle) * cell, (pads.left_far - middle) * cell
                    grip.right_near, grip.right_far = (
                        (pads.right_near - middle) * cell,
                        (pads.right_far - middle) * cell,
                    )
    return best


@part
def from_the_side(maps, lines, number, rules):
    """Look at a row from the side; lines: its heights, of which the first are the target's already."""
    hand = rules.hand
    material, around, shadow = lines[0], lines[1], lines[2]
    left, right, dark_left, dark_right = lines[3], lines[4], lines[5], lines[6]
    begin, stop = 0, hand.columns
    while material[begin] <= rules.lowest:
        begin += 1
    while material[stop - 1] <= rules.lowest:
        stop -= 1
    thick, finger_rows = len(hand.underside), int(hand.finger / hand.cell + 0.5)
    first, last = max(begin - SCAN, thick), min(stop + SCAN + 1, hand.columns - thick)
    profile(maps.scene, number, finger_rows, first - thick, last + thick, around)
    profile(maps.hidden, number, finger_rows, first - thick, last + thick, shadow)
    finger_floor(around, hand.underside, first, last, left, right)
    finger_floor(shadow, hand.underside, first, last, dark_left, dark_right)
    b = (number - hand.rows // 2) * hand.cell
    return Row(number, b, begin, stop, material, left, right, dark_left, dark_right)


@part
def rough_cost(maps, row, first, last, tip, rules, best, dropped):
    """The cost of gripping columns first to last of a row with the tips at a height, and where the pads may be.

    The cost is infinite if nothing can be gripped so, or not for less than `best`.
    """
    hand, weights, enough = rules.hand, rules.weights, rules.enough
    cell, middle = hand.cell, (first + last + 1) / 2
    width = (last - first) * cell  # between the cells' middles
    depth = end_height(row.material, first, last) - tip
    if width > hand.opening or depth < LEAST_DEPTH * cell:
        dropped[WIDE if width > hand.opening else SHALLOW] += 1
        return np.inf, NOWHERE
    offset = np.sqrt(((middle - hand.columns / 2) * cell) ** 2 + row.b**2)
    cost = weights.shallow * lack(depth, enough.shallow) + weights.wide * width / enough.wide
    cost += weights.offset * (1.0 - lack(offset, enough.offset))
    if cost >= best:
        return np.inf, NOWHERE
    left_near, left_far = free_side(row.left, first, -1, tip)
    right_near, right_far = free_side(row.right, last + 1, 1, tip)
    if left_near < 0 or right_near < 0 or (right_near - left_near - 2) * cell > hand.opening:
        dropped[FINGERS] += 1
        return np.inf, NOWHERE
    spare = min(min(first - left_far, right_far - last - 1) * cell, (hand.opening - width) / 2)
    dark = max(row.dark_left[left_near], row.dark_right[right_near]) - tip
    cost += weights.tight * lack(spare, enough.tight)
    cost += weights.shadow * (1.0 - lack(dark, 1.5 * enough.shadow))
    if cost >= best:
        return np.inf, NOWHERE
    if maps.highest > tip + hand.palm and not hand_fits(maps.scene, row.number, int(middle), tip, hand):
        dropped[PALM] += 1
        return np.inf, NOWHERE
    return cost, Pads(left_near, left_far, right_near, right_far)


@part
def lack(value, enough):
    """How much of `enough` is missing: 0 none, 1 all."""
    return 1.0 - min(max(value, 0.0) / enough, 1.0)
