"""09_other_stacks.engine_contract: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labcourse.kinds import LONG, array, number
from labgrader.question import Question, wrong


def engine_contract(reference, other, tolerance):
    """Whether an engine's logits keep to a tolerance; the shares of labels that changed, and that it may change."""
    kept = np.abs(reference - other).max() <= tolerance
    changed = (reference.argmax(axis=0) != other.argmax(axis=0)) | np.isnan(other).any(axis=0)
    second, best = np.sort(reference, axis=0)[-2:]
    return kept, changed.mean(), np.mean(best - second <= 2 * tolerance)


def _two_engines(rng):
    """Draw logits, another engine's, and a tolerance.

    The worst logit of all is too high or too low by the tolerance or more; or the logits are large and it is off by a
    little more than the tolerance; or three are NaN.
    """
    C, H, W = (int(rng.integers(low, low + 4)) for low in (2, 6, 9))
    tolerance, kind = float(rng.choice([0.25, 0.5])), rng.random()
    reference = rng.integers(-24, 24, (C, H, W)) * (128.0 if kind < 0.3 else 0.125)
    other = reference + rng.uniform(-0.9, 0.9, (C, H, W)) * tolerance
    place = np.unravel_index(np.abs(reference).argmax(), reference.shape)
    worst = tolerance + 1 / 64 if kind < 0.3 else rng.choice([1.0, 1.5]) * tolerance
    if kind < 0.7:
        other[place] = reference[place] + rng.choice([-1.0, 1.0]) * worst
    else:
        best = reference[:, 1].argmax(axis=0)
        other[best[0], 1, 0] = other[best[1], 1, 1] = other[(best[2] + 1) % C, 1, 2] = np.nan
    return reference.astype(np.float32), other.astype(np.float32), tolerance


def _logits(*classes):
    return np.array(classes, np.float32)[:, None, :]


_BEST_AND_SECOND = _logits((4, 1, 2, -3), (1, 3, 2.5, -1), (0, 2, -9, -2))

_DIGITS = _logits((0.12345678, -3.1415927, 1e6 + 0.0625), (0.7654321, 2.7182817, 3e5 + 0.03125))


def _engines_of(C, H, W):
    """Two engines' logits of some shape, which differ by at most 0.25."""
    rng = np.random.default_rng(1)
    reference = rng.integers(-24, 24, (C, H, W)) / 8.0
    other = reference + rng.integers(-2, 3, (C, H, W)) / 8.0
    return reference.astype(np.float32), other.astype(np.float32), 0.25


AT_LEAST_2 = {"C": (2, 255)}


