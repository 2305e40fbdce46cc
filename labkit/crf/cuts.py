"""Many classes by a sequence of minimum cuts: expansion moves.

Boykov, Veksler and Zabih 2001, "Fast approximate energy minimization via graph cuts", doi:10.1109/34.969114.

For three classes and more the minimum is NP-hard to find. But the best of exponentially many small changes can be found
by one cut: let every pixel choose between its label and alpha. When no class can expand any more, the energy is within
twice the optimum (Potts).
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import cycle

import numpy as np
from jaxtyping import Bool, Integer

from labkit.crf.energy import MapResult, PottsCRF, timed
from labkit.crf.integers import IntegerPotts, inside, pixel_numbers, quantise
from labkit.crf.maxflow_kernels import SOURCE, Graph, max_flow, new_forest
from labkit.crf.messages import _trws
from labkit.crf.move_kernels import RING, expansion_move
from labkit.support.validation import MAX_ITERATIONS, check_whole

START_SWEEPS = 6
# How far flow is pushed on without search trees, in pixels: from a good start the ways are shorter than in one cut.
NEAR = 3


@timed
def expansion(crf: PottsCRF, labels: Integer[np.ndarray, "H W"] | None = None) -> MapResult:
    """Minimise by expansion moves, from `labels` if they are given, until no class can expand (topic 02).

    Without them it starts from what a few sweeps of TRW-S find: that takes less time than the moves that it saves, and
    ends lower than a start from the unary solution. iterations counts the moves tried.

    >>> psi = np.array([[[0.0, 2.0, 2.0], [1.0, 2.0, 0.8], [0.0, 2.0, 2.0]]])
    >>> expansion(PottsCRF(psi, np.array([[[0.5, 0.5, 0.0]], [[0.0, 0.0, 0.0]]]))).labels
    array([[0, 0, 0]], dtype=uint8)
    """
    if labels is not None:
        labels = crf.check_labelling("labels", labels)
    integer = quantise(crf)
    return _expansion(crf, integer, _trws(crf, integer, START_SWEEPS, 0.0).labels if labels is None else labels)


def _expansion(crf: PottsCRF, integer: IntegerPotts, labels: Integer[np.ndarray, "H W"]) -> MapResult:
    moves = Moves(integer, labels)
    tried = moves.expand_all()
    return moves.result(crf, tried)


@timed
def trws_expansion(crf: PottsCRF, iterations: int = 50, tolerance: float = 1e-4) -> MapResult:
    """Let TRW-S find the bound and a start, and expansion moves the rest of the way down.

    TRW-S stops after `iterations`, or once its own gap is below `tolerance`; the moves then shrink it further.
    """
    check_whole("iterations", iterations, 1, MAX_ITERATIONS)
    integer = quantise(crf)
    start = _trws(crf, integer, iterations, tolerance)
    finish = _expansion(crf, integer, start.labels)
    best = min(start, finish, key=lambda result: result.energy)
    return replace(best, lower_bound=start.lower_bound, iterations=start.iterations + finish.iterations)


def try_in_turn(moves: list[Callable[[], bool]]) -> int:
    """Make the moves in turn until none of them changes anything; return how many were tried.

    A move that has just been made finds nothing more to change, so the others alone are tried after it. Each change
    lowers the integer energy, so that this ends.
    """
    tried = unchanged = 0
    for move in cycle(moves):
        unchanged = 1 if move() else unchanged + 1
        tried += 1
        if unchanged == len(moves):
            break
    return tried


class Moves:
    """A labelling that moves improve, and the arrays of the graph, which are filled anew for each move.

    labels: (N,), flat with a ring as in `integers`. free: whether a pixel's label may change. nodes: the free pixels.
    """

    def __init__(self, integer: IntegerPotts, labels: Integer[np.ndarray, "H W"]):
        N, dtype = len(integer.unary), integer.unary.dtype
        self.integer = integer
        self.labels, self.free = np.full(N, RING, np.uint8), np.zeros(N, bool)
        inside(self.labels, integer.size)[:] = labels
        self.nodes = pixel_numbers(integer.size)
        self.free[self.nodes] = True
        self.graph = Graph(np.zeros((N, len(integer.step)), dtype), np.zeros(N, dtype), integer.step)
        self.trees = new_forest(N)

    def result(self, crf: PottsCRF, tried: int) -> MapResult:
        """Return the labels as an image, with their energy."""
        labels = inside(self.labels, self.integer.size).copy()
        return MapResult(labels, crf._energy(labels), iterations=tried)

    def leave_free(self, stays: Bool[np.ndarray, "n"]) -> None:
        """Let only those of the free pixels take part in further moves for which `stays` is true."""
        self.trees[0].tree[self.nodes] = 0
        self.free[self.nodes[~stays]] = False
        self.nodes = self.nodes[stays]

    def expand_all(self) -> int:
        """Let each class expand in turn until none can; return how many moves were tried."""
        return try_in_turn([partial(self.expand, alpha) for alpha in range(self.integer.unary.shape[1])])

    def expand(self, alpha: int) -> bool:
        """Let every free pixel keep its label or take alpha, as is best; return whether any took it.

        The cut with the fewest changes is taken, so that any change at all lowers the energy.
        """
        _, _, tree = self.cut(expansion_move, alpha)
        takes = self.nodes[tree == SOURCE]
        self.labels[takes] = alpha
        return len(takes) > 0

    def cut(self, question: Callable, *classes: int, near: int = NEAR):
        """Put a question of `move_kernels` to the free pixels: what it returns, the flow, and each pixel's tree."""
        integer = self.integer
        answer = question(
            integer.unary, integer.weights, integer.step, self.labels, self.free, self.nodes, *classes, self.graph
        )
        flow = max_flow(self.graph, *self.trees, self.nodes, near)
        return answer, flow, self.trees[0].tree[self.nodes]
