"""02_crf.terminal_capacities: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.checker.question import Question, holds, wrong
from labkit.course.topics.t02_crf import model


def terminal_capacities(psi):
    """Give the arcs source -> pixel and pixel -> sink for two classes, the source's side being 0, and the constant."""
    lowest = psi.min(axis=2)
    source = psi[..., 1] - lowest
    sink = psi[..., 0] - lowest
    return source, sink, float(lowest.sum())


QUESTION = Question(
    reference=terminal_capacities,
    inputs=lambda rng: (model(rng, 3, 5, 2)[0],),
    by_hand=(
        (np.array([[[2.0, 5.0]]]),),
        (np.array([[[4.0, 1.0], [-1.0, -3.0]]]),),
        (np.array([[[0.5, 0.5]], [[0.0, 2.0]], [[3.0, 1.0]]]),),
    ),
)


@holds("no capacity is negative")
def none_is_negative(psi, out):
    return np.min(out[0]) >= 0.0 and np.min(out[1]) >= 0.0


@holds("one of the two arcs of each pixel has capacity 0")
def one_of_two_is_0(psi, out):
    return np.minimum(out[0], out[1]).max() <= 1e-9


# ---------------------------------------------------------------------------------------------------- wrong answers


@wrong("Try one pixel: on the source's side it has label 0, and which of its two arcs is cut then?")
def source_and_sink_exchanged(psi):
    """A pixel that wants label 0 is bound to the sink."""
    source, sink, constant = terminal_capacities(psi)
    return sink, source, constant


@wrong("Subtract the minimum pixel by pixel, so that one of each pixel's two arcs vanishes.")
def one_minimum_for_all(psi):
    """Right as a cut, but both arcs of a pixel stay."""
    return psi[..., 1] - psi.min(), psi[..., 0] - psi.min(), psi.min() * psi[..., 0].size


@wrong("A negative cost needs no clipping: less the pixel's smaller cost, both of its arcs are 0 or more.")
def negative_costs_clipped(psi):
    return terminal_capacities(np.maximum(psi, 0.0))


@wrong("The smaller cost leaves both arcs: what remains on the other arc is the difference of the two costs.")
def whole_costs_kept(psi):
    dearer = np.where(psi > psi.min(axis=2, keepdims=True), psi, 0.0)
    return dearer[..., 1], dearer[..., 0], psi.min(axis=2).sum()


@wrong("One arc of each pixel has capacity 0: if label 1 costs more, which of its two arcs stays?")
def difference_in_both_arcs(psi):
    difference = np.abs(psi[..., 1] - psi[..., 0])
    return difference, difference, psi.min(axis=2).sum()


@wrong("A pixel pays its smaller cost in any case, whatever its sign: did you take it from both arcs?")
def only_negative_costs_taken(psi):
    return np.maximum(psi[..., 1], 0.0), np.maximum(psi[..., 0], 0.0), np.minimum(psi, 0.0).sum()
