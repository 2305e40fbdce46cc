"""Maximum flow on a pixel grid: the algorithm of Boykov and Kolmogorov (2004) without pointers, compiled by numba.

doi:10.1109/TPAMI.2004.60.

The graph is implicit. A pixel n has an arc to each neighbour n + step[k], and arc k of n returns as arc K - 1 - k of
that neighbour. A ring of pixels without arcs surrounds the image, so that no loop asks where the border is. The two
terminals are not nodes: excess[n] > 0 is what the source can still give to n, -excess[n] > 0 what n can still give
to the sink. Pixels that do not take part have no arcs either, and are in no tree.

Two trees of unsaturated arcs grow from the source and from the sink. Where they touch, flow goes through, some arcs
fill up, and the nodes that hung on them look for another parent in their tree or leave it.
"""

from collections import namedtuple

import numpy as np

from labkit.support.compiled import inline, kernel

FREE, SOURCE, SINK = 0, 1, 2  # which tree a node is in
ROOT, ORPHAN = -1, -2  # a node's parent is one of its arcs, or the terminal itself, or lost
FAR = 1 << 30

# capacity[n, k] and excess[n] are residual: they shrink as flow is sent.
Graph = namedtuple("Graph", "capacity excess step")
# parent[n]: arc to the parent. dist[n]: steps to the terminal, known to be right at time stamp[n].
Forest = namedtuple("Forest", "tree parent dist stamp")
# Nodes that may still grow, first in, first out: a ring buffer, and whether a node is in it.
Queue = namedtuple("Queue", "nodes waiting ends")


def new_forest(size):
    """Make room for the trees of a graph, its queue of active nodes and its orphans; all nodes are in no tree."""
    forest = Forest(
        np.zeros(size, np.int8), np.empty(size, np.int8), np.empty(size, np.int32), np.empty(size, np.int32)
    )
    return (
        forest,
        Queue(np.empty(size, np.int32), np.zeros(size, np.bool_), np.zeros(2, np.int64)),
        np.empty(size, np.int32),
    )


@kernel
def both_ways(weights, step):
    """Give each pair of neighbours an arc of its weight in either direction: capacities (N, K) from weights (N, D)."""
    capacity = np.zeros((len(weights), len(step)), weights.dtype)
    for n in range(step.max(), len(weights) - step.max()):
        for k in range(len(step)):
            capacity[n, k] = weights[n, k] if 2 * k < len(step) else weights[n + step[k], len(step) - 1 - k]
    return capacity


@kernel
def max_flow(graph, forest, active, orphans, nodes, near):
    """Send all the flow that fits and return its value; forest.tree is then SOURCE on that side of a minimum cut.

    Of all minimum cuts it is the one with the fewest nodes on that side. nodes: those that take part. capacity (N, K)
    and excess (N,), integers, are left holding what remains. near: how far flow goes without trees, see `push_nearby`.
    """
    tree, parent, dist, stamp = forest
    flow = 0
    for n in nodes:
        flow += max(graph.excess[n], 0)
    push_nearby(graph, dist, active, nodes, near)
    roots = 0
    for n in nodes:
        flow -= max(graph.excess[n], 0)
        tree[n] = SOURCE if graph.excess[n] > 0 else SINK if graph.excess[n] < 0 else FREE
        parent[n], dist[n], stamp[n] = ROOT, 1, 0
        roots += tree[n] != FREE
    # The source's tree finds every way by growing alone. Where much is free, two trees that grow meet sooner.
    both_grow = 2 * roots < len(nodes)
    for n in nodes:
        if (tree[n] == SOURCE or (both_grow and tree[n] == SINK)) and meets_others(graph, tree, n):
            push(active, n)
    time = 0
    while active.ends[0] != active.ends[1]:
        n = pop(active)
        while tree[n] != FREE:
            bridge = grow(graph, forest, active, n)
            if bridge < 0:
                break
            lost, sent = augment(graph, forest, orphans, n, bridge)
            flow += sent
            time += 1
            adopt(graph, forest, active, orphans, lost, time)
    return flow


@inline
def push_nearby(graph, height, queue, nodes, near):
    """Let all nodes push their excess towards the sink at once (Goldberg and Tarjan 1988): short ways need no trees.

    height: a lower bound on the arcs from a node to the sink. Excess goes to neighbours one lower, and a node that has
    none is lifted. It gives up at the height `near`: the trees find long ways sooner. The queue is left empty.
    """
    capacity, excess, step = graph
    waiting_nodes, waiting, _ = queue
    K, size = len(step), len(waiting_nodes)
    first = last = count = 0
    for n in nodes:
        height[n] = 1 if excess[n] < 0 else 2
        if excess[n] > 0:
            waiting_nodes[last], waiting[n] = n, True
            last += 1
    count = last
    while count > 0:
        n = waiting_nodes[first]
        waiting[n] = False
        first = first + 1 if first + 1 < size else 0
        count -= 1
        below, lowest = height[n] - 1, near
        for k in range(K):
            if capacity[n, k] > 0:
                m = n + step[k]
                if height[m] == below:
                    sent = min(excess[n], capacity[n, k])
                    capacity[n, k] -= sent
                    capacity[m, K - 1 - k] += sent
                    excess[n] -= sent
                    excess[m] += sent
                    if excess[m] > 0 and not waiting[m]:
                        waiting_nodes[last], waiting[m] = m, True
                        last = last + 1 if last + 1 < size else 0
                        count += 1
                    if excess[n] == 0:
                        break
                if capacity[n, k] > 0:
                    lowest = min(lowest, height[m])
        if excess[n] > 0:
            height[n] = lowest + 1
            if height[n] < near:
                waiting_nodes[last], waiting[n] = n, True
                last = last + 1 if last + 1 < size else 0
                count += 1


