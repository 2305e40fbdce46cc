"""02_crf.terminal_capacities: the question, and wrong answers with the hints that they earn."""

from functools import partial

import numpy as np

from labcourse.kinds import LONG, array, number
from labcourse.questions.t02_crf import model
from labgrader.question import Question, holds, wrong


def terminal_capacities(psi, known, large):
    """Give the arcs source -> pixel and pixel -> sink for two classes, the source's side being 0, and the constant."""
    of_0 = np.where(known == 1, psi[..., 1] + large, psi[..., 0])
    of_1 = np.where(known == 0, psi[..., 0] + large, psi[..., 1])
    lowest = np.minimum(of_0, of_1)
    return of_1 - lowest, of_0 - lowest, float(lowest.sum())


def _strokes(rng, shape, size, large):
    """Draw costs of a size, pixels known and unknown, and `large` from a range."""
    known = rng.choice(np.array([0, 1, 255], np.uint8), size=shape, p=(0.3, 0.3, 0.4))
    known[0, 0] = known[-1, -1] = 255
    return model(rng, *shape, 2, size)[0], known, float(rng.uniform(*large))


def _model_with_strokes(rng):
    """Draw costs, and a third of the pixels known, some of them against their cheaper label."""
    known = rng.choice(np.array([0, 1, 255], np.uint8), size=(3, 5), p=(0.2, 0.2, 0.6))
    known[0, :3], known[1, :3] = (0, 1, 255), (1, 0, 255)
    psi = model(rng, 3, 5, 2)[0]
    psi[0, :3], psi[1, :3] = np.sort(psi[0, :3]), np.sort(psi[1, :3])  # label 0 is the cheaper one
    return psi, known, float(rng.choice([50.0, 1000.0]))


QUESTION = Question(
    reference=terminal_capacities,
    kinds={
        "psi": array("H W 2", -1e6, 1e6, says="-1e6 to 1e6"),
        "known": array("H W", 0, 1, also=(255,), dtype="uint8", says=("0 or 1", "255"), free=("8 bits",)),
        "large": number(1.0, 1e6, says=("1 to 1e6", "may differ by more")),
    },
    inputs=(
        _model_with_strokes,
        partial(_strokes, shape=(1, LONG), size=1.0, large=(1.0, 1.1)),
        partial(_strokes, shape=(LONG, 1), size=4e5, large=(1.0, 1e4)),
        partial(_strokes, shape=(4, 4), size=4e5, large=(9.6e5, 1e6)),
    ),
    by_hand=(
        (np.array([[[2.0, 5.0]]]), np.array([[255]], np.uint8), 100.0),
        (np.array([[[4.0, 1.0], [-1.0, -3.0]]]), np.array([[255, 255]], np.uint8), 50.0),
        (np.array([[[2.0, 5.0]], [[1.0, -3.0]]]), np.array([[255], [0]], np.uint8), 100.0),
        (np.array([[[0.5, 0.5], [0.0, 2.0], [3.0, 1.0]]]), np.array([[1, 0, 1]], np.uint8), 80.0),
        (np.array([[[2.0, 5.0], [1.0, -3.0]]]), np.array([[255, 0]], np.uint8), 100.0),
        (np.array([[[-2.0, -5.0], [0.0, 3.0]]]), np.array([[0, 0]], np.uint8), 1.0004),
    ),
    edges=2,
)


@holds("no capacity is negative")
def none_is_negative(psi, known, large, out):
    return np.min(out[0]) >= -1e-9 and np.min(out[1]) >= -1e-9


@holds("one of the two arcs of each pixel has capacity 0")
def one_of_two_is_0(psi, known, large, out):
    return np.minimum(out[0], out[1]).max() <= 1e-9


@holds("the constant is what the pixels pay in any case: a known one its known label's cost, any other the smaller one")
def constant_of_labels(psi, known, large, out):
    return np.isclose(out[2], constant_of(psi, known), rtol=1e-4)


# ---------------------------------------------------------------------------------------------------- wrong answers


def own_cost(psi, known):
    """What each pixel pays in any case."""
    return np.where(known == 0, psi[..., 0], np.where(known == 1, psi[..., 1], psi.min(axis=2)))


def constant_of(psi, known):
    return float(own_cost(psi, known).sum())


def with_strokes(source, sink, known, large):
    """The arcs with those of known pixels put in their place."""
    source = np.where(known == 0, large, np.where(known == 1, 0.0, source))
    return source, np.where(known == 1, large, np.where(known == 0, 0.0, sink))


def swapped(known):
    """Each known label taken for the other one."""
    return np.where(known < 2, 1 - known, known)


def unknown_arcs(psi):
    lowest = psi.min(axis=2)
    return psi[..., 1] - lowest, psi[..., 0] - lowest


@wrong("Try one pixel: on the source's side it has label 0, and which of its two arcs is cut then?")
def source_and_sink_exchanged(psi, known, large):
    """A pixel that wants label 0 is bound to the sink."""
    source, sink, constant = terminal_capacities(psi, known, large)
    return sink, source, constant


@wrong("A pixel known to be 0 must stay on the source's side: which of its arcs must be too expensive to cut?")
def strokes_exchanged(psi, known, large):
    return *with_strokes(*unknown_arcs(psi), swapped(known), large), constant_of(psi, known)


@wrong("A pixel known to be 0 must stay on the source's side: which of its arcs must be too expensive to cut?")
def strokes_exchanged_and_constant_of_the_smaller_costs(psi, known, large):
    return *with_strokes(*unknown_arcs(psi), swapped(known), large), psi.min(axis=2).sum()