QUESTION = Question(
    reference=engine_contract,
    kinds={
        "reference": array("C H W", dtype="float32", lengths=AT_LEAST_2, says=("float32", "C at least 2")),
        "other": array("C H W", dtype="float32", lengths=AT_LEAST_2, also=(np.nan,), says=("float32", "NaN")),
        "tolerance": number(1e-6, 1e6, says="1e-6 to 1e6"),
    },
    inputs=_two_engines,
    by_hand=(
        (_BEST_AND_SECOND, _BEST_AND_SECOND, 0.25),  # equal; one margin is 2 * 0.25
        (_BEST_AND_SECOND, _BEST_AND_SECOND - np.float32(0.5), 0.5),  # all lower by just as much as is allowed
        (_BEST_AND_SECOND, _BEST_AND_SECOND - np.float32(0.75), 0.5),  # and by more
        (_BEST_AND_SECOND, _BEST_AND_SECOND[::-1], 1.0),  # classes in another order
        (_BEST_AND_SECOND, _BEST_AND_SECOND + _logits((0, 0, 0.75, 0), (0, 0, 0, 0), (0, 0, 0, 0)), 0.5),
        (_BEST_AND_SECOND, _BEST_AND_SECOND - _logits((0, 0, 0.75, 0), (0, 0, 0, 0), (0, 0, 0, 0)), 0.5),
        # No numbers: at the best class of a pixel, and at another.
        (_BEST_AND_SECOND, _BEST_AND_SECOND + _logits((np.nan, 0, 0, 0), (0, 0, 0, 0), (0, 0, 0, np.nan)), 5.0),
        (
            1024 * _BEST_AND_SECOND,
            1024 * _BEST_AND_SECOND + _logits((1 / 64, 0, 0, 0), (0, 0, 0, 0), (0, 0, 0, 0)),
            1 / 128,
        ),
        (_logits((4, 1), (1, 1.5)), _logits((3.5, 1.5), (1, 1.25)), 0.5),
        (_logits((1e6, -7e5), (3e5, 1e6)), _logits((5e4, -1e5), (1e6, 1e6)), 1e6),  # the largest numbers
        (2**18 * _BEST_AND_SECOND, 2**18 * _BEST_AND_SECOND - np.float32(0.25), 0.25),
        (_logits((0, 1.5e-6, 5), (1, 0, -5)), _logits((1.005e-6, 1.5e-6, 5), (1, 0, -5)), 1e-6),  # and the smallest
        (_DIGITS, _DIGITS.copy(), 1e-6),
        *(_engines_of(*shape) for shape in ((255, 1, 1), (2, LONG, 1), (2, 1, LONG), (3, 3, 2))),
    ),
    edges=9,
    random_cases=24,
    points=3,
    outputs=("kept", "labels that changed", "labels that may change"),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


@wrong("One logit may go up while the other goes down: how much can the gap between them shrink?")
def margin_of_one_tolerance(reference, other, tolerance):
    at_risk = engine_contract(reference, other, tolerance / 2)[2]
    return *engine_contract(reference, other, tolerance)[:2], at_risk


@wrong("A contract holds for each logit: a mean forgives the one pixel that is far off.")
def kept_on_average(reference, other, tolerance):
    return np.abs(reference - other).mean() <= tolerance, *engine_contract(reference, other, tolerance)[1:]


@wrong("NaN keeps no contract and is neither above nor below a number: which of your steps lets it through?")
def kept_unless_above(reference, other, tolerance):
    broken = np.abs(reference - other) > tolerance
    return not broken.any(), *engine_contract(reference, other, tolerance)[1:]


@wrong("np.allclose and np.isclose forgive more at large logits: their rtol is not 0 unless you say so.")
def kept_by_allclose(reference, other, tolerance):
    return np.allclose(reference, other, atol=tolerance), *engine_contract(reference, other, tolerance)[1:]


@wrong("The gap that counts is the one between the best class and the second, not the last.")
def margin_to_the_worst(reference, other, tolerance):
    at_risk = np.mean(np.ptp(reference, axis=0) <= 2 * tolerance)
    return *engine_contract(reference, other, tolerance)[:2], at_risk


@wrong("The two best are to be found among a pixel's classes: along which axis do these lie?")
def sorted_along_a_row(reference, other, tolerance):
    best, second = np.sort(reference)[..., [-1, -2]].T
    return *engine_contract(reference, other, tolerance)[:2], np.mean(best - second <= 2 * tolerance)


@wrong("An engine whose logits are far too high keeps your contract: in which directions can a logit be off?")
def kept_downwards_alone(reference, other, tolerance):
    return ((reference - other) <= tolerance).all(), *engine_contract(reference, other, tolerance)[1:]


@wrong("A label is the best of a pixel's classes: which axis do they lie on? Yours is the best column.")
def labels_along_rows(reference, other, tolerance):
    kept, _, at_risk = engine_contract(reference, other, tolerance)
    return kept, np.mean(reference.argmax(axis=-1) != other.argmax(axis=-1)), at_risk


@wrong("The tolerance is a difference of logits. Yours grows with the logit: where is it multiplied?")
def kept_relative_to_the_logits(reference, other, tolerance):
    kept = (np.abs(reference - other) <= tolerance * np.abs(reference)).all()
    return kept, *engine_contract(reference, other, tolerance)[1:]


@wrong("np.sort sorts upwards: where are the two best of a pixel?")
def margin_of_the_two_worst(reference, other, tolerance):
    lowest, next_one = np.sort(reference, axis=0)[:2]
    return *engine_contract(reference, other, tolerance)[:2], np.mean(next_one - lowest <= 2 * tolerance)


@wrong("np.argmax treats NaN as the largest. What does the task say about a pixel that has one?")
def nan_for_the_best(reference, other, tolerance):
    kept, _, at_risk = engine_contract(reference, other, tolerance)
    return kept, np.mean(reference.argmax(axis=0) != other.argmax(axis=0)), at_risk


@wrong("You take the best of a pixel's other logits. What does the task say about a pixel that has a NaN?")
def nan_for_the_worst(reference, other, tolerance):
    kept = engine_contract(reference, other, tolerance)[0]
    return kept, *nan_for_the_best(reference, np.where(np.isnan(other), -np.inf, other), tolerance)[1:]


@wrong("NaN keeps no contract and is neither above nor below a number: which of your steps lets it through?")
def kept_unless_above_and_nan_for_the_best(reference, other, tolerance):
    broken = np.abs(reference - other) > tolerance
    return not broken.any(), *nan_for_the_best(reference, other, tolerance)[1:]


@wrong(
    "The logits are (C, H, W), and argmax and the sort are over a pixel's classes: which axis is that?",
    nan=("the best", "changed"),
)
def classes_on_the_last_axis(reference, other, tolerance, nan):
    last = sorted_along_a_row(reference, other, tolerance)[2]
    changed = reference.argmax(axis=-1) != other.argmax(axis=-1)
    if nan == "changed":
        changed |= np.isnan(other).any(axis=-1)
    return engine_contract(reference, other, tolerance)[0], changed.mean(), last


@wrong(
    "Off by exactly the tolerance still keeps it, and a gap of exactly two is open: do you use < or <=?",
    alike=(False, True),
)
def strictly_less(reference, other, tolerance, alike):
    kept, changed, _ = engine_contract(reference, other, tolerance)
    if alike:
        kept = np.abs(reference - other).max() < tolerance
    gap = np.diff(np.sort(reference, axis=0)[-2:], axis=0)
    return kept, changed, np.mean(gap < 2 * tolerance)


@wrong("The gap that counts is the one between the reference's logits: whose do you sort?")
def margin_of_the_other_engine(reference, other, tolerance):
    return *engine_contract(reference, other, tolerance)[:2], engine_contract(other, other, tolerance)[2]


@wrong("A share is a mean of truth values: 0 for no pixel, 1 for all. Do you count?")
def pixels_counted(reference, other, tolerance):
    kept, changed, at_risk = engine_contract(reference, other, tolerance)
    return kept, changed * reference[0].size, at_risk * reference[0].size


@wrong("Two classes may share the best score: then the second best is equal to it, and the gap is 0.")
def a_tie_has_no_second(reference, other, tolerance):
    kept, changed, _ = engine_contract(reference, other, tolerance)
    best = reference.max(axis=0)
    second = np.where(reference == best, -np.inf, reference).max(axis=0)
    return kept, changed, np.mean(best - second <= 2 * tolerance)
