"""03_gradient.softmax_backward: the question, and wrong answers with the hints that they earn."""

from functools import partial

import numpy as np

from labcourse.kinds import LONG, MOST_CLASSES, array, probabilities
from labgrader.question import Question, wrong


def softmax_backward(p, g):
    """Carry a gradient back through a softmax: g[k] = dL/dp[k] becomes dL/dz[c] = sum over k of g[k] dp[k]/dz[c]."""
    return p * (g - (p * g).sum(axis=-1, keepdims=True))


def draw(rng, shape=(3, 5), C=4, size=1.0):
    """Draw probabilities (*shape, C) and gradients of their shape and of a size."""
    g = np.clip(size * rng.normal(size=(*shape, C)), -1e6, 1e6)
    return rng.dirichlet(rng.uniform(0.5, 2.0, C), shape or None).reshape(*shape, C), g


QUESTION = Question(
    reference=softmax_backward,
    kinds={"p": probabilities("... C"), "g": array("... C", -1e6, 1e6, says=("of p's shape", "-1e6 to 1e6"))},
    inputs=(
        draw,
        partial(draw, shape=()),
        partial(draw, shape=(LONG,), C=2),
        partial(draw, shape=(3, 3, 4), C=3),
        partial(draw, shape=(2,), C=MOST_CLASSES, size=4e5),
        partial(draw, shape=(3,), C=1),
    ),
    random_cases=12,
    by_hand=(
        (np.array([[0.5, 0.5]]), np.array([[1.0, 0.0]])),
        (np.array([[0.2, 0.3, 0.5]]), np.array([[-1.0, 0.0, 2.0]])),
        (np.array([[[0.0, 1.0], [0.1, 0.9]]]), np.array([[[4.0, -3.0], [4.0, -3.0]]])),
        (np.array([0.5, 0.5]), np.array([1.0, 0.0])),
    ),
    edges=1,
    points=3,
    forbidden=("scipy", "torch"),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


@wrong("Each p depends on every logit: besides dp[c]/dz[c] there are the terms with k other than c.")
def diagonal_only(p, g):
    """Only the case k = c of the derivative."""
    return p * (1.0 - p) * g


@wrong("dp[k]/dz[c] is p[k] (1 - p[c]) only for k = c. What is it for the other k, and with which sign?")
def other_terms_added(p, g):
    """The sign of the terms with k other than c is wrong."""
    return p * (1.0 - p) * g + p * ((p * g).sum(axis=-1, keepdims=True) - p * g)


@wrong("The sum that is subtracted belongs to one pixel: which axis holds the classes?")
def summed_over_everything(p, g):
    """One sum for all pixels."""
    return p * (g - (p * g).sum())


@wrong("The derivative of a softmax by a logit has a factor p[c]: what happens to a class of p = 0?")
def without_the_factor(p, g):
    """The outer p forgotten."""
    return g - (p * g).sum(axis=-1, keepdims=True)


@wrong("You subtract the plain mean of g. In the right mean each class is weighted by its probability.")
def plain_mean(p, g):
    """An unweighted mean of the gradients."""
    return p * (g - g.mean(axis=-1, keepdims=True))


@wrong("For k other than c the derivative dp[k]/dz[c] is -p[k] p[c]: where is the factor p[k]?")
def others_unweighted(p, g):
    """The terms with k other than c lack p[k]."""
    return p * (1.0 - p) * g - p * (g.sum(axis=-1, keepdims=True) - g)


@wrong("For k other than c the derivative dp[k]/dz[c] is -p[k] p[c]: you have p[c] twice and no p[k].")
def others_squared(p, g):
    """The terms with k other than c have p[c] in the place of p[k]."""
    return p * (1.0 - p) * g - p**2 * (g.sum(axis=-1, keepdims=True) - g)


@wrong("p has been through the softmax already: do not put it through another one.")
def softmax_of_p(p, g):
    """p taken for logits."""
    p = np.exp(p) / np.exp(p).sum(axis=-1, keepdims=True)
    return p * (g - (p * g).sum(axis=-1, keepdims=True))


@wrong("You subtract the sum of g. Each class is weighted by its probability: it is the sum of p g.")
def plain_sum(p, g):
    """An unweighted sum of the gradients."""
    return p * (g - g.sum(axis=-1, keepdims=True))


@wrong("p g is one part of it. If all of g rises by 1, the answer must not change: does yours?")
def without_the_mean(p, g):
    return p * g


@wrong("p - Y is softmax and cross-entropy in one. Here any loss may follow, and g is its gradient by p.")
def shortcut_of_the_cross_entropy(p, g):
    return p - g


@wrong("How does p[c] change with its own logit? By p[c] (1 - p[c]); you take p[c].")
def own_logit_without_its_share(p, g):
    return softmax_backward(p, g) + p * p * g


@wrong("Two classes are only one case: what becomes of a third one, or of a class that is alone?")
def two_classes_alone(p, g):
    d = p[..., :1] * p[..., 1:2] * (g[..., :1] - g[..., 1:2])
    return np.concatenate([d, -d, 0.0 * p[..., 2:]], axis=-1)
