"""TRW-S, compiled by numba.

It visits the pixels in an order and uses each new message at once, which looks hopelessly sequential. But pixels on
one diagonal of the image do not touch each other. So the image is stored in skewed coordinates: pixel (v, u) is at
diagonal k = u + slant * v and place v on it, with slant 1 for 4 neighbours and 2 for 8. Then every neighbour is on
an earlier or a later diagonal, a diagonal is a contiguous row, and the processor works on many pixels of it at once.

Arrays: unary[k, c, v], weights[k, d, v], messages[d, k, c, v] where (d, k, v) names the pair of a pixel and the one
hop[d] = (diagonals, places) further. There are MARGIN empty diagonals and one empty place on either side.
"""

from typing import NamedTuple

import numpy as np

from labkit.support.compiled import inline, kernel

MARGIN = 3  # the longest hop: right and down among 8 neighbours


class Skew(NamedTuple):
    """How an image W wide is stored by diagonals, and where its pixels' neighbours are then."""

    slant: int
    W: int
    hop: np.ndarray


@kernel
def skewed(image, slant):
    """Store an image (H, W, C) by diagonals: (diagonals, C, places)."""
    H, W, C = image.shape
    out = np.zeros((W + slant * (H - 1) + 2 * MARGIN, C, H + 2), image.dtype)
    for v in range(H):
        for u in range(W):
            for c in range(C):
                out[MARGIN + u + slant * v, c, 1 + v] = image[v, u, c]
    return out


@inline
def straightened(rows, skew):
    """Bring one channel (diagonals, places) back to an image (H, W)."""
    H = rows.shape[1] - 2
    out = np.empty((H, skew.W), rows.dtype)
    for v in range(H):
        for u in range(skew.W):
            out[v, u] = rows[MARGIN + u + skew.slant * v, 1 + v]
    return out