@inline
def meets_others(graph, tree, n):
    """Say whether a node of a tree can grow at all: amid its own tree it waits until a neighbour gets lost."""
    capacity, _, step = graph
    K = len(step)
    for k in range(K):
        m = n + step[k]
        if tree[m] != tree[n] and (capacity[n, k] if tree[n] == SOURCE else capacity[m, K - 1 - k]) > 0:
            return True
    return False


@inline
def push(queue, n):
    """Append a node unless it waits already."""
    if not queue.waiting[n]:
        queue.waiting[n] = True
        queue.nodes[queue.ends[1]] = n
        queue.ends[1] += 1
        if queue.ends[1] == len(queue.nodes):
            queue.ends[1] = 0


@inline
def pop(queue):
    """Take the node that has waited longest."""
    n = queue.nodes[queue.ends[0]]
    queue.waiting[n] = False
    queue.ends[0] += 1
    if queue.ends[0] == len(queue.nodes):
        queue.ends[0] = 0
    return n


@inline
def grow(graph, forest, active, n):
    """Let node n take free neighbours into its tree; return its arc to the other tree once there is one, or -1."""
    capacity, _, step = graph
    tree, parent, dist, stamp = forest
    K = len(step)
    side = tree[n]
    for k in range(K):
        m = n + step[k]
        if (capacity[n, k] if side == SOURCE else capacity[m, K - 1 - k]) > 0:
            if tree[m] == FREE:
                tree[m], parent[m] = side, K - 1 - k
                dist[m], stamp[m] = dist[n] + 1, stamp[n]
                push(active, m)
            elif tree[m] != side:
                return k
            elif stamp[m] <= stamp[n] and dist[m] > dist[n] + 1:  # a shorter way to the terminal
                parent[m] = K - 1 - k
                dist[m], stamp[m] = dist[n] + 1, stamp[n]
    return -1


@inline
def augment(graph, forest, orphans, n, bridge):
    """Send what fits through the path over arc `bridge` of n; return how many orphans that makes and the flow sent."""
    capacity, excess, step = graph
    tree, parent = forest.tree, forest.parent
    K = len(step)
    if tree[n] == SINK:  # see the bridge from its source side
        n, bridge = n + step[bridge], K - 1 - bridge
    m = n + step[bridge]
    room = capacity[n, bridge]
    i = n
    while parent[i] != ROOT:
        room = min(room, capacity[i + step[parent[i]], K - 1 - parent[i]])
        i += step[parent[i]]
    room = min(room, excess[i])
    i = m
    while parent[i] != ROOT:
        room = min(room, capacity[i, parent[i]])
        i += step[parent[i]]
    room = min(room, -excess[i])

    lost = 0
    capacity[n, bridge] -= room
    capacity[m, K - 1 - bridge] += room
    i = n
    while parent[i] != ROOT:
        k = parent[i]
        above = i + step[k]
        capacity[i, k] += room
        capacity[above, K - 1 - k] -= room
        if capacity[above, K - 1 - k] == 0:
            parent[i] = ORPHAN
            orphans[lost] = i
            lost += 1
        i = above
    excess[i] -= room
    if excess[i] == 0:
        parent[i] = ORPHAN
        orphans[lost] = i
        lost += 1
    i = m
    while parent[i] != ROOT:
        k = parent[i]
        above = i + step[k]
        capacity[above, K - 1 - k] += room
        capacity[i, k] -= room
        if capacity[i, k] == 0:
            parent[i] = ORPHAN
            orphans[lost] = i
            lost += 1
        i = above
    excess[i] += room
    if excess[i] == 0:
        parent[i] = ORPHAN
        orphans[lost] = i
        lost += 1
    return lost, room


@inline
def adopt(graph, forest, active, orphans, lost, time):
    """Find each orphan the parent nearest to its terminal; one without any leaves the tree and orphans its children."""
    capacity, _, step = graph
    tree, parent, dist, stamp = forest
    K = len(step)
    first = 0
    while first < lost:
        n = orphans[first]
        first += 1
        side = tree[n]
        nearest, best = FAR, ORPHAN
        for k in range(K):
            m = n + step[k]
            if tree[m] == side and (capacity[m, K - 1 - k] if side == SOURCE else capacity[n, k]) > 0:
                d = distance_to_terminal(forest, step, m, time)
                if d < nearest:
                    nearest, best = d, k
        parent[n] = best
        if best != ORPHAN:
            dist[n], stamp[n] = nearest + 1, time
            continue
        for k in range(K):
            m = n + step[k]
            if tree[m] == side:
                if (capacity[m, K - 1 - k] if side == SOURCE else capacity[n, k]) > 0:
                    push(active, m)
                if parent[m] == K - 1 - k:
                    parent[m] = ORPHAN
                    orphans[lost] = m
                    lost += 1
        tree[n] = FREE


@inline
def distance_to_terminal(forest, step, n, time):
    """Count the steps from n up to its terminal, FAR if an orphan is in the way; the nodes passed remember theirs."""
    _, parent, dist, stamp = forest
    d = 0
    i = n
    while stamp[i] != time:
        if parent[i] == ORPHAN:
            return FAR
        d += 1
        if parent[i] == ROOT:
            stamp[i], dist[i] = time, 1
            d -= 1
            break
        i += step[parent[i]]
    d += dist[i]
    nearest = d
    i = n
    while stamp[i] != time:
        stamp[i], dist[i] = time, d
        d -= 1
        i += step[parent[i]]
    return nearest