@wrong("A pixel known to be 0 must stay on the source's side: which of its arcs must be too expensive to cut?")
def other_label_known(psi, known, large):
    return terminal_capacities(psi, swapped(known), large)


@wrong("The forbidden label costs `large` more than the known one. Yours starts from another cost, so the arc is off.")
def large_on_its_own_cost(psi, known, large):
    off = np.stack([known == 1, known == 0], axis=-1)
    return terminal_capacities(psi + large * off, np.full_like(known, 255), large)


@wrong("The forbidden label costs `large` more than the known one. Yours starts from another cost, so the arc is off.")
def large_in_the_place_of_its_cost(psi, known, large):
    off = np.stack([known == 1, known == 0], axis=-1)
    return terminal_capacities(np.where(off, large, psi), np.full_like(known, 255), large)


@wrong("A known pixel pays its known label's cost, even if that is the higher one: what is in your constant for it?")
def constant_of_the_smaller_costs(psi, known, large):
    return *with_strokes(*unknown_arcs(psi), known, large), psi.min(axis=2).sum()


@wrong("The constant is one number: what all pixels pay in any case, added up.")
def constant_of_each_pixel(psi, known, large):
    return *terminal_capacities(psi, known, large)[:2], own_cost(psi, known)


@wrong("Known pixels cost something, too: their label's psi goes into the constant.")
def constant_without_the_known(psi, known, large):
    constant = psi.min(axis=2)[known == 255].sum()
    return *with_strokes(*unknown_arcs(psi), known, large), constant


@wrong("The pixel's own difference is still in its arcs: one of a known pixel has exactly `large`, the other 0.")
def large_added(psi, known, large):
    source, sink = unknown_arcs(psi)
    return source + large * (known == 0), sink + large * (known == 1), psi.min(axis=2).sum()


@wrong("The pixel's own difference is still in its arcs: one of a known pixel has exactly `large`, the other 0.")
def large_added_right_constant(psi, known, large):
    source, sink = unknown_arcs(psi)
    return source + large * (known == 0), sink + large * (known == 1), constant_of(psi, known)


@wrong("One arc of a known pixel is large; the other still ties it to the wrong side: what must its capacity be?")
def other_arc_kept(psi, known, large):
    source, sink = unknown_arcs(psi)
    arcs = np.where(known == 0, large, source), np.where(known == 1, large, sink)
    return *arcs, constant_of(psi, known)


@wrong("One arc of a known pixel is large; the other still ties it to the wrong side: what must its capacity be?")
def other_arc_and_constant_kept(psi, known, large):
    source, sink = unknown_arcs(psi)
    return np.where(known == 0, large, source), np.where(known == 1, large, sink), psi.min(axis=2).sum()


@wrong("You handle pixels known to have one of the two labels only. `known` may be 0 or 1.", label=(0, 1))
def one_label_known(psi, known, large, label):
    return terminal_capacities(psi, np.where(known == label, known, 255), large)


@wrong("255 says that nothing is known about the pixel: it keeps its own arcs.", label=(0, 1))
def unknown_taken_for_known(psi, known, large, label):
    return terminal_capacities(psi, np.where(known == 255, label, known), large)


@wrong("You treat a pixel with 255 as one that is known to be 1. Is 255 true in a condition?")
def known_as_a_condition(psi, known, large):
    return np.where(known, 0.0, large), np.where(known, large, 0.0), psi.min(axis=2).sum()


@wrong("You treat a pixel with 255 as one that is known to be 1. Is 255 true in a condition?", of=("the min", "labels"))
def arcs_by_a_condition(psi, known, large, of):
    source, sink = unknown_arcs(psi)
    constant = psi.min(axis=2).sum() if of == "the min" else constant_of(psi, known)
    return np.where(known, source, large), np.where(known, large, sink), constant


@wrong("`large` is what a forbidden cut would cost. The allowed label pays its psi, and only that is in the constant.")
def large_in_the_constant(psi, known, large):
    source, sink, constant = terminal_capacities(psi, known, large)
    return source, sink, constant + large * np.count_nonzero(known != 255)


@wrong("Subtract the minimum pixel by pixel, so that one of each pixel's two arcs vanishes.")
def one_minimum_for_all(psi, known, large):
    """Right as a cut, but both arcs of a pixel stay."""
    arcs = with_strokes(psi[..., 1] - psi.min(), psi[..., 0] - psi.min(), known, large)
    return *arcs, psi.min() * psi[..., 0].size


@wrong("A negative cost needs no clipping: once the pixel's smaller cost is subtracted, both arcs are 0 or more.")
def negative_costs_clipped(psi, known, large):
    return terminal_capacities(np.maximum(psi, 0.0), known, large)


@wrong(
    "The smaller cost is subtracted from both arcs: what remains on the other arc is the difference of the two costs."
)
def whole_costs_kept(psi, known, large):
    dearer = np.where(psi > psi.min(axis=2, keepdims=True), psi, 0.0)
    return *with_strokes(dearer[..., 1], dearer[..., 0], known, large), constant_of(psi, known)


@wrong("One arc of each pixel has capacity 0: if label 1 costs more, which of its two arcs remains?")
def difference_in_both_arcs(psi, known, large):
    difference = np.abs(psi[..., 1] - psi[..., 0])
    return *with_strokes(difference, difference, known, large), constant_of(psi, known)


@wrong("A pixel pays its smaller cost in any case, whatever its sign: did you subtract it from both arcs?")
def only_negative_costs_taken(psi, known, large):
    arcs = with_strokes(np.maximum(psi[..., 1], 0.0), np.maximum(psi[..., 0], 0.0), known, large)
    return *arcs, np.minimum(psi, 0.0).sum()
