"""The search for grips on maps of heights, compiled by numba. `labkit.grasp.planner` explains the plan and calls it.

Seen from above, a hand that comes straight down is an underside: nothing below the tips under its fingers, a slot
between them, the palm over it all. The hand can go down until `height - underside` of what it covers meets the tips.
So everything here is a map of heights: float32 metres, -inf for an empty cell. A map is turned to a yaw: its columns
run along a, the direction in which the jaws close, its rows along b, across the pads. The hand's size sets the size of
the cells and of the maps. Nothing here holds Python's lock, so that several targets are searched at once.
"""

from typing import NamedTuple

import numpy as np

from labkit.support.compiled import inline, kernel

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
    """The gripper as the kernels need it, metres; a margin is in all but opening, pad and thickness.

    Heights count from the tips upwards. opening: the widest between the pads. thickness: of a tip, along the closing
    direction. palm, body: heights of their undersides. cell: edge of a cell. columns, rows: size of a map. slot: how
    many empty cells a finger needs. pad, finger, palm_half, body_half: half widths across the pads. underside: of a
    finger, one height per cell outwards from its pad, float32. palm_reach: half the palm's length. spare, least: air
    beside the target that an open jaw should and must leave.
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
    """Maps of one yaw, float32 (rows, columns): target, scene, what is hidden; highest: of the scene near by."""

    target: np.ndarray
    scene: np.ndarray
    hidden: np.ndarray
    highest: float


class Turn(NamedTuple):
    """How points become a map: turned by a yaw around (x, y), into cells of so many metres."""

    x: float
    y: float
    cos: float
    sin: float
    cell: float


class Side(NamedTuple):
    """A row of the maps from the side, float32 heights by column.

    material: the target between the pads. around, shadow: the scene, and what is hidden, under a finger. left, right:
    how low the tips of a finger can go with its pad at a column's left edge; dark_left, dark_right: the same among what
    is hidden.
    """

    material: np.ndarray
    around: np.ndarray
    shadow: np.ndarray
    left: np.ndarray
    right: np.ndarray
    dark_left: np.ndarray
    dark_right: np.ndarray


class Stretch(NamedTuple):
    """What a grip may close on: columns first to last of row `row`, with the tips at a height.

    b: the row's distance from the target's middle, metres.
    """

    row: int
    b: float
    first: int
    last: int
    tip: float


# A grip, in radians and metres; a and b count from the target's middle along and across the closing direction.
GRIP = np.dtype(
    [
        ("yaw", float),  # direction in which the jaws close
        ("b", float),
        ("tip", float),  # height of the tips
        ("left_near", float),  # where the left pad may be along a, nearest to the target
        ("left_far", float),
        ("right_near", float),
        ("right_far", float),
        ("a", float),  # middle of the jaws, once it is measured
        ("opening", float),  # between the pads, likewise
        ("cost", float),  # infinite where there is no grip
    ]
)
GRIP = np.dtype((np.record, GRIP))  # fields are attributes where nothing is compiled, too


@inline
def fill(heights, points, turn):
    """Make a map: the highest point of each cell."""
    rows, columns = heights.shape
    heights[:] = -np.inf
    for i in range(len(points)):
        dx, dy = points[i, 0] - turn.x, points[i, 1] - turn.y
        u = (dx * turn.cos + dy * turn.sin) / turn.cell + columns / 2
        v = (dy * turn.cos - dx * turn.sin) / turn.cell + rows / 2
        if 0.0 <= u < columns and 0.0 <= v < rows:
            heights[int(v), int(u)] = max(heights[int(v), int(u)], points[i, 2])


@inline
def profile(heights, row, n, columns, out):
    """Look at a map from the side: the highest of the cells within n rows of a row, from one column to another."""
    out[:] = -np.inf
    for r in range(max(row - n, 0), min(row + n + 1, len(heights))):
        for c in range(columns[0], columns[1]):
            out[c] = heights[r, c] if heights[r, c] > out[c] else out[c]


@inline
def finger_floor(heights, underside, columns, left, right):
    """How low the tips can go with a pad at the left edge of these columns: left finger, right finger."""
    first, last = columns
    left[:], right[:] = np.inf, np.inf  # beyond these there is no place
    left[first:last], right[first:last] = -np.inf, -np.inf
    for k in range(len(underside)):
        for edge in range(first, last):
            z = heights[edge - 1 - k] - underside[k]
            left[edge] = z if z > left[edge] else left[edge]
            z = heights[edge + k] - underside[k]
            right[edge] = z if z > right[edge] else right[edge]


@inline
def find_runs(heights, tip, slot, runs):
    """Find the stretches of columns higher than the tips, as rows of `runs`: first column, one past the last; how many.

    A gap too narrow for a finger does not end a stretch.
    """
    n, gap = 0, slot
    for c in range(len(heights)):
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


@inline
def free_side(floors, edge, step, tip):
    """Where may a pad start, from an edge of the target outwards (step -1 or 1)? The nearest place and the furthest."""
    for near in range(edge, edge + 3 * step, step):
        if 0 <= near < len(floors) and floors[near] <= tip:
            far = near
            while abs(far + step - edge) <= SCAN and 0 <= far + step < len(floors) and floors[far + step] <= tip:
                far += step
            return near, far
    return -1, -1


@inline
def end_height(heights, first, last):
    """The lower of the two ends of a stretch of columns, each the higher of its two outermost ones."""
    left, right = heights[first], heights[last]
    if last > first:
        left, right = max(left, heights[first + 1]), max(right, heights[last - 1])
    return min(left, right)


@inline
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


def search(seen, yaws, rules):
    """Try every yaw, row and tip height, and every pair of edges of the target there; keep the best of each few rows.

    seen: `Surroundings`. Returns GRIPs with their rough costs, and counts of what was dropped and why.
    """
    grips, dropped = np.zeros((len(yaws), 2 * REACH // BAND + 1), GRIP), np.zeros(5, np.int64)
    grips["yaw"], grips["cost"] = yaws[:, None], np.inf
    heights = np.empty((3, rules.hand.rows, rules.hand.columns), np.float32)
    maps = Maps(*heights, highest=seen.near[:, 2].max(initial=-np.inf))
    search_yaws(seen, maps, rules, grips, dropped)
    return grips.ravel(), dropped


@kernel
def search_yaws(seen, maps, rules, grips, dropped):
    """Write the best grip of each yaw and band of rows into `grips`, (yaws, bands)."""
    lines = np.empty((7, rules.hand.columns), np.float32)
    side = Side(lines[0], lines[1], lines[2], lines[3], lines[4], lines[5], lines[6])
    for n in range(len(grips)):
        yaw = grips[n, 0].yaw
        turn = Turn(seen.centre[0], seen.centre[1], np.cos(yaw), np.sin(yaw), rules.hand.cell)
        fill(maps.target, seen.target, turn)
        fill(maps.scene, seen.near, turn)
        fill(maps.hidden, seen.hidden, turn)
        for offset in range(-REACH, REACH + 1, STRIDE):
            search_row(offset, maps, side, rules, grips[n, (offset + REACH) // BAND], dropped)


@inline
def search_row(offset, maps, side, rules, grip, dropped):
    """Replace `grip` by the best one of the row that is `offset` cells from the middle, if that costs less."""
    hand, lowest = rules.hand, rules.lowest
    cell, least_depth, row = hand.cell, LEAST_DEPTH * hand.cell, hand.rows // 2 + offset
    material = side.material
    profile(maps.target, row, int(hand.pad / cell + 0.5), (0, hand.columns), material)
    top = material[0]
    for c in range(1, hand.columns):
        top = max(top, material[c])
    if top <= lowest + least_depth:
        dropped[SHALLOW] += top > lowest
        return
    look_from_the_side(row, maps, side, rules)
    runs = np.empty((4, 2), np.int64)
    tip = lowest - STEP * cell
    while tip + STEP * cell < top - least_depth:
        tip += STEP * cell
        for i in range(find_runs(material, tip, hand.slot, runs)):
            for j in range(i + 1):
                try_stretch(
                    Stretch(row, offset * cell, runs[j, 0], runs[i, 1] - 1, tip), maps, side, rules, grip, dropped
                )


@inline
def look_from_the_side(row, maps, side, rules):
    """Fill `side` for a row; the target's material is there already."""
    hand = rules.hand
    begin, stop = 0, hand.columns
    while side.material[begin] <= rules.lowest:
        begin += 1
    while side.material[stop - 1] <= rules.lowest:
        stop -= 1
    thick, finger_rows = len(hand.underside), int(hand.finger / hand.cell + 0.5)
    first, last = max(begin - SCAN, thick), min(stop + SCAN + 1, hand.columns - thick)
    profile(maps.scene, row, finger_rows, (first - thick, last + thick), side.around)
    profile(maps.hidden, row, finger_rows, (first - thick, last + thick), side.shadow)
    finger_floor(side.around, hand.underside, (first, last), side.left, side.right)
    finger_floor(side.shadow, hand.underside, (first, last), side.dark_left, side.dark_right)


