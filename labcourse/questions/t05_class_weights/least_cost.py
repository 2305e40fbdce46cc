"""05_class_weights.least_cost: the question, and wrong answers with the hints that they earn."""

from functools import partial

import numpy as np

from labcourse.kinds import MOST_CLASSES, array, probabilities
from labgrader.question import Question, wrong


def least_cost(q, cost):
    """Decide each pixel for the class of least expected cost; cost[i, j] is paid for saying j where i is true."""
    return (q @ cost).argmin(axis=-1)


def _probabilities_and_costs(rng):
    """Draw probabilities (H, W, C) that are rarely sure, and costs that differ both ways; to be right costs, too."""
    shape = int(rng.integers(5, 8)), int(rng.integers(9, 12)), int(rng.integers(4, 6))
    q = rng.dirichlet(np.full(shape[-1], 1.5), shape[:2])
    cost = np.exp(rng.uniform(-1.0, 2.5, (shape[-1], shape[-1])))
    np.fill_diagonal(cost, rng.uniform(0.0, 2.0, shape[-1]))
    return q, cost


def _any_costs(rng, shape, C, sizes):
    """Draw probabilities of a shape, most of them small and some 0, and costs between two powers of ten."""
    q = rng.dirichlet(np.full(C, 0.3), shape)
    q[q < 1e-4] = 0.0
    cost = 10.0 ** rng.uniform(*sizes, (C, C))
    np.fill_diagonal(cost, cost.diagonal() / 1000.0)
    return q / q.sum(axis=-1, keepdims=True), cost


ANY = ((4, 4, 5, 3), (-4.0, -3.0)), ((40, 4), (5.0, 6.0)), ((100, 6), (-2.0, 6.0)), ((4, MOST_CLASSES), (-4.0, 6.0))
QUESTION = Question(
    reference=least_cost,
    kinds={
        "q": probabilities("... C", says=("probabilities", "sum to 1")),
        "cost": array("C C", 0.0, 1e6, says=("0 to 10 ** 6", "C from 1 to 255")),
    },
    inputs=(_probabilities_and_costs, *(partial(_any_costs, shape=q[:-1], C=q[-1], sizes=sizes) for q, sizes in ANY)),
    random_cases=10,
    by_hand=(
        (np.array([0.6, 0.4]), np.array([[3.0, 1.0], [1.0, 2.0]])),  # 2.2 for saying 0, 1.4 for saying 1
        (np.array([0.8, 0.2]), np.array([[0.0, 1.0], [10.0, 0.0]])),  # 2 for saying 0, 0.8 for saying 1
        (np.array([[0.5, 0.4, 0.1], [0.1, 0.4, 0.5]]), np.array([[0.0, 1.0, 1.0], [1.0, 0.0, 1.0], [1.0, 9.0, 1.0]])),
        (np.array([[0.5, 0.4, 0.1]]), np.array([[0.0, 4.0, 1.0], [1.0, 0.0, 2.0], [8.0, 1.0, 0.0]])),
        (np.array([0.4999, 0.5001]), np.array([[0.0, 16.0], [16.0, 0.0]])),  # nearly a tie
        (np.ones(1), np.array([[3.0]])),
        (np.array([0.95, 0.05]), np.array([[0.0, 1.0], [18.5, 0.0]])),
        (np.array([0.95, 0.05]), np.array([[0.0, 5e4], [1e6, 0.0]])),  # 50,000 for saying 0, 47,500 for saying 1
    ),
    edges=4,
)

# ---------------------------------------------------------------------------------------------------- wrong answers


@wrong("That is the most likely class. Naming it may be the most expensive mistake: where do you use `cost`?")
def most_likely(q, cost):
    return q.argmax(axis=-1)


@wrong("Your cost depends on the true class alone. Here it also depends on the class that is named.")
def one_weight_per_class(q, cost):
    return (q * cost.sum(axis=1)).argmax(axis=-1)


@wrong("You choose the class that costs most.")
def dearest(q, cost):
    return (q @ cost).argmax(axis=-1)


@wrong("To be right may cost something, too: the diagonal of cost need not be 0.")
def right_for_nothing(q, cost):
    return (q @ (cost * (1.0 - np.eye(len(cost))))).argmin(axis=-1)


@wrong("You decide as if the most probable class were certainly the true one. What does it cost if it is not?")
def cheapest_for_the_most_likely(q, cost):
    return cost[q.argmax(axis=-1)].argmin(axis=-1)


@wrong("An expected cost is a sum over the true classes. You take the largest of its terms.")
def least_of_the_worst(q, cost):
    return (q[..., None] * cost).max(axis=-2).argmin(axis=-1)


@wrong("For one j, q[i] cost[i, j] is added up over i: over which index does your sum run?")
def summed_over_what_is_said(q, cost):
    return (q[..., None] * cost).sum(axis=-1).argmin(axis=-1)


@wrong("q[i] multiplies cost[i, j], the row of the true class: do you multiply a column?")
def rows_and_columns_exchanged(q, cost):
    return (q @ cost.T).argmin(axis=-1)


@wrong("That is what the best decision costs. Which class is it?")
def the_least_price(q, cost):
    return (q @ cost).min(axis=-1)


@wrong("The cost of naming j depends on the true class: weight row i of `cost` by q[i], and add up the rows.")
def column_sums(q, cost):
    return np.argmin(cost.sum(axis=0) * (1 - q), axis=-1)
