"""A close look at grips, measured on the points themselves and compiled by numba."""

from typing import NamedTuple

import numpy as np

from labkit.grasp.search_kernels import SLIPPERY, lack
from labkit.support.compiled import inline, kernel

STEEPEST = 0.5  # tangent: between two faces that each lean by more than this to the same side, the target slips out


class Contact(NamedTuple):
    """What a pad meets: length and middle of the patch across the pad, its top over the tips, rise and slope.

    rise: how much the target still rises towards its edge; a face that leans to the camera and ends there has a back
    that nobody saw. slope: how fast the face recedes across the pad, as a tangent.
    """

    patch: float
    middle: float
    top: float
    rise: float
    slope: float


def measure_grips(grips, seen, rules, most, dropped):
    """Measure grips of `search`, the best first, until `most` of them hold; `dropped` counts those that would slip.

    Returns those that hold, with a, opening and cost as measured.
    """
    grips = grips.copy()
    return grips[: measure_in_turn(grips, seen, rules, most, dropped)]


@kernel
def measure_in_turn(grips, seen, rules, most, dropped):
    """Move the grips that hold to the front, until these are `most`; returns how many there are."""
    target, hidden = np.empty_like(seen.target), np.empty_like(seen.hidden)
    n = 0
    for i in range(len(grips)):
        if n == most:
            break
        turn(seen.target, seen.centre, grips[i], target)
        turn(seen.hidden, seen.centre, grips[i], hidden)
        if measure_grip(grips[i], target, hidden, rules, dropped):
            grips[n] = grips[i]
            n += 1
    return n


@inline
def turn(points, centre, grip, out):
    """Coordinates of points along and across the jaws, relative to the target's middle and the grip's row."""
    cos, sin = np.cos(grip.yaw), np.sin(grip.yaw)
    for i in range(len(points)):
        dx, dy = points[i, 0] - centre[0], points[i, 1] - centre[1]
        out[i, 0], out[i, 1], out[i, 2] = dx * cos + dy * sin, dy * cos - dx * sin - grip.b, points[i, 2]


@inline
def measure_grip(grip, T, H, rules, dropped):
    """Write a, opening and cost of a grip into it, given target and hidden points turned to it.

    The cost is the weighted sum of its shortcomings, each from 0 to 1. Says whether the grip fits and would hold.
    """
    hand, weights, enough = rules.hand, rules.weights, rules.enough
    left, right, start, end = jaws(T, grip, hand)
    if not 0.0 < right - left <= hand.opening:
        return False
    at_left, at_right = contact(T, grip.tip, hand, start, -1.0), contact(T, grip.tip, hand, end, 1.0)
    # Where both faces recede to the same side, as at a corner, the jaws squeeze the target out. Two parallel faces
    # recede to opposite sides: they only turn between the jaws.
    if abs(np.arctan(at_left.slope) + np.arctan(at_right.slope)) > 2.0 * np.arctan(STEEPEST):
        dropped[SLIPPERY] += 1
        return False
    dark_left = shadow_height(H, grip.tip, hand.finger, left - hand.thickness, left)
    dark_right = shadow_height(H, grip.tip, hand.finger, right, right + hand.thickness)
    middle = (left + right) / 2
    dark_palm = shadow_height(
        H, grip.tip + hand.palm, hand.palm_half, middle - hand.palm_reach, middle + hand.palm_reach
    )
    offset = np.sqrt(((start + end) / 2) ** 2 + grip.b**2)
    unseen = max(min(dark_left, at_left.rise), min(dark_right, at_right.rise))
    # One term for each of `Shortcomings`.
    cost = weights.shallow * lack(min(at_left.top, at_right.top), enough.shallow)
    cost += weights.wide * (1.0 - lack(end - start, enough.wide))
    cost += weights.tight * lack(min(start - left, right - end), enough.tight)
    cost += weights.offset * (1.0 - lack(offset, enough.offset))
    cost += weights.shadow * (1.0 - lack((dark_left + dark_right) / 2 + dark_palm, enough.shadow))
    cost += weights.short * lack((at_left.patch + at_right.patch) / 2, enough.short)
    cost += weights.skew * (1.0 - lack(abs(at_left.middle - at_right.middle), enough.skew))
    cost += weights.unseen * (1.0 - lack(unseen, enough.unseen))
    grip.a, grip.opening, grip.cost = middle, right - left, cost
    return True


@inline
def jaws(P, grip, hand):
    """Where to open the jaws around what stands between them: left and right pad, left and right edge of the target.

    P: the target along and across the jaws. Both pads stand off equally, by `hand.spare` if there is room; without
    room for `hand.least` the right pad comes out left of the left one.
    """
    start, end = np.inf, -np.inf
    for i in range(len(P)):
        a, b, z = P[i, 0], P[i, 1], P[i, 2]
        if abs(b) <= hand.finger and z > grip.tip and grip.left_near - hand.cell < a < grip.right_near + hand.cell:
            start, end = min(start, a), max(end, a)
    room = min(start - grip.left_far, grip.right_far - end, (hand.opening - (end - start)) / 2)
    if not room >= hand.least:
        return 0.0, -1.0, start, end
    off = min(room, hand.spare)
    return min(grip.left_near, start - off), max(grip.right_near, end + off), start, end


@inline
def contact(P, tip, hand, edge, side):
    """Look at what a pad meets at an edge of the target (side -1 left, 1 right)."""
    low, high, top, inner = np.inf, -np.inf, -np.inf, -np.inf
    outline = np.full(4, np.inf)  # how far inside the edge the target begins: beside the pad, its two halves, beside it
    for i in range(len(P)):
        a, b, z = P[i, 0], P[i, 1], P[i, 2]
        depth = (edge - a) * side
        if z <= tip or abs(b) >= 2 * hand.pad or depth < -2 * hand.pad:
            continue
        half = int(b / hand.pad + 2.0)
        outline[half] = min(outline[half], depth)
        if abs(b) <= hand.pad and 0.0 <= depth <= 3 * hand.cell:
            if depth <= hand.cell:  # the pad touches this too
                low, high, top = min(low, b), max(high, b), max(top, z)
            else:
                inner = max(inner, z)
    slope = slope_beyond(outline[1], outline[2], outline[3]) - slope_beyond(outline[2], outline[1], outline[0])
    if high < low:  # what reaches out furthest passes beside the pad
        return Contact(0.0, side, 0.0, 0.0, slope / hand.pad)
    return Contact(high - low, (low + high) / 2, top - tip, top - max(inner, tip), slope / hand.pad)


@inline
def slope_beyond(inner, outer, beside):
    """How much further out a face gets from one half of a pad to the other, if it goes on so beside the pad; else 0.

    Only then the pad's border rests on an inclined face. inner is infinite where the target has a corner in the pad.
    """
    return max(min(inner - outer, outer - beside), 0.0) if outer < np.inf and beside < np.inf else 0.0


@inline
def shadow_height(P, height, half, low, high):
    """How far unseen things might stand above a height, between two places along the jaws."""
    z = 0.0
    for i in range(len(P)):
        if low < P[i, 0] < high and abs(P[i, 1]) <= half:
            z = max(z, P[i, 2] - height)
    return z
