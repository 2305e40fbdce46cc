"""A close look at grips: measured on the points themselves, compiled by numba; `labkit.grasp` scores the numbers."""

import numpy as np
from numba import njit

from labkit.grasp.search_kernels import CELL, Grip, search

SKIN = 0.004  # metres: what lies this close behind the outermost point is touched by the pad too


@njit(cache=True, nogil=True)
def measure(grips, target, hidden, centre, hand, spare, least):
    """Measure grips on the points themselves; a row each: a of the hand, opening, and what `labkit.grasp` scores.

    An opening of 0 says that the grip does not fit after all. All in metres.
    """
    x, y = centre
    out = np.zeros((len(grips), 10))
    T, H = np.empty_like(target), np.empty_like(hidden)
    for n in range(len(grips)):
        g = grips[n]
        grip = Grip(g[0], g[1], g[2], g[3], g[4], g[5], g[6])
        turn(target, x, y, grip.yaw, grip.b, T)
        left, right, start, end = jaws(T, grip, hand, spare, least)
        if not 0.0 < right - left <= hand.opening:
            continue
        turn(hidden, x, y, grip.yaw, grip.b, H)
        patch_left, middle_left, top_left, rise_left = contact(T, grip.tip, hand.pad, start, -1)
        patch_right, middle_right, top_right, rise_right = contact(T, grip.tip, hand.pad, end, 1)
        dark_left = shadow_height(H, grip.tip, hand.finger, left - hand.thickness, left)
        dark_right = shadow_height(H, grip.tip, hand.finger, right, right + hand.thickness)
        middle = (left + right) / 2
        palm = (middle - hand.palm_reach, middle + hand.palm_reach)
        dark_palm = shadow_height(H, grip.tip + hand.palm, hand.palm_half, palm[0], palm[1])
        out[n, 0] = middle
        out[n, 1] = right - left
        out[n, 2] = min(top_left, top_right)  # depth
        out[n, 3] = end - start  # width
        out[n, 4] = min(start - left, right - end)  # clearance
        out[n, 5] = np.sqrt(((start + end) / 2) ** 2 + grip.b**2)  # offset
        out[n, 6] = (dark_left + dark_right) / 2 + dark_palm  # shadow
        out[n, 7] = (patch_left + patch_right) / 2  # patch
        out[n, 8] = abs(middle_left - middle_right)  # skew
        out[n, 9] = max(min(dark_left, rise_left), min(dark_right, rise_right))  # unseen
    return out


@njit(cache=True, nogil=True)
def turn(points, x, y, yaw, b, out):
    """Coordinates of points along and across the jaws, relative to (x, y) and to b."""
    cos, sin = np.cos(yaw), np.sin(yaw)
    for i in range(len(points)):
        dx, dy = points[i, 0] - x, points[i, 1] - y
        out[i, 0], out[i, 1], out[i, 2] = dx * cos + dy * sin, dy * cos - dx * sin - b, points[i, 2]


@njit(cache=True, nogil=True)
def jaws(P, grip, hand, spare, least):
    """Where to open the jaws around what stands between them: left and right pad, left and right edge of the target.

    P: the target along and across the jaws. Both pads stand off equally, by `spare` if there is room; without room for
    `least` the right pad comes out left of the left one.
    """
    start, end = np.inf, -np.inf
    for a, b, z in P:
        if abs(b) <= hand.finger and z > grip.tip and grip.left_near - CELL < a < grip.right_near + CELL:
            start, end = min(start, a), max(end, a)
    room = min(start - grip.left_far, grip.right_far - end, (hand.opening - (end - start)) / 2)
    if not room >= least:
        return 0.0, -1.0, start, end
    off = min(room, spare)
    return min(grip.left_near, start - off), max(grip.right_near, end + off), start, end


@njit(cache=True, nogil=True)
def contact(P, tip, half, edge, side):
    """What a pad meets at an edge of the target (side -1 left, 1 right).

    Returns the length of the patch across the pad, its middle, the height of its top over the tips, and how much the
    target still rises towards the edge: a face that leans to the camera and ends there has a back that nobody saw.
    """
    low, high, top, inner = np.inf, -np.inf, -np.inf, -np.inf
    for a, b, z in P:
        depth = (edge - a) * side
        if abs(b) <= half and z > tip and depth >= 0.0:
            if depth <= SKIN:
                low, high, top = min(low, b), max(high, b), max(top, z)
            elif depth <= 3 * SKIN:
                inner = max(inner, z)
    if high < low:  # what reaches out furthest passes beside the pad
        return 0.0, float(side), 0.0, 0.0
    return high - low, (low + high) / 2, top - tip, top - max(inner, tip)


@njit(cache=True, nogil=True)
def shadow_height(P, height, half, low, high):
    """How far unseen things might stand above a height, between two places along the jaws."""
    z = 0.0
    for i in range(len(P)):
        if low < P[i, 0] < high and abs(P[i, 1]) <= half:
            z = max(z, P[i, 2] - height)
    return z


@njit(cache=True, nogil=True)
def find_grips(target, scene, hidden, centre, yaws, lowest, hand, weights, most, spare, least):
    """Search, and measure the `most` best by their rough costs: grips, their measures, and what was dropped and why."""
    grips, costs, dropped = search(target, scene, hidden, centre, yaws, lowest, hand, weights)
    grips = grips[np.argsort(costs, kind="mergesort")[:most]]  # stable: equals stay in their order
    return grips, measure(grips, target, hidden, centre, hand, spare, least), dropped
