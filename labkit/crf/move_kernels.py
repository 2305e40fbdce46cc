"""The two-class problems inside moves and inside the proof of persistency, written into a grid's arcs by numba.

Only the pixels `nodes`, those with free[n], take part; the labels of the others stay. Each function fills excess[n]
and all arcs of `nodes`. Arrays are flat with a ring (`integers`); ring pixels have no weights.
"""

import numpy as np

from labkit.support.compiled import inline, kernel

RING = 255


@inline
def pair_weight(weights, n, m, k, K):
    """The weight between pixel n and its neighbour m, the k-th of K, kept at the pixel that counts it forward."""
    return weights[n, k] if 2 * k < K else weights[m, K - 1 - k]


@kernel
def expansion_move(unary, weights, step, labels, free, nodes, alpha, graph):
    """Ask of each pixel: keep your label, or take `alpha` (the source's side)?

    With x = 1 for taking alpha, two pixels of one label disagree if x_p != x_q: an arc both ways. Two pixels of
    different labels disagree unless both take alpha: w (1 - x_p x_q) = w (1 - x_p) + w x_p (1 - x_q), which is a cost
    of keeping p and an arc from p to q. Beside a pixel of label alpha keeping costs w, and beside a pixel that stays
    with the same label taking alpha does.
    """
    K = len(step)
    capacity, excess = graph.capacity, graph.excess
    for n in nodes:
        if labels[n] == alpha:
            excess[n] = 0
            capacity[n] = 0
            continue
        taking = unary[n, alpha] - unary[n, labels[n]]
        for k in range(K):
            m = n + step[k]
            w = pair_weight(weights, n, m, k, K)
            capacity[n, k] = 0
            if w == 0:
                continue
            if not free[m]:
                capacity[m, K - 1 - k] = 0
            if labels[m] == alpha:
                taking -= w
            elif not free[m]:
                taking += w if labels[m] == labels[n] else 0
            elif labels[m] == labels[n]:
                capacity[n, k] = w
            elif 2 * k < K:
                capacity[n, k] = w
                taking -= w
        excess[n] = -taking


@kernel
def persistency_test(unary, weights, step, labels, free, nodes, graph):
    """Ask which pixels keep their label in some best labelling: those beyond the source's side of the cut.

    Let S be any set of pixels that leave their labels. Each pixel of S pays at least its margin, the cost of the
    second-best class above that of its label. Pairs inside S and pairs with free pixels of another label could save w.
    Pairs of S with pixels of the same label that stay cost w. Nothing is saved if no S can pay with less than
    it saves: if all that could be saved flows to pixels with a margin to spare, through pairs of the same label.
    """
    K, C = len(step), unary.shape[1]
    capacity, excess = graph.capacity, graph.excess
    cost = np.empty(C, unary.dtype)
    for n in nodes:
        own = labels[n]
        for c in range(C):
            cost[c] = unary[n, c]
        saved = 0
        for k in range(K):
            m = n + step[k]
            w = pair_weight(weights, n, m, k, K)
            capacity[n, k] = 0
            if w == 0:
                continue
            if not free[m]:
                capacity[m, K - 1 - k] = 0
                cost[labels[m]] -= w
            elif labels[m] == own:
                capacity[n, k] = w
            else:
                saved += w
        second = cost[0] if own > 0 else cost[1]
        for c in range(C):
            if c != own:
                second = min(second, cost[c])
        excess[n] = saved - (second - cost[own])


@kernel
def sources_of(unary, weights, step, labels, free, nodes, graph):
    """Find the sources of `persistency_test`, pixels that would change by themselves, and fill their arcs.

    A source has another class that is cheaper, or a neighbour of another label: only those are tested.
    """
    found, differs = np.empty(len(nodes), np.int32), np.zeros(len(labels), np.bool_)
    ring, count = step.max(), 0
    here, inner = labels[ring:-ring], differs[ring:-ring]
    for k in range(len(step)):
        there = labels[ring + step[k] : len(labels) - ring + step[k]]
        for i in range(len(here)):  # over neighbours in memory: many at a time
            inner[i] |= here[i] != there[i]
    for n in nodes:
        if differs[n] or unary[n, labels[n]] > 0:
            found[count] = n
            count += 1
    persistency_test(unary, weights, step, labels, free, found[:count], graph)
    last = 0
    for i in range(count):
        if graph.excess[found[i]] > 0:
            found[last] = found[i]
            last += 1
    return found[:last]


@kernel
def surroundings(sources, free, step, reach, most):
    """The free pixels within `reach` steps of the sources, those of the last step last, and how many are nearer.

    The number is -1 if there are more than `most`.
    """
    found, seen = np.empty(len(free), np.int32), np.zeros(len(free), np.bool_)
    first, last = 0, len(sources)
    for i in range(last):
        found[i], seen[sources[i]] = sources[i], True
    for _ in range(reach):
        end = last
        for i in range(first, end):
            for k in range(len(step)):
                m = found[i] + step[k]
                if free[m] and not seen[m]:
                    found[last], seen[m] = m, True
                    last += 1
        first = end
        if last > most:
            return found[:last], -1
    return found[:last], first


@kernel
def cheapest(unary):
    """The class of least cost of each pixel (H, W, C), the first one of equals: NumPy's argmin, a third of its time."""
    H, W, C = unary.shape
    labels = np.empty((H, W), np.uint8)
    for v in range(H):
        for u in range(W):
            best = 0
            for c in range(1, C):
                if unary[v, u, c] < unary[v, u, best]:
                    best = c
            labels[v, u] = best
    return labels


@kernel
def fold_fixed(unary, weights, step, labels, free, nodes):
    """Turn what fixed neighbours charge free pixels into unary costs, in place, and cut the pairs with them.

    The least cost of each pixel becomes 0 again: energies fall by a constant.
    """
    K = len(step)
    for n in nodes:
        for k in range(K):
            m = n + step[k]
            row, d = (n, k) if 2 * k < K else (m, K - 1 - k)
            if weights[row, d] > 0 and not free[m]:
                unary[n, labels[m]] -= weights[row, d]
                weights[row, d] = 0
        least = unary[n, 0]
        for c in range(1, unary.shape[1]):
            least = min(least, unary[n, c])
        for c in range(unary.shape[1]):
            unary[n, c] -= least


@kernel
def energy_of(unary, weights, step, labels, nodes):
    """Sum the integer costs of `nodes` and of the pairs that these own."""
    total = 0
    for n in nodes:
        total += unary[n, labels[n]]
        for d in range(weights.shape[1]):
            if labels[n + step[d]] != labels[n]:
                total += weights[n, d]
    return total