@inline
def places(k, H, skew):
    """Range of places on diagonal k that hold pixels."""
    k -= MARGIN
    return 1 + max(0, -((skew.W - 1 - k) // skew.slant)), 1 + min(H - 1, k // skew.slant) + 1


@inline
def add(total, terms):
    """Add element by element; as all loops below, over pixels that are neighbours in memory."""
    for i in range(len(total)):
        total[i] += terms[i]


@inline
def smaller(least, values):
    """Keep the smaller of each pair of elements."""
    for i in range(len(least)):
        least[i] = min(least[i], values[i])


@kernel
def trws_sweep(unary, weights, messages, skew, shift, pairs_ahead, forward):
    """Send new messages along all pairs, forward or backward; return the lower bound that this proves.

    A pixel's belief h sums its unary cost and the messages to it. It gives an equal share of h to each pair ahead,
    which is a tree's part of the belief; what the pair can still cost at the least is the message on:
    min over j of share(j) - message back(j) + w [j != c], for Potts one minimum over all j, cut off at w above it.
    That minimum goes to the bound. So does what the pixel keeps, with the remainders of the division, at its least.
    """
    hop, D, C, H = skew.hop, len(skew.hop), unary.shape[1], unary.shape[2] - 2
    h, rest = np.empty((C, H), unary.dtype), np.empty((C, H), unary.dtype)
    low, kept = np.empty(H, unary.dtype), np.empty(H, unary.dtype)
    bound = np.int64(0)
    diagonals = unary.shape[0] - 2 * MARGIN
    for i in range(diagonals):
        k = MARGIN + (i if forward else diagonals - 1 - i)
        a, b = places(k, H, skew)
        n = b - a
        if n <= 0:
            continue
        share, ahead = shift[k, a:b], pairs_ahead[k, a:b]
        for c in range(C):
            belief = h[c, :n]
            belief[:] = unary[k, c, a:b]
            for d in range(D):
                add(belief, messages[d, k, c, a:b])
                add(belief, messages[d, k - hop[d, 0], c, a - hop[d, 1] : b - hop[d, 1]])
            divide(belief, share, ahead, rest[c, :n])
            if c == 0:
                kept[:n] = rest[0, :n]
            else:
                smaller(kept[:n], rest[c, :n])
        for j in range(n):
            bound += kept[j]
        for d in range(D):
            row, shifted = (k, 0) if forward else (k - hop[d, 0], hop[d, 1])
            w = weights[row, d, a - shifted : b - shifted]
            for c in range(C):
                subtract(rest[c, :n], h[c, :n], messages[d, row, c, a - shifted : b - shifted])
                if c == 0:
                    low[:n] = rest[0, :n]
                else:
                    smaller(low[:n], rest[c, :n])
            for c in range(C):
                cut_off(messages[d, row, c, a - shifted : b - shifted], rest[c, :n], low[:n], w)
            for j in range(n):
                bound += low[j] if w[j] > 0 else 0
    return bound


@inline
def divide(belief, shift, ahead, rest):
    """Replace a belief by the share of one pair; `rest` is what remains after all pairs ahead took theirs."""
    for i in range(len(belief)):
        share = belief[i] >> shift[i]
        rest[i] = belief[i] - share * ahead[i]
        belief[i] = share


@inline
def subtract(out, x, y):
    """out = x - y."""
    for i in range(len(out)):
        out[i] = x[i] - y[i]


@inline
def cut_off(message, values, low, w):
    """message = min(values - low, w): the distance transform of a Potts term."""
    for i in range(len(message)):
        message[i] = min(values[i] - low[i], w[i])


@kernel
def trws_labels(unary, weights, messages, skew):
    """Read labels off the messages of a backward sweep: each pixel in turn, given the labels already chosen."""
    hop, D, C, H = skew.hop, len(skew.hop), unary.shape[1], unary.shape[2] - 2
    labels = np.zeros((unary.shape[0], H + 2), np.uint8)
    cost, least = np.empty(H, unary.dtype), np.empty(H, unary.dtype)
    for k in range(MARGIN, unary.shape[0] - MARGIN):
        a, b = places(k, H, skew)
        n = b - a
        if n <= 0:
            continue
        for c in range(C):
            cost[:n] = unary[k, c, a:b]
            for d in range(D):
                add(cost[:n], messages[d, k, c, a:b])
                back, first, last = k - hop[d, 0], a - hop[d, 1], b - hop[d, 1]
                add_where_differs(cost[:n], weights[back, d, first:last], labels[back, first:last], c)
            choose(labels[k, a:b], least[:n], cost[:n], c)
    return straightened(labels, skew)


@inline
def add_where_differs(cost, w, labels, c):
    """Charge class c for each pair whose other pixel has another label."""
    for i in range(len(cost)):
        cost[i] += w[i] if labels[i] != c else 0


@inline
def choose(labels, least, cost, c):
    """Take class c where it is the first or the cheapest so far."""
    for i in range(len(labels)):
        if c == 0 or cost[i] < least[i]:
            least[i] = cost[i]
            labels[i] = c


@kernel
def trws_bound(unary, weights, step, nodes, place, iterations, enough):
    """Run the same algorithm on few scattered pixels, one at a time; return the bound on their energy and iterations.

    Arrays are flat with a ring (`integers`); place[n] is where pixel n is in `nodes`, or -1. It ends when the bound
    is `enough`.
    """
    messages = np.zeros((len(nodes), len(step), unary.shape[1]), unary.dtype)
    bound = 0
    for iteration in range(1, iterations + 1):
        for forward in (True, False):
            bound = max(bound, sweep_nodes(unary, weights, step, nodes, place, messages, forward))
        if bound >= enough:
            return bound, iteration
    return bound, iterations


@inline
def sweep_nodes(unary, weights, step, nodes, place, messages, forward):
    """Do what `trws_sweep` does; messages[i, k] comes to pixel nodes[i] from its neighbour k."""
    K, C = len(step), unary.shape[1]
    h = np.empty(C, unary.dtype)
    bound = 0
    for turn in range(len(nodes)):
        i = turn if forward else len(nodes) - 1 - turn
        n = nodes[i]
        for c in range(C):
            h[c] = unary[n, c]
        ahead = behind = 0
        for k in range(K):
            if place[n + step[k]] >= 0:
                ahead += (2 * k < K) == forward
                behind += (2 * k < K) != forward
                for c in range(C):
                    h[c] += messages[i, k, c]
        shift = 0
        while 1 << shift < max(ahead, behind):
            shift += 1
        kept = h[0] - (h[0] >> shift) * ahead
        for c in range(C):
            share = h[c] >> shift
            kept = min(kept, h[c] - share * ahead)
            h[c] = share
        bound += kept
        for k in range(0 if forward else K // 2, K // 2 if forward else K):
            m = n + step[k]
            if place[m] >= 0:
                w = weights[n, k] if forward else weights[m, K - 1 - k]
                low = h[0] - messages[i, k, 0]
                for c in range(1, C):
                    low = min(low, h[c] - messages[i, k, c])
                for c in range(C):
                    messages[place[m], K - 1 - k, c] = min(h[c] - messages[i, k, c] - low, w)
                bound += low
    return bound
