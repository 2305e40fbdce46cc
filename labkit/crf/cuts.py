"""Many classes by a sequence of minimum cuts: expansion and swap moves (Boykov, Veksler and Zabih 2001).

For three classes and more the minimum is NP-hard to find. But the best of exponentially many small changes can be found
by one cut: let every pixel choose between its label and alpha (expansion), or let the pixels of two labels choose
between these (swap). When no move helps any more, the energy is within twice the optimum (expansion, Potts).
"""

from collections.abc import Callable
from functools import partial
from itertools import combinations, cycle

import numpy as np
from jaxtyping import Integer

from labkit.crf.energy import MapResult, PottsCRF
from labkit.crf.exact import grid_steps
from labkit.crf.integers import quantise
from labkit.crf.messages import trws

START_SWEEPS = 4


def expansion(crf: PottsCRF, labels: Integer[np.ndarray, "H W"] | None = None) -> MapResult:
    """Minimise by expansion moves, from `labels` if they are given, until no class can expand.

    Without them it starts from what a few sweeps of TRW-S find: that takes less time than the moves that it saves, and
    ends lower than a start from the unary solution. iterations counts the moves tried. Section 2 of the text.

    >>> psi = np.array([[[0.0, 2.0, 2.0], [1.0, 2.0, 0.8], [0.0, 2.0, 2.0]]])
    >>> expansion(PottsCRF(psi, np.array([[[0.5, 0.5, 0.0]], [[0.0, 0.0, 0.0]]]))).labels
    array([[0, 0, 0]], dtype=uint8)
    """
    moves = MoveGraph(crf, trws(crf, START_SWEEPS).labels if labels is None else labels)
    return try_in_turn(crf, moves, [partial(moves.expand, alpha) for alpha in range(crf.shape[2])])


def swap(crf: PottsCRF, labels: Integer[np.ndarray, "H W"] | None = None) -> MapResult:
    """Minimise by swap moves, from the unary solution or from `labels`, until no two classes can improve by swapping.

    iterations counts the moves tried. Section 2 of the text.
    """
    moves = MoveGraph(crf, labels)
    return try_in_turn(crf, moves, [partial(moves.swap, *pair) for pair in combinations(range(crf.shape[2]), 2)])


def try_in_turn(crf: PottsCRF, graph: "MoveGraph", moves: list[Callable[[], bool]]) -> MapResult:
    """Make the moves in turn until a whole round of them changes nothing; each change lowers the integer energy."""
    tried = unchanged = 0
    for move in cycle(moves):
        unchanged = 0 if move() else unchanged + 1
        tried += 1
        if unchanged == len(moves):
            break
    labels = graph.labels[1:-1, 1:-1].copy()
    return MapResult(labels, crf.energy(labels), iterations=tried)


class MoveGraph:
    """A labelling that moves improve, and the arrays of the graph, which are filled anew for each move.

    All images have a ring of one pixel around them; see `maxflow_kernels`.
    """

    def __init__(self, crf: PottsCRF, labels: Integer[np.ndarray, "H W"] | None):
        from labkit.crf.move_kernels import RING

        H, W, C = crf.shape
        integer = quantise(crf)
        self.step = grid_steps(crf.offsets, W)
        ring = ((1, 1), (1, 1), (0, 0))
        self.unary = np.pad(integer.unary, ring).reshape(-1, C)
        self.weights = np.pad(integer.weights.transpose(1, 2, 0), ring).reshape(len(self.unary), -1)
        self.labels = np.full((H + 2, W + 2), RING, np.uint8)
        self.labels[1:-1, 1:-1] = crf.unary.argmin(axis=2) if labels is None else crf.check_labelling("labels", labels)
        self.capacity = np.empty((len(self.unary), len(self.step)), self.weights.dtype)
        self.excess = np.empty(len(self.unary), self.unary.dtype)

    def expand(self, alpha: int) -> bool:
        """Let every pixel keep its label or take alpha, as is best; return whether any took it.

        The cut with the fewest changes is taken, so that any change at all lowers the energy.
        """
        from labkit.crf.maxflow_kernels import SINK, max_flow
        from labkit.crf.move_kernels import expansion_move

        expansion_move(self.unary, self.weights, self.labels.ravel(), self.step, alpha, self.capacity, self.excess)
        _, tree = max_flow(self.capacity, self.excess, self.step)
        takes = tree.reshape(self.labels.shape) == SINK
        self.labels[takes] = alpha
        return bool(takes.any())

    def swap(self, alpha: int, beta: int) -> bool:
        """Label the pixels of alpha and beta anew with these two, as is best; return whether the energy fell."""
        from labkit.crf.maxflow_kernels import SINK, max_flow
        from labkit.crf.move_kernels import swap_move

        before = swap_move(
            self.unary, self.weights, self.labels.ravel(), self.step, alpha, beta, self.capacity, self.excess
        )
        flow, tree = max_flow(self.capacity, self.excess, self.step)
        if flow == before:
            return False
        takes_part = (self.labels == alpha) | (self.labels == beta)
        self.labels[takes_part] = np.where(tree.reshape(self.labels.shape)[takes_part] == SINK, beta, alpha)
        return True
