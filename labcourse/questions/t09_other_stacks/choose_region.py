"""09_other_stacks.choose_region: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labcourse.kinds import LONG, array, truth
from labgrader.question import Question, wrong


def choose_region(features, mean, covariance, allowed):
    """Number, from 1, of the allowed piece with the least Mahalanobis distance to the mean; 0 if none is allowed."""
    off = features - mean
    squared = (off @ np.linalg.inv(covariance) * off).sum(axis=1)
    squared[~allowed] = np.inf
    return squared.argmin() + 1 if allowed.any() else 0


def _covariance(rng):
    A = rng.normal(size=(3, 3)) * (3.0, 0.4, 1.0)
    return A.T @ A + np.diag((0.3, 0.02, 0.1))


def _features(rng):
    """Draw pieces that are nearly equally far from the mean, so that any other distance chooses another one.

    In some draws all features are small or large, in some all pieces are far away, and in some no piece is allowed.
    """
    n, unit = int(rng.integers(5, 9)), rng.choice([1.0, 1e-4, 1e6])
    covariance = _covariance(rng) * unit**2
    mean = rng.normal(size=3) * (4.0, 1.0, 2.0) * unit
    off = rng.normal(size=(n, 3))
    off *= rng.uniform(1.0, 1.2, (n, 1)) / np.linalg.norm(off, axis=1, keepdims=True) * rng.choice([1.0, 50.0])
    allowed = rng.random(n) < 0.5
    allowed[rng.integers(n)] = True
    allowed &= rng.random() < 0.8
    return mean + off @ np.linalg.cholesky(covariance).T, mean, covariance, allowed


_LINE = np.array([[2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.9, 1.9, 0.0]])


_TILTED = np.array([[1.0, 0.9, 0.0], [0.9, 1.0, 0.0], [0.0, 0.0, 1.0]])


def _star(mean, scale, first):
    """A piece near the mean, first or last, and others round it on six sides: with any other mean another one is it."""
    off = np.vstack([[[0.1, -0.1, 0.05]], np.diag([1.0, 1.1, 1.2]), np.diag([-1.3, -1.4, -1.5])])
    return mean + scale * off[:: 1 if first else -1], mean, _OBLIQUE * scale**2, np.ones(7, bool)


_OBLIQUE = np.array([[1.0, 0.2, -0.3], [0.2, 1.0, -0.4], [-0.3, -0.4, 1.0]])
# Millimetres, say: of these two covariances and five pieces each entry counts, and so does its sign.
_SPREADS = (
    1e6 * np.array([[9.0, 0.9, -3.0], [0.9, 1.0, -0.8], [-3.0, -0.8, 4.0]]),
    1e6 * np.array([[9.0, -1.2, 3.0], [-1.2, 1.0, 0.6], [3.0, 0.6, 4.0]]),
)
_FIVE = 1e3 * np.array([[4.0, 3.0, -2.0], [3.0, 4.0, -2.0], [-2.0, 0.0, -4.0], [0.0, -2.0, 4.0], [4.0, -2.0, 0.0]])
_VERY_FAR = 1e9 * np.array([[6.8, -6.8, 0.0], [-5.0, 0.0, 0.0], [10.0, 0.0, 0.0], [0.0, -10.0, 1.0]])
_AWAY = np.array([9e6, -9.5e6, 9.7e6])


# The nearest allowed is number 288, which no byte holds; the nearest, 289, is not allowed.
_MANY = (np.abs(np.arange(LONG) - 288.0)[:, None] * (1.0, -0.5, 2.0), np.zeros(3), np.eye(3), np.arange(LONG) < 288)


QUESTION = Question(
    reference=choose_region,
    kinds={
        "features": array("n 3", -1e10, 1e10, says="-1e10 to 1e10"),
        "mean": array("3", -1e7, 1e7, says="-1e7 to 1e7"),
        "covariance": array(
            "3 3", form=lambda rng, _: _covariance(rng) * rng.choice([1e-8, 1.0, 1e12]), says="symmetric and invertible"
        ),
        "allowed": truth("n"),
    },
    inputs=_features,
    by_hand=(
        (_LINE, np.zeros(3), np.eye(3), np.array([True, True, True])),
        (_LINE[:2], np.zeros(3), np.eye(3), np.array([True, True])),
        (_LINE, np.zeros(3), np.diag([9.0, 0.1, 1.0]), np.array([True, True, True])),
        (_LINE, np.zeros(3), _TILTED, np.array([True, True, True])),
        (_LINE, np.zeros(3), np.diag([0.9, 0.3, 1.0]), np.array([True, True, True])),  # the inverse twice: 1, not 2
        (0.01 * _LINE, np.zeros(3), np.diag([1e-4, 2e-5, 1e-4]), np.ones(3, bool)),  # 1, small as all variances are
        (_LINE, np.zeros(3), np.eye(3), np.array([True, False, True])),
        (_LINE, np.zeros(3), np.eye(3), np.array([False, False, False])),
        (_LINE[:1], np.zeros(3), np.eye(3), np.array([True])),
        (_LINE + 1.0, np.ones(3), np.eye(3), np.array([False, False, True])),
        (
            _LINE - _LINE[0],
            np.zeros(3),
            np.diag([1.0, 4.0, 1.0]),
            np.array([False, True, True]),
        ),  # a forbidden one at the mean
        (_VERY_FAR, np.zeros(3), np.eye(3), np.array([True, False, True, True])),  # all very far away
        _MANY,
        *(_star(mean, 1.0, first) for mean in (_AWAY, -_AWAY) for first in (True, False)),
        *((_FIVE, np.zeros(3), spread, np.ones(5, bool)) for spread in _SPREADS),
        _star(np.array([0.0, 1.23e-4, -2.34e-4]), 1e-4, True),
    ),
    edges=9,
    random_cases=24,
    points=3,
    forbidden=("scipy", "sklearn"),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def distances(features, mean, covariance):
    off = features - mean
    return (off @ np.linalg.inv(covariance) * off).sum(axis=1)


def chosen(distance, allowed):
    return 1 + int(np.where(allowed, distance, np.inf).argmin()) if np.any(allowed) else 0


@wrong("Your distance ignores that two features vary together: what is off the diagonal?")
def chosen_by_spread(features, mean, covariance, allowed):
    return chosen(((features - mean) ** 2 / np.diag(covariance)).sum(axis=1), allowed)


@wrong("A piece at the image's edge may not be chosen.")
def chosen_although_forbidden(features, mean, covariance, allowed):
    return chosen(distances(features, mean, covariance), np.ones(len(features), bool)) if allowed.any() else 0


@wrong("In features[allowed] the rows have new numbers. Which number does the piece have in the image of pieces?")
def chosen_among_the_allowed(features, mean, covariance, allowed):
    return 1 + int(distances(features[allowed], mean, covariance).argmin()) if allowed.any() else 0


@wrong("If no piece is allowed, the answer is 0: what is argmin of all inf?")
def chosen_always(features, mean, covariance, allowed):
    return 1 + int(np.where(allowed, distances(features, mean, covariance), np.inf).argmin())


@wrong("The square of (off @ inverse) has the inverse twice: what should it be multiplied by?")
def inverse_twice(features, mean, covariance, allowed):
    squared = (((features - mean) @ np.linalg.inv(covariance)) ** 2).sum(axis=1)
    return chosen(squared, allowed)


@wrong("The diagonal has variances, squares already, and two features vary together: what is off it?")
def divided_by_variances(features, mean, covariance, allowed):
    return chosen((((features - mean) / np.diag(covariance)) ** 2).sum(axis=1), allowed)


@wrong(
    "You add to the diagonal. What does that do to a variance of 0.0001? It is invertible as it is.",
    more=(1e-2, 1e-3, 1e-4, 1e-6),
)
def variances_made_larger(features, mean, covariance, allowed, more):
    return choose_region(features, mean, covariance + more * np.eye(3), allowed)


@wrong("1 / covariance divides entry by entry: is its matrix product with covariance the identity?")
def inverse_entry_by_entry(features, mean, covariance, allowed):
    off = features - mean
    return chosen((off @ (1.0 / (covariance + 1e-12)) * off).sum(axis=1), allowed)


@wrong("off @ inverse @ off.T is n x n: which of its entries is piece i's own distance?")
def first_row_of_all_products(features, mean, covariance, allowed):
    off = features - mean
    return chosen((off @ np.linalg.inv(covariance) @ off.T)[0], allowed)


@wrong("The density is largest where the distance is least: is argmin its best piece?")
def least_density(features, mean, covariance, allowed):
    return chosen(np.exp(-0.5 * distances(features, mean, covariance)), allowed)


@wrong("An allowed piece may be farther away than what you give the others: which number is never less?")
def others_at_1000(features, mean, covariance, allowed):
    squared = np.where(allowed, distances(features, mean, covariance), 1000.0)
    return int(squared.argmin()) + 1 if allowed.any() else 0


@wrong("A spread of 0.1 should count more than one of 10: do you multiply by the covariance, or divide?")
def covariance_without_its_inverse(features, mean, covariance, allowed):
    return chosen(((features - mean) @ covariance * (features - mean)).sum(axis=1), allowed)


@wrong("You give a forbidden piece the distance 0, and it wins: which distance never wins?")
def forbidden_ones_at_the_mean(features, mean, covariance, allowed):
    return 1 + int((distances(features, mean, covariance) * allowed).argmin()) if allowed.any() else 0


@wrong("Yours is the allowed piece farthest from the mean: do you want argmax?")
def farthest(features, mean, covariance, allowed):
    return chosen(-distances(features, mean, covariance), allowed)


@wrong("Row 0 holds piece 1: which number has your best row?")
def row_in_place_of_the_number(features, mean, covariance, allowed):
    return max(choose_region(features, mean, covariance, allowed) - 1, 0)


@wrong("You choose first and then ask whether it is allowed: a worse region that is allowed is never chosen.")
def chosen_before_it_is_allowed(features, mean, covariance, allowed):
    off = features - mean
    k = int(np.argmin((off @ np.linalg.inv(covariance) * off).sum(axis=1)))
    return k + 1 if allowed[k] else 0


@wrong("1 / covariance divides number by number: the inverse matrix is another one.")
def divided_number_by_number(features, mean, covariance, allowed):
    off = features - mean
    with np.errstate(all="ignore"):
        squared = (off @ (1.0 / covariance) * off).sum(axis=1)
    return int(np.where(allowed, squared, np.inf).argmin()) + 1 if allowed.any() else 0
