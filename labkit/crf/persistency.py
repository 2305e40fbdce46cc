"""Labels that are certain: prove for most pixels that a best labelling keeps their label, and solve only the rest.

A network's doubts are local. Where it is sure, one cut proves that no set of pixels can change away from the network's
labels and gain (persistency, also called partial optimality: Kovtun 2003, Shekhovtsov 2014). These pixels are then
fixed, and what they charge their neighbours is a unary cost of those. As some best labelling agrees with all fixed
pixels, a bound for the rest is a bound for the whole image.
"""

from dataclasses import replace

import numpy as np

from labkit.crf.cuts import Moves, trws_expansion
from labkit.crf.energy import MapResult, PottsCRF, timed
from labkit.crf.integers import pixel_numbers, quantise
from labkit.crf.maxflow_kernels import FREE, SOURCE, max_flow
from labkit.crf.message_kernels import trws_bound
from labkit.crf.move_kernels import cheapest, energy_of, fold_fixed, persistency_test, sources_of, surroundings
from labkit.support.validation import MAX_ITERATIONS, check_whole

# If more of the pixels than these shares are left after the first test, or after all, "trws+expansion" solves the image
# as a whole: it takes less time then.
MANY_UNCERTAIN, MANY_LEFT = 0.3, 0.05
# How far flow is pushed on without search trees here: there are few sources, and all else is a sink.
NEAR = 10
# Steps from the sources within which a cut is tried before one of all pixels.
REACHES = (6, 24)


@timed
def persistency(crf: PottsCRF, iterations: int = 100, tolerance: float = 1e-4) -> MapResult:
    """Fix what is certain, label the rest by expansion moves, and let TRW-S prove how good that is (topic 02).

    First each pixel's label of least unary cost is tested; then, for the pixels that fail, one class after the other.
    TRW-S on the pixels that fail all tests stops after `iterations`, or once the gap of the whole image is below
    `tolerance`. An image of which much is uncertain is solved by "trws+expansion". iterations counts cuts and TRW-S's.
    """
    check_whole("iterations", iterations, 1, MAX_ITERATIONS)
    integer = quantise(crf)
    moves = Moves(integer, cheapest(crf.unary))
    pixels = len(moves.nodes)
    fix_certain(moves)
    first, tried = moves.labels.copy(), 1
    if len(moves.nodes) > MANY_UNCERTAIN * pixels:
        return trws_expansion(crf, tolerance=tolerance)
    for alpha in np.argsort(-np.bincount(first[moves.nodes], minlength=crf.shape[2])):
        if len(moves.nodes):
            moves.labels[moves.nodes] = alpha
            fix_certain(moves)
            tried += 1
    if len(moves.nodes) > MANY_LEFT * pixels:
        return trws_expansion(crf, tolerance=tolerance)
    above = 0
    if len(moves.nodes):
        moves.labels[moves.nodes] = first[moves.nodes]
        tried += moves.expand_all()
    everywhere = pixel_numbers(integer.size)
    bound = energy_of(integer.unary, integer.weights, integer.step, moves.labels, everywhere)
    result = moves.result(crf, tried)
    if len(moves.nodes):
        above, more = distance_to_bound(moves, iterations, tolerance * abs(result.energy) * integer.scale)
        result = replace(result, iterations=tried + more)
    return replace(result, lower_bound=integer.lower_bound(bound - above, result.energy))


def fix_certain(moves: Moves, reaches: tuple[int, ...] = REACHES) -> None:
    """Take the free pixels that keep their label in some best labelling out of the moves.

    What may change lies near the pixels that would change by themselves, its sources. So the cut is made among the
    pixels within a few steps of them, the outermost of which are dead ends. If no source can send anything there, no
    source could if all pixels took part: it is the whole image's cut. Otherwise it is made anew, wider.
    """
    problem = moves.integer.unary, moves.integer.weights, moves.integer.step, moves.labels, moves.free
    sources = sources_of(*problem, moves.nodes, moves.graph)
    for reach in reaches:
        near, inner = surroundings(sources, moves.free, moves.integer.step, reach, len(moves.nodes) // 2)
        if inner < 0:
            break
        persistency_test(*problem, near[:inner], moves.graph)
        moves.graph.excess[near[inner:]] = 0
        moves.graph.capacity[near[inner:]] = 0
        max_flow(moves.graph, *moves.trees, near, NEAR)
        tree = moves.trees[0].tree[near]
        moves.trees[0].tree[near] = FREE
        if not (tree[inner:] == SOURCE).any():
            moves.nodes = np.sort(near[tree == SOURCE])
            moves.free[:] = False
            moves.free[moves.nodes] = True
            return
    _, _, tree = moves.cut(persistency_test, near=NEAR)
    moves.leave_free(tree == SOURCE)


def distance_to_bound(moves: Moves, iterations: int, enough: float) -> tuple[int, int]:
    """Bound the error of the labels that are not proven: their energy minus a lower bound, in integer units.

    TRW-S tightens the bound until the difference is at most `enough`, or `iterations` are over. Returns the difference
    and the iterations used. Call it last: it changes `moves.integer` in place.
    """
    integer = moves.integer
    problem = integer.unary, integer.weights, integer.step
    fold_fixed(*problem, moves.labels, moves.free, moves.nodes)
    energy = energy_of(*problem, moves.labels, moves.nodes)
    place = np.full(len(moves.free), -1, np.int32)
    place[moves.nodes] = np.arange(len(moves.nodes))
    bound, tried = trws_bound(*problem, moves.nodes, place, iterations, energy - enough)
    return energy - bound, tried