@inline
def try_stretch(stretch, maps, side, rules, grip, dropped):
    """Replace `grip` by one of this stretch, if that is possible and costs less."""
    hand, weights, enough = rules.hand, rules.weights, rules.enough
    first, last, tip = stretch.first, stretch.last, stretch.tip
    cell, middle = hand.cell, (first + last + 1) / 2
    width = (last - first) * cell  # between the cells' middles
    depth = end_height(side.material, first, last) - tip
    if width > hand.opening or depth < LEAST_DEPTH * cell:
        dropped[WIDE if width > hand.opening else SHALLOW] += 1
        return
    offset = np.sqrt(((middle - hand.columns / 2) * cell) ** 2 + stretch.b**2)
    cost = weights.shallow * lack(depth, enough.shallow) + weights.wide * width / enough.wide
    cost += weights.offset * (1.0 - lack(offset, enough.offset))
    if cost >= grip.cost:
        return
    left_near, left_far = free_side(side.left, first, -1, tip)
    right_near, right_far = free_side(side.right, last + 1, 1, tip)
    if left_near < 0 or right_near < 0 or (right_near - left_near - 2) * cell > hand.opening:
        dropped[FINGERS] += 1
        return
    spare = min(min(first - left_far, right_far - last - 1) * cell, (hand.opening - width) / 2)
    dark = max(side.dark_left[left_near], side.dark_right[right_near]) - tip
    cost += weights.tight * lack(spare, enough.tight)
    cost += weights.shadow * (1.0 - lack(dark, 1.5 * enough.shadow))
    if cost >= grip.cost:
        return
    if maps.highest > tip + hand.palm and not hand_fits(maps.scene, stretch.row, int(middle), tip, hand):
        dropped[PALM] += 1
        return
    half = hand.columns / 2
    grip.b, grip.tip, grip.cost = stretch.b, tip, cost
    grip.left_near, grip.left_far = (left_near - half) * cell, (left_far - half) * cell
    grip.right_near, grip.right_far = (right_near - half) * cell, (right_far - half) * cell


@inline
def lack(value, enough):
    """How much of `enough` is missing: 0 none, 1 all."""
    return 1.0 - min(max(value, 0.0) / enough, 1.0)
